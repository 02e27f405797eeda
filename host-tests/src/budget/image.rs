//! Images: built by cargo, read as ELF files.

use crate::Failure;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const FIRMWARE: &str = "firmware-example";
const BUILT: &str = "target/thumbv7em-none-eabihf";
/// What cargo compiles images by: for speed, and for size.
pub const RELEASE: &str = "release";
/// See [`RELEASE`].
pub const SMALL: &str = "small";

/// An image: a copy of its own, which later builds leave alone.
#[derive(Debug)]
pub struct Image {
    content: Vec<u8>,
    file: tempfile::NamedTempFile,
}

impl Image {
    /// The image `name`, as built last for speed.
    pub fn open(root: &Path, name: &str) -> Result<Self, Failure> {
        Self::of_profile(root, RELEASE, name)
    }

    /// The image `name`, as built last by `profile`.
    pub fn of_profile(root: &Path, profile: &str, name: &str) -> Result<Self, Failure> {
        let built = root.join(FIRMWARE).join(BUILT).join(profile).join(name);
        let content = std::fs::read(&built).map_err(|error| Failure::input(error).in_file(&built))?;
        let mut file = tempfile::NamedTempFile::new().map_err(Failure::input)?;
        file.write_all(&content).map_err(|error| Failure::input(error).in_file(file.path()))?;
        Ok(Self { content, file })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The address of the first instruction of `function`.
    pub fn address(&self, function: &str) -> Result<u64, Failure> {
        let elf = self.elf()?;
        // Thumb functions are marked by an odd address.
        Ok(symbol(&elf, function)?.address() & !1)
    }

    /// Bytes of code and constants.
    pub fn flash(&self) -> Result<u64, Failure> {
        let elf = self.elf()?;
        Ok([".text", ".rodata"].iter().filter_map(|name| elf.section_by_name(name)).map(|section| section.size()).sum())
    }

    /// Bytes of the functions that have code at one of `addresses`.
    pub fn functions(&self, addresses: &[u64]) -> Result<u64, Failure> {
        let elf = self.elf()?;
        let texts = elf.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0);
        let sizes: BTreeMap<u64, u64> = texts.map(|symbol| (symbol.address() & !1, symbol.size())).collect();
        let reached = addresses.iter().filter_map(|address| sizes.range(..=address).next_back());
        Ok(reached.collect::<BTreeMap<_, _>>().into_values().sum())
    }

    /// The bytes of the constant `name`.
    pub fn data(&self, name: &str) -> Result<Vec<u8>, Failure> {
        let elf = self.elf()?;
        let symbol = symbol(&elf, name)?;
        let section = symbol.section_index().and_then(|index| elf.section_by_index(index).ok());
        let data = section.and_then(|section| section.data_range(symbol.address(), symbol.size()).ok().flatten());
        data.map(<[u8]>::to_vec).ok_or_else(|| Failure::input(format!("{name} is not in the image")))
    }

    fn elf(&self) -> Result<object::File<'_>, Failure> {
        object::File::parse(self.content.as_slice()).map_err(Failure::input)
    }
}

fn symbol<'a>(elf: &'a object::File<'a>, name: &str) -> Result<object::Symbol<'a, 'a>, Failure> {
    elf.symbol_by_name(name).ok_or_else(|| Failure::input(format!("the image has no {name}")))
}

/// Builds images of the firmware example by `profile`, with `variables` in the environment.
pub fn build(root: &Path, profile: &str, names: &[&str], variables: &[(&str, String)]) -> Result<(), Failure> {
    let mut cargo = cargo(&root.join(FIRMWARE), profile);
    cargo.envs(variables.iter().map(|(name, value)| (name, value)));
    finish(cargo.args(names.iter().flat_map(|name| ["--bin", name])))
}

/// Builds the plugin that counts; where it is.
pub fn build_counter(root: &Path) -> Result<PathBuf, Failure> {
    // From the root, where no configuration names the microcontroller as the target.
    finish(cargo(root, RELEASE).args(["--manifest-path", "firmware-example/counter/Cargo.toml"]))?;
    let built = root.join(FIRMWARE).join("counter/target/release/libcounter.so");
    std::path::absolute(&built).map_err(|error| Failure::input(error).in_file(&built))
}

/// What compiles the images.
pub fn compiler(root: &Path) -> Result<String, Failure> {
    let said = Command::new("rustc").arg("--version").current_dir(root.join(FIRMWARE)).output();
    let said = said.map_err(|error| Failure::input(format!("cannot run rustc: {error}")))?;
    Ok(String::from_utf8_lossy(&said.stdout).trim().to_owned())
}

/// `cargo build` by a profile in a directory, into the default place and with the flags of that place.
fn cargo(directory: &Path, profile: &str) -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    for variable in ["CARGO_TARGET_DIR", "CARGO_BUILD_TARGET", "RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"] {
        cargo.env_remove(variable);
    }
    cargo.current_dir(directory).args(["build", "--profile", profile, "--quiet"]);
    cargo
}

fn finish(cargo: &mut Command) -> Result<(), Failure> {
    let done = cargo.stdin(Stdio::null()).output().map_err(|error| Failure::input(format!("cannot run cargo: {error}")))?;
    if done.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&done.stderr);
    let reason = text.lines().find(|line| line.starts_with("error")).unwrap_or("for no stated reason");
    Err(Failure::input(format!("cargo build failed: {reason}")))
}
