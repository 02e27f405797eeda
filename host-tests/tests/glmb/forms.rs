//! The forms of a density against each other, births from detections, scans at one time, and the bits of the target.

use super::{All, Outcome, Problem, Sensor, ample, l1, sets, time};
use boresight::association::Gate;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Mixture, Particles, Ranked, Region, Truncation};
use boresight::initiation::{Initiation, Rule};
use boresight::mode::ModeSet;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::SVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::error::Error;

type Events = Ranked<32, 16>;
type Straight = (ConstantVelocity<f64, 2>,);

fn straight() -> Result<JmsGlmb<f64, Straight, Events, 4, 1, 2>, Box<dyn Error>> {
    let modes = (ConstantVelocity::new(ProcessNoise::Discrete(4.0))?,);
    Ok(JmsGlmb::new(modes, [[1.0]], 0.99, Ranked)?)
}

fn sensor(p_detect: f64) -> Result<Sensor<f64>, Box<dyn Error>> {
    let model = Position::new(Symmetric::from_diagonal([25.0; 2]))?;
    Ok(UniformSensor::new(model, p_detect, Clutter::Poisson(1e-7), Gate::new::<2>(25.0)?)?)
}

fn prior() -> Gaussian<f64, 4> {
    Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1e4, 100.0, 1e4, 100.0]))
}

/// The position of a target on its way.
fn place(k: usize) -> [f64; 2] {
    [40.0 + 6.0 * k as f64, -30.0 - 4.0 * k as f64]
}

/// Estimates of 20 scans, scan by scan.
fn follow<M: ModeSet<f64, 4, 1>, D: Density<f64, 4, 1>, const S: usize>(
    tracker: &JmsGlmb<f64, M, Events, 4, 1, 2>,
    seed: u64,
) -> Result<Vec<SVector<f64, 4>>, Box<dyn Error>>
where
    Events: Truncation<f64, 3>,
{
    let (sensor, mut rng) = (sensor(0.9)?, ChaCha8Rng::seed_from_u64(seed));
    let mut state = Box::new(GlmbState::<f64, D, Events, S, 32, 3, 4, 4>::new());
    let mut means = Vec::new();
    for k in 0..20 {
        let [x, y] = place(k);
        let plots = [Detection::new([x + 4.0 * (k as f64).sin(), y + 4.0 * (1.7 * k as f64).cos()])];
        // One scan in five sees nothing.
        let plots = if k % 5 == 4 { &plots[..0] } else { &plots[..] };
        tracker.step_with(&mut state, &sensor, &Scan::new(time(k), plots), &mut rng)?;
        let first = state.estimates().next().ok_or("no target")?;
        means.push(first.state.mean);
    }
    Ok(means)
}

/// In a linear problem points say what Gaussians say, up to an error that falls with the root of their number.
#[test]
fn particles_agree_with_gaussians() -> Outcome {
    let tracker = straight()?.with_region(Region::new(0.5, prior(), [1.0])?)?;
    let exact = follow::<_, Mixture<f64, 4, 1, 1>, 6>(&tracker, 0)?;
    let mut squares = [0.0; 2];
    for seed in 0..10 {
        let few = follow::<_, Particles<f64, 4, 1, 100>, 6>(&tracker, seed)?;
        let many = follow::<_, Particles<f64, 4, 1, 1000>, 6>(&tracker, seed)?;
        for (squares, drawn) in squares.iter_mut().zip([few, many]) {
            let apart = |(a, b): (&SVector<f64, 4>, &SVector<f64, 4>)| (a[0] - b[0]).powi(2) + (a[2] - b[2]).powi(2);
            *squares += drawn.iter().zip(&exact).map(apart).sum::<f64>() / 200.0;
        }
    }
    let [few, many] = squares.map(f64::sqrt);
    // 0.32 for ten times as many. A track knows its position to 5 m.
    assert!(many < 0.8 && (0.2..0.45).contains(&(many / few)), "{few} {many}");
    Ok(())
}

/// Two sensors at a time: between their scans points have no noise left to be drawn, and are weighed as they are.
#[test]
fn particles_take_two_scans_at_one_time() -> Outcome {
    let tracker = straight()?.with_region(Region::new(0.5, prior(), [1.0])?)?;
    let (sensor, mut rng) = (sensor(0.9)?, ChaCha8Rng::seed_from_u64(8));
    let mut exact = Box::new(GlmbState::<f64, Mixture<f64, 4, 1, 1>, Events, 6, 32, 3, 4, 4>::new());
    let mut points = Box::new(GlmbState::<f64, Particles<f64, 4, 1, 1000>, Events, 6, 32, 3, 4, 4>::new());
    for k in 0..20 {
        let [x, y] = place(k / 2);
        let plots = [Detection::new([x + 4.0 * (k as f64).sin(), y + 4.0 * (1.7 * k as f64).cos()])];
        let scan = Scan::new(time(k / 2), &plots);
        let reports = [tracker.step(&mut exact, &sensor, &scan)?, tracker.step_with(&mut points, &sensor, &scan, &mut rng)?];
        assert!(reports.iter().all(|report| report.numeric_resets == 0), "{reports:?}");
        let mean = |first: Option<SVector<f64, 4>>| first.ok_or("no target");
        let known = mean(exact.estimates().next().map(|target| target.state.mean))?;
        let drawn = mean(points.estimates().next().map(|target| target.state.mean))?;
        assert!((known[0] - drawn[0]).hypot(known[2] - drawn[2]) < 2.5, "scan {k}: {known} {drawn}");
    }
    Ok(())
}

/// With Gaussians for all sequences of modes nothing changes when there are more; with fewer it does, a little.
#[test]
fn components_beyond_those_needed_change_nothing() -> Outcome {
    type With<const COMPS: usize> = GlmbState<f64, Mixture<f64, 4, 2, COMPS>, All, 128, 4096, 6, 4, 4>;
    let mut merged: f64 = 0.0;
    for seed in 40..50 {
        let problem = Problem::draw(seed);
        let (tracker, sensor) = (problem.tracker(All::default())?, problem.sensor()?);
        let (mut many, mut one) = (Box::new(With::<7>::new()), Box::new(With::<1>::new()));
        for k in 0..problem.scans.len() {
            let plots = problem.plots(k);
            tracker.step(&mut many, &sensor, &Scan::new(time(k), &plots))?;
            tracker.step(&mut one, &sensor, &Scan::new(time(k), &plots))?;
        }
        let known = sets(&*ample::<f64>(&problem, problem.scans.len())?);
        assert!(l1(&sets(&*many), &known) < 1e-12);
        merged = merged.max(l1(&sets(&*one), &known));
    }
    assert!(merged > 1e-9 && merged < 0.05, "{merged}");
    Ok(())
}

#[test]
fn targets_appear_where_detections_are() -> Outcome {
    let initiation = Initiation::new(Rule::OnePoint, prior())?;
    let tracker = straight()?.with_initiation(initiation, 0.1, 0.05, [1.0])?;
    let sensor = sensor(0.9)?;
    let mut state = Box::new(GlmbState::<f64, Mixture<f64, 4, 1, 1>, Events, 16, 32, 6, 4, 8>::new());
    for k in 0..8 {
        let [x, y] = place(k);
        // Behind, in front and far away, a different place every scan: not a target's.
        let clutter = [(997 * k) % 7000, (383 * k) % 5000].map(|c| c as f64 - 3000.0);
        let plots = [Detection::new(clutter), Detection::new([x, y])];
        tracker.step(&mut state, &sensor, &Scan::new(time(k), &plots))?;
    }
    let targets: Vec<_> = state.estimates().collect();
    assert_eq!(targets.len(), 1);
    let [x, y] = place(7);
    let mean = targets[0].state.mean;
    assert!((mean[0] - x).hypot(mean[2] - y) < 5.0 && targets[0].existence > 0.9, "{mean}");
    // Born in the second scan, from the second detection of the first.
    assert_eq!((targets[0].label.birth_scan, targets[0].label.index), (1, 1));
    Ok(())
}

/// A second sensor that sees nothing, at the time of the first and without a chance to detect, tells nothing.
#[test]
fn nothing_moves_appears_or_goes_between_scans_at_one_time() -> Outcome {
    for seed in 50..60 {
        let problem = Problem::draw(seed);
        let mut state = ample::<f64>(&problem, problem.scans.len())?;
        let before = sets(&*state);
        let means = |state: &super::Ample<f64>| state.labels::<4, 2>().map(|e| e.state.mean).collect::<Vec<_>>();
        let at = means(&state);
        let model = Position::<f64, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?;
        let blind = UniformSensor::new(model, 0.0, Clutter::Poisson(1e-5), Gate::new::<2>(1e6)?)?;
        let tracker = problem.tracker::<f64, _>(All::default())?;
        let report = tracker.step(&mut state, &blind, &Scan::new(time(problem.scans.len() - 1), &[]))?;
        assert!(report.is_complete() && report.births == 0);
        assert!(l1(&sets(&*state), &before) < 1e-12);
        // The table may be in another order.
        let moved = |a: &SVector<f64, 4>| means(&state).iter().map(|b| (a - b).norm()).fold(f64::INFINITY, f64::min);
        assert!(at.iter().all(|a| moved(a) < 1e-9));
    }
    Ok(())
}

#[test]
fn the_target_s_image_computes_the_same_bits() -> Outcome {
    use twin::glmb::{CHECKSUMS, Checksum, Linear, Points, Scans, Sigma, linear, particles, unscented};
    let mut sums = [Checksum::default(); 3];
    let (mut form, mut scans, mut state) = (linear()?, Scans::new(), Box::new(Linear::new()));
    while let Some(scan) = scans.next(false) {
        assert!(form.step(&mut state, &scan));
        sums[0].add(&state);
    }
    let (mut form, mut scans, mut state) = (unscented()?, Scans::new(), Box::new(Sigma::new()));
    while let Some(scan) = scans.next(true) {
        assert!(form.step(&mut state, &scan));
        sums[1].add(&state);
    }
    let (mut form, mut scans, mut state) = (particles()?, Scans::new(), Box::new(Points::new()));
    while let Some(scan) = scans.next(true) {
        assert!(form.step(&mut state, &scan));
        sums[2].add(&state);
    }
    assert_eq!(sums, CHECKSUMS, "{sums:x?}");
    // 262 targets' scans.
    assert!(sums.iter().all(|sum| sum.estimates.abs_diff(262) <= 10));
    Ok(())
}
