//! Prints plain text over semihosting and ends with status 0 or 1; needs no defmt decoder.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::hprintln;

#[entry]
fn main() -> ! {
    let passed = core::hint::black_box(1.5_f32) * 2.0 == 3.0;
    hprintln!("selftest: f32 arithmetic {}", if passed { "ok" } else { "FAILED" });
    firmware_example::exit(passed)
}
