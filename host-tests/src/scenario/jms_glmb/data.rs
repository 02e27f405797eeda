//! The data of the examples of Punchihewa, Vo and Vo (2016): three targets that come, turn and go, in 60 clutter points a scan.
//!
//! ```text
//! truth     exact arcs of known rate, from the mean of a birth region + N(0, (300 m)² I)
//! linear    z = (x, y) + N(0, σ² I);  clutter uniform over the region
//! polar     z = (azimuth, range) + N(0, diag(σ²));  clutter uniform over (−π, π] × [0, 85 km]
//! ```
//!
//! Scans k = 1..100 at t = 5 k s. One draw serves every sensor: the same targets, misses and standard normal errors.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{count, normal, reported, shuffle};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Scans of a run.
pub const SCANS: usize = 100;
/// Milliseconds from scan to scan.
pub const STEP_MS: u64 = 5000;
/// Targets.
pub const TARGETS: usize = 3;
/// Where targets are born \[m\].
pub const BIRTHS: [[f64; 2]; 3] = [[40e3, -50e3], [-50e3, 40e3], [-10e3, -40e3]];
/// Half the side of the region \[m\].
pub const HALF_SIDE: f64 = 60e3;
/// The largest range of the polar sensor \[m\].
pub const MOST_RANGE: f64 = 85e3;
/// Clutter points in a scan, in the mean.
pub const CLUTTER: f64 = 60.0;
/// The rate of all turns \[rad/s\].
pub const TURN_RATE: f64 = PI / 60.0;

const STEP: f64 = STEP_MS as f64 / 1000.0;
const BIRTH_SIGMA: f64 = 300.0;

/// The life of a target: from a birth region, first and last scan, velocity, and turns from scan to scan.
struct Life {
    region: usize,
    scans: [usize; 2],
    velocity: [f64; 2],
    turns: [(usize, usize, Motion); 2],
}

const LIVES: [Life; TARGETS] = [
    Life { region: 1, scans: [1, 100], velocity: [180.0, -60.0], turns: [(30, 38, Motion::Right), (60, 70, Motion::Left)] },
    Life { region: 0, scans: [10, 90], velocity: [-120.0, 200.0], turns: [(40, 46, Motion::Left), (70, 80, Motion::Right)] },
    Life { region: 2, scans: [20, 100], velocity: [150.0, 150.0], turns: [(45, 57, Motion::Left), (80, 86, Motion::Right)] },
];

/// How a target moved to where it is: in the order of the modes of the linear example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Straight on, or just born
    Straight,
    /// To the right
    Right,
    /// To the left
    Left,
}

/// A target at a scan.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Which one
    pub number: usize,
    /// (x, y) \[m\]
    pub position: [f64; 2],
    /// How it came here
    pub motion: Motion,
}

/// What a sensor measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sensor {
    /// (x, y), by the deviation in each \[m\]
    Position(f64),
    /// (azimuth, range), by their deviations \[rad, m\]
    Polar([f64; 2]),
}

/// The origin of a plot before a sensor sees it.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// A position, standard normal errors, and a number in 0..1 below P_D if it is seen
    Target([f64; 2], [f64; 2], f64),
    /// Clutter, uniform in the unit square
    Clutter([f64; 2]),
}

/// Truth and plots of one run.
#[derive(Debug, Clone)]
pub struct Data {
    /// The targets that live, by scan
    pub truth: Vec<Vec<Target>>,
    sources: Vec<Vec<Source>>,
}

impl Data {
    /// The plots of every scan as `sensor` reports them that detects with `p_detect`, in random order.
    pub fn plots(&self, sensor: Sensor, p_detect: f64) -> Vec<Vec<[f64; 2]>> {
        let seen = |source: &Source| {
            let plot = match *source {
                Source::Target(p, e, draw) => (draw < p_detect).then(|| measure(sensor, p, e))?,
                Source::Clutter([u, v]) => match sensor {
                    Sensor::Position(_) => [u, v].map(|u| HALF_SIDE * (2.0 * u - 1.0)),
                    Sensor::Polar(_) => [PI * (1.0 - 2.0 * u), MOST_RANGE * v],
                },
            };
            Some(reported(plot))
        };
        self.sources.iter().map(|scan| scan.iter().filter_map(seen).collect()).collect()
    }
}

fn measure(sensor: Sensor, [x, y]: [f64; 2], [e, f]: [f64; 2]) -> [f64; 2] {
    match sensor {
        Sensor::Position(sigma) => [x + sigma * e, y + sigma * f],
        Sensor::Polar([azimuth, range]) => {
            let turned = y.atan2(x) + azimuth * e;
            let wrapped = turned - 2.0 * PI * (turned / (2.0 * PI)).round();
            [wrapped, x.hypot(y) + range * f]
        }
    }
}

/// Draws one run.
#[must_use]
pub fn draw(streams: &mut Streams) -> Data {
    let rng = &mut streams.data;
    let mut truth = vec![Vec::new(); SCANS];
    for (number, life) in LIVES.iter().enumerate() {
        let [mut x, mut y] = BIRTHS[life.region].map(|p| p + BIRTH_SIGMA * normal(rng));
        let [mut vx, mut vy] = life.velocity;
        let mut motion = Motion::Straight;
        for k in life.scans[0]..=life.scans[1] {
            truth[k - 1].push(Target { number, position: [x, y], motion });
            motion = life.turns.iter().find(|(from, to, _)| (*from..*to).contains(&k)).map_or(Motion::Straight, |turn| turn.2);
            let rate = match motion {
                Motion::Straight => 0.0,
                Motion::Right => -TURN_RATE,
                Motion::Left => TURN_RATE,
            };
            let (sin, cos) = (rate * STEP).sin_cos();
            let (along, across) = if rate == 0.0 { (STEP, 0.0) } else { (sin / rate, (1.0 - cos) / rate) };
            (x, y) = (x + along * vx - across * vy, y + across * vx + along * vy);
            (vx, vy) = (cos * vx - sin * vy, sin * vx + cos * vy);
        }
    }
    let sources = truth.iter().map(|targets| scan(targets, rng)).collect();
    Data { truth, sources }
}

fn scan(targets: &[Target], rng: &mut ChaCha8Rng) -> Vec<Source> {
    let mut sources: Vec<Source> =
        targets.iter().map(|target| Source::Target(target.position, [normal(rng), normal(rng)], rng.random())).collect();
    sources.extend((0..count(CLUTTER, rng)).map(|_| Source::Clutter([rng.random(), rng.random()])));
    shuffle(&mut sources, rng);
    sources
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;

    #[test]
    fn targets_live_turn_and_keep_apart_as_specified() {
        let data = draw(&mut streams(1_000_000, 0));
        let of = |number: usize| data.truth.iter().flatten().filter(move |t| t.number == number);
        assert_eq!([0, 1, 2].map(|n| of(n).count()), [100, 81, 81]);
        // Of target 1: 8 transitions of 15 degrees to the right, 10 to the left.
        let turned = |number, motion| of(number).filter(|t: &&Target| t.motion == motion).count();
        assert_eq!([turned(0, Motion::Right), turned(0, Motion::Left)], [8, 10]);
        assert_eq!([turned(1, Motion::Left), turned(1, Motion::Right)], [6, 10]);
        assert_eq!([turned(2, Motion::Left), turned(2, Motion::Right)], [12, 6]);
        // Speeds stay, and the region holds all of them.
        assert!(data.truth.iter().flatten().all(|t| t.position.iter().all(|p| p.abs() < HALF_SIDE)));
        for (number, speed) in [(0, 180f64.hypot(60.0)), (1, 120f64.hypot(200.0)), (2, 150f64.hypot(150.0))] {
            let path: Vec<_> = of(number).collect();
            for pair in path.windows(2) {
                let moved = (pair[1].position[0] - pair[0].position[0]).hypot(pair[1].position[1] - pair[0].position[1]);
                // The chord of an arc of 15 degrees is 0.29 % shorter.
                assert!((moved / (STEP * speed) - 1.0).abs() < 0.003);
            }
        }
        let apart = |scan: &Vec<Target>| {
            let pairs = scan.iter().enumerate().flat_map(|(i, a)| scan.iter().skip(i + 1).map(move |b| (a, b)));
            pairs.map(|(a, b)| (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1])).fold(f64::INFINITY, f64::min)
        };
        let nearest = data.truth.iter().map(apart).fold(f64::INFINITY, f64::min);
        assert!((1500.0..4000.0).contains(&nearest), "{nearest}");
    }

    #[test]
    fn statistics_of_the_plots_are_those_of_the_specification() {
        let (mut plots, mut seen, mut targets) = (0, [0, 0], 0);
        for run in 0..20 {
            let data = draw(&mut streams(1_000_000, run));
            for (which, p_detect) in [0.97, 0.9].into_iter().enumerate() {
                let scans = data.plots(Sensor::Position(40.0), p_detect);
                for (scan, truth) in scans.iter().zip(&data.truth) {
                    let near = |t: &&Target| scan.iter().any(|[x, y]| (x - t.position[0]).hypot(y - t.position[1]) < 240.0);
                    seen[which] += truth.iter().filter(near).count();
                }
                plots += if which == 0 { scans.iter().map(Vec::len).sum() } else { 0 };
            }
            targets += data.truth.iter().map(Vec::len).sum::<usize>();
        }
        // 5240 target scans, with four binomial deviations; clutter in the circle adds 0.08 %.
        assert_eq!(targets, 5240);
        assert!((seen[0] as f64 - 5083.0).abs() < 60.0 && (seen[1] as f64 - 4717.0).abs() < 95.0, "{seen:?}");
        // 2000 Poisson counts of mean 60, and the detections.
        assert!((plots as f64 / 2000.0 - 60.0 - 0.97 * 2.62).abs() < 0.7, "{plots}");
    }
}
