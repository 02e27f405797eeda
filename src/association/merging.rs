//! Joint association of tracks of which two may have one detection between them.
//!
//! ```text
//! resolved     every track has a detection of its own or none, by weight (1 − P_u) Π h, Π m
//! as one       two tracks t, u have detection j together, by weight g_j, or none, by g_0;  the others as ever
//! Z_o          Σ weights of the events of the others alone
//! Z_r / Z_o  = m_t m_u / (β_t0 β_u0|t0)        from β_t0 among all, and β_u0 where t has none
//! Z_1 / Z_o  = g_0 / γ_0                       from the probabilities γ of one row g in the place of both
//! P(as one)  = Z_1 / (Z_1 + (1 − P_u) Z_r),   β ← P(resolved) β + P(as one) γ
//! ```
//!
//! Any exact association gives the sums of all weights by what it says of "none": three associations serve one pair, two more every
//! further one. For one pair in a cluster that is exact. Of several in one cluster each is weighed while the others count as resolved,
//! and the probabilities of all other tracks are mixed by one pair after the other.

use super::jpda::{Jpda, JpdaMemory};
use super::matrix::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use crate::scalar::{Real, is_finite, larger};
use heapless::Vec;

/// Weights this small count for nothing but that the detection is somebody's, which diffuse clutter asks.
const TRACE: f64 = 1e-12;

/// Where detection is certain this much doubt is put: "none" must be possible for the sums to be told by it.
const LEAST_MISS: f64 = 1e-6;

/// Two tracks that may have one detection between them.
#[derive(Clone, Debug)]
pub struct UnresolvedPair<T, const DETS: usize> {
    /// Their rows in the matrix
    pub rows: [u16; 2],
    /// 1 − P_u, the prior probability that they are resolved
    pub resolved: T,
    /// β_t0 of the first while all are resolved; to be left to the association
    pub alone: T,
    /// The weight g_0, then the probability, of "they are one, and not detected"
    pub miss: T,
    /// The weights g_j, then the probabilities, of "they are one, and detection j is of both"
    pub hit: [T; DETS],
}

/// The pairs of a scan.
pub type UnresolvedPairs<T, const DETS: usize> = heapless::VecView<UnresolvedPair<T, DETS>>;

/// [`Jpda`] with room for `PAIRS` pairs of tracks that the sensor may not tell apart.
///
/// In [`ImmJpda`](crate::tracker::ImmJpda) this is all it takes besides a sensor that states its [resolution](crate::sensor::Sensor::resolution): tracks that
/// come close are paired, the closest first and each once, and are two again when they part. Pairs beyond `PAIRS` stay resolved, and the report counts them.
/// [`LmsJpda`](crate::tracker::LmsJpda) makes no pairs.
///
/// Memory: two matrices more than `Jpda`, and DETS + 4 scalars a pair. Cost: 1 + 2 p associations with p pairs, and about
/// 5 p TRACKS DETS operations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MergingJpda<const NODES: usize, const PAIRS: usize>(Jpda<NODES>);

impl<const NODES: usize, const PAIRS: usize> MergingJpda<NODES, PAIRS> {
    /// On top of `jpda`.
    #[must_use]
    pub const fn new(jpda: Jpda<NODES>) -> Self {
        Self(jpda)
    }
}

/// What [`MergingJpda`] works in.
#[derive(Clone, Debug)]
pub struct MergingMemory<T, const TRACKS: usize, const DETS: usize, const NODES: usize, const PAIRS: usize> {
    jpda: JpdaMemory<T, TRACKS, DETS, NODES>,
    pairs: Vec<UnresolvedPair<T, DETS>, PAIRS>,
    weights: AssociationMatrix<T, TRACKS, DETS>,
    other: AssociationMatrix<T, TRACKS, DETS>,
}

impl<T: Real, const TRACKS: usize, const DETS: usize, const NODES: usize, const PAIRS: usize> Associator<T, TRACKS, DETS>
    for MergingJpda<NODES, PAIRS>
{
    type Memory = MergingMemory<T, TRACKS, DETS, NODES, PAIRS>;

    const MEMORY: Self::Memory = MergingMemory {
        jpda: <Jpda<NODES> as Associator<T, TRACKS, DETS>>::MEMORY,
        pairs: Vec::new(),
        weights: AssociationMatrix::new(),
        other: AssociationMatrix::new(),
    };

    fn pairs(memory: &mut Self::Memory) -> Option<&mut UnresolvedPairs<T, DETS>> {
        Some(&mut memory.pairs)
    }

    #[inline(never)]
    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness {
        let MergingMemory { jpda, pairs, weights, other } = memory;
        if pairs.is_empty() || matrix.domain == Domain::Logarithmic {
            pairs.clear();
            return self.0.associate(matrix, jpda);
        }
        for pair in pairs.iter_mut() {
            pair.miss = larger(pair.miss, T::lit(LEAST_MISS) * (T::ONE - pair.resolved));
            for row in pair.rows {
                if let Some((miss, _)) = matrix.row_mut(usize::from(row)) {
                    *miss = larger(*miss, T::lit(LEAST_MISS));
                }
            }
        }
        weights.copy_from(matrix);
        let mut completeness = self.0.associate(matrix, jpda);
        let miss = |matrix: &AssociationMatrix<T, TRACKS, DETS>, row: u16| matrix.miss.get(usize::from(row)).copied().unwrap_or(T::ONE);
        for pair in pairs.iter_mut() {
            pair.alone = miss(matrix, pair.rows[0]);
        }
        for pair in pairs.iter_mut() {
            let [first, second] = pair.rows;
            other.copy_from(weights);
            clear(other, first);
            completeness.join(self.0.associate(other, jpda));
            // P_u Z_1 over (1 − P_u) Z_r, factor by factor: the sums themselves may leave the range.
            let odds = (pair.alone / miss(weights, first)) * (miss(other, second) / miss(weights, second)) / pair.resolved;
            other.copy_from(weights);
            clear(other, second);
            clear(other, first);
            if let Some((miss, hit)) = other.row_mut(usize::from(first)) {
                *miss = pair.miss;
                for (h, g) in hit.iter_mut().zip(&pair.hit) {
                    *h += *g;
                }
            }
            completeness.join(self.0.associate(other, jpda));
            let odds = odds * (pair.miss / miss(other, first));
            // Without end where the resolved events are impossible; no number where both are, which tells nothing.
            let certain = if odds > T::ONE { T::ONE } else { T::ZERO };
            let as_one = if is_finite(odds) { odds / (T::ONE + odds) } else { certain };
            pair.miss = as_one * miss(other, first);
            pair.hit = [T::ZERO; DETS];
            if let Some((_, gamma)) = other.row(usize::from(first)) {
                for (g, gamma) in pair.hit.iter_mut().zip(gamma) {
                    *g = as_one * *gamma;
                }
            }
            for row in 0..TRACKS {
                let own = row == usize::from(first) || row == usize::from(second);
                let Some(((beta_0, beta), (gamma_0, gamma))) = matrix.row_mut(row).zip(other.row(row)) else { continue };
                let share = if own { T::ZERO } else { as_one };
                *beta_0 += share * gamma_0 - as_one * *beta_0;
                for (beta, gamma) in beta.iter_mut().zip(gamma) {
                    *beta += share * *gamma - as_one * *beta;
                }
            }
        }
        completeness
    }
}

/// Leaves a track nothing but no detection.
fn clear<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &mut AssociationMatrix<T, TRACKS, DETS>, track: u16) {
    let share = if matrix.clutter == ClutterPrior::Diffuse { T::lit(TRACE) } else { T::ZERO };
    if let Some((miss, hit)) = matrix.row_mut(usize::from(track)) {
        *miss = T::ONE;
        hit.iter_mut().for_each(|h| *h *= share);
    }
}
