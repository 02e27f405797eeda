//! Complete trackers: each states its equations, its memory and its step.
//!
//! | file | holds |
//! |---|---|
//! | `imm_pdaf.rs` | every track associated as if it were alone |
//! | `imm_jpda.rs` | all tracks associated together |
//! | `lms_jpda.rs` | the same, each track with the likely ones of many modes |
//! | `coupled.rs` | two targets as one, unresolved detections included |
//! | `unresolved.rs` | tracks that the sensor may not tell apart |
//! | `jms_glmb.rs`, `glmb_cycle.rs` | a labelled random finite set |
//! | `picture.rs`, `births.rs` | what the others share: prediction, life and birth of tracks |
//! | `rows.rs` | what joint association is made from |
//! | `state.rs`, `glmb_state.rs` | what they remember |
//! | `work.rs` | the most work that a scan can make |
//! | `printed.rs`, `printed_joint.rs` | baselines for [`ImmPdaf`] and [`LmsJpda`] |

mod births;
mod coupled;
mod glmb_cycle;
mod glmb_state;
mod imm_jpda;
mod imm_pdaf;
mod jms_glmb;
mod lms_jpda;
mod picture;
mod printed;
mod printed_joint;
mod rows;
mod state;
mod unresolved;
mod work;

pub use coupled::{CoupledState, ImmCoupled};
pub use glmb_state::{GlmbState, LabelledEstimate};
pub use imm_jpda::{ImmJpda, Joint, JointState};
pub use imm_pdaf::ImmPdaf;
pub use jms_glmb::JmsGlmb;
pub use lms_jpda::{Likely, LmsJpda, LmsState};
pub use state::{Scratch, State};
pub use work::Work;

use crate::error::ScanError;
use crate::scalar::Real;
use crate::scan::{Estimate, Report, Scan};
use crate::sensor::Sensor;
use crate::track::Track;

/// A tracker whose tracks are banks of `MODES` modes over `NX` states, for code that serves any of them.
pub trait Tracker<T: Real, const NX: usize, const MODES: usize> {
    /// What it remembers.
    type State: Default;

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan.
    ///
    /// # Errors
    /// As the tracker's own `step`; the state then stays as it was.
    fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut Self::State,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError>;

    /// The live tracks.
    fn tracks<'a>(&self, state: &'a Self::State) -> impl Iterator<Item = &'a Track<T, NX, MODES>>
    where
        T: 'a;

    /// All that the next scan depends on, folded into one word: see [`State::digest`].
    fn digest(&self, state: &Self::State) -> u32;

    /// The combined estimates of all live tracks.
    fn estimates(&self, state: &Self::State) -> impl Iterator<Item = Estimate<T, NX>> {
        self.tracks(state).filter_map(Track::estimate)
    }
}
