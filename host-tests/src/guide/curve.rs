//! What came of a setting over all runs.
//!
//! ```text
//! lost      targets without a track in most of the last ten scans, as a share
//! without   scans of targets without a track, as a share
//! rms       of the errors of all tracks of targets, within manoeuvres and outside
//! NEES      e' P⁻¹ e / 2, mean over all tracks of targets; 1 where the covariance is honest
//! interval  that holds 95 % of the means of an honest NEES over as many targets: χ² with 2 degrees each
//! ```

use super::lesson::Shown;
use super::world::{Look, Watched};
use crate::metrics::consistency;
use crate::statistics::{mean, rms};
use std::fmt;

const LAST: usize = 10;

/// The figures of a setting.
pub struct Figures {
    /// See above, all three
    pub lost: f64,
    /// See there
    pub without: f64,
    /// Mean number of tracks of nothing
    pub false_tracks: f64,
    /// \[m\]
    pub manoeuvre: f64,
    /// \[m\]
    pub quiet: f64,
    /// See there
    pub nees: f64,
    interval: Option<[f64; 2]>,
    error_curve: Vec<[f64; 2]>,
    nees_curve: Vec<[f64; 2]>,
    found_curve: Vec<[f64; 2]>,
    false_curve: Vec<[f64; 2]>,
}

impl Figures {
    /// Of all runs of a setting.
    pub fn of<'a>(runs: impl Iterator<Item = &'a Watched> + Clone) -> Self {
        let scans = runs.clone().map(|run| run.looks.len()).max().unwrap_or(0);
        let at = |k: usize| runs.clone().filter_map(move |run| run.looks.get(k)).flatten();
        let looks = || (0..scans).flat_map(at);
        let missing = |looks: &mut dyn Iterator<Item = &Look>| mean(looks.map(|look| f64::from(u8::from(look.error.is_none()))));
        let value = |m: Option<crate::statistics::Mean>| m.map_or(f64::NAN, |m| m.mean);
        let during = |wanted: bool| rms(looks().filter(|look| look.manoeuvres == Some(wanted)).filter_map(|look| look.error));
        let curve = |of: &dyn Fn(usize) -> f64| (0..scans).map(|k| [k as f64, of(k)]).collect::<Vec<_>>();
        let targets = runs.clone().flat_map(|run| (0..run.paths.len()).map(move |target| (run, target)));
        let lost = targets.clone().map(|(run, target)| {
            let last = run.looks.iter().rev().take(LAST).filter(|looks| looks[target].error.is_none()).count();
            f64::from(u8::from(2 * last > LAST))
        });
        // The quantiles do not depend on the values.
        let honest = consistency(&vec![2.0; targets.clone().count()], 2);
        Self {
            lost: value(mean(lost)),
            without: value(missing(&mut looks())),
            false_tracks: value(mean(runs.clone().flat_map(|run| run.false_tracks.iter().map(|n| *n as f64)))),
            manoeuvre: during(true).unwrap_or(f64::NAN),
            quiet: during(false).unwrap_or(f64::NAN),
            nees: value(mean(looks().filter_map(|look| look.nees))),
            interval: honest.map(|honest| honest.interval.map(|bound| bound / 2.0)),
            error_curve: curve(&|k| rms(at(k).filter_map(|look| look.error)).unwrap_or(f64::NAN)),
            nees_curve: curve(&|k| value(mean(at(k).filter_map(|look| look.nees)))),
            found_curve: curve(&|k| 1.0 - value(missing(&mut at(k)))),
            false_curve: curve(&|k| value(mean(runs.clone().filter_map(|run| run.false_tracks.get(k)).map(|n| *n as f64)))),
        }
    }

    /// Over the scans.
    pub fn over_time(&self, shown: Shown) -> Vec<[f64; 2]> {
        match shown {
            Shown::Error => &self.error_curve,
            Shown::Nees => &self.nees_curve,
            Shown::Found => &self.found_curve,
            Shown::False => &self.false_curve,
        }
        .clone()
    }

    /// What holds 95 % of the means of an honest NEES, a component.
    pub fn interval(&self) -> Option<[f64; 2]> {
        self.interval
    }
}

/// As cells of a table.
impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { lost, without, false_tracks, manoeuvre, quiet, nees, .. } = self;
        let per_cent = |share: &f64| format!("{:.1} %", 100.0 * share);
        let (lost, without) = (per_cent(lost), per_cent(without));
        write!(f, "{lost} | {without} | {false_tracks:.2} | {manoeuvre:.1} m | {quiet:.1} m | {nees:.2}")
    }
}
