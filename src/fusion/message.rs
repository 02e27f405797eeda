//! A track in bytes, so that one node can tell another of it over any link.
//!
//! ```text
//! offset  bytes   little-endian
//! 0       1       version, 1
//! 1       1, 1    NX, MODES
//! 3       1       status: 0 tentative, 1 confirmed, 2 coasting
//! 4       2       number of the sensor
//! 6       4       identity
//! 10      8       time [µs]
//! 18      4       existence
//! 22      4 MODES mode probabilities
//! then    for every mode 4 NX for the mean, 2 NX (NX + 1) for the upper triangle of the covariance, by rows
//! last    4       CRC-32 (IEEE 802.3) of all before
//! ```
//!
//! Real numbers are single precision. The layout is plain because its length must be a constant and arrays of a generic length
//! are foreign to the usual serialisers. Everything that comes in is checked: length, version, shape, checksum, and then that
//! it is a track: probabilities that sum to one, finite means, covariances that are semi-definite. Frame and axes are agreed
//! upon beforehand.

use crate::bytes::{CHECKSUM, Reader, Writer, crc32};
use crate::gaussian::{Gaussian, zero_vector};
use crate::mode::{ModeBank, check_distribution};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use crate::time::Instant;
use crate::track::{Status, Track, TrackId};
use core::fmt;
use core::num::NonZeroU32;

const VERSION: u8 = 1;
/// Bytes before the mode probabilities.
const HEAD: usize = 22;

/// A sensor's track as it goes over a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackMessage<T, const NX: usize, const MODES: usize> {
    /// Which sensor's
    pub sensor: u16,
    /// When the track is as told here
    pub time: Instant,
    /// Its identity with that sensor
    pub id: TrackId,
    /// How far it is trusted
    pub status: Status,
    /// The probability that the target exists
    pub existence: T,
    /// Its density over all modes
    pub bank: ModeBank<T, NX, MODES>,
}

/// Without the densities of its modes, which no line of a log holds.
#[cfg(feature = "defmt")]
impl<T: Real + defmt::Format, const NX: usize, const MODES: usize> defmt::Format for TrackMessage<T, NX, MODES> {
    fn format(&self, f: defmt::Formatter<'_>) {
        let Self { sensor, time, id, status, existence, bank } = self;
        defmt::write!(f, "sensor {} at {}: {} {}, existence {}, modes {}", sensor, time, id, status, existence, bank.prob);
    }
}

/// Why bytes are no message.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MessageError {
    /// Not as many bytes as a message has, or no room for one.
    Length,
    /// Of a version that this code does not know.
    Version,
    /// Of states or modes of another number.
    Shape,
    /// The checksum is not that of the bytes.
    Checksum,
    /// The numbers are no track: not finite, no probabilities, no covariance, no identity.
    Content,
}

impl<T: Real, const NX: usize, const MODES: usize> TrackMessage<T, NX, MODES> {
    /// The length of every message \[bytes\].
    pub const SIZE: usize = {
        assert!(NX < 256 && MODES < 256, "the shape takes a byte each");
        HEAD + 4 * MODES + MODES * (4 * NX + 2 * NX * (NX + 1)) + CHECKSUM
    };

    /// What `sensor` knows of `track` at `time`; `None` for a free slot.
    #[must_use]
    pub fn new(sensor: u16, time: Instant, track: &Track<T, NX, MODES>) -> Option<Self> {
        Some(Self { sensor, time, id: track.id()?, status: track.status(), existence: track.existence(), bank: *track.bank() })
    }

    /// Writes the message to the first [`SIZE`](Self::SIZE) bytes of `out`.
    ///
    /// # Errors
    /// [`MessageError::Length`] where they are not there.
    pub fn encode(&self, out: &mut [u8]) -> Result<(), MessageError> {
        let message = out.get_mut(..Self::SIZE).ok_or(MessageError::Length)?;
        let (body, checksum) = message.split_at_mut_checked(Self::SIZE - CHECKSUM).ok_or(MessageError::Length)?;
        let mut writer = Writer(body);
        let status = match self.status {
            Status::Tentative => 0,
            Status::Confirmed => 1,
            Status::Coasting => 2,
        };
        writer.put(&[VERSION, NX as u8, MODES as u8, status]);
        writer.put(&self.sensor.to_le_bytes());
        writer.put(&self.id.number().to_le_bytes());
        writer.put(&self.time.as_micros().to_le_bytes());
        writer.real(self.existence);
        self.bank.prob.iter().for_each(|p| writer.real(*p));
        for g in &self.bank.modes {
            g.mean.iter().for_each(|x| writer.real(*x));
            writer.upper(&g.cov);
        }
        checksum.copy_from_slice(&crc32(body).to_le_bytes());
        Ok(())
    }

    /// Reads a message of exactly [`SIZE`](Self::SIZE) bytes.
    ///
    /// # Errors
    /// Where the bytes are not what [`encode`](Self::encode) writes of a track.
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (body, checksum) = bytes.split_last_chunk::<CHECKSUM>().ok_or(MessageError::Length)?;
        let mut reader = Reader(body);
        let [version, states, modes, status] = reader.take().ok_or(MessageError::Length)?;
        if version != VERSION {
            return Err(MessageError::Version);
        }
        if (usize::from(states), usize::from(modes)) != (NX, MODES) {
            return Err(MessageError::Shape);
        }
        if bytes.len() != Self::SIZE {
            return Err(MessageError::Length);
        }
        if u32::from_le_bytes(*checksum) != crc32(body) {
            return Err(MessageError::Checksum);
        }
        let status = match status {
            0 => Status::Tentative,
            1 => Status::Confirmed,
            2 => Status::Coasting,
            _ => return Err(MessageError::Content),
        };
        let mut read = || {
            let (sensor, id, time, existence) = (reader.half()?, reader.word()?, reader.wide()?, reader.real()?);
            let mut bank = ModeBank::<f32, NX, MODES>::ZERO;
            reader.reals(&mut bank.prob)?;
            for g in &mut bank.modes {
                reader.reals(g.mean.as_mut_slice())?;
                reader.upper(&mut g.cov)?;
            }
            Some((sensor, id, Instant::from_micros(time), existence, bank))
        };
        let (sensor, id, time, existence, bank) = read().ok_or(MessageError::Length)?;
        let id = NonZeroU32::new(id).map(TrackId).ok_or(MessageError::Content)?;
        // Judged in the precision of the link: what is semi-definite there may not be to twice the digits.
        let sound = (0.0..=1.0).contains(&existence)
            && check_distribution(&bank.prob).is_ok()
            && bank.is_valid()
            && bank.modes.iter().all(|g| g.cov.cholesky().is_some());
        if !sound {
            return Err(MessageError::Content);
        }
        Ok(Self { sensor, time, id, status, existence: wide(existence), bank: widened(&bank) })
    }
}

fn wide<T: Real>(x: f32) -> T {
    T::lit(f64::from(x))
}

/// The same bank in the tracker's own precision.
fn widened<T: Real, const NX: usize, const MODES: usize>(bank: &ModeBank<f32, NX, MODES>) -> ModeBank<T, NX, MODES> {
    let mode = |g: &Gaussian<f32, NX>| {
        let mut mean = zero_vector();
        mean.data.0[0] = g.mean.data.0[0].map(wide);
        Gaussian::new(mean, Symmetric::from_fn(|i, j| wide(g.cov.upper()[i][j])))
    };
    ModeBank { prob: bank.prob.map(wide), modes: bank.modes.each_ref().map(mode) }
}

impl fmt::Display for MessageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            MessageError::Length => "the length is not that of a message",
            MessageError::Version => "the version is unknown",
            MessageError::Shape => "the message has another number of states or modes",
            MessageError::Checksum => "the checksum does not match",
            MessageError::Content => "the numbers are no track",
        })
    }
}

impl core::error::Error for MessageError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_of_two_modes_and_six_states_takes_250_bytes() {
        assert_eq!(TrackMessage::<f32, 6, 2>::SIZE, 22 + 2 * (4 + 24 + 84) + 4);
    }
}
