//! The trackers that the images of the budget are made of: each by its type alone.
//!
//! ```text
//! Turning        4 states (x, vx, y, vy), 3 modes: constant velocity, turns to the left and to the right
//! ManyTurns      4 states, 7 modes: turns of -0.06 to 0.06 rad/s in steps of 0.02, each may change to the next
//! Accelerating   6 states (x, vx, ax, y, vy, ay), 2 modes: constant velocity, constant acceleration
//! ```

use crate::load::cue;
use boresight::association::{Associator, Jpda, SingleAssociator};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::mode::{JumpMatrix, LikelyModes, ModeSet};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::turn::KnownTurn;
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{ImmJpda, ImmPdaf, LmsJpda, Scratch, State, Tracker};
use nalgebra::SVector;

/// The modes over 4 states.
pub type Turning = (ConstantVelocity<f32, 2>, KnownTurn<f32, 2>, KnownTurn<f32, 2>);
/// Many modes over 4 states.
pub type ManyTurns = [KnownTurn<f32, 2>; 7];
/// The modes over 6 states.
pub type Accelerating = (ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>);

/// Modes with their jumps.
pub trait Motion<const NX: usize, const MODES: usize>: ModeSet<f32, NX, MODES> + Sized {
    /// The modes, π, and the mode probabilities of a new track.
    ///
    /// # Errors
    /// None: the constants are valid.
    fn new() -> Result<(Self, JumpMatrix<f32, MODES>, [f32; MODES]), ConfigError>;
}

impl Motion<4, 3> for Turning {
    fn new() -> Result<(Self, JumpMatrix<f32, 3>, [f32; 3]), ConfigError> {
        let turn = |rate| KnownTurn::new(rate, ProcessNoise::Discrete(4.0));
        let modes = (ConstantVelocity::new(ProcessNoise::Discrete(1.0))?, turn(0.06)?, turn(-0.06)?);
        Ok((modes, [[0.9, 0.05, 0.05], [0.1, 0.85, 0.05], [0.1, 0.05, 0.85]], [0.8, 0.1, 0.1]))
    }
}

impl Motion<4, 7> for ManyTurns {
    fn new() -> Result<(Self, JumpMatrix<f32, 7>, [f32; 7]), ConfigError> {
        let mut turns = [KnownTurn::new(0.0, ProcessNoise::Discrete(1.0))?; 7];
        for (number, turn) in turns.iter_mut().enumerate() {
            *turn = KnownTurn::new(0.02 * (number as f32 - 3.0), ProcessNoise::Discrete(1.0))?;
        }
        let jump = core::array::from_fn(|i: usize| {
            let neighbours = if i == 0 || i == 6 { 1.0 } else { 2.0 };
            core::array::from_fn(|j| match i.abs_diff(j) {
                0 => 0.9,
                1 => 0.1 / neighbours,
                _ => 0.0,
            })
        });
        Ok((turns, jump, [0.0, 0.0, 0.1, 0.8, 0.1, 0.0, 0.0]))
    }
}

impl Motion<6, 2> for Accelerating {
    fn new() -> Result<(Self, JumpMatrix<f32, 2>, [f32; 2]), ConfigError> {
        let modes = (ConstantVelocity::new(ProcessNoise::Discrete(1.0))?, ConstantAcceleration::new(ProcessNoise::Discrete(16.0))?);
        Ok((modes, [[0.95, 0.05], [0.1, 0.9]], [0.8, 0.2]))
    }
}

/// A tracker that can be made, and cued.
pub trait Loaded<const NX: usize, const MODES: usize>: Tracker<f32, NX, MODES> + Sized {
    /// The tracker, starting tracks by itself from two detections.
    ///
    /// # Errors
    /// None: the constants are valid.
    fn new() -> Result<Self, ConfigError>;

    /// Replaces all tracks by those of [`cue`]; whether all of `tracks` have found room.
    fn crowd(&self, state: &mut Self::State, tracks: usize, at: Instant) -> bool;
}

impl<M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Loaded<NX, MODES>
    for ImmPdaf<f32, M, NX, MODES, TRACKS, DETS, A>
where
    M: Motion<NX, MODES>,
    A: SingleAssociator<f32> + Default,
{
    fn new() -> Result<Self, ConfigError> {
        let (modes, jump, initial) = M::new()?;
        Ok(ImmPdaf::new(modes, jump, initial, logic()?)?.with_initiation(initiation()?).with_associator(A::default()))
    }

    fn crowd(&self, state: &mut Self::State, tracks: usize, at: Instant) -> bool {
        clear(state);
        (0..tracks).all(|number| self.start(state, cue(number), at).is_some())
    }
}

impl<M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Loaded<NX, MODES>
    for ImmJpda<f32, M, NX, MODES, TRACKS, DETS, A>
where
    M: Motion<NX, MODES>,
    A: Associator<f32, TRACKS, DETS> + Default,
{
    fn new() -> Result<Self, ConfigError> {
        let (modes, jump, initial) = M::new()?;
        Ok(ImmJpda::new(modes, jump, initial, logic()?, A::default())?.with_initiation(initiation()?))
    }

    fn crowd(&self, state: &mut Self::State, tracks: usize, at: Instant) -> bool {
        clear(state);
        (0..tracks).all(|number| self.start(state, cue(number), at).is_some())
    }
}

impl<M: Motion<NX, MODES>, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, const NODES: usize>
    Loaded<NX, MODES> for LmsJpda<f32, M, NX, MODES, TRACKS, DETS, Jpda<NODES>>
{
    fn new() -> Result<Self, ConfigError> {
        let (modes, jump, initial) = M::new()?;
        let likely = LikelyModes::new(&jump, 0.005, 0.3, MODES.min(3))?;
        Ok(LmsJpda::new(modes, jump, initial, likely, logic()?, Jpda::new())?.with_initiation(initiation()?))
    }

    fn crowd(&self, state: &mut Self::State, tracks: usize, at: Instant) -> bool {
        clear(state);
        (0..tracks).all(|number| self.start(state, cue(number), at).is_some())
    }
}

/// Removes all tracks.
fn clear<X: Scratch, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>(
    state: &mut State<f32, NX, MODES, TRACKS, DETS, X>,
) {
    loop {
        let first = state.tracks().find_map(|track| track.id());
        let Some(id) = first else { return };
        state.remove(id);
    }
}

fn logic() -> Result<Logic<f32>, ConfigError> {
    Logic::new(3, 5, 4)
}

/// Velocities of ± 200 m/s, accelerations of ± 5 m/s².
fn initiation<const NX: usize>() -> Result<Initiation<f32, NX>, ConfigError> {
    let stride = NX / 2;
    let variances = core::array::from_fn(|i| [1.0f32, 4e4, 25.0][i % stride % 3]);
    let rule = Rule::TwoPoint { max_speed: 300.0, max_gap: Duration::from_millis(2500) };
    Initiation::new(rule, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variances)))
}
