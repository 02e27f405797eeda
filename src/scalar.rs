//! The scalar: `f32` on the target, `f64` as the reference, one generic code path for both.
//!
//! nalgebra's [`RealField`] brings the arithmetic. It also brings `exp`, `sin` and their kin, but those come from
//! the platform's mathematics library wherever `std` is linked, so a desk and a target would disagree in the last
//! bits. The functions of this module are the only transcendentals the library calls. In `f32` they use nothing
//! but IEEE additions, multiplications, divisions and roots in single precision: our own [`exp`], [`ln`], [`sin_cos`] and
//! [`atan2`], `libm` for [`erf`], and the correctly rounded [`sqrt`], on the target by the one
//! instruction in `scalar/square_root.rs`. Equal inputs give equal bits on every machine, and no double-precision code
//! is linked.
//!
//! | file | of what |
//! |---|---|
//! | `scalar/single.rs` | the functions of `f32`, and how good they are |
//! | `scalar/square_root.rs` | its root by one instruction |

use nalgebra::RealField;

/// Σ_k c_k z^k of a `T` in scope, by Horner's rule. The terms behind the second semicolon are below the rounding of single precision.
// Nested expressions and no loop: no coefficient is ever a double-precision number at run time.
macro_rules! polynomial {
    ($z:expr; $($c:expr),+; $($more:expr),+) => {{
        let z: T = $z;
        if T::EPSILON > T::lit(1e-10) { polynomial!(@ z $($c),+) } else { polynomial!(@ z $($c),+, $($more),+) }
    }};
    (@ $z:ident $c:expr) => { T::lit($c) };
    (@ $z:ident $c:expr, $($more:expr),+) => { polynomial!(@ $z $($more),+) * $z + T::lit($c) };
}
pub(crate) use polynomial;

mod single;
mod square_root;

pub(crate) mod sealed {
    /// The functions behind the free functions of `scalar`, and the seal of `Real`.
    pub trait Math: Sized {
        fn exp(self) -> Self;
        fn exp2(self) -> Self;
        fn ln(self) -> Self;
        fn sqrt(self) -> Self;
        fn invertible(self) -> bool;
        fn plus_zero(self) -> bool;
        fn sin_cos(self) -> (Self, Self);
        fn atan2(self, x: Self) -> Self;
        fn erf(self) -> Self;
        fn round(self) -> Self;
    }
}

/// A real number of the width the trackers run in: `f32` or `f64`. Sealed.
pub trait Real: RealField + Copy + sealed::Math {
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// π
    const PI: Self;
    /// The logarithm below which [`exp`] returns zero: no result is subnormal.
    const LN_FLOOR: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The smallest positive number of full precision; its reciprocal is finite.
    const LEAST: Self;
    /// The nearest number to the constant `x`.
    fn lit(x: f64) -> Self;
    /// A count.
    fn from_count(n: usize) -> Self;
    /// Seconds of a number of microseconds, correctly rounded while |`us`| fits the mantissa.
    fn from_micros(us: i64) -> Self;
    /// The same number in double precision.
    fn to_f64(self) -> f64;
}

impl Real for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    const PI: f64 = core::f64::consts::PI;
    const LN_FLOOR: f64 = -708.0;
    const EPSILON: f64 = f64::EPSILON;
    const LEAST: f64 = f64::MIN_POSITIVE;
    #[inline(always)]
    fn lit(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn from_count(n: usize) -> f64 {
        n as f64
    }
    #[inline]
    fn from_micros(us: i64) -> f64 {
        us as f64 / 1e6
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

/// e^x. In `f32` within 2.5e-7 of the true value, relative; zero below [`Real::LN_FLOOR`], infinite above 88.7.
#[inline(always)]
pub fn exp<T: Real>(x: T) -> T {
    sealed::Math::exp(x)
}

/// 2^x. In `f32` within 2.5e-7 of the true value, relative; zero from −126 down, infinite from 126 up. Half the cost of [`exp`].
#[inline(always)]
pub fn exp2<T: Real>(x: T) -> T {
    sealed::Math::exp2(x)
}

/// ln x, −∞ at zero, NaN below. In `f32` within 2.5e-7 of the true value, relative.
#[inline(always)]
pub fn ln<T: Real>(x: T) -> T {
    sealed::Math::ln(x)
}

/// √x, correctly rounded.
#[inline(always)]
pub fn sqrt<T: Real>(x: T) -> T {
    sealed::Math::sqrt(x)
}

/// Whether x is positive, and x and 1 / x are of full precision: not for numbers so small or so large as no variance is.
#[inline(always)]
pub fn is_invertible<T: Real>(x: T) -> bool {
    sealed::Math::invertible(x)
}

/// Whether x is zero without a sign: tested in integer registers, where a comparison would wait for flags, twice if its result is
/// returned.
#[inline(always)]
pub(crate) fn is_plus_zero<T: Real>(x: T) -> bool {
    sealed::Math::plus_zero(x)
}

/// (sin x, cos x), x in radians. In `f32` within 1.2e-7 absolutely for |x| ≤ 1000, NaN beyond 1e5.
#[inline(always)]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    sealed::Math::sin_cos(x)
}

/// The angle of the point (x, y) from the x axis, in (−π, π] \[rad\]; ±0 or ±π on the axis, by the signs of zeros. In `f32` within
/// 2e-7 absolutely, NaN where both are infinite.
#[inline(always)]
pub fn atan2<T: Real>(y: T, x: T) -> T {
    sealed::Math::atan2(y, x)
}

/// The error function, for gate probabilities in odd dimensions.
#[inline(always)]
pub fn erf<T: Real>(x: T) -> T {
    sealed::Math::erf(x)
}

/// `angle` less the whole turns, in (−π, π] \[rad\].
#[inline]
pub fn wrap<T: Real>(angle: T) -> T {
    fold(angle, T::PI)
}

/// `x` less the whole intervals of 2 `half`, in (−`half`, `half`]. `half` must be positive.
#[inline(always)]
pub fn fold<T: Real>(x: T, half: T) -> T {
    if x.abs() < half { x } else { fold_beyond(x, half) }
}

// Out of line: most residuals of angles need no folding.
#[inline(never)]
fn fold_beyond<T: Real>(x: T, half: T) -> T {
    let interval = half + half;
    let folded = x - sealed::Math::round(x / interval) * interval;
    if folded <= -half { half } else { folded }
}

/// Whether `x` is finite, by one multiplication and one comparison: zero times anything else is NaN.
#[inline(always)]
pub fn is_finite<T: Real>(x: T) -> bool {
    x * T::ZERO == T::ZERO
}

/// The larger of two numbers, by one comparison (`a` where either is NaN).
#[inline(always)]
pub fn larger<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

impl sealed::Math for f64 {
    #[inline(always)]
    fn exp(self) -> f64 {
        if self < <f64 as Real>::LN_FLOOR { 0.0 } else { libm::exp(self) }
    }
    #[inline(always)]
    fn exp2(self) -> f64 {
        libm::exp2(self)
    }
    #[inline(always)]
    fn ln(self) -> f64 {
        libm::log(self)
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        libm::sqrt(self)
    }
    #[inline(always)]
    fn invertible(self) -> bool {
        (f64::MIN_POSITIVE..1.0 / f64::MIN_POSITIVE).contains(&self)
    }
    #[inline(always)]
    fn plus_zero(self) -> bool {
        self.to_bits() == 0
    }
    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        libm::sincos(self)
    }
    #[inline(always)]
    fn atan2(self, x: f64) -> f64 {
        libm::atan2(self, x)
    }
    #[inline(always)]
    fn erf(self) -> f64 {
        libm::erf(self)
    }
    #[inline(always)]
    fn round(self) -> f64 {
        libm::rint(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_within_an_interval_is_not_folded() {
        for x in [-0.0f32, 1e-45, 1.0, -2.999_999_8, 2.999_999_8, 3.0] {
            assert_eq!(fold(x, 3.0).to_bits(), x.to_bits());
            assert_eq!(fold(x, f32::INFINITY).to_bits(), x.to_bits());
        }
        assert_eq!((fold(-3.0f32, 3.0), fold(3.5f32, 3.0), fold(-9.0f32, 3.0)), (3.0, -2.5, 3.0));
        assert!(fold(f32::NAN, 3.0).is_nan() && fold(f32::INFINITY, 3.0).is_nan());
    }

    #[test]
    fn angles_wrap_into_the_half_open_turn() {
        assert_eq!(wrap(core::f64::consts::PI), core::f64::consts::PI);
        assert_eq!(wrap(-core::f64::consts::PI), core::f64::consts::PI);
        assert!((wrap(7.0f64) - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
        assert!((wrap(-7.0f32) - (core::f32::consts::TAU - 7.0)).abs() < 1e-6);
    }

    #[test]
    fn seconds_of_whole_milliseconds_are_correctly_rounded() {
        assert_eq!(f32::from_micros(1_680_000), 1.68);
        assert_eq!(f64::from_micros(-1_000), -0.001);
    }
}
