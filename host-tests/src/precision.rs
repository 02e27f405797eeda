//! [`Precision`]: which of the library's two scalar types a command runs it in.
//!
//! The library is generic over its scalar; f32 is what ships, f64 is the reference. `run` and
//! `replay` default to f32, `solve` (comparison against 50-digit references) to f64.

use boresight::scalar::Real;
use serde::Serialize;
use std::fmt;

/// The scalar type of the library's arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision, as on the target.
    F32,
    /// Double precision, the reference.
    F64,
}

/// The library's scalar, with what the desk side needs to read and write it.
pub trait Scalar: Real + Into<f64> {}

impl<T: Real + Into<f64>> Scalar for T {}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}
