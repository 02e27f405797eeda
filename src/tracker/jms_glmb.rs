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
//! Every loop is bounded by the capacities. The formula of all of them is in `glmb/work.rs` and, for given ones,
//! [`GlmbState::worst_case`]; what a scan costs in the mean is far less: a prediction and a row for every track in the table, and
//! a few assignments for every hypothesis. Gibbs sampling takes K LABELS² GATED comparisons a hypothesis for K sweeps instead of
//! the assignments. [`GlmbState`] is all the memory there is.

use super::glmb_cycle::{Arrivals, Births};
use super::glmb_state::GlmbState;
use crate::error::{ConfigError, ScanError};
use crate::glmb::{Adaptive, COUNTED, Density, Look, Mixture, Ranked, Region, Row, Sight, Truncation};
use crate::initiation::{Initiation, Rule};
use crate::mode::{JumpMatrix, ModeSet, check_distribution};
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp, larger, ln};
use crate::scan::{Report, Scan, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::time::{Duration, Instant};
use core::convert::Infallible;
use rand_core::{Rng, TryRng};

/// The configuration of a jump-Markov GLMB tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states, `A` a [`Truncation`]; `BIRTHS` targets at most may be born in a scan.
/// The capacities are those of the [`GlmbState`].
///
/// ```
/// use boresight::association::Gate;
/// use boresight::gaussian::Gaussian;
/// use boresight::glmb::{Mixture, Ranked, Region};
/// use boresight::model::motion::{ConstantVelocity, ProcessNoise};
/// use boresight::model::position::Position;
/// use boresight::model::turn::KnownTurn;
/// use boresight::scan::{Detection, Scan};
/// use boresight::sensor::{Clutter, UniformSensor};
/// use boresight::symmetric::Symmetric;
/// use boresight::time::Instant;
/// use boresight::tracker::{GlmbState, JmsGlmb};
/// use nalgebra::SVector;
///
/// type Modes = (ConstantVelocity<f32, 2>, KnownTurn<f32, 2>);
/// // States (x, vx, y, vy), 2 modes of one Gaussian each; 24 tracks, 16 hypotheses of up to 6 targets, 4 detections of a
/// // track and 32 of a scan.
/// type Events = Ranked<16, 16>;
/// type Memory = GlmbState<f32, Mixture<f32, 4, 2, 1>, Events, 24, 16, 6, 4, 32>;
/// const _: () = assert!(size_of::<Memory>() < 20 * 1024);
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let noise = ProcessNoise::Discrete(1.0); // (m/s²)²
/// let modes: Modes = (ConstantVelocity::new(noise)?, KnownTurn::new(0.1, noise)?); // rad/s
/// let gates = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1e4, 400.0, 1e4, 400.0])); // m², (m/s)²
/// let tracker = JmsGlmb::<f32, _, _, 4, 2, 2>::new(modes, [[0.9, 0.1], [0.1, 0.9]], 0.99, Events {})?
///     .with_region(Region::new(0.02, gates, [1.0, 0.0])?)?
///     .with_limits(16, 1e-5)?;
/// let model = Position::<f32, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?; // m²
/// let sensor = UniformSensor::new(model, 0.95, Clutter::Poisson(1e-6), Gate::new::<2>(16.0)?)?;
///
/// let mut memory = Memory::new();
/// for k in 0..5 {
///     let plots = [Detection::new([20.0 * k as f32, -30.0])];
///     tracker.step(&mut memory, &sensor, &Scan::new(Instant::from_millis(1000 * k), &plots))?;
/// }
/// let target = memory.estimates().next().ok_or("no target")?;
/// assert!(target.existence > 0.9 && target.modes[0] > 0.5 && (target.state.mean[1] - 20.0).abs() < 3.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct JmsGlmb<T, M, A, const NX: usize, const MODES: usize, const BIRTHS: usize> {
    pub(super) modes: M,
    pub(super) jump: JumpMatrix<T, MODES>,
    pub(super) p_survive: T,
    pub(super) visibility: [T; MODES],
    pub(super) regions: heapless::Vec<Region<T, NX, MODES>, BIRTHS>,
    pub(super) adaptive: Option<Adaptive<T, NX, MODES>>,
    pub(super) most: usize,
    pub(super) ln_share: T,
    pub(super) truncation: A,
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
    pub fn with_initiation(self, initiation: Initiation<T, NX>, expected: T, most: T, modes: [T; MODES]) -> Result<Self, ConfigError> {
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
            assert!(DETS + BIRTHS <= 65535, "births are numbered by 16 bits");
            let sensor = <S::Model as MeasurementModel<T, NX, NZ>>::LAYOUT;
            assert!(M::LAYOUT.agrees(sensor), "sensor and modes disagree on where positions stand");
        }
        check(state.time, sensor, scan)?;
        let selection = Selection::<DETS>::new(scan.detections);
        let gap = state.time.map(|last| scan.time.since(last));
        let mut weights = [T::ZERO; DETS];
        let mut look = Look {
            sight: Sight { sensor, visibility: &self.visibility },
            detections: scan.detections,
            candidates: &selection.indices,
            weights: &mut weights,
        };
        let mut report = Report {
            detections: u16::try_from(selection.indices.len()).unwrap_or(u16::MAX),
            detections_dropped: selection.dropped,
            ..Report::default()
        };

        let GlmbState { time, scans, generations: [first, second], second: flipped, rows, memory, unexplained } = state;
        let (old, new) = if *flipped { (second, first) } else { (first, second) };
        self.predict(old.tracks_mut(), gap, rng);
        report.numeric_resets = self.write_rows(old.tracks(), rows, &mut look, gap);
        let births = match gap {
            Some(Duration::ZERO) => Births::NONE,
            _ => self.bear(&mut old.slots, rows, old.count, &Arrivals { unexplained, birth_scan: *scans, gap }, &mut look, rng),
        };
        let (ln_all, complete) = self.explore(&old.pool, &mut new.pool, rows, &births.places, memory, rng);

        new.pool.merge();
        new.pool.cut(self.most, self.ln_share);
        new.assign(rows, BIRTHS);
        let ln_kept = new.pool.normalise();
        let resets = new.absorb(&old.slots, rows, &look, rng);
        new.weigh();

        let rows = rows.get(..old.count + births.places.len()).unwrap_or_default();
        if !complete || new.pool.dropped || births.ln_given_up > T::ZERO || rows.iter().any(Row::is_crowded) {
            report.truncated_mass = truncated(ln_kept, ln_all + births.ln_given_up, LABELS + BIRTHS);
        }
        report.numeric_resets = report.numeric_resets.saturating_add(resets);
        report.births_refused = births.refused;
        report.births = rows.iter().skip(old.count).filter(|row| row.lives_on()).count() as u16;
        let gates = |row: &Row<T, GATED>, number: u16| {
            COUNTED.looks.add(row.hits().len());
            row.gates(number)
        };
        let unclaimed = |number: &&u16| !rows.iter().any(|row| gates(row, **number));
        report.detections_unclaimed = selection.indices.iter().filter(unclaimed).count() as u16;
        self.remember(new.tracks(), rows, &look, unexplained);
        (*time, *flipped) = (Some(scan.time), !*flipped);
        if gap != Some(Duration::ZERO) {
            *scans = scans.saturating_add(1);
        }
        Ok(report)
    }
}

/// Refuses what the tracker may not take in.
fn check<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize>(
    last: Option<Instant>,
    sensor: &S,
    scan: &Scan<'_, T, NZ>,
) -> Result<(), ScanError> {
    scan.check(last)?;
    if !sensor.model().is_finite() {
        return Err(ScanError::SensorNotFinite);
    }
    if sensor.gate().dimension() != NZ {
        return Err(ScanError::GateDimension);
    }
    if scan.detections.iter().any(|d| sensor.clutter(&d.z) == Clutter::Diffuse) {
        return Err(ScanError::ClutterUnknown);
    }
    Ok(())
}

/// A bound on the share of what was given up, rounding included.
fn truncated<T: Real>(ln_kept: T, ln_all: T, rows: usize) -> f32 {
    let rounding = T::EPSILON * T::from_count(4 * rows) * (T::ONE + ln_kept.abs() + ln_all.abs());
    let share = larger(T::ZERO, T::ONE - exp(ln_kept - ln_all)) + rounding;
    // Not below what it was in the other width.
    let share = if share < T::ONE { share.to_f64() as f32 * (1.0 + f32::EPSILON) } else { 1.0 };
    share.min(1.0)
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
