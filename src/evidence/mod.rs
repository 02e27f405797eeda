//! What a scan says about one track: gating, likelihoods under every mode, and the update by association weights.
//!
//! With c_r the predicted mode probabilities, L_jr = N(z_j; ẑ_r, S_r) and λ_j the clutter density at z_j:
//!
//! ```text
//! gate     ν' S⁻¹ ν ≤ γ by the mode with the largest det S, one gate for all modes
//! score    h_j = P_D M_j / λ_j,  M_j = Σ_r c_r L_jr,  m = 1 − P_D P_G        (diffuse clutter: λ = number gated / V)
//! absorb   given β_j:  w_jr = L_jr β_j / M_j,  w_0r = β_0,  e_r = Σ_j w_jr
//!          μ_r = c_r e_r, and mode r takes the association update with weights w_jr / e_r
//! PDA      β_j / M_j = P_D / λ_j and β_0 = m, but for a factor: score and absorb in one pass
//! ```
//!
//! The association is blind to modes and the modes stay exact all the same: for one track this is PDA inside every
//! mode with the mixture likelihood e_r, as corrected in the equations 10–16 of Kashyap et al. (2006).
//!
//! | file | of what |
//! |---|---|
//! | `update.rs` | what detections add up to in every mode, and the update by it |
//! | `logarithms.rs` | what plain sums do not serve: detections with a noise of their own, or far from every mode |
//! | `joseph.rs` | the update where noise is sharp |
//! | `offset.rs` | detections with a time of their own |
//! | `predicted.rs` | of which modes: all, or some |

mod joseph;
mod logarithms;
mod offset;
mod predicted;
mod update;

pub(crate) use logarithms::density_of;
pub use predicted::{Innovations, Predicted, SomeInnovations, innovations, no_innovations, predict_measurements};
pub use update::{Corrected, Found, correct_by_one, update_by_one};

use crate::association::Gate;
use crate::gaussian::{Innovation, unit_peak};
use crate::mode::ModeBank;
use crate::model::MeasurementModel;
use crate::scalar::{Real, larger};
use crate::scan::{Candidates, Detection};
use crate::sensor::{Clutter, Sensor};
use crate::time::Duration;

/// Densities of clutter below this count as this.
pub(crate) const LEAST_DENSITY: f64 = 1e-30;

/// The gated detections of one track with their weights. Scratch: one serves all tracks.
#[derive(Clone, Debug)]
pub struct Evidence<T, const DETS: usize> {
    /// Numbers of the gated detections in the scan
    gated: heapless::Vec<u16, DETS>,
    /// h_j, then β_j
    hit: [T; DETS],
    /// m
    miss: T,
    /// The density at zero of the mode that gates; zero where no mode can be measured
    peak: T,
    kind: Kind,
}

/// The most that the detections of a track bring besides their coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Nothing
    Plain,
    /// A noise; or the sensor's is sharp
    OwnNoise,
    /// A time
    OwnTime,
}

impl<T: Real, const DETS: usize> Default for Evidence<T, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self { gated: heapless::Vec::new(), hit: [T::ZERO; DETS], miss: T::ZERO, peak: T::ZERO, kind: Kind::Plain }
    }

    /// Numbers of the gated detections in the scan, ascending as the candidates did.
    #[must_use]
    pub fn gated(&self) -> &[u16] {
        &self.gated
    }

    /// The weights of association: that of no detection, and those of the gated detections, to be replaced by β.
    #[inline(always)]
    pub fn weights(&mut self) -> (T, &mut [T]) {
        let count = self.gated.len().min(DETS);
        (self.miss, self.hit.get_mut(..count).unwrap_or_default())
    }

    /// The gated detections by number with their weights, to be replaced by β.
    #[inline(always)]
    pub fn scored(&mut self) -> impl Iterator<Item = (u16, &mut T)> {
        self.gated.iter().copied().zip(&mut self.hit)
    }

    /// The gated detections by number with their weights.
    pub fn associated(&self) -> impl Iterator<Item = (u16, T)> {
        self.gated.iter().copied().zip(self.hit.iter().copied())
    }

    /// V, the volume of the gate of the detections gated last; zero where no mode can be measured.
    #[inline(always)]
    #[must_use]
    pub fn volume<const NZ: usize>(&self, gate: &Gate<T>) -> T {
        volume::<T, NZ>(gate, self.peak)
    }

    /// Gates the detections that are `candidates`.
    ///
    /// Cost: one subtraction and product per candidate whose first coordinate is too far off, one residual and form
    /// ν' S⁻¹ ν per other; for detections with a noise or a time of their own a factorisation of S each as well.
    #[inline(always)]
    pub fn gate<S: Sensor<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: Candidates<'_>,
    ) {
        let innovations = predicted.innovations();
        self.gated.clear();
        let (model, threshold) = (sensor.model(), sensor.gate().threshold());
        let (mut widest, mut most, mut sharp) = (MODES, T::ZERO, false);
        for r in 0..MODES {
            if !predicted.weighs(r) {
                continue;
            }
            let Innovation { density, sharp: own, .. } = &innovations[r];
            sharp |= own;
            if density.det > most {
                (widest, most) = (r, density.det);
            }
        }
        self.kind = if sharp { Kind::OwnNoise } else { Kind::Plain };
        let Some(&Innovation { z_hat, density, .. }) = innovations.get(widest) else {
            self.peak = T::ZERO;
            return;
        };
        self.peak = density.peak;
        if !candidates.plain {
            return self.gate_each(bank, predicted, sensor, detections, candidates.numbers, widest);
        }
        // The box: a residual in the gate has no first coordinate beyond √(γ S₁₁).
        let reach = threshold * density.first;
        for &number in candidates.numbers {
            let Some(detection) = detections.get(usize::from(number)) else { return };
            // Inlined, this costs nothing of the other coordinates.
            let first = model.residual(&detection.z, &z_hat).data.0[0][0];
            if first * first > reach {
                continue;
            }
            if density.nis(&model.residual(&detection.z, &z_hat)) <= threshold && self.gated.push(number).is_err() {
                return;
            }
        }
    }

    /// Takes the detections with a positive probability for the gated ones, and the probabilities for their weights: for
    /// [`absorb`](Self::absorb), after an association of many tracks.
    #[inline(always)]
    pub fn take<I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        predicted: &I,
        detections: &[Detection<T, NZ>],
        beta: impl Iterator<Item = (u16, T)>,
    ) {
        self.gated.clear();
        self.kind = kind_of(predicted);
        for (number, beta) in beta.filter(|(_, beta)| *beta > T::ZERO) {
            let Some((detection, hit)) = detections.get(usize::from(number)).zip(self.hit.get_mut(self.gated.len())) else { return };
            if self.gated.push(number).is_err() {
                return;
            }
            *hit = beta;
            if detection.offset != Duration::ZERO {
                self.kind = Kind::OwnTime;
            } else if self.kind == Kind::Plain && detection.noise.is_some() {
                self.kind = Kind::OwnNoise;
            }
        }
    }

    /// Writes the weights of the gated detections.
    ///
    /// Cost: MODES residuals, forms ν' S⁻¹ ν and powers of two per gated detection.
    #[inline(always)]
    pub fn score<S: Sensor<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
    ) {
        let p_detect = sensor.p_detect(&bank.modes[0].mean);
        self.miss = if self.gated.is_empty() { T::ONE } else { T::ONE - p_detect * sensor.gate().p_gate() };
        let mut rate = self.rate::<NZ>(sensor.gate(), p_detect);
        let mut total = self.miss;
        if self.kind == Kind::Plain {
            for (number, hit) in self.gated.iter().zip(&mut self.hit) {
                let Some(detection) = detections.get(usize::from(*number)) else { break };
                let mut mixture = T::ZERO;
                for r in 0..MODES {
                    if !predicted.weighs(r) {
                        continue;
                    }
                    let Innovation { z_hat, density, .. } = &predicted.innovations()[r];
                    mixture += bank.prob[r] * density.at(&sensor.model().residual(&detection.z, z_hat));
                }
                *hit = mixture * rate.at(sensor.clutter(&detection.z));
                total += *hit;
            }
        }
        if self.kind != Kind::Plain || total <= T::LEAST {
            self.score_by_logarithms(bank, predicted, sensor, detections, rate);
        }
    }

    /// [`gate`](Self::gate) and [`score`](Self::score). Returns V.
    #[inline(always)]
    pub fn collect<S: Sensor<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: Candidates<'_>,
    ) -> T {
        self.gate(bank, predicted, sensor, detections, candidates);
        self.score(bank, predicted, sensor, detections);
        self.volume::<NZ>(sensor.gate())
    }

    #[inline(always)]
    fn rate<'a, const NZ: usize>(&self, gate: &'a Gate<T>, p_detect: T) -> Rate<'a, T, NZ> {
        Rate { p_detect, gate, count: self.gated.len(), peak: self.peak, last: Clutter::Poisson(-T::ONE), rate: T::ZERO }
    }
}

/// V of a gate where the density has `peak` at zero; zero where it has none.
#[inline(always)]
fn volume<T: Real, const NZ: usize>(gate: &Gate<T>, peak: T) -> T {
    if peak > T::ZERO { gate.volume(unit_peak::<T, NZ>() / peak) } else { T::ZERO }
}

/// Where all detections are plain.
#[inline(always)]
fn kind_of<T, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(predicted: &I) -> Kind {
    let sharp = (0..MODES).filter(|r| predicted.weighs(*r)).fold(false, |sharp, r| sharp | predicted.innovations()[r].sharp);
    if sharp { Kind::OwnNoise } else { Kind::Plain }
}

/// P_D / λ of one detection after the other.
struct Rate<'a, T, const NZ: usize> {
    p_detect: T,
    gate: &'a Gate<T>,
    /// Detections gated
    count: usize,
    /// The density at zero of the mode that gates
    peak: T,
    last: Clutter<T>,
    rate: T,
}

impl<T: Real, const NZ: usize> Rate<'_, T, NZ> {
    #[inline(always)]
    fn at(&mut self, clutter: Clutter<T>) -> T {
        if clutter != self.last {
            (self.last, self.rate) = (clutter, self.of(clutter));
        }
        self.rate
    }

    // Out of line, or every detection would pay for the division.
    #[inline(never)]
    fn of(&self, clutter: Clutter<T>) -> T {
        self.p_detect / self.density(clutter)
    }

    /// λ
    #[inline(always)]
    fn density(&self, clutter: Clutter<T>) -> T {
        let density = match clutter {
            Clutter::Poisson(density) => density,
            Clutter::Diffuse => diffuse::<T, NZ>(self.gate, self.count, self.peak),
        };
        larger(density, T::lit(LEAST_DENSITY))
    }
}

/// λ of diffuse clutter: what is gated over the volume of the gate.
// Out of line, or known clutter would pay for the divisions.
#[inline(never)]
fn diffuse<T: Real, const NZ: usize>(gate: &Gate<T>, count: usize, peak: T) -> T {
    T::from_count(count) / volume::<T, NZ>(gate, peak)
}
