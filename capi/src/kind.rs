//! The border itself: a tracker in memory that C owns, and back from its address. This file and `lib.rs` hold all unsafe code.
//!
//! ```text
//! address     Head: seal, kind     written last by `create`
//! + 8 or 16   Instance             tracker, sensor, state, plots, and what its log is to tell next
//! ```
//!
//! A tracker holds no pointer to itself: C may copy its memory as a whole.

use crate::tracking::{self, Configuration, Instance, Tracking};
use crate::types::{BORESIGHT_ALIGN, BORESIGHT_COMPONENTS, BORESIGHT_MODES, BORESIGHT_STATES, Status};
use boresight::error::ConfigError;
use boresight::log::{LogError, Recorder};
use boresight::plots::Plots;
use boresight::ready::Parameters;
use core::ffi::c_void;

/// What marks a tracker, combined with the address of its kind.
const SEAL: usize = 0xb0e5_1947;

/// One configuration: how large its trackers are, how they are made and found. C knows it by address only.
pub struct Kind {
    size: usize,
    pub(crate) defaults: fn() -> Parameters,
    pub(crate) header: fn(&Parameters, &mut [u8]) -> Result<usize, LogError>,
    place: unsafe fn(*mut Head, &Parameters) -> Result<(), ConfigError>,
    attach: unsafe fn(*mut Head) -> *mut dyn Tracking,
}

/// A tracker in the caller's memory, which C knows by address only.
pub struct Tracker {
    _memory: [u8; 0],
}

/// What a tracker begins with; what follows depends on its kind.
#[repr(C, align(8))]
struct Head {
    seal: usize,
    kind: *const Kind,
}

#[repr(C)]
struct Placed<I> {
    head: Head,
    instance: I,
}

impl Kind {
    /// The kind of the configuration `C`, for a `static` that C knows as `extern const boresight_kind`.
    #[must_use]
    pub const fn of<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>() -> Self
    where
        C: Configuration<NX, MODES, NZ> + 'static,
    {
        const {
            assert!(NX <= BORESIGHT_STATES && MODES <= BORESIGHT_MODES && NZ <= BORESIGHT_COMPONENTS, "more than C's structures hold");
            assert!(align_of::<Placed<Instance<C, NX, MODES, NZ, TRACKS, DETS>>>() <= BORESIGHT_ALIGN, "aligned more than C's memory");
        }
        Self {
            size: size_of::<Placed<Instance<C, NX, MODES, NZ, TRACKS, DETS>>>(),
            defaults: C::defaults,
            header: tracking::header::<C, NX, MODES, NZ, TRACKS, DETS>,
            place: place::<C, NX, MODES, NZ, TRACKS, DETS>,
            attach: attach::<C, NX, MODES, NZ, TRACKS, DETS>,
        }
    }

    /// Bytes that a tracker needs.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.size
    }

    /// Makes a tracker at `memory`.
    ///
    /// # Safety
    /// `memory` is NULL or `size` bytes that nobody else uses in the meantime.
    pub(crate) unsafe fn create(&'static self, memory: *mut c_void, size: usize, parameters: &Parameters) -> Result<*mut Tracker, Status> {
        let head = memory.cast::<Head>();
        if head.is_null() {
            return Err(Status::Null);
        }
        if size < self.size || !memory.addr().is_multiple_of(BORESIGHT_ALIGN) {
            return Err(Status::Memory);
        }
        // SAFETY: `place` and `self.size` belong to one configuration; size and alignment have been checked.
        unsafe { (self.place)(head, parameters)? };
        let kind: *const Kind = self;
        // SAFETY: the memory begins with a head; only now is it a tracker.
        unsafe { head.write(Head { seal: SEAL ^ kind.addr(), kind }) };
        Ok(head.cast())
    }
}

/// What is behind the address `tracker`.
///
/// # Safety
/// It is NULL or points to initialised memory of at least a head, and where it bears the seal, to what
/// [`Kind::create`] has made or to a copy of it. Nobody else uses it while the reference lives.
pub(crate) unsafe fn find<'a>(tracker: *mut Tracker) -> Result<&'a mut dyn Tracking, Status> {
    let head = tracker.cast::<Head>();
    if head.is_null() {
        return Err(Status::Null);
    }
    if !head.addr().is_multiple_of(BORESIGHT_ALIGN) {
        return Err(Status::Memory);
    }
    // SAFETY: not NULL, aligned, initialised; any bits are a head.
    let Head { seal, kind } = unsafe { head.read() };
    if kind.is_null() || seal ^ kind.addr() != SEAL {
        return Err(Status::NoTracker);
    }
    // SAFETY: the seal says that `create` has written `kind`, which is the address of a static, and with it an instance of that
    // kind; the caller says that nobody else uses it.
    Ok(unsafe { &mut *((*kind).attach)(head) })
}

/// # Safety
/// `head` points to memory of the size and alignment of this configuration.
unsafe fn place<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>(
    head: *mut Head,
    parameters: &Parameters,
) -> Result<(), ConfigError>
where
    C: Configuration<NX, MODES, NZ>,
{
    let (tracker, sensor) = C::build(parameters)?;
    let placed = head.cast::<Placed<Instance<C, NX, MODES, NZ, TRACKS, DETS>>>();
    // SAFETY: within memory of this size and alignment; what was there before needs no drop. Part by part: the whole would pass
    // through the stack.
    unsafe {
        (&raw mut (*placed).instance.tracker).write(tracker);
        (&raw mut (*placed).instance.sensor).write(sensor);
        (&raw mut (*placed).instance.state).write(Default::default());
        (&raw mut (*placed).instance.plots).write(Plots::new());
        (&raw mut (*placed).instance.log).write(Recorder::new());
        (&raw mut (*placed).instance.last).write(None);
    }
    Ok(())
}

/// # Safety
/// `head` points to memory in which [`place`] of the same configuration has succeeded.
unsafe fn attach<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>(
    head: *mut Head,
) -> *mut dyn Tracking
where
    C: Configuration<NX, MODES, NZ> + 'static,
{
    let placed = head.cast::<Placed<Instance<C, NX, MODES, NZ, TRACKS, DETS>>>();
    // SAFETY: within the same memory.
    unsafe { &raw mut (*placed).instance }
}
