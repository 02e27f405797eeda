//! The tracker: the IMM-JPDAF where all modes are kept, the variable-structure IMM where association is certain, and its tracks.

use super::{MODES, Outcome, chain, turns};
use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::evidence::{SomeInnovations, correct_by_one, no_innovations, predict_measurements};
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::mode::{ActiveSet, Deviations, LikelyModes, ModeBank, ModeSet};
use boresight::model::motion::ProcessNoise;
use boresight::model::position::Position;
use boresight::model::turn::KnownTurn;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{ImmJpda, JointState, LmsJpda, LmsState};
use nalgebra::SVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;

type Turns = [KnownTurn<f64, 2>; MODES];
type Imm = ImmJpda<f64, Turns, 4, MODES, 4, 16, Jpda<64>>;
type Lms = LmsJpda<f64, Turns, 4, MODES, 4, 16, Jpda<64>>;
type State = LmsState<f64, 4, MODES, 4, 16, Jpda<64>>;
type Sensor = UniformSensor<Position<f64, 2, 2>, f64>;

const STRAIGHT: [f64; MODES] = [0.0, 0.0, 0.25, 0.5, 0.25, 0.0, 0.0];

fn lms(likely: LikelyModes<f64, MODES>, initial: [f64; MODES]) -> Result<Lms, ConfigError> {
    Lms::new(turns()?, chain(), initial, likely, Logic::unmanaged(), Jpda::new())
}

fn likely() -> Result<LikelyModes<f64, MODES>, ConfigError> {
    LikelyModes::new(&chain(), 0.005, 0.3, 3)
}

fn sensor(p_detect: f64, clutter: Clutter<f64>) -> Result<Sensor, ConfigError> {
    UniformSensor::new(Position::new(Symmetric::from_diagonal([100.0; 2]))?, p_detect, clutter, Gate::new::<2>(100.0)?)
}

fn density(x: f64, y: f64) -> Gaussian<f64, 4> {
    Gaussian::new(SVector::from([x, 100.0, y, 0.0]), Symmetric::from_diagonal([400.0, 100.0, 400.0, 100.0]))
}

fn time(k: u64) -> Instant {
    Instant::from_millis(1000 * k)
}

fn noisy(point: [f64; 2], rng: &mut ChaCha8Rng) -> [f64; 2] {
    point.map(|v| {
        let normal: f64 = StandardNormal.sample(rng);
        v + 10.0 * normal
    })
}

/// Two targets 30 m apart, one of them turning, and clutter between them; plain plots, or some with a noise or a time of their own.
fn plots(k: u64, kind: usize, rng: &mut ChaCha8Rng) -> Vec<Detection<f64, 2>> {
    let t = k as f64;
    let mut points = vec![noisy([100.0 * t, 0.0], rng), noisy([100.0 * t, 30.0 + 2.0 * t * t], rng)];
    points.extend((0..3).map(|_| [100.0 * t + rng.random_range(-80.0..80.0), rng.random_range(-80.0..80.0)]));
    let own = |(number, z): (usize, &[f64; 2])| match (kind, number % 2) {
        (1, 1) => Detection::new(*z).with_noise(Symmetric::from_diagonal([64.0, 225.0])),
        (2, 1) => Detection::new(*z).with_offset(Duration::from_millis(20)),
        _ => Detection::new(*z),
    };
    points.iter().enumerate().map(own).collect()
}

#[test]
fn a_set_that_keeps_all_modes_is_the_imm_jpdaf() -> Outcome {
    let initial = [1.0 / MODES as f64; MODES];
    let imm = Imm::new(turns()?, chain(), initial, Logic::unmanaged(), Jpda::new())?;
    let lms = lms(LikelyModes::new(&chain(), 0.0, 1.0, MODES)?, initial)?;
    for (kind, clutter) in [(0, Clutter::Poisson(1e-4)), (1, Clutter::Poisson(1e-4)), (2, Clutter::Poisson(1e-4)), (0, Clutter::Diffuse)] {
        let (mut a, mut b) = (JointState::new(), State::new());
        for y in [0.0, 30.0] {
            imm.start(&mut a, density(0.0, y), time(0)).ok_or("no room")?;
            lms.start(&mut b, density(0.0, y), time(0)).ok_or("no room")?;
        }
        let sensor = sensor(0.9, clutter)?;
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for k in 1..25 {
            let plots = plots(k, kind, &mut rng);
            // Every fifth scan is followed by another at the same time.
            for _ in 0..1 + k % 5 / 4 {
                let scan = Scan::new(time(k), &plots);
                assert_eq!(imm.step(&mut a, &sensor, &scan)?, lms.step(&mut b, &sensor, &scan)?);
            }
            for (x, y) in a.tracks().zip(b.tracks()) {
                let (g, h) = (x.bank().combined(), y.bank().combined());
                assert!((g.mean - h.mean).amax() < 1e-8, "kind {kind}, scan {k}: {}", (g.mean - h.mean).amax());
                assert!((g.cov.to_matrix() - h.cov.to_matrix()).amax() < 1e-7);
                assert!(x.bank().prob.iter().zip(&y.bank().prob).all(|(p, q)| (p - q).abs() < 1e-11));
                assert_eq!(y.active(), ActiveSet::first(MODES));
                let beta = |id| a.association(id).zip(b.association(id)).ok_or("no association");
                let ((miss, row), (other, others)) = beta(x.id().ok_or("free")?)?;
                assert!((miss - other).abs() < 1e-10 && row.iter().zip(others).all(|(p, q)| (p - q).abs() < 1e-10));
            }
        }
        assert_eq!(a.tracks().count(), 2);
    }
    Ok(())
}

/// Where the one detection is certainly the target's, the tracker is the variable-structure IMM, sets included.
#[test]
fn without_doubt_about_association_it_is_the_variable_structure_imm() -> Outcome {
    let (motion, jump, rules) = (turns()?, chain(), likely()?.without_recall());
    let lms = lms(rules, STRAIGHT)?;
    let sensor = sensor(1.0, Clutter::Poisson(1e-9))?;
    for kind in 0..2 {
        let mut state = State::new();
        let id = lms.start(&mut state, density(0.0, 0.0), time(0)).ok_or("no room")?;
        let mut bank = ModeBank::new(STRAIGHT, density(0.0, 0.0));
        let mut run = bank.active();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut sizes = Vec::new();
        for k in 1..60 {
            let angle = 0.05 * (k as f64 - 20.0).clamp(0.0, 20.0);
            let z = noisy([100.0 * k as f64, 40.0 * angle * angle * 20.0], &mut rng);
            let noise = Symmetric::from_diagonal([100.0, 100.0 + 44.0 * kind as f64]);
            let model = Position::<f64, 2, 2>::new(noise)?;
            let plot = Detection::new(z);
            let plot = if kind == 1 { plot.with_noise(noise) } else { plot };
            lms.step(&mut state, &sensor, &Scan::new(time(k), &[plot]))?;

            let before = Deviations::new(&bank, bank.active());
            bank.prob = [0.0; MODES];
            let cycle = |bank: &mut ModeBank<f64, 4, MODES>, modes: ActiveSet| {
                bank.interact_from(&before, &jump, run, modes);
                bank.advance_active(&motion, modes, &motion.steps(1.0));
                let mut innovations = no_innovations();
                predict_measurements(&mut innovations, bank, modes, &model);
                correct_by_one(bank, &SomeInnovations::new(&innovations, modes), &model, &SVector::from(z)).0.map(f64::exp)
            };
            let first = cycle(&mut bank, run);
            run = rules.adapt(&mut bank, run, first, false, |bank, new| Some(cycle(bank, new))).next;

            let track = state.track(id).ok_or("gone")?;
            assert_eq!(track.active(), bank.active(), "scan {k}");
            for r in track.active().iter() {
                assert!((track.bank().prob[r] - bank.prob[r]).abs() < 1e-9, "scan {k}, mode {r}");
                assert!((track.bank().modes[r].mean - bank.modes[r].mean).amax() < 1e-6);
                assert!((track.bank().modes[r].cov.to_matrix() - bank.modes[r].cov.to_matrix()).amax() < 1e-5);
            }
            sizes.push(track.active().len());
        }
        assert!(sizes.iter().any(|n| *n < 5) && sizes.iter().any(|n| *n > 3), "{sizes:?}");
    }
    Ok(())
}

#[test]
fn an_empty_gate_and_a_surprise_bring_all_modes_back() -> Outcome {
    let sensor = sensor(0.9, Clutter::Poisson(1e-7))?;
    let active = |rules: LikelyModes<f64, MODES>, last: &[Detection<f64, 2>]| -> Result<usize, Box<dyn Error>> {
        let (lms, mut state) = (lms(rules, STRAIGHT)?, State::new());
        let id = lms.start(&mut state, density(0.0, 0.0), time(0)).ok_or("no room")?;
        for k in 1..10 {
            lms.step(&mut state, &sensor, &Scan::new(time(k), &[Detection::new([100.0 * k as f64, 0.0])]))?;
        }
        lms.step(&mut state, &sensor, &Scan::new(time(10), last))?;
        Ok(state.track(id).ok_or("gone")?.active().len())
    };
    let (near, far) = ([Detection::new([1000.0, 3.0])], [Detection::new([1000.0, 60.0])]);
    let rules = likely()?;
    assert!(active(rules, &near)? < MODES);
    assert_eq!([active(rules, &far)?, active(rules, &[])?], [MODES, MODES]);
    assert!(active(rules.with_recall(f64::INFINITY)?, &far)? < MODES);
    assert_eq!(active(rules.with_recall(f64::INFINITY)?, &[])?, MODES);
    assert!(active(rules.without_recall(), &far)? < MODES && active(rules.without_recall(), &[])? < MODES);
    Ok(())
}

#[test]
fn a_new_track_in_an_old_slot_begins_with_the_initial_modes() -> Outcome {
    let (lms, mut state) = (lms(likely()?, STRAIGHT)?, State::new());
    let sensor = sensor(0.9, Clutter::Poisson(1e-7))?;
    let first = lms.start(&mut state, density(0.0, 0.0), time(0)).ok_or("no room")?;
    lms.step(&mut state, &sensor, &Scan::new(time(1), &[]))?;
    assert_eq!(state.track(first).ok_or("gone")?.active().len(), MODES);
    state.remove(first);
    let second = lms.start(&mut state, density(0.0, 0.0), time(1)).ok_or("no room")?;
    lms.step(&mut state, &sensor, &Scan::new(time(2), &[Detection::new([100.0, 0.0])]))?;
    let active = state.track(second).ok_or("gone")?.active();
    assert!(active.len() <= 5 && active.contains(3), "{active:?}");
    Ok(())
}

/// Scans that no filter can make sense of, in single precision: every track stays sound, or goes.
#[test]
fn absurd_scans_break_nothing() -> Outcome {
    type Small = LmsJpda<f32, [KnownTurn<f32, 2>; MODES], 4, MODES, 3, 6, Jpda<16>>;
    let jump = chain().map(|row| row.map(|p| p as f32));
    let mut turns = [KnownTurn::new(0.0, ProcessNoise::Discrete(1.0))?; MODES];
    for (number, turn) in turns.iter_mut().enumerate() {
        *turn = KnownTurn::new(0.3 * (number as f32 - 3.0), ProcessNoise::Discrete(1.0))?;
    }
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 1e4, 1.0, 1e4]));
    let rule = Rule::TwoPoint { max_speed: 1e4, max_gap: Duration::from_millis(1 << 20) };
    let likely = LikelyModes::new(&jump, 0.005, 0.3, 3)?;
    let tracker = Small::new(turns, jump, STRAIGHT.map(|p| p as f32), likely, Logic::new(2, 3, 3)?, Jpda::new())?;
    let tracker = tracker.with_initiation(Initiation::new(rule, prior)?);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut seen = 0;
    for _ in 0..200 {
        let (mut state, mut at) = (LmsState::new(), 0);
        for _ in 0..30 {
            at += [0, 1, 1000, 1000, 1000, 500_000][rng.random_range(0..6)];
            let plots: Vec<_> = (0..rng.random_range(0..9))
                .map(|_| {
                    let scale = [1e-20_f32, 1.0, 100.0, 100.0, 1e6, 1e18][rng.random_range(0..6)];
                    let plot = Detection::new([scale * rng.random_range(-1.0..1.0), scale * rng.random_range(-1.0..1.0)]);
                    let noise = Symmetric::from_diagonal([[1e-12_f32, 1.0, 1e4, 1e12][rng.random_range(0..4)]; 2]);
                    if rng.random_bool(0.3) { plot.with_noise(noise) } else { plot }
                })
                .collect();
            let noise = [1e-6, 100.0, 1e8][rng.random_range(0..3)];
            let clutter = if rng.random_bool(0.5) { Clutter::Diffuse } else { Clutter::Poisson(1e-6) };
            let model = Position::<f32, 2, 2>::new(Symmetric::from_diagonal([noise; 2]))?;
            let sensor = UniformSensor::new(model, 0.9, clutter, Gate::new::<2>(16.0)?)?;
            tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(at), &plots))?;
            for track in state.tracks() {
                let g = track.bank().combined();
                assert!(track.bank().is_valid() && g.mean.iter().all(|v| v.is_finite()) && g.cov.has_valid_variances());
                assert!((track.bank().prob.iter().sum::<f32>() - 1.0).abs() < 1e-4 && track.active().len() >= 3, "{:?}", track.bank().prob);
                seen += 1;
            }
        }
    }
    assert!(seen > 1000, "{seen} tracks");
    Ok(())
}
