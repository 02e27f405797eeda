//! The predicted measurements of a bank, and which of its modes a scan speaks of: all, or a set.
//!
//! ```text
//! weighs     the modes of the mixture M_j = Σ_r c_r L_jr
//! corrects   the modes that are corrected and whose evidence e_r is found
//! ```
//!
//! They differ where modes are activated after the association of a scan: then the mixture is that of the modes which were
//! associated. Nothing is computed for a mode that does neither. The set of all modes is known when the code is compiled and
//! costs nothing.

use crate::gaussian::{Innovation, ResidualDensity, zero_vector};
use crate::mode::{ActiveSet, ModeBank};
use crate::model::MeasurementModel;
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{ArrayStorage, SMatrix};

/// ẑ_r, G_r and S_r of every mode.
pub type Innovations<T, const NX: usize, const NZ: usize, const MODES: usize> = [Innovation<T, NX, NZ>; MODES];

/// Predicted measurements, and of which modes.
pub trait Predicted<T, const NX: usize, const NZ: usize, const MODES: usize> {
    /// Of every mode; what stands for one that neither weighs nor is corrected means nothing.
    fn innovations(&self) -> &Innovations<T, NX, NZ, MODES>;
    /// Whether the mode is of the mixture.
    fn weighs(&self, mode: usize) -> bool;
    /// Whether the mode is to be corrected.
    fn corrects(&self, mode: usize) -> bool;
    /// Whether it does either.
    #[inline(always)]
    fn counts(&self, mode: usize) -> bool {
        self.weighs(mode) || self.corrects(mode)
    }
}

impl<T, const NX: usize, const NZ: usize, const MODES: usize> Predicted<T, NX, NZ, MODES> for Innovations<T, NX, NZ, MODES> {
    #[inline(always)]
    fn innovations(&self) -> &Self {
        self
    }
    #[inline(always)]
    fn weighs(&self, _: usize) -> bool {
        true
    }
    #[inline(always)]
    fn corrects(&self, _: usize) -> bool {
        true
    }
}

/// The predicted measurements of some modes.
#[derive(Clone, Copy, Debug)]
pub struct SomeInnovations<'a, T, const NX: usize, const NZ: usize, const MODES: usize> {
    innovations: &'a Innovations<T, NX, NZ, MODES>,
    weighing: ActiveSet,
    corrected: ActiveSet,
}

impl<'a, T: Real, const NX: usize, const NZ: usize, const MODES: usize> SomeInnovations<'a, T, NX, NZ, MODES> {
    /// Of the modes `active`, which weigh and are corrected.
    #[inline(always)]
    #[must_use]
    pub fn new(innovations: &'a Innovations<T, NX, NZ, MODES>, active: ActiveSet) -> Self {
        Self { innovations, weighing: active, corrected: active }
    }

    /// Of the modes `new`, which are corrected, while those of `run` make up the mixture.
    #[inline(always)]
    #[must_use]
    pub fn activated(innovations: &'a Innovations<T, NX, NZ, MODES>, run: ActiveSet, new: ActiveSet) -> Self {
        Self { innovations, weighing: run, corrected: new }
    }
}

impl<T, const NX: usize, const NZ: usize, const MODES: usize> Predicted<T, NX, NZ, MODES> for SomeInnovations<'_, T, NX, NZ, MODES> {
    #[inline(always)]
    fn innovations(&self) -> &Innovations<T, NX, NZ, MODES> {
        self.innovations
    }
    #[inline(always)]
    fn weighs(&self, mode: usize) -> bool {
        self.weighing.contains(mode)
    }
    #[inline(always)]
    fn corrects(&self, mode: usize) -> bool {
        self.corrected.contains(mode)
    }
}

/// Room for predicted measurements.
#[inline(always)]
#[must_use]
pub const fn no_innovations<T: Real, const NX: usize, const NZ: usize, const MODES: usize>() -> Innovations<T, NX, NZ, MODES> {
    let density = ResidualDensity { s_inv: Symmetric::zeros(), peak: T::ZERO, det: T::ZERO, first: T::ZERO };
    let cross = SMatrix::from_array_storage(ArrayStorage([[T::ZERO; NX]; NZ]));
    [Innovation { z_hat: zero_vector(), cross, spread: Symmetric::zeros(), density, sharp: false }; MODES]
}

/// Writes the predicted measurements of the modes `active` of a bank.
#[inline]
pub fn predict_measurements<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    innovations: &mut Innovations<T, NX, NZ, MODES>,
    bank: &ModeBank<T, NX, MODES>,
    active: ActiveSet,
    model: &M,
) {
    rolled!(for r in 0..MODES {
        if active.contains(r) {
            innovations[r] = model.innovation(&bank.modes[r]);
        }
    });
}

/// The predicted measurements of a bank.
#[inline(always)]
#[must_use]
pub fn innovations<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &ModeBank<T, NX, MODES>,
    model: &M,
) -> Innovations<T, NX, NZ, MODES> {
    // Written in place: collected, they would be copied once more.
    let mut innovations = no_innovations();
    predict_measurements(&mut innovations, bank, ActiveSet::first(MODES), model);
    innovations
}
