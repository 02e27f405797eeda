//! The command `replay`: recorded plots through a tracker.
//!
//! | module | holds |
//! |---|---|
//! | [`recording`] | [`Recording`]: scans, detections and truth in one form |
//! | `csv`, `json` | the two file formats |
//! | [`config`] | the sensors, described in TOML |
//!
//! This file reads and checks everything, says what was recorded and draws it. Positions on the map are
//! own position (or the resting sensor's) plus the detection's relative position.

pub mod config;
mod csv;
mod json;
pub mod recording;

use crate::picture::{Chart, Series};
use crate::{Failure, Precision, output};
use config::Config;
pub use recording::{Component, Components, Plot, Recording, ScanRecord, TruthPoint};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// The command `replay` as the user gave it.
#[derive(Debug, Clone)]
pub struct Request {
    /// The recorded plots.
    pub plots: PathBuf,
    /// The sensors, if described.
    pub config: Option<PathBuf>,
    /// Scalar type of the tracker.
    pub precision: Precision,
    /// Directory for pictures and results, if given; created when missing.
    pub out: Option<PathBuf>,
    /// The result file, if given.
    pub json: Option<PathBuf>,
}

/// What a recording holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of scans.
    pub scans: usize,
    /// From the first scan to the last \[s\].
    pub duration_s: f64,
    /// Number of targets of which the truth is known.
    pub targets: usize,
    /// Each sensor, in order of its first scan.
    pub sensors: Vec<SensorSummary>,
}

/// What a recording holds of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorSummary {
    /// Its name.
    pub name: String,
    /// Number of its scans.
    pub scans: usize,
    /// Number of its detections.
    pub detections: usize,
}

/// Reads and checks the recording and the description of its sensors, then reports on them.
pub fn run(request: &Request) -> Result<(), Failure> {
    let recording = Recording::read(&request.plots)?;
    let config = match &request.config {
        Some(file) => Config::read(file, &recording)?,
        None => Config::default(),
    };
    if let Some(file) = &request.json {
        output::check_target(file)?;
    }
    if let Some(dir) = &request.out {
        output::create_directory(dir)?;
    }

    let summary = summary(&recording);
    if let Some(dir) = &request.out {
        let map = map(&recording, &config).render()?;
        output::write_file(&dir.join("plots.svg"), map.as_bytes())?;
        output::write_json(&dir.join("replay.json"), &summary)?;
    }
    if let Some(file) = &request.json {
        output::write_json(file, &summary)?;
    }
    let mut text = format!(
        "{}: {} scans in {:.1} s, truth of {} targets\n",
        request.plots.display(),
        summary.scans,
        summary.duration_s,
        summary.targets,
    );
    for SensorSummary { name, scans, detections } in &summary.sensors {
        let per_scan = *detections as f64 / *scans as f64;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "    {name}: {scans} scans, {detections} detections, {per_scan:.1} a scan");
    }
    output::print(&text)
}

/// Counts what the recording holds.
#[must_use]
pub fn summary(recording: &Recording) -> Summary {
    let of = |name: &str| {
        let scans = recording.scans.iter().filter(|scan| scan.sensor == name);
        let counts: Vec<usize> = scans.map(|scan| scan.detections.len()).collect();
        SensorSummary { name: name.to_owned(), scans: counts.len(), detections: counts.iter().sum() }
    };
    Summary {
        scans: recording.scans.len(),
        duration_s: recording.duration_s(),
        targets: truth_paths(recording).len(),
        sensors: recording.sensors().into_iter().map(of).collect(),
    }
}

/// The detections of every sensor, the truth and the sensor's own path on a map.
///
/// Plots lie below, so that tracks added to the chart lie above them.
#[must_use]
pub fn map(recording: &Recording, config: &Config) -> Chart {
    let mut chart = Chart::map("Recorded plots", "x [m]", "y [m]");
    for (index, name) in recording.sensors().into_iter().enumerate() {
        let resting = config.sensor(name).position;
        let scans = recording.scans.iter().filter(|scan| scan.sensor == name);
        let points = scans.flat_map(|scan| {
            let origin = scan.own.unwrap_or(resting);
            let absolute = move |[x, y, _]: [f64; 3]| [origin[0] + x, origin[1] + y];
            scan.detections.iter().filter_map(Plot::relative_position).map(absolute)
        });
        let plots = Series::clutter(format!("{name} plots"), points.collect());
        // The first sensor is grey; the others take colours that few tracks reach.
        chart = chart.with(if index == 0 { plots } else { plots.coloured(index + 4) });
    }
    let own = recording.scans.iter().filter_map(|scan| scan.own).map(|[x, y, _]| [x, y]);
    chart = chart.with(Series::reference("own path", own.collect()));
    truth_paths(recording).into_values().fold(chart, |chart, path| chart.with(Series::truth("truth", path)))
}

/// The true path of every target in the plane \[m\].
fn truth_paths(recording: &Recording) -> BTreeMap<u64, Vec<[f64; 2]>> {
    let mut paths: BTreeMap<u64, Vec<[f64; 2]>> = BTreeMap::new();
    for point in recording.scans.iter().flat_map(|scan| &scan.truth) {
        let [x, y, _] = point.position;
        paths.entry(point.id).or_default().push([x, y]);
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replay_says_what_was_recorded() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let plots = dir.path().join("plots.csv");
        std::fs::write(&plots, "t_us,sensor,range,azimuth\n0,radar,100,0.1\n0,radar,90,0.2\n2000000,radar,,\n")?;
        let out = dir.path().join("out");
        let request = Request { plots, config: None, precision: Precision::F32, out: Some(out.clone()), json: None };
        run(&request)?;
        let value: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out.join("replay.json"))?)?;
        assert_eq!(
            value,
            serde_json::json!({
                "scans": 2, "duration_s": 2.0, "targets": 0,
                "sensors": [{"name": "radar", "scans": 2, "detections": 2}],
            })
        );
        assert!(std::fs::read_to_string(out.join("plots.svg"))?.starts_with("<svg"));
        Ok(())
    }

    #[test]
    fn bad_plots_leave_nothing_behind() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let plots = dir.path().join("plots.csv");
        std::fs::write(&plots, "t_us,sensor,x,y\n0,radar,1,two\n")?;
        let out = dir.path().join("out");
        let request = Request { plots, config: None, precision: Precision::F32, out: Some(out.clone()), json: None };
        assert!(run(&request).is_err_and(|f| f.to_string().contains("line 2: column y")));
        assert!(!out.exists());
        Ok(())
    }
}
