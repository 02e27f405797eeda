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
//! Where the library is compiled for size, rows and entries are plain loops with the same operations in the same order.

use crate::gaussian::Gaussian;
use crate::scalar::Real;

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
    let d = deviations(modes);
    if MODES == 2 {
        return mix_two(modes, &d[1], weight);
    }
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
    mix_covariances(modes, &d, &bar, weight);
}

#[inline(always)]
fn mix_two<T: Real, const NX: usize, const MODES: usize>(modes: &mut [Gaussian<T, NX>; MODES], d: &[T; NX], weight: &[[T; MODES]; MODES]) {
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

#[cfg(not(small))]
#[inline(always)]
fn mix_covariances<T: Real, const NX: usize, const MODES: usize>(
    modes: &mut [Gaussian<T, NX>; MODES],
    d: &[[T; NX]; MODES],
    bar: &[[T; NX]; MODES],
    weight: &[[T; MODES]; MODES],
) {
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

#[cfg(small)]
#[inline(always)]
fn mix_covariances<T: Real, const NX: usize, const MODES: usize>(
    modes: &mut [Gaussian<T, NX>; MODES],
    d: &[[T; NX]; MODES],
    bar: &[[T; NX]; MODES],
    weight: &[[T; MODES]; MODES],
) {
    for a in 0..NX {
        for b in a..NX {
            let first = modes[0].cov.upper()[a][b];
            let mut n = [T::ZERO; MODES];
            for i in 1..MODES {
                n[i] = modes[i].cov.upper()[a][b] - first + d[i][a] * d[i][b];
            }
            for j in 0..MODES {
                let mut v = first - bar[j][a] * bar[j][b];
                for i in 1..MODES {
                    v += weight[j][i] * n[i];
                }
                modes[j].cov.upper_mut()[a][b] = v;
            }
        }
    }
}

/// `out` becomes the moment match of all modes i with the weights `prob[i]`.
#[cfg(not(small))]
#[inline(always)]
pub(super) fn combine<T: Real, const NX: usize, const MODES: usize>(
    modes: &[Gaussian<T, NX>; MODES],
    prob: &[T; MODES],
    out: &mut Gaussian<T, NX>,
) {
    if MODES == 1 {
        *out = modes[0];
        return;
    }
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
#[cfg(not(small))]
struct Terms<'a, T, const NX: usize, const MODES: usize> {
    modes: &'a [Gaussian<T, NX>; MODES],
    prob: &'a [T; MODES],
    /// p_i
    weighed: [[T; NX]; MODES],
    /// d_i − d̄
    apart: [[T; NX]; MODES],
}

#[cfg(not(small))]
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

/// `out` becomes the moment match of all modes i with the weights `prob[i]`.
#[cfg(small)]
#[inline(always)]
pub(super) fn combine<T: Real, const NX: usize, const MODES: usize>(
    modes: &[Gaussian<T, NX>; MODES],
    prob: &[T; MODES],
    out: &mut Gaussian<T, NX>,
) {
    if MODES == 1 {
        *out = modes[0];
        return;
    }
    let mut bar = modes[0].mean.data.0[0];
    for k in 0..NX {
        let first = bar[k];
        for i in 1..MODES {
            let moved = prob[i] * (modes[i].mean.data.0[0][k] - first);
            bar[k] = if i == 1 { moved } else { bar[k] + moved };
        }
        out.mean.data.0[0][k] = first + bar[k];
    }
    for a in 0..NX {
        for b in a..NX {
            let first = modes[0].cov.upper()[a][b];
            let mut sum = first;
            for i in 1..MODES {
                let d = |k: usize| modes[i].mean.data.0[0][k] - modes[0].mean.data.0[0][k];
                sum += prob[i] * d(a) * (d(b) - bar[b]);
                sum += prob[i] * (modes[i].cov.upper()[a][b] - first);
            }
            out.cov.upper_mut()[a][b] = sum;
        }
    }
}
