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
/// are counted, too.
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
            pairs.clear();
            return self.0.associate(matrix, jpda);
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
