//! Variable structure: sets of modes, the rules of the likely-model set, the tracker built on them, and its scenario.

#[path = "../support/counting.rs"]
mod counting;
mod rules;
mod scenario;
mod sets;
mod tracker;
mod work;

use boresight::error::ConfigError;
use boresight::mode::JumpMatrix;
use boresight::model::motion::ProcessNoise;
use boresight::model::turn::KnownTurn;
use std::error::Error;

type Outcome = Result<(), Box<dyn Error>>;

/// Modes of most of these tests.
const MODES: usize = 7;

/// Turns at -0.06 to 0.06 rad/s over (x, vx, y, vy).
fn turns() -> Result<[KnownTurn<f64, 2>; MODES], ConfigError> {
    let mut turns = [KnownTurn::new(0.0, ProcessNoise::Discrete(1.0))?; MODES];
    for (number, turn) in turns.iter_mut().enumerate() {
        *turn = KnownTurn::new(0.02 * (number as f64 - 3.0), ProcessNoise::Discrete(1.0))?;
    }
    Ok(turns)
}

/// Every mode stays with 0.9 or changes to one of its neighbours.
fn chain() -> JumpMatrix<f64, MODES> {
    let neighbours = |i: usize| if i == 0 || i == MODES - 1 { 1.0 } else { 2.0 };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match i.abs_diff(j) {
            0 => 0.9,
            1 => 0.1 / neighbours(i),
            _ => 0.0,
        })
    })
}
