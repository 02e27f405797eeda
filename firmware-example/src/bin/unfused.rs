//! The image `fusion` without its fusion: what making the tracks of its sensors and its start-up take of the flash.

#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::fusion::{APART, CROWD, Fusion, Memory};

#[entry]
fn main() -> ! {
    static mut SENSORS: [[Memory; 2]; 2] = [const { [Memory::new(), Memory::new()] }; 2];
    let made = Fusion::new().map(|fusion| {
        for (sensors, case) in SENSORS.iter_mut().zip([APART, CROWD]) {
            fusion.start(sensors, case);
        }
        black_box((&fusion, &SENSORS));
    });
    exit(made.is_ok())
}

firmware_example::silent!();
