//! The oracle: all joint events, one by one, in double precision.

/// Weights of a problem: per track that of no detection, and one per detection.
#[derive(Clone, Debug)]
pub struct Problem {
    pub miss: Vec<f64>,
    pub hit: Vec<Vec<f64>>,
    pub diffuse: bool,
}

impl Problem {
    pub fn tracks(&self) -> usize {
        self.miss.len()
    }

    pub fn detections(&self) -> usize {
        self.hit.first().map_or(0, Vec::len)
    }

    /// Row by row β_t0 and β_tj; `None` where no event is possible.
    pub fn marginals(&self) -> Option<Vec<(f64, Vec<f64>)>> {
        let mut sums = vec![(0.0, vec![0.0; self.detections()]); self.tracks()];
        // Rows on a scale of their own, so that no product leaves the range.
        let scale: Vec<f64> = self.hit.iter().zip(&self.miss).map(|(hit, miss)| hit.iter().fold(*miss, |a, b| a.max(*b))).collect();
        let mut event = vec![None; self.tracks()];
        let total = self.visit(0, 1.0, &scale, &mut event, &mut sums);
        let share = |w: f64| w / total;
        (total > 0.0).then(|| sums.into_iter().map(|(m, h)| (share(m), h.into_iter().map(share).collect())).collect())
    }

    fn visit(&self, t: usize, weight: f64, scale: &[f64], event: &mut Vec<Option<usize>>, sums: &mut [(f64, Vec<f64>)]) -> f64 {
        if weight == 0.0 {
            return 0.0;
        }
        if t == self.tracks() {
            let weight = weight * self.clutter_prior(event.iter().flatten().count());
            for (choice, (miss, hit)) in event.iter().zip(sums) {
                match choice {
                    None => *miss += weight,
                    Some(j) => hit[*j] += weight,
                }
            }
            return weight;
        }
        event[t] = None;
        let mut total = self.visit(t + 1, weight * self.miss[t] / scale[t], scale, event, sums);
        for j in 0..self.detections() {
            if !event[..t].contains(&Some(j)) {
                event[t] = Some(j);
                total += self.visit(t + 1, weight * self.hit[t][j] / scale[t], scale, event, sums);
            }
        }
        event[t] = None;
        total
    }

    /// Π_{i < k} m / (m − i) with m detections that anybody gates
    fn clutter_prior(&self, served: usize) -> f64 {
        if !self.diffuse {
            return 1.0;
        }
        let m = (0..self.detections()).filter(|j| self.hit.iter().any(|row| row[*j] > 0.0)).count();
        (0..served).map(|i| m as f64 / (m - i) as f64).product()
    }
}
