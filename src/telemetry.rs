//! One record a scan for whoever watches a tracker at work: its tracks, its report, what it cost.
//!
//! ```text
//! offset  bytes    little-endian
//! 0       8        time [µs]
//! 8       4        cost, in the caller's unit
//! 12      14 x 2   the report: its counts in order ..
//! 40      4        .. and its error bound
//! 44      2        number of tracks
//! then    29 each  identity 4, status 1, position and velocity 4 each: x, y, z, vx, vy, vz
//! last    4        CRC-32 of all before
//! ```
//!
//! [`Telemetry::SIZE`] bytes at most, for any link; with the feature `defmt` the record can be logged as it is. Unlike a
//! [`log`](crate::log) it holds what an engineer wants to see, not what a desk needs to do the same again.

use crate::bytes::{CHECKSUM, Writer, crc32};
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::{Estimate, Report};
use crate::time::Instant;
use crate::track::{Status, TrackId};

/// Bytes before the tracks, and of a track.
const HEAD: usize = 46;
const TRACK: usize = 29;

/// What is told of one scan.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Telemetry<const TRACKS: usize> {
    /// When
    pub time: Instant,
    /// What the scan cost: cycles, or any other unit that the caller counts
    pub cost: u32,
    /// What the tracker did, and gave up
    pub report: Report,
    /// The tracks afterwards
    pub tracks: heapless::Vec<Brief, TRACKS>,
}

/// A track in brief.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Brief {
    /// Which one
    pub id: TrackId,
    /// How far it is trusted
    pub status: Status,
    /// x, y, z \[m\]; 0 in axes that the tracker does not have
    pub position: [f32; 3],
    /// The velocity \[m/s\]
    pub velocity: [f32; 3],
}

impl Brief {
    /// Position and velocity where `layout` has them.
    #[must_use]
    pub fn new<T: Real, const NX: usize>(estimate: &Estimate<T, NX>, layout: Layout) -> Self {
        let state = |axis: usize, part: usize| {
            let number = estimate.state.mean.get(axis * layout.stride + part).filter(|_| axis < layout.axes);
            number.map_or(0.0, |x| x.to_f64() as f32)
        };
        let all = |part| [state(0, part), state(1, part), state(2, part)];
        Self { id: estimate.id, status: estimate.status, position: all(0), velocity: all(1) }
    }
}

impl<const TRACKS: usize> Telemetry<TRACKS> {
    /// Bytes of the largest record.
    pub const SIZE: usize = HEAD + TRACKS * TRACK + CHECKSUM;

    /// The record of the scan at `time`, with the first `TRACKS` of `estimates`.
    pub fn new<T: Real, const NX: usize>(
        time: Instant,
        cost: u32,
        report: Report,
        layout: Layout,
        estimates: impl Iterator<Item = Estimate<T, NX>>,
    ) -> Self {
        Self { time, cost, report, tracks: estimates.take(TRACKS).map(|estimate| Brief::new(&estimate, layout)).collect() }
    }

    /// Writes the record to `out` and returns its length; `None` where there is no room for [`SIZE`](Self::SIZE) bytes.
    pub fn encode(&self, out: &mut [u8]) -> Option<usize> {
        let length = HEAD + self.tracks.len() * TRACK;
        let (body, checksum) = out.get_mut(..Self::SIZE)?.get_mut(..length + CHECKSUM)?.split_at_mut_checked(length)?;
        let (mut writer, r) = (Writer(body), &self.report);
        writer.put(&self.time.as_micros().to_le_bytes());
        writer.put(&self.cost.to_le_bytes());
        let taken = [r.detections, r.detections_dropped, r.detections_unclaimed, r.seeds_dropped];
        let tracks = [r.births, r.births_refused, r.tracks_evicted, r.tracks_confirmed, r.tracks_deleted, r.duplicates_deleted];
        let association = [r.numeric_resets, r.clusters_bounded, r.clusters_approximated, r.clusters_infeasible];
        taken.iter().chain(&tracks).chain(&association).for_each(|count| writer.put(&count.to_le_bytes()));
        writer.real(r.association_error_bound);
        writer.put(&(self.tracks.len() as u16).to_le_bytes());
        for Brief { id, status, position, velocity } in &self.tracks {
            writer.put(&id.number().to_le_bytes());
            writer.put(&[*status as u8]);
            position.iter().chain(velocity).for_each(|x| writer.real(*x));
        }
        checksum.copy_from_slice(&crc32(body).to_le_bytes());
        Some(length + CHECKSUM)
    }
}

/// What has generic parts is checked here: a derived format holds only where those of its parts do.
#[cfg(feature = "defmt")]
const _: () = {
    use crate::{gaussian, initiation, log, model, scan, sensor, symmetric};
    const fn formats<F: defmt::Format>() {}
    formats::<Telemetry<1>>();
    formats::<gaussian::Gaussian<f32, 4>>();
    formats::<initiation::Initiation<f32, 4>>();
    formats::<log::Seen<4, 2>>();
    formats::<model::Fix<f32>>();
    formats::<scan::Detection<f32, 2>>();
    formats::<scan::Estimate<f32, 4>>();
    formats::<scan::Scan<'_, f32, 2>>();
    formats::<sensor::UniformSensor<model::radar::Radar<f32, 2, 2, 2>, f32>>();
    formats::<symmetric::Symmetric<f32, 4>>();
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::Gaussian;
    use core::num::NonZeroU32;
    use nalgebra::SVector;

    #[test]
    fn a_record_has_the_layout_and_the_length_that_are_stated() {
        let id = TrackId(NonZeroU32::MIN);
        let state = Gaussian { mean: SVector::from([1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0]), ..Gaussian::ZERO };
        let estimate = Estimate { id, status: Status::Coasting, existence: 1.0, state };
        let report = Report { detections: 7, clusters_infeasible: 9, ..Report::default() };
        let record = Telemetry::<3>::new(Instant::from_micros(5), 1000, report, Layout { axes: 2, stride: 3 }, [estimate; 5].into_iter());
        assert_eq!(record.tracks[0], Brief { id, status: Status::Coasting, position: [1.0, 4.0, 0.0], velocity: [2.0, 5.0, 0.0] });
        let mut out = [0; Telemetry::<3>::SIZE];
        // Of five tracks three have room: the record is the largest.
        assert_eq!((record.encode(&mut out), record.encode(&mut [0; 10])), (Some(46 + 3 * 29 + 4), None));
        assert_eq!((out[0], out[8..12] == 1000u32.to_le_bytes(), out[12], out[38], out[44]), (5, true, 7, 9, 3));
        assert_eq!((out[46], out[50], out[51..55] == 1f32.to_le_bytes(), out[67..71] == 5f32.to_le_bytes()), (1, 2, true, true));
    }
}
