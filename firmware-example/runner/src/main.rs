//! Runs one firmware image in QEMU and ends with the image's exit status.
//!
//! Standard output of an image with a `.defmt` section is decoded frame by frame;
//! that of any other image, and standard error always, pass through unchanged.
//! An image that does not end within the time limit is stopped and counts as failed.

use std::{
    env, fs,
    io::{self, ErrorKind, Read, Write},
    process::{Child, ChildStdout, Command, ExitCode, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use defmt_decoder::{DecodeError, StreamDecoder, Table};

const USAGE: &str = "usage: runner ELF [--timeout SECONDS] [-- QEMU ARGUMENTS]";
const QEMU: &str = "qemu-system-arm";
const MACHINE: &str = "mps2-an386";

struct Args {
    elf: String,
    timeout: Duration,
    qemu_args: Vec<String>,
}

impl Args {
    fn parse(mut args: impl Iterator<Item = String>) -> Result<Self> {
        let mut elf = None;
        let mut timeout = Duration::from_secs(120);
        while let Some(arg) = args.next() {
            match arg.as_str() {
                "--" => break,
                "--timeout" => {
                    let seconds = args.next().context(USAGE)?;
                    timeout = Duration::from_secs(seconds.parse().context(USAGE)?);
                }
                _ if elf.is_none() && !arg.starts_with('-') => elf = Some(arg),
                _ => bail!("unexpected argument `{arg}`\n{USAGE}"),
            }
        }
        Ok(Self { elf: elf.context(USAGE)?, timeout, qemu_args: args.collect() })
    }
}

fn main() -> ExitCode {
    match Args::parse(env::args().skip(1)).and_then(|args| run(&args)) {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("runner: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<u8> {
    let image = fs::read(&args.elf).with_context(|| format!("cannot read {}", args.elf))?;
    let table = Table::parse(&image).context("cannot read the image's defmt table")?;
    let mut output = match &table {
        Some(table) => Output::Defmt(table.new_stream_decoder()),
        None => Output::Text,
    };

    let mut qemu = Qemu::start(args)?;
    let deadline = Instant::now() + args.timeout;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        match qemu.stdout.recv_timeout(left) {
            // An image that never stops printing runs out of time as well.
            Ok(bytes) if !left.is_zero() => output.print(&bytes)?,
            Err(RecvTimeoutError::Disconnected) => break,
            Ok(_) | Err(RecvTimeoutError::Timeout) => {
                let seconds = args.timeout.as_secs();
                bail!("{} did not end within {seconds} s", args.elf)
            }
        }
    }
    let status = qemu.child.wait()?;
    match status.code() {
        Some(code) => Ok(u8::try_from(code).unwrap_or(1)),
        None => bail!("{QEMU} ended abnormally: {status}"),
    }
}

/// The emulator; dropped, it is gone, whatever made us leave.
struct Qemu {
    child: Child,
    stdout: Receiver<Vec<u8>>,
}

impl Qemu {
    fn start(args: &Args) -> Result<Self> {
        let mut child = Command::new(QEMU)
            .args(["-M", MACHINE, "-nographic"])
            // Unused; but left on the terminal, they make standard output non-blocking,
            // and the emulator loses output whenever the pipe is full.
            .args(["-serial", "null", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(["-kernel", &args.elf])
            .args(&args.qemu_args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| match error.kind() {
                ErrorKind::NotFound => anyhow::anyhow!("{QEMU} is not installed (`./ci.sh setup` at the repository root installs it)"),
                _ => anyhow::Error::new(error).context(format!("cannot start {QEMU}")),
            })?;
        let stdout = forward(child.stdout.take().expect("stdout is piped"));
        Ok(Self { child, stdout })
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // Both fail only if the emulator has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads the pipe in a thread, so that the reader can wait with a time limit.
fn forward(mut pipe: ChildStdout) -> Receiver<Vec<u8>> {
    let (sender, receiver) = mpsc::sync_channel(16);
    thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = pipe.read(&mut buffer) {
            if sender.send(buffer[..count].to_vec()).is_err() {
                break;
            }
        }
    });
    receiver
}

enum Output<'t> {
    Defmt(Box<dyn StreamDecoder + Send + Sync + 't>),
    Text,
}

impl Output<'_> {
    fn print(&mut self, bytes: &[u8]) -> Result<()> {
        let mut stdout = io::stdout().lock();
        match self {
            Self::Text => stdout.write_all(bytes)?,
            Self::Defmt(decoder) => {
                decoder.received(bytes);
                loop {
                    match decoder.decode() {
                        Ok(frame) => writeln!(stdout, "{}", frame.display(false))?,
                        Err(DecodeError::UnexpectedEof) => break,
                        Err(DecodeError::Malformed) => {
                            bail!("standard output is not a valid defmt stream")
                        }
                    }
                }
            }
        }
        Ok(stdout.flush()?)
    }
}
