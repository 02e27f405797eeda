//! The work that the likely-model set saves is saved: predictions and predicted measurements are counted.

use super::{MODES, Outcome, chain, turns};
use crate::counting::{Asked, Counting, take};
use boresight::association::{Gate, Jpda};
use boresight::gaussian::Gaussian;
use boresight::mode::LikelyModes;
use boresight::model::position::Position;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use boresight::tracker::{LmsJpda, LmsState};
use nalgebra::SVector;

#[test]
fn nothing_is_computed_for_modes_that_do_not_run() -> Outcome {
    let likely = LikelyModes::new(&chain(), 0.005, 0.3, 3)?.without_recall();
    let initial = [0.0, 0.0, 0.25, 0.5, 0.25, 0.0, 0.0];
    let logic = Logic::unmanaged();
    let tracker = LmsJpda::<f64, _, 4, MODES, 1, 4, Jpda<16>>::new(Counting(turns()?), chain(), initial, likely, logic, Jpda::new())?;
    let model = Counting(Position::<f64, 2, 2>::new(Symmetric::from_diagonal([100.0; 2]))?);
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
        take();
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * u64::from(k)), &[plot]))?;
        let Asked { predictions, innovations, residuals, .. } = take();
        let [predictions, innovations, residuals] = [predictions, innovations, residuals].map(|n| n as usize);
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
