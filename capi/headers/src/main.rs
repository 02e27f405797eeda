//! Writes the header of the library, `include/boresight.h`, and the recorded scans of the example in C, `example/recorded.h`.
//!
//! `cargo run -p headers` in `capi/` writes; with `--check` it compares, and fails where they differ.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use twin::data::{PERIOD_MILLIS, SCANS};
use twin::{Label, Sink, radar};

fn main() -> ExitCode {
    let root = &Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let check = std::env::args().nth(1).as_deref() == Some("--check");
    match header(root).and_then(|header| Ok([("include/boresight.h", header), ("example/recorded.h", recorded()?)])) {
        Ok(files) => {
            let stale = files.iter().filter(|(file, text)| {
                let path = root.join(file);
                let current = std::fs::read_to_string(&path).is_ok_and(|old| old == *text);
                if !current && !check && std::fs::write(&path, text).is_ok() {
                    return false;
                }
                if !current {
                    eprintln!("{}: not what the code gives; run `cargo run -p headers` in capi/", path.display());
                }
                !current
            });
            if stale.count() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => {
            eprintln!("headers: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Of the library C sees the parameters alone, so one file of it is enough.
fn header(root: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let mut builder = cbindgen::Builder::new().with_config(cbindgen::Config::from_file(root.join("cbindgen.toml"))?);
    for file in ["../src/ready.rs", "src/lib.rs"] {
        builder = builder.with_src(root.join(file));
    }
    let mut text = Vec::new();
    builder.generate()?.write(&mut text);
    // What documentation in Rust writes otherwise.
    let plain = [("\\[", "["), ("\\]", "]"), ("[`", "`"), ("`]", "`"), ("// # Safety\n", "// Needs:\n")];
    Ok(plain.iter().fold(String::from_utf8(text)?, |text, (rust, c)| text.replace(rust, c)))
}

/// What the joint tracker of the example in Rust tells of every track after every scan.
#[derive(Default)]
struct Told {
    bits: Vec<u32>,
    counts: Vec<u32>,
}

impl Sink for Told {
    fn take(&mut self, label: Label, value: f32) {
        if label.part != "IMM-JPDAF" {
            return;
        }
        self.counts.resize(SCANS.len(), 0);
        if label.field == "identity" {
            self.counts[label.scan] += 1;
        }
        self.bits.push(value.to_bits());
    }
}

fn recorded() -> Result<String, Box<dyn std::error::Error>> {
    let mut told = Told::default();
    radar::run(&mut told, &mut radar::Memory::new()).map_err(|fault| format!("{fault:?}"))?;
    let plots: Vec<[f32; 2]> = SCANS.iter().flat_map(|scan| scan.iter().copied()).collect();
    let mut text = String::from(
        "/* The recorded scans of the example in Rust, and what its tracker tells of every track after each scan: identity, mode\n \
         * probabilities, mean, upper triangle of the covariance. Made by `cargo run -p headers`. */\n#include <stdint.h>\n",
    );
    writeln!(text, "#define PERIOD_US {}u\n#define SCANS {}u", PERIOD_MILLIS * 1000, SCANS.len())?;
    list(&mut text, "uint8_t PLOTS_OF_SCAN", SCANS.iter().map(|scan| scan.len().to_string()))?;
    list(&mut text, "uint8_t TRACKS_OF_SCAN", told.counts.iter().map(u32::to_string))?;
    // A float's shortest decimal form gives the same float back.
    list(&mut text, "float PLOTS[][2]", plots.iter().map(|[range, azimuth]| format!("{{{range:?}f, {azimuth:?}f}}")))?;
    list(&mut text, "uint32_t EXPECTED", told.bits.iter().map(|bits| format!("{bits:#010x}")))?;
    Ok(text)
}

fn list(text: &mut String, name: &str, items: impl Iterator<Item = String>) -> std::fmt::Result {
    let items: Vec<String> = items.collect();
    let name = if name.ends_with(']') { name.into() } else { format!("{name}[]") };
    writeln!(text, "static const {name} = {{")?;
    for line in items.chunks(8) {
        writeln!(text, "    {},", line.join(", "))?;
    }
    writeln!(text, "}};")
}
