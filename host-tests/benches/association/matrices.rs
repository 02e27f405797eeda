//! The problems: weight matrices from fixed seeds, the same for everybody who is timed.
//!
//! ```text
//! miss_t = 0.1 … 0.5,  hit_tj = e^x,  x uniform in −4 … 4        where track t gates detection j
//! dense    every track gates every detection
//! sparse   a track gates a detection with probability 3 / M      about three to a track
//! banded   a track gates the detections within 2 of t M / T      targets in a row
//! ```

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TRACKS: [usize; 8] = [2, 4, 6, 8, 10, 12, 15, 20];
const DETECTIONS: [usize; 5] = [2, 5, 10, 20, 30];
const SEED: u64 = 20_260_301;

/// Who gates what.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pattern {
    Dense,
    Sparse,
    Banded,
}

impl Pattern {
    const fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Sparse => "sparse",
            Self::Banded => "banded",
        }
    }
}

/// One problem: per track the weight of no detection, and one per detection, zero outside the gate.
#[derive(Clone, Debug)]
pub struct Problem {
    pattern: Pattern,
    pub miss: Vec<f64>,
    pub hit: Vec<Vec<f64>>,
}

impl Problem {
    fn new(pattern: Pattern, tracks: usize, detections: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED + (pattern as usize * 10_000 + tracks * 100 + detections) as u64);
        let mut weight = |t: usize, j: usize| {
            let (x, chance): (f64, f64) = (rng.random_range(-4.0..4.0), rng.random_range(0.0..1.0));
            let gated = match pattern {
                Pattern::Dense => true,
                Pattern::Sparse => chance < 3.0 / detections as f64,
                Pattern::Banded => (j as f64 - (t * detections) as f64 / tracks as f64).abs() <= 2.0,
            };
            if gated { x.exp() } else { 0.0 }
        };
        let hit = (0..tracks).map(|t| (0..detections).map(|j| weight(t, j)).collect()).collect();
        let miss = (0..tracks).map(|_| rng.random_range(0.1..0.5)).collect();
        Self { pattern, miss, hit }
    }

    /// Every pattern in every size; of two detections only the dense one, as the others gate the same.
    pub fn all() -> Vec<Self> {
        let sizes = || TRACKS.iter().flat_map(|t| DETECTIONS.iter().map(move |m| (*t, *m)));
        let patterns = [Pattern::Dense, Pattern::Sparse, Pattern::Banded];
        let differs = |p, m| p == Pattern::Dense || m > DETECTIONS[0];
        patterns.iter().flat_map(|p| sizes().filter(|(_, m)| differs(*p, *m)).map(|(t, m)| Self::new(*p, t, m))).collect()
    }

    /// "dense 8x10": the pattern, tracks and detections.
    pub fn name(&self) -> String {
        format!("{} {}x{}", self.pattern.name(), self.tracks(), self.detections())
    }

    pub fn tracks(&self) -> usize {
        self.miss.len()
    }

    pub fn detections(&self) -> usize {
        self.hit.first().map_or(0, Vec::len)
    }

    /// Whether `nodes` hold the sets of the smaller side, tracks or detections, for every layer along the larger.
    pub fn fits(&self, nodes: usize) -> bool {
        let (smaller, larger) = (self.tracks().min(self.detections()), self.tracks().max(self.detections()));
        let total = (1 << smaller) * (larger + 1);
        self.pattern != Pattern::Dense || total <= nodes
    }
}
