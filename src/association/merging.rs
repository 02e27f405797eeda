//! Joint association of tracks of which two may have one detection between them.
//!
//! ```text
//! resolved     every track has a detection of its own or none, by weight (1 − P_u) Π h, Π m
//! as one       two tracks t, u have detection j together, by weight g_j, or none, by g_0;  the others as ever
//! S            the pairs that are one, of those of a cluster:  β = Σ_S P(S) β(S)
//! β(S)         of one association, with the row g for that of t and an empty row for that of u, for every pair (t, u) in S
//! P(S)       ∝ Z(S) Π (1 − P_u) of the pairs not in S,   Z(S) the sum of all weights
//! Z(S + p) / Z(S) = [β_t0(S) / m_t] [β_u0(S, t empty) / m_u] [g_0 / β_t0(S + p)]
//! ```
//!
//! Any exact association gives the ratios of such sums by what it says of "none". So the sets S are walked through, one pair joining
//! or leaving at a time (a Gray code), with two associations a step; clusters that share nothing walk at the same time (`subsets.rs`).
//! A cluster may have up to four pairs, so that the walk has an end in time; of more, the last count as resolved, and are reported.
//! So do all pairs beside weights that are logarithms: the walk puts g in the place of rows, and g is a weight as it is.

use super::jpda::{Jpda, JpdaMemory};
use super::matrix::{AssociationMatrix, Associator, Completeness, Domain};
use super::subsets::{self, Stage};
use super::work::count;
use crate::scalar::{Real, larger};
use heapless::Vec;

/// Where detection is certain this much doubt is put: "none" must be possible for the sums to be told by it.
const LEAST_MISS: f64 = 1e-6;

/// Two tracks that may have one detection between them.
#[derive(Clone, Debug)]
pub struct UnresolvedPair<T, const DETS: usize> {
    /// Their rows in the matrix
    pub rows: [u16; 2],
    /// 1 − P_u, the prior probability that they are resolved
    pub resolved: T,
    /// What they weigh as one: g_0, not detected, and g_j, detection j is of both
    pub weight: PairRow<T, DETS>,
    /// The probabilities of the same, after the association
    pub probability: PairRow<T, DETS>,
    /// β_t0 of the first while all are resolved
    pub(super) alone: T,
}

/// No detection, and every one.
#[derive(Clone, Copy, Debug)]
pub struct PairRow<T, const DETS: usize> {
    /// None
    pub miss: T,
    /// Detection j
    pub hit: [T; DETS],
}

impl<T: Real, const DETS: usize> UnresolvedPair<T, DETS> {
    /// The tracks in `rows`, which are resolved with probability `resolved` and weigh `miss` and `hit` as one.
    #[must_use]
    pub const fn new(rows: [u16; 2], resolved: T, miss: T, hit: [T; DETS]) -> Self {
        let none = PairRow { miss: T::ZERO, hit: [T::ZERO; DETS] };
        Self { rows, resolved, weight: PairRow { miss, hit }, probability: none, alone: T::ONE }
    }
}

/// The pairs of a scan.
pub type UnresolvedPairs<T, const DETS: usize> = heapless::VecView<UnresolvedPair<T, DETS>>;

/// [`Jpda`] with room for `PAIRS` pairs of tracks that the sensor may not tell apart.
///
/// In [`ImmJpda`](crate::tracker::ImmJpda) this is all it takes besides a sensor that states its [resolution](crate::sensor::Sensor::resolution): tracks that
/// come close are paired, the closest first and each once, and are two again when they part. Pairs beyond `PAIRS` stay resolved, and the report counts them.
/// [`LmsJpda`](crate::tracker::LmsJpda) makes no pairs: it chooses modes by how well a track's own detections fit
/// them, which is not defined for one that two tracks share. With this association it does what it does with [`Jpda`].
///
/// Exact wherever [`Jpda`] is. So are the probabilities of several pairs in a cluster: of up to four, the others stay resolved and
/// are counted, too. Weights that are [logarithms](Domain::Logarithmic) have no pairs: all stay resolved, and are counted.
///
/// Memory: two matrices more than `Jpda`, and 2 DETS + 5 scalars a pair. Cost: 3, 7, 15 or 31 associations where the most pairs that
/// any cluster has are 1, 2, 3 or 4; all but the first leave clusters without pairs alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MergingJpda<const NODES: usize, const PAIRS: usize>(Jpda<NODES>);

impl<const NODES: usize, const PAIRS: usize> MergingJpda<NODES, PAIRS> {
    /// On top of `jpda`.
    #[must_use]
    pub const fn new(jpda: Jpda<NODES>) -> Self {
        Self(jpda)
    }

    /// The most steps that associating `tracks` rows with `detections` columns can take: with n associations of A steps, T rows and
    /// M columns, n (A + 3 T M), and 2 PAIRS T M to find the clusters of pairs; n = 2^(min(PAIRS, 4) + 1) − 1.
    #[must_use]
    pub const fn worst_case(tracks: usize, detections: usize) -> u64 {
        let weights = tracks as u64 * detections as u64;
        subsets::associations(PAIRS) * (Jpda::<NODES>::worst_case(tracks, detections) + 3 * weights) + 2 * PAIRS as u64 * weights
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
            let pairs_refused = pairs.len() as u16;
            pairs.clear();
            return Completeness { pairs_refused, ..self.0.associate(matrix, jpda) };
        }
        for pair in pairs.iter_mut() {
            pair.weight.miss = larger(pair.weight.miss, T::lit(LEAST_MISS) * (T::ONE - pair.resolved));
            for row in pair.rows {
                if let Some((miss, _)) = matrix.row_mut(usize::from(row)) {
                    *miss = larger(*miss, T::lit(LEAST_MISS));
                }
            }
        }
        count(TRACKS * matrix.columns());
        weights.copy_from(matrix);
        let mut completeness = self.0.associate(matrix, jpda);
        for pair in pairs.iter_mut() {
            pair.alone = subsets::none(matrix, pair.rows[0]);
        }
        let clusters = subsets::clusters(jpda.clusters(), weights, pairs);
        completeness.pairs_refused = subsets::thin_out(pairs, &clusters);
        let mut walks = subsets::walks::<T, TRACKS, DETS, PAIRS>(pairs, &clusters);
        for step in 1..1usize << subsets::TOGETHER {
            if !walks.iter().any(|walk| walk.goes_on(step)) {
                break;
            }
            for stage in [Stage::Between, Stage::Changed] {
                subsets::compose(other, weights, pairs, &walks, &clusters, step, stage);
                completeness.join(self.0.associate(other, jpda));
                for walk in walks.iter_mut().filter(|walk| walk.goes_on(step)) {
                    match stage {
                        Stage::Between => walk.leave(step, other, weights, pairs),
                        Stage::Changed => walk.arrive(step, other, weights, pairs, &clusters, matrix),
                    }
                }
            }
        }
        completeness
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::ClutterPrior;
    use crate::scalar::ln;

    const TRACKS: usize = 4;
    const DETS: usize = 2;
    type Merging = MergingJpda<64, 2>;

    /// Four tracks which share two detections, and their number of pairs, by weights of `domain`.
    fn associate(pairs: usize, domain: Domain) -> (AssociationMatrix<f64, TRACKS, DETS>, Completeness) {
        let weight = |w: f64| if domain == Domain::Linear { w } else { ln(w) };
        let mut matrix = AssociationMatrix::new();
        matrix.reset(DETS, ClutterPrior::Poisson, domain);
        for (miss, hit) in matrix.miss.iter_mut().zip(&mut matrix.hit) {
            (*miss, *hit) = (weight(0.2), [weight(2.0), weight(3.0)]);
        }
        let mut memory = <Merging as Associator<f64, TRACKS, DETS>>::MEMORY;
        for rows in [[0, 1], [2, 3]].into_iter().take(pairs) {
            memory.pairs.push(UnresolvedPair::new(rows, 0.5, 0.2, [2.0, 3.0])).unwrap();
        }
        let completeness = Merging::new(Jpda::new()).associate(&mut matrix, &mut memory);
        let left = if domain == Domain::Linear { pairs } else { 0 };
        assert_eq!(memory.pairs.len(), left);
        (matrix, completeness)
    }

    #[test]
    fn pairs_beside_logarithms_count_as_resolved_and_are_told() {
        let (resolved, all) = associate(0, Domain::Logarithmic);
        assert!(all.is_exact(), "{all:?}");
        for pairs in [1, 2] {
            let (got, completeness) = associate(pairs, Domain::Logarithmic);
            assert_eq!(completeness, Completeness { pairs_refused: pairs as u16, ..all });
            assert!(!completeness.is_exact());
            assert_eq!((got.miss, got.hit), (resolved.miss, resolved.hit));
            // As they are, the same weights have their pairs.
            assert_eq!(associate(pairs, Domain::Linear).1.pairs_refused, 0);
        }
    }
}
