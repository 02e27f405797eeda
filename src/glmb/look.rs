//! A scan as the rows of targets are written from it.

use super::density::{Density, Sight};
use super::row::Row;
use crate::evidence::LEAST_DENSITY;
use crate::mode::LEAST_PROBABILITY;
use crate::scalar::{Real, is_finite, larger, ln};
use crate::scan::Detection;
use crate::sensor::{Clutter, Sensor};

/// The detections that are taken in, and who sees them.
pub(crate) struct Look<'a, S, T, const NZ: usize, const MODES: usize> {
    pub sight: Sight<'a, S, T, MODES>,
    pub detections: &'a [Detection<T, NZ>],
    /// Those taken in, by number
    pub candidates: &'a [u16],
    /// Scratch, one for each
    pub weights: &'a mut [T],
}

impl<S, T: Real, const NZ: usize, const MODES: usize> Look<'_, S, T, NZ, MODES> {
    /// Writes the row of a target that exists with probability `existence`. One whose density is not sound is gone: then `false`.
    pub fn write<D: Density<T, NX, MODES>, const NX: usize, const GATED: usize>(
        &mut self,
        row: &mut Row<T, GATED>,
        density: &D,
        existence: T,
    ) -> bool
    where
        S: Sensor<T, NX, NZ>,
    {
        if !density.is_valid() {
            row.fill(T::ZERO, -T::ONE / T::ZERO, core::iter::empty());
            return false;
        }
        self.weights.fill(T::ZERO);
        let miss = density.weigh(&self.sight, self.detections, self.candidates, self.weights);
        // A target that cannot be missed can still vanish from sight: some event must remain.
        let ln_missed = ln(larger(T::lit(LEAST_PROBABILITY), miss));
        let ln_alive = ln(existence);
        let hits = self.candidates.iter().zip(self.weights.iter()).filter(|(_, weight)| **weight > T::ZERO);
        let ln_hits = hits.map(|(number, weight)| (*number, ln_alive + ln(*weight) - ln(self.clutter(*number))));
        row.fill(ln(T::ONE - existence), ln_alive + ln_missed, ln_hits.filter(|(_, ln_weight)| is_finite(*ln_weight)));
        true
    }

    /// κ at a detection
    fn clutter<const NX: usize>(&self, number: u16) -> T
    where
        S: Sensor<T, NX, NZ>,
    {
        match self.detections.get(usize::from(number)).map(|d| self.sight.sensor.clutter(&d.z)) {
            Some(Clutter::Poisson(density)) => larger(T::lit(LEAST_DENSITY), density),
            _ => T::ONE,
        }
    }
}
