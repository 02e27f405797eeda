//! Two lists of sixteen tracks, received, associated and fused, to be counted.
//!
//! What is exported is what counts, by these names, for any tool that traces calls: `receive16` takes in a list, `fuse16_16` makes
//! one picture of two. That is called four times: with tracks that are all new, then with pairs that all stay; and both once more
//! in a crowd, where every track may join every other. Inputs and references are those of the module `twin::fusion`: the image ends
//! with status 0 if the bits of the results are those of the desk, otherwise with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::fusion::{FusionReport, ListError};
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::fusion::{APART, CROWD, Fusion, Memory, Picture};

/// Bytes of a picture of two sensors with sixteen tracks each.
const _: () = assert!(size_of::<Picture>() <= 16 * 1024, "the picture is larger than its budget");

#[unsafe(no_mangle)]
#[inline(never)]
fn receive16(fusion: &Fusion, picture: &mut Picture, number: usize, sensor: &Memory, seconds: u64) -> Result<(), ListError> {
    fusion.send(picture, number, sensor, seconds)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn fuse16_16(fusion: &Fusion, picture: &mut Picture) -> FusionReport {
    fusion.update(picture)
}

#[entry]
fn main() -> ! {
    static mut SENSORS: [[Memory; 2]; 2] = [const { [Memory::new(), Memory::new()] }; 2];
    static mut PICTURES: [Picture; 2] = [Picture::new(), Picture::new()];
    let ([sensors, crowded], [picture, crowd]) = (SENSORS, PICTURES);
    exit(Fusion::new().is_ok_and(|fusion| {
        fusion.pass(sensors, picture, APART, receive16, fuse16_16) && fusion.pass(crowded, crowd, CROWD, receive16, fuse16_16)
    }))
}

firmware_example::silent!();
