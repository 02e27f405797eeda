//! What the budget covers: trackers and their capacities, kernels, pieces.
//!
//! A new kind of tracker is an entry of [`KINDS`], an arm of `configuration` in firmware-example/build.rs and a row of
//! firmware-example/src/bin/memory.rs.

use super::image::Image;
use crate::Failure;
use serde::{Deserialize, Serialize};

/// The kinds of tracker, each with its states and modes. The two of seven modes are one tracker but for those that it runs.
const KINDS: [(Kind, (usize, usize)); 10] = [
    (Kind::ImmPdaf, (4, 3)),
    (Kind::ImmPdaf, (6, 2)),
    (Kind::ImmGnn, (4, 3)),
    (Kind::ImmJpda { nodes: 64 }, (4, 3)),
    (Kind::ImmJpda { nodes: 64 }, (6, 2)),
    (Kind::ImmJpda { nodes: 256 }, (4, 3)),
    (Kind::ImmJpda { nodes: 256 }, (6, 2)),
    (Kind::ImmJpda { nodes: 64 }, (4, 7)),
    (Kind::LmsJpda { nodes: 64 }, (4, 7)),
    (Kind::MergingJpda { nodes: 256, pairs: 4 }, (4, 3)),
];
/// Tracks and detections
pub const ROOMS: [(usize, usize); 3] = [(4, 8), (16, 32), (32, 64)];

/// Tracks and detections of the table of sizes, as in firmware-example/src/bin/memory.rs.
pub const TRACKS: [usize; 3] = [4, 16, 32];
/// See [`TRACKS`].
pub const DETECTIONS: [usize; 3] = [8, 32, 64];

/// What the image `budget` exports.
pub const KERNELS: [&str; 4] = ["imm6_step", "imm4_step", "jpda_marginals", "kf4_step"];
/// What the image `kernels` exports.
pub const PIECES: [&str; 11] = [
    "ekf2_update_4",
    "ekf3_update_4",
    "ekf4_update_9",
    "ukf4_update_9",
    "convert_polar",
    "turn_predict_5",
    "mix3_4",
    "mix7_4",
    "gate64_polar",
    "gate64_plane",
    "cluster16_32",
];
/// What the image `fusion` exports: a list taken in, and two made one picture. The latter is called twice with tracks that are
/// apart, then twice in a crowd.
pub const FUSION: [&str; 2] = ["receive16", "fuse16_16"];

/// A kind of tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Every track associated as if it were alone
    ImmPdaf,
    /// The best assignment of all tracks taken for certain
    ImmGnn,
    /// All tracks associated together
    ImmJpda {
        /// Room for sets of served tracks
        nodes: usize,
    },
    /// The same, of whose modes every track runs the likely ones
    LmsJpda {
        /// Room for sets of served tracks
        nodes: usize,
    },
    /// Those associated together, with pairs that the sensor may not tell apart
    MergingJpda {
        /// Room for sets of served tracks
        nodes: usize,
        /// Room for pairs
        pairs: usize,
    },
}

impl Kind {
    /// What it is called, and its nodes and pairs where it has any.
    const fn words(self) -> (&'static str, [Option<usize>; 2]) {
        match self {
            Kind::ImmPdaf => ("imm-pdaf", [None; 2]),
            Kind::ImmGnn => ("imm-gnn", [None; 2]),
            Kind::ImmJpda { nodes } => ("imm-jpda", [Some(nodes), None]),
            Kind::LmsJpda { nodes } => ("lms-jpda", [Some(nodes), None]),
            Kind::MergingJpda { nodes, pairs } => ("merging-jpda", [Some(nodes), Some(pairs)]),
        }
    }

    /// Whether a tracker of this kind with such capacities is counted: a sweep needs a node for every detection and one more, and the
    /// pairs of a crowd of 32 tracks take more of an emulator's time than they tell.
    fn takes(self, (tracks, detections): (usize, usize)) -> bool {
        let (_, [nodes, pairs]) = self.words();
        nodes.is_none_or(|nodes| nodes > detections) && (pairs.is_none() || tracks <= 16)
    }
}

/// A tracker with its capacities.
#[derive(Debug, Clone, Copy)]
pub struct Tracker {
    pub kind: Kind,
    pub states: usize,
    pub modes: usize,
    pub tracks: usize,
    pub detections: usize,
}

impl Tracker {
    /// As the build of the image reads it.
    pub fn name(&self) -> String {
        let Self { kind, states, modes, tracks, detections } = self;
        name(*kind, &format!("{states}x{modes} {tracks}x{detections}"))
    }
}

fn name(kind: Kind, sizes: &str) -> String {
    let (word, room) = kind.words();
    room.into_iter().flatten().fold(format!("{word} {sizes}"), |name, room| format!("{name} {room}"))
}

/// All trackers of the budget.
pub fn trackers() -> impl Iterator<Item = Tracker> {
    KINDS.into_iter().flat_map(|(kind, (states, modes))| {
        let rooms = ROOMS.into_iter().filter(move |room| kind.takes(*room));
        rooms.map(move |(tracks, detections)| Tracker { kind, states, modes, tracks, detections })
    })
}

/// Bytes of the states of one kind and motion: a row for every number of tracks, a column for every number of detections.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    pub name: String,
    pub bytes: [[u64; 3]; 3],
}

/// Bytes of all states, by kind and motion.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Sizes(pub Vec<Row>);

impl Sizes {
    /// Bytes of one tracker's state.
    pub fn ram(&self, tracker: &Tracker) -> Result<u64, Failure> {
        let row = self.0.iter().find(|row| row.name == row_name((tracker.kind, (tracker.states, tracker.modes))));
        let place = |list: [usize; 3], wanted| list.iter().position(|n| *n == wanted);
        let found = row.zip(place(TRACKS, tracker.tracks)).zip(place(DETECTIONS, tracker.detections));
        found.map(|((row, t), d)| row.bytes[t][d]).ok_or_else(|| Failure::input("not in the table of sizes").within(tracker.name()))
    }
}

/// Bytes of the picture of the image `fusion`, as the image `memory` tells them.
pub fn picture(memory: &Image) -> Result<u64, Failure> {
    let bytes = memory.data("PICTURE")?;
    let word = bytes.as_array().ok_or_else(|| Failure::input("PICTURE is not one number"))?;
    Ok(u64::from(u32::from_le_bytes(*word)))
}

/// The table `STATES` of the image `memory`.
pub fn sizes(memory: &Image) -> Result<Sizes, Failure> {
    let bytes = memory.data("STATES")?;
    let (words, _) = bytes.as_chunks::<4>();
    let (rows, _) = words.as_chunks::<3>();
    let (tables, _) = rows.as_chunks::<3>();
    if tables.len() != KINDS.len() {
        return Err(Failure::input("the table STATES has another shape than the budget"));
    }
    let row = |(kind, table): (_, &[[[u8; 4]; 3]; 3])| Row {
        name: row_name(kind),
        bytes: table.map(|row| row.map(|word| u64::from(u32::from_le_bytes(word)))),
    };
    Ok(Sizes(KINDS.into_iter().zip(tables).map(row).collect()))
}

/// The kind that a row of sizes is of.
fn row_name((kind, (states, modes)): (Kind, (usize, usize))) -> String {
    name(kind, &format!("{states}x{modes}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jpda_with_too_few_nodes_is_left_out() {
        assert_eq!(trackers().count(), 25);
        assert!(trackers().all(|tracker| tracker.name() != "imm-jpda 4x3 32x64 64"));
        assert!(trackers().any(|tracker| tracker.name() == "merging-jpda 4x3 16x32 256 4"));
    }
}
