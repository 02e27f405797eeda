//! The inverse of a covariance that may be singular, on the entries that it does know.
//!
//! ```text
//! M = L D L',   M⁻ = L⁻ᵀ D⁺ L⁻¹,   d_j⁺ = 1 / d_j,  or 0 where d_j is zero but for rounding
//! ```
//!
//! M⁻ is a generalised inverse, M M⁻ M = M. Its rows and columns of zero pivots are zero: what M knows exactly, or what other
//! entries determine, is ignored. The constant-velocity mode of a bank has accelerations of zero variance, so sums of two
//! covariances are singular as a matter of course. A (A + B)⁻ B is the same for every generalised inverse (Anderson and
//! Duffin, *J. Math. Anal. Appl.* 26(3), 1969, parallel sums), and that is all the fusion rules ask of it.

use crate::scalar::Real;
use crate::symmetric::Symmetric;

/// M⁻ of the rows and columns that `keep` names, and its rank; zero elsewhere. `None` where a pivot is negative or no number.
///
/// Cost: about N³ / 3 multiply-adds and N divisions.
pub(super) fn generalised_inverse<T: Real, const N: usize>(
    m: &Symmetric<T, N>,
    keep: impl Fn(usize) -> bool,
) -> Option<(Symmetric<T, N>, usize)> {
    let slack = T::EPSILON * T::from_count(4 * N);
    let (mut l, mut d, mut inverse) = ([[T::ZERO; N]; N], [T::ZERO; N], [T::ZERO; N]);
    let mut rank = 0;
    for j in (0..N).filter(|j| keep(*j)) {
        let mut pivot = m.at(j, j);
        for k in 0..j {
            pivot -= l[j][k] * l[j][k] * d[k];
        }
        let noise = m.at(j, j) * slack;
        if pivot > noise {
            (d[j], inverse[j]) = (pivot, T::ONE / pivot);
            rank += 1;
            for i in j + 1..N {
                let mut v = m.at(i, j);
                for k in 0..j {
                    v -= l[i][k] * l[j][k] * d[k];
                }
                l[i][j] = v * inverse[j];
            }
        } else if pivot >= -noise {
            // A zero column of L: no later row depends on this entry.
        } else {
            return None;
        }
    }
    // L⁻¹ by forward substitution, in place below the unit diagonal.
    for i in 0..N {
        for j in 0..i {
            let mut v = -l[i][j];
            for k in j + 1..i {
                v -= l[i][k] * l[k][j];
            }
            l[i][j] = v;
        }
        l[i][i] = T::ONE;
    }
    let matrix = Symmetric::from_fn(|i, j| (j..N).fold(T::ZERO, |sum, k| sum + l[k][i] * l[k][j] * inverse[k]));
    matrix.is_finite().then_some((matrix, rank))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    proptest! {
        /// Rank two to four of four, by a factor with rows of zeros and of multiples.
        #[test]
        fn what_is_known_is_inverted_and_the_rest_is_zero(entries in prop::collection::vec(-3.0..3.0f64, 16), rank in 2usize..=4) {
            let factor = SMatrix::<f64, 4, 4>::from_fn(|i, j| match i {
                0 | 3 => entries[4 * i + j] + if i == j { 4.0 } else { 0.0 },
                _ if i < rank => entries[4 * i + j] + if i == j { 4.0 } else { 0.0 },
                1 => 0.0,
                _ => 2.0 * entries[j] + if j == 0 { 8.0 } else { 0.0 },
            });
            let m = factor * factor.transpose();
            let (inverse, found) = generalised_inverse(&Symmetric::from_matrix(&m), |_| true).ok_or_else(|| TestCaseError::fail("refused"))?;
            let again = m * inverse.to_matrix() * m;
            prop_assert!((again - m).abs().max() < 1e-7 * m.abs().max(), "{again} for {m}");
            prop_assert_eq!(found, if rank < 4 { factor.rank(1e-9) } else { 4 });
        }
    }

    #[test]
    fn entries_left_out_do_not_matter() {
        let m = Symmetric::<f64, 3>::from_fn(|i, j| [[4.0, 7.0, 2.0], [7.0, f64::NAN, 9.0], [2.0, 9.0, 3.0]][i][j]);
        let got = generalised_inverse(&m, |i| i != 1);
        let want = Symmetric::from_fn(|i, j| [[0.375, 0.0, -0.25], [0.0, 0.0, 0.0], [-0.25, 0.0, 0.5]][i][j]);
        assert_eq!(got, Some((want, 2)));
    }

    /// A correlation of 1 − 1e-4, a hundred times what rounding leaves of a pivot: well known, by hand.
    #[test]
    fn what_is_nearly_determined_is_inverted_too() {
        let m = Symmetric::<f32, 2>::from_fn(|i, j| if i == j { 1.0 } else { 0.9999 });
        let got = generalised_inverse(&m, |_| true).map(|(inverse, rank)| (inverse.at(0, 0), rank));
        assert!(got.is_some_and(|(entry, rank)| rank == 2 && (entry / 5000.25 - 1.0).abs() < 1e-3), "{got:?}");
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let indefinite = Symmetric::<f32, 2>::from_fn(|i, j| if i == j { 1.0 } else { 2.0 });
        assert_eq!(generalised_inverse(&indefinite, |_| true), None);
        assert_eq!(generalised_inverse(&Symmetric::from_diagonal([1.0, f32::NAN]), |_| true), None);
        assert_eq!(generalised_inverse(&Symmetric::from_diagonal([1.0, -1.0f32]), |_| true), None);
    }
}
