//! Tracks that the sensor may not tell apart: which they are, what they weigh as one, and what each learns of that.
//!
//! ```text
//! pairs    of all confirmed tracks the two with the largest P_u, then of the others, down to P_u = 10⁻³; each track in one pair
//! gate     what both would give as one, with the threshold of the sensor
//! weights  1 − P_u;  g_j = P_Da / λ_j · √det 2πR_d · N([z_j; 0]; ...),  g_0 = P_u (1 − P_Da P_G)      (coupled/as_one.rs)
//! absorb   of a track t of the pair (t, u), besides its own detections: z_j as measured of both, u integrated out, by P(as one, j);
//!          and, as if detected where u is, that the two are near, by P(as one, neither seen)
//! ```
//!
//! The coupled filter of any two tracks of many, without what two tracks have in common: the other target of a pair enters by its
//! combined density, so a track remains one bank of modes, and a pair is forgotten when the scan is over. Tracks that part are two
//! again by themselves.

use crate::association::{UnresolvedPair, UnresolvedPairs};
use crate::coupled::as_one::{AsOne, of_one};
use crate::coupled::{Blocks, Odds};
use crate::model::MeasurementModel;
use crate::model::resolution::Resolution;
use crate::scalar::{Real, exp, is_finite, larger, ln};
use crate::scan::{Detection, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::symmetric::Symmetric;
use crate::track::{Status, Track};
use heapless::Vec;
use nalgebra::SVector;

/// Two tracks that are one to the sensor less often than this count as resolved.
const LEAST_UNRESOLVED: f64 = 1e-3;
/// Nor are two that differ in a component by more than so many standard deviations.
const FARTHEST: f64 = 5.0;

/// A track as the sensor would measure it, all modes combined.
#[derive(Clone, Copy)]
pub(super) struct Sight<T, const NZ: usize> {
    z_hat: SVector<T, NZ>,
    spread: Symmetric<T, NZ>,
    noise: Symmetric<T, NZ>,
    /// r P_D
    p_detect: T,
}

/// All confirmed tracks as the sensor would measure them.
pub(super) type Sights<T, const NZ: usize, const TRACKS: usize> = [Option<Sight<T, NZ>>; TRACKS];

/// A scan of a sensor that states its resolution.
pub(super) struct Dwell<'a, S, T, const NZ: usize, const DETS: usize> {
    pub sensor: &'a S,
    pub resolution: &'a Resolution<T, NZ>,
    pub detections: &'a [Detection<T, NZ>],
    pub selection: &'a Selection<DETS>,
}

impl<S, T, const NZ: usize, const DETS: usize> Dwell<'_, S, T, NZ, DETS> {
    /// The detections taken in.
    fn taken(&self) -> impl Iterator<Item = Option<&Detection<T, NZ>>> {
        self.selection.indices.iter().map(|number| self.detections.get(usize::from(*number)))
    }
}

/// Measures all confirmed tracks.
#[inline(never)]
pub(super) fn look<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize, const TRACKS: usize>(
    tracks: &[Track<T, NX, MODES>; TRACKS],
    sensor: &S,
) -> Sights<T, NZ, TRACKS> {
    tracks.each_ref().map(|track| {
        // One that is not confirmed has to prove itself by detections of its own.
        if track.is_free() || track.status() == Status::Tentative {
            return None;
        }
        let g = track.bank.combined();
        let innovation = sensor.model().innovation(&g);
        let p_detect = track.existence * sensor.p_detect(&track.bank.modes[0].mean);
        Some(Sight { z_hat: innovation.z_hat, spread: innovation.spread, noise: sensor.model().noise(&g.mean), p_detect })
    })
}

/// Finds the pairs and writes what they weigh as one. `diffuse` is 1 / λ where clutter is. Returns how many found no room.
#[inline(never)]
pub(super) fn pair_up<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>(
    pairs: &mut UnresolvedPairs<T, DETS>,
    sights: &Sights<T, NZ, TRACKS>,
    dwell: &Dwell<'_, S, T, NZ, DETS>,
    diffuse: T,
) -> u16 {
    let Dwell { sensor, resolution, .. } = *dwell;
    let (mut free, mut refused) = (*sights, 0);
    for _ in 0..TRACKS / 2 {
        let mut closest: Option<([usize; 2], AsOne<T, NZ>)> = None;
        for (first, a) in free.iter().enumerate() {
            let Some(a) = a else { continue };
            for (second, b) in free.iter().enumerate().skip(first + 1) {
                let Some(as_one) = b.as_ref().and_then(|b| as_one(a, b, sensor, resolution)) else { continue };
                if closest.as_ref().is_none_or(|(_, closest)| as_one.ln_unresolved > closest.ln_unresolved) {
                    closest = Some(([first, second], as_one));
                }
            }
        }
        let Some((rows, as_one)) = closest else { break };
        let [first, _] = rows.map(|row| free.get_mut(row).and_then(Option::take));
        let Some(nominal) = first.map(|sight| sight.noise) else { break };
        if pairs.is_full() {
            refused += 1;
            continue;
        }
        let mut hit = [T::ZERO; DETS];
        for (column, (detection, g)) in dwell.taken().zip(&mut hit).enumerate() {
            let Some(detection) = detection else { continue };
            let noise = detection.noise.as_ref().or(resolution.noise.as_ref());
            let (z_hat, density) = as_one.predicted(noise.unwrap_or(&nominal));
            if density.nis(&sensor.model().residual(&detection.z, &z_hat)) > sensor.gate().threshold() {
                continue;
            }
            let ln_rate = match sensor.clutter(&detection.z) {
                Clutter::Poisson(density) => -ln(larger(density, T::lit(crate::evidence::LEAST_DENSITY))),
                Clutter::Diffuse => ln(diffuse),
            };
            let weight = exp(as_one.merged(sensor.model(), detection, ln_rate, column).ln_weight);
            *g = if is_finite(weight) { weight } else { T::ZERO };
        }
        let resolved = exp(as_one.ln_resolved);
        let miss = exp(as_one.ln_unresolved + as_one.ln_missed);
        let _ = pairs.push(UnresolvedPair::new(rows.map(|row| row as u16), resolved, miss, hit));
    }
    refused
}

/// Two tracks as one, if they may be.
fn as_one<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize>(
    a: &Sight<T, NZ>,
    b: &Sight<T, NZ>,
    sensor: &S,
    resolution: &Resolution<T, NZ>,
) -> Option<AsOne<T, NZ>> {
    let model = sensor.model();
    let apart = model.difference(&a.z_hat, &b.z_hat);
    let far = (0..NZ).any(|k| {
        let variance = a.spread.upper()[k][k] + b.spread.upper()[k][k] + resolution.cells.upper()[k][k];
        apart.data.0[0][k] * apart.data.0[0][k] > T::lit(FARTHEST * FARTHEST) * variance
    });
    if far {
        return None;
    }
    let odds = Odds { p_detect: [a.p_detect, b.p_detect], p_gate: sensor.gate().p_gate(), ln_pair: T::ZERO };
    let as_one = AsOne::new(model, &[a.z_hat, b.z_hat], &Blocks::diagonal([a.spread, b.spread]), &a.noise, resolution, &odds);
    (as_one.ln_unresolved > ln(T::lit(LEAST_UNRESOLVED))).then_some(as_one)
}

/// What a track of a pair has besides its own detections: those of both, as detections of itself.
pub(super) struct Shared<T, const NZ: usize, const DETS: usize> {
    pub detections: Vec<Detection<T, NZ>, DETS>,
    pub beta: Vec<T, DETS>,
    /// P(no detection is the track's, and the two are two), with what found no room
    pub beta_0: T,
    /// P(the two are one and not seen)
    pub unseen: T,
}

impl<T: Real, const NZ: usize, const DETS: usize> Shared<T, NZ, DETS> {
    /// Of the track in `row`, with its own probabilities `beta_0` and `beta`.
    #[inline(never)]
    pub fn new<S: Sensor<T, NX, NZ>, const NX: usize, const TRACKS: usize>(
        pair: &UnresolvedPair<T, DETS>,
        row: usize,
        (beta_0, beta): (T, &[T]),
        sights: &Sights<T, NZ, TRACKS>,
        dwell: &Dwell<'_, S, T, NZ, DETS>,
    ) -> Option<Self> {
        let Dwell { sensor, resolution, .. } = *dwell;
        let is_first = usize::from(pair.rows[0]) == row;
        let other = sights.get(usize::from(pair.rows[usize::from(is_first)]))?.as_ref()?;
        let share = if is_first { resolution.share } else { T::ONE - resolution.share };
        let mut shared = Self { detections: Vec::new(), beta: Vec::new(), beta_0, unseen: pair.probability.miss };
        let of_one = |detection: Option<&Detection<T, NZ>>| {
            let own = detection.and_then(|d| d.noise.as_ref());
            let noise = own.or(resolution.noise.as_ref()).unwrap_or(&other.noise);
            of_one(sensor.model(), (&other.z_hat, &other.spread), resolution, share, noise, detection.map(|d| &d.z))
        };
        for (detection, p) in dwell.taken().zip(&pair.probability.hit).filter(|(_, p)| **p > T::ZERO) {
            shared.push(of_one(Some(detection?)), *p);
        }
        shared.push(of_one(None), pair.probability.miss);
        for (detection, p) in dwell.taken().zip(beta).filter(|(_, p)| **p > T::ZERO) {
            shared.push(*detection?, *p);
        }
        Some(shared)
    }

    fn push(&mut self, detection: Detection<T, NZ>, p: T) {
        let sound = detection.noise.is_none_or(|noise| noise.is_definite()) && p > T::ZERO;
        if !sound || self.detections.push(detection).is_err() || self.beta.push(p).is_err() {
            self.beta_0 += p;
        }
    }
}
