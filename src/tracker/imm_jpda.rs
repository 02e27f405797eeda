//! IMM-JPDAF: every track an interacting multiple model filter, all associated together: no detection is two targets'.
//!
//! One scan:
//!
//! ```text
//! predict    c_j = Σ π_ij μ_i, mix, predict every mode                      (mode)
//! score      every track's row: h_tj = P_D Σ_r c_r L_tjr / λ_j,  m_t        (evidence)
//! associate  β from all rows at once: JPDA, or another joint association    (association)
//! absorb     modes and their probabilities by β, track by track             (evidence)
//! manage     existence, hit or miss, confirm, delete, duplicates            (track)
//! initiate   from detections that no track gated                            (births.rs)
//! ```
//!
//! Association is blind to modes and the modes stay exact: the joint events weigh a track by its mixture over modes,
//! and [`evidence`](crate::evidence) gives each mode its share of β_tj. That is exact for a prior that is a product over
//! the targets (Chen and Tugnait, *Automatica* 37(2), 2001). With [`Logic::existence`] it is the joint IPDA.
//!
//! # Clutter of unknown density
//! Joint events of diffuse clutter weigh φ! / V^φ. The rows then carry
//!
//! ```text
//! λ = m / V    m the detections that any track can have,  V the gate volumes of all tracks that the sensor may see, summed
//! ```
//!
//! and the associator does the rest ([`ClutterPrior::Diffuse`]). Where a sensor states a density for some detections, those
//! keep it, m counts the others alone, and their λ counts as known.
//!
//! # Unresolved targets
//! Two targets within the cells of the sensor may give one detection between them. Where the sensor states its
//! [resolution](crate::sensor::Sensor::resolution) and the association is [`MergingJpda`](crate::association::MergingJpda), tracks that
//! come so close are handled as pairs, scan by scan (unresolved.rs); otherwise that code is not in the image. With room for p pairs
//! a scan costs at most
//!
//! ```text
//! 2^(min(p, 4) + 1) − 2 associations more                          all pairs in one cluster; 2 where every pair has its own
//! t combined estimates and their measurements,  p of their noise
//! t² (t − 1) / 4 looks at two tracks                               t / 2 times for the closest that are left
//! 3 p m weights, measurements of both as of one
//! 2 p (3 MODES) factorisations of S for every detection            those of pairs have a noise of their own
//! ```
//!
//! more, as [`Work::imm_jpda_merging`] counts them.
//!
//! # Cost
//! Likelihoods are computed twice, before and after the association: kept for all tracks they would take
//! TRACKS DETS MODES scalars, and their innovations, whose size depends on the sensor, TRACKS MODES NX NZ more. The second
//! time only the detections count that a track may have. With t tracks, n detections offered, m = min(n, DETS) taken in and
//! g ≤ m in a gate, operations a scan are at most
//!
//! ```text
//! n DETS comparisons of amplitude  (only where n > DETS)
//! t (mixing, prediction, 2 MODES innovations, m + 2 g MODES residual forms, MODES corrections, 2 m steps of walks)
//! t (m + 3 g MODES) factorisations of S  (only for detections with a noise of their own)
//! TRACKS m for the matrix, twice where clutter is diffuse;  the association's own cost
//! t² / 2 duplicate tests,  m DETS pairings, each of which may look through t slots
//! ```
//!
//! Memory: [`JointState`] is all there is: tracks, TRACKS (DETS + 1) scalars of the matrix, and what the associator needs.

use super::picture::{Outcome, Picture, Setup, looks};
use super::rows;
use super::unresolved::{self, Dwell, Shared, Sights};
use super::{Scratch, State, Tracker, Work};
use crate::association::{AssociationMatrix, Associator, Gnn, Jpda, MergingJpda};
use crate::error::{ConfigError, ScanError};
use crate::evidence::{no_innovations, predict_measurements};
use crate::gaussian::Gaussian;
use crate::initiation::Initiation;
use crate::mode::{ActiveSet, JumpMatrix, ModeSet};
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::{Detection, Report, Scan, Selection};
use crate::sensor::Sensor;
use crate::time::Instant;
use crate::track::{Logic, Track, TrackId};

/// The configuration of an IMM-JPDAF tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states; `TRACKS` and `DETS` are the capacities; `A` associates. With
/// one mode it is the JPDAF.
#[derive(Clone, Copy, Debug)]
pub struct ImmJpda<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A> {
    setup: Setup<T, M, NX, MODES>,
    associator: A,
}

/// All that an IMM-JPDAF tracker remembers, and its scratch. All zero bits when new: a `static` costs no flash.
pub type JointState<T, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A> =
    State<T, NX, MODES, TRACKS, DETS, Joint<T, TRACKS, DETS, A>>;

/// What joint association by `A` works on.
#[derive(Clone, Debug)]
pub struct Joint<T: Real, const TRACKS: usize, const DETS: usize, A: Associator<T, TRACKS, DETS>> {
    /// A row for every slot, a column for every detection taken in
    pub(super) matrix: AssociationMatrix<T, TRACKS, DETS>,
    pub(super) memory: A::Memory,
}

impl<T: Real, A: Associator<T, TRACKS, DETS>, const TRACKS: usize, const DETS: usize> AsRef<AssociationMatrix<T, TRACKS, DETS>>
    for Joint<T, TRACKS, DETS, A>
{
    fn as_ref(&self) -> &AssociationMatrix<T, TRACKS, DETS> {
        &self.matrix
    }
}

impl<T: Real, A: Associator<T, TRACKS, DETS>, const TRACKS: usize, const DETS: usize> Scratch for Joint<T, TRACKS, DETS, A> {
    const NEW: Self = Self { matrix: AssociationMatrix::new(), memory: A::MEMORY };
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> ImmJpda<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: Associator<T, TRACKS, DETS>,
{
    /// Modes, their jump matrix π (rows sum to one), the mode probabilities of a new track, and the association. Tracks
    /// are started by the caller, see [`start`](Self::start), unless [`with_initiation`](Self::with_initiation) says
    /// otherwise.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, initial: [T; MODES], logic: Logic<T>, associator: A) -> Result<Self, ConfigError> {
        const { assert!(MODES >= 1 && TRACKS >= 1 && DETS >= 1 && DETS <= 65535, "every capacity must be at least one") }
        Ok(Self { setup: Setup::new(modes, jump, initial, logic)?, associator })
    }

    /// The same tracker, starting tracks by itself.
    #[must_use]
    pub fn with_initiation(self, initiation: Initiation<T, NX>) -> Self {
        Self { setup: self.setup.with_initiation(initiation), ..self }
    }

    /// Starts a confirmed track at `at`: a cue from elsewhere. `at` is the time of the last scan, or any before the first.
    /// `None` where all slots are taken (a cue does not evict), `at` is another time, or `g` is not finite or beyond the
    /// logic's position limit.
    pub fn start(&self, state: &mut JointState<T, NX, MODES, TRACKS, DETS, A>, g: Gaussian<T, NX>, at: Instant) -> Option<TrackId> {
        state.picture.start(&self.setup, g, at)
    }

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite or whose gate was made
    /// for another dimension, is refused and the state stays as it was. Load is not an error: see [`Report`].
    pub fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut JointState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        let (selection, mut report) = state.picture.open(&self.setup, sensor, scan)?;
        let diffuse = score(state, sensor, scan.detections, &selection);
        let sights = pair_up(state, sensor, scan.detections, &selection, diffuse, &mut report);
        let Joint { matrix, memory } = &mut state.scratch;
        report.add(self.associator.associate(matrix, memory));
        self.absorb(state, sensor, scan.detections, &selection, sights.as_ref(), &mut report);
        state.picture.close(&self.setup, sensor, scan, &selection, &mut report);
        Ok(report)
    }

    /// Updates every track by its probabilities, and draws the conclusions.
    #[inline(never)]
    fn absorb<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut JointState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        selection: &Selection<DETS>,
        sights: Option<&Sights<T, NZ, TRACKS>>,
        report: &mut Report,
    ) {
        let State { picture: Picture { tracks, .. }, evidence, scratch: Joint { matrix, memory } } = state;
        let (model, mut innovations) = (sensor.model(), no_innovations());
        for (slot, track) in tracks.iter_mut().enumerate().filter(|(_, t)| !t.is_free()) {
            let Some((beta_0, row)) = matrix.row(slot) else { continue };
            let bank = &mut track.bank;
            predict_measurements(&mut innovations, bank, ActiveSet::first(MODES), model);
            let p_detect = sensor.p_detect(&bank.modes[0].mean);
            let doubt = self.setup.logic.doubt(track.existence, p_detect * sensor.gate().p_gate());
            let shared = sights.zip(sensor.resolution()).and_then(|(sights, resolution)| {
                let pair = A::pairs(memory)?.iter().find(|pair| pair.rows.iter().any(|row| usize::from(*row) == slot))?;
                Shared::new(pair, slot, (beta_0, row), sights, &Dwell { sensor, resolution, detections, selection })
            });
            track.unresolved = shared.is_some();
            let (missed, resets) = match &shared {
                None => {
                    evidence.take(&innovations, detections, selection.indices.iter().copied().zip(row.iter().copied()));
                    (beta_0, evidence.absorb(beta_0 * doubt, bank, &innovations, model, detections))
                }
                Some(Shared { detections, beta, beta_0, unseen }) => {
                    evidence.take(&innovations, detections, (0..).zip(beta.iter().copied()));
                    (*beta_0 + *unseen, evidence.absorb(*beta_0 * doubt, bank, &innovations, model, detections))
                }
            };
            self.setup.logic.believe(&mut track.existence, doubt, missed, T::ONE - missed);
            self.setup.conclude(track, Outcome { looked: looks(p_detect), hit: missed < T::lit(0.5), resets }, report);
        }
    }

    /// Where positions and velocities stand in the state.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        M::LAYOUT
    }
}

impl<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, const NODES: usize>
    ImmJpda<T, M, NX, MODES, TRACKS, DETS, Jpda<NODES>>
{
    /// The most work that a scan of at most `DETS` detections can make, none with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case() -> Work {
        Work::imm_jpda::<NODES>(TRACKS, DETS, MODES)
    }
}

impl<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> ImmJpda<T, M, NX, MODES, TRACKS, DETS, Gnn> {
    /// The most work that a scan of at most `DETS` detections can make, none with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case() -> Work {
        Work::imm_gnn(TRACKS, DETS, MODES)
    }
}

impl<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, const NODES: usize, const PAIRS: usize>
    ImmJpda<T, M, NX, MODES, TRACKS, DETS, MergingJpda<NODES, PAIRS>>
{
    /// The most work that a scan of at most `DETS` detections can make, none with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case() -> Work {
        Work::imm_jpda_merging::<NODES, PAIRS>(TRACKS, DETS, MODES)
    }
}

/// Writes the row of every track.
// Out of line as `absorb`: what one stage of a scan has on the stack is gone in the next.
#[inline(never)]
fn score<T: Real, S: Sensor<T, NX, NZ>, A, const NX: usize, const NZ: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>(
    state: &mut JointState<T, NX, MODES, TRACKS, DETS, A>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    selection: &Selection<DETS>,
) -> T
where
    A: Associator<T, TRACKS, DETS>,
{
    let State { picture, evidence, scratch: Joint { matrix, .. } } = state;
    let mut innovations = no_innovations();
    rows::write(matrix, picture, evidence, sensor, detections, selection, |evidence, _, track, look| {
        predict_measurements(&mut innovations, &track.bank, ActiveSet::first(MODES), look.model());
        evidence.collect(&track.bank, &innovations, look, detections, selection.candidates())
    })
}

/// Finds the tracks that the sensor may not tell apart, and what they weigh as one: nothing, unless the sensor states its resolution
/// and the association weighs such pairs.
#[inline(always)]
fn pair_up<T, S, A, const NX: usize, const NZ: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>(
    state: &mut JointState<T, NX, MODES, TRACKS, DETS, A>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    selection: &Selection<DETS>,
    diffuse: T,
    report: &mut Report,
) -> Option<Sights<T, NZ, TRACKS>>
where
    T: Real,
    S: Sensor<T, NX, NZ>,
    A: Associator<T, TRACKS, DETS>,
{
    let State { picture: Picture { tracks, claimed, .. }, scratch: Joint { memory, .. }, .. } = state;
    let pairs = A::pairs(memory)?;
    pairs.clear();
    let resolution = sensor.resolution()?;
    let sights = unresolved::look(tracks, sensor);
    report.pairs_refused = unresolved::pair_up(pairs, &sights, &Dwell { sensor, resolution, detections, selection }, diffuse);
    for pair in pairs.iter() {
        for (claimed, g) in claimed.iter_mut().zip(&pair.weight.hit) {
            *claimed |= *g > T::ZERO;
        }
    }
    (!pairs.is_empty()).then_some(sights)
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Tracker<T, NX, MODES>
    for ImmJpda<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: Associator<T, TRACKS, DETS>,
{
    type State = JointState<T, NX, MODES, TRACKS, DETS, A>;

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
