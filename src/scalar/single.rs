//! Single precision: nothing but its additions, multiplications, divisions and roots.
//!
//! ```text
//! exp    x = k ln 2 + r, |r| ≤ ½ ln 2,  e^x = 2^k (1 + r + r² p(r))     p of degree 3, minimax
//! 2^x    x = k + f, |f| ≤ ½,            2^x = 2^k (1 + f ln 2 + f² p(f)) p of degree 3, minimax
//! ln     x = 2^k (1 + f), √½ ≤ 1 + f < √2,  ln x = k ln 2 + f − f²/2 + f³ p(f)         p of degree 6
//! sin    x = k π/2 + r, |r| ≤ π/4,      sin r = r + r³ p(r²)            p of degree 2, minimax
//! cos                                    cos r = 1 − r²/2 + r⁴ p(r²)
//! atan2  k π/4 ± a, |a| ≤ π/8, t = tan a,  a = t + t³ p(t²)            p of degree 3, minimax
//! ```
//!
//! The coefficients are our own fits; every function is held to its error by the tests of this file.

use super::{Real, sealed, square_root};
use core::hint::cold_path;

/// The bits of √½ in single precision.
const ROOT_HALF: u32 = 0x3f35_04f3;

/// tan π/8
const TAN_PI_8: f32 = 0.414_213_57;

/// Adding and subtracting 1.5 · 2²³ rounds a single-precision number of magnitude below 2²² to an integer, ties to even.
const ROUND: f32 = 12_582_912.0;

impl sealed::Math for f32 {
    #[inline(always)]
    fn exp(self) -> f32 {
        // Ordered so that NaN falls through to the polynomial and stays NaN.
        if self < <f32 as Real>::LN_FLOOR {
            return 0.0;
        }
        if self > 88.72 {
            return f32::INFINITY;
        }
        let shifted = self * core::f32::consts::LOG2_E + ROUND;
        let k = shifted - ROUND;
        // ln 2 in two parts, the first short enough that k times it is exact.
        let r = (self - k * 0.693_359_4) + k * 2.121_944_4e-4;
        let p = ((8.312_52e-3 * r + 4.189_015_7e-2) * r + 1.666_711_5e-1) * r + 4.999_923e-1;
        let m = (r * r) * p + r + 1.0;
        // 2^k in two factors, since k reaches 128.
        let scale = f32::from_bits((shifted.to_bits().wrapping_add(126) << 23) & 0x7f80_0000);
        m * scale * 2.0
    }
    #[inline(always)]
    fn exp2(self) -> f32 {
        if self.abs() < 126.0 {
            let shifted = self + ROUND;
            let f = self + (ROUND - shifted);
            // In two chains: no result is used at once.
            let z = f * f;
            let (high, low) = (1.330_060_5e-3 * f + 9.669_691e-3, 5.550_558_5e-2 * f + 2.402_228_3e-1);
            let p = (core::f32::consts::LN_2 * f + 1.0) + z * (high * z + low);
            // k into the exponent.
            f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23))
        } else {
            cold_path();
            if self < 0.0 { 0.0 } else { self * f32::INFINITY }
        }
    }
    #[inline(always)]
    fn ln(self) -> f32 {
        if !(self > 0.0 && self < f32::INFINITY) {
            return match self {
                0.0 => f32::NEG_INFINITY,
                f32::INFINITY => f32::INFINITY,
                _ => f32::NAN,
            };
        }
        let (x, shift) = if self < f32::MIN_POSITIVE { (self * 16_777_216.0, 24.0) } else { (self, 0.0) };
        // The bits of √½ taken off, the exponent field is k, and the rest belongs to m in [√½, √2).
        let bits = x.to_bits().wrapping_sub(ROOT_HALF);
        let k = ((bits as i32) >> 23) as f32 - shift;
        let f = f32::from_bits((bits & 0x007f_ffff).wrapping_add(ROOT_HALF)) - 1.0;
        let z = f * f;
        let p = (((((8.711_366e-2 * f - 1.428_409e-1) * f + 1.491_841_7e-1) * f - 1.657_583e-1) * f + 1.996_259_5e-1) * f - 2.500_138e-1)
            * f
            + 3.333_392e-1;
        ((f * z * p - k * 2.121_944_4e-4) - 0.5 * z) + f + k * 0.693_359_4
    }
    #[inline(always)]
    fn sqrt(self) -> f32 {
        square_root::sqrt(self)
    }
    #[inline(always)]
    fn invertible(self) -> bool {
        // Positive, with an exponent of −126 to 125: one comparison.
        self.to_bits().wrapping_sub(f32::MIN_POSITIVE.to_bits()) < 252 << 23
    }
    #[inline(always)]
    fn plus_zero(self) -> bool {
        self.to_bits() == 0
    }
    #[inline]
    fn sin_cos(self) -> (f32, f32) {
        // Beyond, neighbouring numbers are a hundredth of a radian apart: no answer is right.
        if !(-1e5..=1e5).contains(&self) {
            return (f32::NAN, f32::NAN);
        }
        let shifted = self * core::f32::consts::FRAC_2_PI + ROUND;
        let k = shifted - ROUND;
        // π/2 in three parts: exact products for |k| < 2¹¹.
        let r = ((self - k * 1.570_312_5) - k * 4.837_513e-4) - k * 7.549_79e-8;
        let z = r * r;
        let s = r + r * z * ((-1.951_495_8e-4 * z + 8.332_158e-3) * z - 1.666_665_5e-1);
        let c = 1.0 - 0.5 * z + z * z * ((2.443_278_5e-5 * z - 1.388_731_3e-3) * z + 4.166_664_6e-2);
        match shifted.to_bits() & 3 {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        }
    }
    #[inline(never)]
    fn atan2(self, x: f32) -> f32 {
        // The angle is k π/4 ± a, from the nearest of the axes and diagonals; from a diagonal tan a = (low − high) / (low + high).
        let (along, across, back) = (x.abs(), self.abs(), x.is_sign_negative());
        let steep = across > along;
        let (low, high) = if steep { (along, across) } else { (across, along) };
        let (n, d, k) = if low > TAN_PI_8 * high { (low - high, low + high, 1.0) } else { (low, high, 0.0) };
        let k = if steep { 2.0 - k } else { k };
        let k = if back { 4.0 - k } else { k };
        let t = if d == 0.0 { n } else { n / d };
        let z = t * t;
        let p = ((8.053_744e-2 * z - 1.387_768_6e-1) * z + 1.997_771e-1) * z - 3.333_295e-1;
        let a = t + (t * z) * p;
        let a = if steep == back { a } else { -a };
        // π/4 in two parts, the first short enough that k times it is exact.
        let angle = k * 0.785_156_25 + (k * 2.419_134e-4 + a);
        angle.copysign(self)
    }
    #[inline(always)]
    fn erf(self) -> f32 {
        libm::erff(self)
    }
    #[inline(always)]
    fn round(self) -> f32 {
        libm::rintf(self)
    }
}

impl Real for f32 {
    const ZERO: f32 = 0.0;
    const ONE: f32 = 1.0;
    const PI: f32 = core::f32::consts::PI;
    const LN_FLOOR: f32 = -86.9;
    const EPSILON: f32 = f32::EPSILON;
    const LEAST: f32 = f32::MIN_POSITIVE;
    #[inline(always)]
    fn lit(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn from_count(n: usize) -> f32 {
        n as f32
    }
    #[inline]
    fn from_micros(us: i64) -> f32 {
        // Spans below 35 minutes take one instruction, others a routine; both round correctly.
        let us = if let Ok(us) = i32::try_from(us) { us as f32 } else { us as f32 };
        us / 1e6
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::{atan2, exp, exp2, ln, sin_cos};

    #[test]
    fn single_precision_exp_is_good_to_a_few_units_in_the_last_place() {
        let mut worst = 0.0f64;
        for i in 0..400_000 {
            let x = -86.9 + f64::from(i) * (86.9 + 88.7) / 400_000.0;
            let x = x as f32;
            let truth = libm::exp(f64::from(x));
            worst = worst.max((f64::from(exp(x)) - truth).abs() / truth);
        }
        assert!(worst < 2.5e-7, "{worst:e}");
        assert_eq!((exp(0.0f32), exp(-88.0f32), exp(89.0f32)), (1.0, 0.0, f32::INFINITY));
        assert!(exp(f32::NAN).is_nan() && exp(f32::NEG_INFINITY) == 0.0);
    }

    #[test]
    fn single_precision_powers_of_two() {
        let mut worst = 0.0f64;
        for i in -1_259_999..1_260_000 {
            let x = i as f32 * 1e-4;
            let truth = libm::exp2(f64::from(x));
            worst = worst.max((f64::from(exp2(x)) - truth).abs() / truth);
        }
        assert!(worst < 2.5e-7, "{worst:e}");
        assert_eq!((exp2(0.0f32), exp2(-3.0f32), exp2(-126.0f32), exp2(126.0f32)), (1.0, 0.125, 0.0, f32::INFINITY));
        assert!(exp2(f32::NAN).is_nan() && exp2(f32::NEG_INFINITY) == 0.0);
    }

    #[test]
    fn single_precision_logarithm() {
        let mut worst = 0.0f64;
        for i in 0..2_000_000u32 {
            // Every 1000th positive number, subnormal ones too, and every one close to 1.
            for x in [f32::from_bits(i * 1069), f32::from_bits(0x3f7f_0000 + i / 8)] {
                let truth = libm::log(f64::from(x));
                if x > 0.0 && x.is_finite() && truth != 0.0 {
                    worst = worst.max((f64::from(ln(x)) - truth).abs() / truth.abs());
                }
            }
        }
        assert!(worst < 2.5e-7, "{worst:e}");
        assert_eq!((ln(1.0f32), ln(0.0f32), ln(f32::INFINITY)), (0.0, f32::NEG_INFINITY, f32::INFINITY));
        assert!(ln(-1.0f32).is_nan() && ln(f32::NAN).is_nan());
    }

    #[test]
    fn single_precision_sine_and_cosine() {
        let mut worst = 0.0f64;
        for i in -200_000..=200_000 {
            let x = i as f32 * 0.005;
            let (s, c) = sin_cos(x);
            let (ts, tc) = libm::sincos(f64::from(x));
            worst = worst.max((f64::from(s) - ts).abs()).max((f64::from(c) - tc).abs());
        }
        assert!(worst < 1.2e-7, "{worst:e}");
        assert!(sin_cos(f32::NAN).0.is_nan() && sin_cos(f32::INFINITY).1.is_nan() && sin_cos(1e10f32).0.is_nan());
    }

    #[test]
    fn single_precision_angle_of_a_point() {
        let mut worst = 0.0f64;
        for i in -1_000_000..=1_000_000 {
            let (sin, cos) = libm::sincos(f64::from(i) * 3.2e-6);
            for r in [1e-30, 1.0, 12_345.0, 1e30] {
                let (x, y) = ((r * cos) as f32, (r * sin) as f32);
                worst = worst.max((f64::from(atan2(y, x)) - libm::atan2(f64::from(y), f64::from(x))).abs());
            }
        }
        assert!(worst < 2e-7, "{worst:e}");
        let inf = f32::INFINITY;
        for y in [-1.0, -0.0, 0.0, 1e-45, 1.0, 3e38, inf] {
            for x in [-inf, -1.0, -1e-45, -0.0, 0.0, 1.0, 3e38] {
                let truth = libm::atan2f(y, x);
                let near = (atan2(y, x) - truth).abs() <= 2.5e-7 && atan2(y, x).is_sign_negative() == truth.is_sign_negative();
                assert!(near || (y == inf && x == -inf), "{y} {x}: {}", atan2(y, x));
            }
            assert!(atan2(f32::NAN, y).is_nan() && atan2(y, f32::NAN).is_nan());
        }
    }
}
