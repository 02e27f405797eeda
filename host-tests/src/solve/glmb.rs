//! Kind `glmb`: the untruncated GLMB filter with jump-Markov modes (`boresight::tracker::JmsGlmb`).
//!
//! Inputs of a case: `F`, `Q` per mode, `mode_transition`, `H`, `R`, `p_S`, `p_D` per mode, `clutter_rate`, `volume`, `births`
//! (`r`, `mean`, `cov`, `mode_prob`), `scans`. A scan gives the probabilities of all numbers of targets, and of every label born
//! so far its existence, density and mode probabilities.
//!
//! The tracker is the one that runs on the target, with room for half a million hypotheses, a gate that holds everything, and
//! Gaussians for every sequence of modes over five scans. Cases that need more are refused.

use super::field::{Field, matrix, number, numbers, vector};
use super::kf::symmetric;
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Label, Mixture, Ranked, Region};
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use serde_json::{Value, json};

pub(super) const KIND: Kind = Kind { name: "glmb", lists: &[("cases", solve as CaseSolver)] };

/// Capacities: tracks, hypotheses, targets of one, detections.
const SLOTS: usize = 1024;
const HYPS: usize = 1 << 19;
const LABELS: usize = 12;
const DETS: usize = 16;
/// The births of one scan
const BIRTHS: usize = 4;
/// Every event of a hypothesis, over columns for the detections and the fate of every target
type Truncation = Ranked<8192, 28>;
type Memory<T, const N: usize, const R: usize, const COMPS: usize> =
    GlmbState<T, Mixture<T, N, R, COMPS>, Truncation, SLOTS, HYPS, LABELS, DETS, DETS>;
type Tracker<T, const N: usize, const R: usize> = JmsGlmb<T, [LinearMotion<T, N>; R], Truncation, N, R, BIRTHS>;
type Sensor<T, const N: usize, const M: usize> = UniformSensor<LinearMeasurement<T, N, M>, T>;

/// Scans in several modes of which every sequence is kept.
const MOST_SCANS: usize = 5;

/// The memory is built on the stack before it is boxed.
const STACK_BYTES: usize = 1 << 30;

fn solve(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let modes = case.get("F")?.items()?.len();
    let (n, m) = (case.get("Q")?.items()?.first().map_or(Ok(0), |q| Ok(q.items()?.len()))?, case.get("H")?.items()?.len());
    if modes > 1 && case.get("scans")?.items()?.len() > MOST_SCANS {
        return Err(case.failure(format!("more than {MOST_SCANS} scans with several modes")));
    }
    // Gaussians in every mode: MODES^{scans − 1}.
    let comps = modes.pow(MOST_SCANS as u32 - 1);
    by_size!(precision, filter(case), [n, m, modes, comps], [4 2 1 1] [4 2 2 16] [4 2 3 81])
}

fn filter<T: Scalar, const N: usize, const M: usize, const R: usize, const COMPS: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (tracker, sensor) = models::<T, N, M, R>(case)?;
    let births = case.get("births")?.items()?.len();
    let scans = case.get("scans")?.items()?.iter().map(Field::rows).collect::<Result<Vec<Vec<Vec<T>>>, _>>()?;
    let run = || -> Result<Vec<Value>, Failure> {
        let mut memory = Box::new(Memory::<T, N, R, COMPS>::new());
        let mut steps = Vec::new();
        for (k, scan) in scans.iter().enumerate() {
            let plots: Option<Vec<_>> = scan.iter().map(|z| Some(Detection::new(z.as_slice().try_into().ok()?))).collect();
            let plots = plots.ok_or_else(|| case.failure(format!("scans[{k}]: detections need {M} entries")))?;
            let scan = Scan::new(Instant::from_millis(1000 * k as u64), &plots);
            let report = tracker.step(&mut memory, &sensor, &scan).map_err(|fault| case.failure(fault))?;
            if !report.is_complete() {
                return Err(case.failure(format!("scans[{k}]: no room for all hypotheses ({report:?})")));
            }
            steps.push(step(&memory, births, k));
        }
        Ok(steps)
    };
    let joined = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, run).ok()?;
        thread.join().ok()
    });
    let steps = joined.ok_or_else(|| case.failure("no memory for the filter"))??;
    Ok(json!({ "steps": steps }))
}

/// Reads the tracker and the sensor.
fn models<T: Scalar, const N: usize, const M: usize, const R: usize>(
    case: &Field<'_>,
) -> Result<(Tracker<T, N, R>, Sensor<T, N, M>), Failure> {
    let mut motion = Vec::new();
    for (f, q) in case.get("F")?.items()?.iter().zip(case.get("Q")?.items()?) {
        motion.push(LinearMotion { transition: f.matrix()?, process_noise: Symmetric::from_matrix(&q.matrix()?) });
    }
    let motion = <[_; R]>::try_from(motion).map_err(|_| case.failure("F and Q differ in length"))?;
    let jump = case.get("mode_transition")?.matrix::<T, R, R>()?;
    let jump = std::array::from_fn(|i| std::array::from_fn(|j| jump[(i, j)]));
    let wrong = |fault: ConfigError| case.failure(fault);
    let tracker = JmsGlmb::new(motion, jump, case.get("p_S")?.number()?, Ranked).map_err(wrong)?;
    let mut tracker = tracker.with_visibility(case.get("p_D")?.vector::<T, R>()?.data.0[0]).map_err(wrong)?;
    for birth in case.get("births")?.items()? {
        let density = Gaussian::new(birth.get("mean")?.vector()?, symmetric(&birth, "cov")?);
        let modes = birth.get("mode_prob")?.vector::<T, R>()?.data.0[0];
        let region = Region::new(birth.get("r")?.number()?, density, modes).map_err(|fault| birth.failure(fault))?;
        tracker = tracker.with_region(region).map_err(|fault| birth.failure(fault))?;
    }
    let model = LinearMeasurement { matrix: case.get("H")?.matrix()?, noise: symmetric(case, "R")? };
    let clutter = case.get("clutter_rate")?.number::<T>()? / case.get("volume")?.number()?;
    let gate = Gate::new::<M>(T::lit(1e12)).map_err(wrong)?;
    Ok((tracker, UniformSensor::new(model, T::ONE, Clutter::Poisson(clutter), gate).map_err(wrong)?))
}

/// The results of scan `k`.
fn step<T: Scalar, const N: usize, const R: usize, const COMPS: usize>(memory: &Memory<T, N, R, COMPS>, births: usize, k: usize) -> Value {
    let cardinality: Vec<T> = (0..=births * (k + 1)).map(|n| memory.cardinality(n)).collect();
    let known: Vec<_> = memory.labels::<N, R>().collect();
    let labels = (0..=k).flat_map(|scan| (0..births).map(move |birth| Label { birth_scan: scan as u32, index: birth as u16 }));
    let describe = |label: Label| match known.iter().find(|target| target.label == label) {
        Some(target) => json!({
            "label": [label.birth_scan, label.index], "r": number(target.existence), "x": vector(&target.state.mean),
            "P": matrix(&target.state.cov.to_matrix()), "mode": numbers(&target.modes),
        }),
        None => json!({"label": [label.birth_scan, label.index], "r": 0.0, "x": null, "P": null, "mode": null}),
    };
    json!({
        "n_hypotheses": memory.hypotheses().count(), "cardinality": numbers(&cardinality),
        "labels": labels.map(describe).collect::<Vec<_>>(),
    })
}
