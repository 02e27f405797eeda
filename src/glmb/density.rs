//! What a hypothesis knows of one target, whatever it is made of.
//!
//! ```text
//! predict   p(x, r') = Σ_r π_rr' ∫ f_r'(x | y) p(y, r) dy
//! weigh     M_j = Σ_r ∫ P_D,r(x) g(z_j | x) p(x, r) dx over what lies in the gate,  m = Σ_r ∫ (1 − P_D,r(x) P_G) p(x, r) dx
//! absorb    p(x, r) ∝ P_D,r(x) g(z_j | x) p(x, r),  or (1 − P_D,r(x) P_G) p(x, r) where the target was not detected
//! ```
//!
//! What survival and clutter weigh is not the density's business.

use crate::gaussian::Gaussian;
use crate::mode::{JumpMatrix, ModeSet};
use crate::scalar::Real;
use crate::scan::Detection;
use crate::sensor::Sensor;
use core::fmt::Debug;
use nalgebra::SVector;
use rand_core::Rng;

/// A sensor, and how well it detects targets in every mode.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a, S, T, const MODES: usize> {
    /// The sensor
    pub sensor: &'a S,
    /// By mode, the share of the sensor's detection probability that a target in it has
    pub visibility: &'a [T; MODES],
}

impl<S, T: Real, const MODES: usize> Sight<'_, S, T, MODES> {
    /// P_D of a target at `x` in `mode`.
    #[inline(always)]
    pub fn p_detect<const NX: usize, const NZ: usize>(&self, mode: usize, x: &SVector<T, NX>) -> T
    where
        S: Sensor<T, NX, NZ>,
    {
        self.visibility.get(mode).map_or(T::ZERO, |share| *share * self.sensor.p_detect(x))
    }
}

/// The density of one target over its state and mode, given that it exists.
///
/// Densities may be large: they are written in place. Those that draw random numbers take them from the caller's generator.
pub trait Density<T: Real, const NX: usize, const MODES: usize>: Copy + Debug {
    /// All zero bits.
    const ZERO: Self;
    /// Gaussians or points, in all modes together.
    const COMPONENTS: usize;

    /// Becomes that of a target that was just born: `g` in every mode, with the mode probabilities `prob`.
    fn bear<R: Rng>(&mut self, g: &Gaussian<T, NX>, prob: &[T; MODES], rng: &mut R);

    /// Moves on by one jump and by the `steps` of the models, which all targets of a scan share.
    fn predict<M: ModeSet<T, NX, MODES>, R: Rng>(&mut self, modes: &M, jump: &JumpMatrix<T, MODES>, steps: &M::Steps, rng: &mut R);

    /// Adds M_j to `weights`, one for each of the detections numbered `candidates`, and returns m.
    fn weigh<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        sight: &Sight<'_, S, T, MODES>,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        weights: &mut [T],
    ) -> T;

    /// Writes to `child` what this density becomes by `detection`, or by none. Returns how many corrections were refused because
    /// they would have broken a covariance.
    fn absorb<S: Sensor<T, NX, NZ>, R: Rng, const NZ: usize>(
        &self,
        child: &mut Self,
        sight: &Sight<'_, S, T, MODES>,
        detection: Option<&Detection<T, NZ>>,
        rng: &mut R,
    ) -> u16;

    /// μ, the mode probabilities.
    fn prob(&self) -> [T; MODES];

    /// One Gaussian with the moments of all.
    fn combined(&self) -> Gaussian<T, NX>;

    /// Whether all of it is sound: what is not is a target that is gone.
    fn is_valid(&self) -> bool;
}
