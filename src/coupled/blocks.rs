//! Vectors and symmetric matrices over the measurements of two targets, by blocks of one measurement each.
//!
//! ```text
//! M = [X Y; Y' Z]    Z ← (Z − Y' X⁻¹ Y)⁻¹,   Y ← −X⁻¹ Y Z,   X ← X⁻¹ − Y (X⁻¹ Y)',   det M = det X · det (Z − Y' X⁻¹ Y)
//! ```
//!
//! Inverted through the Schur complement, with the closed forms that serve single measurements.

use crate::scalar::Real;
use crate::symmetric::Symmetric;

/// One vector for each target.
pub type Pair<T, const NZ: usize> = [[T; NZ]; 2];

/// A symmetric matrix over two vectors of `NZ` entries.
#[derive(Clone, Copy, Debug)]
pub struct Blocks<T, const NZ: usize> {
    /// The diagonal blocks X and Z
    pub own: [Symmetric<T, NZ>; 2],
    /// Y: entry \[k\]\[l\] is between entry k of the first vector and l of the second
    pub cross: [[T; NZ]; NZ],
}

impl<T: Real, const NZ: usize> Blocks<T, NZ> {
    /// All entries zero.
    #[must_use]
    pub const fn zeros() -> Self {
        Self { own: [Symmetric::zeros(); 2], cross: [[T::ZERO; NZ]; NZ] }
    }

    /// Block diagonal.
    #[inline(always)]
    #[must_use]
    pub fn diagonal(own: [Symmetric<T, NZ>; 2]) -> Self {
        Self { own, cross: [[T::ZERO; NZ]; NZ] }
    }

    /// M v
    #[inline(always)]
    #[must_use]
    pub fn times(&self, [a, b]: &Pair<T, NZ>) -> Pair<T, NZ> {
        let ([mut x, mut z], y) = ([self.own[0].times(a), self.own[1].times(b)], &self.cross);
        for k in 0..NZ {
            for l in 0..NZ {
                x[k] += y[k][l] * b[l];
                z[l] += y[k][l] * a[k];
            }
        }
        [x, z]
    }

    /// Sum of two matrices, the second times `factor`.
    #[inline(always)]
    pub fn add(&mut self, factor: T, other: &Self) {
        for r in 0..2 {
            for k in 0..NZ {
                for l in k..NZ {
                    self.own[r].upper_mut()[k][l] += factor * other.own[r].upper()[k][l];
                }
            }
        }
        for k in 0..NZ {
            for l in 0..NZ {
                self.cross[k][l] += factor * other.cross[k][l];
            }
        }
    }

    /// M + `factor` v v'
    #[inline(always)]
    pub fn add_square(&mut self, factor: T, v: &Pair<T, NZ>) {
        let scaled = v.map(|v| v.map(|v| factor * v));
        for r in 0..2 {
            for k in 0..NZ {
                for l in k..NZ {
                    self.own[r].upper_mut()[k][l] += scaled[r][k] * v[r][l];
                }
            }
        }
        for k in 0..NZ {
            for l in 0..NZ {
                self.cross[k][l] += scaled[0][k] * v[1][l];
            }
        }
    }

    /// A M A' for A = [a b; c d], each times the identity: of combinations of the two vectors.
    #[inline(always)]
    #[must_use]
    pub fn combined(&self, [[a, b], [c, d]]: [[T; 2]; 2]) -> Self {
        let ([x, z], y) = (&self.own, &self.cross);
        let entry =
            |a: T, b: T, c: T, d: T, k: usize, l: usize| a * c * x.at(k, l) + a * d * y[k][l] + b * c * y[l][k] + b * d * z.at(k, l);
        Self {
            own: [Symmetric::from_fn(|k, l| entry(a, b, a, b, k, l)), Symmetric::from_fn(|k, l| entry(c, d, c, d, k, l))],
            cross: core::array::from_fn(|k| core::array::from_fn(|l| entry(a, b, c, d, k, l))),
        }
    }

    /// M⁻¹ and 1 / √det M; the root is zero where M is not positive definite.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> (Self, T) {
        let first = self.own[0].inverse();
        // X⁻¹ Y by its columns.
        let columns: [[T; NZ]; NZ] = core::array::from_fn(|l| first.matrix.times(&core::array::from_fn(|k| self.cross[k][l])));
        let complement = Symmetric::from_fn(|k, l| {
            let mut rest = self.own[1].upper()[k][l];
            for m in 0..NZ {
                rest -= self.cross[m][k] * columns[l][m];
            }
            rest
        });
        let second = complement.inverse();
        let mut cross = [[T::ZERO; NZ]; NZ];
        for k in 0..NZ {
            for l in 0..NZ {
                for m in 0..NZ {
                    cross[k][l] -= columns[m][k] * second.matrix.at(m, l);
                }
            }
        }
        let own = Symmetric::from_fn(|k, l| {
            let mut sum = first.matrix.upper()[k][l];
            for m in 0..NZ {
                sum -= cross[k][m] * columns[m][l];
            }
            sum
        });
        (Self { own: [own, second.matrix], cross }, first.root * second.root)
    }
}

/// u' v
#[inline(always)]
pub(super) fn dot<T: Real, const NZ: usize>(u: &Pair<T, NZ>, v: &Pair<T, NZ>) -> T {
    crate::gaussian::dot(&u[0], &v[0]) + crate::gaussian::dot(&u[1], &v[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    fn dense(m: &Blocks<f64, 2>) -> SMatrix<f64, 4, 4> {
        SMatrix::from_fn(|i, j| match (i / 2, j / 2) {
            (0, 0) => m.own[0].at(i, j),
            (1, 1) => m.own[1].at(i - 2, j - 2),
            (0, _) => m.cross[i][j - 2],
            _ => m.cross[j][i - 2],
        })
    }

    fn blocks(m: &SMatrix<f64, 4, 4>) -> Blocks<f64, 2> {
        Blocks {
            own: [Symmetric::from_fn(|k, l| m[(k, l)]), Symmetric::from_fn(|k, l| m[(k + 2, l + 2)])],
            cross: core::array::from_fn(|k| core::array::from_fn(|l| m[(k, l + 2)])),
        }
    }

    proptest! {
        #[test]
        fn blocks_are_a_matrix(entries in prop::collection::vec(-3.0..3.0f64, 16), v in prop::array::uniform4(-3.0..3.0f64), mix in prop::array::uniform4(-2.0..2.0f64)) {
            let root = SMatrix::<f64, 4, 4>::from_fn(|i, j| entries[4 * i + j]);
            let m = root * root.transpose() + SMatrix::identity() * 0.1;
            let b = blocks(&m);
            let product = m * nalgebra::SVector::from(v);
            let pair = b.times(&[[v[0], v[1]], [v[2], v[3]]]);
            prop_assert!((0..4).all(|i| (product[i] - pair[i / 2][i % 2]).abs() < 1e-9));
            let (inverse, peak) = b.inverse();
            prop_assert!((m * dense(&inverse) - SMatrix::identity()).abs().max() < 1e-7);
            prop_assert!((peak * peak * m.determinant() - 1.0).abs() < 1e-7);
            let a = SMatrix::<f64, 4, 4>::from_fn(|i, j| if i % 2 == j % 2 { mix[2 * (i / 2) + j / 2] } else { 0.0 });
            let combined = b.combined([[mix[0], mix[1]], [mix[2], mix[3]]]);
            prop_assert!((a * m * a.transpose() - dense(&combined)).abs().max() < 1e-9);
        }
    }

    #[test]
    fn indefinite_blocks_have_no_root() {
        let one = Symmetric::<f32, 1>::from_diagonal([1.0]);
        assert_eq!(Blocks { own: [one; 2], cross: [[1.5]] }.inverse().1, 0.0);
    }
}
