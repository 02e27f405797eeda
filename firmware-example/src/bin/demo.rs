//! Logs through defmt; `cargo run --release --bin demo` decodes the frames.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt_semihosting as _;

#[entry]
fn main() -> ! {
    defmt::info!("demo: defmt over semihosting works");
    firmware_example::exit(true)
}
