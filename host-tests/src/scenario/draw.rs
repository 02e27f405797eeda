//! What the scenarios' data are drawn by. The order of the calls is part of a scenario: it makes the figures of a seed.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};

/// N(0, 1)
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A number of clutter points, `expected` in the mean.
pub fn count(expected: f64, rng: &mut ChaCha8Rng) -> usize {
    Poisson::new(expected).map_or(0, |poisson| poisson.sample(rng) as usize)
}

/// Plots come in single precision, so that filters in either precision see the same data.
pub fn reported<const NZ: usize>(plot: [f64; NZ]) -> [f64; NZ] {
    plot.map(|v| f64::from(v as f32))
}

/// Fisher–Yates: the order of plots tells nothing.
pub fn shuffle<P>(plots: &mut [P], rng: &mut ChaCha8Rng) {
    for i in (1..plots.len()).rev() {
        plots.swap(i, rng.random_range(0..=i));
    }
}
