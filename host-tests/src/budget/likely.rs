//! What the likely-model set saves: how many modes ran, beside how much work was done.
//!
//! The images only count instructions. Which modes ran, the same tracker tells on the desk, on the same scans: its bits are those of
//! the target.

use super::configuration::{Kind, Tracker};
use crate::Failure;
use boresight::association::Jpda;
use boresight::scan::Scan;
use boresight::time::Instant;
use boresight::track::Status;
use boresight::tracker::{ImmJpda, LmsJpda};
use serde::{Deserialize, Serialize};
use twin::load::{self, Room, Sensor, Subject};
use twin::loaded::{Loaded, ManyTurns};

/// The modes of [`ManyTurns`].
const MODES: usize = 7;

/// Over the recorded scenario: a track counts once a scan, a mode once a track and scan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Runs {
    pub tracks: u64,
    pub modes: u64,
}

/// The runs of a tracker of many modes; none of the others.
pub fn runs(tracker: &Tracker) -> Result<Option<Runs>, Failure> {
    type Imm<const TRACKS: usize, const DETS: usize> = ImmJpda<f32, ManyTurns, 4, MODES, TRACKS, DETS, Jpda<64>>;
    type Lms<const TRACKS: usize, const DETS: usize> = LmsJpda<f32, ManyTurns, 4, MODES, TRACKS, DETS, Jpda<64>>;
    let Tracker { kind, modes, tracks, detections, .. } = *tracker;
    if modes != MODES {
        return Ok(None);
    }
    let room = Room { tracks, detections };
    let runs = match (kind, tracks, detections) {
        (Kind::ImmJpda { nodes: 64 }, 4, 8) => count::<Imm<4, 8>>(room),
        (Kind::ImmJpda { nodes: 64 }, 16, 32) => count::<Imm<16, 32>>(room),
        (Kind::LmsJpda { nodes: 64 }, 4, 8) => count::<Lms<4, 8>>(room),
        (Kind::LmsJpda { nodes: 64 }, 16, 32) => count::<Lms<16, 32>>(room),
        _ => return Err(Failure::input("not run on the desk").within(tracker.name())),
    }?;
    // Without a set of likely modes all run, whatever their probability.
    Ok(Some(if let Kind::LmsJpda { .. } = kind { runs } else { Runs { modes: MODES as u64 * runs.tracks, ..runs } }))
}

/// A tracker on the recorded scans.
struct Counted<K: Loaded<4, MODES>> {
    tracker: K,
    sensor: Sensor<2>,
    state: Box<K::State>,
    room: Room,
    scans: usize,
    runs: Runs,
}

fn count<K: Loaded<4, MODES>>(room: Room) -> Result<Runs, Failure> {
    let (tracker, sensor) = (K::new().map_err(Failure::input)?, room.sensor().map_err(Failure::input)?);
    let mut counted = Counted { tracker, sensor, state: Box::default(), room, scans: 0, runs: Runs::default() };
    match load::run(&mut counted, room) {
        true => Ok(counted.runs),
        false => Err(Failure::check("a scan was refused, or the targets were not found")),
    }
}

impl<K: Loaded<4, MODES>> Subject for Counted<K> {
    fn crowd(&mut self, at: Instant) {
        self.tracker.crowd(&mut self.state, self.room.tracks, at);
    }

    fn step(&mut self, scan: &Scan<'_, f32, 2>) -> bool {
        let taken = self.tracker.step(&mut self.state, &self.sensor, scan).is_ok();
        self.scans += 1;
        if self.scans <= load::SCANS {
            for track in self.tracker.tracks(&self.state) {
                self.runs.tracks += 1;
                self.runs.modes += track.active().len() as u64;
            }
        }
        taken
    }

    fn confirmed(&self) -> usize {
        self.tracker.estimates(&self.state).filter(|estimate| estimate.status != Status::Tentative).count()
    }
}
