//! Coupled filter: two targets that the sensor may not tell apart, with all pairs of modes.
//!
//! One scan:
//!
//! ```text
//! predict    c_J = Σ π_IJ μ_I, mix, predict every pair of modes              (coupled/bank.rs)
//! gate       ν' S⁻¹ ν ≤ γ about either target, and about what both would give as one: one gate each for all pairs of modes,
//!            that of the pair with the largest det S
//! update     in every pair of modes all hypotheses on the gated detections   (coupled/hypotheses.rs)
//! weigh      μ_J ∝ c_J Λ_J, Λ_J the sum of their weights
//! ```
//!
//! Jeong and Tugnait's IMM/JPDAMCF where the sensor states its [`Resolution`](crate::model::resolution::Resolution), the ordinary
//! coupled filter IMM/JPDACF where it does not: then every target gives a detection of its own. With [`NoCross`](crate::coupled::NoCross) what the targets
//! have in common is dropped wherever it would come up. Sensors that look at the same time step one after the other, each about
//! the estimate that the one before has left.
//!
//! Clutter of unknown density: V is the volume of both gates, m the detections that are in any of the three.
//!
//! # Cost
//! With r modes, n detections offered and g ≤ m candidates, operations a scan are at most
//!
//! ```text
//! n DETS comparisons of amplitude  (only where n > DETS)
//! r² (mixing, two predictions and that of what is common)        not between two scans at one time
//! 2 r² predicted measurements of both
//! 3 m + r² (3 g + 2 g (g − 1)) residual forms    m = min(n, DETS) detections taken in
//! r² (3 + 2 of twice the size) inverses, (1 + g)² + g + 1 hypotheses, g of which are of both as one, one correction of both targets
//! ```
//!
//! as [`ImmCoupled::worst_case`] counts them.
//!
//! Memory: [`CoupledState`] is all there is, r² (2 (NX² + NX) + NX²) scalars and DETS candidates; r² · 2 (NX² + NX) without what is common.

use super::Work;
use crate::coupled::as_one::AsOne;
use crate::coupled::{Candidate, CoupledBank, CoupledInnovation, Coupling, Cross, Odds, Sums};
use crate::error::{ConfigError, ScanError};
use crate::evidence::LEAST_DENSITY;
use crate::gaussian::{Gaussian, ResidualDensity, unit_peak};
use crate::mode::{JumpMatrix, ModeSet, check_distribution};
use crate::model::MeasurementModel;
use crate::scalar::{Real, larger, ln};
use crate::scan::{Detection, Estimate, Report, Scan, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::time::{Duration, Instant};
use crate::track::{Identities, Status, TrackId};
use core::marker::PhantomData;
use nalgebra::SVector;

/// The configuration of a coupled filter, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states, for either target; `C` is [`Cross`] or [`NoCross`](crate::coupled::NoCross).
#[derive(Clone, Copy, Debug)]
pub struct ImmCoupled<T, M, const NX: usize, const MODES: usize, C = Cross<T, NX>> {
    modes: M,
    jump: JumpMatrix<T, MODES>,
    initial: [T; MODES],
    coupling: PhantomData<C>,
}

/// All that a coupled filter remembers, and its scratch. All zero bits when new: a `static` costs no flash.
#[derive(Clone, Debug)]
pub struct CoupledState<T, const NX: usize, const MODES: usize, const DETS: usize, C = Cross<T, NX>> {
    time: Option<Instant>,
    ids: Identities,
    pair: Option<[TrackId; 2]>,
    bank: CoupledBank<T, NX, MODES, C>,
    candidates: heapless::Vec<Candidate<T>, DETS>,
    /// P(detected in the last scan) of either
    seen: [T; 2],
    /// P(both were one to the sensor in the last scan)
    unresolved: T,
    resets: u8,
}

impl<T: Real, C: Coupling<T, NX>, const NX: usize, const MODES: usize, const DETS: usize> CoupledState<T, NX, MODES, DETS, C> {
    /// No targets.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            time: None,
            ids: Identities::new(),
            pair: None,
            bank: CoupledBank::ZERO,
            candidates: heapless::Vec::new(),
            seen: [T::ZERO; 2],
            unresolved: T::ZERO,
            resets: 0,
        }
    }

    /// The density of both targets; `None` where none are followed.
    #[must_use]
    pub fn bank(&self) -> Option<&CoupledBank<T, NX, MODES, C>> {
        self.pair.map(|_| &self.bank)
    }

    /// The combined estimates of both targets, computed as they are asked for.
    pub fn estimates(&self) -> impl Iterator<Item = Estimate<T, NX>> {
        let targets = self.pair.map(|ids| (ids, self.bank.combined().targets));
        targets.into_iter().flat_map(|(ids, states)| {
            let status = |seen: T| if seen > T::lit(0.5) { Status::Confirmed } else { Status::Coasting };
            let estimate = move |((id, state), seen)| Estimate { id, status: status(seen), existence: T::ONE, state };
            ids.into_iter().zip(states).zip(self.seen).map(estimate)
        })
    }

    /// The probability that the last scan saw both targets as one; zero where none are followed.
    #[must_use]
    pub fn unresolved_probability(&self) -> T {
        self.pair.map_or(T::ZERO, |_| self.unresolved)
    }

    /// The time of the last scan.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.time
    }

    /// Follows the targets no longer.
    pub fn remove(&mut self) {
        self.pair = None;
    }
}

impl<T: Real, C: Coupling<T, NX>, const NX: usize, const MODES: usize, const DETS: usize> Default for CoupledState<T, NX, MODES, DETS, C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, M: ModeSet<T, NX, MODES>, C: Coupling<T, NX>, const NX: usize, const MODES: usize> ImmCoupled<T, M, NX, MODES, C> {
    /// Modes, their jump matrix π (rows sum to one), and the mode probabilities of a new target.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, initial: [T; MODES]) -> Result<Self, ConfigError> {
        const { assert!(NX >= 1 && MODES >= 1 && MODES <= 32, "a target needs a state and one to 32 modes") }
        jump.iter().try_for_each(check_distribution)?;
        check_distribution(&initial)?;
        Ok(Self { modes, jump, initial, coupling: PhantomData })
    }

    /// Follows the targets `targets` in place of any others. `at` is the time of the last scan, or any before the first; `None` where
    /// it is not, a density is not sound, or all identities are used up.
    pub fn start<const DETS: usize>(
        &self,
        state: &mut CoupledState<T, NX, MODES, DETS, C>,
        targets: [Gaussian<T, NX>; 2],
        at: Instant,
    ) -> Option<[TrackId; 2]> {
        let bank = CoupledBank::new(&self.initial, targets);
        if state.time.is_some_and(|time| time != at) || !bank.is_valid() {
            return None;
        }
        let pair = [state.ids.next()?, state.ids.next()?];
        (state.time, state.pair, state.bank) = (Some(at), Some(pair), bank);
        (state.resets, state.seen, state.unresolved) = (0, [T::ONE; 2], T::ZERO);
        Some(pair)
    }

    /// Takes in one scan of `sensor`. The targets are then at the time of the scan. A correction that would break a covariance is
    /// refused and counted; after a second scan that has one, or a prediction that overflows, the targets are followed no longer.
    ///
    /// Detections count as made at the time of the scan.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite or whose gate was made for
    /// another dimension, is refused and the state stays as it was. Load is not an error: see [`Report`].
    pub fn step<S: Sensor<T, NX, NZ>, const NZ: usize, const DETS: usize>(
        &self,
        state: &mut CoupledState<T, NX, MODES, DETS, C>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        const {
            assert!(
                M::LAYOUT.agrees(<S::Model as MeasurementModel<T, NX, NZ>>::LAYOUT),
                "sensor and modes disagree on where positions stand"
            );
        }
        scan.check(state.time)?;
        if !sensor.model().is_finite() {
            return Err(ScanError::SensorNotFinite);
        }
        if sensor.gate().dimension() != NZ {
            return Err(ScanError::GateDimension);
        }
        let gap = state.time.map_or(Duration::ZERO, |last| scan.time.since(last));
        state.time = Some(scan.time);
        let selection = Selection::<DETS>::new(scan.detections);
        let count = u16::try_from(selection.indices.len()).unwrap_or(u16::MAX);
        let mut report =
            Report { detections: count, detections_dropped: selection.dropped, detections_unclaimed: count, ..Report::default() };
        if state.pair.is_none() {
            return Ok(report);
        }
        self.predict(&mut state.bank, gap);
        let ln_pair = gate(state, sensor, scan.detections, &selection);
        let gated = u16::try_from(state.candidates.len()).unwrap_or(u16::MAX);
        report.detections_unclaimed = count.saturating_sub(gated);
        report.numeric_resets = update(state, sensor, scan.detections, ln_pair);
        report.numeric_resets += u16::from(!state.bank.is_valid());
        if report.numeric_resets > 0 {
            state.resets = state.resets.saturating_add(1);
            if state.resets >= 2 || !state.bank.is_valid() {
                state.pair = None;
                report.tracks_deleted = 2;
            }
        }
        Ok(report)
    }

    /// The most work that a scan of at most `detections` detections can make, none with a noise of its own: the formula of this file.
    #[must_use]
    pub const fn worst_case(detections: usize) -> Work {
        let (m, pairs) = (detections as u64, (MODES * MODES) as u64);
        Work {
            predictions: 2 * pairs,
            innovations: 4 * pairs,
            // Three gates; in every pair of modes a detection of one target or of both, and of two detections two residuals.
            residuals: 3 * m + pairs * (3 * m + 2 * m * m.saturating_sub(1)),
            corrections: 2 * pairs,
            // No detection, one of either or of both, or one of each.
            association: pairs * ((1 + m) * (1 + m) + m + 1),
            as_one: pairs * (2 + m),
            ..Work::imm_pdaf(0, 0, 0)
        }
    }

    // One copy for all sensors.
    #[inline(never)]
    fn predict(&self, bank: &mut CoupledBank<T, NX, MODES, C>, gap: Duration) {
        if gap != Duration::ZERO {
            bank.interact(&self.jump);
            bank.predict(&self.modes, gap.as_secs());
        }
    }
}

/// The widest gate of one kind.
struct Widest<T, const NZ: usize> {
    z_hat: SVector<T, NZ>,
    density: Option<ResidualDensity<T, NZ>>,
}

impl<T: Real, const NZ: usize> Widest<T, NZ> {
    #[inline(always)]
    fn offer(&mut self, z_hat: &SVector<T, NZ>, density: &ResidualDensity<T, NZ>) {
        if density.is_proper() && self.density.is_none_or(|widest| density.peak < widest.peak) {
            (self.z_hat, self.density) = (*z_hat, Some(*density));
        }
    }
}

/// Gates the detections by the widest pairs of modes and finds what clutter weighs. Returns ln m / (m − 1) where it is diffuse.
#[inline(never)]
fn gate<T, S, C, const NX: usize, const NZ: usize, const MODES: usize, const DETS: usize>(
    state: &mut CoupledState<T, NX, MODES, DETS, C>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    selection: &Selection<DETS>,
) -> T
where
    T: Real,
    S: Sensor<T, NX, NZ>,
    C: Coupling<T, NX>,
{
    let (model, threshold, candidates) = (sensor.model(), sensor.gate().threshold(), &mut state.candidates);
    let mut widest: [Widest<T, NZ>; 3] = core::array::from_fn(|_| Widest { z_hat: SVector::zeros(), density: None });
    let possible = state.bank.prob.iter().flatten().zip(state.bank.pairs.iter().flatten()).filter(|(p, _)| **p > T::ZERO);
    for (_, pair) in possible {
        let innovation = pair.innovation(model);
        for (r, widest) in widest.iter_mut().take(2).enumerate() {
            widest.offer(&innovation.z_hat[r], &innovation.density[r]);
        }
        if let Some(resolution) = sensor.resolution() {
            let noise = &innovation.noise[0];
            let odds = Odds { p_detect: [T::ONE; 2], p_gate: T::ONE, ln_pair: T::ZERO };
            let as_one = AsOne::new(model, &innovation.z_hat, &innovation.spread, noise, resolution, &odds);
            let (z_hat, density) = as_one.predicted(resolution.noise.as_ref().unwrap_or(noise));
            widest[2].offer(&z_hat, &density);
        }
    }
    candidates.clear();
    for &number in &selection.indices {
        let Some(detection) = detections.get(usize::from(number)) else { continue };
        let [first, second, merged] = widest
            .each_ref()
            .map(|Widest { z_hat, density }| density.is_some_and(|density| density.nis(&model.residual(&detection.z, z_hat)) <= threshold));
        if first || second || merged {
            let _ = candidates.push(Candidate { number, gated: [first, second], merged, ln_rate: T::ZERO });
        }
    }
    let mut volume = T::ZERO;
    for widest in widest.iter().take(2) {
        let peak = widest.density.map_or(T::ZERO, |density| density.peak);
        volume += if peak > T::ZERO { sensor.gate().volume(unit_peak::<T, NZ>() / peak) } else { T::ZERO };
    }
    let clutter = |candidate: &Candidate<T>| detections.get(usize::from(candidate.number)).map(|d| sensor.clutter(&d.z));
    let diffuse = candidates.iter().filter(|c| clutter(c) == Some(Clutter::Diffuse)).count();
    let estimated = T::from_count(diffuse) / volume;
    for candidate in candidates.iter_mut() {
        let density = match clutter(candidate) {
            Some(Clutter::Poisson(density)) => density,
            _ => estimated,
        };
        candidate.ln_rate = -ln(larger(density, T::lit(LEAST_DENSITY)));
    }
    // Where some densities are known, those estimated count as known too.
    if diffuse > 1 && diffuse == candidates.len() { ln(T::from_count(diffuse) / T::from_count(diffuse - 1)) } else { T::ZERO }
}

/// Updates every pair of modes by all hypotheses. Returns how many corrections were refused.
#[inline(never)]
fn update<T, S, C, const NX: usize, const NZ: usize, const MODES: usize, const DETS: usize>(
    state: &mut CoupledState<T, NX, MODES, DETS, C>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    ln_pair: T,
) -> u16
where
    T: Real,
    S: Sensor<T, NX, NZ>,
    C: Coupling<T, NX>,
{
    let CoupledState { bank, candidates, seen, unresolved, .. } = state;
    let model = sensor.model();
    let (mut ln_evidence, mut resets) = ([[T::ZERO; MODES]; MODES], 0);
    let mut found = [[([T::ZERO; 2], T::ZERO); MODES]; MODES];
    for i in 0..MODES {
        for j in 0..MODES {
            let pair = &mut bank.pairs[i][j];
            let innovation: CoupledInnovation<T, NX, NZ> = pair.innovation(model);
            let means = pair.targets.each_ref().map(|target| &target.mean);
            let odds = Odds { p_detect: means.map(|x| sensor.p_detect(x)), p_gate: sensor.gate().p_gate(), ln_pair };
            let mut sums = Sums::new();
            innovation.hypotheses(model, sensor.resolution(), &odds, detections, candidates, |h| sums.take(h));
            ln_evidence[i][j] = sums.ln_evidence();
            found[i][j] = sums.probabilities();
            let (w, e) = sums.correction();
            resets += u16::from(!pair.correct(&innovation, &w, &e));
        }
    }
    bank.weigh(&ln_evidence);
    (*seen, *unresolved) = ([T::ZERO; 2], T::ZERO);
    for (p, (of_pair, as_one)) in bank.prob.iter().flatten().zip(found.iter().flatten()) {
        *unresolved += *p * *as_one;
        for (seen, of_pair) in seen.iter_mut().zip(of_pair) {
            *seen += *p * *of_pair;
        }
    }
    resets
}
