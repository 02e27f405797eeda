//! The data of the scenario after Jeong and Tugnait: two aircraft that close up, cross and part; a radar and an infrared sensor that
//! see them as one when they are close; clutter about either.
//!
//! ```text
//! truth     straight lines and exact arcs over 87 s, scans k = 1..=87 at t = k s
//! seen      z_r = h(x_r) + noise, each with P_D;  both seen: with probability exp(−½ d' R_d⁻¹ d), d = z₁ − z₂, (z₁ + z₂) / 2 instead
//! clutter   Poisson in the union of two rectangles about the true places
//! start     the truth at t = 0 plus noise
//! ```
//!
//! The paper prints one of the starting positions and no senses of the turns; these are the only readings by which the targets meet
//! as it tells. R_d is diag(α²), by which its ordinary filter loses as many runs as it says.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{count, normal, reported};
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Scans of a run.
pub const SCANS: usize = 87;
/// Targets.
pub const TARGETS: usize = 2;
/// P_D of either sensor.
pub const P_DETECT: f64 = 0.997;
/// Standard deviations of the start of each axis in position, velocity, acceleration \[m, m/s, m/s²\].
pub const START: [f64; 3] = [100.0, 30.0, 10.0];
/// The radar: range \[m\] and azimuth \[rad\].
pub const RADAR: Sensor =
    Sensor { components: [range, azimuth], sigmas: [20.0, 0.007], cells: [40.0, 0.014], density: 0.02, window: [1000.0, 0.1] };
/// The infrared sensor: azimuth and elevation \[rad\].
pub const INFRARED: Sensor =
    Sensor { components: [azimuth, elevation], sigmas: [0.002; 2], cells: [0.004; 2], density: 200.0, window: [0.1, 0.05] };

/// How a target flies.
struct Course {
    /// At the start \[m\]
    position: [f64; 3],
    /// In the plane \[m/s\]
    velocity: [f64; 2],
    /// From when on it turns at which rate \[s, rad/s\]
    turns: &'static [(usize, f64)],
}

const COURSES: [Course; TARGETS] = [
    Course { position: [18649.0, 16340.0, 40.0], velocity: [-8.3, -399.9], turns: &[(27, -0.15), (42, 0.0), (47, 0.10), (65, 0.0)] },
    Course { position: [30000.0, -3040.0, 40.0], velocity: [-382.0, 157.0], turns: &[(44, -0.075), (59, 0.0)] },
];

/// A sensor of two components at the origin.
#[derive(Debug, Clone, Copy)]
pub struct Sensor {
    components: [fn(&[f64; 3]) -> f64; 2],
    /// Standard deviations
    pub sigmas: [f64; 2],
    /// α
    pub cells: [f64; 2],
    /// Clutter in a unit of measurement
    pub density: f64,
    /// Half widths of the rectangles that hold clutter
    pub window: [f64; 2],
}

/// Truth and plots of one run.
#[derive(Debug, Clone)]
pub struct Data {
    /// Positions at scans 0..=87 \[m\]
    pub truth: [Vec<[f64; 3]>; TARGETS],
    /// Plots of the radar and of the infrared sensor at scans 1..=87, in random order
    pub plots: [Vec<Vec<[f64; 2]>>; 2],
    /// Whether a scan of either sensor held one plot of both
    pub merged: [Vec<bool>; 2],
    /// Where the filters start: (x, vx, ax, y, vy, ay, z, vz, az)
    pub start: [[f64; 9]; TARGETS],
}

/// Draws one run.
#[must_use]
pub fn draw(streams: &mut Streams) -> Data {
    let truth = COURSES.map(|course| trajectory(&course));
    let (mut plots, mut merged) = ([const { Vec::new() }; 2], [const { Vec::new() }; 2]);
    for k in 1..=SCANS {
        for ((sensor, plots), merged) in [RADAR, INFRARED].iter().zip(&mut plots).zip(&mut merged) {
            let (scan, one) = sensor.scan([&truth[0][k], &truth[1][k]], &mut streams.data);
            plots.push(scan);
            merged.push(one);
        }
    }
    let start = std::array::from_fn(|target: usize| {
        let Course { position: [x, y, z], velocity: [vx, vy], .. } = COURSES[target];
        let state = [[x, vx, 0.0], [y, vy, 0.0], [z, 0.0, 0.0]];
        std::array::from_fn(|i| state[i / 3][i % 3] + START[i % 3] * normal(&mut streams.initial))
    });
    Data { truth, plots, merged, start }
}

impl Sensor {
    /// The plots of a scan, and whether one is of both targets.
    fn scan(&self, truth: [&[f64; 3]; TARGETS], rng: &mut ChaCha8Rng) -> (Vec<[f64; 2]>, bool) {
        let places = truth.map(|position| self.components.map(|component| component(position)));
        let noisy = places.map(|place| std::array::from_fn(|k| place[k] + self.sigmas[k] * normal(rng)));
        let seen = places.map(|_| rng.random_bool(P_DETECT));
        let [first, second]: [[f64; 2]; TARGETS] = noisy;
        let distance: f64 = (0..2).map(|k| ((first[k] - second[k]) / self.cells[k]).powi(2)).sum();
        // Drawn whether it is asked or not, so that other cells leave the rest of the data as it is.
        let as_one = rng.random_bool((-0.5 * distance).exp()) && seen == [true; 2];
        let mut plots: Vec<[f64; 2]> = match as_one {
            true => vec![std::array::from_fn(|k| 0.5 * (first[k] + second[k]))],
            false => noisy.into_iter().zip(seen).filter(|(_, seen)| *seen).map(|(plot, _)| plot).collect(),
        };
        for (number, place) in places.iter().enumerate() {
            for _ in 0..self.clutter_count(rng) {
                let plot: [f64; 2] = std::array::from_fn(|k| place[k] + self.window[k] * (2.0 * rng.random::<f64>() - 1.0));
                // The rectangles make a union: what lies in both counts once.
                let counted = number == 1 && (0..2).all(|k| (plot[k] - places[0][k]).abs() <= self.window[k]);
                if !counted {
                    plots.push(plot);
                }
            }
        }
        plots.shuffle(rng);
        (plots.into_iter().map(reported).collect(), as_one)
    }

    fn clutter_count(&self, rng: &mut ChaCha8Rng) -> usize {
        let expected = self.density * 4.0 * self.window[0] * self.window[1];
        count(expected, rng)
    }
}

fn range([x, y, z]: &[f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

fn azimuth([x, y, _]: &[f64; 3]) -> f64 {
    y.atan2(*x)
}

fn elevation([x, y, z]: &[f64; 3]) -> f64 {
    z.atan2(x.hypot(*y))
}

/// Positions at scans 0..=87.
fn trajectory(course: &Course) -> Vec<[f64; 3]> {
    let ([mut x, mut y, z], [mut vx, mut vy]) = (course.position, course.velocity);
    let mut positions = vec![[x, y, z]];
    for k in 0..SCANS {
        let rate = course.turns.iter().rev().find(|(from, _)| *from <= k).map_or(0.0, |(_, rate)| *rate);
        let (sin, cos) = rate.sin_cos();
        let (along, across) = if rate == 0.0 { (1.0, 0.0) } else { (sin / rate, (1.0 - cos) / rate) };
        (x, y) = (x + along * vx - across * vy, y + across * vx + along * vy);
        (vx, vy) = (cos * vx - sin * vy, sin * vx + cos * vy);
        positions.push([x, y, z]);
    }
    positions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;

    /// As the specification prints them.
    #[test]
    fn targets_meet_as_specified() {
        let data = draw(&mut streams(1_000_000, 0));
        let apart = |k: usize| (0..3).map(|a| (data.truth[0][k][a] - data.truth[1][k][a]).powi(2)).sum::<f64>().sqrt();
        for (k, metres) in [(38, 21.0), (39, 69.0), (40, 98.0), (41, 77.0), (42, 85.0), (48, 557.0), (51, 196.0), (52, 237.0)] {
            assert!((apart(k) - metres).abs() <= 0.6, "{k}: {} m", apart(k));
        }
        assert!((apart(87) / 1000.0 - 25.36).abs() < 0.01);
    }

    /// Plots of either sensor in a run: the targets', less those that merge, and clutter of the rectangles' union.
    #[test]
    fn plots_are_as_many_as_they_should_be() {
        let (runs, mut clutter, mut merged) = (40, 0, 0);
        for run in 0..runs {
            let data = draw(&mut streams(1_000_000, run));
            // Far apart the rectangles are two: 2 · 0.02 · 4 · 1000 · 0.1 = 16 plots of clutter a scan.
            clutter += data.plots[0][..20].iter().map(Vec::len).sum::<usize>();
            merged += data.merged[0][37..42].iter().filter(|merged| **merged).count();
        }
        let (scans, expected) = (20.0 * runs as f64, 16.0 + 2.0 * P_DETECT);
        assert!((clutter as f64 / scans - expected).abs() < 4.0 * (16.0 / scans).sqrt(), "{clutter}");
        // At 21 to 98 m most are one to the radar.
        assert!(merged > 2 * runs as usize && merged < 5 * runs as usize, "{merged}");
    }
}
