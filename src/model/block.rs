//! Linear motion in equal blocks of states: the kernel under every linear model.
//!
//! A state of A blocks of S states each (an axis with position and velocity, or a horizontal plane that turns), all
//! moving by the same S × S transition f. With P_ab the block of the covariance between blocks a and b,
//!
//! ```text
//! x_a ← f x_a        P_ab ← f P_ab f' + δ_ab q
//! ```
//!
//! f is straight-line code that propagates a vector in place, first the columns of a block of P, then its rows; no
//! matrix is formed and no structural zero multiplied. A diagonal block is computed whole and stored as a triangle,
//! so the compiler drops what only the lower half would need: constant velocity in two axes costs 28 operations,
//! constant acceleration 108.

use crate::gaussian::Gaussian;
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// The motion of one block of S states over one step.
pub trait BlockStep<T: Real, const S: usize> {
    /// v ← f v
    fn propagate(&self, v: &mut [T; S]);
    /// q
    fn noise(&self) -> Symmetric<T, S>;
}

/// Predicts mean and covariance of the first `A` blocks of `S` states.
#[inline(always)]
pub fn predict<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B, g: &mut Gaussian<T, NX>) {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let x = &mut g.mean.data.0[0];
    for a in 0..A {
        let mut v: [T; S] = core::array::from_fn(|i| x[a * S + i]);
        step.propagate(&mut v);
        x[a * S..][..S].copy_from_slice(&v);
    }
    predict_covariance::<T, B, NX, A, S>(step, &mut g.cov);
}

/// Predicts the covariance alone, where the mean moves by other equations.
#[inline(always)]
pub fn predict_covariance<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(
    step: &B,
    cov: &mut Symmetric<T, NX>,
) {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let q = step.noise();
    let p = cov.upper_mut();
    for a in 0..A {
        for b in a..A {
            let mut columns = [[T::ZERO; S]; S];
            for j in 0..S {
                for i in 0..S {
                    columns[j][i] = if a == b && i > j { p[a * S + j][b * S + i] } else { p[a * S + i][b * S + j] };
                }
            }
            for column in &mut columns {
                step.propagate(column);
            }
            for i in 0..S {
                let mut row = [T::ZERO; S];
                for j in 0..S {
                    row[j] = columns[j][i];
                }
                step.propagate(&mut row);
                for j in 0..S {
                    if a != b {
                        p[a * S + i][b * S + j] = row[j];
                    } else if i <= j {
                        p[a * S + i][b * S + j] = row[j] + q.upper()[i][j];
                    }
                }
            }
        }
    }
}

/// F, block diagonal, one beyond the blocks: the plain form of a block-wise model.
pub fn jacobian<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B) -> SMatrix<T, NX, NX> {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let mut f = SMatrix::<T, NX, NX>::identity();
    for j in 0..S {
        let mut column = [T::ZERO; S];
        column[j] = T::ONE;
        step.propagate(&mut column);
        for a in 0..A {
            for i in 0..S {
                f.data.0[a * S + j][a * S + i] = column[i];
            }
        }
    }
    f
}

/// f(x), as F x.
pub fn transition<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(
    step: &B,
    x: &SVector<T, NX>,
) -> SVector<T, NX> {
    jacobian::<T, B, NX, A, S>(step) * x
}

/// Q, block diagonal.
pub fn process_noise<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B) -> Symmetric<T, NX> {
    let q = step.noise();
    Symmetric::from_fn(|i, j| if i < A * S && i / S == j / S { q.at(i % S, j % S) } else { T::ZERO })
}
