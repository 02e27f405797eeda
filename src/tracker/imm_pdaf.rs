//! IMM-PDAF: every track an interacting multiple model filter with probabilistic data association of its own.
//!
//! One scan, track by track:
//!
//! ```text
//! predict    c_j = Σ π_ij μ_i, mix, predict every mode          (mode)
//! gate       by the mode with the largest det S                 (evidence)
//! score      h_j = P_D Σ_r c_r L_jr / λ,  m = 1 − P_D P_G        (evidence)
//! associate  β from m and h: PDA, or nearest neighbour          (association)
//! absorb     modes and their probabilities by β                 (evidence; with PDA these three are one pass)
//! manage     existence, hit or miss, confirm, delete, duplicates (track)
//! initiate   from detections that no track gated                (initiation)
//! ```
//!
//! Houles and Bar-Shalom, *IEEE Trans. AES* 25(2), 1989; Kashyap et al., *J. Aerospace Sciences and Technologies*
//! 58(2), 2006, corrected. Each target is associated as if it were alone: targets that share detections for long want
//! a joint association.
//!
//! # Cost
//! With t tracks, n detections offered and m = min(n, DETS) taken in, operations a scan are at most
//!
//! ```text
//! n DETS comparisons of amplitude  (only where n > DETS)
//! t (mixing, prediction, MODES innovations, m (1 + MODES) residual forms, MODES corrections, m claims)
//! t m MODES residual forms more  (only for an association that is not PDA)
//! t m (1 + 3 MODES) factorisations of S  (only for detections with a noise of their own)
//! t² / 2 duplicate tests,  m DETS pairings, each of which may look through t slots
//! ```
//!
//! Memory: [`State`] is all there is, and its size is a constant.

use super::picture::{Look, Outcome, Picture, Setup, looks};
use super::{State, Tracker, Work, printed};
use crate::association::{Pda, SingleAssociator};
use crate::error::{ConfigError, ScanError};
use crate::evidence::{Found, no_innovations, predict_measurements};
use crate::gaussian::Gaussian;
use crate::initiation::Initiation;
use crate::mode::{ActiveSet, JumpMatrix, ModeSet};
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::{Detection, Report, Scan, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::time::Instant;
use crate::track::{Logic, Track, TrackId};

/// The configuration of an IMM-PDAF tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states; `TRACKS` and `DETS` are the capacities; `A` associates.
/// With one mode it is the PDAF, with [`NearestNeighbour`](crate::association::NearestNeighbour) the nearest-neighbour
/// filter, with [`Logic::existence`] the IPDA.
#[derive(Clone, Copy, Debug)]
pub struct ImmPdaf<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A = Pda> {
    setup: Setup<T, M, NX, MODES>,
    associator: A,
}

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>
    ImmPdaf<T, M, NX, MODES, TRACKS, DETS>
{
    /// Modes, their jump matrix π (rows sum to one) and the mode probabilities of a new track. Tracks are started by
    /// the caller, see [`start`](Self::start), unless [`with_initiation`](Self::with_initiation) says otherwise.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, initial: [T; MODES], logic: Logic<T>) -> Result<Self, ConfigError> {
        const { assert!(MODES >= 1 && TRACKS >= 1 && DETS >= 1 && DETS <= 65535, "every capacity must be at least one") }
        Ok(Self { setup: Setup::new(modes, jump, initial, logic)?, associator: Pda })
    }

    /// The most work that a scan of at most `DETS` detections can make, none with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case() -> Work {
        Work::imm_pdaf(TRACKS, DETS, MODES)
    }
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> ImmPdaf<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: SingleAssociator<T>,
{
    /// The same tracker, starting tracks by itself.
    #[must_use]
    pub fn with_initiation(self, initiation: Initiation<T, NX>) -> Self {
        Self { setup: self.setup.with_initiation(initiation), ..self }
    }

    /// The same tracker with another association.
    #[must_use]
    pub fn with_associator<B: SingleAssociator<T>>(self, associator: B) -> ImmPdaf<T, M, NX, MODES, TRACKS, DETS, B> {
        ImmPdaf { setup: self.setup, associator }
    }

    /// Starts a confirmed track at `at`: a cue from elsewhere. `at` is the time of the last scan, or any before the first.
    /// `None` where all slots are taken (a cue does not evict), `at` is another time, or `g` is not finite or beyond the
    /// logic's position limit.
    pub fn start(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, g: Gaussian<T, NX>, at: Instant) -> Option<TrackId> {
        state.picture.start(&self.setup, g, at)
    }

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite or whose gate was made
    /// for another dimension, is refused and the state stays as it was. Load is not an
    /// error: see [`Report`].
    pub fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut State<T, NX, MODES, TRACKS, DETS>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        let (selection, mut report) = state.picture.open(&self.setup, sensor, scan)?;
        self.update(state, sensor, scan.detections, &selection, &mut report);
        state.picture.close(&self.setup, sensor, scan, &selection, &mut report);
        Ok(report)
    }

    /// Gate, score, associate and absorb, track by track.
    // Out of line: what it has on the stack is gone when tracks are born.
    #[inline(never)]
    fn update<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut State<T, NX, MODES, TRACKS, DETS>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        let State { picture: Picture { tracks, claimed, .. }, evidence, .. } = state;
        let mut innovations = no_innovations();
        for track in tracks.iter_mut().filter(|t| !t.is_free()) {
            let Track { bank, existence, .. } = track;
            let look = Look { sensor, existence: *existence, diffuse: Clutter::Diffuse };
            let p_detect = sensor.p_detect(&bank.modes[0].mean);
            let doubt = self.setup.logic.doubt(*existence, p_detect * sensor.gate().p_gate());
            let mut claims = selection.walk(claimed);
            let claim = |number| {
                if let Some(claimed) = claims(number) {
                    *claimed = true;
                }
            };
            let Found { miss, hits, resets } = if A::COMBINED_INNOVATION {
                let associate = |miss, weights: &mut [T]| self.associator.associate(miss, weights);
                printed::update::<T, _, NX, NZ, MODES, DETS>(bank, &look, associate, doubt, detections, selection.candidates(), claim)
            } else {
                predict_measurements(&mut innovations, bank, ActiveSet::first(MODES), sensor.model());
                evidence.gate(bank, &innovations, &look, detections, selection.candidates());
                evidence.gated().iter().copied().for_each(claim);
                if A::PROPORTIONAL {
                    evidence.pda(bank, &innovations, &look, detections, doubt)
                } else {
                    evidence.score(bank, &innovations, &look, detections);
                    let (miss, weights) = evidence.weights();
                    let beta_0 = self.associator.associate(miss, weights);
                    let resets = evidence.absorb(beta_0 * doubt, bank, &innovations, sensor.model(), detections);
                    Found { miss: beta_0, hits: T::ONE - beta_0, resets }
                }
            };
            self.setup.logic.believe(existence, doubt, miss, hits);
            let hit = miss < hits;
            self.setup.conclude(track, Outcome { looked: looks(p_detect), hit, resets }, report);
        }
    }

    /// Where positions and velocities stand in the state.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        M::LAYOUT
    }
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Tracker<T, NX, MODES>
    for ImmPdaf<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: SingleAssociator<T>,
{
    type State = State<T, NX, MODES, TRACKS, DETS>;

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
