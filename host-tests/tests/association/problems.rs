//! Random and adversarial weight matrices.

use crate::events::Problem;
use rand::{Rng, RngExt};

/// The kinds of problems; each stresses something else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Weights over eight decades, most pairs gated
    Dense,
    /// One pair of three gated
    Sparse,
    /// Every track gates its neighbours' detections only
    Banded,
    /// All weights equal: nothing is light
    Equal,
    /// Misses nearly impossible: tracks fight for detections
    Contested,
    /// Weights over sixty decades
    Wide,
}

pub const KINDS: [Kind; 6] = [Kind::Dense, Kind::Sparse, Kind::Banded, Kind::Equal, Kind::Contested, Kind::Wide];

/// A problem of `tracks` and `detections`; feasible, as every miss has some weight.
pub fn problem(kind: Kind, tracks: usize, detections: usize, diffuse: bool, rng: &mut impl Rng) -> Problem {
    let decades = |rng: &mut _, span: f64| 10f64.powf(RngExt::random_range(rng, -span..span));
    let mut miss = Vec::new();
    let mut hit = Vec::new();
    for t in 0..tracks {
        let centre = t * detections / tracks.max(1);
        miss.push(match kind {
            Kind::Equal => 1.0,
            Kind::Contested => decades(rng, 1.0) * 1e-6,
            Kind::Wide => decades(rng, 15.0),
            _ => decades(rng, 1.0) * 0.1,
        });
        let row = (0..detections).map(|j| match kind {
            Kind::Dense if rng.random_bool(0.9) => decades(rng, 4.0),
            Kind::Sparse if rng.random_bool(0.33) => decades(rng, 2.0),
            Kind::Banded if centre.abs_diff(j) <= 1 => decades(rng, 1.0),
            Kind::Equal => 1.0,
            Kind::Contested if rng.random_bool(0.7) => decades(rng, 1.0),
            Kind::Wide if rng.random_bool(0.8) => decades(rng, 15.0),
            _ => 0.0,
        });
        hit.push(row.collect());
    }
    Problem { miss, hit, diffuse }
}
