//! The image `fusion` without its fusion: what making the tracks of its sensors and its start-up take of the flash.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
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
