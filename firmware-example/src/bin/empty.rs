//! The image `tracker` without its tracker: what its scans and its start-up take of the flash.

#![no_std]
#![no_main]

use boresight::scan::Scan;
use boresight::time::Instant;
use core::hint::black_box;
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::load::{self, Room, Subject};

struct Nothing;

impl Subject for Nothing {
    fn crowd(&mut self, at: Instant) {
        black_box(at);
    }

    fn step(&mut self, scan: &Scan<'_, f32, 2>) -> bool {
        black_box(scan.detections.len()) <= load::MOST
    }

    fn confirmed(&self) -> usize {
        black_box(load::MOST)
    }
}

#[entry]
fn main() -> ! {
    exit(load::run(&mut Nothing, Room { tracks: 16, detections: 32 }))
}

firmware_example::silent!();
