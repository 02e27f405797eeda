//! Joint association by listing every event: the oracle of small problems.
//!
//! ```text
//! β_tj = Σ weights of the events that give track t detection j / Σ weights of all events
//! diffuse clutter: the weight of an event that serves k tracks is divided by m (m − 1) … (m − k + 1) / m^k
//! ```

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use boresight::scalar::Real;

/// Every event, in double precision.
#[derive(Clone, Copy, Debug, Default)]
pub struct Enumeration;

/// One problem: rows of weights, each scaled by its largest, miss first.
struct Events {
    rows: Vec<Vec<f64>>,
    /// Detections that some track can have, where clutter is diffuse.
    shared: Option<f64>,
    sums: Vec<Vec<f64>>,
    chosen: Vec<usize>,
}

impl Events {
    fn list(&mut self, weight: f64) {
        let Some(row) = self.rows.get(self.chosen.len()) else {
            let served = self.chosen.iter().filter(|entry| **entry > 0).count();
            let clutter: f64 = self.shared.map_or(1.0, |m| (0..served).map(|k| m / (m - k as f64)).product());
            for (sums, entry) in self.sums.iter_mut().zip(&self.chosen) {
                sums[*entry] += weight * clutter;
            }
            return;
        };
        let possible: Vec<_> =
            row.iter().copied().enumerate().filter(|(entry, w)| *w > 0.0 && !(*entry > 0 && self.chosen.contains(entry))).collect();
        for (entry, w) in possible {
            self.chosen.push(entry);
            self.list(weight * w);
            self.chosen.pop();
        }
    }
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Associator<T, TRACKS, DETS> for Enumeration {
    type Memory = ();
    const MEMORY: () = ();

    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, (): &mut ()) -> Completeness {
        let linear = |w: T| if matrix.domain == Domain::Linear { w.to_f64() } else { w.to_f64().exp() };
        let row = |track: usize| {
            let (miss, hits) = matrix.row(track)?;
            let row: Vec<f64> = std::iter::once(miss).chain(hits.iter().copied()).map(linear).collect();
            let largest = row.iter().copied().fold(0.0, f64::max);
            Some(row.into_iter().map(|w| w / largest).collect())
        };
        let rows: Vec<Vec<f64>> = (0..TRACKS).filter_map(row).collect();
        let possible = (1..=matrix.columns()).filter(|entry| rows.iter().any(|row| row[*entry] > 0.0)).count();
        let shared = (matrix.clutter == ClutterPrior::Diffuse).then_some(possible as f64);
        let mut events = Events { sums: rows.iter().map(|row| vec![0.0; row.len()]).collect(), rows, shared, chosen: vec![] };
        events.list(1.0);
        let mut completeness = Completeness::default();
        for (track, sums) in events.sums.iter().enumerate() {
            let Some((miss, hits)) = matrix.row_mut(track) else { continue };
            let total: f64 = sums.iter().sum();
            let probability = |sum: f64, entry: usize| if total > 0.0 { sum / total } else { f64::from(u8::from(entry == 0)) };
            completeness.infeasible = u16::from(total <= 0.0);
            for ((entry, sum), out) in sums.iter().enumerate().zip(std::iter::once(miss).chain(hits)) {
                *out = T::lit(probability(*sum, entry));
            }
        }
        completeness
    }
}
