//! What no tracker may take in is refused, and nothing changes.

use super::{All, Ample, Outcome, Problem, ample, sets, time};
use boresight::association::Gate;
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::glmb::{Ranked, Region};
use boresight::initiation::{Initiation, Rule};
use boresight::model::position::Position;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::JmsGlmb;
use nalgebra::SVector;

#[test]
fn bad_scans_leave_the_state_as_it_was() -> Outcome {
    let problem = Problem::draw(1);
    let scans = problem.scans.len();
    let mut state = ample::<f64>(&problem, scans)?;
    let (tracker, sensor) = (problem.tracker::<f64, _>(All::default())?, problem.sensor()?);
    let (before, at) = (sets(&*state), state.time());
    let bad = [[f64::NAN, 0.0], [0.0, f64::INFINITY]].map(|z| [Detection::new(z)]);
    for plots in &bad {
        assert_eq!(tracker.step(&mut state, &sensor, &Scan::new(time(scans), plots)), Err(ScanError::DetectionNotFinite));
    }
    assert_eq!(tracker.step(&mut state, &sensor, &Scan::new(Instant::ZERO, &[])), Err(ScanError::TimeReversed));
    let noise = Symmetric::from_diagonal([25.0; 2]);
    let diffuse = UniformSensor::new(Position::<f64, 2, 2>::new(noise)?, 0.9, Clutter::Diffuse, Gate::new::<2>(16.0)?)?;
    let plots = [Detection::new([0.0, 0.0])];
    assert_eq!(tracker.step(&mut state, &diffuse, &Scan::new(time(scans), &plots)), Err(ScanError::ClutterUnknown));
    let gate = Gate::new::<3>(16.0)?;
    let wrong = UniformSensor::new(Position::<f64, 2, 2>::new(noise)?, 0.9, Clutter::Poisson(1e-4), gate)?;
    assert_eq!(tracker.step(&mut state, &wrong, &Scan::new(time(scans), &plots)), Err(ScanError::GateDimension));
    let nowhere = Position::<f64, 2, 2>::new(noise)?.at(SVector::from([f64::NAN, 0.0]));
    let lost = UniformSensor::new(nowhere, 0.9, Clutter::Poisson(1e-4), Gate::new::<2>(16.0)?)?;
    assert_eq!(tracker.step(&mut state, &lost, &Scan::new(time(scans), &plots)), Err(ScanError::SensorNotFinite));
    assert_eq!((sets(&*state), state.time()), (before, at));
    Ok(())
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

/// Extreme but finite numbers: no scan panics, and what is told stays finite.
#[test]
fn extremes_are_survived() -> Outcome {
    let problem = Problem::draw(3);
    let (tracker, sensor) = (problem.tracker::<f32, _>(All::default())?, problem.sensor()?);
    let mut state = Box::new(Ample::<f32>::new());
    for (k, value) in [0.0, 1e30, -1e30, 1e-30, 3e38, 0.0].into_iter().enumerate() {
        let plots = [Detection::new([value, value]), Detection::new([0.0, -value])];
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * 2u64.pow(8 * k as u32)), &plots))?;
        let sum: f32 = state.hypotheses().map(|(weight, _)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        assert!(state.labels::<4, 2>().all(|e| e.existence.is_finite()));
    }
    Ok(())
}
