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
//!     const LOG: [u8; 4] = *b"mine";
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
//! // C: extern const boresight_kind mine;   states, modes, components, room for tracks and detections
//! #[unsafe(no_mangle)]
//! pub static mine: Kind = Kind::of::<Mine, 4, 1, 2, 8, 16>();
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

/// The status of a call that goes as `call` does.
fn status(call: impl FnOnce() -> Result<(), Status>) -> Status {
    call().err().unwrap_or(Status::Ok)
}

/// Refuses an address that is NULL or not aligned.
fn check<T>(address: *const T) -> Result<(), Status> {
    match address.is_aligned() {
        _ if address.is_null() => Err(Status::Null),
        true => Ok(()),
        false => Err(Status::Memory),
    }
}

/// What stands at `address`.
///
/// # Safety
/// It is NULL, not aligned or valid, and does not change while the reference lives.
unsafe fn read<'a, T>(address: *const T) -> Result<&'a T, Status> {
    check(address)?;
    // SAFETY: neither NULL nor misaligned, so valid, as the caller says.
    Ok(unsafe { &*address })
}

/// No record or header is as long.
const MOST_BYTES: usize = 1 << 16;

/// The bytes at `out`, as many as a log's part can take.
///
/// # Safety
/// It is NULL or holds `capacity` bytes that nobody else uses while the reference lives.
unsafe fn room<'a>(out: *mut u8, capacity: usize) -> Result<&'a mut [u8], Status> {
    check(out)?;
    let capacity = capacity.min(MOST_BYTES);
    // SAFETY: not NULL, and as many bytes as the caller says; zeroed, so that they have a value.
    unsafe {
        out.write_bytes(0, capacity);
        Ok(slice::from_raw_parts_mut(out, capacity))
    }
}

/// Writes the numbers that `kind` starts from to `parameters`.
///
/// # Safety
/// `parameters` is NULL or can be written; `kind` is NULL or a kind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_defaults(kind: *const Kind, parameters: *mut Parameters) -> Status {
    status(|| {
        check(parameters)?;
        // SAFETY: as the caller says; a kind is a static.
        let kind = unsafe { read(kind)? };
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { parameters.write((kind.defaults)()) };
        Ok(())
    })
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
    status(|| {
        check(tracker)?;
        // SAFETY: as the caller says; a kind is a static, and `memory` is as `create` needs it.
        let created = unsafe { read(kind).and_then(|kind| kind.create(memory, size, read(parameters)?)) };
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { tracker.write(created.unwrap_or(core::ptr::null_mut())) };
        created.map(|_| ())
    })
}

/// Gives the tracker other numbers: a moving radar's place before each scan, for example. The tracks stay. A log goes on with
/// another [`boresight_log_header`].
///
/// # Safety
/// Both are NULL or valid, `tracker` by [`boresight_create`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_configure(tracker: *mut Tracker, parameters: *const Parameters) -> Status {
    status(|| {
        // SAFETY: as the caller says.
        let (tracking, parameters) = unsafe { (kind::find(tracker)?, read(parameters)?) };
        Ok(tracking.configure(parameters)?)
    })
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
    status(|| {
        let detections = match count {
            0 => &[],
            _ if count > isize::MAX as usize / size_of::<Detection>() => return Err(Status::Count),
            _ => {
                check(detections)?;
                // SAFETY: neither NULL nor misaligned, and as many as the caller says; their bytes are less than an address space.
                unsafe { slice::from_raw_parts(detections, count) }
            }
        };
        if !report.is_null() {
            check(report)?;
        }
        // SAFETY: as the caller says.
        let made = unsafe { kind::find(tracker)? }.step(time_us, detections)?;
        if !report.is_null() {
            // SAFETY: neither NULL nor misaligned, so it can be written.
            unsafe { report.write(made) };
        }
        Ok(())
    })
}

/// Writes the live tracks to `tracks`, at most `capacity` of them, and to `count` how many there are; that may be more.
///
/// # Safety
/// Every pointer is NULL or valid; `tracks` has room for `capacity` tracks, or is NULL with a `capacity` of 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_tracks(tracker: *mut Tracker, tracks: *mut Track, capacity: usize, count: *mut usize) -> Status {
    status(|| {
        check(count)?;
        if capacity > 0 {
            check(tracks)?;
        }
        let mut live = 0;
        // SAFETY: as the caller says.
        unsafe { kind::find(tracker)? }.tracks(&mut |track| {
            if live < capacity {
                // SAFETY: within `capacity` tracks that can be written.
                unsafe { tracks.add(live).write(track) };
            }
            live += 1;
        });
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { count.write(live) };
        Ok(())
    })
}

/// Writes all that is known of the track `id` to `density`.
///
/// # Safety
/// Both are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_track_density(tracker: *mut Tracker, id: u32, density: *mut Density) -> Status {
    status(|| {
        check(density)?;
        // SAFETY: as the caller says.
        let known = unsafe { kind::find(tracker)? }.density(id).ok_or(Status::NoTrack)?;
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { density.write(known) };
        Ok(())
    })
}

/// Writes what a log begins with to `out`, and its length to `length`: BORESIGHT_LOG_HEADER. `kind` and `parameters` are those that the
/// tracker was created with, or, where the log goes on after [`boresight_configure`], has now. The log is for `host-tests
/// replay-log`, which does the same again to the same bits.
///
/// # Safety
/// Every pointer is NULL or valid; `out` has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_log_header(
    kind: *const Kind,
    parameters: *const Parameters,
    out: *mut u8,
    capacity: usize,
    length: *mut usize,
) -> Status {
    status(|| {
        check(length)?;
        // SAFETY: as the caller says; a kind is a static.
        let (kind, parameters, out) = unsafe { (read(kind)?, read(parameters)?, room(out, capacity)?) };
        let written = (kind.header)(parameters, out)?;
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { length.write(written) };
        Ok(())
    })
}

/// Writes the record of the last scan, taken in or refused, to `out`, and its length to `length`. A scan has one record; one that got
/// none is a gap that the desk finds. BORESIGHT_LOG_RECORD bytes are enough for every ready configuration, and asked for whatever
/// the scan.
///
/// # Safety
/// Every pointer is NULL or valid, `tracker` by [`boresight_create`]; `out` has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn boresight_log_scan(tracker: *mut Tracker, out: *mut u8, capacity: usize, length: *mut usize) -> Status {
    status(|| {
        check(length)?;
        // SAFETY: as the caller says.
        let (tracking, out) = unsafe { (kind::find(tracker)?, room(out, capacity)?) };
        let written = tracking.record(out)?;
        // SAFETY: neither NULL nor misaligned, so it can be written.
        unsafe { length.write(written) };
        Ok(())
    })
}

/// None is reached: the symbols of the example in C are checked for it.
#[cfg(all(target_os = "none", feature = "panic-handler"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
