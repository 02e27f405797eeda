//! The kernels on the desk: what the image `budget` counts on the target, in single and double precision.
//!
//! ```text
//! cargo bench -p host-tests --bench kernels                     all, in half a minute
//! PYTHON=venv/bin/python cargo bench ...                        beside Python: `pip install filterpy pyehm` there
//!
//! imm6, imm4    one scan of one track: IMM-PDAF, four plots                                   (`twin::workloads`)
//! .. one plot   the same filter without association: interaction, prediction, update by one plot, combination
//! jpda          marginals of 4 tracks and 8 detections; with loading of the weights
//! kf4           prediction and update
//! ```
//!
//! FilterPy, in Python with numpy, has the two IMM of one plot (`IMMEstimator`) and the Kalman filter (`KalmanFilter`), PyEHM,
//! C++ behind Python, the marginals (EHM2). They get the same matrices and numbers, and must end where double precision ends, to
//! 1e-8 of a standard deviation or of a probability, or the run fails; so must single precision, to 1e-2. Of the times of PyEHM
//! that of an empty call is taken off; numpy is part of FilterPy. Rust crates: `../peers`.
//!
//! Criterion times and compares with its last run; the table in the end takes the shortest batch of each and divides within this
//! run.

#[path = "../support/mod.rs"]
mod support;
mod workloads;

use boresight::gaussian::Gaussian;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::error::Error;
use std::hint::black_box;
use std::time::Duration;
use support::{ask, shortest, times};
use twin::workloads::data::{DT, IMM4_PLOTS, IMM6_PLOTS};
use workloads::{Joint, Kf4, imm4, imm6};

const SCANS: usize = IMM6_PLOTS.len();
/// How far double precision and Python may lie apart, and single from double.
const AGREEMENT: f64 = 1e-8;
const SINGLE: f64 = 1e-2;

type Rows = Vec<Vec<f64>>;

/// A filter as `time_filterpy.py` reads it: F and Q of every mode, H, R, where it starts, what it sees, and where it must end.
#[derive(Serialize)]
struct Filter {
    name: &'static str,
    f: Vec<Rows>,
    q: Vec<Rows>,
    h: Rows,
    r: Rows,
    jump: Rows,
    prob: Vec<f64>,
    x: Rows,
    p: Vec<Rows>,
    z: Rows,
    mean: Vec<f64>,
    cov: Rows,
}

/// What a script found.
#[derive(Default, Deserialize)]
struct Answer {
    version: String,
    /// Seconds of a call that has nothing to do
    #[serde(default)]
    call: f64,
    seconds: HashMap<String, Option<f64>>,
    /// The largest difference from what we have
    difference: f64,
}

/// Seconds of a scan.
struct Row {
    name: &'static str,
    single: f64,
    double: f64,
}

fn rows<T: Real, const R: usize, const C: usize>(m: &SMatrix<T, R, C>) -> Rows {
    m.row_iter().map(|row| row.iter().map(|v| v.to_f64()).collect()).collect()
}

/// The largest difference of a mean in standard deviations, or of a covariance in products of two.
fn apart<T: Real, const NX: usize>(g: &Gaussian<T, NX>, want: &Gaussian<f64, NX>) -> f64 {
    let (got, cov) = (g.cov.to_matrix().map(|v| v.to_f64()), want.cov.to_matrix());
    let sigma = cov.diagonal().map(f64::sqrt);
    let means = (0..NX).map(|i| (g.mean[i].to_f64() - want.mean[i]).abs() / sigma[i]);
    let covs = (0..NX * NX).map(|k| (got[k] - cov[k]).abs() / (sigma[k % NX] * sigma[k / NX]));
    means.chain(covs).fold(0.0, f64::max)
}

/// Times both precisions; `None` where the command line leaves them out.
fn pair<const NX: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &'static str,
    mut single: impl FnMut() -> Gaussian<f32, NX>,
    mut double: impl FnMut() -> Gaussian<f64, NX>,
) -> Result<Option<Row>, String> {
    let off = apart(&single(), &double());
    if off.is_nan() || off > SINGLE {
        return Err(format!("{name}: single precision is off by {off} standard deviations"));
    }
    let scan = |seconds: f64| seconds / SCANS as f64;
    let single = shortest(group, &format!("{name}, f32"), || _ = black_box(single())).map(scan);
    let double = shortest(group, &format!("{name}, f64"), || _ = black_box(double())).map(scan);
    Ok(single.zip(double).map(|(single, double)| Row { name, single, double }))
}

/// F and Q of a model, which are the same everywhere.
fn dense<M: MotionModel<f64, NX>, const NX: usize>(model: &M, at: &Gaussian<f64, NX>) -> (Rows, Rows) {
    let dt = f64::from(DT);
    (rows(&model.jacobian(&at.mean, dt)), rows(&model.process_noise(&at.mean, dt).to_matrix()))
}

/// What Python is to compute: `modes` from `start` by the first plots of `scans`, to end at `end`.
fn filter<S: MeasurementModel<f64, NX, 2>, const NX: usize, const MODES: usize>(
    name: &'static str,
    modes: [(Rows, Rows); MODES],
    (jump, prob): ([[f64; MODES]; MODES], [f64; MODES]),
    start: &[Gaussian<f64, NX>; MODES],
    sensor: &S,
    (scans, end): (&[[[f32; 2]; 4]], &Gaussian<f64, NX>),
) -> Filter {
    let (f, q) = modes.into_iter().unzip();
    Filter {
        name,
        f,
        q,
        h: rows(&sensor.jacobian(&SVector::zeros())),
        r: rows(&sensor.noise(&SVector::zeros()).to_matrix()),
        jump: jump.map(Vec::from).into(),
        prob: prob.into(),
        x: start.iter().map(|g| g.mean.iter().copied().collect()).collect(),
        p: start.iter().map(|g| rows(&g.cov.to_matrix())).collect(),
        z: scans.iter().map(|[z, ..]| z.map(f64::from).into()).collect(),
        mean: end.mean.iter().copied().collect(),
        cov: rows(&end.cov.to_matrix()),
    }
}

/// The filters that FilterPy has too.
fn filters() -> Result<[Filter; 3], Box<dyn Error>> {
    let (mut six, mut four, kf4) = (imm6::<f64>()?, imm4::<f64>()?, Kf4::<f64>::new()?);
    let ends = (six.alone(&IMM6_PLOTS), four.alone(&IMM4_PLOTS), kf4.run(&IMM4_PLOTS));
    let modes6 = [dense(&six.modes.0, &ends.0), dense(&six.modes.1, &ends.0)];
    let modes4 = [dense(&four.modes.0, &ends.1), dense(&four.modes.1, &ends.1), dense(&four.modes.2, &ends.1)];
    let one = [dense(&kf4.motion, &ends.2)];
    Ok([
        filter("imm6, one plot", modes6, (six.jump, six.start.prob), &six.start.modes, &six.sensor.model, (&IMM6_PLOTS, &ends.0)),
        filter("imm4, one plot", modes4, (four.jump, four.start.prob), &four.start.modes, &four.sensor.model, (&IMM4_PLOTS, &ends.1)),
        filter("kf4", one, ([[1.0]], [1.0]), &[kf4.start], &kf4.position, (&IMM4_PLOTS, &ends.2)),
    ])
}

/// The joint association as `time_pyehm.py` reads it.
#[derive(Serialize)]
struct Problem {
    name: &'static str,
    miss: [f64; 4],
    hit: [[f64; 8]; 4],
    marginals: Rows,
}

fn measure(criterion: &mut Criterion) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut group = criterion.benchmark_group("kernels");
    let (mut six, mut six64) = (imm6::<f32>()?, imm6::<f64>()?);
    let (mut four, mut four64) = (imm4::<f32>()?, imm4::<f64>()?);
    let (kf4, kf464) = (Kf4::<f32>::new()?, Kf4::<f64>::new()?);
    let (plots6, plots4) = (|| black_box(&IMM6_PLOTS), || black_box(&IMM4_PLOTS));
    let mut found = vec![
        pair(&mut group, "imm6", || six.in_clutter(plots6()), || six64.in_clutter(plots6()))?,
        pair(&mut group, "imm4", || four.in_clutter(plots4()), || four64.in_clutter(plots4()))?,
        pair(&mut group, "imm6, one plot", || six.alone(plots6()), || six64.alone(plots6()))?,
        pair(&mut group, "imm4, one plot", || four.alone(plots4()), || four64.alone(plots4()))?,
        pair(&mut group, "kf4", || kf4.run(plots4()), || kf464.run(plots4()))?,
    ];
    let (mut joint, mut joint64) = (Joint::<f32>::new(), Joint::<f64>::new());
    let off = (joint.run() - joint64.run()).abs().max();
    if off.is_nan() || off > SINGLE {
        return Err(format!("jpda: single precision is off by {off}").into());
    }
    let single = shortest(&mut group, "jpda, f32", || _ = black_box(joint.run()));
    let double = shortest(&mut group, "jpda, f64", || _ = black_box(joint64.run()));
    found.push(single.zip(double).map(|(single, double)| Row { name: "jpda", single, double }));
    group.finish();
    Ok(found.into_iter().flatten().collect())
}

/// What Python takes, if it is there and agrees.
fn checked(answer: Option<Answer>) -> Result<Answer, String> {
    let answer = answer.unwrap_or_default();
    if answer.difference <= AGREEMENT { Ok(answer) } else { Err(format!("Python is off by {}", answer.difference)) }
}

fn main() -> Result<(), Box<dyn Error>> {
    let brief = |c: Criterion| c.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(800));
    let mut criterion = brief(Criterion::default().without_plots().sample_size(30).nresamples(5_000)).configure_from_args();
    let found = measure(&mut criterion)?;
    if found.is_empty() {
        return Ok(());
    }
    let filterpy = checked(ask("kernels/time_filterpy.py", &filters()?)?)?;
    let mut joint = Joint::<f64>::new();
    let (miss, hit) = (joint.weights.miss, joint.weights.hit);
    let pyehm = checked(ask("time_pyehm.py", &[Problem { name: "jpda", miss, hit, marginals: rows(&joint.run()) }])?)?;

    println!("\n| kernel | f32 [ns] | f64 [ns] | f64 / f32 | Python [us] | x f64 |\n|---|--:|--:|--:|--:|--:|");
    for Row { name, single, double } in found {
        let filter = filterpy.seconds.get(name).copied().flatten().map(|s| s / SCANS as f64);
        let python = filter.or(pyehm.seconds.get(name).copied().flatten().map(|s| s - pyehm.call));
        let (theirs, ratio) = python.map_or_else(Default::default, |s| (format!("{:.2}", s * 1e6), times(s / double)));
        println!("| {name} | {:.0} | {:.0} | {} | {theirs} | {ratio} |", single * 1e9, double * 1e9, times(double / single));
    }
    println!("\nFilterPy {}, PyEHM {} less the {:.1} us of a call from Python.", filterpy.version, pyehm.version, pyehm.call * 1e6);
    Ok(())
}
