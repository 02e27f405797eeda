//! What a replay comes to: the content of `replay.json`, and the same as a table for people.
//!
//! The JSON is [`Summary`] as it stands; what is not known is null (`judgement` without truth).

use super::config::{AssociationKind, TrackerPlan};
use super::history::{Counts, History};
use super::judge::{Judgement, judge};
use super::recording::Recording;
use crate::Precision;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write;

/// A recording and what a tracker made of it.
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
    /// What the tracker ran as, and what it did.
    pub tracker: TrackerSummary,
    /// How good its tracks are, where the truth is known.
    pub judgement: Option<Judgement>,
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

/// What the tracker ran as, and what it did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackerSummary {
    /// The scalar type.
    pub precision: Precision,
    /// Its description, with all that followed from the recording.
    pub plan: TrackerPlan,
    /// Number of tracks that were ever confirmed.
    pub confirmed: usize,
    /// Number of those that were found to move.
    pub moving: usize,
    /// The sums of the library's reports.
    pub report: Counts,
}

/// Sums up a run of the tracker `plan`.
#[must_use]
pub fn summary(recording: &Recording, history: &History, plan: &TrackerPlan, precision: Precision) -> Summary {
    let of = |name: &str| {
        let scans = recording.scans.iter().filter(|scan| scan.sensor == name);
        let counts: Vec<usize> = scans.map(|scan| scan.detections.len()).collect();
        SensorSummary { name: name.to_owned(), scans: counts.len(), detections: counts.iter().sum() }
    };
    let confirmed: BTreeSet<u32> = history.tracks().filter(|track| track.is_confirmed()).map(|track| track.id).collect();
    let moving: BTreeSet<u32> = history.tracks().filter(|track| track.moving).map(|track| track.id).collect();
    let targets: BTreeSet<u64> = recording.scans.iter().flat_map(|scan| &scan.truth).map(|target| target.id).collect();
    Summary {
        scans: recording.scans.len(),
        duration_s: recording.duration_s(),
        targets: targets.len(),
        sensors: recording.sensors().into_iter().map(of).collect(),
        tracker: TrackerSummary { precision, plan: plan.clone(), confirmed: confirmed.len(), moving: moving.len(), report: history.counts },
        judgement: judge(recording, history),
    }
}

/// The table.
#[must_use]
pub fn table(summary: &Summary, plots: &str) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let Summary { scans, duration_s, targets, sensors, tracker, judgement } = summary;
    let _ = writeln!(text, "{plots}: {scans} scans in {duration_s:.1} s, truth of {targets} targets");
    for SensorSummary { name, scans, detections } in sensors {
        let _ = writeln!(text, "    {name}: {scans} scans, {detections} detections, {:.1} a scan", *detections as f64 / *scans as f64);
    }
    let TrackerSummary { precision, plan, confirmed, moving, report } = tracker;
    let (states, modes, fed) = (plan.state.names().join(", "), plan.modes.len(), plan.sensors.join(" and "));
    let kind = match plan.association {
        AssociationKind::Pda => "IMM-PDAF",
        AssociationKind::Jpda => "IMM-JPDAF",
        AssociationKind::Gnn => "IMM-GNN",
    };
    let _ = writeln!(text, "{kind} in {precision}: ({states}), {modes} modes, fed by {fed}");
    let _ = writeln!(text, "    {confirmed} tracks confirmed, {moving} of them moving");
    let _ = writeln!(
        text,
        "    {} births, {} deleted, {} duplicates; given up: {} detections, {} seeds, {} births, {} tentative tracks; {} numeric resets",
        report.births,
        report.tracks_deleted,
        report.duplicates_deleted,
        report.detections_dropped,
        report.seeds_dropped,
        report.births_refused,
        report.tracks_evicted,
        report.numeric_resets,
    );
    if report.clusters_bounded + report.clusters_approximated + report.clusters_infeasible > 0 {
        let _ = writeln!(
            text,
            "    association: {} clusters bounded, errors at most {:.1e}; {} approximated; {} without a possible event",
            report.clusters_bounded, report.association_error_bound, report.clusters_approximated, report.clusters_infeasible,
        );
    }
    let Some(judgement) = judgement else { return text };
    let _ = writeln!(
        text,
        "confirmed, moving tracks against the truth at {} {}scans",
        judgement.scans,
        judgement.sensor.map_or(String::new(), |name| format!("{name} "))
    );
    let _ = writeln!(text, "    {:>6} {:>10} {:>14} {:>9} {:>17}", "target", "first [s]", "within 20 m", "RMSE [m]", "identity changes");
    for target in &judgement.targets {
        let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
        let fraction = target.covered_fraction.map_or(String::new(), |f| format!("{:.1} %", 100.0 * f));
        let covered = format!("{}/{} {fraction:>7}", target.covered, target.scans);
        let _ = writeln!(
            text,
            "    {:>6} {:>10} {covered:>14} {:>9} {:>17}",
            target.id,
            number(target.first_s, 1),
            number(target.rmse, 2),
            target.identity_changes,
        );
    }
    let g = &judgement.gospa;
    let _ = writeln!(
        text,
        "    GOSPA {:.2} m (c = 30 m, p = 2); squared: localisation {:.1}, missed {:.1}, false {:.1} m^2; a scan: {:.2} missed, {:.2} false",
        g.gospa, g.localisation, g.missed, g.false_, g.n_missed, g.n_false,
    );
    let _ = writeln!(text, "    false tracks: {}", judgement.false_tracks);
    text
}

#[cfg(test)]
mod tests {
    use super::super::config::Config;
    use super::super::history::tests::history;
    use super::super::recording::tests::recording;
    use super::*;
    use crate::replay::TruthPoint;
    use boresight::track::Status::Confirmed;

    #[test]
    fn the_table_tells_what_the_summary_holds() -> Result<(), crate::Failure> {
        let mut recording = recording("t_us,sensor,x,y\n0,radar,1,2\n2000000,radar,,\n")?;
        let history = history(&[(0, 0, &[(1, Confirmed, 0.0, 0.0)]), (1, 2, &[(1, Confirmed, 0.0, 20.0)])], 15.0);
        let plan = TrackerPlan::new(&Config::default(), &recording)?;
        let without = summary(&recording, &history, &plan, Precision::F64);
        assert_eq!((without.scans, without.duration_s, without.targets, without.judgement.is_none()), (2, 2.0, 0, true));
        assert_eq!((without.tracker.confirmed, without.tracker.moving), (1, 1));
        recording.scans[1].truth = vec![TruthPoint { id: 7, position: [0.0, 23.0, 0.0] }];
        let with = table(&summary(&recording, &history, &plan, Precision::F64), "p.csv");
        for line in [
            "p.csv: 2 scans in 2.0 s, truth of 1 targets",
            "    radar: 2 scans, 1 detections, 0.5 a scan",
            "IMM-JPDAF in f64: (x, vx, y, vy), 2 modes, fed by radar",
            "    1 tracks confirmed, 1 of them moving",
            "confirmed, moving tracks against the truth at 2 radar scans",
            "         7        2.0    1/1 100.0 %      3.00                 0",
            "    false tracks: 0",
        ] {
            assert!(with.lines().any(|found| found == line), "{line}\nin\n{with}");
        }
        Ok(())
    }
}
