//! Tracks the recorded scans and writes a log of them to standard output, bytes and nothing else:
//!
//! ```text
//! cargo run --release --bin record > scans.log
//! cargo run --release -p host-tests -- replay-log scans.log      # from the repository root
//! ```

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::hio;
use twin::record::{self, MOST, Memory};

#[entry]
fn main() -> ! {
    static mut STATE: Memory = Memory::new();
    static mut BUFFER: [u8; MOST] = [0; MOST];
    let written = hio::hstdout().is_ok_and(|mut out| {
        let mut all = true;
        let done = record::run(STATE, BUFFER, |bytes| all &= out.write_all(bytes).is_ok());
        done.is_ok() && all
    });
    firmware_example::exit(written)
}

firmware_example::reporting!();
