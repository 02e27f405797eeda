//! The modes of a density about one place: from this, a mixture costs one sum of numbers a mode.
//!
//! ```text
//! d_i = x_i − x_o,   N_i = P_i + d_i d_i'
//! x = x_o + Σ_i w_i d_i,   P = Σ_i w_i N_i − (x − x_o)(x − x_o)',   Σ w_i = 1
//! ```
//!
//! The moments of a mixture: Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
//! section 1.4.16, there with the second moments about the origin. A covariance does not change with the place, so the same holds
//! of d_i = x_i − x_o, the mean then being x − x_o.
//!
//! x_i and d_i are vectors of NX components in the units of the state, P_i and N_i NX × NX in products of two of them; w_i is a
//! probability. x_o is the mean of one of the modes. All terms have the size of the distances between modes: see
//! [`ModeBank::interact`].

use super::{ActiveSet, ModeBank};
use crate::gaussian::Gaussian;
use crate::scalar::Real;
use nalgebra::SVector;

/// Some modes of a [`ModeBank`] about one place, and their probabilities: what a scan mixes from.
///
/// `MODES` modes of `NX` components each, in the units of the state. Memory: a bank and NX scalars.
#[derive(Clone, Copy, Debug)]
pub struct Deviations<T, const NX: usize, const MODES: usize> {
    /// μ of every mode, held or not
    prob: [T; MODES],
    /// x_o, the mean of the first mode that is held
    place: SVector<T, NX>,
    /// d_i and N_i, as mean and covariance
    modes: [Gaussian<T, NX>; MODES],
}

impl<T: Real, const NX: usize, const MODES: usize> Deviations<T, NX, MODES> {
    /// All zero bits: no mode is held.
    pub const ZERO: Self = Self { prob: [T::ZERO; MODES], place: Gaussian::<T, NX>::ZERO.mean, modes: [Gaussian::ZERO; MODES] };

    /// Those of the modes `active` of `bank`; of the others d_i and N_i are zero. With none active all but the probabilities is zero.
    ///
    /// Cost: for every mode of `active` about 2 NX (NX + 1) / 2 operations.
    #[must_use]
    pub fn new(bank: &ModeBank<T, NX, MODES>, active: ActiveSet) -> Self {
        let mut new = Self::ZERO;
        new.take(bank, active);
        new
    }

    /// The same in place. What is held of other modes stays as it was, and no longer means anything.
    #[inline(always)]
    pub fn take(&mut self, bank: &ModeBank<T, NX, MODES>, active: ActiveSet) {
        self.prob = bank.prob;
        let Some(first) = active.iter().find_map(|r| bank.modes.get(r)) else { return };
        self.place = first.mean;
        for (i, (mode, g)) in self.modes.iter_mut().zip(&bank.modes).enumerate() {
            if active.contains(i) {
                about(&self.place, g, mode);
            }
        }
    }

    /// μ, the probabilities of all `MODES` modes of the bank, as it had them.
    #[inline(always)]
    #[must_use]
    pub const fn prob(&self) -> &[T; MODES] {
        &self.prob
    }

    /// The moment match x, P of the modes with the weights `weight`, written to `mixed` in the units of the state. One w_i for every mode:
    /// they sum to one and are zero in modes that are not held.
    ///
    /// Cost: for every weight above zero about 2 NX (NX + 1) / 2 operations, and as many once.
    #[inline(always)]
    pub fn mix(&self, weight: &[T; MODES], mixed: &mut Gaussian<T, NX>) {
        let (mut bar, mut cov) = ([T::ZERO; NX], [[T::ZERO; NX]; NX]);
        for (g, w) in self.modes.iter().zip(weight) {
            if *w == T::ZERO {
                continue;
            }
            let mut product = g.mean.data.0[0];
            for k in 0..NX {
                product[k] *= *w;
            }
            for k in 0..NX {
                bar[k] += product[k];
            }
            unrolled!(for a in NX {
                let mut product = g.cov.upper()[a];
                for b in a..NX {
                    product[b] *= *w;
                }
                for b in a..NX {
                    cov[a][b] += product[b];
                }
            });
        }
        unrolled!(for a in NX {
            let mut product = [T::ZERO; NX];
            for b in a..NX {
                product[b] = bar[a] * bar[b];
            }
            for b in a..NX {
                mixed.cov.upper_mut()[a][b] = cov[a][b] - product[b];
            }
        });
        for k in 0..NX {
            mixed.mean.data.0[0][k] = self.place.data.0[0][k] + bar[k];
        }
    }
}

/// d and N of the mode `g`; of N the upper half is written.
#[inline(always)]
fn about<T: Real, const NX: usize>(place: &SVector<T, NX>, g: &Gaussian<T, NX>, about: &mut Gaussian<T, NX>) {
    let d: [T; NX] = core::array::from_fn(|k| g.mean.data.0[0][k] - place.data.0[0][k]);
    about.mean.data.0[0] = d;
    unrolled!(for a in NX {
        let mut product = [T::ZERO; NX];
        for b in a..NX {
            product[b] = d[a] * d[b];
        }
        for b in a..NX {
            about.cov.upper_mut()[a][b] = g.cov.upper()[a][b] + product[b];
        }
    });
}
