//! The most work of a scan: what models are asked under the heaviest load, counted, against the formula.

use super::Outcome;
use crate::counting::{Asked, Counting, take};
use boresight::association::Gate;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Mixture, Particles, Ranked, Region};
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::SVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Detections of a scan
const DETS: usize = 8;
type Events = Ranked<16, 16>;
type Memory<D> = GlmbState<f64, D, Events, 24, 32, 6, 4, DETS>;

/// Everything full: all detections in the gates of all tracks, births from every one of them.
fn crowd<D: Density<f64, 4, 2>>() -> Outcome {
    let moving = |acceleration: f64| ConstantVelocity::<f64, 2>::new(ProcessNoise::Discrete(acceleration));
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([100.0, 25.0, 100.0, 25.0]));
    let jump = [[0.9, 0.1], [0.1, 0.9]];
    let tracker = JmsGlmb::<f64, _, Events, 4, 2, 4>::new(Counting((moving(1.0)?, moving(9.0)?)), jump, 0.95, Ranked)?
        .with_region(Region::new(0.3, prior, [0.5, 0.5])?)?
        .with_initiation(Initiation::new(Rule::OnePoint, prior)?, 2.0, 0.3, [0.5, 0.5])?;
    let model = Counting(Position::<f64, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?);
    let sensor = UniformSensor::new(model, 0.7, Clutter::Poisson(1e-3), Gate::new::<2>(1e4)?)?;
    let (mut state, mut rng) = (Box::new(Memory::<D>::new()), ChaCha8Rng::seed_from_u64(1));
    let most = Memory::<D>::worst_case::<4, 2>(usize::MAX);
    let most = [most.predictions, most.innovations, most.residuals];
    let mut seen = [0; 3];
    take();
    for k in 0..12u32 {
        let plots: Vec<_> = (0..DETS as u32).map(|i| Detection::new([f64::from(i % 3) * 6.0, f64::from((i * k) % 7) * 5.0])).collect();
        tracker.step_with(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * u64::from(k)), &plots), &mut rng)?;
        let Asked { predictions, innovations, residuals, .. } = take();
        let counted = [predictions, innovations, residuals];
        assert!(counted.iter().zip(&most).all(|(count, most)| count <= most), "{counted:?} of {most:?}");
        seen = [0, 1, 2].map(|kind| seen[kind].max(counted[kind]));
    }
    // The load is one: more than half of what may be.
    assert!(seen.iter().zip(&most).all(|(seen, most)| 2 * seen > *most), "{seen:?} of {most:?}");
    Ok(())
}

#[test]
fn no_scan_asks_more_of_gaussians_than_the_formula_says() -> Outcome {
    crowd::<Mixture<f64, 4, 2, 1>>()?;
    crowd::<Mixture<f64, 4, 2, 3>>()
}

#[test]
fn no_scan_asks_more_of_points_than_the_formula_says() -> Outcome {
    crowd::<Particles<f64, 4, 2, 50>>()
}
