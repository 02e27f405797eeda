//! Tracks as files: `tracks.csv`, one row for each track and scan, and `tracks.json`, one entry for each track.
//!
//! | column | holds |
//! |---|---|
//! | `t_us`, `sensor` | the scan after which the track stands so: time in microseconds, sensor |
//! | `id` | the track, from 1 in order of birth, never used twice |
//! | `status` | `tentative`, `confirmed`, or `coasting`: confirmed, but not seen in this scan |
//! | `moving` | 1 from where it is known to move, see [`super::history`] |
//! | `x`, `vx`, .. | the combined estimate over all modes, in the frame of the recording (m, m/s, m/s²) |
//! | `std_x`, `std_vx`, .. | its standard deviations |
//! | `p_1`, `p_2`, .. | the mode probabilities |
//!
//! The JSON holds the same: `{"states": [..], "tracks": [{"id", "points": [{"t_us", "sensor", "status", "moving",
//! "mean": [..], "std": [..], "modes": [..]}, ..]}, ..]}`.

use super::history::{History, Tracked};
use super::recording::Recording;
use boresight::track::Status;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The text of `tracks.csv`.
#[must_use]
pub fn csv(recording: &Recording, history: &History) -> String {
    let states = history.state.names();
    let modes = history.tracks().map(|track| track.modes.len()).max().unwrap_or(0);
    let deviations = states.iter().map(|state| format!("std_{state}"));
    let columns = states.iter().map(|state| (*state).to_owned()).chain(deviations).chain((1..=modes).map(|mode| format!("p_{mode}")));
    let mut text = "t_us,sensor,id,status,moving".to_owned();
    columns.for_each(|column| text.extend([",", &column]));
    text.push('\n');
    for moment in &history.moments {
        for track in &moment.tracks {
            // Writing to a string cannot fail.
            let sensor = quoted(sensor(recording, moment.scan));
            let _ = write!(text, "{},{sensor},{},{},{}", moment.time_us, track.id, status(track), u8::from(track.moving));
            for value in track.mean.iter().chain(&track.std) {
                let _ = write!(text, ",{value:.4}");
            }
            for p in &track.modes {
                let _ = write!(text, ",{p:.5}");
            }
            text.push('\n');
        }
    }
    text
}

/// The text of `tracks.json`, a line for each track.
#[must_use]
pub fn json(recording: &Recording, history: &History) -> String {
    let mut tracks: BTreeMap<u32, Vec<Value>> = BTreeMap::new();
    for moment in &history.moments {
        for track in &moment.tracks {
            tracks.entry(track.id).or_default().push(json!({
                "t_us": moment.time_us,
                "sensor": sensor(recording, moment.scan),
                "status": status(track),
                "moving": track.moving,
                "mean": track.mean,
                "std": track.std,
                "modes": track.modes,
            }));
        }
    }
    let lines: Vec<String> = tracks.into_iter().map(|(id, points)| json!({"id": id, "points": points}).to_string()).collect();
    format!("{{\"states\": {}, \"tracks\": [\n{}\n]}}\n", json!(history.state.names()), lines.join(",\n"))
}

fn sensor(recording: &Recording, scan: usize) -> &str {
    recording.scans.get(scan).map_or("", |scan| &scan.sensor)
}

fn status(track: &Tracked) -> &'static str {
    match track.status {
        Status::Tentative => "tentative",
        Status::Confirmed => "confirmed",
        Status::Coasting => "coasting",
    }
}

/// A name as a CSV cell.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::history::tests::{Listed, history};
    use super::super::recording::tests::recording;
    use super::*;
    use boresight::track::Status::{Coasting, Confirmed, Tentative};

    #[test]
    fn both_files_hold_every_track_after_every_scan() -> Result<(), Box<dyn std::error::Error>> {
        let recording = recording("t_us,sensor,x,y\n0,\"r,1\",1,2\n1000000,s,1,2\n")?;
        let moments: [Listed<'_>; 2] =
            [(0, 0, &[(1, Tentative, 1.0, 2.0)]), (1, 1, &[(1, Confirmed, 1.5, 30.0), (4, Coasting, -7.0, 8.0)])];
        let history = history(&moments, 20.0);
        let expected = "t_us,sensor,id,status,moving,x,vx,y,vy,std_x,std_vx,std_y,std_vy,p_1,p_2\n\
            0,\"r,1\",1,tentative,0,1.0000,1.0000,2.0000,2.0000,0.5000,0.5000,0.5000,0.5000,0.25000,0.75000\n\
            1000000,s,1,confirmed,1,1.5000,1.0000,30.0000,2.0000,0.5000,0.5000,0.5000,0.5000,0.25000,0.75000\n\
            1000000,s,4,coasting,0,-7.0000,1.0000,8.0000,2.0000,0.5000,0.5000,0.5000,0.5000,0.25000,0.75000\n";
        assert_eq!(csv(&recording, &history), expected);
        let read: Value = serde_json::from_str(&json(&recording, &history))?;
        assert_eq!(read["states"], json!(["x", "vx", "y", "vy"]));
        assert_eq!(read["tracks"][0]["points"][1]["mean"], json!([1.5, 1.0, 30.0, 2.0]));
        assert_eq!((&read["tracks"][1]["id"], &read["tracks"][1]["points"][0]["status"]), (&json!(4), &json!("coasting")));
        Ok(())
    }
}
