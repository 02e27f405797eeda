//! The trackers: what they refuse, what they survive, and that configuration alone decides on merged measurements.

use boresight::association::{Associator, Gate, Jpda, MergingJpda};
use boresight::coupled::{Coupling, Cross, NoCross};
use boresight::error::ScanError;
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::model::resolution::Resolution;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, Sensor, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use boresight::tracker::{CoupledState, ImmCoupled, ImmJpda, JointState};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NX: usize = 4;
const MODES: usize = 2;
const DETS: usize = 8;
const JUMP: [[f32; 2]; 2] = [[0.95, 0.05], [0.1, 0.9]];
const INITIAL: [f32; 2] = [0.8, 0.2];

type Modes = [ConstantVelocity<f32, 2>; MODES];
type Filter<C> = ImmCoupled<f32, Modes, NX, MODES, C>;
type State<C> = CoupledState<f32, NX, MODES, DETS, C>;
type Seeing = UniformSensor<Radar<f32, 2, 2, 2>, f32>;

fn modes() -> Modes {
    [0.1, 20.0].map(|variance| ConstantVelocity::new(ProcessNoise::Discrete(variance)).expect("sound"))
}

fn radar(clutter: Clutter<f32>) -> Seeing {
    let noise = Symmetric::from_diagonal([100.0, 1e-5]);
    let model = Radar::new([Component::Range, Component::Azimuth], noise).expect("sound");
    UniformSensor::new(model, 0.95, clutter, Gate::new::<2>(16.0).expect("sound")).expect("sound")
}

fn unresolving(sensor: Seeing, cells: [f32; 2]) -> Unresolving<Seeing, f32, 2> {
    Unresolving { sensor, resolution: Resolution::new(cells).expect("sound") }
}

/// Two targets before a sensor at the origin, 60 m apart and closing.
fn targets() -> [Gaussian<f32, NX>; 2] {
    let cov = Symmetric::from_diagonal([400.0, 25.0, 400.0, 25.0]);
    [30.0, -30.0].map(|y: f32| Gaussian::new([5000.0, 20.0, y, -y / 10.0].into(), cov))
}

/// Plots of both at scan `k`: one of both while they are within the cells, and a plot of clutter now and then.
fn plots(k: u64, rng: &mut ChaCha8Rng) -> Vec<Detection<f32, 2>> {
    let t = k as f32;
    let y = 30.0 - 3.0 * t;
    let plot = |y: f32, rng: &mut ChaCha8Rng| {
        let (x, noise) = (5000.0 + 20.0 * t, |rng: &mut ChaCha8Rng| 2.0 * rng.random::<f32>() - 1.0);
        Detection::new([x.hypot(y) + 10.0 * noise(rng), y.atan2(x) + 0.003 * noise(rng)])
    };
    let mut plots = if y.abs() < 15.0 { vec![plot(0.0, rng)] } else { vec![plot(y, rng), plot(-y, rng)] };
    if rng.random_bool(0.3) {
        plots.push(plot(200.0 * rng.random::<f32>() - 100.0, rng));
    }
    plots
}

fn follow<C: Coupling<f32, NX>, S: Sensor<f32, NX, 2>>(sensor: &S, scans: u64) -> State<C> {
    let (filter, mut state) = (Filter::<C>::new(modes(), JUMP, INITIAL).expect("sound"), State::<C>::new());
    filter.start(&mut state, targets(), Instant::ZERO).expect("accepted");
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for k in 1..=scans {
        let report = filter.step(&mut state, sensor, &Scan::new(Instant::from_millis(1000 * k), &plots(k, &mut rng))).expect("accepted");
        assert_eq!(report.numeric_resets, 0);
    }
    state
}

fn bits<C: Coupling<f32, NX>>(state: &State<C>) -> Vec<u32> {
    let states =
        state.estimates().flat_map(|e| e.state.mean.iter().copied().chain(e.state.cov.upper().as_flattened().to_vec()).collect::<Vec<_>>());
    states.map(f32::to_bits).collect()
}

#[test]
fn targets_are_followed_through_one_another() {
    fn hold<C: Coupling<f32, NX>>(clutter: Clutter<f32>) {
        let state = follow::<C, _>(&unresolving(radar(clutter), [30.0, 0.006]), 20);
        let y: Vec<f32> = state.estimates().map(|e| e.state.mean[2]).collect();
        // By then they have changed sides.
        assert!((y[0] + 30.0).abs() < 15.0 && (y[1] - 30.0).abs() < 15.0, "{y:?}");
    }
    for clutter in [Clutter::Diffuse, Clutter::Poisson(1e-3)] {
        hold::<Cross<f32, NX>>(clutter);
        hold::<NoCross>(clutter);
    }
}

#[test]
fn the_probability_of_one_plot_of_both_follows_the_targets() {
    let sensor = unresolving(radar(Clutter::Poisson(1e-3)), [30.0, 0.006]);
    let at = |scans: u64| follow::<Cross<f32, NX>, _>(&sensor, scans).unresolved_probability();
    assert!(at(2) < 0.2 && at(10) > 0.8 && at(20) < 0.2, "{} {} {}", at(2), at(10), at(20));
    // Of none there is none.
    let mut state = follow::<Cross<f32, NX>, _>(&sensor, 10);
    state.remove();
    assert_eq!(state.unresolved_probability(), 0.0);
}

#[test]
fn bad_scans_change_nothing() {
    let sensor = radar(Clutter::Diffuse);
    let filter = Filter::<Cross<f32, NX>>::new(modes(), JUMP, INITIAL).expect("sound");
    let mut state = follow::<Cross<f32, NX>, _>(&sensor, 5);
    let before = bits(&state);
    let good = [Detection::new([5100.0, 0.0])];
    let mut refused = |time: u64, detections: &[Detection<f32, 2>], sensor: &Seeing| {
        let refusal = filter.step(&mut state, sensor, &Scan::new(Instant::from_millis(time), detections)).err();
        assert_eq!(bits(&state), before);
        refusal
    };
    assert_eq!(refused(4999, &good, &sensor), Some(ScanError::TimeReversed));
    assert_eq!(refused(6000, &[Detection::new([f32::NAN, 0.0])], &sensor), Some(ScanError::DetectionNotFinite));
    let gate = Gate::new::<3>(16.0).expect("sound");
    let other = UniformSensor::new(sensor.model, 0.9, Clutter::Diffuse, gate).expect("sound");
    assert_eq!(refused(6000, &good, &other), Some(ScanError::GateDimension));
}

/// Whatever comes, the filter goes on or says that it has lost the targets.
#[test]
fn garbage_is_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for run in 0..40 {
        let sensor = unresolving(radar(Clutter::Diffuse), [30.0, 0.006]);
        let (filter, mut state) = (Filter::<Cross<f32, NX>>::new(modes(), JUMP, INITIAL).expect("sound"), State::new());
        filter.start(&mut state, targets(), Instant::ZERO).expect("accepted");
        let mut time = 0;
        for _ in 0..40 {
            time += [0, 1, 1_000_000, 3_600_000_000, 1 << 50][rng.random_range(0..if run % 4 == 0 { 5 } else { 3 })];
            let large = [1.0, 1e3, 1e18, 3e38][rng.random_range(0..4)];
            let plot = |rng: &mut ChaCha8Rng| Detection::new([large * rng.random::<f32>(), large * (rng.random::<f32>() - 0.5)]);
            let plots: Vec<_> = (0..rng.random_range(0..12)).map(|_| plot(&mut rng)).collect();
            let report = filter.step(&mut state, &sensor, &Scan::new(Instant::from_micros(time), &plots)).expect("accepted");
            assert_eq!(usize::from(report.detections) + usize::from(report.detections_dropped), plots.len());
            assert!(state.estimates().all(|e| e.state.mean.iter().all(|v| v.is_finite()) && e.state.cov.has_valid_variances()));
            assert_eq!(state.estimates().count() == 0, state.bank().is_none());
        }
    }
}

#[test]
fn two_sensors_at_one_time_are_two_scans() {
    let sensor = radar(Clutter::Diffuse);
    let filter = Filter::<NoCross>::new(modes(), JUMP, INITIAL).expect("sound");
    let mut state = follow::<NoCross, _>(&sensor, 5);
    let spread = |state: &State<NoCross>| state.estimates().map(|e| e.state.cov.get(0, 0).unwrap_or(0.0)).sum::<f32>();
    let before = spread(&state);
    // Between two scans at one time nothing moves.
    filter.step(&mut state, &sensor, &Scan::new(Instant::from_millis(5000), &[])).expect("accepted");
    assert!((spread(&state) / before - 1.0).abs() < 0.05);
}

/// The tracks of an IMM-JPDA over the same scans, to the bit.
fn joint<A: Associator<f32, 4, DETS>, S: Sensor<f32, NX, 2>>(associator: A, sensor: &S, scans: u64) -> (Vec<u32>, usize) {
    let logic = Logic::new(2, 3, 5).expect("sound");
    let tracker = ImmJpda::<f32, Modes, NX, MODES, 4, DETS, A>::new(modes(), JUMP, INITIAL, logic, associator).expect("sound");
    let mut state = JointState::<f32, NX, MODES, 4, DETS, A>::new();
    for g in targets() {
        tracker.start(&mut state, g, Instant::ZERO).expect("accepted");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for k in 1..=scans {
        tracker.step(&mut state, sensor, &Scan::new(Instant::from_millis(1000 * k), &plots(k, &mut rng))).expect("accepted");
    }
    let bits = state.estimates().flat_map(|e| e.state.mean.iter().map(|v| v.to_bits()).collect::<Vec<_>>()).collect();
    (bits, state.tracks().filter(|track| track.is_unresolved()).count())
}

#[test]
fn pairs_are_a_matter_of_configuration() {
    let plain = radar(Clutter::Diffuse);
    let coarse = unresolving(plain, [30.0, 0.006]);
    let merging = || MergingJpda::<64, 1>::new(Jpda::new());
    let ordinary = joint(Jpda::<64>::new(), &plain, 10);
    // Either half of the configuration alone changes nothing.
    assert_eq!(joint(merging(), &plain, 10), ordinary);
    assert_eq!(joint(Jpda::<64>::new(), &coarse, 10), ordinary);
    assert_ne!(joint(merging(), &coarse, 10).0, ordinary.0);
    // Two tracks while the targets are close, and again when they have parted.
    assert_eq!((joint(merging(), &coarse, 10).1, joint(merging(), &coarse, 40).1), (2, 0));
    assert_eq!(joint(merging(), &coarse, 40).0.len(), 2 * NX);
}
