//! The plots of one scan in memory of their own, for whoever gathers them one by one: a link, a log, code in C.
//!
//! Where there are more than fit, the strongest stay, or the first where none has an amplitude: the rule of the trackers.

use crate::scalar::Real;
use crate::scan::{Detection, Report, Scan, weaker};
use crate::time::Instant;

/// At most `DETS` plots, in order of arrival. New ones cost no flash.
///
/// A plot costs one copy; beyond the capacity, `DETS` comparisons of amplitude and as many copies.
#[derive(Clone, Debug)]
pub struct Plots<T, const NZ: usize, const DETS: usize> {
    kept: heapless::Vec<Detection<T, NZ>, DETS>,
    dropped: u16,
}

impl<T: Real, const NZ: usize, const DETS: usize> Plots<T, NZ, DETS> {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self { kept: heapless::Vec::new(), dropped: 0 }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.kept.clear();
        self.dropped = 0;
    }

    /// Takes one more plot, or gives up the weakest.
    pub fn push(&mut self, plot: Detection<T, NZ>) {
        let Err(plot) = self.kept.push(plot) else { return };
        self.dropped = self.dropped.saturating_add(1);
        // Of equals the last to arrive.
        let weakest = self.kept.iter().enumerate().reduce(|a, b| if weaker(a.1, b.1) { a } else { b });
        if let Some((slot, kept)) = weakest
            && weaker(kept, &plot)
        {
            // Those behind it move up.
            self.kept.iter_mut().skip(slot).rev().fold(plot, |behind, place| core::mem::replace(place, behind));
        }
    }

    /// The plots kept.
    #[must_use]
    pub fn as_slice(&self) -> &[Detection<T, NZ>] {
        &self.kept
    }

    /// How many were given up.
    #[must_use]
    pub fn dropped(&self) -> u16 {
        self.dropped
    }

    /// The scan that they make at `time`.
    #[must_use]
    pub fn scan(&self, time: Instant) -> Scan<'_, T, NZ> {
        Scan::new(time, &self.kept)
    }

    /// `report` with the plots that have not even reached the tracker.
    #[must_use]
    pub fn counted(&self, report: Report) -> Report {
        Report { detections_dropped: report.detections_dropped.saturating_add(self.dropped), ..report }
    }
}

impl<T: Real, const NZ: usize, const DETS: usize> Default for Plots<T, NZ, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Selection;
    use proptest::prelude::*;

    proptest! {
        /// What is kept of a scan is what a tracker with the same room keeps.
        #[test]
        fn plots_are_kept_as_trackers_keep_them(amplitudes in proptest::collection::vec(proptest::option::of(0u8..6), 0..40)) {
            let plot = |(i, a): (usize, &Option<u8>)| {
                let plot = Detection::new([i as f32]);
                a.map_or(plot, |a| plot.with_amplitude(f32::from(a)))
            };
            let all: heapless::Vec<_, 40> = amplitudes.iter().enumerate().map(plot).collect();
            let selection = Selection::<7>::new(&all);
            let mut plots = Plots::<f32, 1, 7>::new();
            all.iter().for_each(|plot| plots.push(*plot));
            prop_assert_eq!(plots.dropped(), selection.dropped);
            prop_assert!(plots.as_slice().iter().map(|d| d.z[0] as u16).eq(selection.indices));
        }
    }
}
