//! The coupled filter, to be counted: two targets of nine states each, nine pairs of modes, radar and infrared sensor.
//!
//! `radar_scan` predicts and updates, `infrared_scan` updates at the same time; `radar_scan_apart` and `infrared_scan_apart` are the
//! same without the cross covariance. They are exported by these names, for any tool that traces calls. Plots and reference are
//! those of the module `twin::coupled`: the image ends with status 0 if the bits of the result are those of the desk, otherwise
//! with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::coupled::{Coupling, NoCross};
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use twin::coupled::{CHECKSUMS, Kept, Meeting, Memory, NX, Plots, SCANS, checksum, plots};

const _: () = assert!(size_of::<Memory>() <= 12 * 1024 && size_of::<Memory<NoCross>>() <= 8 * 1024, "larger than their budget");

type Step<C> = fn(&Meeting<C>, &mut Memory<C>, usize, &Plots) -> bool;

#[unsafe(no_mangle)]
#[inline(never)]
fn radar_scan(meeting: &Meeting, memory: &mut Memory, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 0, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn infrared_scan(meeting: &Meeting, memory: &mut Memory, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 1, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn radar_scan_apart(meeting: &Meeting<NoCross>, memory: &mut Memory<NoCross>, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 0, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn infrared_scan_apart(meeting: &Meeting<NoCross>, memory: &mut Memory<NoCross>, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 1, k, plots).is_ok()
}

/// All scans; the checksum of the states after them, unless one was refused.
fn follow<C: Coupling<f32, NX>>(memory: &mut Memory<C>, steps: [Step<C>; 2]) -> Option<u32> {
    let meeting = Meeting::new().ok()?;
    let mut sound = meeting.start(memory);
    for k in 1..=SCANS {
        for (sensor, step) in steps.iter().enumerate() {
            sound &= step(&meeting, memory, k, &plots(sensor, k));
        }
    }
    sound.then(|| checksum(memory))
}

#[entry]
fn main() -> ! {
    static mut KEPT: Memory<Kept> = Memory::new();
    static mut APART: Memory<NoCross> = Memory::new();
    let sums = [follow(KEPT, [radar_scan, infrared_scan]), follow(APART, [radar_scan_apart, infrared_scan_apart])];
    exit(sums == CHECKSUMS.map(Some))
}

fn exit(passed: bool) -> ! {
    debug::exit(if passed { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    exit(false)
}
