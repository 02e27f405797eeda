//! Puts the board's `memory.x` where the linker looks and passes the linker scripts; tells the image `tracker` which tracker.
//!
//! ```text
//! BORESIGHT_TRACKER    KIND STATESxMODES TRACKSxDETS [NODES [PAIRS]]      "imm-jpda 4x3 16x32 64" if not set
//! BORESIGHT_MOST_RAM   bytes that the tracker's state may have    all of the board's if not set
//! ```

use std::{env, fs, path::PathBuf};

/// Images that log through defmt.
const WITH_DEFMT: [&str; 1] = ["demo"];
/// Images that print plain text, or nothing.
const WITHOUT_DEFMT: [&str; 11] =
    ["budget", "coupled", "empty", "fusion", "glmb", "kernels", "memory", "record", "selftest", "tracker", "unfused"];

/// A library built with defmt support leaves sections that only defmt's script places.
const NO_DEFMT_X: &str = "SECTIONS { /DISCARD/ : { *(.defmt .defmt.*); } }\n";

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("../memory.x", out.join("memory.x")).expect("memory.x is at the repository root");
    fs::write(out.join("no-defmt.x"), NO_DEFMT_X).expect("OUT_DIR is writable");
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-search={}", out.display());

    let tracker = env::var("BORESIGHT_TRACKER").unwrap_or_else(|_| "imm-jpda 4x3 16x32 64".into());
    let most_ram = env::var("BORESIGHT_MOST_RAM").unwrap_or_else(|_| "4 * 1024 * 1024".into());
    let types = configuration(&tracker, &most_ram).unwrap_or_else(|| panic!("no such tracker: {tracker}"));
    fs::write(out.join("configuration.rs"), types).expect("OUT_DIR is writable");
    println!("cargo:rerun-if-env-changed=BORESIGHT_TRACKER");
    println!("cargo:rerun-if-env-changed=BORESIGHT_MOST_RAM");

    // FLASH and RAM segments are not page-aligned.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    for bin in WITH_DEFMT {
        println!("cargo:rustc-link-arg-bin={bin}=-Tdefmt.x");
    }
    for bin in WITHOUT_DEFMT {
        println!("cargo:rustc-link-arg-bin={bin}=-Tno-defmt.x");
    }
}

/// The types of the image `tracker`: another tracker is another arm here, and an implementation of `twin::loaded::Loaded`.
fn configuration(tracker: &str, most_ram: &str) -> Option<String> {
    let mut words = tracker.split_whitespace();
    let (kind, motion, room) = (words.next()?, words.next()?, words.next()?);
    let (tracks, dets) = room.split_once('x')?;
    let (modes, nx, mode_count) = match motion {
        "4x3" => ("Turning", 4, 3),
        "4x7" => ("ManyTurns", 4, 7),
        "6x2" => ("Accelerating", 6, 2),
        _ => return None,
    };
    let coarse = kind == "merging-jpda";
    let (tracker, state) = match (kind, words.next()) {
        ("imm-pdaf", None) => ("ImmPdaf<f32, Modes, NX, MODES, TRACKS, DETS>".into(), "State<f32, NX, MODES, TRACKS, DETS>".into()),
        ("imm-gnn", None) => {
            ("ImmJpda<f32, Modes, NX, MODES, TRACKS, DETS, Gnn>".into(), "JointState<f32, NX, MODES, TRACKS, DETS, Gnn>".into())
        }
        ("imm-jpda", Some(nodes)) => (
            format!("ImmJpda<f32, Modes, NX, MODES, TRACKS, DETS, Jpda<{nodes}>>"),
            format!("JointState<f32, NX, MODES, TRACKS, DETS, Jpda<{nodes}>>"),
        ),
        ("merging-jpda", Some(nodes)) => {
            let joint = format!("MergingJpda<{nodes}, {}>", words.next()?);
            (format!("ImmJpda<f32, Modes, NX, MODES, TRACKS, DETS, {joint}>"), format!("JointState<f32, NX, MODES, TRACKS, DETS, {joint}>"))
        }
        ("lms-jpda", Some(nodes)) => (
            format!("LmsJpda<f32, Modes, NX, MODES, TRACKS, DETS, Jpda<{nodes}>>"),
            format!("LmsState<f32, NX, MODES, TRACKS, DETS, Jpda<{nodes}>>"),
        ),
        _ => return None,
    };
    let (sensor, make) = if coarse { ("Coarse", "coarse") } else { ("Sensor", "sensor") };
    Some(format!(
        "#[allow(unused_imports)]\n\
         use boresight::{{association::{{Gnn, Jpda, MergingJpda}}, error::ConfigError, tracker}};\n\
         use twin::load::{{self, Room}};\n\
         pub const NX: usize = {nx};\n\
         pub const MODES: usize = {mode_count};\n\
         pub const TRACKS: usize = {tracks};\n\
         pub const DETS: usize = {dets};\n\
         pub const MOST_RAM: usize = {most_ram};\n\
         type Modes = twin::loaded::{modes};\n\
         pub type Tracker = tracker::{tracker};\n\
         pub type State = tracker::{state};\n\
         pub type Sensor = load::{sensor}<{{ NX / 2 }}>;\n\
         pub const UNRESOLVING: bool = {coarse};\n\
         pub fn sensor(room: Room) -> Result<Sensor, ConfigError> {{\n    room.{make}()\n}}\n"
    ))
}
