//! √x in single precision: by the instruction where there is one, by `libm` elsewhere. The only file with `unsafe` code.
//!
//! IEEE 754 asks for the correctly rounded root, so both give the same bits (for x ≥ 0 and NaN in, NaN out).
//!
//! # Why
//! Core has no square root on stable Rust, and `libm` finds it bit by bit on ARM: 60 estimated cycles a call on a
//! Cortex-M4F, against 14 for `vsqrt.f32` and four for moving the number there and back. A radar predicts its measurement
//! by two roots, sigma points of nine states by 48. Cycles of the image `kernels` at opt-level 3:
//!
//! ```text
//!                                                                   libm    here
//! ekf2_update_4   range and azimuth of 4 states                      936     842   -10 %
//! ekf4_update_9   range, azimuth, elevation, range-rate of 9        4182    4088    -2 %
//! ukf4_update_9   the same by sigma points                         26150   23684    -9 %
//! convert_polar   to Cartesian coordinates, debiased                 547     427   -22 %
//! ```
//!
//! # Why it is sound
//! The block reads one general register and writes one, uses s0, which it declares, and touches neither memory nor stack. The
//! ABI `eabihf` passes floating-point numbers in the registers of the unit, so every target that has it has the instruction.
//! Registers of the unit cannot be named as operands here, as their target feature is not stable; clobbering them can.

/// √x, correctly rounded; NaN below zero.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[expect(unsafe_code, reason = "one instruction that stable Rust does not offer otherwise")]
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    let root: u32;
    // SAFETY: pure arithmetic in registers; see the head of this file.
    unsafe {
        core::arch::asm!(
            "vmov s0, {x}",
            "vsqrt.f32 s0, s0",
            "vmov {x}, s0",
            x = inout(reg) x.to_bits() => root,
            out("s0") _,
            options(pure, nomem, nostack),
        );
    }
    f32::from_bits(root)
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
pub use libm::sqrtf as sqrt;
