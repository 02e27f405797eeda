//! The coupled filter, to be counted: two targets of nine states each, nine pairs of modes, radar and infrared sensor.
//!
//! `coupled18_first` takes in a scan of the radar, which moves all pairs of modes, `coupled18_second` one of the infrared sensor at
//! the same time; `apart18_first` and `apart18_second` are the same without the cross covariance. They are exported by these names,
//! for any tool that traces calls. Plots and reference are those of the module `twin::coupled`: the image ends with status 0 if the
//! bits of the result are those of the desk, otherwise with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::coupled::{Coupling, NoCross};
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::coupled::{CHECKSUMS, Kept, Meeting, Memory, NX, Plots, SCANS, checksum, plots};

/// Bytes of the states, in this order
#[used]
#[unsafe(no_mangle)]
static STATES: [u32; 2] = [size_of::<Memory>() as u32, size_of::<Memory<NoCross>>() as u32];

const _: () = assert!(size_of::<Memory>() <= 12 * 1024 && size_of::<Memory<NoCross>>() <= 8 * 1024, "larger than their budget");

type Step<C> = fn(&Meeting<C>, &mut Memory<C>, usize, &Plots) -> bool;

#[unsafe(no_mangle)]
#[inline(never)]
fn coupled18_first(meeting: &Meeting, memory: &mut Memory, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 0, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn coupled18_second(meeting: &Meeting, memory: &mut Memory, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 1, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn apart18_first(meeting: &Meeting<NoCross>, memory: &mut Memory<NoCross>, k: usize, plots: &Plots) -> bool {
    meeting.step(memory, 0, k, plots).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn apart18_second(meeting: &Meeting<NoCross>, memory: &mut Memory<NoCross>, k: usize, plots: &Plots) -> bool {
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
    let sums = [follow(KEPT, [coupled18_first, coupled18_second]), follow(APART, [apart18_first, apart18_second])];
    exit(sums == CHECKSUMS.map(Some))
}

firmware_example::silent!();
