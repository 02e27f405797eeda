//! Recorded plots as JSON: detections of a moving sensor, joined with the truth.
//!
//! ```text
//! {"meta": {..}, "scans": [{"t": s, "sensor": NAME, "own": [n, e], "z": [[n, e], ..],
//!                           "truth": [{"id": 1, "p": [n, e]}, ..]}, ..]}
//! ```
//!
//! `t` is in seconds and never decreases; it is rounded to microseconds. `own` is the sensor's position
//! in the frame of the truth, `z` a detection relative to it with the same axes, so own + z is a position
//! in that frame. All in metres; two coordinates, or three. North becomes x and east y. `own` and
//! `truth` may be left out.

use super::recording::{Component, Frame, Plot, Recording, ScanRecord, TruthPoint};
use crate::Failure;
use serde::Deserialize;
use std::path::Path;

/// Beyond this many seconds a time is not one: 2^53 us, where f64 stops counting microseconds.
const LAST_SECOND: f64 = 9.007e9;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "meta")]
    _meta: Option<serde_json::Value>,
    scans: Vec<Scan>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Scan {
    t: f64,
    sensor: String,
    own: Option<Vec<f64>>,
    z: Vec<Vec<f64>>,
    #[serde(default)]
    truth: Vec<Truth>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Truth {
    id: u64,
    p: Vec<f64>,
}

/// Reads the text of `file`.
pub(super) fn parse(file: &Path, text: &str) -> Result<Recording, Failure> {
    let content: File = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
        let message = error.to_string();
        let reason = message.split(" at line ").next().unwrap_or_default();
        Failure::at_line(file, error.line() as u64, format!("{reason} (column {})", error.column()))
    })?;
    let mut scans: Vec<ScanRecord> = Vec::with_capacity(content.scans.len());
    for (index, scan) in content.scans.into_iter().enumerate() {
        let record = scan.check(scans.last()).map_err(|failure| failure.within(format!("scans[{index}]")).in_file(file))?;
        scans.push(record);
    }
    match scans.is_empty() {
        true => Err(Failure::at_field("scans", "empty").in_file(file)),
        false => Ok(Recording { frame: Frame::NorthEast, scans }),
    }
}

impl Scan {
    /// The scan in the form of the program, if it makes sense after `before`.
    fn check(self, before: Option<&ScanRecord>) -> Result<ScanRecord, Failure> {
        if !(0.0..LAST_SECOND).contains(&self.t) {
            return Err(Failure::at_field("t", format!("{} is not a time in seconds >= 0", self.t)));
        }
        let time_us = (self.t * 1e6).round() as u64;
        if let Some(before) = before.filter(|before| before.time_us > time_us) {
            let earlier = before.time_us as f64 * 1e-6;
            let reason = format!("{} is before {earlier}, the time of the scan above", self.t);
            return Err(Failure::at_field("t", reason));
        }
        if self.sensor.is_empty() {
            return Err(Failure::at_field("sensor", "empty"));
        }
        let dimension = self.own.as_ref().or(self.z.first()).map_or(2, Vec::len);
        let own = self.own.map(|own| position("own", &own, dimension)).transpose()?;
        let detection = |(i, z): (usize, &Vec<f64>)| plot(&format!("z[{i}]"), z, dimension);
        let target = |(i, truth): (usize, &Truth)| {
            let position = position(&format!("truth[{i}].p"), &truth.p, dimension)?;
            Ok(TruthPoint { id: truth.id, position })
        };
        let truth: Vec<TruthPoint> = self.truth.iter().enumerate().map(target).collect::<Result<_, Failure>>()?;
        let repeated = |(i, point): &(usize, &TruthPoint)| truth[..*i].iter().any(|p| p.id == point.id);
        if let Some((i, point)) = truth.iter().enumerate().find(repeated) {
            let reason = format!("{} stands there twice", point.id);
            return Err(Failure::at_field(format!("truth[{i}].id"), reason));
        }
        Ok(ScanRecord {
            time_us,
            sensor: self.sensor,
            own,
            detections: self.z.iter().enumerate().map(detection).collect::<Result<_, _>>()?,
            truth,
        })
    }
}

/// Two or three finite coordinates, as many as the rest of the scan has.
fn position(field: &str, p: &[f64], dimension: usize) -> Result<[f64; 3], Failure> {
    // Infinite numbers cannot be written in JSON and its parser refuses those too large for f64.
    match *p {
        [x, y] if dimension == 2 => Ok([x, y, 0.0]),
        [x, y, z] if dimension == 3 => Ok([x, y, z]),
        [_, _] | [_, _, _] => {
            let reason = format!("{} coordinates where the scan has {dimension}", p.len());
            Err(Failure::at_field(field, reason))
        }
        _ => Err(Failure::at_field(field, format!("{} coordinates, not 2 or 3", p.len()))),
    }
}

fn plot(field: &str, z: &[f64], dimension: usize) -> Result<Plot, Failure> {
    position(field, z, dimension)?;
    let mut plot = Plot::default();
    let axes = [Component::X, Component::Y, Component::Z];
    axes.into_iter().zip(z).for_each(|(axis, &value)| plot.values.set(axis, value));
    Ok(plot)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Recording, Failure> {
        parse(Path::new("p.json"), text)
    }

    #[test]
    fn scans_keep_what_the_file_says() -> Result<(), Failure> {
        let recording = parsed(
            r#"{"meta": {"source": "a boat"}, "scans": [
                {"t": 0.3380864, "sensor": "lidar", "own": [-16.5, -390.0], "z": [], "truth": []},
                {"t": 1.5, "sensor": "radar", "own": [-16.0, -391.0], "z": [[10.0, 20.0]],
                 "truth": [{"id": 2, "p": [-6.0, -371.0]}]}]}"#,
        )?;
        assert_eq!(recording.scans[0].time_us, 338_086);
        assert!(recording.scans[0].detections.is_empty());
        let radar = &recording.scans[1];
        assert_eq!(radar.own, Some([-16.0, -391.0, 0.0]));
        assert_eq!(radar.detections[0].relative_position(), Some([10.0, 20.0, 0.0]));
        assert_eq!(radar.truth, [TruthPoint { id: 2, position: [-6.0, -371.0, 0.0] }]);
        assert!(recording.has_truth());
        Ok(())
    }

    #[test]
    fn resting_sensor_in_three_dimensions() -> Result<(), Failure> {
        let recording = parsed(r#"{"scans": [{"t": 0, "sensor": "r", "z": [[1, 2, 3]]}]}"#)?;
        assert_eq!(recording.scans[0].own, None);
        assert_eq!(recording.scans[0].detections[0].values.get(Component::Z), Some(3.0));
        Ok(())
    }

    #[test]
    fn complaints_name_the_place_and_the_reason() {
        let scan = |fields: &str| format!("{{\"scans\": [{{{fields}}}]}}");
        for (text, expected) in [
            ("{\"scans\": [".into(), "p.json, line 1: EOF while parsing a list (column 11)"),
            ("{\n\"scans\": [NaN]}".into(), "p.json, line 2: expected value (column 11)"),
            ("{}".into(), "p.json, line 1: missing field `scans` (column 2)"),
            ("{\"scans\": []}".into(), "p.json: scans: empty"),
            (scan("\"t\": 1e999, \"sensor\": \"r\", \"z\": []"), "p.json, line 1: number out of range (column 22)"),
            (scan("\"t\": -1, \"sensor\": \"r\", \"z\": []"), "p.json: scans[0]: t: -1 is not a time in seconds >= 0"),
            (scan("\"t\": 1, \"sensor\": \"\", \"z\": []"), "p.json: scans[0]: sensor: empty"),
            (scan("\"t\": 1, \"sensor\": \"r\", \"z\": [[1]]"), "p.json: scans[0]: z[0]: 1 coordinates, not 2 or 3"),
            (
                scan("\"t\": 1, \"sensor\": \"r\", \"own\": [1, 2, 3], \"z\": [[1, 2]]"),
                "p.json: scans[0]: z[0]: 2 coordinates where the scan has 3",
            ),
            (
                scan(
                    "\"t\": 1, \"sensor\": \"r\", \"z\": [], \
                   \"truth\": [{\"id\": 1, \"p\": [1, 2]}, {\"id\": 1, \"p\": [3, 4]}]",
                ),
                "p.json: scans[0]: truth[1].id: 1 stands there twice",
            ),
        ] {
            let told = parsed(&text).err().map(|failure| failure.to_string());
            assert_eq!(told.as_deref(), Some(expected), "{text}");
        }
        let strange = parsed(&scan("\"t\": 1, \"sensor\": \"r\", \"z\": [], \"doppler\": 1"));
        assert!(strange.is_err_and(|f| f.to_string().contains("unknown field `doppler`")));
        let late = "{\"t\": 2, \"sensor\": \"r\", \"z\": []}, {\"t\": 1, \"sensor\": \"r\", \"z\": []}";
        let unsorted = parsed(&format!("{{\"scans\": [{late}]}}"));
        assert!(unsorted.is_err_and(|f| f.to_string() == "p.json: scans[1]: t: 1 is before 2, the time of the scan above"));
    }
}
