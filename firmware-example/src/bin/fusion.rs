//! Two lists of sixteen tracks, associated and fused, to be counted.
//!
//! `fuse16_16` is exported by this name, for any tool that traces calls; it is called twice: with tracks that are all new, then
//! with pairs that all stay. Inputs and reference are those of the module `twin::fusion`: the image ends with status 0 if the
//! bits of the result are those of the desk, otherwise with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::fusion::FusionReport;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use twin::fusion::{CHECKSUM, Fusion, Memory, Picture, TRACKS, checksum};

#[unsafe(no_mangle)]
#[inline(never)]
fn fuse16_16(fusion: &Fusion, picture: &mut Picture) -> FusionReport {
    fusion.update(picture)
}

#[entry]
fn main() -> ! {
    static mut SENSORS: [Memory; 2] = [Memory::new(), Memory::new()];
    static mut PICTURE: Picture = Picture::new();
    let passed = Fusion::new().is_ok_and(|fusion| {
        fusion.start(SENSORS);
        let sent = fusion.send(PICTURE, SENSORS, 1).is_ok();
        let first = fuse16_16(&fusion, PICTURE);
        let sent = sent && fusion.send(PICTURE, SENSORS, 2).is_ok();
        let second = fuse16_16(&fusion, PICTURE);
        let all = |report: FusionReport| usize::from(report.tracks) == TRACKS && report.is_complete();
        sent && all(first) && all(second) && usize::from(first.joined) == TRACKS && second.joined == 0 && checksum(PICTURE) == CHECKSUM
    });
    exit(passed)
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
