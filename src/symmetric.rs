//! Symmetric matrices: covariances that cannot become asymmetric.
//!
//! A full square array of which only the entries (i, j) with i ≤ j mean anything. That costs the memory of the
//! lower triangle, and buys straight-line kernels without index arithmetic and without unstable const expressions.
//!
//! ```text
//! inverse    N ≤ 3: adjugate over determinant;  else Gauss-Jordan elimination in place, one sweep per pivot (Goodnight 1979)
//! factor     P = L L' (Cholesky), a zero pivot gives a zero column: P may be semi-definite
//! ```

use crate::scalar::{Real, is_finite, is_invertible, sqrt};
use nalgebra::SMatrix;

/// A symmetric N × N matrix.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Symmetric<T, const N: usize> {
    upper: [[T; N]; N],
}

/// S⁻¹, det S and the root of det S⁻¹; all zero where S is not positive definite.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inverse<T, const N: usize> {
    /// S⁻¹
    pub matrix: Symmetric<T, N>,
    /// det S
    pub det: T,
    /// 1 / √det S
    pub root: T,
}

impl<T: Real, const N: usize> Symmetric<T, N> {
    /// All entries zero.
    #[must_use]
    pub const fn zeros() -> Self {
        Self { upper: [[T::ZERO; N]; N] }
    }

    /// Entry (i, j) = `entry(i, j)`, called for i ≤ j only.
    #[inline(always)]
    #[must_use]
    pub fn from_fn(mut entry: impl FnMut(usize, usize) -> T) -> Self {
        let mut s = Self::zeros();
        if N <= 3 {
            each!(i in N {
                each!(j in N {
                    if i <= j {
                        s.upper[i][j] = entry(i, j);
                    }
                });
            });
        } else {
            for i in 0..N {
                for j in i..N {
                    s.upper[i][j] = entry(i, j);
                }
            }
        }
        s
    }

    /// The diagonal matrix of `diagonal`, for example of variances.
    #[inline(always)]
    #[must_use]
    pub fn from_diagonal(diagonal: [T; N]) -> Self {
        Self::from_fn(|i, j| if i == j { diagonal[i] } else { T::ZERO })
    }

    /// The upper triangle of `m`; what stands below is not read.
    #[must_use]
    pub fn from_matrix(m: &SMatrix<T, N, N>) -> Self {
        Self::from_fn(|i, j| m.data.0[j][i])
    }

    /// Both triangles.
    #[must_use]
    pub fn to_matrix(&self) -> SMatrix<T, N, N> {
        SMatrix::from_fn(|i, j| self.at(i, j))
    }

    /// Entry (i, j) or (j, i), `None` outside the matrix.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> Option<T> {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        self.upper.get(i)?.get(j).copied()
    }

    /// The rows, of which only the entries (i, j) with i ≤ j mean anything. For kernels.
    #[inline(always)]
    #[must_use]
    pub fn upper(&self) -> &[[T; N]; N] {
        &self.upper
    }

    /// As [`upper`](Self::upper), to be written.
    #[inline(always)]
    pub fn upper_mut(&mut self) -> &mut [[T; N]; N] {
        &mut self.upper
    }

    /// Entry (i, j) of either triangle, for indices that loops over 0..N make.
    #[inline(always)]
    pub(crate) fn at(&self, i: usize, j: usize) -> T {
        if i <= j { self.upper[i][j] } else { self.upper[j][i] }
    }

    /// Row or column `i`, for an index below N.
    #[inline(always)]
    pub(crate) fn line(&self, i: usize) -> [T; N] {
        let mut line = self.upper[i];
        for k in 0..i {
            line[k] = self.upper[k][i];
        }
        line
    }

    /// Column `j`, for an index that is known when the compiler first sees it, times `factor`.
    #[inline(always)]
    pub(crate) fn column(&self, j: usize, factor: T) -> [T; N] {
        let mut column = [T::ZERO; N];
        unrolled!(for i in N {
            column[i] = self.at(i, j) * factor;
        });
        column
    }

    /// Sum of two matrices.
    #[inline(always)]
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self::from_fn(|i, j| self.upper[i][j] + other.upper[i][j])
    }

    /// S v
    #[inline(always)]
    #[must_use]
    pub fn times(&self, v: &[T; N]) -> [T; N] {
        // Column by column: no product is used at once, which the pipeline of a small core would wait for.
        let (mut sum, mut column) = ([T::ZERO; N], [T::ZERO; N]);
        each!(j in N {
            each!(i in N {
                column[i] = self.at(i, j) * v[j];
            });
            each!(i in N {
                sum[i] = if j == 0 { column[i] } else { sum[i] + column[i] };
            });
        });
        sum
    }

    /// Whether every entry, and their sum, is finite.
    #[inline(always)]
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let mut sum = T::ZERO;
        for i in 0..N {
            for j in i..N {
                sum += self.upper[i][j];
            }
        }
        is_finite(sum)
    }

    /// Whether every entry is finite and no variance is negative: what every covariance must satisfy, and cheap.
    #[inline]
    #[must_use]
    pub fn has_valid_variances(&self) -> bool {
        self.has_no_negative_variance() && self.is_finite()
    }

    /// Whether all variances are finite and none is negative: one comparison, for kernels.
    #[inline(always)]
    pub(crate) fn has_no_negative_variance(&self) -> bool {
        let mut flaw = T::ZERO;
        for i in 0..N {
            // Zero for a finite variance, positive for a negative one, NaN for the rest.
            flaw += self.upper[i][i].abs() - self.upper[i][i];
        }
        flaw == T::ZERO
    }

    /// Whether the matrix is positive definite.
    #[must_use]
    pub fn is_definite(&self) -> bool {
        self.inverse().root > T::ZERO
    }

    /// S⁻¹, det S and 1 / √det S; all zero where S is not positive definite, or its determinant beyond the precision. Where S is not
    /// finite the root is zero, and the matrix no number.
    ///
    /// The closed forms up to N = 3 do not mind mixed units: scaling a row and its column scales every product alike.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> Inverse<T, N> {
        let s = &self.upper;
        if N == 1 {
            let (det, scale, root) = reciprocals(true, s[0][0]);
            Inverse { matrix: Self::from_fn(|_, _| scale), det, root }
        } else if N == 2 {
            let (a, b, c) = (s[0][0], s[0][1], s[1][1]);
            let (det, scale, root) = reciprocals(a > T::ZERO, a * c - b * b);
            let adjugate = [[c, -b], [T::ZERO, a]];
            Inverse { matrix: Self::from_fn(|i, j| adjugate[i][j] * scale), det, root }
        } else if N == 3 {
            let (a, b, c, d, e, f) = (s[0][0], s[0][1], s[0][2], s[1][1], s[1][2], s[2][2]);
            let (c00, c01, c02) = (d * f - e * e, c * e - b * f, b * e - c * d);
            let (c11, c12, c22) = (a * f - c * c, b * c - a * e, a * d - b * b);
            let (det, scale, root) = reciprocals(a > T::ZERO && c22 > T::ZERO, a * c00 + b * c01 + c * c02);
            let adjugate = [[c00, c01, c02], [T::ZERO, c11, c12], [T::ZERO, T::ZERO, c22]];
            Inverse { matrix: Self::from_fn(|i, j| adjugate[i][j] * scale), det, root }
        } else {
            self.inverse_by_sweeps().unwrap_or(Inverse { matrix: Self::zeros(), det: T::ZERO, root: T::ZERO })
        }
    }

    /// The general case by N sweeps, of the pivot k: a_ij ← a_ij − a_ik a_jk / a_kk, a_ik ← a_ik / a_kk, a_kk ← −1 / a_kk.
    /// They turn S into −S⁻¹, and their pivots are those of S = L D L'.
    fn inverse_by_sweeps(&self) -> Option<Inverse<T, N>> {
        let mut a = self.upper;
        let (mut det, mut root) = (T::ONE, T::ONE);
        unrolled!(for k in N {
            let (pivot, scale, inverse_root) = reciprocals(true, a[k][k]);
            if scale == T::ZERO {
                return None;
            }
            det *= pivot;
            root *= inverse_root;
            let row: [T; N] = core::array::from_fn(|i| if i < k { a[i][k] } else { a[k][i] });
            let scaled = row.map(|v| v * scale);
            for i in 0..N {
                // All products, then all sums: no result is used at once.
                let product = scaled.map(|v| row[i] * v);
                for j in i..N {
                    a[i][j] = if i == k {
                        scaled[j]
                    } else if j == k {
                        scaled[i]
                    } else {
                        a[i][j] - product[j]
                    };
                }
            }
            a[k][k] = -scale;
        });
        let matrix = Self::from_fn(|i, j| -a[i][j]);
        matrix.is_finite().then_some(Inverse { matrix, det, root })
    }

    /// The lower triangular L with S = L L', or `None` where S has a negative pivot or is not finite.
    ///
    /// A pivot that rounding cannot tell from zero gives a zero column, so that singular covariances (a
    /// constant-velocity mode padded with zero accelerations) have a factor too.
    #[must_use]
    pub fn cholesky(&self) -> Option<[[T; N]; N]> {
        if !self.has_valid_variances() {
            return None;
        }
        let (mut rest, mut l) = (self.upper, [[T::ZERO; N]; N]);
        let slack = T::EPSILON * T::from_count(4 * N);
        unrolled!(for j in N {
            let (pivot, noise) = (rest[j][j], self.upper[j][j] * slack);
            if pivot < -noise {
                return None;
            }
            if pivot > noise {
                let root = sqrt(pivot);
                let scale = T::ONE / root;
                l[j][j] = root;
                for i in j + 1..N {
                    l[i][j] = rest[j][i] * scale;
                }
                // What the column leaves of S.
                for i in j + 1..N {
                    for k in i..N {
                        rest[i][k] -= l[i][j] * l[k][j];
                    }
                }
            }
        });
        Some(l)
    }
}

/// x, 1 / x and 1 / √x of a positive number, all of full precision; zeros for others, or where not `definite`.
#[inline(always)]
fn reciprocals<T: Real>(definite: bool, x: T) -> (T, T, T) {
    if !(definite && is_invertible(x)) {
        return (T::ZERO, T::ZERO, T::ZERO);
    }
    let scale = T::ONE / x;
    (x, scale, sqrt(scale))
}

impl<T: PartialEq, const N: usize> PartialEq for Symmetric<T, N> {
    fn eq(&self, other: &Self) -> bool {
        (0..N).all(|i| (i..N).all(|j| self.upper[i][j] == other.upper[i][j]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn definite<const N: usize>(entries: &[f64], ridge: f64) -> Symmetric<f64, N> {
        let a = SMatrix::<f64, N, N>::from_fn(|i, j| entries[i * N + j]);
        Symmetric::from_matrix(&(a * a.transpose() + SMatrix::identity() * ridge))
    }

    fn check<const N: usize>(entries: &[f64]) -> Result<(), TestCaseError> {
        let s = definite::<N>(entries, 0.1);
        let inverse = s.inverse();
        let one = s.to_matrix() * inverse.matrix.to_matrix();
        prop_assert!((one - SMatrix::identity()).abs().max() < 1e-9);
        let factor = s.to_matrix().cholesky().ok_or_else(|| TestCaseError::fail("no factor"))?;
        let root: f64 = (0..N).map(|i| factor.l()[(i, i)]).product();
        prop_assert!((inverse.root * root - 1.0).abs() < 1e-9);
        let l = s.cholesky().ok_or_else(|| TestCaseError::fail("no factor"))?;
        let l = SMatrix::<f64, N, N>::from_fn(|i, j| l[i][j]);
        prop_assert!((l * l.transpose() - s.to_matrix()).abs().max() < 1e-12 * (1.0 + s.to_matrix().abs().max()));
        Ok(())
    }

    proptest! {
        #[test]
        fn inverse_and_factor_reproduce_the_matrix(entries in prop::collection::vec(-3.0..3.0f64, 36)) {
            check::<1>(&entries)?;
            check::<2>(&entries)?;
            check::<3>(&entries)?;
            check::<4>(&entries)?;
            check::<6>(&entries)?;
        }
    }

    #[test]
    fn indefinite_and_broken_matrices_are_refused() {
        fn refused<T: Real, const N: usize>(s: Symmetric<T, N>) -> bool {
            let inverse = s.inverse();
            let nothing = inverse.matrix == Symmetric::zeros() || !s.is_finite();
            nothing && inverse.root == T::ZERO && s.cholesky().is_none()
        }
        assert!(refused(Symmetric::<f64, 2>::from_fn(|i, j| if i == j { 1.0 } else { 2.0 })));
        assert!(refused(Symmetric::<f64, 2>::from_diagonal([-1.0, -1.0])));
        assert!(refused(Symmetric::<f64, 3>::from_diagonal([-1.0, -1.0, 1.0])));
        assert!(refused(Symmetric::<f32, 1>::from_diagonal([f32::INFINITY])));
        assert!(refused(Symmetric::<f32, 2>::from_diagonal([f32::INFINITY, 1.0])));
        assert!(refused(Symmetric::<f32, 3>::from_diagonal([1.0, f32::NAN, 1.0])));
        assert!(refused(Symmetric::<f32, 4>::from_diagonal([1.0, f32::NAN, 1.0, 1.0])));
    }

    #[test]
    fn a_singular_covariance_has_a_factor() {
        let s = Symmetric::<f64, 3>::from_fn(|i, j| [[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 0.0]][i][j]);
        let l = s.cholesky().map(|l| SMatrix::<f64, 3, 3>::from_fn(|i, j| l[i][j]));
        assert_eq!(l.map(|l| l * l.transpose()), Some(s.to_matrix()));
    }
}
