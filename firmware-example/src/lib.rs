//! What the images that print share: how they end when they fail.
//!
//! A panic or a fault is reported as plain text on the emulator's standard error
//! (defmt frames own standard output) and ends the emulator with a non-zero status.

#![no_std]

use core::{fmt, panic::PanicInfo};

use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::{debug, heprintln};

/// Ends the emulator: status 0 if `passed`, otherwise 1.
pub fn exit(passed: bool) -> ! {
    debug::exit(if passed { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

fn fail(reason: &dyn fmt::Display) -> ! {
    heprintln!("{}", reason);
    exit(false)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    fail(info)
}

// SAFETY: only prints and ends the emulator; it never returns to the faulting code.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    fail(&format_args!("hard fault at {:#010x}", frame.pc()))
}
