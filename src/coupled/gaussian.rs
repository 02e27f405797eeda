//! The density of two targets, each in one mode, with or without what they have in common.
//!
//! ```text
//! prediction   P_r ← F_r P_r F_r' + Q_r,   C ← F₁ C F₂'
//! measurement  G = [P₁H₁' CH₂'; C'H₁' P₂H₂'],   Σ = [H₁P₁H₁' H₁CH₂'; · H₂P₂H₂']
//! correction   x ← x + G w,   P ← P − G E G'
//! ```

use super::blocks::{self, Blocks, Pair};
use crate::gaussian::{Gaussian, ResidualDensity, blunted, dot};
use crate::mode::ModeSet;
use crate::model::MeasurementModel;
use crate::scalar::{Real, is_plus_zero};
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// What two targets have in common: kept, or taken for nothing. Sealed.
pub trait Coupling<T: Real, const NX: usize>: Copy + sealed::Sealed {
    /// Zero.
    const ZERO: Self;
    /// C = E (x₁ − x̂₁)(x₂ − x̂₂)', if it is kept
    fn block(&self) -> Option<&SMatrix<T, NX, NX>>;
    /// The same, to be written
    fn block_mut(&mut self) -> Option<&mut SMatrix<T, NX, NX>>;
}

/// The covariance between two targets is kept: NX² scalars for every pair of modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cross<T, const NX: usize>(pub SMatrix<T, NX, NX>);

/// The covariance between two targets is taken for zero whenever it would come up: a half of the memory of the whole matrix, and
/// less than a half of the work.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NoCross;

mod sealed {
    pub trait Sealed {}
    impl<T, const NX: usize> Sealed for super::Cross<T, NX> {}
    impl Sealed for super::NoCross {}
}

impl<T: Real, const NX: usize> Coupling<T, NX> for Cross<T, NX> {
    const ZERO: Self = Self(SMatrix::from_array_storage(nalgebra::ArrayStorage([[T::ZERO; NX]; NX])));
    #[inline(always)]
    fn block(&self) -> Option<&SMatrix<T, NX, NX>> {
        Some(&self.0)
    }
    #[inline(always)]
    fn block_mut(&mut self) -> Option<&mut SMatrix<T, NX, NX>> {
        Some(&mut self.0)
    }
}

impl<T: Real, const NX: usize> Coupling<T, NX> for NoCross {
    const ZERO: Self = Self;
    #[inline(always)]
    fn block(&self) -> Option<&SMatrix<T, NX, NX>> {
        None
    }
    #[inline(always)]
    fn block_mut(&mut self) -> Option<&mut SMatrix<T, NX, NX>> {
        None
    }
}

/// A Gaussian density of two `NX`-states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledGaussian<T, const NX: usize, C> {
    /// x_r, P_r
    pub targets: [Gaussian<T, NX>; 2],
    /// C
    pub cross: C,
}

/// Two predicted measurements.
#[derive(Clone, Copy, Debug)]
pub struct CoupledInnovation<T, const NX: usize, const NZ: usize> {
    /// ẑ_r
    pub z_hat: [SVector<T, NZ>; 2],
    /// G by its blocks: of state r with measurement s
    pub gain: [[SMatrix<T, NX, NZ>; 2]; 2],
    /// Σ
    pub spread: Blocks<T, NZ>,
    /// R at either target, see [`CoupledGaussian::innovation`]
    pub noise: [Symmetric<T, NZ>; 2],
    /// N(·; 0, Σ_rr + R)
    pub density: [ResidualDensity<T, NZ>; 2],
}

impl<T: Real, const NX: usize, C: Coupling<T, NX>> CoupledGaussian<T, NX, C> {
    /// All zero bits.
    pub const ZERO: Self = Self { targets: [Gaussian::ZERO; 2], cross: C::ZERO };

    /// Two targets that have nothing in common.
    #[must_use]
    pub const fn new(targets: [Gaussian<T, NX>; 2]) -> Self {
        Self { targets, cross: C::ZERO }
    }

    /// Predicts both targets over `dt` \[s\], target r by the model `modes[r]` of `set`, whose `steps` over that time are given.
    #[inline(always)]
    pub fn predict<M: ModeSet<T, NX, MODES>, const MODES: usize>(&mut self, set: &M, modes: [usize; 2], steps: &M::Steps, dt: T) {
        let Self { targets, cross } = self;
        if let Some(c) = cross.block_mut() {
            set.propagate(modes[0], &targets[0].mean, c, dt);
            let mut rows = c.transpose();
            set.propagate(modes[1], &targets[1].mean, &mut rows, dt);
            *c = rows.transpose();
        }
        for (target, mode) in targets.iter_mut().zip(modes) {
            set.advance(mode, target, steps);
        }
    }

    /// The predicted measurements of both.
    ///
    /// Corrections subtract, so that noise far below what it corrects would leave nothing definite: a variance of it counts as at least
    /// 2¹³ ε of that of the predicted measurement (10⁻³ in single precision). What such a scan leaves, the next one takes.
    #[inline(always)]
    #[must_use]
    pub fn innovation<M: MeasurementModel<T, NX, NZ>, const NZ: usize>(&self, model: &M) -> CoupledInnovation<T, NX, NZ> {
        let seen = self.targets.each_ref().map(|target| model.innovation(target));
        let measured = |r: usize| {
            let noise = model.noise(&self.targets[r].mean);
            if !seen[r].sharp {
                return (noise, seen[r].density);
            }
            let noise = blunted(&noise, &seen[r].spread);
            (noise, ResidualDensity::new(&seen[r].spread.plus(&noise)))
        };
        let ((first, first_density), (second, second_density)) = (measured(0), measured(1));
        let mut out = CoupledInnovation {
            z_hat: seen.each_ref().map(|seen| seen.z_hat),
            gain: [[seen[0].cross, SMatrix::zeros()], [SMatrix::zeros(), seen[1].cross]],
            spread: Blocks::diagonal(seen.each_ref().map(|seen| seen.spread)),
            noise: [first, second],
            density: [first_density, second_density],
        };
        if let Some(c) = self.cross.block() {
            let jacobians = self.targets.each_ref().map(|target| model.jacobian(&target.mean));
            for k in 0..NZ {
                for i in 0..NX {
                    let (first, second) = (jacobians[0].data.0[i][k], jacobians[1].data.0[i][k]);
                    // A measurement depends on few of the states.
                    if first == T::ZERO && second == T::ZERO {
                        continue;
                    }
                    for j in 0..NX {
                        out.gain[0][1].data.0[k][j] += c.data.0[i][j] * second;
                        out.gain[1][0].data.0[k][j] += c.data.0[j][i] * first;
                    }
                }
            }
            for k in 0..NZ {
                for l in 0..NZ {
                    for i in 0..NX {
                        out.spread.cross[k][l] += jacobians[0].data.0[i][k] * out.gain[0][1].data.0[l][i];
                    }
                }
            }
            // What an innovation drops as ambiguous tells nothing of the other target either.
            for (r, seen) in seen.iter().enumerate() {
                for k in (0..NZ).filter(|k| seen.cross.data.0[*k].iter().all(|v| *v == T::ZERO)) {
                    out.gain[1 - r][r].data.0[k] = [T::ZERO; NX];
                    for l in 0..NZ {
                        let entry = if r == 0 { &mut out.spread.cross[k][l] } else { &mut out.spread.cross[l][k] };
                        *entry = T::ZERO;
                    }
                }
            }
        }
        out
    }

    /// x ← x + G w, P ← P − G E G'. Where a variance would be negative or something not finite, nothing changes and the answer is
    /// `false`.
    ///
    /// Cost: about 4 NX·NZ² + 2 NX²·NZ multiply-adds, 8 NX·NZ² + 8 NX²·NZ where the covariance between the targets is kept.
    #[inline(always)]
    #[must_use]
    pub fn correct<const NZ: usize>(&mut self, innovation: &CoupledInnovation<T, NX, NZ>, w: &Pair<T, NZ>, e: &Blocks<T, NZ>) -> bool {
        let coupled = self.cross.block().is_some();
        // The rows of G, and of G E; what is not kept is not computed.
        let row = |r: usize, i: usize| -> Pair<T, NZ> { innovation.gain[r].each_ref().map(|g| core::array::from_fn(|k| g.data.0[k][i])) };
        let product = |a: &Pair<T, NZ>, b: &Pair<T, NZ>, r: usize| if coupled { blocks::dot(a, b) } else { dot(&a[r], &b[r]) };
        let weighed = |r: usize, i: usize| {
            let row = row(r, i);
            if coupled { e.times(&row) } else { row.map(|v| e.own[r].times(&v)) }
        };
        let ge: [[Pair<T, NZ>; NX]; 2] = core::array::from_fn(|r| core::array::from_fn(|i| weighed(r, i)));
        let moved: [[T; NX]; 2] = core::array::from_fn(|r| core::array::from_fn(|i| product(&row(r, i), w, r)));
        let variance: [[T; NX]; 2] =
            core::array::from_fn(|r| core::array::from_fn(|i| self.targets[r].cov.upper()[i][i] - product(&ge[r][i], &row(r, i), r)));
        // Zero while all is well, positive or NaN otherwise.
        let flaw = variance.iter().flatten().fold(T::ZERO, |flaw, v| flaw + (v.abs() - *v));
        let sum = moved.iter().flatten().fold(T::ZERO, |sum, v| sum + *v);
        if !is_plus_zero(flaw + sum * T::ZERO) {
            return false;
        }
        for r in 0..2 {
            let Gaussian { mean, cov } = &mut self.targets[r];
            for i in 0..NX {
                mean.data.0[0][i] += moved[r][i];
                cov.upper_mut()[i][i] = variance[r][i];
                for j in i + 1..NX {
                    cov.upper_mut()[i][j] -= product(&ge[r][i], &row(r, j), r);
                }
            }
        }
        if let Some(c) = self.cross.block_mut() {
            for j in 0..NX {
                let row = row(1, j);
                for i in 0..NX {
                    c.data.0[j][i] -= product(&ge[0][i], &row, 0);
                }
            }
        }
        true
    }
}
