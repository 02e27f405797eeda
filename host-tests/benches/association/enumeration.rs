//! Plain enumeration: every joint event once, depth first.
//!
//! ```text
//! S(t, used) = miss_t S(t + 1, used) + Σ_{j ∉ used} hit_tj S(t + 1, used ∪ j),   S(T, ·) = 1
//! β_tj       = Σ over all ways to come to t of  (weight of the way) hit_tj S(t + 1, ·) / S(0, ∅)
//! ```
//!
//! The sums of subtrees come back from below, so that an event costs one multiplication and not one per track.

use crate::matrices::Problem;

/// A problem in the form that is quickest to enumerate: the gated detections of every track, as bits.
pub struct Enumeration {
    miss: Vec<f64>,
    gated: Vec<Vec<(u32, f64)>>,
    detections: usize,
}

impl Enumeration {
    pub fn new(problem: &Problem) -> Self {
        let gated = |row: &Vec<f64>| (0..).zip(row).filter(|(_, h)| **h > 0.0).map(|(j, h)| (1 << j, *h)).collect();
        Self { miss: problem.miss.clone(), gated: problem.hit.iter().map(gated).collect(), detections: problem.detections() }
    }

    /// The number of joint events, if it is at most `most`.
    pub fn events(&self, most: u64) -> Option<u64> {
        let mut events = 0;
        self.count(0, 0, most, &mut events);
        (events <= most).then_some(events)
    }

    fn count(&self, t: usize, used: u32, most: u64, events: &mut u64) {
        let Some(gated) = self.gated.get(t) else { return *events += 1 };
        let free = gated.iter().map(|(bit, _)| *bit).filter(|bit| used & bit == 0);
        for bit in std::iter::once(0).chain(free) {
            if *events > most {
                return;
            }
            self.count(t + 1, used | bit, most, events);
        }
    }

    /// β_t0 and β_tj, one row per track.
    pub fn marginals(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![vec![0.0; self.detections + 1]; self.miss.len()];
        let total = self.visit(0, 0, 1.0, &mut rows);
        rows.iter_mut().flatten().for_each(|beta| *beta /= total);
        rows
    }

    /// S(t, used), for a way there of weight `way`.
    fn visit(&self, t: usize, used: u32, way: f64, rows: &mut [Vec<f64>]) -> f64 {
        let (Some(miss), Some(gated)) = (self.miss.get(t), self.gated.get(t)) else { return 1.0 };
        let mut sum = miss * self.visit(t + 1, used, way * miss, rows);
        rows[t][0] += way * sum;
        for (bit, hit) in gated.iter().filter(|(bit, _)| used & bit == 0) {
            let share = hit * self.visit(t + 1, used | bit, way * hit, rows);
            rows[t][1 + bit.trailing_zeros() as usize] += way * share;
            sum += share;
        }
        sum
    }
}
