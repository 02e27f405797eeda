//! A radar on an SPI bus that is not there: it sends the recorded scans as frames, and makes the mistakes of real links.
//!
//! ```text
//! scan 7     a bit is flipped on the way; the radar sends the frame again
//! scan 15    sent twice
//! scan 25    the radar stops in the middle; the frame is sent again
//! scan 44    never sent
//! ```

use crate::data::{PERIOD_MILLIS, SCANS};
use boresight::link::encode;
use boresight::scan::Detection;
use core::convert::Infallible;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};

/// Clock of the radar at its first scan \[µs\]: it wraps after twelve of them.
const STARTED: u32 = u32::MAX - 12_500_000;
const FLIPPED: usize = 7;
const TWICE: usize = 15;
const CUT: usize = 25;
const LOST: usize = 44;

/// The radar; one read is one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radar {
    scan: usize,
    /// The frame of this scan has been sent once.
    again: bool,
}

impl Radar {
    fn send(&mut self, words: &mut [u8]) {
        words.fill(0);
        let Some(plots) = SCANS.get(self.scan) else { return };
        let mut detections = [Detection::new([0.0; 2]); 32];
        detections.iter_mut().zip(*plots).for_each(|(slot, plot)| *slot = Detection::new(*plot));
        let detections = detections.get(..plots.len()).unwrap_or_default();
        let micros = STARTED.wrapping_add(1000 * PERIOD_MILLIS as u32 * self.scan as u32);
        let length = encode(self.scan as u32, micros, detections, words).unwrap_or(0);
        let (sent, rest) = words.split_at_mut_checked(length / 2).unwrap_or_default();
        match (self.scan, self.again) {
            (FLIPPED, false) => sent.iter_mut().last().map_or((), |byte| *byte ^= 0x20),
            (CUT, false) => rest.fill(0),
            _ => {}
        }
        self.again = matches!(self.scan, FLIPPED | TWICE | CUT) && !self.again;
        self.scan += usize::from(!self.again);
        self.scan += usize::from(self.scan == LOST);
    }
}

impl ErrorType for Radar {
    type Error = Infallible;
}

impl SpiDevice for Radar {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::Read(words) = operation {
                self.send(words);
            }
        }
        Ok(())
    }
}
