//! The work that the likely-model set saves is saved: predictions and predicted measurements are counted.

use super::{MODES, Outcome, chain, turns};
use boresight::association::{Gate, Jpda};
use boresight::gaussian::{Gaussian, Innovation};
use boresight::mode::{LikelyModes, ModeSet};
use boresight::model::position::Position;
use boresight::model::turn::KnownTurn;
use boresight::model::{Layout, MeasurementModel};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use boresight::tracker::{LmsJpda, LmsState};
use nalgebra::{SMatrix, SVector};
use std::cell::Cell;

thread_local! {
    /// Predictions, predicted measurements and residuals.
    static COUNTED: Cell<[usize; 3]> = const { Cell::new([0; 3]) };
}

fn count(kind: usize) {
    let mut counted = COUNTED.get();
    counted[kind] += 1;
    COUNTED.set(counted);
}

/// A model that counts its calls.
#[derive(Clone, Copy, Debug)]
struct Counting<M>(M);

impl ModeSet<f64, 4, MODES> for Counting<[KnownTurn<f64, 2>; MODES]> {
    const LAYOUT: Layout = <[KnownTurn<f64, 2>; MODES] as ModeSet<f64, 4, MODES>>::LAYOUT;
    type Steps = <[KnownTurn<f64, 2>; MODES] as ModeSet<f64, 4, MODES>>::Steps;

    fn steps(&self, dt: f64) -> Self::Steps {
        self.0.steps(dt)
    }
    fn advance(&self, mode: usize, g: &mut Gaussian<f64, 4>, steps: &Self::Steps) {
        count(0);
        self.0.advance(mode, g, steps);
    }
    fn propagate(&self, mode: usize, x: &SVector<f64, 4>, v: &mut SMatrix<f64, 4, 4>, dt: f64) {
        self.0.propagate(mode, x, v, dt);
    }
}

impl MeasurementModel<f64, 4, 2> for Counting<Position<f64, 2, 2>> {
    const LAYOUT: Layout = <Position<f64, 2, 2> as MeasurementModel<f64, 4, 2>>::LAYOUT;

    fn observe(&self, x: &SVector<f64, 4>) -> SVector<f64, 2> {
        self.0.observe(x)
    }
    fn jacobian(&self, x: &SVector<f64, 4>) -> SMatrix<f64, 2, 4> {
        MeasurementModel::<f64, 4, 2>::jacobian(&self.0, x)
    }
    fn noise(&self, x: &SVector<f64, 4>) -> Symmetric<f64, 2> {
        self.0.noise(x)
    }
    fn residual(&self, z: &SVector<f64, 2>, z_hat: &SVector<f64, 2>) -> SVector<f64, 2> {
        count(2);
        MeasurementModel::<f64, 4, 2>::residual(&self.0, z, z_hat)
    }
    fn innovation(&self, g: &Gaussian<f64, 4>) -> Innovation<f64, 4, 2> {
        count(1);
        self.0.innovation(g)
    }
}

#[test]
fn nothing_is_computed_for_modes_that_do_not_run() -> Outcome {
    let likely = LikelyModes::new(&chain(), 0.005, 0.3, 3)?.without_recall();
    let initial = [0.0, 0.0, 0.25, 0.5, 0.25, 0.0, 0.0];
    let logic = Logic::unmanaged();
    let tracker = LmsJpda::<f64, _, 4, MODES, 1, 4, Jpda<16>>::new(Counting(turns()?), chain(), initial, likely, logic, Jpda::new())?;
    let model = Counting(Position::new(Symmetric::from_diagonal([100.0; 2]))?);
    let sensor = UniformSensor::new(model, 0.9, Clutter::Poisson(1e-6), Gate::new::<2>(16.0)?)?;
    let mut state = LmsState::new();
    let g = Gaussian::new(SVector::from([0.0, 100.0, 0.0, 0.0]), Symmetric::from_diagonal([400.0, 100.0, 400.0, 100.0]));
    tracker.start(&mut state, g, Instant::from_millis(0)).ok_or("no room")?;
    let (mut predicted, mut saved) = (0, 0);
    let mut run = 3;
    for k in 1..40_u32 {
        // Straight, then a turn to the left.
        let t = f64::from(k);
        let plot = Detection::new([100.0 * t, 2.0 * (t - 15.0).clamp(0.0, 10.0).powi(2)]);
        COUNTED.set([0; 3]);
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * u64::from(k)), &[plot]))?;
        let [predictions, innovations, residuals] = COUNTED.get();
        let union = state.tracks().next().ok_or("gone")?.active().len();
        // Those that ran and those that were activated; predicted measurements of the former twice.
        assert_eq!(predictions, union, "scan {k}");
        let first = innovations - union;
        assert!(first <= union && first >= run.min(3), "scan {k}: {first} of {union}");
        // Two for the gate, likelihoods and corrections of those that ran, and once more for activated modes.
        let most = 2 + 2 * first + if union > first { union } else { 0 };
        assert!(residuals <= most, "scan {k}: {residuals} residuals, {first} ran, {union} in the union");
        run = union;
        predicted += predictions;
        saved += MODES - predictions;
    }
    assert!(saved * 3 > predicted, "{saved} predictions saved, {predicted} made");
    Ok(())
}
