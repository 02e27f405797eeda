//! The Kalman filter of other Rust crates beside ours: constant velocity, states (x, vx, y, vy), positions; five scans.
//!
//! ```text
//! cargo run --release --manifest-path host-tests/benches/peers/Cargo.toml
//! ```
//!
//! Models, plots and references are those of `kf4` in `twin::workloads`: every filter must agree with them to 1e-4 of the
//! largest entry of mean and covariance, or the run fails. adskalman 0.18 runs with its default update, Joseph's form, and with
//! P − K H P; minikalman 0.8 knows P − K H P; tracktor 0.4 always takes Joseph's form. All but minikalman have fixed sizes in
//! their types, and all are dense: they multiply by the zeros of F and H, which ours never forms.
//!
//! Criterion times, and the table in the end takes the shortest batch of each, and divides within this run.

mod filters;

use adskalman::CovarianceUpdateMethod::{JosephForm, OptimalKalman};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::symmetric::Symmetric;
use criterion::Criterion;
use filters::Scalar;
use nalgebra::{SMatrix, SVector};
use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};
use twin::workloads::TOLERANCE;
use twin::workloads::data::{self, DT};

const SCANS: usize = data::KF4_EXPECTED.len();

const FILTERS: [&str; 5] = ["boresight", "minikalman", "adskalman", "adskalman, Joseph", "tracktor, Joseph"];

/// Mean and covariance, rows, in double precision whoever made them.
type State = ([f64; 4], [[f64; 4]; 4]);

/// F, H, Q and R, dense.
struct Matrices {
    f: SMatrix<f64, 4, 4>,
    h: SMatrix<f64, 2, 4>,
    q: SMatrix<f64, 4, 4>,
    r: SMatrix<f64, 2, 2>,
    x: SVector<f64, 4>,
    p: SMatrix<f64, 4, 4>,
    z: [SVector<f64, 2>; SCANS],
}

impl Matrices {
    /// From our models, whose dense forms are exact.
    fn new() -> Result<Self, Box<dyn Error>> {
        let motion = ConstantVelocity::<f64, 2>::new(ProcessNoise::Discrete(0.25))?;
        let dt = f64::from(DT);
        let start = data::IMM4_START.modes[0].gaussian();
        let noise = data::NOISE.map(|row| row.map(f64::from));
        let position = Position::<f64, 2, 2>::new(Symmetric::from_fn(|i, j| noise[i][j]))?;
        Ok(Self {
            f: MotionModel::<f64, 4>::jacobian(&motion, &SVector::zeros(), dt),
            h: MeasurementModel::<f64, 4, 2>::jacobian(&position, &SVector::zeros()),
            q: MotionModel::<f64, 4>::process_noise(&motion, &SVector::zeros(), dt).to_matrix(),
            r: MeasurementModel::<f64, 4, 2>::noise(&position, &SVector::zeros()).to_matrix(),
            x: start.mean.map(f64::from),
            p: start.cov.to_matrix().map(f64::from),
            z: std::array::from_fn(|k| SVector::from(data::IMM4_PLOTS[k][0].map(f64::from))),
        })
    }
}

/// Whether the filter ends where it should, by the tolerance of the workload.
fn check(name: &str, (x, p): &State) -> Result<(), String> {
    let want = &data::KF4_EXPECTED[SCANS - 1];
    let near = |got: &[f64], want: &[f32]| {
        let largest = want.iter().fold(0.0, |m: f32, v| m.max(v.abs()));
        got.iter().zip(want).all(|(g, w)| (g - f64::from(*w)).abs() <= f64::from(TOLERANCE * largest))
    };
    let agrees = near(x, &want.mean) && near(p.as_flattened(), want.cov.as_flattened());
    agrees.then_some(()).ok_or_else(|| format!("{name} does not agree with the reference"))
}

/// Seconds a scan in the shortest batch.
fn time(criterion: &mut Criterion, name: &str, mut run: impl FnMut() -> State) -> Result<f64, String> {
    check(name, &run())?;
    let mut shortest = f64::INFINITY;
    criterion.bench_function(name, |bencher| {
        bencher.iter_custom(|calls| {
            let start = Instant::now();
            for _ in 0..calls {
                black_box(run());
            }
            let elapsed = start.elapsed();
            shortest = shortest.min(elapsed.as_secs_f64() / (calls as f64 * SCANS as f64));
            elapsed
        });
    });
    Ok(shortest)
}

/// Seconds of every filter in one precision.
fn times<T: Scalar + Default>(c: &mut Criterion, m: &Matrices, precision: &str) -> Result<[f64; 5], Box<dyn Error>> {
    let mut group = |filter: &str, run: &mut dyn FnMut() -> State| time(c, &format!("{filter} {precision}"), run);
    Ok([
        group(FILTERS[0], &mut filters::boresight::<T>(m)?)?,
        group(FILTERS[1], &mut filters::minikalman::<T>(m))?,
        group(FILTERS[2], &mut filters::adskalman::<T>(m, || OptimalKalman))?,
        group(FILTERS[3], &mut filters::adskalman::<T>(m, || JosephForm))?,
        group(FILTERS[4], &mut filters::tracktor::<T>(m))?,
    ])
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut c = Criterion::default().without_plots().warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    let m = Matrices::new()?;
    let (single, double) = (times::<f32>(&mut c, &m, "f32")?, times::<f64>(&mut c, &m, "f64")?);
    println!("\n| filter | f32 [ns a scan] | x boresight | f64 [ns a scan] | x boresight |\n|---|--:|--:|--:|--:|");
    for ((name, f32), f64) in FILTERS.iter().zip(single).zip(double) {
        println!("| {name} | {:.0} | {:.1} | {:.0} | {:.1} |", f32 * 1e9, f32 / single[0], f64 * 1e9, f64 / double[0]);
    }
    Ok(())
}
