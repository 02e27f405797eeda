//! Assignment, ranked assignment and global nearest neighbour, against all joint events listed one by one.
//!
//! | module | holds |
//! |---|---|
//! | [`best`] | the best event, and prices that prove it: complementary slackness, any range of weights, bounded work |
//! | [`ranking`] | the K best events in order, ties included: the lists of the reference cases and complete lists of our own |
//! | [`nearest`] | global nearest neighbour, Poisson and diffuse clutter, linear and logarithmic weights |

mod best;
mod nearest;
mod ranking;

use boresight::scalar::Real;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cmp::Ordering;
use std::error::Error;
use std::path::Path;

type Outcome = Result<(), Box<dyn Error>>;

/// The kinds of matrices that are drawn. A row is sometimes without a miss, and a pair without a weight in all of them.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Logarithms up to ± this
    Range(f64),
    /// Small integers: sums are exact, most events tie
    Tied,
    /// Mostly forbidden
    Sparse,
}

/// Logarithms of weights, −∞ for zero.
#[derive(Clone, Debug)]
struct Problem<T> {
    miss: Vec<T>,
    hit: Vec<Vec<T>>,
    columns: usize,
}

/// Nothing but a joint event: 0 for a miss, j + 1 for column j.
type Event = Vec<u16>;

impl<T: Real> Problem<T> {
    fn random(rng: &mut ChaCha8Rng, kind: Kind, rows: usize, columns: usize) -> Self {
        let forbidden = if matches!(kind, Kind::Sparse) { 0.6 } else { 0.15 };
        let mut weight = || {
            let ln = match kind {
                Kind::Range(limit) => rng.random_range(-limit..limit),
                Kind::Tied => f64::from(rng.random_range(-2..3)),
                Kind::Sparse => rng.random_range(-10.0..10.0),
            };
            T::lit(if rng.random_bool(forbidden) { f64::NEG_INFINITY } else { ln })
        };
        let miss = (0..rows).map(|_| weight()).collect();
        Self { miss, hit: (0..rows).map(|_| (0..columns).map(|_| weight()).collect()).collect(), columns }
    }

    /// Of a reference case: one list a row, a weight for the miss and one for every column.
    fn from_weights(weights: &[Vec<f64>]) -> Self {
        let rows = weights.iter().map(|row| row.iter().map(|w| T::lit(w.ln())).collect::<Vec<_>>());
        let (miss, hit) = rows.map(|row| (row[0], row[1..].to_vec())).unzip();
        Self { miss, hit, columns: weights.iter().map(|row| row.len() - 1).max().unwrap_or(0) }
    }

    fn rows(&self) -> usize {
        self.miss.len()
    }

    fn choice(&self, row: usize, choice: u16) -> T {
        if choice == 0 { self.miss[row] } else { self.hit[row][usize::from(choice) - 1] }
    }

    /// The sum of logarithms, row by row.
    fn ln_weight(&self, event: &[u16]) -> T {
        event.iter().enumerate().fold(T::ZERO, |sum, (row, &choice)| sum + self.choice(row, choice))
    }

    /// The largest finite logarithm, by magnitude.
    fn magnitude(&self) -> f64 {
        let all = self.miss.iter().chain(self.hit.iter().flatten());
        all.map(|w| w.to_f64().abs()).filter(|w| w.is_finite()).fold(0.0, f64::max)
    }

    /// All events with a weight, best first, equal ones in lexicographic order.
    fn events(&self) -> Vec<(T, Event)> {
        let mut events = vec![Event::new()];
        for row in 0..self.rows() {
            let grown = |event: &Event| {
                let free = (0..=self.columns as u16).filter(|c| *c == 0 || !event.contains(c)).collect::<Vec<_>>();
                let possible = free.into_iter().filter(|c| self.choice(row, *c).to_f64() > f64::NEG_INFINITY);
                possible.map(|c| [event.as_slice(), &[c]].concat()).collect::<Vec<_>>()
            };
            events = events.iter().flat_map(grown).collect();
        }
        let mut events: Vec<_> = events.into_iter().map(|event| (self.ln_weight(&event), event)).collect();
        events.sort_by(|(a, left), (b, right)| b.partial_cmp(a).unwrap_or(Ordering::Equal).then_with(|| left.cmp(right)));
        events
    }

    /// How far rounding may take the sums that searches compare: each row brings one shortest path, of which every price
    /// keeps at most four errors, each at most ε times the largest number around, a sum of as many logarithms as the path
    /// has rows.
    fn rounding(&self) -> f64 {
        let n = self.rows() as f64;
        4.0 * n * n * T::EPSILON.to_f64() * 2.0 * n * self.magnitude()
    }
}

/// Runs `check` on `count` random problems of each kind.
fn on_random_problems<T: Real>(seed: u64, count: usize, rows: usize, columns: usize, check: impl Fn(&Problem<T>) -> Outcome) -> Outcome {
    let extreme = 460.0;
    for kind in [Kind::Range(1.0), Kind::Range(69.0), Kind::Range(extreme), Kind::Tied, Kind::Sparse] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..count {
            let (rows, columns) = (rng.random_range(0..=rows), rng.random_range(0..=columns));
            let problem = Problem::random(&mut rng, kind, rows, columns);
            check(&problem).map_err(|fault| format!("{kind:?}, {problem:?}: {fault}"))?;
        }
    }
    Ok(())
}

/// The cases of a reference file.
fn cases(file: &str) -> Result<Vec<serde_json::Value>, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(file);
    let content: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    Ok(content["cases"].as_array().ok_or("no cases")?.clone())
}

/// A field of a case.
fn field<V: serde::de::DeserializeOwned>(case: &serde_json::Value, name: &str) -> Result<V, Box<dyn Error>> {
    serde_json::from_value(case[name].clone()).map_err(|fault| format!("{}, {name}: {fault}", case["name"]).into())
}
