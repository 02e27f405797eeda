//! How good the tracks of a recording are, where it holds the truth.
//!
//! Judged at the scans of the sensor named `radar` if the tracker takes it in, else at all its scans, by the
//! estimates after the scan of the tracks that are confirmed (coasting ones too) and moving:
//!
//! ```text
//! first       time of the first judged scan in which such a track is closer than 20 m to the target
//! covered     part of the judged scans from there on in which one is                             0..1
//! RMSE, identity changes   from there on, of pairs closer than 20 m (`metrics::sequence`)
//! GOSPA       mean over all judged scans, c = 30 m, p = 2; its parts, squared, add up to the mean of its square
//! ```
//!
//! A false track is one that was never paired with a target (c = 30 m) in any judged scan.

use super::history::{History, Moment};
use super::recording::{Recording, ScanRecord};
use crate::metrics::{Labelled, Sequence, distance, gospa, match_points};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Farther from the truth than this, a track is not the target's \[m\].
pub const NEAR: f64 = 20.0;
/// The cut-off c of GOSPA \[m\]; its order p is 2.
pub const CUTOFF: f64 = 30.0;
/// The sensor at whose scans is judged.
const JUDGED: &str = "radar";

/// The whole judgement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// The sensor at whose scans was judged; `None` for all.
    pub sensor: Option<&'static str>,
    /// Number of judged scans.
    pub scans: usize,
    /// Each target.
    pub targets: Vec<TargetScore>,
    /// Mean GOSPA and its parts.
    pub gospa: GospaMean,
    /// Tracks that were never near a target.
    pub false_tracks: usize,
}

/// What became of one target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetScore {
    /// Which.
    pub id: u64,
    /// Time of its first track, from the first scan on \[s\].
    pub first_s: Option<f64>,
    /// Judged scans from there on.
    pub scans: usize,
    /// Those with a track closer than 20 m.
    pub covered: usize,
    /// The same as a fraction.
    pub covered_fraction: Option<f64>,
    /// Root mean square error of position \[m\].
    pub rmse: Option<f64>,
    /// Times its track became another.
    pub identity_changes: usize,
}

/// Means over the judged scans.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct GospaMean {
    /// GOSPA \[m\].
    pub gospa: f64,
    /// Squared error of the pairs \[m^2\].
    pub localisation: f64,
    /// c^2/2 for each missed target \[m^2\].
    pub missed: f64,
    /// c^2/2 for each false track \[m^2\].
    #[serde(rename = "false")]
    pub false_: f64,
    /// Number of missed targets.
    pub n_missed: f64,
    /// Number of false tracks.
    pub n_false: f64,
}

/// Judges `history`; `None` where the recording holds no truth at any judged scan.
#[must_use]
pub fn judge(recording: &Recording, history: &History) -> Option<Judgement> {
    let scan = |moment: &&Moment| recording.scans.get(moment.scan);
    let by_radar = history.moments.iter().any(|moment| scan(&moment).is_some_and(|scan| scan.sensor == JUDGED));
    let judged: Vec<(&ScanRecord, &Moment)> =
        history.moments.iter().filter_map(|m| Some((scan(&m)?, m))).filter(|(scan, _)| !by_radar || scan.sensor == JUDGED).collect();
    if judged.iter().all(|(scan, _)| scan.truth.is_empty()) {
        return None;
    }
    let start_us = recording.scans.first().map_or(0, |scan| scan.time_us);
    let mut sequence = Sequence::new(NEAR);
    let mut first: BTreeMap<u64, Option<f64>> = BTreeMap::new();
    let mut mean = GospaMean::default();
    let (mut reported, mut paired) = (BTreeSet::new(), BTreeSet::new());
    for (scan, moment) in &judged {
        let (truth, estimates) = (truth(scan, history), estimates(moment, history));
        for target in &truth {
            let begun = first.entry(target.label).or_default();
            let near = estimates.iter().any(|estimate| distance(&target.position, &estimate.position) < NEAR);
            if begun.is_none() && near {
                *begun = Some((scan.time_us - start_us) as f64 * 1e-6);
            }
        }
        let begun: Vec<_> = truth.iter().filter(|target| first.get(&target.label).is_some_and(Option::is_some)).cloned().collect();
        sequence.push(&begun, &estimates);
        mean.add(&truth, &estimates);
        reported.extend(estimates.iter().map(|estimate| estimate.label));
        paired.extend(match_points(&truth, &estimates, CUTOFF, 2.0).pairs.iter().map(|pair| estimates[pair.estimate].label));
    }
    let scores: BTreeMap<_, _> = sequence.per_target().collect();
    let target = |(id, first_s): (u64, Option<f64>)| {
        let score = scores.get(&id).map(|score| **score).unwrap_or_default();
        TargetScore {
            id,
            first_s,
            scans: score.scans,
            covered: score.covered,
            covered_fraction: score.coverage(),
            rmse: score.rmse(),
            identity_changes: score.identity_changes,
        }
    };
    Some(Judgement {
        sensor: by_radar.then_some(JUDGED),
        scans: judged.len(),
        targets: first.into_iter().map(target).collect(),
        gospa: mean.over(judged.len()),
        false_tracks: reported.difference(&paired).count(),
    })
}

/// The targets of a scan, in as many dimensions as the tracks.
fn truth(scan: &ScanRecord, history: &History) -> Vec<Labelled<Vec<f64>>> {
    let (axes, _) = history.state.shape();
    let point = |p: [f64; 3]| p.iter().take(axes).copied().collect();
    scan.truth.iter().map(|target| Labelled { label: target.id, position: point(target.position) }).collect()
}

/// The tracks that are taken for targets.
fn estimates(moment: &Moment, history: &History) -> Vec<Labelled<Vec<f64>>> {
    let reported = moment.tracks.iter().filter(|track| track.moving);
    reported.map(|track| Labelled { label: track.id.into(), position: track.position(history.state) }).collect()
}

impl GospaMean {
    fn add(&mut self, truth: &[Labelled<Vec<f64>>], estimates: &[Labelled<Vec<f64>>]) {
        let one = gospa(truth, estimates, CUTOFF, 2.0);
        self.gospa += one.gospa;
        self.localisation += one.localisation;
        self.missed += one.missed;
        self.false_ += one.false_;
        self.n_missed += one.n_missed as f64;
        self.n_false += one.n_false as f64;
    }

    fn over(self, scans: usize) -> Self {
        let n = scans as f64;
        Self {
            gospa: self.gospa / n,
            localisation: self.localisation / n,
            missed: self.missed / n,
            false_: self.false_ / n,
            n_missed: self.n_missed / n,
            n_false: self.n_false / n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::history::tests::history;
    use super::super::recording::{Frame, TruthPoint};
    use super::*;
    use boresight::track::Status::{Coasting, Confirmed, Tentative};

    /// Scans of `sensors`, a second apart, with a target at (0, 0) and one at (100, 0).
    fn recording(sensors: &[&str]) -> Recording {
        let truth = |id, x| TruthPoint { id, position: [x, 0.0, 0.0] };
        let scan = |(time_us, sensor): (u64, &&str)| ScanRecord {
            time_us,
            sensor: (*sensor).to_owned(),
            own: None,
            detections: Vec::new(),
            truth: vec![truth(1, 0.0), truth(2, 100.0)],
        };
        Recording { frame: Frame::XRight, scans: (0..).step_by(1_000_000).zip(sensors).map(scan).collect() }
    }

    #[test]
    fn targets_count_from_their_first_track_on() {
        let history = history(
            &[
                (0, 0, &[(5, Tentative, 0.0, 3.0)]),
                (1, 1, &[(5, Confirmed, 0.0, 3.0), (6, Confirmed, 100.0, 25.0)]),
                (2, 2, &[(5, Coasting, 0.0, 40.0), (6, Confirmed, 100.0, 4.0), (9, Confirmed, 500.0, 0.0)]),
                (3, 3, &[(7, Confirmed, 0.0, 4.0), (6, Confirmed, 100.0, 4.0)]),
            ],
            0.0,
        );
        let Some(judgement) = judge(&recording(&["radar"; 4]), &history) else { panic!("there is truth") };
        let [one, two] = judgement.targets.as_slice() else { panic!("there are two targets") };
        assert_eq!((one.first_s, one.scans, one.covered, one.identity_changes), (Some(1.0), 3, 2, 1));
        assert_eq!(one.rmse, Some(12.5_f64.sqrt()));
        assert_eq!((two.first_s, two.scans, two.covered, two.identity_changes), (Some(2.0), 2, 2, 0));
        // Missed: 2, 0, 1, 0; false: 0, 0, 2, 0; half of c squared is 450.
        let g = judgement.gospa;
        assert_eq!((judgement.scans, g.n_missed, g.n_false, judgement.false_tracks), (4, 0.75, 0.5, 1));
        assert_eq!((g.missed, g.false_, g.localisation), (337.5, 225.0, (9.0 + 625.0 + 16.0 + 16.0 + 16.0) / 4.0));
    }

    #[test]
    fn the_radar_judges_where_there_is_one() {
        let near = (1, Confirmed, 0.0, 1.0);
        let both = history(&[(0, 0, &[near]), (1, 1, &[near])], 0.0);
        let by = |sensors: &[&str]| judge(&recording(sensors), &both).map(|judgement| (judgement.sensor, judgement.scans));
        assert_eq!(by(&["radar", "lidar"]), Some((Some("radar"), 1)));
        assert_eq!(by(&["sonar", "lidar"]), Some((None, 2)));
        let standing = history(&[(0, 0, &[near]), (1, 1, &[near])], 10.0);
        let judged = judge(&recording(&["radar", "radar"]), &standing);
        assert!(judged.is_some_and(|judgement| judgement.targets.iter().all(|target| target.first_s.is_none())));
        let mut blind = recording(&["radar", "radar"]);
        blind.scans.iter_mut().for_each(|scan| scan.truth.clear());
        assert_eq!(judge(&blind, &both), None);
    }
}
