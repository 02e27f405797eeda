//! Straight motion: constant velocity, constant acceleration, Singer. Per axis, over a step of T seconds:
//!
//! ```text
//! CV      f = [1 T; 0 1]           q = σ² g g',  g = (T²/2, T)'            piecewise constant acceleration
//!                                  q = s [T³/3 T²/2; · T]                  continuous white acceleration
//! CA      f = [1 T T²/2; 0 1 T; 0 0 1]
//!                                  q = σ² g g',  g = (T²/2, T, 1)'         Wiener sequence acceleration
//!                                  q = s [T⁵/20 T⁴/8 T³/6; · T³/3 T²/2; · · T]   continuous white jerk
//! Singer  da/dt = −α a + w:  f = [1 T (αT−1+e)/α²; 0 1 (1−e)/α; 0 0 e],  e = e^{−αT},  q = 2ασ² ∫ g g' dτ
//! ```
//!
//! Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001, sections 6.2–6.3;
//! Singer, *IEEE Trans. AES* 6(4), 1970. The discrete forms are the papers' (their variance belongs to one step
//! length); the continuous ones keep their meaning when the step varies.
//!
//! Constant velocity in a state with more than position and velocity (an acceleration, a turn rate) makes what it
//! does not use zero, with zero variance, so that it can stand beside richer modes in one bank.

use super::block::{self, BlockStep};
use super::{Layout, MotionModel};
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::scalar::{Real, exp};
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// The process noise of a kinematic model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ProcessNoise<T> {
    /// One random value per step of this variance: acceleration (CV, turns) or acceleration increment (CA) \[m²/s⁴\].
    Discrete(T),
    /// White noise of this power spectral density: acceleration (CV, turns) \[m²/s³\] or jerk (CA) \[m²/s⁵\].
    Continuous(T),
}

impl<T: Real> ProcessNoise<T> {
    pub(crate) fn checked(self) -> Result<Self, ConfigError> {
        let (ProcessNoise::Discrete(v) | ProcessNoise::Continuous(v)) = self;
        match (v.is_finite(), v >= T::ZERO) {
            (false, _) => Err(ConfigError::NotFinite),
            (true, false) => Err(ConfigError::NotPositive),
            (true, true) => Ok(self),
        }
    }

    /// (position, cross, velocity) of the noise of one axis with position and velocity.
    #[inline(always)]
    pub(crate) fn of_velocity(self, dt: T) -> [T; 3] {
        match self {
            ProcessNoise::Discrete(variance) => {
                let (half, step) = (T::lit(0.5) * dt * dt, variance * dt);
                [half * half * variance, half * step, dt * step]
            }
            ProcessNoise::Continuous(density) => {
                let q = density * dt;
                [q * dt * dt * T::lit(1.0 / 3.0), T::lit(0.5) * q * dt, q]
            }
        }
    }
}

/// Constant velocity in `AXES` axes of `STRIDE` states each (2: position and velocity; more: the rest is zero).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConstantVelocity<T, const AXES: usize, const STRIDE: usize = 2> {
    noise: ProcessNoise<T>,
}

impl<T: Real, const AXES: usize, const STRIDE: usize> ConstantVelocity<T, AXES, STRIDE> {
    /// With the process noise `noise` in every axis.
    ///
    /// # Errors
    /// Where the noise is negative or not finite.
    pub fn new(noise: ProcessNoise<T>) -> Result<Self, ConfigError> {
        const { assert!(AXES >= 1 && STRIDE >= 2, "an axis needs a position and a velocity") }
        Ok(Self { noise: noise.checked()? })
    }
}

/// A step of constant velocity.
#[derive(Clone, Copy, Debug)]
pub struct VelocityStep<T> {
    dt: T,
    noise: [T; 3],
}

impl<T: Real, const S: usize> BlockStep<T, S> for VelocityStep<T> {
    #[inline(always)]
    fn propagate<const L: usize>(&self, v: &mut [[T; L]; S]) {
        let moved = block::scaled(&v[1], self.dt);
        block::add(&mut v[0], &moved);
        for i in 2..S {
            v[i] = [T::ZERO; L];
        }
    }
    #[inline(always)]
    fn noise(&self, i: usize, j: usize) -> T {
        // The smaller number tells the compiler what i ≤ j does: that the index is one.
        if j < 2 { self.noise[(i + j).min(2)] } else { T::ZERO }
    }
}

impl<T: Real, const NX: usize, const AXES: usize, const STRIDE: usize> MotionModel<T, NX> for ConstantVelocity<T, AXES, STRIDE> {
    const LAYOUT: Layout = Layout { axes: AXES, stride: STRIDE };
    type Step = VelocityStep<T>;

    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
        MotionModel::<T, NX>::jacobian(self, x, dt) * x
    }
    fn jacobian(&self, _x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
        let mut f = block::jacobian::<T, _, NX, AXES, STRIDE>(&VelocityStep { dt, noise: [T::ZERO; 3] });
        for k in AXES * STRIDE..NX {
            f.data.0[k][k] = T::ZERO;
        }
        f
    }
    fn process_noise(&self, _x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
        block::process_noise::<T, _, NX, AXES, STRIDE>(&VelocityStep { dt, noise: self.noise.of_velocity(dt) })
    }
    #[inline(always)]
    fn step(&self, dt: T) -> VelocityStep<T> {
        VelocityStep { dt, noise: self.noise.of_velocity(dt) }
    }
    #[inline(always)]
    fn advance(&self, g: &mut Gaussian<T, NX>, step: &VelocityStep<T>) {
        block::predict::<T, _, NX, AXES, STRIDE>(step, g);
        for k in AXES * STRIDE..NX {
            g.mean.data.0[0][k] = T::ZERO;
            for row in g.cov.upper_mut().iter_mut().take(k + 1) {
                row[k] = T::ZERO;
            }
            g.cov.upper_mut()[k] = [T::ZERO; NX];
        }
    }
    #[inline(always)]
    fn propagate(&self, _x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
        block::propagate::<T, _, NX, AXES, STRIDE>(&VelocityStep { dt, noise: [T::ZERO; 3] }, v);
        for unused in v.data.0.iter_mut().flat_map(|column| column.iter_mut().skip(AXES * STRIDE)) {
            *unused = T::ZERO;
        }
    }
}

/// Constant acceleration in `AXES` axes of three states each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConstantAcceleration<T, const AXES: usize> {
    noise: ProcessNoise<T>,
}

impl<T: Real, const AXES: usize> ConstantAcceleration<T, AXES> {
    /// With the process noise `noise` in every axis.
    ///
    /// # Errors
    /// Where the noise is negative or not finite.
    pub fn new(noise: ProcessNoise<T>) -> Result<Self, ConfigError> {
        Ok(Self { noise: noise.checked()? })
    }

    #[inline(always)]
    fn step_over(&self, dt: T) -> AccelerationStep<T> {
        let half = T::lit(0.5) * dt * dt;
        let noise = match self.noise {
            ProcessNoise::Discrete(variance) => {
                let (v, a) = (variance * dt, variance);
                Symmetric::from_fn(|i, j| [[half * half * variance, half * v, half * a], [T::ZERO, dt * v, v], [T::ZERO, T::ZERO, a]][i][j])
            }
            ProcessNoise::Continuous(density) => {
                let q = density * dt;
                let q2 = q * dt * dt;
                Symmetric::from_fn(|i, j| {
                    [
                        [q2 * dt * dt * T::lit(0.05), q2 * dt * T::lit(0.125), q2 * T::lit(1.0 / 6.0)],
                        [T::ZERO, q2 * T::lit(1.0 / 3.0), T::lit(0.5) * q * dt],
                        [T::ZERO, T::ZERO, q],
                    ][i][j]
                })
            }
        };
        AccelerationStep { velocity: dt, acceleration: [half, dt, T::ONE], noise }
    }
}

/// A step of CA or Singer: an axis with an acceleration that enters position, velocity and itself by `acceleration`.
#[derive(Clone, Copy, Debug)]
pub struct AccelerationStep<T> {
    velocity: T,
    acceleration: [T; 3],
    noise: Symmetric<T, 3>,
}

impl<T: Real> BlockStep<T, 3> for AccelerationStep<T> {
    #[inline(always)]
    fn propagate<const L: usize>(&self, [x, v, a]: &mut [[T; L]; 3]) {
        let [to_x, to_v, to_a] = self.acceleration;
        let (moved, fallen, gained) = (block::scaled(v, self.velocity), block::scaled(a, to_x), block::scaled(a, to_v));
        block::add(x, &moved);
        block::add(x, &fallen);
        block::add(v, &gained);
        *a = block::scaled(a, to_a);
    }
    #[inline(always)]
    fn noise(&self, i: usize, j: usize) -> T {
        self.noise.at(i, j)
    }
}

/// Acceleration as a first-order Markov process (Singer), in `AXES` axes of three states each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Singer<T, const AXES: usize> {
    decay: T,
    variance: T,
}

impl<T: Real, const AXES: usize> Singer<T, AXES> {
    /// `time_constant` of a manoeuvre \[s\] (1/α) and the standard deviation of the acceleration \[m/s²\].
    ///
    /// # Errors
    /// Where the time constant is not positive, the deviation negative, or one of them not finite.
    pub fn new(time_constant: T, acceleration_std: T) -> Result<Self, ConfigError> {
        if !(time_constant.is_finite() && acceleration_std.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        if time_constant <= T::ZERO || acceleration_std < T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { decay: T::ONE / time_constant, variance: acceleration_std * acceleration_std })
    }

    fn step_over(&self, dt: T) -> AccelerationStep<T> {
        let a = self.decay * dt;
        let noise = singer_noise(a);
        // From units of T = 1 and α σ² = ½ to this step: row i, column j carry T^(2−i) T^(2−j) and 2ασ²T.
        let scale = T::lit(2.0) * self.variance * a;
        let power = [dt * dt, dt, T::ONE];
        AccelerationStep {
            velocity: dt,
            acceleration: [dt * dt * fading(a, 2), dt * fading(a, 1), exp(-a)],
            noise: Symmetric::from_fn(|i, j| noise[i][j] * scale * power[i] * power[j]),
        }
    }
}

/// φ_n(a) = Σ_k (−a)^k / (k + n)!: φ₁ = (1 − e^{−a})/a, φ₂ = (a − 1 + e^{−a})/a², without cancellation near zero.
fn fading<T: Real>(a: T, n: u32) -> T {
    if a > T::ONE {
        let e = exp(-a);
        return if n == 1 { (T::ONE - e) / a } else { (a - T::ONE + e) / (a * a) };
    }
    series(a, n as usize, |_| T::ONE)
}

/// Σ_{n ≥ first} κ(n) (−1)^n a^{n − first} / n! up to the sign of its first term: the power series of the module's
/// integrals, twenty terms, enough for a ≤ 1 in double precision even where κ grows as 2^n.
fn series<T: Real>(a: T, first: usize, weight: impl Fn(usize) -> T) -> T {
    let mut term = T::ONE;
    for n in 1..=first {
        term /= T::from_count(n);
    }
    let mut sum = T::ZERO;
    for n in first..first + 24 {
        sum += weight(n) * term;
        term *= -a / T::from_count(n + 1);
    }
    sum
}

/// ∫₀¹ g(τ) g(τ)' dτ with g = ((aτ − 1 + e)/a², (1 − e)/a, e), e = e^{−aτ}: upper triangle.
fn singer_noise<T: Real>(a: T) -> [[T; 3]; 3] {
    let two_to = |n: usize| {
        let mut p = T::ONE;
        for _ in 0..n {
            p += p;
        }
        p
    };
    if a > T::ONE {
        let (e, two) = (exp(-a), T::lit(2.0));
        let e2 = e * e;
        let (a2, third) = (a * a, T::lit(1.0 / 3.0));
        let half_decay = (T::ONE - e2) / (two * a);
        // Antiderivatives in closed form; for a > 1 their terms no longer cancel.
        let q33 = half_decay;
        let q23 = ((T::ONE - e) / a - half_decay) / a;
        let q22 = (T::ONE - two * (T::ONE - e) / a + half_decay) / a2;
        let decay = (T::ONE - e) / a;
        let ramp = (decay - e) / a;
        let q13 = (a * ramp - decay + half_decay) / a2;
        let q12 = (a / two - T::ONE + two * decay - a * ramp - half_decay) / (a2 * a);
        let q11 = (a2 * third - a + T::ONE + two * (a * ramp - decay) + half_decay) / (a2 * a2);
        return [[q11, q12, q13], [q12, q22, q23], [q13, q23, q33]];
    }
    // Coefficients of (−aτ)^n/n! in the products of g, integrated over τ.
    let over = |n: usize| T::ONE / T::from_count(n + 1);
    let count = T::from_count;
    let q33 = series(a, 0, |n| two_to(n) * over(n));
    let q23 = series(a, 1, |n| (two_to(n) - T::ONE) * over(n));
    let q22 = series(a, 2, |n| (two_to(n) - T::lit(2.0)) * over(n));
    let q13 = series(a, 2, |n| (two_to(n) - count(n + 1)) * over(n));
    let q12 = series(a, 3, |n| (two_to(n) - count(n + 2)) * over(n));
    let q11 = series(a, 4, |n| (two_to(n) - count(2 * n + 2)) * over(n));
    [[q11, q12, q13], [q12, q22, q23], [q13, q23, q33]]
}

/// The plain functions of a model whose axes all make the same `step`.
macro_rules! axiswise {
    ($model:ident) => {
        impl<T: Real, const NX: usize, const AXES: usize> MotionModel<T, NX> for $model<T, AXES> {
            const LAYOUT: Layout = Layout { axes: AXES, stride: 3 };
            type Step = AccelerationStep<T>;

            fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
                block::transition::<T, _, NX, AXES, 3>(&self.step_over(dt), x)
            }
            fn jacobian(&self, _x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
                block::jacobian::<T, _, NX, AXES, 3>(&self.step_over(dt))
            }
            fn process_noise(&self, _x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
                block::process_noise::<T, _, NX, AXES, 3>(&self.step_over(dt))
            }
            #[inline(always)]
            fn step(&self, dt: T) -> AccelerationStep<T> {
                self.step_over(dt)
            }
            #[inline(always)]
            fn advance(&self, g: &mut Gaussian<T, NX>, step: &AccelerationStep<T>) {
                const { assert!(NX == 3 * AXES, "the state must be three per axis") }
                block::predict::<T, _, NX, AXES, 3>(step, g);
            }
            #[inline(always)]
            fn propagate(&self, _x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
                block::propagate::<T, _, NX, AXES, 3>(&self.step_over(dt), v);
            }
        }
    };
}
axiswise!(ConstantAcceleration);
axiswise!(Singer);
