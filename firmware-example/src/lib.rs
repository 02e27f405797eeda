//! What the images share: how they end.
//!
//! An image ends the emulator by [`exit`]. What becomes of a panic or a fault, each says for itself: with [`silent!`] a panic ends it
//! with a non-zero status, and nothing that formats is linked; with [`reporting!`] plain text on the emulator's standard error (defmt
//! frames own standard output) comes first.

#![no_std]

use core::fmt;
use cortex_m_semihosting::{debug, heprintln};

/// Ends the emulator: status 0 if `passed`, otherwise 1.
pub fn exit(passed: bool) -> ! {
    debug::exit(if passed { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// Ends the emulator with status 1 and says why.
pub fn fail(reason: &dyn fmt::Display) -> ! {
    heprintln!("{}", reason);
    exit(false)
}

/// Panics of an image that prints nothing.
#[macro_export]
macro_rules! silent {
    () => {
        #[panic_handler]
        fn panic(_: &core::panic::PanicInfo) -> ! {
            $crate::exit(false)
        }
    };
}

/// Panics and faults of an image that prints.
#[macro_export]
macro_rules! reporting {
    () => {
        #[panic_handler]
        fn panic(info: &core::panic::PanicInfo) -> ! {
            cortex_m::interrupt::disable();
            $crate::fail(info)
        }

        // SAFETY: only prints and ends the emulator; it never returns to the faulting code.
        #[cortex_m_rt::exception]
        unsafe fn HardFault(frame: &cortex_m_rt::ExceptionFrame) -> ! {
            $crate::fail(&format_args!("hard fault at {:#010x}", frame.pc()))
        }
    };
}
