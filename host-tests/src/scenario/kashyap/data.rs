//! The data of scenario a of Kashyap et al. (2006): two manoeuvring targets, one sensor, Poisson clutter.
//!
//! ```text
//! quiet       (p, v) ← [1 T; 0 1] (p, v) + (T²/2, T)' w,  acceleration 0        w ~ N(0, 0.1 (m/s²)²) per axis
//! manoeuvre   at its first transition the acceleration is set, then (p, v, a) by CA with the same noise on a
//! plots       each target with P_D = 0.99, R = 25 m²; clutter 1e-5 /m² in the union of two squares of half-width
//!             500 m about the targets
//! ```
//!
//! Scans k = 0..149 at t = k s. The first two give the tracks their two-point start, from noise of a stream of its own.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{count, normal, reported, shuffle};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Scans of a run.
pub const SCANS: usize = 150;
/// Targets.
pub const TARGETS: usize = 2;
/// Standard deviation of a position measurement in each axis \[m\].
pub const SIGMA: f64 = 5.0;
/// Probability of detection.
pub const P_DETECT: f64 = 0.99;

const NOISE_VARIANCE: f64 = 0.1;
/// Clutter \[1/m²\].
pub const CLUTTER_DENSITY: f64 = 1e-5;
const HALF_WIDTH: f64 = 500.0;
const G: f64 = 9.81;

/// A stretch of constant acceleration: transitions `from`..`to`.
#[derive(Debug, Clone, Copy)]
pub struct Manoeuvre {
    /// First transition
    pub from: usize,
    /// The transition after the last
    pub to: usize,
    /// Acceleration \[m/s²\]
    pub acceleration: [f64; 2],
}

/// The manoeuvres of both targets.
pub const MANOEUVRES: [&[Manoeuvre]; TARGETS] = [
    &[Manoeuvre { from: 30, to: 50, acceleration: [G, -G] }, Manoeuvre { from: 70, to: 100, acceleration: [G, -G] }],
    &[Manoeuvre { from: 50, to: 80, acceleration: [-G, G] }],
];

const START: [[[f64; 2]; 2]; TARGETS] = [[[0.0, 5.0], [100.0, 5.0]], [[1200.0, 5.0], [-1200.0, 5.0]]];

/// What a target is doing at a scan, for the metrics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Scans from + 1 to `to` of a manoeuvre
    Manoeuvre,
    /// The start (k < 5) and the five scans after a manoeuvre
    Between,
    /// All others
    Quiet,
}

/// The phase of `target` at scan `k`.
#[must_use]
pub fn phase(target: usize, k: usize) -> Phase {
    let of = |m: &Manoeuvre| match () {
        () if k > m.from && k <= m.to => Phase::Manoeuvre,
        () if k > m.to && k <= m.to + 5 => Phase::Between,
        () => Phase::Quiet,
    };
    let start = if k < 5 { Phase::Between } else { Phase::Quiet };
    MANOEUVRES[target].iter().map(of).fold(start, |a, b| if a == Phase::Quiet { b } else { a })
}

/// Truth and plots of one run.
#[derive(Debug, Clone)]
pub struct Data {
    /// Positions of the targets by scan \[m\]
    pub truth: [Vec<[f64; 2]>; TARGETS],
    /// Plots by scan, targets and clutter in random order \[m\]
    pub plots: Vec<Vec<[f64; 2]>>,
    /// Two noisy positions of every target, at scans 0 and 1 \[m\]
    pub start: [[[f64; 2]; 2]; TARGETS],
}

/// Draws one run.
#[must_use]
pub fn draw(streams: &mut Streams) -> Data {
    let rng = &mut streams.data;
    let truth: [Vec<[f64; 2]>; TARGETS] = std::array::from_fn(|target| trajectory(target, rng));
    let plots = (0..SCANS).map(|k| scan(std::array::from_fn(|target| truth[target][k]), rng)).collect();
    let start = std::array::from_fn(|target: usize| std::array::from_fn(|k| measured(truth[target][k], &mut streams.initial)));
    Data { truth, plots, start }
}

fn trajectory(target: usize, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let noise = NOISE_VARIANCE.sqrt();
    let mut axes = START[target].map(|[p, v]| [p, v, 0.0]);
    let mut positions = Vec::with_capacity(SCANS);
    for k in 0..SCANS {
        positions.push(axes.map(|[p, _, _]| p));
        let manoeuvre = MANOEUVRES[target].iter().find(|m| (m.from..m.to).contains(&k));
        for (axis, [p, v, a]) in axes.iter_mut().enumerate() {
            let w = noise * normal(rng);
            match manoeuvre {
                Some(m) => {
                    if k == m.from {
                        *a = m.acceleration[axis];
                    }
                    *p += *v + 0.5 * (*a + w);
                    *v += *a + w;
                    *a += w;
                }
                None => {
                    *p += *v + 0.5 * w;
                    *v += w;
                    *a = 0.0;
                }
            }
        }
    }
    positions
}

fn measured(position: [f64; 2], rng: &mut ChaCha8Rng) -> [f64; 2] {
    reported(position.map(|p| p + SIGMA * normal(rng)))
}

fn scan(targets: [[f64; 2]; TARGETS], rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let mut plots = Vec::new();
    for target in targets {
        // Both drawn whether detected or not: a miss then shifts no other random number.
        let (plot, detected) = (measured(target, rng), rng.random_bool(P_DETECT));
        if detected {
            plots.push(plot);
        }
    }
    let expected = CLUTTER_DENSITY * (2.0 * HALF_WIDTH) * (2.0 * HALF_WIDTH);
    for (number, centre) in targets.iter().enumerate() {
        for _ in 0..count(expected, rng) {
            let point = reported(centre.map(|c| c + rng.random_range(-HALF_WIDTH..HALF_WIDTH)));
            let inside = |other: &[f64; 2]| (0..2).all(|i| (point[i] - other[i]).abs() < HALF_WIDTH);
            // The union of the windows, not their sum.
            if !targets[..number].iter().any(inside) {
                plots.push(point);
            }
        }
    }
    shuffle(&mut plots, rng);
    plots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;

    #[test]
    fn phases_follow_the_table_of_manoeuvres() {
        let at = |target, k| phase(target, k);
        assert_eq!([at(0, 4), at(0, 5), at(0, 30)], [Phase::Between, Phase::Quiet, Phase::Quiet]);
        assert_eq!([at(0, 31), at(0, 50), at(0, 51), at(0, 55)], [Phase::Manoeuvre, Phase::Manoeuvre, Phase::Between, Phase::Between]);
        assert_eq!([at(0, 56), at(0, 71), at(0, 100), at(0, 106)], [Phase::Quiet, Phase::Manoeuvre, Phase::Manoeuvre, Phase::Quiet]);
        assert_eq!([at(1, 50), at(1, 51), at(1, 80), at(1, 86)], [Phase::Quiet, Phase::Manoeuvre, Phase::Manoeuvre, Phase::Quiet]);
    }

    #[test]
    fn statistics_of_the_draw_are_those_of_the_specification() {
        let (mut detected, mut clutter, mut scans) = (0usize, 0usize, 0usize);
        for run in 0..20 {
            let data = draw(&mut streams(1_000_000, run));
            for (k, plots) in data.plots.iter().enumerate() {
                for truth in &data.truth {
                    let near = |p: &&[f64; 2]| (p[0] - truth[k][0]).hypot(p[1] - truth[k][1]) < 6.0 * SIGMA;
                    detected += usize::from(plots.iter().any(|p| near(&p)));
                }
                // Well apart after the start: the windows no longer overlap.
                if k > 40 {
                    clutter += plots.len();
                    scans += 1;
                }
            }
        }
        let rate = detected as f64 / (20 * SCANS * TARGETS) as f64;
        assert!((rate - P_DETECT).abs() < 0.005, "{rate}");
        let mean = clutter as f64 / scans as f64;
        // Two detections and twice ten clutter points.
        assert!((mean - 21.98).abs() < 0.4, "{mean}");
    }

    #[test]
    fn an_acceleration_of_one_g_lasts_its_twenty_seconds() {
        let data = draw(&mut streams(1_000_000, 3));
        let speed = |k: usize| data.truth[0][k + 1][0] - data.truth[0][k][0];
        let gained = speed(51) - speed(29);
        // Acceleration noise of the model integrates to a few m/s.
        assert!((gained - 20.0 * G).abs() < 60.0, "{gained}");
    }
}
