//! Starting tracks: from one detection, or from two of successive scans.
//!
//! ```text
//! one point   p = z,                 v = 0 (or the measured radial speed along the line of sight)
//! two points  p = z₂, v from the prior; then a Kalman update by z₁ = p − T v + noise (R₁),
//!             if |z₂ − z₁| ≤ v_max T + 3 √tr(R₁ + R₂)
//! radial      v ← v + K (ṙ − u'v), one scalar Kalman update with the line of sight u;
//!             ṙ modulo 2 V only if 3 √S ≤ V, by the fold nearest to u'v
//! offset      seen δ after the scan: x ← F x, P ← F P F' over −δ to the scan, and T from detection to detection
//! ```
//!
//! Everything else (velocities, accelerations, turn rates) is taken from a prior density. With a prior velocity far wider
//! than the measurement allows, two points give v = (z₂ − z₁)/T and P = [R₂  R₂/T; ·  (R₁ + R₂)/T²], two-point
//! differencing (Bar-Shalom, Li and Kirubarajan 2001, section 5.5.3); with detections close in time the prior keeps the
//! speed physical. Every pair of an unclaimed detection
//! and a remembered one starts a tentative track (Kashyap et al. 2006, "Automatic track formation").

use crate::bytes::Digest;
use crate::error::ConfigError;
use crate::gaussian::{Gaussian, Innovation};
use crate::model::offset::shift;
use crate::model::{Fix, Layout, MeasurementModel};
use crate::scalar::{Real, fold, sqrt};
use crate::scan::Detection;
use crate::symmetric::Symmetric;
use crate::time::{Duration, Instant};
use nalgebra::{SMatrix, SVector};

/// How tracks are started from detections that no track claims.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Initiation<T, const NX: usize> {
    pub(crate) prior: Gaussian<T, NX>,
    pub(crate) rule: Rule<T>,
}

/// How many detections make a track.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rule<T> {
    /// Tracks are started by the caller alone.
    Off,
    /// Every unclaimed detection starts a tentative track.
    OnePoint,
    /// Two unclaimed detections, at most `max_gap` apart in time, that a target slower than `max_speed` \[m/s\] could
    /// have caused.
    TwoPoint {
        /// The largest speed of a target \[m/s\]
        max_speed: T,
        /// How long a detection waits for its partner, from scan to scan
        max_gap: Duration,
    },
}

impl<T: Real, const NX: usize> Initiation<T, NX> {
    /// By `rule`; what the detections do not tell is taken from `prior`.
    ///
    /// # Errors
    /// Where `prior` is not positive semi-definite or not finite, or the rule's speed or gap is not positive.
    pub fn new(rule: Rule<T>, prior: Gaussian<T, NX>) -> Result<Self, ConfigError> {
        if !(prior.mean.iter().all(|v| v.is_finite()) && prior.cov.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        if prior.cov.cholesky().is_none() {
            return Err(ConfigError::NotDefinite);
        }
        if let Rule::TwoPoint { max_speed, max_gap } = rule
            && !(max_speed > T::ZERO && max_gap > Duration::ZERO)
        {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { prior, rule })
    }

    /// None: tracks are started by the caller.
    pub(crate) const fn off() -> Self {
        Self { prior: Gaussian::ZERO, rule: Rule::Off }
    }

    /// The density, at the time of the scan, of a target seen at `fix`.
    pub(crate) fn one_point(&self, layout: Layout, fix: &Fix<T>) -> Gaussian<T, NX> {
        let mut g = self.prior;
        let axes = || (0..layout.axes.min(3)).map(|a| (a, a * layout.stride));
        let p = g.cov.upper_mut();
        for (a, i) in axes() {
            for k in 0..NX {
                let (row, column) = (i.min(k), i.max(k));
                if let Some(v) = p.get_mut(row).and_then(|r| r.get_mut(column)) {
                    *v = T::ZERO;
                }
            }
            if let Some(x) = g.mean.get_mut(i) {
                *x = fix.position[a];
            }
        }
        for (a, i) in axes() {
            for (b, j) in axes().skip(a) {
                if let Some(v) = p.get_mut(i).and_then(|r| r.get_mut(j)) {
                    *v = fix.cov.at(a, b);
                }
            }
        }
        radial_update(&mut g, layout, fix);
        to_scan(&mut g, layout, fix);
        g
    }

    /// The density, at the time of the second scan, of a target seen at `first` and `dt` \[s\] later at `second`.
    pub(crate) fn two_points(&self, layout: Layout, first: &Fix<T>, second: &Fix<T>, dt: T) -> Gaussian<T, NX> {
        let mut g = self.one_point(layout, &Fix { radial: None, offset: Duration::ZERO, ..*second });
        // The first detection as a measurement p − T v of the state at the second; axes the state lacks measure zero.
        let axis = |a: usize| (a < layout.axes).then_some(a * layout.stride);
        let entry = |i: usize, j: usize| g.cov.get(i, j).unwrap_or(T::ZERO);
        let cross = SMatrix::<T, NX, 3>::from_fn(|i, a| axis(a).map_or(T::ZERO, |k| entry(i, k) - dt * entry(i, k + 1)));
        let at = |i: usize, a: usize| cross.get((i, a)).copied().unwrap_or(T::ZERO);
        let spread = Symmetric::from_fn(|a, b| axis(a).map_or(T::ZERO, |k| at(k, b) - dt * at(k + 1, b)));
        let noise = Symmetric::from_fn(|a, b| if axis(b).is_some() { first.cov.at(a, b) } else { T::from_count(usize::from(a == b)) });
        let state = |k: usize| g.mean.get(k).copied().unwrap_or(T::ZERO);
        let nu = SVector::from_fn(|a, _| axis(a).map_or(T::ZERO, |k| first.position[a] - (state(k) - dt * state(k + 1))));
        let innovation = Innovation::new(SVector::zeros(), cross, spread, &noise);
        // Where the correction would break the covariance the track starts from the second detection alone.
        let _ = g.update(&innovation, &nu);
        radial_update(&mut g, layout, second);
        to_scan(&mut g, layout, second);
        g
    }
}

/// Where and when a detection of `model` was made, if it tells.
pub(crate) fn locate<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    model: &M,
    detection: &Detection<T, NZ>,
) -> Option<Fix<T>> {
    let noise = detection.noise.unwrap_or_else(|| model.nominal_noise());
    let mut fix = model.locate(&detection.z, &noise)?;
    fix.offset = detection.offset;
    let dt = fix.offset.as_secs::<T>();
    for (p, v) in fix.position.iter_mut().zip(model.velocity()) {
        *p += dt * v;
    }
    Some(fix)
}

/// From the time of the detection to that of its scan.
fn to_scan<T: Real, const NX: usize>(g: &mut Gaussian<T, NX>, layout: Layout, fix: &Fix<T>) {
    if fix.offset != Duration::ZERO {
        shift(g, layout, -fix.offset.as_secs::<T>());
    }
}

/// Corrects the velocity by a measured radial speed.
fn radial_update<T: Real, const NX: usize>(g: &mut Gaussian<T, NX>, layout: Layout, fix: &Fix<T>) {
    let Some(radial) = &fix.radial else { return };
    let axes = || (0..layout.axes.min(3)).map(|a| (radial.direction[a], a * layout.stride + 1));
    let mut cross = SMatrix::<T, NX, 1>::zeros();
    for (i, c) in cross.iter_mut().enumerate() {
        for (u, k) in axes() {
            *c += g.cov.get(i, k).unwrap_or(T::ZERO) * u;
        }
    }
    let (mut spread, mut predicted) = (T::ZERO, T::ZERO);
    for (u, k) in axes() {
        spread += u * cross.get(k).copied().unwrap_or(T::ZERO);
        predicted += u * g.mean.get(k).copied().unwrap_or(T::ZERO);
    }
    let deviation = sqrt(spread + radial.variance);
    if radial.unambiguous.is_some_and(|v| T::lit(3.0) * deviation > v) {
        return;
    }
    let nu = radial.speed - predicted;
    let nu = radial.unambiguous.map_or(nu, |v| fold(nu, v));
    let noise = Symmetric::from_diagonal([radial.variance]);
    let innovation = Innovation::new(SVector::from([predicted]), cross, Symmetric::from_diagonal([spread]), &noise);
    let mut h = SMatrix::<T, 1, NX>::zeros();
    for (u, k) in axes() {
        if let Some(entry) = h.get_mut(k) {
            *entry = u;
        }
    }
    // Range-rate is far more accurate than the prior speed: Joseph's form. Where even that breaks the covariance the track
    // starts without the radial speed.
    let _ = g.update_joseph(&innovation, &h, &noise, &SVector::from([nu]));
}

/// A detection that waits for its partner; `time` is that of its scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seed<T> {
    pub time: Instant,
    pub fix: Fix<T>,
}

impl<T: Real> Seed<T> {
    /// Adds all of the seed to `digest`.
    pub fn fold_into(&self, digest: &mut Digest) {
        let Fix { position, cov, radial, offset } = &self.fix;
        digest.wide(self.time.as_micros());
        digest.wide(offset.as_micros() as u64);
        position.iter().for_each(|p| digest.real(*p));
        digest.upper(cov);
        if let Some(radial) = radial {
            radial.direction.iter().chain([&radial.speed, &radial.variance]).chain(&radial.unambiguous).for_each(|x| digest.real(*x));
        }
    }

    /// The seconds from this detection to one at `fix` in the scan at `time`, if a target no faster than `max_speed` could have made both.
    pub fn pairs_with(&self, fix: &Fix<T>, time: Instant, layout: Layout, max_speed: T, max_gap: Duration) -> Option<T> {
        let gap = time.since(self.time);
        let later = fix.offset.as_micros().saturating_sub(self.fix.offset.as_micros());
        let between = Duration::from_micros(gap.as_micros().saturating_add(later));
        if between <= Duration::ZERO || gap > max_gap {
            return None;
        }
        let dt = between.as_secs::<T>();
        let (mut distance2, mut variance) = (T::ZERO, T::ZERO);
        let axes = layout.axes.min(3);
        for a in 0..axes {
            let d = fix.position[a] - self.fix.position[a];
            distance2 += d * d;
            variance += fix.cov.at(a, a) + self.fix.cov.at(a, a);
        }
        let reach = max_speed * dt + T::lit(3.0) * sqrt(variance);
        (distance2 <= reach * reach).then_some(dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::RadialSpeed;

    const LAYOUT: Layout = Layout { axes: 2, stride: 3 };

    fn fix(x: f64, y: f64) -> Fix<f64> {
        Fix { position: [x, y, 0.0], cov: Symmetric::from_fn(|i, j| if i == j { 25.0 } else { 5.0 }), radial: None, offset: Duration::ZERO }
    }

    fn initiation(velocity_variance: f64) -> Result<Initiation<f64, 6>, ConfigError> {
        let diagonal = [1.0, velocity_variance, 2.0, 1.0, velocity_variance, 2.0];
        Initiation::new(Rule::OnePoint, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(diagonal)))
    }

    #[test]
    fn two_points_under_a_wide_prior_are_two_point_differencing() {
        let g = initiation(1e9).map(|i| i.two_points(LAYOUT, &fix(0.0, 10.0), &fix(8.0, 6.0), 2.0));
        assert!(g.is_ok_and(|g| (g.mean - SVector::from([8.0, 4.0, 0.0, 6.0, -2.0, 0.0])).abs().max() < 1e-6));
        assert!(g.is_ok_and(|g| {
            let got = [(0, 0), (0, 1), (0, 3), (0, 4), (1, 1), (1, 4), (2, 2)].map(|(i, j)| g.cov.at(i, j));
            let differencing = [25.0, 12.5, 5.0, 2.5, 12.5, 2.5, 2.0];
            got.iter().zip(differencing).all(|(got, want)| (got - want).abs() < 1e-5)
        }));
    }

    #[test]
    fn two_points_close_in_time_keep_the_speed_of_the_prior() {
        let g = initiation(400.0).map(|i| i.two_points(LAYOUT, &fix(0.0, 10.0), &fix(8.0, 6.0), 0.001));
        assert!(g.is_ok_and(|g| g.mean[1].abs() < 1.0 && (g.cov.at(1, 1) - 400.0).abs() < 1.0));
        assert!(g.is_ok_and(|g| g.cov.is_definite()));
    }

    #[test]
    fn a_radial_speed_sets_the_velocity_along_the_line_of_sight_only() {
        let radial = RadialSpeed { direction: [0.6, 0.8, 0.0], speed: -20.0, variance: 1e-6, unambiguous: None };
        let g = initiation(100.0).map(|i| i.one_point(LAYOUT, &Fix { radial: Some(radial), ..fix(300.0, 400.0) }));
        assert!(g.is_ok_and(|g| {
            let along = 0.6 * g.mean[1] + 0.8 * g.mean[4];
            let across = 0.8 * g.mean[1] - 0.6 * g.mean[4];
            let variance = 0.64 * g.cov.at(1, 1) + 0.36 * g.cov.at(4, 4) - 0.96 * g.cov.at(1, 4);
            (along + 20.0).abs() < 1e-3 && across.abs() < 1e-9 && (variance - 100.0).abs() < 1e-6
        }));
    }

    /// Along the line of sight of `fix` with a radial speed measured modulo 2 V: speed and variance.
    fn along(velocity_variance: f64, mean: f64, speed: f64, unambiguous: f64) -> Option<(f64, f64)> {
        let radial = RadialSpeed { direction: [0.6, 0.8, 0.0], speed, variance: 1.0, unambiguous: Some(unambiguous) };
        let diagonal = [1.0, velocity_variance, 2.0, 1.0, velocity_variance, 2.0];
        let prior = Gaussian::new(SVector::from([0.0, 0.6 * mean, 0.0, 0.0, 0.8 * mean, 0.0]), Symmetric::from_diagonal(diagonal));
        let g = Initiation::new(Rule::OnePoint, prior).ok()?.one_point(LAYOUT, &Fix { radial: Some(radial), ..fix(300.0, 400.0) });
        let variance = 0.36 * g.cov.at(1, 1) + 0.64 * g.cov.at(4, 4) + 0.96 * g.cov.at(1, 4);
        Some((0.6 * g.mean[1] + 0.8 * g.mean[4], variance))
    }

    #[test]
    fn a_folded_radial_speed_is_taken_by_the_nearest_fold_or_not_at_all() {
        // 3 √(24 + 1) = 15 m/s: certain up to there. The scalar Kalman update of 95 ± √24 by 98 ± 1 m/s, folded by 2 · 15 or not.
        let (speed, variance) = (95.0 + 24.0 / 25.0 * 3.0, 24.0 / 25.0);
        for folds in [-4.0, -1.0, 0.0, 2.0] {
            let near = |(s, v): (f64, f64)| (s - speed).abs() < 1e-9 && (v - variance).abs() < 1e-9;
            assert!(along(24.0, 95.0, 98.0 + 30.0 * folds, 15.0).is_some_and(near));
            let untouched = |(s, v): (f64, f64)| (s - 95.0).abs() < 1e-9 && (v - 24.0).abs() < 1e-9;
            assert!(along(24.0, 95.0, 98.0 + 29.0 * folds, 14.5).is_some_and(untouched));
        }
    }

    #[test]
    fn what_was_seen_before_or_after_its_scan_is_brought_to_it() {
        // By hand: half a second from the scan the velocity's ten m/s of deviation are five metres, and correlated.
        for (millis, s) in [(500, 0.5), (-500, -0.5)] {
            let seen = Fix { offset: Duration::from_millis(millis), ..fix(300.0, 400.0) };
            let prior =
                Gaussian::new(SVector::from([0.0, 8.0, 0.0, 0.0, -6.0, 0.0]), Symmetric::from_diagonal([1.0, 100.0, 0.0, 1.0, 100.0, 0.0]));
            let g = Initiation::new(Rule::OnePoint, prior).map(|i| i.one_point(LAYOUT, &seen));
            assert!(g.is_ok_and(|g| {
                let got = [(0, 0), (0, 1), (1, 1), (0, 3), (3, 3), (3, 4)].map(|(i, j)| g.cov.at(i, j));
                let want = [50.0, -100.0 * s, 100.0, 5.0, 50.0, -100.0 * s];
                let mean = SVector::from([300.0 - 8.0 * s, 8.0, 0.0, 400.0 + 6.0 * s, -6.0, 0.0]);
                (g.mean - mean).abs().max() < 1e-9 && got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-9)
            }));
        }
        // Two points of one line, whatever the times: x = 4 t, y = 10 − 2 t, of scans at 0 and 2 s.
        for (first, second) in [(0, 700), (-900, 0), (800, -900), (-300, 400)] {
            let at = |scan: f64, millis: i64| {
                let t = scan + 1e-3 * millis as f64;
                Fix { offset: Duration::from_millis(millis), ..fix(4.0 * t, 10.0 - 2.0 * t) }
            };
            let (seed, fix) = (Seed { time: Instant::ZERO, fix: at(0.0, first) }, at(2.0, second));
            let dt = seed.pairs_with(&fix, Instant::from_millis(2000), LAYOUT, 10.0, Duration::from_millis(2000));
            assert_eq!(dt, Some((2000 + second - first) as f64 / 1000.0));
            let g = dt.and_then(|dt| Some(initiation(1e9).ok()?.two_points(LAYOUT, &seed.fix, &fix, dt)));
            assert!(g.is_some_and(|g| (g.mean - SVector::from([8.0, 4.0, 0.0, 6.0, -2.0, 0.0])).abs().max() < 1e-5));
        }
    }

    #[test]
    fn only_possible_pairs_are_made() {
        let seed = Seed { time: Instant::from_millis(1000), fix: fix(0.0, 0.0) };
        let pair =
            |x: f64, millis: u64| seed.pairs_with(&fix(x, 0.0), Instant::from_millis(millis), LAYOUT, 10.0, Duration::from_millis(2000));
        assert_eq!(pair(39.0, 2000), Some(1.0));
        assert_eq!(pair(41.0, 2000), None);
        assert_eq!(pair(0.0, 1000), None);
        assert_eq!(pair(0.0, 3001), None);
        assert_eq!(pair(0.0, 500), None);
    }
}
