//! The command `compare`: every tracker on the same scenarios, beside what it costs on the target; one table for whoever chooses.
//!
//! | file | holds |
//! |---|---|
//! | `stage.rs` | the scenarios: data, models and sensors that all trackers get alike |
//! | `follow.rs` | the trackers |
//! | `score.rs` | what a run is worth: how it ends, OSPA, GOSPA, NEES |
//! | `page.rs` | the table, between two marks of WHICH-TRACKER.md |
//!
//! The figures are kept in host-tests/compare.json; what a tracker costs is read from the published budget. The page is made from
//! both, so that a budget that has changed needs no new runs.

pub(crate) mod follow;
mod page;
mod score;
pub(crate) mod stage;

use crate::monte_carlo::{self, Streams};
use crate::statistics::mean;
use crate::{Failure, budget, output};
use boresight::mode::ModeSet;
use boresight::sensor::Sensor;
use follow::Which;
use score::{End, Score};
use serde::{Deserialize, Serialize};
use stage::Stage;
use std::path::{Path, PathBuf};

/// The page.
const PAGE: &str = "WHICH-TRACKER.md";
/// Its figures for machines.
const RECORD: &str = "host-tests/compare.json";
/// By how much, relatively, the first run may come out otherwise than recorded: a change of rounding passes, one of a tracker does not.
const TOLERANCE: f64 = 0.01;

/// What the command is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Runs of each scenario
    pub runs: u64,
    /// Base seed
    pub seed: u64,
    /// Where the results go instead of the page
    pub json: Option<PathBuf>,
}

/// The scores of some trackers on the data of a run, by a cut-off.
type Scores = fn(&mut Streams, &[Which], f64) -> Result<Vec<Score>, Failure>;

/// One of the scenarios.
struct Scene {
    name: &'static str,
    /// What there is to see
    about: &'static str,
    /// Of pairs, OSPA and GOSPA \[m\]
    cutoff: f64,
    run: Scores,
    /// Bytes that a tracker of these states and modes remembers
    ram: fn(Which) -> usize,
}

const SCENES: [Scene; 4] = [
    Scene {
        name: "kashyap-a",
        about: "two targets manoeuvre at 1 g, apart from each other, among 20 clutter points",
        cutoff: 100.0,
        run: |streams, which, cutoff| scores(&stage::kashyap_a(streams)?, which, cutoff),
        ram: follow::ram::<6, 3>,
    },
    Scene {
        name: "gomes",
        about: "two targets cross at 12 degrees, seven turn rates, no clutter",
        cutoff: 500.0,
        run: |streams, which, cutoff| scores(&stage::gomes(streams)?, which, cutoff),
        ram: follow::ram::<4, 7>,
    },
    Scene {
        name: "jeong-tugnait",
        about: "two targets cross within one plot of radar and infrared sensor, in clutter",
        cutoff: 500.0,
        run: |streams, which, cutoff| scores(&stage::jeong_tugnait(streams)?, which, cutoff),
        ram: follow::ram::<9, 3>,
    },
    Scene {
        name: "jms-glmb-linear",
        about: "three targets come, turn and go among 60 clutter points",
        cutoff: 1000.0,
        run: |streams, which, cutoff| scores(&stage::jms_glmb_linear(streams)?, which, cutoff),
        ram: follow::ram::<4, 3>,
    },
];

/// Why a tracker has no figures of a scenario.
fn obstacle(scene: &Scene, which: Which) -> Option<&'static str> {
    match (which, scene.name) {
        (Which::ImmCoupled, "jms-glmb-linear") => Some("follows two targets that are given; here three come and go"),
        (Which::MergingJpda, "kashyap-a" | "gomes" | "jms-glmb-linear") => Some("as `ImmJpda`: the sensor states no cells"),
        (Which::LmsJpda, "kashyap-a" | "jeong-tugnait" | "jms-glmb-linear") => Some("as `ImmJpda`: of three modes all run"),
        _ => None,
    }
}

fn scores<M, S, const NX: usize, const MODES: usize>(
    stage: &Stage<M, S, NX, MODES>,
    which: &[Which],
    cutoff: f64,
) -> Result<Vec<Score>, Failure>
where
    M: ModeSet<f32, NX, MODES> + Copy,
    S: Sensor<f32, NX, 2>,
{
    let score = |which: &Which| {
        let seen = follow::follow(*which, stage).map_err(|fault| fault.of(which.name()))?;
        Ok(Score::new(&stage.truth, &seen, cutoff))
    };
    which.iter().map(score).collect()
}

/// A mean over runs, and its standard error where there are several.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Figure {
    mean: f64,
    error: Option<f64>,
}

impl Figure {
    fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        mean(values).map(|m| Self { mean: m.mean, error: m.standard_error })
    }
}

/// One tracker on one scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Row {
    scenario: String,
    tracker: String,
    /// Runs that lost a target
    lost: usize,
    /// Runs that lost none, but exchanged some
    exchanged: usize,
    ospa: Option<Figure>,
    gospa: Option<Figure>,
    nees: Option<Figure>,
    /// OSPA and GOSPA of the first run
    first: [f64; 2],
}

/// All figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Record {
    runs: u64,
    seed: u64,
    rows: Vec<Row>,
}

impl Record {
    /// Runs everything.
    fn measure(runs: u64, seed: u64) -> Result<Self, Failure> {
        let mut rows = Vec::new();
        for scene in &SCENES {
            let which: Vec<Which> = Which::ALL.into_iter().filter(|which| obstacle(scene, *which).is_none()).collect();
            let one = |index| (scene.run)(&mut monte_carlo::streams(seed, index), &which, scene.cutoff);
            let scores = monte_carlo::run(scene.name, runs, one).into_iter().collect::<Result<Vec<_>, _>>()?;
            for (number, which) in which.iter().enumerate() {
                let of: Vec<Score> = scores.iter().map(|run| run[number]).collect();
                let ended = |end: End| of.iter().filter(|score| score.end == end).count();
                rows.push(Row {
                    scenario: scene.name.to_owned(),
                    tracker: which.name().to_owned(),
                    lost: ended(End::Lost),
                    exchanged: ended(End::Exchanged),
                    ospa: Figure::of(of.iter().map(|score| score.ospa)),
                    gospa: Figure::of(of.iter().map(|score| score.gospa)),
                    nees: Figure::of(of.iter().filter_map(|score| score.nees)),
                    first: of.first().map_or([f64::NAN; 2], |score| [score.ospa, score.gospa]),
                });
            }
        }
        Ok(Self { runs, seed, rows })
    }

    fn read(file: &Path) -> Result<Self, Failure> {
        serde_json::from_str(&output::read_text(file)?).map_err(|error| Failure::input(error).in_file(file))
    }

    fn row(&self, scenario: &str, tracker: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.scenario == scenario && row.tracker == tracker)
    }

    /// Fails where the first run of `again` is another than ours.
    fn begins_like(&self, again: &Self) -> Result<(), Failure> {
        for row in &again.rows {
            let recorded = self.row(&row.scenario, &row.tracker);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= TOLERANCE * b.abs();
            if !recorded.is_some_and(|recorded| row.first.iter().zip(&recorded.first).all(near)) {
                let was = recorded.map_or("none".to_owned(), |row| format!("{:?}", row.first));
                let text = format!("OSPA and GOSPA of the first run are {:?}, recorded {was}; run `compare`", row.first);
                return Err(Failure::check(text).within(&row.tracker).within(&row.scenario));
            }
        }
        match self.rows.len() == again.rows.len() {
            true => Ok(()),
            false => Err(Failure::check("the record has other rows than there are trackers; run `compare`")),
        }
    }
}

/// Carries the command out, from the repository root.
///
/// # Errors
/// Where a file cannot be read or written.
pub fn run(root: &Path, request: &Request) -> Result<(), Failure> {
    let costs = budget::figures::Record::read(&root.join(budget::RECORD))?;
    if let Some(file) = &request.json {
        output::check_target(file)?;
    }
    let record = Record::measure(request.runs, request.seed)?;
    output::print(&page::table(&record, &costs))?;
    match &request.json {
        Some(file) => output::write_json(file, &record),
        None => {
            page::publish(&root.join(PAGE), &record, &costs)?;
            output::write_json(&root.join(RECORD), &record)
        }
    }
}

/// Makes the page anew from its record and the published budget, without any run.
///
/// # Errors
/// Where a file cannot be read or written.
pub fn refresh(root: &Path) -> Result<(), Failure> {
    let costs = budget::figures::Record::read(&root.join(budget::RECORD))?;
    page::publish(&root.join(PAGE), &Record::read(&root.join(RECORD))?, &costs)
}

/// Whether the page is that of its record and of the published budget, and the first run comes out as recorded.
///
/// # Errors
/// Where it is not.
pub fn check(root: &Path) -> Result<(), Failure> {
    let costs = budget::figures::Record::read(&root.join(budget::RECORD))?;
    let record = Record::read(&root.join(RECORD))?;
    page::check(&root.join(PAGE), &record, &costs)?;
    record.begins_like(&Record::measure(1, record.seed)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    /// The repository.
    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
    }

    #[test]
    fn the_page_is_current() {
        assert_eq!(check(&root()), Ok(()));
    }

    #[test]
    fn a_record_that_begins_otherwise_is_refused() -> Result<(), Failure> {
        let record = Record::read(&root().join(RECORD))?;
        assert_eq!(record.begins_like(&record), Ok(()));
        let mut other = record.clone();
        other.rows[3].first[1] *= 1.02;
        assert!(record.begins_like(&other).is_err_and(|failure| failure.status() == Status::Check));
        other.rows.truncate(3);
        assert!(record.begins_like(&other).is_err());
        Ok(())
    }

    /// What the page says where it has no figures of its own: the same but for the rounding of sums in another order, a tenth of the
    /// last digit that the page shows.
    #[test]
    fn those_that_are_said_to_be_as_imm_jpda_are() -> Result<(), Failure> {
        for scene in &SCENES {
            for which in [Which::MergingJpda, Which::LmsJpda].into_iter().filter(|which| obstacle(scene, *which).is_some()) {
                let scores = (scene.run)(&mut monte_carlo::streams(1_000_000, 0), &[Which::ImmJpda, which], scene.cutoff)?;
                let [joint, other] = scores.as_slice() else { return Err(Failure::input("a tracker without a score")) };
                let shown = |score: &Score| [score.ospa, score.gospa, score.nees.unwrap_or(f64::NAN)];
                let near = shown(joint).iter().zip(shown(other)).zip([0.01, 0.01, 0.001]).all(|((a, b), digit)| (a - b).abs() < digit);
                assert!(joint.end == other.end && near, "{}: {}: {other:?} for {joint:?}", scene.name, which.name());
            }
        }
        Ok(())
    }

    /// Sizes on the desk stand for those on the target.
    #[test]
    fn sizes_are_those_of_the_budget() -> Result<(), Failure> {
        let costs = budget::figures::Record::read(&root().join(budget::RECORD))?;
        let published = |name: &str| costs.trackers.get(name).map(|figures| figures.ram).or(costs.labelled.get(name).map(|form| form.ram));
        for (name, ram) in [
            ("imm-gnn 4x3 16x32", follow::ram::<4, 3>(Which::Gnn)),
            ("imm-pdaf 4x3 16x32", follow::ram::<4, 3>(Which::ImmPdaf)),
            ("imm-jpda 4x3 16x32 64", follow::ram::<4, 3>(Which::ImmJpda)),
            ("imm-jpda 4x7 16x32 64", follow::ram::<4, 7>(Which::ImmJpda)),
            ("lms-jpda 4x7 16x32 64", follow::ram::<4, 7>(Which::LmsJpda)),
            ("linear, 3 modes, 48 tracks", follow::ram::<4, 3>(Which::JmsGlmb)),
        ] {
            let there = published(name).unwrap_or_default() as f64;
            assert!((ram as f64 / there - 1.0).abs() < 0.01, "{name}: {there} there, {ram} here");
        }
        Ok(())
    }
}
