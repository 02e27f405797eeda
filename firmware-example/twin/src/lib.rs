//! What desk and target both run: trackers on recorded scans, and one pass through every kernel.
//!
//! Each run tells its results, value by value, to a [`Sink`]. The desk writes the bits of those values into
//! [`data::EXPECTED`] (`cargo run --release -p host-tests -- twin`); the self-test on the target compares. A
//! [`Label`] names every value, so that a divergence is found by part, scan, track and field.

#![no_std]

pub mod coupled;
#[rustfmt::skip]
pub mod data;
pub mod fusion;
pub mod glmb;
pub mod kernels;
pub mod load;
pub mod loaded;
pub mod pieces;
pub mod radar;
pub mod record;
pub mod simulated;
pub mod workloads;

use boresight::coupled::NoCross;
use boresight::gaussian::Gaussian;

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// The part of the run: the tracker, or a kernel
    pub part: &'static str,
    /// Scan or step, from 0
    pub scan: usize,
    /// Number of the track's identity; 0 where there is none
    pub track: u32,
    /// The field of the result
    pub field: &'static str,
}

/// Takes in results in a fixed order.
pub trait Sink {
    /// One value.
    fn take(&mut self, label: Label, value: f32);
}

/// Tells mean and covariance of a density.
pub(crate) fn tell<S: Sink, const NX: usize>(sink: &mut S, label: Label, g: &Gaussian<f32, NX>) {
    for value in g.mean.iter() {
        sink.take(Label { field: "mean", ..label }, *value);
    }
    for (i, row) in g.cov.upper().iter().enumerate() {
        for value in row.iter().skip(i) {
            sink.take(Label { field: "covariance", ..label }, *value);
        }
    }
}

/// Why a run could not be made; a configuration here is wrong.
#[derive(Clone, Copy, Debug)]
pub enum Fault {
    /// A configuration was refused.
    Config(boresight::error::ConfigError),
    /// A scan was refused.
    Scan(boresight::error::ScanError),
    /// A list of tracks was refused.
    List(boresight::fusion::ListError),
    /// A message was not understood.
    Message(boresight::fusion::MessageError),
    /// A log could not be written.
    Log(boresight::log::LogError),
}

impl From<boresight::log::LogError> for Fault {
    fn from(error: boresight::log::LogError) -> Self {
        Self::Log(error)
    }
}

impl From<boresight::error::ConfigError> for Fault {
    fn from(error: boresight::error::ConfigError) -> Self {
        Self::Config(error)
    }
}

impl From<boresight::error::ScanError> for Fault {
    fn from(error: boresight::error::ScanError) -> Self {
        Self::Scan(error)
    }
}

impl From<boresight::fusion::ListError> for Fault {
    fn from(error: boresight::fusion::ListError) -> Self {
        Self::List(error)
    }
}

impl From<boresight::fusion::MessageError> for Fault {
    fn from(error: boresight::fusion::MessageError) -> Self {
        Self::Message(error)
    }
}

/// What all trackers remember.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    radar: radar::Memory,
    coupled: coupled::Memory,
    apart: coupled::Memory<NoCross>,
    pairs: coupled::Tracks,
    sets: glmb::Forms,
}

impl Memory {
    /// All zero bits.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            radar: radar::Memory::new(),
            coupled: coupled::Memory::new(),
            apart: coupled::Memory::new(),
            pairs: coupled::Tracks::new(),
            sets: glmb::Forms::new(),
        }
    }
}

/// Everything, in the order of [`data::EXPECTED`].
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<S: Sink>(sink: &mut S, memory: &mut Memory) -> Result<(), Fault> {
    let Memory { radar, coupled, apart, pairs, sets } = memory;
    radar::run(sink, radar)?;
    kernels::run(sink)?;
    coupled::run(sink, coupled, apart, pairs)?;
    glmb::run(sink, sets)
}
