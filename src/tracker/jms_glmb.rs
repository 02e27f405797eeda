//! The jump-Markov GLMB filter: a changing number of targets with an identity each, in several modes of motion.
//!
//! One scan, prediction and update in one (Vo, Vo and Hoang, *IEEE Trans. SP* 65(8), 2017; with modes Punchihewa, Vo and
//! Vo, FUSION 2016):
//!
//! ```text
//! predict   every track of the table moves on:  p(x, r') = Σ_r π_rr' ∫ f_r'(x | y) p(y, r) dy      (glmb/density.rs)
//! births    one possible target for every region                                                 (glmb/birth.rs)
//! rows      of every track and birth: gone 1 − P_S, missed P_S m, detections P_S M_j / κ(z_j)      (glmb/row.rs)
//! events    of every hypothesis the heaviest:  w_h Π_t row_t(choice_t),  no detection twice       (glmb/ranked.rs, gibbs.rs)
//! keep      the heaviest of all; equal sets of (label, history of detections) add up             (glmb/pool.rs)
//! absorb    one track for every pair of a track and a choice that is left
//! ```
//!
//! Rows are written once for a track, and a track that is in many hypotheses is updated once. The truncated mass of the
//! [`Report`] is a bound on what was given up of this scan's posterior:
//!
//! ```text
//! truncated ≤ 1 − Σ_kept w / Σ_h w_h Z_h,   Z_h ≥ the weight of all events of h                    (glmb/total.rs)
//! ‖π − π_kept‖₁ ≤ 2 truncated
//! ```
//!
//! It counts hypotheses beyond `HYPS`, tracks beyond `SLOTS`, targets beyond `LABELS`, detections beyond `GATED`, events that
//! were not found and those below the threshold; not what lies outside gates.
//!
//! # Cost
//! With s tracks in the table, b births, h hypotheses of at most ℓ = LABELS rows, m detections and g = GATED, a scan costs at most
//!
//! ```text
//! s predictions of a density,  (s + b) m residuals in every component,  (s + b) g exponentials
//! h rows of events: for Ranked of K events and C columns 3 K ℓ (ℓ + 2) C looks, for Gibbs of K sweeps K ℓ² g
//! h (ℓ² g² comparisons + 448 ℓ multiply-adds) for the total weight
//! h K offers of log₂ HYPS swaps,  HYPS log₂ HYPS comparisons of sets, twice
//! s updates of a density
//! ```
//!
//! and with births from detections m predictions and rows more. [`GlmbState`] is all the memory there is.

use super::glmb_state::{Generation, GlmbState};
use crate::error::{ConfigError, ScanError};
use crate::evidence::LEAST_DENSITY;
use crate::gaussian::Gaussian;
use crate::glmb::{
    Adaptive, Density, GONE, Hypothesis, Label, Limits, Mixture, NO_TRACK, Pool, Problem, Ranked, Region, Row, Sight, Truncation,
    Unexplained, ln_add, ln_total,
};
use crate::initiation::{Initiation, Rule, locate};
use crate::mode::{JumpMatrix, LEAST_PROBABILITY, ModeSet, check_distribution};
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp, is_finite, larger, ln};
use crate::scan::{Detection, Report, Scan, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::time::Duration;
use core::convert::Infallible;
use rand_core::{Rng, TryRng};

/// The configuration of a jump-Markov GLMB tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states, `A` a [`Truncation`]; `BIRTHS` targets at most may be born in a scan.
/// The capacities are those of the [`GlmbState`].
#[derive(Clone, Debug)]
pub struct JmsGlmb<T, M, A, const NX: usize, const MODES: usize, const BIRTHS: usize> {
    modes: M,
    jump: JumpMatrix<T, MODES>,
    p_survive: T,
    visibility: [T; MODES],
    regions: heapless::Vec<Region<T, NX, MODES>, BIRTHS>,
    adaptive: Option<Adaptive<T, NX, MODES>>,
    most: usize,
    ln_share: T,
    truncation: A,
}

/// A scan as the rows are written from it.
struct Look<'a, S, T, const NZ: usize, const MODES: usize, const DETS: usize> {
    sight: Sight<'a, S, T, MODES>,
    detections: &'a [Detection<T, NZ>],
    candidates: &'a heapless::Vec<u16, DETS>,
}

/// Generator of those that draw nothing.
struct NoRandomness;

impl TryRng for NoRandomness {
    type Error = Infallible;
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(0)
    }
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(0)
    }
    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        dst.fill(0);
        Ok(())
    }
}

impl<T: Real, M: ModeSet<T, NX, MODES>, A, const NX: usize, const MODES: usize, const BIRTHS: usize> JmsGlmb<T, M, A, NX, MODES, BIRTHS> {
    /// Modes, their jump matrix π (rows sum to one), and the probability P_S that a target survives from one scan to the next.
    /// No targets appear until [`with_region`](Self::with_region) or [`with_initiation`](Self::with_initiation) says where; all
    /// hypotheses are kept that there is room for.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, p_survive: T, truncation: A) -> Result<Self, ConfigError> {
        jump.iter().try_for_each(check_distribution)?;
        if !(p_survive >= T::ZERO && p_survive <= T::ONE) {
            return Err(ConfigError::NotAProbability);
        }
        let ln_share = -T::ONE / T::ZERO;
        let (visibility, regions) = ([T::ONE; MODES], heapless::Vec::new());
        Ok(Self { modes, jump, p_survive, visibility, regions, adaptive: None, most: usize::MAX, ln_share, truncation })
    }

    /// The same with one more region where targets appear.
    ///
    /// # Errors
    /// Where there are `BIRTHS` regions already.
    pub fn with_region(mut self, region: Region<T, NX, MODES>) -> Result<Self, ConfigError> {
        self.regions.push(region).map_err(|_| ConfigError::TooManyRegions)?;
        Ok(self)
    }

    /// The same where targets also appear at detections of the last scan that no track explains: `expected` of them in a scan,
    /// none with more than the probability `most`, in modes by `modes`. What a detection does not tell comes from the prior of
    /// `initiation`, by [`Rule::OnePoint`]. They take what the regions leave of `BIRTHS`.
    ///
    /// # Errors
    /// Where the numbers are none such, the rule is another, or the modes do not sum to one.
    pub fn with_initiation(
        self,
        initiation: Initiation<T, NX>,
        expected: T,
        most: T,
        modes: [T; MODES],
    ) -> Result<Self, ConfigError> {
        check_distribution(&modes)?;
        if !(most >= T::ZERO && most <= T::ONE) {
            return Err(ConfigError::NotAProbability);
        }
        if !(expected.is_finite() && expected > T::ZERO && initiation.rule == Rule::OnePoint) {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { adaptive: Some(Adaptive { initiation, expected, most, modes }), ..self })
    }

    /// The same for targets that a sensor detects in mode r with `visibility[r]` times its P_D.
    ///
    /// # Errors
    /// Where one is no probability.
    pub fn with_visibility(self, visibility: [T; MODES]) -> Result<Self, ConfigError> {
        let valid = visibility.iter().all(|v| *v >= T::ZERO && *v <= T::ONE);
        if valid { Ok(Self { visibility, ..self }) } else { Err(ConfigError::NotAProbability) }
    }

    /// The same, keeping at most `most` hypotheses, and none that weighs less than `share` of the heaviest.
    ///
    /// # Errors
    /// Where `most` is zero or `share` no probability.
    pub fn with_limits(self, most: usize, share: T) -> Result<Self, ConfigError> {
        match (most, share >= T::ZERO && share <= T::ONE) {
            (0, _) => Err(ConfigError::NotPositive),
            (_, false) => Err(ConfigError::NotAProbability),
            (_, true) => Ok(Self { most, ln_share: ln(share), ..self }),
        }
    }

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan. `rng` is drawn from by densities and
    /// truncations that need it.
    ///
    /// Between scans at the same time, of several sensors, nothing moves, appears or goes.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite, whose gate was made
    /// for another dimension or that states no density of clutter, is refused and the state stays as it was. Load is not an error:
    /// see [`Report`].
    pub fn step_with<
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
        R: Rng,
        const NZ: usize,
        const SLOTS: usize,
        const HYPS: usize,
        const LABELS: usize,
        const GATED: usize,
        const DETS: usize,
    >(
        &self,
        state: &mut GlmbState<T, D, A, SLOTS, HYPS, LABELS, GATED, DETS>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
        rng: &mut R,
    ) -> Result<Report, ScanError>
    where
        A: Truncation<T, LABELS>,
    {
        const {
            assert!(SLOTS > LABELS + BIRTHS, "the table must hold one hypothesis, the births of a scan and one more");
            let sensor = <S::Model as MeasurementModel<T, NX, NZ>>::LAYOUT;
            assert!(M::LAYOUT.agrees(sensor), "sensor and modes disagree on where positions stand");
        }
        scan.check(state.time)?;
        if !sensor.model().is_finite() {
            return Err(ScanError::SensorNotFinite);
        }
        if sensor.gate().dimension() != NZ {
            return Err(ScanError::GateDimension);
        }
        if scan.detections.iter().any(|d| sensor.clutter(&d.z) == Clutter::Diffuse) {
            return Err(ScanError::ClutterUnknown);
        }
        let selection = Selection::<DETS>::new(scan.detections);
        let gap = state.time.map(|last| scan.time.since(last));
        let sight = Sight { sensor, visibility: &self.visibility };
        let look = Look { sight, detections: scan.detections, candidates: &selection.indices };
        let mut report = Report {
            detections: u16::try_from(selection.indices.len()).unwrap_or(u16::MAX),
            detections_dropped: selection.dropped,
            ..Report::default()
        };

        let GlmbState { time, scans, generations: [first, second], second: flipped, rows, memory, unexplained } = state;
        let (old, new) = if *flipped { (second, first) } else { (first, second) };
        self.predict(old, gap, rng);
        let mut resets = self.write_rows(old, rows, &look, gap);
        let (births, ln_unborn) = match gap {
            Some(Duration::ZERO) => (heapless::Vec::new(), T::ZERO),
            _ => self.bear(old, rows, unexplained, *scans, gap, &look, rng),
        };
        let (ln_all, complete) = self.explore(&old.pool, &mut new.pool, rows, &births, memory, rng);

        new.pool.merge();
        new.pool.cut(self.most, self.ln_share);
        assign(new, rows, BIRTHS);
        let ln_kept = new.pool.ln_sum();
        new.pool.all_mut().iter_mut().for_each(|h| h.ln_weight -= ln_kept);
        for place in 0..new.tracks {
            let Some(child) = new.slots.get_mut(place) else { break };
            let (row, choice) = decode::<GATED>(child.origin);
            let Some(parent) = old.slots.get(row) else { break };
            let detection = rows.get(row).and_then(|row| row.outcome(choice)?.detection);
            let detection = detection.and_then(|number| scan.detections.get(usize::from(number)));
            (child.label, child.weight) = (parent.label, T::ZERO);
            resets = resets.saturating_add(parent.density.absorb(&mut child.density, &look.sight, detection, rng));
        }
        for hypothesis in new.pool.all() {
            let weight = exp(hypothesis.ln_weight);
            for track in hypothesis.tracks() {
                new.slots.iter_mut().skip(usize::from(*track)).take(1).for_each(|slot| slot.weight += weight);
            }
        }

        let crowded = rows.iter().take(old.tracks + births.len()).any(|row| row.rest() > T::ZERO);
        if !complete || crowded || new.pool.dropped || ln_unborn > T::ZERO {
            report.truncated_mass = truncated(ln_kept, ln_all + ln_unborn, LABELS + BIRTHS);
        }
        report.numeric_resets = resets;
        let claimed = |number: &&u16| rows.iter().take(old.tracks + births.len()).all(|row| row.hits().iter().all(|o| o.detection != Some(**number)));
        report.detections_unclaimed = selection.indices.iter().filter(claimed).count() as u16;
        let born = births.iter().filter_map(|row| rows.get(usize::from(*row)));
        report.births = born.filter(|row| row.outcomes().any(|o| o.child != NO_TRACK)).count() as u16;
        self.remember(new, rows, &look, unexplained);
        (*time, *flipped) = (Some(scan.time), !*flipped);
        if gap != Some(Duration::ZERO) {
            *scans = scans.saturating_add(1);
        }
        Ok(report)
    }

    /// Between two scans at the same time nothing moves and no mode jumps.
    fn predict<D: Density<T, NX, MODES>, R: Rng, const SLOTS: usize, const HYPS: usize, const LABELS: usize>(
        &self,
        old: &mut Generation<T, D, SLOTS, HYPS, LABELS>,
        gap: Option<Duration>,
        rng: &mut R,
    ) {
        let Some(gap) = gap.filter(|gap| *gap != Duration::ZERO) else { return };
        for slot in old.slots.iter_mut().take(old.tracks) {
            slot.density.predict(&self.modes, &self.jump, gap.as_secs(), rng);
        }
    }

    /// The rows of all tracks. Returns how many tracks are gone because they are not sound.
    fn write_rows<
        S,
        D,
        const NZ: usize,
        const SLOTS: usize,
        const HYPS: usize,
        const LABELS: usize,
        const GATED: usize,
        const DETS: usize,
    >(
        &self,
        old: &Generation<T, D, SLOTS, HYPS, LABELS>,
        rows: &mut [Row<T, GATED>; SLOTS],
        look: &Look<'_, S, T, NZ, MODES, DETS>,
        gap: Option<Duration>,
    ) -> u16
    where
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
    {
        let p_survive = if gap == Some(Duration::ZERO) { T::ONE } else { self.p_survive };
        let mut lost = 0u16;
        for (slot, row) in old.slots.iter().zip(rows).take(old.tracks) {
            lost = lost.saturating_add(u16::from(!look.write(row, &slot.density, p_survive)));
        }
        lost
    }

    /// Writes tracks and rows of this scan's births behind those of the table. Returns their places, the most probable first, and
    /// by how much the logarithm of the weight of all events is larger with those that were left out.
    fn bear<
        S,
        D,
        R,
        const NZ: usize,
        const SLOTS: usize,
        const HYPS: usize,
        const LABELS: usize,
        const GATED: usize,
        const DETS: usize,
    >(
        &self,
        old: &mut Generation<T, D, SLOTS, HYPS, LABELS>,
        rows: &mut [Row<T, GATED>; SLOTS],
        unexplained: &[Unexplained<T>],
        birth_scan: u32,
        gap: Option<Duration>,
        look: &Look<'_, S, T, NZ, MODES, DETS>,
        rng: &mut R,
    ) -> (heapless::Vec<u16, BIRTHS>, T)
    where
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
        R: Rng,
    {
        let (mut births, mut ln_unborn) = (heapless::Vec::<u16, BIRTHS>::new(), T::ZERO);
        let mut bear = |index: usize, existence: T, g: &Gaussian<T, NX>, modes: &[T; MODES], dt: T| {
            let place = old.tracks + births.len();
            let Some((slot, row)) = old.slots.get_mut(place).zip(rows.get_mut(place)) else { return };
            slot.label = Label { birth_scan, index: index as u16 };
            slot.density.bear(g, modes, rng);
            if dt > T::ZERO {
                slot.density.predict(&self.modes, &self.jump, dt, rng);
            }
            look.write(row, &slot.density, existence);
            if births.push(place as u16).is_ok() {
                return;
            }
            // The least probable of those from detections gives way, or this one.
            let alive = |place: u16| rows.get(usize::from(place)).map_or(T::ZERO, Row::alive);
            let others = births.iter().copied().skip(self.regions.len());
            let weakest = others.reduce(|a, b| if alive(b) < alive(a) { b } else { a }).filter(|weakest| alive(*weakest) < alive(place as u16));
            let loser = weakest.map_or(place, usize::from);
            if let Some(row) = rows.get(loser) {
                ln_unborn += row.ln_total - row.outcome(GONE).map_or(T::ZERO, |o| o.ln_weight);
            }
            if loser != place {
                let (to, from) = rows.split_at_mut(place);
                to.get_mut(loser).zip(from.first()).into_iter().for_each(|(to, from)| to.clone_from(from));
                let (to, from) = old.slots.split_at_mut(place);
                to.get_mut(loser).zip(from.first()).into_iter().for_each(|(to, from)| *to = *from);
            }
        };
        for (index, region) in self.regions.iter().enumerate() {
            bear(index, region.existence, &region.density, &region.modes, T::ZERO);
        }
        if let (Some(adaptive), Some(gap)) = (&self.adaptive, gap) {
            let doubts = unexplained.iter().fold(T::ZERO, |sum, seed| sum + seed.doubt);
            for seed in unexplained.iter().filter(|seed| seed.doubt > T::ZERO) {
                let share = adaptive.expected * seed.doubt / doubts;
                let existence = if share < adaptive.most { share } else { adaptive.most };
                let g = adaptive.initiation.one_point(M::LAYOUT, &seed.fix);
                bear(self.regions.len() + usize::from(seed.number), existence, &g, &adaptive.modes, gap.as_secs());
            }
        }
        let alive = |place: u16| rows.get(usize::from(place)).map_or(T::ZERO, Row::alive);
        crate::glmb::sort(&mut births, |a, b| alive(*a) > alive(*b) || alive(*a) == alive(*b) && a < b);
        (births, ln_unborn)
    }

    /// Offers the events of all hypotheses to `pool`. Returns the logarithm of a bound on the weight of all that there are, and
    /// whether all were offered.
    fn explore<R: Rng, const HYPS: usize, const LABELS: usize, const GATED: usize>(
        &self,
        parents: &Pool<T, LABELS, HYPS>,
        pool: &mut Pool<T, LABELS, HYPS>,
        rows: &[Row<T, GATED>],
        births: &[u16],
        memory: &mut A::Memory,
        rng: &mut R,
    ) -> (T, bool)
    where
        A: Truncation<T, LABELS>,
    {
        pool.clear();
        let none = -T::ONE / T::ZERO;
        let (mut ln_all, mut best, mut complete) = (none, none, true);
        let nothing_yet = [Hypothesis::EMPTY];
        let parents = if parents.all().is_empty() { &nothing_yet } else { parents.all() };
        for parent in parents {
            let mut chosen = heapless::Vec::<u16, LABELS>::from_slice(parent.tracks()).unwrap_or_default();
            let (mut ln_unborn, mut ln_absent) = (T::ZERO, T::ZERO);
            for place in births {
                if chosen.push(*place).is_err()
                    && let Some(row) = rows.get(usize::from(*place))
                {
                    ln_unborn += row.ln_total;
                    ln_absent += row.outcome(GONE).map_or(none, |o| o.ln_weight);
                    complete &= row.alive() <= T::ZERO;
                }
            }
            let problem = Problem { rows, chosen: &chosen };
            let ln_base = parent.ln_weight + ln_absent;
            ln_all = ln_add(ln_all, parent.ln_weight + ln_unborn + ln_total(&problem));
            let limits = Limits {
                share: exp(parent.ln_weight),
                ln_least: larger(pool.least(), best + self.ln_share) - ln_base,
                ln_span: -self.ln_share,
            };
            complete &= self.truncation.explore(&problem, &limits, memory, rng, |ln_weight, event| {
                let ln_weight = ln_base + ln_weight;
                best = larger(best, ln_weight);
                let alive = chosen.iter().zip(event).filter(|(_, choice)| **choice != GONE);
                pool.offer(Hypothesis::new(ln_weight, alive.map(|(row, choice)| encode::<GATED>(*row, *choice))));
            });
        }
        (ln_all, complete)
    }

    /// Keeps the detections that the next scan's births may come from.
    fn remember<S, D, const NZ: usize, const SLOTS: usize, const HYPS: usize, const LABELS: usize, const GATED: usize, const DETS: usize>(
        &self,
        new: &Generation<T, D, SLOTS, HYPS, LABELS>,
        rows: &[Row<T, GATED>; SLOTS],
        look: &Look<'_, S, T, NZ, MODES, DETS>,
        unexplained: &mut heapless::Vec<Unexplained<T>, DETS>,
    ) where
        S: Sensor<T, NX, NZ>,
    {
        unexplained.clear();
        if self.adaptive.is_none() {
            return;
        }
        for number in look.candidates {
            let Some(detection) = look.detections.get(usize::from(*number)) else { break };
            let Some(fix) = locate(look.sight.sensor.model(), detection) else { continue };
            let uses = new.slots.iter().take(new.tracks).filter(|slot| {
                let (row, choice) = decode::<GATED>(slot.origin);
                rows.get(row).and_then(|row| row.outcome(choice)?.detection) == Some(*number)
            });
            let doubt = T::ONE - uses.fold(T::ZERO, |sum, slot| sum + slot.weight);
            let _ = unexplained.push(Unexplained { number: *number, fix, doubt });
        }
    }
}

impl<T: Real, M, const NX: usize, const MODES: usize, const BIRTHS: usize, const EVENTS: usize, const COLUMNS: usize>
    JmsGlmb<T, M, Ranked<EVENTS, COLUMNS>, NX, MODES, BIRTHS>
where
    M: ModeSet<T, NX, MODES>,
{
    /// [`step_with`](Self::step_with) for trackers that draw nothing.
    ///
    /// # Errors
    /// As there.
    #[allow(clippy::type_complexity)]
    pub fn step<
        S: Sensor<T, NX, NZ>,
        const NZ: usize,
        const COMPS: usize,
        const SLOTS: usize,
        const HYPS: usize,
        const LABELS: usize,
        const GATED: usize,
        const DETS: usize,
    >(
        &self,
        state: &mut GlmbState<T, Mixture<T, NX, MODES, COMPS>, Ranked<EVENTS, COLUMNS>, SLOTS, HYPS, LABELS, GATED, DETS>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        self.step_with(state, sensor, scan, &mut NoRandomness)
    }
}

impl<S, T: Real, const NZ: usize, const MODES: usize, const DETS: usize> Look<'_, S, T, NZ, MODES, DETS> {
    /// Writes the row of a target that exists with probability `existence`. One whose density is not sound is gone: then `false`.
    fn write<D: Density<T, NX, MODES>, const NX: usize, const GATED: usize>(
        &self,
        row: &mut Row<T, GATED>,
        density: &D,
        existence: T,
    ) -> bool
    where
        S: Sensor<T, NX, NZ>,
    {
        let none = -T::ONE / T::ZERO;
        if !density.is_valid() {
            row.fill(T::ZERO, none, core::iter::empty());
            return false;
        }
        let mut weights = [T::ZERO; DETS];
        let miss = density.weigh(&self.sight, self.detections, self.candidates, &mut weights);
        // A target that cannot be missed can still vanish: some event must remain.
        let ln_missed = ln(larger(miss, T::lit(LEAST_PROBABILITY)));
        let ln_alive = ln(existence);
        let clutter = |number: u16| match self.detections.get(usize::from(number)).map(|d| self.sight.sensor.clutter(&d.z)) {
            Some(Clutter::Poisson(density)) => larger(density, T::lit(LEAST_DENSITY)),
            _ => T::ONE,
        };
        let hits = self.candidates.iter().zip(&weights).filter(|(_, weight)| **weight > T::ZERO && is_finite(**weight));
        let ln_hits = hits.map(|(number, weight)| (*number, ln_alive + ln(*weight) - ln(clutter(*number))));
        row.fill(ln(T::ONE - existence), ln_alive + ln_missed, ln_hits);
        true
    }
}

/// The tracks of hypotheses in the making are numbered by row and choice.
fn encode<const GATED: usize>(row: u16, choice: u16) -> u16 {
    row.wrapping_mul(GATED as u16 + 1).wrapping_add(choice.wrapping_sub(1))
}

/// The row and the choice behind a number.
fn decode<const GATED: usize>(number: u16) -> (usize, u16) {
    let number = usize::from(number);
    (number / (GATED + 1), (number % (GATED + 1)) as u16 + 1)
}

/// Gives a place in the table to every track that a hypothesis has, heaviest hypothesis first; where there is no room for all tracks
/// of one, it is given up. `reserved` places and one more stay free for births.
fn assign<T: Real, D, const SLOTS: usize, const HYPS: usize, const LABELS: usize, const GATED: usize>(
    new: &mut Generation<T, D, SLOTS, HYPS, LABELS>,
    rows: &mut [Row<T, GATED>; SLOTS],
    reserved: usize,
) {
    let Generation { slots, tracks, pool } = new;
    *tracks = 0;
    pool.retain(|hypothesis| {
        let child = |rows: &[Row<T, GATED>; SLOTS], number: u16| {
            let (row, choice) = decode::<GATED>(number);
            rows.get(row).and_then(|row| row.outcome(choice)).map_or(NO_TRACK, |o| o.child)
        };
        let wanted = hypothesis.tracks().iter().filter(|number| child(rows, **number) == NO_TRACK).count();
        if *tracks + wanted + reserved >= SLOTS {
            return false;
        }
        for number in hypothesis.tracks() {
            let (row, choice) = decode::<GATED>(*number);
            if let Some(outcome) = rows.get_mut(row).and_then(|row| row.outcome_mut(choice))
                && outcome.child == NO_TRACK
                && let Some(slot) = slots.get_mut(*tracks)
            {
                (outcome.child, slot.origin) = (*tracks as u16, *number);
                *tracks += 1;
            }
        }
        let known = *hypothesis;
        hypothesis.replace(known.tracks().iter().map(|number| child(rows, *number)));
        true
    });
}

/// A bound on the share of what was given up, rounding included.
fn truncated<T: Real>(ln_kept: T, ln_all: T, rows: usize) -> f32 {
    let rounding = T::EPSILON * T::from_count(4 * rows) * (T::ONE + ln_kept.abs() + ln_all.abs());
    let share = (T::ONE - exp(ln_kept - ln_all) + rounding).to_f64() as f32;
    if share >= 0.0 { share.min(1.0) } else { 1.0 }
}
