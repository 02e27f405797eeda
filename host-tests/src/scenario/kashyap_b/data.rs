//! The data of scenario b of Kashyap et al. (2006): four targets, two sensors that see three each, Poisson clutter.
//!
//! ```text
//! quiet       (p, v) ← [1 T; 0 1] (p, v) + (T²/2, T)' w,  acceleration 0        w ~ N(0, 0.01 (m/s²)²) per axis
//! manoeuvre   target 1, transitions 40 to 49: the acceleration is set to (g, −g), then (p, v, a) by CA with the same noise on a
//! plots       each target that the sensor sees with P_D = 0.99, R = 5 m², relative to the sensor; clutter 1e-7 /m²
//! ```
//!
//! Scans k = 0..99 at t = k s. The first sensor sees targets 1, 2 and 3, the second 1, 2 and 4.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{count, normal, reported, shuffle};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Scans of a run.
pub const SCANS: usize = 100;
/// Targets.
pub const TARGETS: usize = 4;
/// Where the sensors are \[m\].
pub const SENSORS: [[f64; 2]; 2] = [[0.0, 0.0], [1000.0, 1000.0]];
/// Variance of a position measurement in each axis \[m²\].
pub const R: f64 = 5.0;
/// Probability of detection.
pub const P_DETECT: f64 = 0.99;
/// The transitions in which target 1 accelerates.
pub const MANOEUVRE: std::ops::Range<usize> = 40..50;

const SEEN: [[bool; TARGETS]; 2] = [[true, true, true, false], [true, true, false, true]];
const NOISE_VARIANCE: f64 = 0.01;
const CLUTTER_DENSITY: f64 = 1e-7;
const REGION: [[f64; 2]; 2] = [[-1500.0, 7500.0], [-6500.0, 2500.0]];
const ACCELERATION: [f64; 2] = [9.81, -9.81];
/// Position and velocity of every target in both axes. The paper prints one state for targets 2 to 4; those of 3 and 4 are
/// chosen.
const START: [[[f64; 2]; 2]; TARGETS] =
    [[[0.0, 5.0], [100.0, 5.0]], [[1200.0, 5.0], [-1200.0, 5.0]], [[600.0, -5.0], [800.0, 5.0]], [[-400.0, 5.0], [-900.0, -5.0]]];

/// (x, vx, y, vy) of a target \[m, m/s\].
pub type Kinematics = [f64; 4];

/// Truth and plots of one run.
#[derive(Debug, Clone)]
pub struct Data {
    /// The targets by scan
    pub truth: [Vec<Kinematics>; TARGETS],
    /// Plots of both sensors by scan, in random order, relative to the sensor \[m\]
    pub plots: [Vec<Vec<[f64; 2]>>; 2],
}

/// Draws one run.
#[must_use]
pub fn draw(streams: &mut Streams) -> Data {
    let rng = &mut streams.data;
    let truth: [Vec<Kinematics>; TARGETS] = std::array::from_fn(|target| trajectory(target, rng));
    let mut plots: [Vec<Vec<[f64; 2]>>; 2] = Default::default();
    for k in 0..SCANS {
        for (sensor, plots) in plots.iter_mut().enumerate() {
            plots.push(scan(sensor, std::array::from_fn(|target: usize| truth[target][k]), rng));
        }
    }
    Data { truth, plots }
}

fn trajectory(target: usize, rng: &mut ChaCha8Rng) -> Vec<Kinematics> {
    let mut axes = START[target].map(|[p, v]| [p, v, 0.0]);
    let mut states = Vec::with_capacity(SCANS);
    for k in 0..SCANS {
        let [[x, vx, _], [y, vy, _]] = axes;
        states.push([x, vx, y, vy]);
        let manoeuvres = target == 0 && MANOEUVRE.contains(&k);
        for (axis, [p, v, a]) in axes.iter_mut().enumerate() {
            let w = NOISE_VARIANCE.sqrt() * normal(rng);
            match manoeuvres {
                true if k == MANOEUVRE.start => *a = ACCELERATION[axis],
                true => {}
                false => *a = 0.0,
            }
            *p += *v + 0.5 * (*a + w);
            *v += *a + w;
            *a += w;
        }
    }
    states
}

fn seen_from(sensor: usize, position: [f64; 2]) -> [f64; 2] {
    reported(std::array::from_fn(|axis| position[axis] - SENSORS[sensor][axis]))
}

fn scan(sensor: usize, targets: [Kinematics; TARGETS], rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let mut plots = Vec::new();
    for ([x, _, y, _], seen) in targets.into_iter().zip(SEEN[sensor]) {
        // Both drawn whether detected or not: a miss then shifts no other random number.
        let (plot, detected) = ([x, y].map(|p| p + R.sqrt() * normal(rng)), rng.random_bool(P_DETECT));
        if seen && detected {
            plots.push(seen_from(sensor, plot));
        }
    }
    let [width, height] = REGION.map(|[from, to]| to - from);
    let clutter = count(CLUTTER_DENSITY * width * height, rng);
    plots.extend((0..clutter).map(|_| seen_from(sensor, REGION.map(|[from, to]| rng.random_range(from..to)))));
    shuffle(&mut plots, rng);
    plots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;

    #[test]
    fn statistics_of_the_draw_are_those_of_the_specification() {
        let (mut detected, mut plots) = ([[0usize; TARGETS]; 2], 0usize);
        for run in 0..20 {
            let data = draw(&mut streams(1_000_000, run));
            for k in 0..SCANS {
                for sensor in 0..2 {
                    plots += data.plots[sensor][k].len();
                    for target in 0..TARGETS {
                        let [x, _, y, _] = data.truth[target][k];
                        let [sx, sy] = SENSORS[sensor];
                        let near = |p: &[f64; 2]| (p[0] + sx - x).hypot(p[1] + sy - y) < 6.0 * R.sqrt();
                        detected[sensor][target] += usize::from(data.plots[sensor][k].iter().any(near));
                    }
                }
            }
        }
        // 2000 scans: four binomial deviations of 4.4 about 1980; of what is not seen a clutter point in a thousand scans.
        let seen = |count: usize| (1962..=1998).contains(&count);
        assert!([(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 3)].iter().all(|(s, t)| seen(detected[*s][*t])), "{detected:?}");
        assert!(detected[0][3] < 8 && detected[1][2] < 8, "{detected:?}");
        // 3 · 0.99 + 8.1 a scan, over 4000 scans with a deviation of 2.85 each.
        let mean = plots as f64 / 4000.0;
        assert!((mean - 11.07).abs() < 0.18, "{mean}");
    }

    #[test]
    fn only_target_1_gains_speed_and_by_ten_seconds_of_one_g() {
        let data = draw(&mut streams(1_000_000, 3));
        for target in 0..TARGETS {
            let gained = |axis: usize| data.truth[target][50][axis] - data.truth[target][40][axis];
            let expected = if target == 0 { 98.1 } else { 0.0 };
            // Acceleration noise of 0.1 m/s² adds up to a walk of 0.1 · √(1² + … + 10²) = 2 m/s.
            assert!((gained(1) - expected).abs() < 8.0 && (gained(3) + expected).abs() < 8.0, "target {target}: {}", gained(1));
        }
    }
}
