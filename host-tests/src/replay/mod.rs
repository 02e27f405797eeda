//! The command `replay`: recorded plots through a tracker.
//!
//! | module | holds |
//! |---|---|
//! | [`recording`] | [`Recording`]: scans, detections and truth in one form |
//! | `csv`, `json` | the two file formats |
//! | [`config`] | sensors and tracker, described in TOML |
//! | `modes`, `sensor` | the library's models put together as described |
//! | [`tracking`], [`history`] | the run, scan by scan, and what came of it |
//! | [`judge`], [`summary`] | how good the tracks are, where the truth is known; the result in numbers |
//! | [`tables`], [`map`] | the tracks as CSV and JSON, and as a picture |
//!
//! This file carries the command out: everything is read, checked, computed and drawn before the first file is
//! written. With `--out` those are `tracks.csv`, `tracks.json`, `replay.json` (the summary), `scene.svg` (the whole map)
//! and `tracks.svg` (the map around the truth, or the whole where there is none).

pub mod config;
mod csv;
pub mod history;
mod json;
pub mod judge;
pub mod map;
mod modes;
pub mod recording;
mod sensor;
pub mod summary;
pub mod tables;
pub mod tracking;

use crate::{Failure, Precision, output};
use config::{Config, TrackerPlan};
pub use recording::{Component, Components, Frame, Plot, Recording, ScanRecord, TruthPoint};
use std::path::PathBuf;

/// The command `replay` as the user gave it.
#[derive(Debug, Clone)]
pub struct Request {
    /// The recorded plots.
    pub plots: PathBuf,
    /// Sensors and tracker, if described.
    pub config: Option<PathBuf>,
    /// Scalar type of the tracker.
    pub precision: Precision,
    /// Directory for tracks, picture and result, if given; created when missing.
    pub out: Option<PathBuf>,
    /// The result file, if given.
    pub json: Option<PathBuf>,
}

/// Runs the tracker over the recording, writes what was asked for and prints the result.
pub fn run(request: &Request) -> Result<(), Failure> {
    let recording = Recording::read(&request.plots)?;
    for sensor in recording.sensors() {
        recording.components(sensor).map_err(|failure| failure.in_file(&request.plots))?;
    }
    let config = match &request.config {
        Some(file) => Config::read(file, &recording)?,
        None => Config::default(),
    };
    if let Some(file) = &request.json {
        output::check_target(file)?;
    }
    let place = request.config.as_ref().unwrap_or(&request.plots);
    let plan = TrackerPlan::new(&config, &recording).map_err(|failure| failure.in_file(place))?;
    let history = tracking::track(&recording, &config, &plan, request.precision).map_err(|failure| failure.in_file(place))?;
    let summary = summary::summary(&recording, &history, &plan, request.precision);
    if let Some(dir) = &request.out {
        let name = request.plots.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let draw = |limits| map::map(&recording, &config, &history, &format!("{name}: plots and confirmed tracks"), limits).render();
        let (scene, closer) = (draw(None)?, map::around_truth(&recording).map(|limits| draw(Some(limits))).transpose()?);
        let (csv, json) = (tables::csv(&recording, &history), tables::json(&recording, &history));
        output::create_directory(dir)?;
        output::write_file(&dir.join("tracks.csv"), csv.as_bytes())?;
        output::write_file(&dir.join("tracks.json"), json.as_bytes())?;
        let tracks = closer.as_ref().unwrap_or(&scene);
        output::write_file(&dir.join("tracks.svg"), tracks.as_bytes())?;
        output::write_file(&dir.join("scene.svg"), scene.as_bytes())?;
        output::write_json(&dir.join("replay.json"), &summary)?;
    }
    if let Some(file) = &request.json {
        output::write_json(file, &summary)?;
    }
    output::print(&summary::table(&summary, &request.plots.display().to_string()))
}
