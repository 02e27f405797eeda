//! Numbers at the ends of their ranges: certain births and survival, sensors that never miss or never err, no clutter, weights
//! that single precision cannot hold.

use super::{All, Ample, Outcome, Problem, ample, l1, sets, time};
use boresight::association::Gate;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Gibbs, Label, Mixture, Particles, Ranked, Region, Truncation};
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::SVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What is certain, impossible, or in between.
#[derive(Debug, Clone, Copy)]
struct Setting {
    p_survive: f64,
    birth: f64,
    p_detect: f64,
    clutter: f64,
}

fn settings() -> impl Iterator<Item = Setting> {
    let ends = [0.0, 0.5, 1.0];
    let clutter = [0.0, 1e-4];
    let all = ends.into_iter().flat_map(move |p_survive| ends.into_iter().map(move |birth| (p_survive, birth)));
    let all = all.flat_map(move |(p_survive, birth)| ends.into_iter().map(move |p_detect| (p_survive, birth, p_detect)));
    all.flat_map(move |(p_survive, birth, p_detect)| clutter.map(|clutter| Setting { p_survive, birth, p_detect, clutter }))
}

fn density<T: Real>() -> Gaussian<T, 4> {
    Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([100.0, 25.0, 100.0, 25.0].map(T::lit)))
}

/// Six scans with none to two detections; what is told must be sound after each.
fn survive<T, D, A, const LABELS: usize>(setting: Setting, truncation: A) -> Result<f32, Box<dyn std::error::Error>>
where
    T: Real,
    D: Density<T, 4, 2>,
    A: Truncation<T, LABELS>,
{
    let mode = |noise| ConstantVelocity::<T, 2>::new(ProcessNoise::Discrete(T::lit(noise)));
    let jump = [[0.9, 0.1], [0.2, 0.8]].map(|row: [f64; 2]| row.map(T::lit));
    let mut tracker = JmsGlmb::<T, _, A, 4, 2, 3>::new((mode(1.0)?, mode(9.0)?), jump, T::lit(setting.p_survive), truncation)?;
    for _ in 0..2 {
        tracker = tracker.with_region(Region::new(T::lit(setting.birth), density(), [T::ONE, T::ZERO])?)?;
    }
    let initiation = Initiation::new(Rule::OnePoint, density())?;
    let tracker = tracker.with_initiation(initiation, T::ONE, T::lit(setting.birth), [T::ONE, T::ZERO])?;
    let model = Position::<T, 2, 2>::new(Symmetric::from_diagonal([T::lit(25.0); 2]))?;
    let clutter = Clutter::Poisson(T::lit(setting.clutter));
    let sensor = UniformSensor::new(model, T::lit(setting.p_detect), clutter, Gate::new::<2>(T::lit(50.0))?)?;
    let (mut state, mut rng) = (Box::new(GlmbState::<T, D, A, 16, 32, LABELS, 2, 4>::new()), ChaCha8Rng::seed_from_u64(1));
    let mut truncated = 0f32;
    for (k, count) in [0, 1, 2, 2, 0, 1].into_iter().enumerate() {
        let plots = [[3.0, -2.0], [-1.0, 4.0]].map(|z: [f64; 2]| Detection::new(z.map(T::lit)));
        let report = tracker.step_with(&mut state, &sensor, &Scan::new(time(k), &plots[..count]), &mut rng)?;
        let sum: f64 = state.hypotheses().map(|(weight, _)| weight.to_f64()).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{setting:?}, scan {k}: weights sum to {sum}");
        assert!((0.0..=1.0).contains(&report.truncated_mass) && report.numeric_resets == 0, "{setting:?}, scan {k}: {report:?}");
        for target in state.labels::<4, 2>().chain(state.estimates()) {
            let mut told = target.state.mean.iter().chain(&target.modes).chain([&target.existence]);
            assert!(told.all(|x| x.to_f64().is_finite()), "{setting:?}, scan {k}: {target:?}");
        }
        truncated = truncated.max(report.truncated_mass);
    }
    Ok(truncated)
}

#[test]
fn certainty_and_impossibility_are_survived() -> Outcome {
    for setting in settings() {
        survive::<f32, Mixture<f32, 4, 2, 1>, _, 6>(setting, Ranked::<32, 16>)?;
        survive::<f64, Mixture<f64, 4, 2, 2>, _, 6>(setting, Ranked::<32, 16>)?;
        survive::<f32, Mixture<f32, 4, 2, 1>, _, 6>(setting, Gibbs::<8>)?;
        survive::<f32, Particles<f32, 4, 2, 20>, _, 6>(setting, Ranked::<32, 16>)?;
    }
    Ok(())
}

/// One that is born for certain and has no room is left out: with all the weight that it had.
#[test]
fn more_certain_births_than_room_are_told() -> Outcome {
    for setting in settings().filter(|setting| setting.birth == 1.0) {
        assert!(survive::<f32, Mixture<f32, 4, 2, 1>, _, 1>(setting, Ranked::<32, 16>)? > 0.999, "{setting:?}");
        assert!(survive::<f32, Mixture<f32, 4, 2, 1>, _, 1>(setting, Gibbs::<8>)? > 0.999, "{setting:?}");
    }
    Ok(())
}

/// Certain survival and births are no more than any other to the filter with room for all.
#[test]
fn certainty_is_exact() -> Outcome {
    for seed in 1000..1020 {
        let mut problem = Problem::draw(seed);
        problem.p_survive = 1.0;
        problem.births[0].0 = 1.0;
        let scans = problem.scans.len();
        let truth = super::enumeration::Enumeration::new(&problem, scans).sets();
        assert!(l1(&sets(&*ample::<f64>(&problem, scans)?), &truth) < 1e-10, "seed {seed}");
    }
    Ok(())
}

/// Two targets that are hardly ever missed, and one detection: every event has a weight far below those of the rows, in single
/// precision below its rounding. The bound holds nevertheless, and is no idle one.
#[test]
fn the_bound_holds_where_rows_contend_for_a_detection() -> Outcome {
    type Few = GlmbState<f32, Mixture<f32, 4, 2, 4>, All, 128, 4096, 6, 4, 4>;
    for seed in 1100..1130 {
        let mut problem = Problem::draw(seed);
        (problem.visibility, problem.clutter) = ([1.0; 2], 1e-6);
        problem.births = vec![(0.99999, [2.0, 1.0], [0.5, 0.5]), (0.99999, [-2.0, 1.0], [0.5, 0.5])];
        problem.scans = vec![vec![[seed as f64 % 7.0 - 3.0, 0.0]]];
        // Two in a million are missed.
        let (p_detect, gate) = (1.0 - 2e-6, Gate::new::<2>(1e6)?);
        let model = Position::<f64, 2, 2>::new(Symmetric::from_diagonal([super::NOISE; 2]))?;
        let exact = UniformSensor::new(model, p_detect, Clutter::Poisson(problem.clutter), gate)?;
        let mut all = Box::new(Ample::<f64>::new());
        problem.tracker(All::default())?.step(&mut all, &exact, &Scan::new(time(0), &problem.plots(0)))?;
        let model = Position::<f32, 2, 2>::new(Symmetric::from_diagonal([super::NOISE as f32; 2]))?;
        let clutter = Clutter::Poisson(problem.clutter as f32);
        let single = UniformSensor::new(model, p_detect as f32, clutter, Gate::new::<2>(1e6)?)?;
        let mut few = Box::new(Few::new());
        let tracker = problem.tracker::<f32, _>(All::default())?.with_limits(1, 0.0)?;
        let report = tracker.step(&mut few, &single, &Scan::new(time(0), &problem.plots(0)))?;
        let (apart, bound) = (l1(&sets(&*few), &sets(&*all)), 2.0 * f64::from(report.truncated_mass));
        assert!(apart <= bound && bound < 1.2 * apart + 0.05, "seed {seed}: {apart} of {bound}");
    }
    Ok(())
}

/// A target that is all but impossible has no weight in single precision: nothing is told of it, and nothing is not a number.
#[test]
fn what_has_no_weight_is_not_told() -> Outcome {
    let mut problem = Problem::draw(6);
    problem.births = vec![(1e-38, [0.0, 0.0], [1.0, 0.0]), (0.5, [5.0, 0.0], [0.0, 1.0])];
    problem.scans = vec![Vec::new(), Vec::new()];
    let state = ample::<f32>(&problem, 2)?;
    assert!(state.hypotheses().any(|(weight, _)| weight == 0.0));
    assert!(state.labels::<4, 2>().all(|target| target.existence > 0.0 && target.state.mean.iter().all(|x| x.is_finite())));
    assert_eq!(state.labels::<4, 2>().count(), 2);
    Ok(())
}

/// Extreme but finite numbers: no scan panics, and what is told stays finite. Births that cannot be sound are refused, and told.
#[test]
fn extremes_are_survived() -> Outcome {
    let mode = || ConstantVelocity::<f32, 2>::new(ProcessNoise::Discrete(1.0));
    let tracker = JmsGlmb::<f32, _, All, 4, 2, 3>::new((mode()?, mode()?), [[0.5; 2]; 2], 0.99, Ranked)?
        .with_region(Region::new(0.2, density(), [0.5, 0.5])?)?
        .with_initiation(Initiation::new(Rule::OnePoint, density())?, 0.5, 0.2, [0.5, 0.5])?;
    let sensor = Problem::draw(3).sensor()?;
    let (mut state, mut refused) = (Box::new(Ample::<f32>::new()), 0);
    for (k, value) in [0.0, 1e30, -1e30, 1e-30, 3e38, 0.0].into_iter().enumerate() {
        let plots = [Detection::new([value, value]), Detection::new([0.0, -value])];
        let at = Instant::from_millis(1000 * 2u64.pow(8 * k as u32));
        let report: Report = tracker.step(&mut state, &sensor, &Scan::new(at, &plots))?;
        refused += report.births_refused;
        let sum: f32 = state.hypotheses().map(|(weight, _)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        assert!(state.labels::<4, 2>().all(|e| e.existence.is_finite()));
    }
    assert!(refused > 0);
    Ok(())
}

/// Births from detections are named by the place of these among those that were taken in.
#[test]
fn names_count_what_was_taken_in() -> Outcome {
    let mode = || ConstantVelocity::<f64, 2>::new(ProcessNoise::Discrete(1.0));
    let tracker = JmsGlmb::<f64, _, All, 4, 2, 2>::new((mode()?, mode()?), [[0.5; 2]; 2], 0.99, Ranked)?;
    let tracker = tracker.with_initiation(Initiation::new(Rule::OnePoint, density())?, 0.2, 0.2, [0.5, 0.5])?;
    let model = Position::<f64, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?;
    let sensor = UniformSensor::new(model, 0.9, Clutter::Poisson(1e-6), Gate::new::<2>(25.0)?)?;
    let mut state = Box::new(GlmbState::<f64, Mixture<f64, 4, 2, 1>, All, 16, 32, 6, 4, 2>::new());
    for k in 0..4 {
        // Room for two of three: the weakest goes.
        let plots = [[900.0, 900.0], [0.0, 0.0], [400.0, 0.0]].map(Detection::new);
        let plots = [plots[0].with_amplitude(1.0), plots[1].with_amplitude(2.0), plots[2].with_amplitude(3.0)];
        let report = tracker.step(&mut state, &sensor, &Scan::new(time(k), &plots))?;
        assert_eq!(report.detections_dropped, 1);
    }
    let mut labels: Vec<Label> = state.estimates::<4, 2>().map(|target| target.label).collect();
    labels.sort();
    assert_eq!(labels, [0, 1].map(|index| Label { birth_scan: 1, index }));
    Ok(())
}
