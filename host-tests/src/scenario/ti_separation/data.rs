//! The data of the separation test: two objects before a short-range radar, apart by one cell in range, azimuth or speed.
//!
//! ```text
//! radar     77 GHz, at the origin, 0.1 s a frame; range, azimuth, range-rate with σ = 0.3 m, 1°, 0.3 m/s;  P_D = 0.9
//! cells     α = 4 m, 4°, 4 m/s.  A range cell of 4 cm is finer by far, but a person or a vehicle is a cloud of points as large as it
//!           is and as its limbs and wheels move, and what a grouping of points tells apart is the size of its reach
//! seen      both detected: with probability exp(−½ d' R_d⁻¹ d), d = z₁ − z₂, their mean instead
//! clutter   Poisson, 0.3 plots a frame, uniform over 5 to 100 m, ±60°, ±15 m/s
//! range     both on one line of sight, receding at 1 m/s; 12 m apart, closing up over 3 s to 4 m, which they keep
//! azimuth   both at 40 m, receding at 1 m/s; 12° apart, closing up over 3 s to 4°, which they keep
//! speed     on one line of sight one overtakes the other: 1 and 5 m/s, at one place after 5 s
//! ```
//!
//! Two objects that differ by one cell in one coordinate and by nothing in the others give one plot in e^{−½} = 61 % of the frames
//! in which both are detected: the published separation (4 m, or 4°, or 4 m/s, in more than 95 % of runs) is asked at the edge of
//! what the radar resolves. Geometry, noise and cells are chosen here.

use crate::monte_carlo::Streams;
use crate::scenario::draw::{count, normal, reported};
use rand::RngExt;
use rand::seq::SliceRandom;

/// Frames of a run.
pub const FRAMES: usize = 100;
/// Their distance \[ms\].
pub const FRAME_MS: u64 = 100;
/// Standard deviations of range \[m\], azimuth \[rad\], range-rate \[m/s\].
pub const SIGMAS: [f64; 3] = [0.3, DEGREE, 0.3];
/// α in the same units.
pub const CELLS: [f64; 3] = [4.0, 4.0 * DEGREE, 4.0];
/// P_D
pub const P_DETECT: f64 = 0.9;
/// Plots of clutter a frame.
pub const CLUTTER: f64 = 0.3;
/// Where clutter is: from and to in range, azimuth, range-rate.
pub const FIELD: [[f64; 2]; 3] = [[5.0, 100.0], [-60.0 * DEGREE, 60.0 * DEGREE], [-15.0, 15.0]];
/// When the objects begin to close up, and have done so \[s\].
const CLOSING: [f64; 2] = [2.0, 5.0];

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// In what the objects differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// 4 m
    Range,
    /// 4°
    Azimuth,
    /// 4 m/s
    Speed,
}

/// Truth and plots of one run of one case.
#[derive(Debug, Clone)]
pub struct Data {
    /// Positions of both objects at every frame \[m\]
    pub truth: Vec<[[f64; 2]; 2]>,
    /// Plots of every frame, in random order: range, azimuth, range-rate
    pub plots: Vec<Vec<[f64; 3]>>,
    /// Frames in which one plot is of both
    pub merged: usize,
}

/// (x, vx, y, vy) of both objects at `t` \[s\].
fn objects(case: Case, t: f64) -> [[f64; 4]; 2] {
    let [from, to] = CLOSING;
    let closed = ((t - from) / (to - from)).clamp(0.0, 1.0);
    let rate = if closed > 0.0 && closed < 1.0 { -2.0 / (to - from) } else { 0.0 };
    let (apart, receding) = (3.0 - 2.0 * closed, 40.0 + t);
    match case {
        Case::Range => [0.5, -0.5].map(|side| [receding + side * 4.0 * apart, 1.0 + side * 4.0 * rate, 0.0, 0.0]),
        Case::Azimuth => [0.5, -0.5].map(|side| {
            let ((sin, cos), turning) = ((side * 4.0 * DEGREE * apart).sin_cos(), side * 4.0 * DEGREE * rate);
            [receding * cos, cos - receding * sin * turning, receding * sin, sin + receding * cos * turning]
        }),
        Case::Speed => [1.0, 5.0].map(|speed| [45.0 + speed * (t - 5.0), speed, 0.0, 0.0]),
    }
}

/// Draws one run of one case.
#[must_use]
pub fn draw(case: Case, streams: &mut Streams) -> Data {
    let rng = &mut streams.data;
    let mut data = Data { truth: Vec::new(), plots: Vec::new(), merged: 0 };
    for frame in 1..=FRAMES {
        let objects = objects(case, 0.001 * (frame as u64 * FRAME_MS) as f64);
        let noisy = objects.map(|[x, vx, y, vy]| {
            let range = x.hypot(y);
            let exact = [range, y.atan2(x), (x * vx + y * vy) / range];
            std::array::from_fn(|k| exact[k] + SIGMAS[k] * normal(rng))
        });
        let seen = noisy.map(|_| rng.random_bool(P_DETECT));
        let [first, second]: [[f64; 3]; 2] = noisy;
        let distance: f64 = (0..3).map(|k| ((first[k] - second[k]) / CELLS[k]).powi(2)).sum();
        let as_one = rng.random_bool((-0.5 * distance).exp()) && seen == [true; 2];
        let mut plots: Vec<[f64; 3]> = match as_one {
            true => vec![std::array::from_fn(|k| 0.5 * (first[k] + second[k]))],
            false => noisy.into_iter().zip(seen).filter(|(_, seen)| *seen).map(|(plot, _)| plot).collect(),
        };
        let clutter = count(CLUTTER, rng);
        plots.extend((0..clutter).map(|_| FIELD.map(|[from, to]| from + (to - from) * rng.random::<f64>())));
        plots.shuffle(rng);
        data.truth.push(objects.map(|[x, _, y, _]| [x, y]));
        data.plots.push(plots.into_iter().map(reported).collect());
        data.merged += usize::from(as_one);
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monte_carlo::streams;

    #[test]
    fn objects_differ_by_one_cell_in_the_end() {
        let apart = |case, t| {
            let polar = objects(case, t).map(|[x, vx, y, vy]| [x.hypot(y), y.atan2(x), (x * vx + y * vy) / x.hypot(y)]);
            let cells: [f64; 3] = std::array::from_fn(|k| (polar[0][k] - polar[1][k]).abs() / CELLS[k]);
            cells
        };
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        for t in [5.0, 7.0, 10.0] {
            assert!(near(apart(Case::Range, t), [1.0, 0.0, 0.0]) && near(apart(Case::Azimuth, t), [0.0, 1.0, 0.0]));
        }
        assert!(near(apart(Case::Speed, 5.0), [0.0, 0.0, 1.0]));
        assert!(near(apart(Case::Range, 1.0), [3.0, 0.0, 0.0]) && near(apart(Case::Azimuth, 1.0), [0.0, 3.0, 0.0]));
    }

    /// One cell apart, 61 % of the pairs of detections merge: in 50 of 100 frames, less the noise of the plots.
    #[test]
    fn objects_merge_as_often_as_they_should() {
        let runs = 200;
        let merged: usize = (0..runs).map(|run| draw(Case::Range, &mut streams(1_000_000, run)).merged).sum();
        let share = merged as f64 / (51.0 * runs as f64 * P_DETECT * P_DETECT);
        // Frames before the last fifty add a little.
        assert!(share > 0.60 && share < 0.75, "{share}");
    }
}
