//! The data of the scenarios after Gomes: two targets that cross once, a radar at the origin, no clutter.
//!
//! ```text
//! truth   exact arcs at 150 m/s, both targets at (6000, 5000) m at scan 30, headings 200° and 200° + A there
//! rates   target 1: 0.02 rad/s;  target 2: the table of the variant, by transition k to k + 1
//! plots   range and azimuth with σ = 20 m and 2 mrad, both targets in every scan, in random order
//! start   the truth at scan 0 plus noise, σ = 50 m and 15 m/s in each axis
//! ```
//!
//! Scans k = 1..60 at t = k s. The paper gives no numbers: all of these are from the scenario's specification.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{normal, reported};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Scans of a run.
pub const SCANS: usize = 60;
/// Targets.
pub const TARGETS: usize = 2;
/// Standard deviations of range \[m\] and azimuth \[rad\].
pub const SIGMAS: [f64; 2] = [20.0, 0.002];
/// Standard deviations of the start in (x, vx, y, vy) \[m, m/s\].
pub const START: [f64; 4] = [50.0, 15.0, 50.0, 15.0];

const CROSSING: usize = 30;
const PLACE: [f64; 2] = [6000.0, 5000.0];
const SPEED: f64 = 150.0;
const HEADING: f64 = 200.0;
const STEADY: f64 = 0.02;

/// One of the three scenarios.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    /// Angle between the paths where they cross \[degrees\]
    pub angle: f64,
    /// Turn rate of target 2 from a transition on \[rad/s\]
    pub rates: &'static [(usize, f64)],
}

/// Truth and plots of one run.
#[derive(Debug, Clone)]
pub struct Data {
    /// States (x, vx, y, vy) of the targets at scans 0..=60
    pub truth: [Vec<[f64; 4]>; TARGETS],
    /// Range and azimuth at scans 1..=60, of the two targets in random order
    pub plots: Vec<[[f64; 2]; TARGETS]>,
    /// Which of the two plots of a scan is that of target 1
    pub first: Vec<usize>,
    /// Where the filters start
    pub start: [[f64; 4]; TARGETS],
}

/// Draws one run.
#[must_use]
pub fn draw(variant: &Variant, streams: &mut Streams) -> Data {
    let truth = [trajectory(HEADING, |_| STEADY), trajectory(HEADING + variant.angle, |k| rate(variant, k))];
    let rng = &mut streams.data;
    let (mut plots, mut first) = (Vec::with_capacity(SCANS), Vec::with_capacity(SCANS));
    for k in 1..=SCANS {
        let seen: [[f64; 2]; TARGETS] = std::array::from_fn(|target| measured(&truth[target][k], rng));
        let swapped = rng.random_bool(0.5);
        plots.push(if swapped { [seen[1], seen[0]] } else { seen });
        first.push(usize::from(swapped));
    }
    let start = std::array::from_fn(|target: usize| {
        let at: [f64; 4] = truth[target][0];
        std::array::from_fn(|i| at[i] + START[i] * normal(&mut streams.initial))
    });
    Data { truth, plots, first, start }
}

fn rate(variant: &Variant, k: usize) -> f64 {
    variant.rates.iter().rev().find(|(from, _)| *from <= k).map_or(0.0, |(_, rate)| *rate)
}

/// States at scans 0..=60, from the crossing forwards and backwards.
fn trajectory(heading: f64, rate: impl Fn(usize) -> f64) -> Vec<[f64; 4]> {
    let (sin, cos) = heading.to_radians().sin_cos();
    let mut states = vec![[PLACE[0], SPEED * cos, PLACE[1], SPEED * sin]; SCANS + 1];
    for k in CROSSING..SCANS {
        states[k + 1] = turned(&states[k], rate(k), 1.0);
    }
    for k in (0..CROSSING).rev() {
        states[k] = turned(&states[k + 1], rate(k), -1.0);
    }
    states
}

/// A coordinated turn at `rate` for `dt` seconds.
fn turned([x, vx, y, vy]: &[f64; 4], rate: f64, dt: f64) -> [f64; 4] {
    let (sin, cos) = (rate * dt).sin_cos();
    let (along, across) = if rate == 0.0 { (dt, 0.0) } else { (sin / rate, (1.0 - cos) / rate) };
    [x + along * vx - across * vy, cos * vx - sin * vy, y + across * vx + along * vy, sin * vx + cos * vy]
}

fn measured([x, _, y, _]: &[f64; 4], rng: &mut ChaCha8Rng) -> [f64; 2] {
    reported([x.hypot(*y) + SIGMAS[0] * normal(rng), y.atan2(*x) + SIGMAS[1] * normal(rng)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;
    use crate::scenario::gomes::{CROSSING_12, CROSSING_25, CROSSING_ABRUPT};

    fn separation(variant: &Variant, k: usize) -> f64 {
        let data = draw(variant, &mut streams(1_000_000, 0));
        let [a, b] = [data.truth[0][k], data.truth[1][k]];
        (a[0] - b[0]).hypot(a[2] - b[2])
    }

    /// As the specification prints them.
    #[test]
    fn separations_are_those_of_the_specification() {
        for (variant, expected) in [
            (CROSSING_12, [(24, 134.0), (28, 57.0), (30, 0.0), (32, 69.0), (36, 241.0), (45, 762.0), (60, 1377.0)]),
            (CROSSING_25, [(24, 336.0), (28, 124.0), (30, 0.0), (32, 136.0), (36, 441.0), (45, 1255.0), (60, 2361.0)]),
        ] {
            for (k, metres) in expected {
                assert!((separation(&variant, k) - metres).abs() <= 0.5, "{k}: {} m", separation(&variant, k));
            }
        }
    }

    #[test]
    fn rates_follow_the_table_of_the_variant() {
        let at = |k: usize| rate(&CROSSING_ABRUPT, k);
        assert_eq!([at(0), at(19), at(20), at(37), at(38), at(49), at(50), at(59)], [0.0, 0.0, 0.06, 0.06, -0.04, -0.04, 0.0, 0.0]);
    }

    #[test]
    fn plots_have_the_noise_of_the_radar() {
        let (mut squares, mut count) = ([0.0; 2], 0.0);
        for run in 0..50 {
            let data = draw(&CROSSING_12, &mut streams(1_000_000, run));
            for (k, (plots, first)) in data.plots.iter().zip(&data.first).enumerate() {
                let [x, _, y, _] = data.truth[0][k + 1];
                let error = [plots[*first][0] - x.hypot(y), plots[*first][1] - y.atan2(x)];
                squares = [squares[0] + error[0] * error[0], squares[1] + error[1] * error[1]];
                count += 1.0;
            }
        }
        // The standard deviation of 3000 draws is good to 1.3 %.
        for (sum, sigma) in squares.iter().zip(SIGMAS) {
            assert!(((sum / count).sqrt() / sigma - 1.0).abs() < 0.05, "{sum}");
        }
    }
}
