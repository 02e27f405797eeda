//! A log of scans: what a tracker took in and what it made of it, small enough for a serial line, so that a desk can do the
//! same again to the same bits.
//!
//! ```text
//! header    bytes, little-endian
//! 0         4      "bslg"
//! 4         1      version of the format, 1
//! 5         1 x 3  NX, MODES, NZ
//! 8         2 x 2  TRACKS, DETS
//! 12        2 x 3  version of this library
//! 18        2      n, the numbers of the configuration
//! 20        4      kind of the configuration, the caller's
//! 24        4 n    its numbers
//! then      4      their hash, with kind and shape
//! last      4      CRC-32 of all before
//!
//! record, one for every scan offered
//! 0         2      its length
//! 2         1 x 2  0x5c; 0 where the scan was taken in, 1 where it was refused: then it tells of no detections
//! 4         4      number of the scan, from 0
//! 8         8      time [µs]
//! 16        2 x 4  detections and tracks that follow, detections dropped, 0
//! 24        4      digest of the tracker's state after it
//! then      for every detection 1 + 4 NZ, and what it brings besides: 2 NZ (NZ + 1) its noise, 4 its amplitude, 4 its offset [µs]
//! then      for every track 4 identity, 1 status, 4 existence, 4 MODES mode probabilities, 4 NX mean, 4 digest of all of it
//! last      4      CRC-32 of all before
//! ```
//!
//! A tracker whose numbers change while it lives writes another header before its next record. Everything is checked when read. A record costs a copy of the scan, a combined estimate and a digest of every track, and two
//! steps a byte for the checksum: small against the scan itself.

mod header;
mod record;

pub use header::{Header, VERSION};
pub use record::{Record, Recorder, Seen};

use crate::bytes::{CHECKSUM, crc32};
use core::fmt;

/// Why bytes are no log.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LogError {
    /// Fewer bytes than the part takes, or no room for it.
    Length,
    /// It does not begin as a log, or a record, does.
    Magic,
    /// Of a format that this code does not know.
    Format,
    /// The checksum is not that of the bytes.
    Checksum,
    /// Of states, modes, measurements or capacities of another number.
    Shape,
    /// The contents contradict each other.
    Content,
}

/// Writes the checksum of a part behind its body.
fn seal(part: &mut [u8]) {
    if let Some((body, checksum)) = part.split_last_chunk_mut::<CHECKSUM>() {
        *checksum = crc32(body).to_le_bytes();
    }
}

fn is_intact(part: &[u8]) -> bool {
    part.split_last_chunk::<CHECKSUM>().is_some_and(|(body, checksum)| crc32(body).to_le_bytes() == *checksum)
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LogError::Length => "it ends early, or there is no room for it",
            LogError::Magic => "it does not begin as it must",
            LogError::Format => "the format is unknown",
            LogError::Checksum => "the checksum does not match",
            LogError::Shape => "it is of another number of states, modes, components, tracks or detections",
            LogError::Content => "the contents contradict each other",
        })
    }
}

impl core::error::Error for LogError {}
