//! Motion and measurement models: three plain functions each, and one override for speed.
//!
//! The mathematics of a model is in `transition`, `jacobian`, `process_noise` (or `observe`, `jacobian`, `noise`).
//! The provided `predict` and `innovation` use them through dense matrices; the models here override these two
//! with straight-line code that never multiplies a structural zero, and property tests hold both equal.

pub mod block;
pub mod converted;
pub mod linear;
pub mod motion;
pub mod position;
pub mod radar;
pub mod turn;
pub mod unscented;

use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// Where positions and velocities stand in a state: axis a has its position at `a * stride`, its velocity behind it.
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

    /// Whether positions and velocities of all axes fit `nx` states.
    #[must_use]
    pub const fn fits(self, nx: usize) -> bool {
        self.axes == 0 || (self.axes <= 3 && self.stride >= 2 && self.axes * self.stride <= nx)
    }
}

/// How a target moves over a time step `dt` \[s\]: x ← f(x), P ← F P F' + Q.
pub trait MotionModel<T: Real, const NX: usize> {
    /// Where positions and velocities stand.
    const LAYOUT: Layout = Layout::UNKNOWN;

    /// f(x)
    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX>;
    /// F = ∂f/∂x at `x`
    fn jacobian(&self, x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX>;
    /// Q
    fn process_noise(&self, x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX>;

    /// Predicts in place. Dense here: about 2 NX³ multiply-adds.
    #[inline(always)]
    fn predict(&self, g: &mut Gaussian<T, NX>, dt: T) {
        predict_dense(self, g, dt);
    }
}

/// The dense prediction, F P F' + Q from the three plain functions of `model`.
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

    /// ν = z − ẑ, angles wrapped into (−π, π].
    #[inline(always)]
    fn residual(&self, z: &SVector<T, NZ>, z_hat: &SVector<T, NZ>) -> SVector<T, NZ> {
        z - z_hat
    }

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
    let cross = g.cov.to_matrix() * h.transpose();
    let spread = Symmetric::from_matrix(&(h * cross));
    Innovation::new(model.observe(&g.mean), cross, spread, &model.noise(&g.mean))
}

/// A position in space that one detection fixes, with the radial speed if it was measured.
#[derive(Clone, Copy, Debug)]
pub struct Fix<T> {
    /// Position \[m\]; axes that the state does not have are zero.
    pub position: [T; 3],
    /// Covariance of the position \[m²\].
    pub cov: Symmetric<T, 3>,
    /// The radial speed, where measured.
    pub radial: Option<RadialSpeed<T>>,
}

/// The component of a target's velocity along the line of sight.
#[derive(Clone, Copy, Debug)]
pub struct RadialSpeed<T> {
    /// Unit vector from the sensor to the target.
    pub direction: [T; 3],
    /// Speed of the target along `direction` over the ground, the sensor's own motion taken out \[m/s\].
    pub speed: T,
    /// Variance \[m²/s²\].
    pub variance: T,
}
