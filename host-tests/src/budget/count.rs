//! Runs an image in QEMU with the plugin that counts.

use super::image::Image;
use crate::{Failure, output};
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const QEMU: &str = "qemu-system-arm";
/// An image that takes longer has hung.
const PATIENCE: Duration = Duration::from_secs(120);

/// The emulated boards. Both have their memory where the images expect it.
#[derive(Debug, Clone, Copy)]
pub enum Board {
    CortexM4,
    CortexM7,
}

/// One call of a counted function, callees included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    pub function: String,
    pub instructions: u64,
    /// Estimated, for a Cortex-M4 without wait states
    pub cycles: u64,
    /// The deepest byte written below the stack pointer at the entry
    pub stack: u64,
}

/// Runs `image` and counts every call of `functions`, in the order of their ends.
pub fn run(counter: &Path, image: &Image, board: Board, functions: &[&str]) -> Result<Vec<Call>, Failure> {
    let counts = count(counter, image, board, functions)?;
    let calls: Option<Vec<Call>> = counts.lines().filter(|line| starts(line).is_none()).map(read).collect();
    calls.filter(|calls| !calls.is_empty()).ok_or_else(|| Failure::input("nothing was counted"))
}

/// Bytes of all functions that the calls of each of `functions` ran.
pub fn code(counter: &Path, image: &Image, functions: &[&str]) -> Result<Vec<u64>, Failure> {
    let counts = count(counter, image, Board::CortexM4, functions)?;
    let bytes = |function: &&str| {
        let (_, starts) = counts.lines().filter_map(starts).find(|(name, _)| name == function)?;
        let starts: Option<Vec<u64>> = starts.split(' ').map(|start| u64::from_str_radix(start.strip_prefix("0x")?, 16).ok()).collect();
        image.functions(&starts?).ok()
    };
    functions.iter().map(|f| bytes(f).ok_or_else(|| Failure::input(format!("{f} has not been called")))).collect()
}

/// What the plugin writes.
fn count(counter: &Path, image: &Image, board: Board, functions: &[&str]) -> Result<String, Failure> {
    let counts = tempfile::NamedTempFile::new().map_err(Failure::input)?;
    let mut plugin = format!("{},out={}", counter.display(), counts.path().display());
    for function in functions {
        plugin += &format!(",call={function}:{:#x}", image.address(function)?);
    }
    let machine = match board {
        Board::CortexM4 => "mps2-an386",
        Board::CortexM7 => "mps2-an500",
    };
    let mut qemu = Command::new(QEMU);
    qemu.args(["-M", machine, "-nographic", "-serial", "null", "-monitor", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native", "-plugin", &plugin, "-kernel"]).arg(image.path());
    let child = qemu.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let complaint = finish(child.map_err(|error| match error.kind() {
        ErrorKind::NotFound => Failure::input(format!("{QEMU} is not installed; ./ci.sh setup installs it")),
        _ => Failure::input(format!("cannot start {QEMU}: {error}")),
    })?)?;
    let text = output::read_text(counts.path())?;
    if text.is_empty() { Err(Failure::input(format!("nothing was counted {complaint}"))) } else { Ok(text) }
}

/// Waits for the emulator, whose status is the image's; what it has said on standard error.
fn finish(mut child: Child) -> Result<String, Failure> {
    let started = Instant::now();
    while child.try_wait().map_err(Failure::input)?.is_none() {
        if started.elapsed() > PATIENCE {
            // Fails only if it has ended just now.
            let _ = child.kill();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let done = child.wait_with_output().map_err(Failure::input)?;
    let complaint = String::from_utf8_lossy(&done.stderr).into_owned();
    match done.status.code() {
        Some(0) => Ok(complaint),
        Some(_) => Err(Failure::check(format!("the image failed its own check {complaint}"))),
        None => Err(Failure::check(format!("the image did not end within {} s", PATIENCE.as_secs()))),
    }
}

/// `NAME code ADDRESS ...`: the name and the addresses.
fn starts(line: &str) -> Option<(&str, &str)> {
    line.split_once(" code ")
}

/// `NAME instructions cycles stack`
fn read(line: &str) -> Option<Call> {
    let mut words = line.split(' ');
    let function = words.next()?.to_owned();
    let mut number = || words.next()?.parse().ok();
    Some(Call { function, instructions: number()?, cycles: number()?, stack: number()? })
}
