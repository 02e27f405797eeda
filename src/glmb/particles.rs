//! Points in every mode: the sequential Monte Carlo form, for models and sensors that no Gaussian serves.
//!
//! ```text
//! predict   a jump drawn for every point;  x_i ← f(x_i),  and the noise Q of the step is not drawn yet
//! weigh     M_j = 1/N Σ_i P_D(x_i) N(z_j; h(x_i), H Q H' + R) over the points in whose gate z_j lies
//! absorb    points drawn anew in proportion to their terms (systematic resampling), and each from what its noise has become:
//!           N(x_i, Q) updated by z_j, or N(x_i, Q) itself where nothing was detected
//! ```
//!
//! Drawing the noise after the detection is known is the optimal importance function for one step (Doucet, Godsill and
//! Andrieu 2000, section II.D): without it hardly a point in a hundred would lie near an accurate detection. h is linearised,
//! or taken at sigma points, over the noise of a step, not over the spread of the target. A newborn target is one point whose
//! noise is the whole density of its birth.
//!
//! The points of a target that hardly manoeuvres lose their variety: with little process noise prefer Gaussians.

use super::density::{Density, Sight};
use super::mixture::{correct, gated_density, weigh_part};
use super::random;
use crate::gaussian::Gaussian;
use crate::mode::{JumpMatrix, ModeSet};
use crate::model::MeasurementModel;
use crate::scalar::Real;
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use nalgebra::SVector;
use rand_core::Rng;

/// `POINTS` points of equal weight. The noise of a mode is that of its last point: models whose Q depends on the state are served
/// to that accuracy.
///
/// A prediction costs `POINTS` predictions of one mode and draws; a row `POINTS` innovations and residuals for every detection; a
/// track that is kept as much once more, and a factorisation of its noise for every point that is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Particles<T, const NX: usize, const MODES: usize, const POINTS: usize> {
    points: [Point<T, NX>; POINTS],
    /// By mode, the covariance of what is still to be drawn
    noise: [Symmetric<T, NX>; MODES],
}

#[derive(Clone, Copy, Debug)]
struct Point<T, const NX: usize> {
    x: SVector<T, NX>,
    mode: u8,
}

impl<T: Real, const NX: usize, const MODES: usize, const POINTS: usize> Particles<T, NX, MODES, POINTS> {
    /// A point with its noise.
    fn kernel(&self, point: &Point<T, NX>) -> (usize, Gaussian<T, NX>) {
        let mode = usize::from(point.mode);
        (mode, Gaussian::new(point.x, self.noise.get(mode).copied().unwrap_or(Symmetric::zeros())))
    }
}

/// One draw from `g`; its mean where the covariance has no factor.
fn draw<T: Real, R: Rng, const NX: usize>(g: &Gaussian<T, NX>, factor: Option<&[[T; NX]; NX]>, rng: &mut R) -> SVector<T, NX> {
    let Some(l) = factor else { return g.mean };
    let n = random::normal::<T, R, NX>(rng);
    SVector::from_fn(|i, _| (0..=i).fold(g.mean.data.0[0][i], |x, j| x + l[i][j] * n.data.0[0][j]))
}

impl<T: Real, const NX: usize, const MODES: usize, const POINTS: usize> Density<T, NX, MODES> for Particles<T, NX, MODES, POINTS> {
    const ZERO: Self = {
        assert!(POINTS >= 1 && MODES >= 1 && MODES <= 255, "a density needs a point");
        let point = Point { x: Gaussian::<T, NX>::ZERO.mean, mode: 0 };
        Self { points: [point; POINTS], noise: [Symmetric::zeros(); MODES] }
    };
    const COMPONENTS: usize = POINTS;

    fn bear<R: Rng>(&mut self, g: &Gaussian<T, NX>, prob: &[T; MODES], rng: &mut R) {
        self.noise = [g.cov; MODES];
        for point in &mut self.points {
            *point = Point { x: g.mean, mode: random::index(prob.iter().copied(), rng).unwrap_or(0) as u8 };
        }
    }

    fn predict<M: ModeSet<T, NX, MODES>, R: Rng>(&mut self, modes: &M, jump: &JumpMatrix<T, MODES>, steps: &M::Steps, rng: &mut R) {
        let before = self.noise;
        for point in &mut self.points {
            let from = usize::from(point.mode);
            let mode = jump.get(from).and_then(|row| random::index(row.iter().copied(), rng)).unwrap_or(from);
            let mut g = Gaussian::new(point.x, before.get(from).copied().unwrap_or(Symmetric::zeros()));
            modes.advance(mode, &mut g, steps);
            *point = Point { x: g.mean, mode: mode as u8 };
            self.noise.iter_mut().skip(mode).take(1).for_each(|noise| *noise = g.cov);
        }
    }

    fn weigh<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        sight: &Sight<'_, S, T, MODES>,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        weights: &mut [T],
    ) -> T {
        let share = T::ONE / T::from_count(POINTS);
        self.points.iter().fold(T::ZERO, |miss, point| {
            let (mode, g) = self.kernel(point);
            miss + weigh_part(sight, (share, mode, &g), detections, candidates, weights)
        })
    }

    fn absorb<S: Sensor<T, NX, NZ>, R: Rng, const NZ: usize>(
        &self,
        child: &mut Self,
        sight: &Sight<'_, S, T, MODES>,
        detection: Option<&Detection<T, NZ>>,
        rng: &mut R,
    ) -> u16 {
        let mut terms = [T::ZERO; POINTS];
        let mut sum = T::ZERO;
        for (term, point) in terms.iter_mut().zip(&self.points) {
            let (mode, g) = self.kernel(point);
            let p_detect = sight.p_detect(mode, &g.mean);
            *term = match detection {
                None => T::ONE - p_detect * sight.sensor.gate().p_gate(),
                Some(d) => p_detect * gated_density(sight.sensor, &g, &sight.sensor.model().innovation(&g), d),
            };
            sum += *term;
        }
        if sum <= T::ZERO {
            // Not to be missed, and missed: nothing is learnt.
            (terms, sum) = ([T::ONE; POINTS], T::from_count(POINTS));
        }
        child.noise = [Symmetric::zeros(); MODES];
        // Systematic: the teeth of a comb with one random offset pick points by their shares of its length.
        let (tooth, mut at) = (sum / T::from_count(POINTS), T::ZERO);
        let mut next = random::uniform::<T, R>(rng) * tooth;
        let (mut resets, mut places) = (0u16, child.points.iter_mut().peekable());
        let mut last = 0;
        for (place, (point, term)) in self.points.iter().zip(&terms).enumerate() {
            at += *term;
            if next >= at || places.peek().is_none() {
                continue;
            }
            let (g, factor) = self.resolve(point, sight, detection, &mut resets);
            while next < at
                && let Some(free) = places.next()
            {
                *free = Point { x: draw(&g, factor.as_ref(), rng), mode: point.mode };
                next += tooth;
            }
            last = place;
        }
        // Rounding may leave the last tooth beyond the end.
        if let Some(point) = self.points.get(last) {
            let (g, factor) = self.resolve(point, sight, detection, &mut resets);
            places.for_each(|free| *free = Point { x: draw(&g, factor.as_ref(), rng), mode: point.mode });
        }
        resets
    }

    fn prob(&self) -> [T; MODES] {
        let share = T::ONE / T::from_count(POINTS);
        let mut prob = [T::ZERO; MODES];
        for point in &self.points {
            prob.iter_mut().skip(usize::from(point.mode)).take(1).for_each(|p| *p += share);
        }
        prob
    }

    fn combined(&self) -> Gaussian<T, NX> {
        let share = T::ONE / T::from_count(POINTS);
        Gaussian::moment_match(self.points.iter().map(|point| (share, self.kernel(point).1)))
    }

    fn is_valid(&self) -> bool {
        let sum = self.points.iter().fold(T::ZERO, |sum, point| point.x.iter().fold(sum, |sum, x| sum + x.abs()));
        sum <= T::lit(1e15) && self.noise.iter().all(Symmetric::has_valid_variances)
    }
}

impl<T: Real, const NX: usize, const MODES: usize, const POINTS: usize> Particles<T, NX, MODES, POINTS> {
    /// What the noise of `point` is once the detection is known, and its factor.
    fn resolve<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        point: &Point<T, NX>,
        sight: &Sight<'_, S, T, MODES>,
        detection: Option<&Detection<T, NZ>>,
        resets: &mut u16,
    ) -> (Gaussian<T, NX>, Option<[[T; NX]; NX]>) {
        let (_, mut g) = self.kernel(point);
        if let Some(detection) = detection {
            let (model, innovation) = (sight.sensor.model(), sight.sensor.model().innovation(&g));
            *resets = resets.saturating_add(u16::from(!correct(model, &mut g, &innovation, detection)));
        }
        let factor = g.cov.cholesky();
        (g, factor)
    }
}
