//! The dense sweep of a small cluster: two, three or four tracks, with every layer an array of all 2^N sets.
//!
//! ```text
//! column i    f(s) ← q_i f(s) + Σ_{t ∈ s} h_ti f(s \ t)
//! end         b(s) = Π_{t ∉ s} vacant_t,   Z = Σ_s f(s) b(s),   β_t0 = Σ_{s ∌ t} f(s) b(s) / Z
//! backward    β_ti = h_ti Σ_{s ∌ t} f_i(s) b(s ∪ t) / Z,   b(s) ← q_i b(s) + Σ_{t ∉ s} h_ti b(s ∪ t)
//! ```
//!
//! What `sweep.rs` does for any number of open tracks, without opening and closing: the index of a set is the set, all
//! loops over sets unroll, and most clusters in practice are of this size.

use super::cluster::Cluster;
use super::work::count;
use crate::scalar::{Real, is_finite};

/// Replaces the weights of a cluster of two to four tracks in `hit` and `cluster.vacant` by marginals, in layers from
/// `nodes`. `None` where the cluster is larger or the layers do not fit; otherwise Z, and where it is not above `least`
/// nothing is replaced.
pub(super) fn marginals<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &mut [[T; DETS]; TRACKS],
    nodes: &mut [T],
    least: T,
) -> Option<T> {
    match cluster.tracks.len() {
        2 => sweep::<T, TRACKS, DETS, 2, 4>(cluster, hit, nodes, least),
        3 => sweep::<T, TRACKS, DETS, 3, 8>(cluster, hit, nodes, least),
        4 => sweep::<T, TRACKS, DETS, 4, 16>(cluster, hit, nodes, least),
        _ => None,
    }
}

fn sweep<T: Real, const TRACKS: usize, const DETS: usize, const N: usize, const SETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &mut [[T; DETS]; TRACKS],
    nodes: &mut [T],
    least: T,
) -> Option<T> {
    let layers = nodes.as_chunks_mut::<SETS>().0.get_mut(..cluster.columns.len())?;
    let tracks: [usize; N] = core::array::from_fn(|k| cluster.tracks.get(k).map_or(TRACKS, |t| usize::from(*t)));
    let rows = hit.get_disjoint_mut(tracks).ok()?;
    let vacant = cluster.vacant.first_chunk_mut::<N>()?;

    count(3 * SETS * N * (cluster.columns.len() + 1));
    let mut f = [T::ZERO; SETS];
    f[0] = T::ONE;
    for (column, layer) in cluster.columns.iter().zip(layers.iter_mut()) {
        *layer = f;
        if column.unused != T::ONE {
            f = f.map(|f| f * column.unused);
        }
        for t in 0..N {
            let h = rows[t].get(usize::from(column.det)).copied()?;
            if h > T::ZERO {
                for s in 0..SETS {
                    if s >> t & 1 == 0 {
                        f[s | 1 << t] += h * layer[s];
                    }
                }
            }
        }
    }
    let mut b = [T::ONE; SETS];
    let (mut z, mut missed) = (T::ZERO, [T::ZERO; N]);
    for s in 0..SETS {
        for t in 0..N {
            if s >> t & 1 == 0 {
                b[s] *= vacant[t];
            }
        }
        let weight = f[s] * b[s];
        z += weight;
        for t in 0..N {
            if s >> t & 1 == 0 {
                missed[t] += weight;
            }
        }
    }
    if z <= least || !is_finite(z) {
        return Some(z);
    }
    let scale = T::ONE / z;
    *vacant = missed.map(|m| m * scale);
    for (column, layer) in cluster.columns.iter_mut().zip(layers.iter()).rev() {
        let behind = b;
        if column.unused != T::ONE {
            b = b.map(|b| b * column.unused);
        }
        for t in 0..N {
            let h = rows[t].get_mut(usize::from(column.det))?;
            if *h > T::ZERO {
                let mut sum = T::ZERO;
                for s in 0..SETS {
                    if s >> t & 1 == 0 {
                        sum += layer[s] * behind[s | 1 << t];
                        b[s] += *h * behind[s | 1 << t];
                    }
                }
                *h *= sum * scale;
            }
        }
        if cluster.turned {
            let sum = layer.iter().zip(&behind).fold(T::ZERO, |sum, (f, b)| sum + *f * *b);
            column.unused *= sum * scale;
        }
    }
    Some(z)
}
