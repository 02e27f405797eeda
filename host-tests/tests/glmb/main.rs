//! Labelled random finite sets: against exhaustive enumeration, by properties, and on the published scenarios.

mod capacity;
#[path = "../support/counting.rs"]
mod counting;
mod enumeration;
mod exact;
mod extremes;
mod forms;
mod properties;
mod refusal;
mod scenario;
mod work;

use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Label, Mixture, Ranked, Region, Truncation};
use boresight::model::linear::LinearMotion;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::error::Error;

type Outcome = Result<(), Box<dyn Error>>;

const BIRTHS: usize = 2;
type Sensor<T> = UniformSensor<Position<T, 2, 2>, T>;
type Tracker<T, A> = JmsGlmb<T, [LinearMotion<T, 4>; 2], A, 4, 2, BIRTHS>;
/// All events of a small problem.
type All = Ranked<1024, 16>;
/// Room for everything there is: two modes over three scans.
type Ample<T> = GlmbState<T, Mixture<T, 4, 2, 4>, All, 128, 4096, 6, 4, 4>;

/// A small problem: one or two births a scan, two modes, a few detections.
struct Problem {
    turn: f64,
    jump: [[f64; 2]; 2],
    p_survive: f64,
    visibility: [f64; 2],
    clutter: f64,
    /// r, place, mode probabilities
    births: Vec<(f64, [f64; 2], [f64; 2])>,
    scans: Vec<Vec<[f64; 2]>>,
}

const NOISE: f64 = 25.0;
const VARIANCES: [f64; 4] = [100.0, 25.0, 100.0, 25.0];

impl Problem {
    /// Targets near each other, so that they share detections.
    fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stay: [f64; 2] = [rng.random_range(0.5..1.0), rng.random_range(0.5..1.0)];
        let count = rng.random_range(1..=BIRTHS);
        let births = (0..count).map(|_| {
            let first: f64 = rng.random_range(0.0..1.0);
            (rng.random_range(0.05..0.6), [rng.random_range(-20.0..20.0), rng.random_range(-20.0..20.0)], [first, 1.0 - first])
        });
        let births: Vec<_> = births.collect();
        let scans = (0..4 - count).map(|_| {
            let dets = rng.random_range(0..=2);
            (0..dets).map(|_| [rng.random_range(-30.0..30.0), rng.random_range(-30.0..30.0)]).collect()
        });
        let scans = scans.collect();
        Self {
            turn: rng.random_range(0.1..1.0),
            jump: [[stay[0], 1.0 - stay[0]], [1.0 - stay[1], stay[1]]],
            p_survive: rng.random_range(0.7..1.0),
            visibility: [rng.random_range(0.5..1.0), rng.random_range(0.3..1.0)],
            clutter: rng.random_range(1e-5..1e-3),
            births,
            scans,
        }
    }

    /// Straight on, and a turn.
    fn motion<T: Real>(&self) -> [LinearMotion<T, 4>; 2] {
        [0.0, self.turn].map(|angle: f64| {
            let (s, c) = angle.sin_cos();
            let f = [[1.0, 1.0, 0.0, 0.0], [0.0, c, 0.0, -s], [0.0, 0.0, 1.0, 1.0], [0.0, s, 0.0, c]];
            let q = [1.0, 2.0, 1.0, 2.0];
            LinearMotion { transition: SMatrix::from_fn(|i, j| T::lit(f[i][j])), process_noise: Symmetric::from_diagonal(q.map(T::lit)) }
        })
    }

    fn birth<T: Real>(&self, number: usize) -> Gaussian<T, 4> {
        let [x, y] = self.births[number].1;
        Gaussian::new(SVector::from([x, 3.0, y, -2.0].map(T::lit)), Symmetric::from_diagonal(VARIANCES.map(T::lit)))
    }

    fn tracker<T: Real, A>(&self, truncation: A) -> Result<Tracker<T, A>, ConfigError> {
        let jump = self.jump.map(|row| row.map(T::lit));
        let tracker = JmsGlmb::new(self.motion(), jump, T::lit(self.p_survive), truncation)?;
        let tracker = tracker.with_visibility(self.visibility.map(T::lit))?;
        self.births.iter().enumerate().try_fold(tracker, |tracker, (number, (r, _, modes))| {
            tracker.with_region(Region::new(T::lit(*r), self.birth(number), modes.map(T::lit))?)
        })
    }

    /// A gate that holds everything.
    fn sensor<T: Real>(&self) -> Result<Sensor<T>, ConfigError> {
        let model = Position::new(Symmetric::from_diagonal([T::lit(NOISE); 2]))?;
        UniformSensor::new(model, T::ONE, Clutter::Poisson(T::lit(self.clutter)), Gate::new::<2>(T::lit(1e6))?)
    }

    fn plots<T: Real>(&self, k: usize) -> Vec<Detection<T, 2>> {
        self.scans[k].iter().map(|z| Detection::new(z.map(T::lit))).collect()
    }
}

fn time(k: usize) -> Instant {
    Instant::from_millis(1000 * k as u64)
}

/// The probability of every set of labels.
type Sets = BTreeMap<Vec<Label>, f64>;

fn sets<T, D, A, const S: usize, const H: usize, const L: usize, const G: usize, const M: usize>(
    state: &GlmbState<T, D, A, S, H, L, G, M>,
) -> Sets
where
    T: Real,
    D: Density<T, 4, 2>,
    A: Truncation<T, L>,
{
    let mut sets = Sets::new();
    for (weight, labels) in state.hypotheses() {
        let mut labels: Vec<Label> = labels.collect();
        labels.sort();
        *sets.entry(labels).or_default() += weight.to_f64();
    }
    sets
}

/// Σ |a − b|
fn l1(a: &Sets, b: &Sets) -> f64 {
    let of = |sets: &Sets, key: &Vec<Label>| sets.get(key).copied().unwrap_or(0.0);
    let both: std::collections::BTreeSet<_> = a.keys().chain(b.keys()).collect();
    both.into_iter().map(|key| (of(a, key) - of(b, key)).abs()).sum()
}

/// The state after the first `scans` scans of a problem, with nothing given up.
fn ample<T: Real>(problem: &Problem, scans: usize) -> Result<Box<Ample<T>>, Box<dyn Error>> {
    let (tracker, sensor) = (problem.tracker::<T, _>(Ranked)?, problem.sensor()?);
    let mut state = Box::new(Ample::<T>::new());
    for k in 0..scans {
        let report = tracker.step(&mut state, &sensor, &Scan::new(time(k), &problem.plots(k)))?;
        assert!(report.is_complete(), "{report:?}");
    }
    Ok(state)
}
