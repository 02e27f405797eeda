//! One tracker under load, to be counted: the image of one line of the budget.
//!
//! Which tracker: the environment variable `BORESIGHT_TRACKER` of the build, see `build.rs`. The scans are those of the module
//! `twin::load`. Only `step` is the tracker's; it is exported by this name, for any tool that traces calls. `crowd` begins each
//! round of the adversarial scenario, so its calls tell the two scenarios apart.
//!
//! Ends with status 0 if no scan was refused and the targets were found, otherwise with 1. Nothing here prints.

#![no_std]
#![no_main]

use boresight::error::ConfigError;
use boresight::scan::Scan;
use boresight::time::Instant;
use boresight::track::Status;
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::load::{self, Room, Subject};
use twin::loaded::Loaded;

/// `Tracker`, `State` and `Sensor`, which `sensor` makes, `NX`, `MODES`, `TRACKS` and `DETS`, `MOST_RAM` in bytes, and whether the
/// sensor is `UNRESOLVING`.
mod configuration {
    include!(concat!(env!("OUT_DIR"), "/configuration.rs"));
}
use configuration::{DETS, MODES, MOST_RAM, NX, Sensor, State, TRACKS, Tracker, UNRESOLVING, sensor};

const _: () = assert!(size_of::<State>() <= MOST_RAM, "the state is larger than its budget");

struct Load {
    tracker: Tracker,
    sensor: Sensor,
    state: &'static mut State,
}

#[unsafe(no_mangle)]
#[inline(never)]
fn step(load: &mut Load, scan: &Scan<'_, f32, 2>) -> bool {
    load.tracker.step(load.state, &load.sensor, scan).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn crowd(load: &mut Load, at: Instant) {
    load.tracker.crowd(load.state, TRACKS, at);
}

impl Subject for Load {
    fn crowd(&mut self, at: Instant) {
        crowd(self, at);
    }

    fn step(&mut self, scan: &Scan<'_, f32, 2>) -> bool {
        step(self, scan)
    }

    fn confirmed(&self) -> usize {
        self.state.tracks().filter(|track| track.status() != Status::Tentative).count()
    }

    fn unresolving(&self) -> bool {
        UNRESOLVING
    }
}

#[entry]
fn main() -> ! {
    static mut STATE: State = State::new();
    exit(run(STATE) == Ok(true))
}

fn run(state: &'static mut State) -> Result<bool, ConfigError> {
    let room = Room { tracks: TRACKS, detections: DETS };
    let mut load = Load { tracker: <Tracker as Loaded<NX, MODES>>::new()?, sensor: sensor(room)?, state };
    Ok(load::run(&mut load, room))
}

firmware_example::silent!();
