//! The bound beside what was observed.
//!
//! ```text
//! steps    proven: the loops of a scan end after as many, whatever the input (boresight::tracker::Work; the test `budget`
//!          holds instrumented runs against the formula)
//! cycles   estimated: Σ steps of a kind times the cycles below, which were chosen so that no scan of the images has taken
//!          more than its own steps amount to (the test `budget` holds them against the published figures)
//! ```
//!
//! The bound is far above anything observed where association is joint: its formula lets every cluster climb all rungs of
//! exact, bounded and approximate association with full memory at once.

use super::configuration::{Kind, Tracker};
use crate::Failure;
use boresight::fusion::FusionWork;
use boresight::tracker::Work;

/// The most work of one scan.
pub fn most(tracker: &Tracker) -> Result<Work, Failure> {
    let Tracker { kind, modes, tracks, detections, .. } = *tracker;
    match kind {
        Kind::ImmPdaf => Ok(Work::imm_pdaf(tracks, detections, modes)),
        Kind::ImmGnn => Ok(Work::imm_gnn(tracks, detections, modes)),
        Kind::ImmJpda { nodes: 64 } => Ok(Work::imm_jpda::<64>(tracks, detections, modes)),
        Kind::ImmJpda { nodes: 256 } => Ok(Work::imm_jpda::<256>(tracks, detections, modes)),
        Kind::LmsJpda { nodes: 64 } => Ok(Work::lms_jpda::<64>(tracks, detections, modes)),
        Kind::MergingJpda { nodes: 256, pairs: 4 } => Ok(Work::imm_jpda_merging::<256, 4>(tracks, detections, modes)),
        Kind::ImmJpda { nodes } | Kind::LmsJpda { nodes } | Kind::MergingJpda { nodes, .. } => {
            Err(Failure::input(format!("no formula for {nodes} nodes")))
        }
    }
}

/// Cycles of a scan beside the steps.
const SCAN: u64 = 3000;
/// Cycles of a step, by its kind.
const STEP: Work = Work {
    predictions: 1200,
    innovations: 1000,
    residuals: 230,
    corrections: 1000,
    association: 45,
    comparisons: 200,
    fixes: 2300,
    pairings: 2700,
    looks: 10,
    as_one: 1500,
};

/// What work amounts to in cycles of a Cortex-M4, by the estimates of this file.
#[must_use]
pub fn cycles(work: &Work) -> u64 {
    SCAN + amount(work, &STEP)
}

/// Cycles of a step of the coupled filter, by its kind, for two targets of nine states.
const COUPLED: Work = Work {
    predictions: 8500,
    innovations: 2400,
    residuals: 260,
    corrections: 5000,
    association: 170,
    as_one: 1700,
    ..Work::imm_pdaf(0, 0, 0)
};

/// What the work of a scan of the coupled filter amounts to in cycles of a Cortex-M4, by the estimates of this file.
#[must_use]
pub fn coupled_cycles(work: &Work) -> u64 {
    SCAN + amount(work, &COUPLED)
}

fn amount(work: &Work, step: &Work) -> u64 {
    work.predictions * step.predictions
        + work.innovations * step.innovations
        + work.residuals * step.residuals
        + work.corrections * step.corrections
        + work.association * step.association
        + work.comparisons * step.comparisons
        + work.fixes * step.fixes
        + work.pairings * step.pairings
        + work.looks * step.looks
        + work.as_one * step.as_one
}

/// Cycles of an update of fused tracks beside the steps.
const UPDATE: u64 = 20_000;
/// Cycles of a step of fusion, by its kind, for six states in two modes.
const FUSION: FusionWork =
    FusionWork { predictions: 1200, combinations: 1500, tests: 2200, fusions: 15_000, slopes: 2200, pairs: 45, looks: 12 };

/// What the work of an update amounts to in cycles of a Cortex-M4, by the estimates of this file.
#[must_use]
pub fn fusion_cycles(work: &FusionWork) -> u64 {
    UPDATE
        + work.predictions * FUSION.predictions
        + work.combinations * FUSION.combinations
        + work.tests * FUSION.tests
        + work.fusions * FUSION.fusions
        + work.slopes * FUSION.slopes
        + work.pairs * FUSION.pairs
        + work.looks * FUSION.looks
}
