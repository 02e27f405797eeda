//! Linear motion in equal blocks of states: the kernel under every linear model.
//!
//! A state of A blocks of S states each (an axis with position and velocity, or a horizontal plane that turns), all
//! moving by the same S × S transition f. With P_ab the block of the covariance between blocks a and b,
//!
//! ```text
//! x_a ← f x_a        P_ab ← f P_ab f' + δ_ab q
//! ```
//!
//! f is straight-line code that propagates vectors in place, all of them side by side: first the columns of a block of P, then
//! its rows; no matrix is formed and no structural zero multiplied. A diagonal block is computed whole and stored as a triangle,
//! so the compiler drops what only the lower half would need: constant velocity in two axes costs 28 operations,
//! constant acceleration 108. Compiled for size, the loop over blocks stays one, and a block is written out all the same: that is
//! shorter than loops over two or three states.

use crate::gaussian::Gaussian;
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// The motion of one block of S states over one step.
pub trait BlockStep<T: Real, const S: usize> {
    /// v ← f v for `L` vectors v side by side: `v[i]` are the entries i of all.
    fn propagate<const L: usize>(&self, v: &mut [[T; L]; S]);
    /// q_ij, i ≤ j
    fn noise(&self, i: usize, j: usize) -> T;
}

/// `factor` v
#[inline(always)]
pub(super) fn scaled<T: Real, const L: usize>(v: &[T; L], factor: T) -> [T; L] {
    let mut product = [T::ZERO; L];
    each!(l in L {
        product[l] = factor * v[l];
    });
    product
}

/// v ← v + w
#[inline(always)]
pub(super) fn add<T: Real, const L: usize>(v: &mut [T; L], w: &[T; L]) {
    each!(l in L {
        v[l] += w[l];
    });
}

/// Predicts mean and covariance of the first `A` blocks of `S` states.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub fn predict<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B, g: &mut Gaussian<T, NX>) {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let x = &mut g.mean.data.0[0];
    let mut v = [[T::ZERO; A]; S];
    each!(i in S {
        each!(a in A {
            v[i][a] = x[a * S + i];
        });
    });
    step.propagate(&mut v);
    each!(i in S {
        each!(a in A {
            x[a * S + i] = v[i][a];
        });
    });
    predict_covariance::<T, B, NX, A, S>(step, &mut g.cov);
}

/// Predicts the covariance alone, where the mean moves by other equations.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub fn predict_covariance<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(
    step: &B,
    cov: &mut Symmetric<T, NX>,
) {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let p = cov.upper_mut();
    for a in 0..A {
        let mut block = [[T::ZERO; S]; S];
        each!(i in S {
            each!(j in S {
                block[i][j] = if i > j { p[a * S + j][a * S + i] } else { p[a * S + i][a * S + j] };
            });
        });
        let block = conjugated(step, block);
        each!(i in S {
            each!(j in S {
                if i <= j {
                    p[a * S + i][a * S + j] = block[j][i] + step.noise(i, j);
                }
            });
        });
        for b in a + 1..A {
            let mut block = [[T::ZERO; S]; S];
            each!(i in S {
                each!(j in S {
                    block[i][j] = p[a * S + i][b * S + j];
                });
            });
            let block = conjugated(step, block);
            each!(i in S {
                each!(j in S {
                    p[a * S + i][b * S + j] = block[j][i];
                });
            });
        }
    }
}

/// (f B f')' of a block B.
#[inline(always)]
fn conjugated<T: Real, B: BlockStep<T, S>, const S: usize>(step: &B, mut block: [[T; S]; S]) -> [[T; S]; S] {
    step.propagate(&mut block);
    let mut turned = [[T::ZERO; S]; S];
    each!(i in S {
        each!(j in S {
            turned[j][i] = block[i][j];
        });
    });
    step.propagate(&mut turned);
    turned
}

/// v ← F v for all columns of `v`, the identity beyond the blocks.
#[inline(always)]
pub fn propagate<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B, v: &mut SMatrix<T, NX, NX>) {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let columns = &mut v.data.0;
    for a in 0..A {
        let mut rows: [[T; NX]; S] = core::array::from_fn(|i| core::array::from_fn(|l| columns[l][a * S + i]));
        step.propagate(&mut rows);
        for i in 0..S {
            for l in 0..NX {
                columns[l][a * S + i] = rows[i][l];
            }
        }
    }
}

/// F, block diagonal, one beyond the blocks: the plain form of a block-wise model.
pub fn jacobian<T: Real, B: BlockStep<T, S>, const NX: usize, const A: usize, const S: usize>(step: &B) -> SMatrix<T, NX, NX> {
    const { assert!(A * S <= NX, "the state is too short for these blocks") }
    let mut block = [[T::ZERO; S]; S];
    for i in 0..S {
        block[i][i] = T::ONE;
    }
    step.propagate(&mut block);
    SMatrix::from_fn(|i, j| {
        if i < A * S && i / S == j / S {
            block[i % S][j % S]
        } else if i == j {
            T::ONE
        } else {
            T::ZERO
        }
    })
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
    Symmetric::from_fn(|i, j| if i < A * S && i / S == j / S { step.noise(i % S, j % S) } else { T::ZERO })
}
