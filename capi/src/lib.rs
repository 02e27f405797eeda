//! The trackers for C: a static library and a header, `include/boresight.h`.
//!
//! The caller owns all memory; nothing is allocated, nothing global is written, and nothing unwinds. Every call returns a
//! [`Status`]; bad arguments, bad numbers and bad scans change nothing. A call takes as long as the tracker's step.
//!
//! # One's own configuration
//! Another crate with `crate-type = ["staticlib"]` that depends on this one (without its default features where it has a panic
//! handler) and holds three items: a type that implements [`Configuration`], a constant for C's memory, and a static.
//!
//! ```
//! use boresight::{error::ConfigError, ready::{Parameters, Sensor}};
//! use boresight_capi::{Configuration, Kind};
//! # use boresight::{model::motion::{ConstantVelocity, ProcessNoise}, track::Logic, tracker::ImmPdaf};
//!
//! struct Mine;
//!
//! impl Configuration<4, 1, 2> for Mine {
//!     type Tracker = ImmPdaf<f32, [ConstantVelocity<f32, 2>; 1], 4, 1, 8, 16>;
//!     type Sensor = Sensor<f32, 2, 2>;
//!
//!     fn defaults() -> Parameters {
//!         Parameters::turning()
//!     }
//!     fn build(parameters: &Parameters) -> Result<(Self::Tracker, Self::Sensor), ConfigError> {
//!         let quiet = ConstantVelocity::new(ProcessNoise::Discrete(parameters.mode_noise[0]))?;
//!         Ok((ImmPdaf::new([quiet], [[1.0]], [1.0], Logic::new(3, 4, 5)?)?, parameters.sensor()?))
//!     }
//! }
//!
//! // C: extern const boresight_kind mine;
//! #[unsafe(no_mangle)]
//! pub static mine: Kind = Kind::of::<Mine, 4, 1, 2, 16>();
//! // C: #define MINE_SIZE 4096
//! const _: () = assert!(mine.size() <= 4096);
//! ```
#![cfg_attr(target_os = "none", no_std)]
// Statics are named as C sees them.
#![allow(non_upper_case_globals)]

mod kind;
mod ready;
mod tracking;
mod types;

pub use kind::{Kind, Tracker};
pub use ready::*;
pub use tracking::{Configuration, Tracking};
pub use types::*;

use boresight::ready::Parameters;
use core::ffi::c_void;
use core::slice;

fn status(result: Result<(), Status>) -> Status {
    result.err().unwrap_or(Status::Ok)
}

/// Writes the numbers that `kind` starts from to `parameters`.
///
/// # Safety
/// `parameters` is NULL or can be written; `kind` is NULL or a kind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_defaults(kind: *const Kind, parameters: *mut Parameters) -> Status {
    // SAFETY: as the caller says; a kind is a static.
    match (unsafe { kind.as_ref() }, parameters.is_null()) {
        (Some(kind), false) => {
            // SAFETY: not NULL, so it can be written.
            unsafe { parameters.write((kind.defaults)()) };
            Status::Ok
        }
        _ => Status::Null,
    }
}

/// Makes a tracker of `kind` in `size` bytes at `memory` and writes its address to `tracker`, or NULL where it fails. The memory
/// must be aligned to BORESIGHT_ALIGN; what it holds does not matter. A tracker needs no clean-up, and holds no address of itself:
/// it may be copied with its memory.
///
/// # Safety
/// Every pointer is NULL or valid; `memory` holds `size` bytes, and nothing else uses them as long as the tracker is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_create(
    kind: *const Kind,
    memory: *mut c_void,
    size: usize,
    parameters: *const Parameters,
    tracker: *mut *mut Tracker,
) -> Status {
    if tracker.is_null() {
        return Status::Null;
    }
    // SAFETY: as the caller says; a kind is a static.
    let created = match unsafe { (kind.as_ref(), parameters.as_ref()) } {
        // SAFETY: `memory` is as `create` needs it.
        (Some(kind), Some(parameters)) => unsafe { kind.create(memory, size, parameters) },
        _ => Err(Status::Null),
    };
    // SAFETY: not NULL, so it can be written.
    unsafe { tracker.write(created.unwrap_or(core::ptr::null_mut())) };
    status(created.map(|_| ()))
}

/// Gives the tracker other numbers: a moving radar's place before each scan, for example. The tracks stay.
///
/// # Safety
/// Both are NULL or valid, `tracker` by [`boresight_create`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_configure(tracker: *mut Tracker, parameters: *const Parameters) -> Status {
    // SAFETY: as the caller says.
    let (found, parameters) = unsafe { (kind::find(tracker), parameters.as_ref()) };
    status(found.and_then(|tracking| Ok(tracking.configure(parameters.ok_or(Status::Null)?)?)))
}

/// Takes in one scan: `count` detections made at `time_us`, in microseconds since any epoch. No detections is a scan as well: the
/// radar looked and saw nothing. Writes what it did to `report` unless that is NULL; a report is never an error.
///
/// # Safety
/// Every pointer is NULL or valid; `detections` holds `count` of them, or is NULL with a `count` of 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_step(
    tracker: *mut Tracker,
    time_us: u64,
    detections: *const Detection,
    count: usize,
    report: *mut Report,
) -> Status {
    let detections = match count {
        0 => &[],
        _ if detections.is_null() => return Status::Null,
        _ if count > isize::MAX as usize / size_of::<Detection>() => return Status::Count,
        // SAFETY: not NULL, and as many as the caller says; their bytes are less than an address space.
        _ => unsafe { slice::from_raw_parts(detections, count) },
    };
    // SAFETY: as the caller says.
    let done = unsafe { kind::find(tracker) }.and_then(|tracking| Ok(tracking.step(time_us, detections)?));
    status(done.map(|made| {
        if !report.is_null() {
            // SAFETY: not NULL, so it can be written.
            unsafe { report.write(made) };
        }
    }))
}

/// Writes the live tracks to `tracks`, at most `capacity` of them, and to `count` how many there are; that may be more.
///
/// # Safety
/// Every pointer is NULL or valid; `tracks` has room for `capacity` tracks, or is NULL with a `capacity` of 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_tracks(tracker: *mut Tracker, tracks: *mut Track, capacity: usize, count: *mut usize) -> Status {
    if count.is_null() || (tracks.is_null() && capacity > 0) {
        return Status::Null;
    }
    // SAFETY: as the caller says.
    status(unsafe { kind::find(tracker) }.map(|tracking| {
        let mut live = 0;
        tracking.tracks(&mut |track| {
            if live < capacity {
                // SAFETY: within `capacity` tracks that can be written.
                unsafe { tracks.add(live).write(track) };
            }
            live += 1;
        });
        // SAFETY: not NULL, so it can be written.
        unsafe { count.write(live) };
    }))
}

/// Writes all that is known of the track `id` to `density`.
///
/// # Safety
/// Both are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_track_density(tracker: *mut Tracker, id: u32, density: *mut Density) -> Status {
    if density.is_null() {
        return Status::Null;
    }
    // SAFETY: as the caller says.
    let found = unsafe { kind::find(tracker) }.and_then(|tracking| tracking.density(id).ok_or(Status::NoTrack));
    // SAFETY: not NULL, so it can be written.
    status(found.map(|known| unsafe { density.write(known) }))
}

/// None is reached: the symbols of the example in C are checked for it.
#[cfg(all(target_os = "none", feature = "panic-handler"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
