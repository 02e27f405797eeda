//! LMS-JPDAF: an IMM-JPDAF with many modes, of which every track runs only the likely ones.
//!
//! One scan, with M_t the likely modes of track t:
//!
//! ```text
//! predict    c_j over M_t, mix and predict the modes of M_t                              (mode)
//! score      every track's row over its M_t: h_tj = P_D Σ_{r ∈ M} c_r L_tjr / λ_j,  m_t   (evidence)
//! associate  β from all rows at once, this once                                          (association)
//! absorb     the modes of M_t by β                                                       (evidence)
//! adapt      classify; modes that are activated are mixed from the last scan, predicted, and absorb the same β by their own
//!            residuals, e_n = β_t0 + Σ_j β_tj L_tjn / Σ_{r ∈ M} c_r L_tjr;  μ over the union;  discard            (mode)
//! manage     existence, hit or miss, confirm, delete, duplicates                         (track)
//! initiate   from detections that no track gated                                         (births.rs)
//! ```
//!
//! Gomes, "An overview on target tracking using multiple models methods", tables 3 to 5, corrected: association conditional on
//! modes, and the mixture over joint events for a mode's likelihood. The rules of adaptation are those of [`LikelyModes`].
//!
//! # Cost
//! That of [`ImmJpda`](super::ImmJpda) with the active modes of each track in the place of all: nothing is mixed, predicted, scored
//! or corrected for another. Besides, what is activated costs a mixing, a prediction, an innovation and a correction, and the
//! likelihoods of those that ran once more. [`LmsJpda::worst_case`] has the most: all modes, some of them activated.
//!
//! Memory: [`LmsState`] is all there is. Beside what `ImmJpda` needs it holds the densities of the last scan, from which modes are
//! activated: tracks take twice the room.

use super::picture::{Outcome, Picture, Setup, looks};
use super::{Joint, Scratch, State, Tracker, Work, rows};
use crate::association::{AssociationMatrix, Associator, Jpda};
use crate::error::{ConfigError, ScanError};
use crate::evidence::{Corrected, SomeInnovations, no_innovations, predict_measurements};
use crate::gaussian::Gaussian;
use crate::initiation::Initiation;
use crate::mode::{ActiveSet, Deviations, JumpMatrix, LikelyModes, ModeBank, ModeSet};
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::{Detection, Report, Scan, Selection};
use crate::sensor::Sensor;
use crate::time::{Duration, Instant};
use crate::track::{Logic, Track, TrackId};

/// The configuration of an LMS-JPDAF tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states; `TRACKS` and `DETS` are the capacities; `A` associates.
#[derive(Clone, Copy, Debug)]
pub struct LmsJpda<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A> {
    pub(super) setup: Setup<T, M, NX, MODES>,
    pub(super) likely: LikelyModes<T, MODES>,
    pub(super) associator: A,
}

/// All that an LMS-JPDAF tracker remembers, and its scratch. All zero bits when new: a `static` costs no flash.
pub type LmsState<T, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A> =
    State<T, NX, MODES, TRACKS, DETS, Likely<T, NX, MODES, TRACKS, DETS, A>>;

/// What adaptation and joint association by `A` work on.
#[derive(Clone, Debug)]
pub struct Likely<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A: Associator<T, TRACKS, DETS>> {
    pub(super) joint: Joint<T, TRACKS, DETS, A>,
    pub(super) slots: [Slot<T, NX, MODES>; TRACKS],
    /// Time since the last scan \[s\]
    pub(super) dt: T,
}

/// What adaptation remembers of the track in a slot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot<T, const NX: usize, const MODES: usize> {
    /// Whose this is
    pub track: Option<TrackId>,
    /// The modes of this scan, then of the next
    pub run: ActiveSet,
    /// The modes of the last scan
    pub before: Deviations<T, NX, MODES>,
}

impl<T: Real, A: Associator<T, TRACKS, DETS>, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>
    AsRef<AssociationMatrix<T, TRACKS, DETS>> for Likely<T, NX, MODES, TRACKS, DETS, A>
{
    fn as_ref(&self) -> &AssociationMatrix<T, TRACKS, DETS> {
        self.joint.as_ref()
    }
}

impl<T: Real, A: Associator<T, TRACKS, DETS>, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Scratch
    for Likely<T, NX, MODES, TRACKS, DETS, A>
{
    const NEW: Self =
        Self { joint: Joint::NEW, slots: [Slot { track: None, run: ActiveSet::EMPTY, before: Deviations::ZERO }; TRACKS], dt: T::ZERO };
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> LmsJpda<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: Associator<T, TRACKS, DETS>,
{
    /// Modes, their jump matrix π (rows sum to one), the mode probabilities of a new track, whose active modes are those with a
    /// probability, the rules of adaptation, and the association. Tracks are started by the caller, see [`start`](Self::start),
    /// unless [`with_initiation`](Self::with_initiation) says otherwise.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(
        modes: M,
        jump: JumpMatrix<T, MODES>,
        initial: [T; MODES],
        likely: LikelyModes<T, MODES>,
        logic: Logic<T>,
        associator: A,
    ) -> Result<Self, ConfigError> {
        const { assert!(MODES >= 1 && TRACKS >= 1 && DETS >= 1 && DETS <= 65535, "every capacity must be at least one") }
        Ok(Self { setup: Setup::new(modes, jump, initial, logic)?, likely, associator })
    }

    /// The same tracker, starting tracks by itself.
    #[must_use]
    pub fn with_initiation(self, initiation: Initiation<T, NX>) -> Self {
        Self { setup: self.setup.with_initiation(initiation), ..self }
    }

    /// Starts a confirmed track at `at`: a cue from elsewhere. `at` is the time of the last scan, or any before the first.
    /// `None` where all slots are taken (a cue does not evict), `at` is another time, or `g` is not finite or beyond the
    /// logic's position limit.
    pub fn start(&self, state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>, g: Gaussian<T, NX>, at: Instant) -> Option<TrackId> {
        state.picture.start(&self.setup, g, at)
    }

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite or whose gate was made
    /// for another dimension, is refused and the state stays as it was. Load is not an error: see [`Report`].
    pub fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        let (selection, mut report) = self.open(state, sensor, scan)?;
        score(state, sensor, scan.detections, &selection);
        let Joint { matrix, memory } = &mut state.scratch.joint;
        report.add(self.associator.associate(matrix, memory));
        self.absorb(state, sensor, scan.detections, &selection, &mut report);
        state.picture.close(&self.setup, sensor, scan, &selection, &mut report);
        Ok(report)
    }

    /// Checks a scan, and brings the likely modes of all tracks to its time.
    #[inline(always)]
    pub(super) fn open<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<(Selection<DETS>, Report), ScanError> {
        let State { picture, scratch: Likely { slots, dt, .. }, .. } = state;
        picture.open_by(&self.setup, sensor, scan, |picture, setup, gap| {
            *dt = gap.as_secs();
            predict(&mut picture.tracks, slots, setup, gap);
        })
    }

    /// Updates every track by its probabilities, adapts its modes, and draws the conclusions.
    // Out of line as `score`: what one stage of a scan has on the stack is gone in the next.
    #[inline(never)]
    fn absorb<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        let State { picture: Picture { tracks, .. }, evidence, scratch: Likely { joint: Joint { matrix, .. }, slots, dt } } = state;
        let (model, mut innovations) = (sensor.model(), no_innovations());
        let steps = self.steps(*dt);
        for ((number, track), slot) in tracks.iter_mut().enumerate().zip(slots).filter(|((_, t), _)| !t.is_free()) {
            let Some((beta_0, row)) = matrix.row_mut(number) else { continue };
            let Track { bank, existence, .. } = track;
            let run = slot.run;
            predict_measurements(&mut innovations, bank, run, model);
            let predicted = SomeInnovations::new(&innovations, run);
            evidence.take(&predicted, detections, selection.indices.iter().copied().zip(row.iter().copied()));
            let p_detect = sensor.p_detect(&bank.modes[0].mean);
            let doubt = self.setup.logic.doubt(*existence, p_detect * sensor.gate().p_gate());
            let miss = *beta_0 * doubt;
            let recall = looks(p_detect) && self.likely.recalls(NZ, |nis| evidence.is_explained(bank, &predicted, model, detections, nis));
            let Corrected { evidence: weights, mut resets } = evidence.correct(miss, bank, &predicted, model, detections);
            self.adapt(bank, slot, weights, recall, steps.as_ref(), |bank, new| {
                predict_measurements(&mut innovations, bank, new, model);
                let predicted = SomeInnovations::activated(&innovations, run, new);
                let more = evidence.correct_activated(miss, bank, &predicted, model, detections);
                resets += more.resets;
                more.evidence
            });
            self.setup.logic.believe(existence, doubt, *beta_0, T::ONE - *beta_0);
            self.setup.conclude(track, Outcome { looked: looks(p_detect), hit: *beta_0 < T::lit(0.5), resets }, report);
        }
    }

    /// The steps since the last scan; none between two scans at the same time, when no mode jumps.
    pub(super) fn steps(&self, dt: T) -> Option<M::Steps> {
        (dt > T::ZERO).then(|| self.setup.modes.steps(dt))
    }

    /// Adapts the modes of a track whose likely ones were corrected; `correct` corrects those that are activated.
    #[inline(always)]
    pub(super) fn adapt(
        &self,
        bank: &mut ModeBank<T, NX, MODES>,
        slot: &mut Slot<T, NX, MODES>,
        evidence: [T; MODES],
        recall: bool,
        steps: Option<&M::Steps>,
        correct: impl FnOnce(&mut ModeBank<T, NX, MODES>, ActiveSet) -> [T; MODES],
    ) {
        let adaptation = self.likely.adapt(bank, slot.run, evidence, recall, |bank, new| {
            steps.map(|steps| {
                bank.interact_from(&slot.before, &self.setup.jump, slot.run, new);
                bank.advance_active(&self.setup.modes, new, steps);
                correct(bank, new)
            })
        });
        bank.anchor(bank.active());
        slot.run = adaptation.next;
    }

    /// Where positions and velocities stand in the state.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        M::LAYOUT
    }
}

/// Writes the row of every track, by its likely modes.
#[inline(never)]
fn score<T: Real, S: Sensor<T, NX, NZ>, A, const NX: usize, const NZ: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>(
    state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    selection: &Selection<DETS>,
) where
    A: Associator<T, TRACKS, DETS>,
{
    let State { picture, evidence, scratch: Likely { joint: Joint { matrix, .. }, slots, .. } } = state;
    let mut innovations = no_innovations();
    rows::write(matrix, picture, evidence, sensor, detections, selection, |evidence, slot, track, look| {
        let run = slots.get(slot).map_or(ActiveSet::EMPTY, |slot| slot.run);
        predict_measurements(&mut innovations, &track.bank, run, look.model());
        let predicted = SomeInnovations::new(&innovations, run);
        evidence.collect(&track.bank, &predicted, look, detections, selection.candidates())
    });
}

/// Brings the likely modes of all tracks over `gap`, and keeps what they were. Between two scans at the same time nothing moves, no
/// mode jumps and no target goes.
// One copy for all sensors.
#[inline(never)]
fn predict<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize, const TRACKS: usize>(
    tracks: &mut [Track<T, NX, MODES>; TRACKS],
    slots: &mut [Slot<T, NX, MODES>; TRACKS],
    setup: &Setup<T, M, NX, MODES>,
    gap: Duration,
) {
    let dt = gap.as_secs::<T>();
    let (p_survive, steps) = (setup.logic.p_survive(dt), setup.modes.steps(dt));
    for (track, Slot { track: owner, run, before }) in tracks.iter_mut().zip(slots).filter(|(t, _)| !t.is_free()) {
        let (id, active, bank) = (track.id(), track.bank.active(), &mut track.bank);
        if gap == Duration::ZERO || *owner != id {
            (*owner, *run) = (id, active);
        }
        if gap == Duration::ZERO {
            continue;
        }
        before.take(bank, active);
        bank.prob = [T::ZERO; MODES];
        bank.interact_from(before, &setup.jump, *run, *run);
        bank.advance_active(&setup.modes, *run, &steps);
        bank.anchor(*run);
        track.existence *= p_survive;
    }
}

impl<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, const NODES: usize>
    LmsJpda<T, M, NX, MODES, TRACKS, DETS, Jpda<NODES>>
{
    /// The most work that a scan of at most `DETS` detections can make, none with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case() -> Work {
        Work::lms_jpda::<NODES>(TRACKS, DETS, MODES)
    }
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Tracker<T, NX, MODES>
    for LmsJpda<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: Associator<T, TRACKS, DETS>,
{
    type State = LmsState<T, NX, MODES, TRACKS, DETS, A>;

    fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut Self::State,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        self.step(state, sensor, scan)
    }

    fn tracks<'a>(&self, state: &'a Self::State) -> impl Iterator<Item = &'a Track<T, NX, MODES>>
    where
        T: 'a,
    {
        state.tracks()
    }

    fn digest(&self, state: &Self::State) -> u32 {
        state.digest()
    }
}
