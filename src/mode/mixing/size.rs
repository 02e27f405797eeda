//! Mixing and combination of modes, in loops over rows and entries: `mixing.rs` derives the equations.
//!
//! ```text
//! mix       (P⁰_j)_ab = (P_1)_ab + Σ_i μ_i|j (N_i)_ab − d̄_ja d̄_jb,   (N_i)_ab = (P_i − P_1)_ab + d_ia d_ib
//! combine   P_ab = (P_1)_ab + Σ_i μ_i (P_i − P_1)_ab + μ_i d_ia (d_ib − d̄_b)
//! ```
//!
//! Only sums over modes are written out: that is shorter than loops of two or three. Distances and their weighted sums are computed
//! where they are needed, rather than kept.

use crate::gaussian::Gaussian;
use crate::scalar::Real;

/// d_i of the coordinate k.
#[inline(always)]
fn deviations<T: Real, const NX: usize, const MODES: usize>(modes: &[Gaussian<T, NX>; MODES], k: usize) -> [T; MODES] {
    let mut d = [T::ZERO; MODES];
    written_out!(for i in MODES {
        if i > 0 {
            d[i] = modes[i].mean.data.0[0][k] - modes[0].mean.data.0[0][k];
        }
    });
    d
}

/// Σ_i w_i d_i
#[inline(always)]
fn weighed<T: Real, const MODES: usize>(weight: &[T; MODES], d: &[T; MODES]) -> T {
    let mut sum = weight[1] * d[1];
    written_out!(for i in MODES {
        if i > 1 {
            sum += weight[i] * d[i];
        }
    });
    sum
}

/// Of three modes or more.
#[inline(always)]
pub fn mix<T: Real, const NX: usize, const MODES: usize>(modes: &mut [Gaussian<T, NX>; MODES], weight: &[[T; MODES]; MODES]) {
    for a in 0..NX {
        let d_a = deviations(modes, a);
        for b in a..NX {
            let d_b = deviations(modes, b);
            let first = modes[0].cov.upper()[a][b];
            let mut n = [T::ZERO; MODES];
            written_out!(for i in MODES {
                if i > 0 {
                    n[i] = modes[i].cov.upper()[a][b] - first + d_a[i] * d_b[i];
                }
            });
            for j in 0..MODES {
                let mut v = first - weighed(&weight[j], &d_a) * weighed(&weight[j], &d_b);
                written_out!(for i in MODES {
                    if i > 0 {
                        v += weight[j][i] * n[i];
                    }
                });
                modes[j].cov.upper_mut()[a][b] = v;
            }
        }
        // Rows below need no mean of this coordinate.
        let first = modes[0].mean.data.0[0][a];
        for j in 0..MODES {
            modes[j].mean.data.0[0][a] = first + weighed(&weight[j], &d_a);
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
    for a in 0..NX {
        let d_a = deviations(modes, a);
        out.mean.data.0[0][a] = modes[0].mean.data.0[0][a] + weighed(prob, &d_a);
        for b in a..NX {
            let d_b = deviations(modes, b);
            let bar = weighed(prob, &d_b);
            let first = modes[0].cov.upper()[a][b];
            let mut sum = first;
            written_out!(for i in MODES {
                if i > 0 {
                    sum += prob[i] * d_a[i] * (d_b[i] - bar);
                    sum += prob[i] * (modes[i].cov.upper()[a][b] - first);
                }
            });
            out.cov.upper_mut()[a][b] = sum;
        }
    }
}
