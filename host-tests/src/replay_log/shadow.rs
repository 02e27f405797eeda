//! Single precision beside double: the worst differences of all tracks over all scans, and where they were.
//!
//! ```text
//! mean               |x − x'| / σ'                  σ' the standard deviation of that state in double precision
//! covariance         |P_ij − P'_ij| / (σ'_i σ'_j)
//! mode probability   |μ − μ'|
//! ```

use boresight::ready::{MODES, State};
use boresight::track::Track;
use std::fmt;

/// The worst difference of one quantity.
#[derive(Clone, Debug, Default)]
struct Worst {
    difference: f64,
    place: String,
}

impl Worst {
    fn take(&mut self, difference: f64, place: impl FnOnce() -> String) {
        // What is not a number counts as worst.
        if difference > self.difference || difference.is_nan() {
            *self = Self { difference, place: place() };
        }
    }
}

/// What the comparison has found.
#[derive(Clone, Debug, Default)]
pub struct Shadow {
    mean: Worst,
    covariance: Worst,
    probability: Worst,
    /// The first scan after which the lists of tracks differ.
    parted: Option<u32>,
}

impl Shadow {
    /// Compares the tracks of both states after the scan number `scan`.
    pub fn take<const NX: usize>(&mut self, scan: u32, single: &State<f32, NX>, double: &State<f64, NX>) {
        let ids = |a: Option<_>, b: Option<_>| a == b;
        let same =
            single.tracks().count() == double.tracks().count() && single.tracks().zip(double.tracks()).all(|(a, b)| ids(a.id(), b.id()));
        if !same {
            self.parted.get_or_insert(scan);
            return;
        }
        single.tracks().zip(double.tracks()).for_each(|(a, b)| self.compare(scan, a, b));
    }

    fn compare<const NX: usize>(&mut self, scan: u32, single: &Track<f32, NX, MODES>, double: &Track<f64, NX, MODES>) {
        let place = |field: String| format!("scan {scan}, track {}, {field}", single.id().map_or(0, |id| id.number()));
        let (a, b) = (single.bank().combined(), double.bank().combined());
        let (a_cov, b_cov) = (a.cov.to_matrix(), b.cov.to_matrix());
        // A state that a mode holds at zero knows no deviation: differences there count in its own unit.
        let sigma = |i: usize| if b_cov[(i, i)] > 0.0 { b_cov[(i, i)].sqrt() } else { 1.0 };
        for i in 0..NX {
            self.mean.take((f64::from(a.mean[i]) - b.mean[i]).abs() / sigma(i), || place(format!("state {i}")));
            for j in i..NX {
                let difference = (f64::from(a_cov[(i, j)]) - b_cov[(i, j)]).abs() / (sigma(i) * sigma(j));
                self.covariance.take(difference, || place(format!("entry {i} {j}")));
            }
        }
        for (r, (a, b)) in single.bank().prob.iter().zip(&double.bank().prob).enumerate() {
            self.probability.take((f64::from(*a) - b).abs(), || place(format!("mode {r}")));
        }
    }
}

impl fmt::Display for Shadow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "beside double precision, at worst")?;
        let rows =
            [("mean, in deviations", &self.mean), ("covariance, relative", &self.covariance), ("mode probability", &self.probability)];
        for (name, Worst { difference, place }) in rows {
            writeln!(f, "  {name:<22} {difference:8.1e}  {place}")?;
        }
        match self.parted {
            Some(scan) => writeln!(f, "  other tracks since scan {scan}: compared until then, and whenever the lists agree"),
            None => writeln!(f, "  the same tracks in all scans"),
        }
    }
}
