//! Pieces of a scan to be counted one by one: updates by radars, a turn, mixing, gating, clusters.
//!
//! The functions of this file that are exported are what counts: `ekf2_update_4`, … `cluster16_32`, by these names, for any tool
//! that traces calls. They set up nothing and only call the library. Inputs and references are those of the module
//! `twin::pieces`: the image ends with status 0 if every result agrees, otherwise with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::association::{Associator, Completeness, Jpda};
use boresight::evidence::{Innovations, innovations};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, ModeBank};
use boresight::model::MotionModel;
use boresight::model::converted::{Converted, Polar};
use boresight::model::position::Position;
use boresight::model::turn::UnknownTurn;
use boresight::model::unscented::Unscented;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::UniformSensor;
use cortex_m_rt::entry;
use firmware_example::exit;
use nalgebra::SVector;
use twin::pieces::{self, ALL, DETS, DT, Joint, MODES, Matrix, Models, NODES, Radar2, Radar3, Radar4, Scored, TRACKS, data};

type Bank<const R: usize> = ModeBank<f32, 4, R>;
type Predicted = Innovations<f32, 4, 2, MODES>;

#[unsafe(no_mangle)]
#[inline(never)]
fn ekf2_update_4(radar: &Radar2, g: &mut Gaussian<f32, 4>, z: &SVector<f32, 2>) -> bool {
    pieces::update(radar, g, z)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn ekf3_update_4(radar: &Radar3, g: &mut Gaussian<f32, 4>, z: &SVector<f32, 3>) -> bool {
    pieces::update(radar, g, z)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn ekf4_update_9(radar: &Radar4, g: &mut Gaussian<f32, 9>, z: &SVector<f32, 4>) -> bool {
    pieces::update(radar, g, z)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn ukf4_update_9(radar: &Unscented<Radar4, f32>, g: &mut Gaussian<f32, 9>, z: &SVector<f32, 4>) -> bool {
    pieces::update(radar, g, z)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn convert_polar(polar: &Polar<f32>) -> Converted<f32> {
    polar.debiased()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn turn_predict_5(turn: &UnknownTurn<f32, 2>, g: &mut Gaussian<f32, 5>) {
    turn.predict(g, DT);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn mix3_4(bank: &mut Bank<3>, jump: &JumpMatrix<f32, 3>) {
    bank.interact(jump);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn mix7_4(bank: &mut Bank<7>, jump: &JumpMatrix<f32, 7>) {
    bank.interact(jump);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn gate64_polar(
    sensor: &UniformSensor<Radar2, f32>,
    bank: &Bank<MODES>,
    predicted: &Predicted,
    plots: &[Detection<f32, 2>],
    candidates: Candidates<'_>,
    scored: &mut Scored,
) -> f32 {
    pieces::collect(sensor, bank, predicted, plots, candidates, scored)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn gate64_plane(
    sensor: &UniformSensor<Position<f32, 2, 2>, f32>,
    bank: &Bank<MODES>,
    predicted: &Predicted,
    plots: &[Detection<f32, 2>],
    candidates: Candidates<'_>,
    scored: &mut Scored,
) -> f32 {
    pieces::collect(sensor, bank, predicted, plots, candidates, scored)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn cluster16_32(matrix: &mut Matrix, memory: &mut Joint) -> Completeness {
    pieces::joint(matrix, memory)
}

#[entry]
fn main() -> ! {
    static mut BANK3: Bank<3> = ModeBank::ZERO;
    static mut BANK7: Bank<7> = ModeBank::ZERO;
    static mut SCORED: Scored = Scored::new();
    static mut MATRIX: Matrix = Matrix::new();
    static mut JOINT: Joint = <Jpda<NODES> as Associator<f32, TRACKS, DETS>>::MEMORY;
    let passed = Models::new().is_ok_and(|models| filters(&models) && gates(&models, SCORED))
        && pieces::is_converted(&convert_polar(&pieces::polar()))
        && data::MIX3_4.pass(BANK3, mix3_4)
        && data::MIX7_4.pass(BANK7, mix7_4)
        && pieces::associates(MATRIX, |matrix| cluster16_32(matrix, JOINT));
    exit(passed)
}

/// Updates and the turn; whether all results agree.
fn filters(models: &Models) -> bool {
    data::EKF2_4.pass(|g, z| ekf2_update_4(&models.radar2, g, z))
        && data::EKF3_4.pass(|g, z| ekf3_update_4(&models.radar3, g, z))
        && data::EKF4_9.pass(|g, z| ekf4_update_9(&models.radar4, g, z))
        && data::UKF4_9.pass(|g, z| ukf4_update_9(&models.unscented, g, z))
        && data::TURN_5.pass(|g| turn_predict_5(&models.turn, g))
}

/// Gating; whether all results agree.
fn gates(models: &Models, scored: &mut Scored) -> bool {
    let polar = data::GATE_POLAR.pass(scored, |bank, plots, scored| {
        gate64_polar(&models.polar, bank, &innovations(bank, &models.polar.model), plots, Candidates::new(plots, &ALL), scored);
    });
    let plane = data::GATE_PLANE.pass(scored, |bank, plots, scored| {
        gate64_plane(&models.plane, bank, &innovations(bank, &models.plane.model), plots, Candidates::new(plots, &ALL), scored);
    });
    polar && plane
}

firmware_example::silent!();
