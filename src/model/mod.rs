//! Motion and measurement models: three plain functions each, and one override for speed.
//!
//! The mathematics of a model is in `transition`, `jacobian`, `process_noise` (or `observe`, `jacobian`, `noise`).
//! [`predict_dense`] and the provided `innovation` use them through dense matrices; the models here `advance` and innovate
//! by straight-line code that never multiplies a structural zero, and property tests hold both equal.

pub mod block;
pub mod converted;
pub mod linear;
pub mod motion;
pub(crate) mod offset;
pub mod position;
pub mod radar;
pub mod resolution;
pub mod turn;
pub mod unscented;

use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use crate::time::Duration;
use nalgebra::{SMatrix, SVector};

/// Where positions and velocities stand in a state: axis a has its position at `a * stride`, its velocity behind it and,
/// where a stride has room, its acceleration behind that.
///
/// (x, vx, y, vy) is 2 axes with stride 2; (x, vx, ax, y, vy, ay) is 2 axes with stride 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Layout {
    /// Number of Cartesian axes, 1 to 3; 0 where a model does not say.
    pub axes: usize,
    /// States per axis.
    pub stride: usize,
}

impl Layout {
    /// A model that does not tell where its positions stand: it filters, but no track can be started from it.
    pub const UNKNOWN: Layout = Layout { axes: 0, stride: 0 };

    /// Whether two layouts can serve the same state.
    #[must_use]
    pub const fn agrees(self, other: Layout) -> bool {
        self.axes == 0 || other.axes == 0 || (self.axes == other.axes && self.stride == other.stride)
    }

    /// Entries of all axes.
    pub(crate) const fn states(self) -> usize {
        self.axes.saturating_mul(self.stride)
    }

    /// Whether positions and velocities of all axes fit `nx` states.
    #[must_use]
    pub const fn fits(self, nx: usize) -> bool {
        self.axes == 0 || (self.axes <= 3 && self.stride >= 2 && self.states() <= nx)
    }

    /// The entry of which entry `j` is the rate: a velocity's position, an acceleration's velocity.
    pub(crate) const fn integral(self, j: usize) -> Option<usize> {
        match j.checked_rem(self.stride) {
            Some(1 | 2) if j < self.states() => Some(j - 1),
            _ => None,
        }
    }
}

/// How a target moves over a time step `dt` \[s\]: x ← f(x), P ← F P F' + Q.
pub trait MotionModel<T: Real, const NX: usize> {
    /// Where positions and velocities stand.
    const LAYOUT: Layout = Layout::UNKNOWN;
    /// What a step of some length needs of the model, worked out once for all targets: `T`, the length, where that is nothing.
    type Step;

    /// f(x)
    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX>;
    /// F = ∂f/∂x at `x`
    fn jacobian(&self, x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX>;
    /// Q
    fn process_noise(&self, x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX>;

    /// The step over `dt` \[s\].
    fn step(&self, dt: T) -> Self::Step;
    /// Predicts in place by a step of this model; [`predict_dense`] serves any model.
    fn advance(&self, g: &mut Gaussian<T, NX>, step: &Self::Step);

    /// Predicts in place over `dt` \[s\].
    #[inline(always)]
    fn predict(&self, g: &mut Gaussian<T, NX>, dt: T) {
        self.advance(g, &self.step(dt));
    }

    /// v ← F v for all columns of `v`, F at `x`: what a covariance between two targets moves by. Dense here: NX³ multiply-adds.
    #[inline(always)]
    fn propagate(&self, x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
        *v = self.jacobian(x, dt) * *v;
    }
}

/// The dense prediction, F P F' + Q from the three plain functions of `model`: about 2 NX³ multiply-adds.
#[inline]
pub fn predict_dense<T: Real, M: MotionModel<T, NX> + ?Sized, const NX: usize>(model: &M, g: &mut Gaussian<T, NX>, dt: T) {
    let f = model.jacobian(&g.mean, dt);
    let q = model.process_noise(&g.mean, dt);
    let fp = f * g.cov.to_matrix();
    let p = Symmetric::from_fn(|i, j| {
        let mut sum = q.upper()[i][j];
        for k in 0..NX {
            sum += fp.data.0[k][i] * f.data.0[k][j];
        }
        sum
    });
    g.mean = model.transition(&g.mean, dt);
    g.cov = p;
}

/// What a sensor measures of a state: z = h(x) + noise of covariance R.
pub trait MeasurementModel<T: Real, const NX: usize, const NZ: usize> {
    /// Where positions and velocities are expected.
    const LAYOUT: Layout = Layout::UNKNOWN;

    /// h(x)
    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ>;
    /// H = ∂h/∂x at `x`
    fn jacobian(&self, x: &SVector<T, NX>) -> SMatrix<T, NZ, NX>;
    /// R for a target at `x`; a detection may bring its own instead
    fn noise(&self, x: &SVector<T, NX>) -> Symmetric<T, NZ>;

    /// ν = z − ẑ, angles wrapped into (−π, π], and what is measured modulo an interval folded by it.
    #[inline(always)]
    fn residual(&self, z: &SVector<T, NZ>, z_hat: &SVector<T, NZ>) -> SVector<T, NZ> {
        z - z_hat
    }

    /// The difference of two predicted measurements: angles are wrapped, but nothing is folded, for predictions are whole.
    #[inline(always)]
    fn difference(&self, a: &SVector<T, NZ>, b: &SVector<T, NZ>) -> SVector<T, NZ> {
        self.residual(a, b)
    }

    /// Makes uninformative what the prediction, G = P H' (`cross`) and H P H' (`spread`), is too uncertain to unfold.
    #[inline(always)]
    fn drop_ambiguous(&self, _cross: &mut SMatrix<T, NX, NZ>, _spread: &mut Symmetric<T, NZ>, _noise: &Symmetric<T, NZ>) {}

    /// The predicted measurement of `g`. Dense here: about NX² NZ multiply-adds.
    #[inline(always)]
    fn innovation(&self, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ> {
        innovation_dense(self, g)
    }

    /// The position in space that the measurement `z` with noise `noise` points to, if it fixes one: what new tracks
    /// are started from.
    #[inline]
    fn locate(&self, _z: &SVector<T, NZ>, _noise: &Symmetric<T, NZ>) -> Option<Fix<T>> {
        None
    }

    /// The sensor's own velocity over the ground \[m/s\]: where it was when it made a detection before or after its scan.
    #[inline]
    fn velocity(&self) -> [T; 3] {
        [T::ZERO; 3]
    }

    /// Whether everything the model is made of is finite. A tracker refuses the scan of a sensor that is not.
    #[inline]
    fn is_finite(&self) -> bool {
        true
    }

    /// R where no target is known yet.
    #[inline]
    fn nominal_noise(&self) -> Symmetric<T, NZ> {
        self.noise(&SVector::zeros())
    }
}

/// The dense predicted measurement from the three plain functions of `model`.
#[inline]
pub fn innovation_dense<T: Real, M, const NX: usize, const NZ: usize>(model: &M, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ>
where
    M: MeasurementModel<T, NX, NZ> + ?Sized,
{
    let h = model.jacobian(&g.mean);
    let mut cross = g.cov.to_matrix() * h.transpose();
    let mut spread = Symmetric::from_matrix(&(h * cross));
    let noise = model.noise(&g.mean);
    model.drop_ambiguous(&mut cross, &mut spread, &noise);
    Innovation::new(model.observe(&g.mean), cross, spread, &noise)
}

/// A position in space that one detection fixes, with the radial speed if it was measured.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fix<T> {
    /// Position \[m\]; axes that the state does not have are zero.
    pub position: [T; 3],
    /// Covariance of the position \[m²\].
    pub cov: Symmetric<T, 3>,
    /// The radial speed, where measured.
    pub radial: Option<RadialSpeed<T>>,
    /// When, after the time of the scan.
    pub offset: Duration,
}

/// The component of a target's velocity along the line of sight.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RadialSpeed<T> {
    /// Unit vector from the sensor to the target.
    pub direction: [T; 3],
    /// Speed of the target along `direction` over the ground, the sensor's own motion taken out \[m/s\].
    pub speed: T,
    /// Variance \[m²/s²\].
    pub variance: T,
    /// Where it is measured modulo 2 V only: V \[m/s\].
    pub unambiguous: Option<T>,
}
