//! Computes on the target what the desk has computed, and compares the bits.
//!
//! Ends with status 0 when every value agrees. Otherwise names the first divergence: part, scan, track, field, and both
//! values.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::hprintln;
use twin::{Label, Memory, Sink, data::EXPECTED};

/// Compares values in order and keeps the first that differs.
#[derive(Default)]
struct Comparison {
    taken: usize,
    different: usize,
    first: Option<(Label, u32, u32)>,
}

impl Sink for Comparison {
    fn take(&mut self, label: Label, value: f32) {
        let (here, there) = (value.to_bits(), EXPECTED.get(self.taken).copied());
        self.taken += 1;
        if there != Some(here) {
            self.different += 1;
            self.first.get_or_insert((label, here, there.unwrap_or_default()));
        }
    }
}

#[entry]
fn main() -> ! {
    static mut MEMORY: Memory = Memory::new();
    let mut comparison = Comparison::default();
    let run = twin::run(&mut comparison, MEMORY);
    if let Err(fault) = run {
        hprintln!("selftest: {:?}", fault);
    }
    if let Some((Label { part, scan, track, field }, here, there)) = comparison.first {
        hprintln!("selftest: first divergence in {}, scan {}, track {}, {}", part, scan, track, field);
        hprintln!("    target {:#010x}, desk {:#010x}", here, there);
    }
    let complete = comparison.taken == EXPECTED.len();
    hprintln!("selftest: {} values of {}, {} differ from the desk", comparison.taken, EXPECTED.len(), comparison.different);
    firmware_example::exit(run.is_ok() && complete && comparison.different == 0)
}

firmware_example::reporting!();
