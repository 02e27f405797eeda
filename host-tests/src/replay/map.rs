//! The picture of a replay: plots, truth, the sensor's own path and the confirmed tracks, north upwards where known.
//!
//! Positions are the sensor's (in that scan) plus the detection's relative to it. Tracks that move have a colour each;
//! those that stand still are drawn alike, tentative ones not at all. The truth lies on top. [`map`] shows everything,
//! or only the part around the truth.

use super::config::Config;
use super::history::History;
use super::recording::{Frame, Plot, Recording};
use crate::picture::{Chart, Series};
use std::collections::BTreeMap;

/// The colours of tracks in the palette, in turn.
const TRACKS: [usize; 8] = [0, 1, 2, 3, 4, 6, 9, 8];
/// That of the tracks that stand still.
const STANDING: usize = 7;
/// That of the plots of the second sensor; those of the first are grey.
const SECOND: usize = 5;

/// Room around the truth, as a part of its extent.
const MARGIN: f64 = 0.08;

/// Draws a replay, or the part of it inside `limits` (on paper, see [`around_truth`]).
#[must_use]
pub fn map(recording: &Recording, config: &Config, history: &History, title: &str, limits: Option<Limits>) -> Chart {
    let drawn = |x: f64, y: f64| drawn(recording.frame, x, y);
    let (across, up) = match recording.frame {
        Frame::XRight => ("x [m]", "y [m]"),
        Frame::NorthEast => ("east [m]", "north [m]"),
    };
    let mut chart = Chart::map(title, across, up);
    if let Some([x, y]) = limits {
        chart = chart.x_limits(x[0], x[1]).y_limits(y[0], y[1]);
    }
    let mut sensors = recording.sensors();
    sensors.sort_by_key(|name| *name != "radar");
    for (index, name) in sensors.into_iter().enumerate() {
        let resting = config.sensor(name).position;
        let scans = recording.scans.iter().filter(|scan| scan.sensor == name);
        let points = scans.flat_map(|scan| {
            let origin = scan.own.unwrap_or(resting);
            let absolute = move |[x, y, _]: [f64; 3]| drawn(origin[0] + x, origin[1] + y);
            scan.detections.iter().filter_map(Plot::relative_position).map(absolute)
        });
        let plots = Series::clutter(format!("{name} plots"), points.collect());
        chart = chart.with(if index == 0 { plots } else { plots.coloured(SECOND) });
    }
    let own = recording.scans.iter().filter_map(|scan| scan.own).map(|[x, y, _]| drawn(x, y));
    chart = chart.with(Series::reference("own path", own.collect()));
    let mut tracks: BTreeMap<u32, (Vec<[f64; 2]>, bool)> = BTreeMap::new();
    for track in history.tracks().filter(|track| track.is_confirmed()) {
        let (path, moves) = tracks.entry(track.id).or_default();
        if let [x, y, ..] = track.position(history.state).as_slice() {
            path.push(drawn(*x, *y));
        }
        *moves |= track.moving;
    }
    let visible = |[x, y]: &[f64; 2]| limits.is_none_or(|[a, b]| (a[0]..=a[1]).contains(x) && (b[0]..=b[1]).contains(y));
    let mut colours = TRACKS.into_iter().cycle();
    for (id, (path, moves)) in tracks {
        let colour = if moves { colours.next().unwrap_or_default() } else { STANDING };
        let name = if moves { format!("track {id}") } else { "standing".to_owned() };
        if path.iter().any(visible) {
            chart = chart.with(Series::curve(name, path).coloured(colour));
        }
    }
    let mut truth: BTreeMap<u64, Vec<_>> = BTreeMap::new();
    for target in recording.scans.iter().flat_map(|scan| &scan.truth) {
        let [x, y, _] = target.position;
        truth.entry(target.id).or_default().push(drawn(x, y));
    }
    truth.into_values().fold(chart, |chart, path| chart.with(Series::truth("truth", path)))
}

/// From where to where on both axes of the paper \[m\].
pub type Limits = [[f64; 2]; 2];

/// The part of the map around the truth and the sensor's own path, where the truth is known.
#[must_use]
pub fn around_truth(recording: &Recording) -> Option<Limits> {
    let targets = recording.scans.iter().flat_map(|scan| &scan.truth).map(|target| target.position);
    let own = recording.scans.iter().filter_map(|scan| scan.own);
    let points: Vec<_> = targets.chain(own).map(|[x, y, _]| drawn(recording.frame, x, y)).collect();
    let extent = |axis: usize| {
        let values = || points.iter().map(|point| point[axis]);
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    };
    let limits = [extent(0), extent(1)];
    let margin = limits.iter().fold(1.0, |most: f64, [from, to]| most.max(MARGIN * (to - from)));
    recording.has_truth().then_some(limits.map(|[from, to]| [from - margin, to + margin]))
}

/// A point as it lies on the paper.
fn drawn(frame: Frame, x: f64, y: f64) -> [f64; 2] {
    match frame {
        Frame::XRight => [x, y],
        Frame::NorthEast => [y, x],
    }
}

#[cfg(test)]
mod tests {
    use super::super::history::tests::history;
    use super::super::recording::tests::recording;
    use super::super::recording::{ScanRecord, TruthPoint};
    use super::*;
    use boresight::track::Status::{Confirmed, Tentative};

    #[test]
    fn north_is_up_and_tentative_tracks_are_left_out() -> Result<(), crate::Failure> {
        let mut recording = recording("t_us,sensor,x,y\n0,radar,1,2\n1000000,lidar,1,2\n")?;
        let tracks: &[_] = &[(1, Confirmed, 0.0, 20.0), (2, Confirmed, 9.0, 9.0), (3, Tentative, 5.0, 5.0)];
        let history = history(&[(0, 0, &[(1, Tentative, 0.0, 0.0)]), (1, 1, tracks)], 15.0);
        let drawn = |recording: &Recording, limits| map(recording, &Config::default(), &history, "map", limits).render();
        let plain = drawn(&recording, None)?;
        for (text, shown) in [("x [m]", true), ("track 1", true), ("standing", true), ("track 3", false), ("truth", false)] {
            assert_eq!(plain.contains(text), shown, "{text}");
        }
        assert_eq!(around_truth(&recording), None);
        let target = TruthPoint { id: 1, position: [0.0, 100.0, 0.0] };
        recording.frame = Frame::NorthEast;
        recording.scans.push(ScanRecord { own: Some([50.0, 0.0, 0.0]), truth: vec![target], ..recording.scans[0].clone() });
        let limits = around_truth(&recording);
        assert_eq!(limits, Some([[-8.0, 108.0], [-8.0, 58.0]]));
        let northern = drawn(&recording, limits)?;
        assert!(northern.contains("north [m]") && northern.contains("truth"));
        Ok(())
    }
}
