//! What no tracker may take in is refused, and nothing changes.

use super::{All, Outcome, Problem, time};
use boresight::association::Gate;
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Gibbs, Mixture, Particles, Ranked, Region, Truncation};
use boresight::initiation::{Initiation, Rule};
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::SVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::fmt::Debug;

/// A tracker of any form has taken in three scans; then come those that it may not take. Neither the state nor the generator may
/// be another one afterwards: all bits are compared, scratch included.
fn refuse<T: Real, D: Density<T, 4, 2>, A: Truncation<T, 6> + Debug>(truncation: A) -> Outcome {
    let problem = Problem::draw(1);
    let prior = Initiation::new(Rule::OnePoint, problem.birth::<T>(0))?;
    let tracker = problem.tracker::<T, A>(truncation)?.with_initiation(prior, T::lit(0.2), T::lit(0.1), [T::ONE, T::ZERO])?;
    let (sensor, mut rng) = (problem.sensor()?, ChaCha8Rng::seed_from_u64(3));
    let mut state = Box::new(GlmbState::<T, D, A, 16, 32, 6, 4, 4>::new());
    for k in 0..3 {
        let plots = [[k as f64, 1.0], [-10.0, 4.0]].map(|z| Detection::new(z.map(T::lit)));
        tracker.step_with(&mut state, &sensor, &Scan::new(time(k), &plots), &mut rng)?;
    }
    let (before, drawn) = (format!("{state:?}"), rng.clone());
    let zero = Detection::new([T::ZERO; 2]);
    let (infinity, noise) = (T::ONE / T::ZERO, Symmetric::from_diagonal([T::lit(25.0); 2]));
    let bad = [
        (Detection::new([T::lit(f64::NAN), T::ZERO]), ScanError::DetectionNotFinite),
        (Detection::new([T::ZERO, infinity]), ScanError::DetectionNotFinite),
        (zero.with_amplitude(infinity), ScanError::DetectionNotFinite),
        (zero.with_noise(Symmetric::from_diagonal([-T::ONE; 2])), ScanError::NoiseNotDefinite),
        (zero.with_offset(Duration::from_millis(70_000)), ScanError::OffsetTooLarge),
    ];
    for (plot, error) in bad {
        let told = tracker.step_with(&mut state, &sensor, &Scan::new(time(3), &[zero, plot]), &mut rng);
        assert_eq!(told, Err(error));
    }
    let told = tracker.step_with(&mut state, &sensor, &Scan::new(Instant::ZERO, &[]), &mut rng);
    assert_eq!(told, Err(ScanError::TimeReversed));
    let place = |x| Ok::<_, ConfigError>(Position::<T, 2, 2>::new(noise)?.at(SVector::from([x, T::ZERO])));
    let (gate, clutter) = (Gate::new::<2>(T::lit(16.0))?, Clutter::Poisson(T::lit(1e-4)));
    let wrong = [
        (place(T::ZERO)?, Clutter::Diffuse, gate, ScanError::ClutterUnknown),
        (place(T::ZERO)?, clutter, Gate::new::<3>(T::lit(16.0))?, ScanError::GateDimension),
        (place(infinity)?, clutter, gate, ScanError::SensorNotFinite),
    ];
    for (model, clutter, gate, error) in wrong {
        let sensor = UniformSensor::new(model, T::lit(0.9), clutter, gate)?;
        let told = tracker.step_with(&mut state, &sensor, &Scan::new(time(3), &[zero]), &mut rng);
        assert_eq!(told, Err(error));
    }
    assert!(format!("{state:?}") == before && rng == drawn);
    // And a good one is taken in still.
    tracker.step_with(&mut state, &sensor, &Scan::new(time(3), &[zero]), &mut rng)?;
    assert!(format!("{state:?}") != before);
    Ok(())
}

#[test]
fn bad_scans_leave_every_form_as_it_was() -> Outcome {
    refuse::<f32, Mixture<f32, 4, 2, 1>, _>(Ranked::<32, 16>)?;
    refuse::<f64, Mixture<f64, 4, 2, 3>, _>(Ranked::<32, 16>)?;
    refuse::<f32, Mixture<f32, 4, 2, 1>, _>(Gibbs::<20>)?;
    refuse::<f32, Particles<f32, 4, 2, 30>, _>(Ranked::<32, 16>)?;
    refuse::<f64, Particles<f64, 4, 2, 30>, _>(Gibbs::<20>)
}

#[test]
fn bad_configurations_are_refused() -> Outcome {
    let problem = Problem::draw(2);
    let new = |jump, p_survive| JmsGlmb::<f64, _, _, 4, 2, 2>::new(problem.motion(), jump, p_survive, All::default()).err();
    let jump = problem.jump;
    assert_eq!(new([[0.5, 0.4], [0.5, 0.5]], 0.9), Some(ConfigError::NotNormalised));
    assert_eq!(new(jump, 1.5), Some(ConfigError::NotAProbability));
    assert_eq!(new(jump, f64::NAN), Some(ConfigError::NotAProbability));
    let g = problem.birth::<f64>(0);
    let region = |r, g, modes: [f64; 2]| Region::new(r, g, modes).err();
    assert_eq!(region(-0.1, g, [1.0, 0.0]), Some(ConfigError::NotAProbability));
    assert_eq!(region(0.1, g, [0.5, 0.0]), Some(ConfigError::NotNormalised));
    assert_eq!(region(0.1, Gaussian::new(SVector::repeat(f64::NAN), g.cov), [1.0, 0.0]), Some(ConfigError::NotFinite));
    let indefinite = Symmetric::from_diagonal([1.0, -1.0, 1.0, 1.0]);
    assert_eq!(region(0.1, Gaussian::new(g.mean, indefinite), [1.0, 0.0]), Some(ConfigError::NotDefinite));
    let tracker = || problem.tracker::<f64, Ranked<1024, 16>>(Ranked);
    assert_eq!(tracker()?.with_limits(0, 0.5).err(), Some(ConfigError::NotPositive));
    assert_eq!(tracker()?.with_limits(5, -0.5).err(), Some(ConfigError::NotAProbability));
    assert_eq!(tracker()?.with_visibility([0.5, 2.0]).err(), Some(ConfigError::NotAProbability));
    let again = (0..3).try_fold(tracker()?, |tracker, _| tracker.with_region(Region::new(0.1, g, [1.0, 0.0])?));
    assert_eq!(again.err(), Some(ConfigError::TooManyRegions));
    let prior = Initiation::new(Rule::OnePoint, g)?;
    assert_eq!(tracker()?.with_initiation(prior, 0.0, 0.1, [1.0, 0.0]).err(), Some(ConfigError::NotPositive));
    assert_eq!(tracker()?.with_initiation(prior, 0.1, 2.0, [1.0, 0.0]).err(), Some(ConfigError::NotAProbability));
    Ok(())
}
