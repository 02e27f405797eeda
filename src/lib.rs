//! Trackers for manoeuvring targets in clutter, on microcontrollers.
#![no_std]
#![deny(unsafe_code, missing_docs)]

pub mod association;
pub mod error;
pub mod evidence;
pub mod gaussian;
pub mod initiation;
pub mod mode;
pub mod model;
pub mod scalar;
pub mod scan;
pub mod sensor;
pub mod symmetric;
pub mod time;
pub mod track;
pub mod tracker;
