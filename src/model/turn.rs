//! Coordinated turns in the horizontal plane, at a known and at an estimated rate. With a = ωT:
//!
//! ```text
//! x  ← x + T S vx − T C vy      vx ← cos a vx − sin a vy      S(a) = sin a / a
//! y  ← y + T C vx + T S vy      vy ← sin a vx + cos a vy      C(a) = (1 − cos a) / a
//! ∂x/∂ω = T² (S' vx − C' vy)    ∂vx/∂ω = −T (sin a vx + cos a vy)    and likewise for y
//! ```
//!
//! ω > 0 turns left. S, C and their derivatives are entire functions: near a = 0 their power series replace the
//! quotients (S' → 0 but C' → ½: the derivative at ω = 0 is not zero). A third axis, if any, keeps its velocity.
//! Bar-Shalom, Li and Kirubarajan 2001, sections 11.7.1–11.7.2. Process noise as constant velocity in every axis.

use super::block::{self, BlockStep, add, scaled};
use super::motion::ProcessNoise;
use super::{Layout, MotionModel};
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::scalar::{Real, polynomial, sin_cos};
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// A turn at a known rate; states (x, vx, y, vy) or, with `AXES` = 3, (x, vx, y, vy, z, vz).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KnownTurn<T, const AXES: usize> {
    rate: T,
    noise: ProcessNoise<T>,
}

/// A turn at a rate that is the last state: (x, vx, y, vy, ω) or, with `AXES` = 3, (x, vx, y, vy, z, vz, ω).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnknownTurn<T, const AXES: usize> {
    noise: ProcessNoise<T>,
    rate_noise: ProcessNoise<T>,
}

impl<T: Real, const AXES: usize> KnownTurn<T, AXES> {
    /// At `rate` \[rad/s\], positive to the left, with the process noise `noise` (acceleration) in every axis.
    ///
    /// # Errors
    /// Where a number is not finite or the noise is negative.
    pub fn new(rate: T, noise: ProcessNoise<T>) -> Result<Self, ConfigError> {
        const { assert!(AXES == 2 || AXES == 3, "a turn needs a plane") }
        if !rate.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        Ok(Self { rate, noise: noise.checked()? })
    }
}

impl<T: Real, const AXES: usize> UnknownTurn<T, AXES> {
    /// With the process noise `noise` (acceleration) in every axis and `rate_noise` of the turn rate: its increment a
    /// step \[rad²/s²\] (discrete) or its random walk \[rad²/s³\] (continuous).
    ///
    /// # Errors
    /// Where a noise is negative or not finite.
    pub fn new(noise: ProcessNoise<T>, rate_noise: ProcessNoise<T>) -> Result<Self, ConfigError> {
        const { assert!(AXES == 2 || AXES == 3, "a turn needs a plane") }
        Ok(Self { noise: noise.checked()?, rate_noise: rate_noise.checked()? })
    }
}

/// S, C, sin and cos of a turn by the angle a.
#[derive(Clone, Copy, Debug)]
struct Arc<T> {
    s: T,
    c: T,
    sin: T,
    cos: T,
}

/// Below this angle \[rad\] the power series serve, exact to rounding with the terms given.
const SERIES: f64 = 0.5;

impl<T: Real> Arc<T> {
    #[inline(always)]
    fn new(a: T) -> Self {
        if a < T::lit(SERIES) && a > T::lit(-SERIES) {
            let z = a * a;
            // 1/(2k+1)! and 1/(2k+2)! with alternating signs
            let s =
                polynomial!(z; 1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0; 1.0 / 362_880.0, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0);
            let c = polynomial!(z; 0.5, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0; 1.0 / 3_628_800.0, -1.0 / 479_001_600.0);
            let c = a * c;
            Self { s, c, sin: a * s, cos: T::ONE - a * c }
        } else {
            let (sin, cos) = sin_cos(a);
            let (half, _) = sin_cos(a * T::lit(0.5));
            Self { s: sin / a, c: (half * half + half * half) / a, sin, cos }
        }
    }

    /// (S', C')
    #[inline(always)]
    fn derivatives(&self, a: T) -> (T, T) {
        if a < T::lit(SERIES) && a > T::lit(-SERIES) {
            let z = a * a;
            // 2k/(2k+1)! and (2k+1)/(2k+2)! with alternating signs
            let s = polynomial!(z; -1.0 / 3.0, 1.0 / 30.0, -1.0 / 840.0, 1.0 / 45_360.0; -1.0 / 3_991_680.0, 1.0 / 518_918_400.0);
            let c = polynomial!(z; 0.5, -0.125, 1.0 / 144.0, -1.0 / 5760.0; 1.0 / 403_200.0, -1.0 / 43_545_600.0, 1.0 / 6_706_022_400.0);
            (a * s, c)
        } else {
            ((self.cos - self.s) / a, (self.sin - self.c) / a)
        }
    }
}

/// One step of a turn for S = 2 AXES states, or one more: the rate, whose derivatives are `by_rate`.
#[derive(Clone, Copy, Debug)]
pub struct TurnStep<T, const S: usize> {
    dt: T,
    arc: Arc<T>,
    by_rate: [T; 4],
    noise: [T; 3],
    rate_noise: T,
}

impl<T: Real, const S: usize> TurnStep<T, S> {
    /// The first four states; the third axis, if any, behind them.
    #[inline(always)]
    fn turn<const L: usize>(&self, v: &mut [[T; L]; S]) {
        let Arc { s, c, sin, cos } = self.arc;
        let (along, across) = (self.dt * s, self.dt * c);
        let (vx, vy) = (v[1], v[3]);
        let (xx, xy, yx, yy) = (scaled(&vx, along), scaled(&vy, -across), scaled(&vx, across), scaled(&vy, along));
        add(&mut v[0], &xx);
        add(&mut v[2], &yx);
        add(&mut v[0], &xy);
        add(&mut v[2], &yy);
        (v[1], v[3]) = (scaled(&vx, cos), scaled(&vx, sin));
        add(&mut v[1], &scaled(&vy, -sin));
        add(&mut v[3], &scaled(&vy, cos));
        if S >= 6 {
            let rise = scaled(&v[5], self.dt);
            add(&mut v[4], &rise);
        }
    }
}

impl<T: Real, const S: usize> BlockStep<T, S> for TurnStep<T, S> {
    #[inline(always)]
    fn propagate<const L: usize>(&self, v: &mut [[T; L]; S]) {
        self.turn(v);
        if S % 2 == 1 {
            let rate = v[S - 1];
            for i in 0..4 {
                add(&mut v[i], &scaled(&rate, self.by_rate[i]));
            }
        }
    }
    #[inline(always)]
    fn noise(&self, i: usize, j: usize) -> T {
        if S % 2 == 1 && j == S - 1 {
            if i == j { self.rate_noise } else { T::ZERO }
        } else if i / 2 == j / 2 {
            self.noise[i % 2 + j % 2]
        } else {
            T::ZERO
        }
    }
}

impl<T: Real, const AXES: usize> KnownTurn<T, AXES> {
    #[inline(always)]
    fn step_over<const S: usize>(&self, dt: T) -> TurnStep<T, S> {
        let arc = Arc::new(self.rate * dt);
        TurnStep { dt, arc, by_rate: [T::ZERO; 4], noise: self.noise.of_velocity(dt), rate_noise: T::ZERO }
    }
}

impl<T: Real, const NX: usize, const AXES: usize> MotionModel<T, NX> for KnownTurn<T, AXES> {
    const LAYOUT: Layout = Layout { axes: AXES, stride: 2 };
    type Step = TurnStep<T, NX>;

    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
        block::transition::<T, _, NX, 1, NX>(&self.step_over::<NX>(dt), x)
    }
    fn jacobian(&self, _x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
        block::jacobian::<T, _, NX, 1, NX>(&self.step_over::<NX>(dt))
    }
    fn process_noise(&self, _x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
        block::process_noise::<T, _, NX, 1, NX>(&self.step_over::<NX>(dt))
    }
    #[inline(always)]
    fn step(&self, dt: T) -> TurnStep<T, NX> {
        self.step_over(dt)
    }
    #[inline(always)]
    fn advance(&self, g: &mut Gaussian<T, NX>, step: &TurnStep<T, NX>) {
        const { assert!(NX == 2 * AXES, "a known turn has two states per axis") }
        block::predict::<T, _, NX, 1, NX>(step, g);
    }
}

impl<T: Real, const AXES: usize> UnknownTurn<T, AXES> {
    #[inline(always)]
    fn step_at<const NX: usize>(&self, x: &SVector<T, NX>, dt: T) -> TurnStep<T, NX> {
        const { assert!(NX == 2 * AXES + 1, "an unknown turn has two states per axis and the rate") }
        let x = &x.data.0[0];
        let a = x[NX - 1] * dt;
        let arc = Arc::new(a);
        let (ds, dc) = arc.derivatives(a);
        let (vx, vy, t2) = (x[1], x[3], dt * dt);
        let (turned_x, turned_y) = (arc.cos * vx - arc.sin * vy, arc.sin * vx + arc.cos * vy);
        let rate_noise = match self.rate_noise {
            ProcessNoise::Discrete(variance) => variance,
            ProcessNoise::Continuous(density) => density * dt,
        };
        TurnStep {
            dt,
            arc,
            by_rate: [t2 * (ds * vx - dc * vy), -dt * turned_y, t2 * (dc * vx + ds * vy), dt * turned_x],
            noise: self.noise.of_velocity(dt),
            rate_noise,
        }
    }
}

impl<T: Real, const NX: usize, const AXES: usize> MotionModel<T, NX> for UnknownTurn<T, AXES> {
    const LAYOUT: Layout = Layout { axes: AXES, stride: 2 };
    type Step = T;

    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
        let mut moved = x.data.0[0].map(|x| [x]);
        self.step_at(x, dt).turn(&mut moved);
        SVector::from_fn(|i, _| moved[i][0])
    }
    fn jacobian(&self, x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
        block::jacobian::<T, _, NX, 1, NX>(&self.step_at(x, dt))
    }
    fn process_noise(&self, x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
        block::process_noise::<T, _, NX, 1, NX>(&self.step_at(x, dt))
    }
    #[inline(always)]
    fn step(&self, dt: T) -> T {
        dt
    }
    #[inline(always)]
    fn advance(&self, g: &mut Gaussian<T, NX>, dt: &T) {
        let step = self.step_at(&g.mean, *dt);
        let mut moved = g.mean.data.0[0].map(|x| [x]);
        step.turn(&mut moved);
        g.mean.data.0[0] = moved.map(|[x]| x);
        block::predict_covariance::<T, _, NX, 1, NX>(&step, &mut g.cov);
    }
}
