//! Moment matching of the modes of one target: the arithmetic of interaction and combination.
//!
//! With d_i = x_i − x_1, so that nothing of the size of the coordinates cancels:
//!
//! ```text
//! combination   p_i = μ_i d_i,  d̄ = Σ p_i:    x = x_1 + d̄,   P = P_1 + Σ_i μ_i (P_i − P_1) + p_i (d_i − d̄)'
//! interaction   N_i = P_i − P_1 + d_i d_i':   P⁰_j = P_1 + Σ_i μ_i|j N_i − d̄_j d̄_j',   d̄_j = Σ_i μ_i|j d_i
//! of two modes                                P⁰_j = P_1 + w_j (P_2 − P_1) + w_j (1 − w_j) d d',   w_j = μ_2|j
//! ```
//!
//! The N_i are shared by all targets of the interaction. The weights of the first mode are what the others leave of one: they do
//! not appear. All three equal Σ_i μ_i (P_i + (x_i − x)(x_i − x)').
//!
//! | file | of what |
//! |---|---|
//! | `mixing/speed.rs` | rows and entries written out, in an order that suits the pipeline |
//! | `mixing/size.rs` | where the library is compiled for size: plain loops, with the same operations on every entry |

#[cfg(small)]
mod size;
#[cfg(not(small))]
mod speed;

use crate::gaussian::Gaussian;
use crate::scalar::Real;
#[cfg(small)]
use size as form;
#[cfg(not(small))]
use speed as form;

/// d_i = x_i − x_1, but for i = 1, which nothing asks for.
#[inline(always)]
fn deviations<T: Real, const NX: usize, const MODES: usize>(modes: &[Gaussian<T, NX>; MODES]) -> [[T; NX]; MODES] {
    let first = modes[0].mean.data.0[0];
    let mut d = [first; MODES];
    for i in 1..MODES {
        for k in 0..NX {
            d[i][k] = modes[i].mean.data.0[0][k] - first[k];
        }
    }
    d
}

/// Every mode j becomes the moment match of all modes i with the weights `weight[j][i]`.
#[inline(always)]
pub(super) fn mix<T: Real, const NX: usize, const MODES: usize>(modes: &mut [Gaussian<T, NX>; MODES], weight: &[[T; MODES]; MODES]) {
    if MODES == 2 { mix_two(modes, weight) } else { form::mix(modes, weight) }
}

#[inline(always)]
fn mix_two<T: Real, const NX: usize, const MODES: usize>(modes: &mut [Gaussian<T, NX>; MODES], weight: &[[T; MODES]; MODES]) {
    let d = &deviations(modes)[1];
    let mut apart = [T::ZERO; MODES];
    for j in 0..MODES {
        apart[j] = weight[j][1] * (T::ONE - weight[j][1]);
    }
    for a in 0..NX {
        let first = modes[0].mean.data.0[0][a];
        for j in 0..MODES {
            modes[j].mean.data.0[0][a] = first + weight[j][1] * d[a];
        }
        for b in a..NX {
            let first = modes[0].cov.upper()[a][b];
            let (n, dd) = (modes[1].cov.upper()[a][b] - first, d[a] * d[b]);
            for j in 0..MODES {
                let (wn, spread) = (weight[j][1] * n, apart[j] * dd);
                modes[j].cov.upper_mut()[a][b] = first + wn + spread;
            }
        }
    }
}

/// `out` becomes the moment match of all modes i with the weights `prob[i]`.
#[inline(always)]
pub(super) fn combine<T: Real, const NX: usize, const MODES: usize>(
    modes: &[Gaussian<T, NX>; MODES],
    prob: &[T; MODES],
    out: &mut Gaussian<T, NX>,
) {
    if MODES == 1 { *out = modes[0] } else { form::combine(modes, prob, out) }
}
