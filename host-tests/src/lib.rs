//! The desk side of boresight: everything that proves the library on a PC.
//!
//! | module | holds |
//! |---|---|
//! | [`cli`] | the commands `list`, `run`, `replay`, `replay-log`, `telemetry`, `soak`, `solve`, `twin`, `budget`, `compare`, `guide` |
//! | [`scenario`] | the table of published scenarios; each compares named filters by Monte Carlo |
//! | [`solve`] | reference cases: reads a case file, fills in what the library computes |
//! | [`replay`] | recorded plots: readers, sensor description, summary and picture |
//! | [`replay_log`] | logs that targets have written, done again to the same bits |
//! | [`telemetry`] | records of a target at work, in words |
//! | [`soak`] | trackers that live long, under faults |
//! | [`budget`] | what trackers and kernels cost on the target, and the bounds of that |
//! | [`mod@twin`] | the data of the firmware example and the bits expected of it |
//! | [`compare`] | every tracker on the same scenarios, beside what it costs on the target |
//! | [`guide`] | lessons in tuning: what wrong numbers look like |
//! | [`metrics`] | OSPA, GOSPA, NEES, chi-square quantiles, tracking over a sequence of scans |
//! | [`statistics`] | means with standard errors, medians, Wilson intervals |
//! | [`monte_carlo`] | independent seeded runs in parallel, in order, with progress |
//! | [`picture`] | SVG charts: maps with equal axes, curves over time |
//! | [`output`], [`error`], [`precision`] | atomic files, the one-line error, f32 or f64 |
//!
//! Conventions: SI units and radians; angles in (-pi, pi]; x east, y north, z up unless a file says
//! otherwise. Bad input is a [`Failure`], never a panic, and no output file is ever half-written.

pub mod budget;
pub mod cli;
pub mod compare;
pub mod error;
pub mod guide;
pub mod metrics;
pub mod monte_carlo;
pub mod output;
pub mod picture;
pub mod precision;
pub mod replay;
pub mod replay_log;
pub mod scenario;
pub mod soak;
pub mod solve;
pub mod statistics;
pub mod telemetry;
pub mod twin;

pub use error::Failure;
pub use precision::Precision;
