//! Mixing and combination of modes, written out: `mixing.rs` derives the equations.
//!
//! ```text
//! mix       P⁰_j = P_1 + Σ_i μ_i|j N_i − d̄_j d̄_j',   N_i = P_i − P_1 + d_i d_i'     N_i once for all j
//! combine   P = P_1 + Σ_i μ_i (P_i − P_1) + p_i (d_i − d̄)'                          p_i and d_i − d̄ once for all rows
//! ```

use super::deviations;
use crate::gaussian::Gaussian;
use crate::scalar::Real;

/// Of three modes or more.
#[inline(always)]
pub fn mix<T: Real, const NX: usize, const MODES: usize>(modes: &mut [Gaussian<T, NX>; MODES], weight: &[[T; MODES]; MODES]) {
    let d = deviations(modes);
    let mut bar = [[T::ZERO; NX]; MODES];
    for k in 0..NX {
        let first = modes[0].mean.data.0[0][k];
        for j in 0..MODES {
            bar[j][k] = weight[j][1] * d[1][k];
            for i in 2..MODES {
                bar[j][k] += weight[j][i] * d[i][k];
            }
            modes[j].mean.data.0[0][k] = first + bar[j][k];
        }
    }
    for a in 0..NX {
        for b in a..NX {
            let first = modes[0].cov.upper()[a][b];
            // In stages, so that no result is used at once: the pipeline of a small core would wait.
            let (mut n, mut v, mut wn) = ([T::ZERO; MODES], [T::ZERO; MODES], [T::ZERO; MODES]);
            for i in 1..MODES {
                v[i] = d[i][a] * d[i][b];
            }
            for i in 1..MODES {
                n[i] = modes[i].cov.upper()[a][b] - first;
            }
            for i in 1..MODES {
                n[i] += v[i];
            }
            for j in 0..MODES {
                v[j] = bar[j][a] * bar[j][b];
            }
            for j in 0..MODES {
                v[j] = first - v[j];
            }
            for i in 1..MODES {
                for j in 0..MODES {
                    wn[j] = weight[j][i] * n[i];
                }
                for j in 0..MODES {
                    v[j] += wn[j];
                }
            }
            for j in 0..MODES {
                modes[j].cov.upper_mut()[a][b] = v[j];
            }
        }
    }
}

/// Of more than one mode.
#[inline(always)]
pub fn combine<T: Real, const NX: usize, const MODES: usize>(
    modes: &[Gaussian<T, NX>; MODES],
    prob: &[T; MODES],
    out: &mut Gaussian<T, NX>,
) {
    let mut apart = deviations(modes);
    let mut weighed = apart;
    for i in 1..MODES {
        for k in 0..NX {
            weighed[i][k] *= prob[i];
        }
    }
    let mut bar = weighed[MODES - 1];
    for k in 0..NX {
        for i in 1..MODES {
            bar[k] = if i == 1 { weighed[i][k] } else { bar[k] + weighed[i][k] };
        }
        out.mean.data.0[0][k] = modes[0].mean.data.0[0][k] + bar[k];
        for i in 1..MODES {
            apart[i][k] -= bar[k];
        }
    }
    let terms = Terms { modes, prob, weighed, apart };
    // The upper half of the rows whole, the lower half from the middle on. Rows of one length are one piece of code without
    // inner loop; what they have below the diagonal means nothing.
    let half = NX / 2;
    rolled!(for a in 0..half {
        terms.combine_row(a, 0, &mut out.cov.upper_mut()[a]);
    });
    rolled!(for a in half..NX {
        terms.combine_row(a, half, &mut out.cov.upper_mut()[a]);
    });
}

/// What a combined covariance is made of.
struct Terms<'a, T, const NX: usize, const MODES: usize> {
    modes: &'a [Gaussian<T, NX>; MODES],
    prob: &'a [T; MODES],
    /// p_i
    weighed: [[T; NX]; MODES],
    /// d_i − d̄
    apart: [[T; NX]; MODES],
}

impl<T: Real, const NX: usize, const MODES: usize> Terms<'_, T, NX, MODES> {
    /// The entries (a, b), b from `from` on.
    #[inline(always)]
    fn combine_row(&self, a: usize, from: usize, out: &mut [T; NX]) {
        let first = self.modes[0].cov.upper()[a];
        let (mut sum, mut n, mut product) = (first, [T::ZERO; NX], [T::ZERO; NX]);
        // All products, then all sums: no result is used at once.
        for i in 1..MODES {
            for b in from..NX {
                product[b] = self.weighed[i][a] * self.apart[i][b];
            }
            for b in from..NX {
                n[b] = self.modes[i].cov.upper()[a][b] - first[b];
            }
            for b in from..NX {
                sum[b] += product[b];
            }
            for b in from..NX {
                n[b] *= self.prob[i];
            }
            for b in from..NX {
                sum[b] += n[b];
            }
        }
        #[expect(clippy::manual_memcpy, reason = "copied as slices, the row would need a check of its bounds")]
        for b in from..NX {
            out[b] = sum[b];
        }
    }
}
