//! Labelled sets: looks, sums and comparisons of whole scans, and of ranking alone. What is asked of models, `tests/glmb/work.rs`
//! counts.

use super::{COUNTER, Outcome};
use boresight::association::{Gate, KBest, take_operations};
use boresight::gaussian::Gaussian;
use boresight::glmb::{GlmbWork, Mixture, Ranked, Region, take_work};
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::SVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use twin::glmb::{Linear, MOST, Scans, linear};

fn kinds(work: &GlmbWork) -> [f64; 3] {
    [work.looks, work.sums, work.comparisons].map(|n| n as f64)
}

/// A scan, held against the formula: its shares of that.
fn held<E>(most: &GlmbWork, step: impl FnOnce() -> Result<(), E>) -> Result<[f64; 3], E> {
    take_work();
    step()?;
    let (seen, most) = (kinds(&take_work()), kinds(most));
    assert!(seen.iter().zip(&most).all(|(seen, most)| seen <= most), "{seen:?} of at most {most:?}");
    Ok(std::array::from_fn(|kind| seen[kind] / most[kind]))
}

fn larger(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|kind| a[kind].max(b[kind]))
}

#[test]
fn no_recorded_scan_takes_more_work_than_the_formula() -> Outcome {
    let _alone = COUNTER.lock();
    let (mut form, mut scans, mut state) = (linear()?, Scans::new(), Box::new(Linear::new()));
    let mut worst = [0.0; 3];
    while let Some(scan) = scans.next(false) {
        worst = larger(worst, held(&Linear::worst_case::<4, 3>(MOST), || form.step(&mut state, &scan).then_some(()).ok_or("not taken"))?);
    }
    println!("largest shares of the formula: {worst:.4?}");
    assert!(worst.iter().all(|share| *share > 0.0));
    Ok(())
}

/// Crowds: targets and detections in one place, hardly apart or exactly alike, so that no event is much lighter than the next.
fn crowd<
    const SLOTS: usize,
    const HYPS: usize,
    const LABELS: usize,
    const GATED: usize,
    const DETS: usize,
    const K: usize,
    const C: usize,
>(
    rounds: u64,
    most: usize,
) -> Result<[f64; 3], Box<dyn Error>> {
    let mut worst = [0.0; 3];
    for round in 0..rounds {
        let mut rng = ChaCha8Rng::seed_from_u64(round);
        let mode = |acceleration: f32| ConstantVelocity::<f32, 2>::new(ProcessNoise::Discrete(acceleration));
        let spread = [0.0, 1.0, 10.0][round as usize % 3];
        let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([100.0, 25.0, 100.0, 25.0]));
        let tracker = JmsGlmb::<f32, _, _, 4, 1, 3>::new((mode(1.0)?,), [[1.0]], rng.random_range(0.3..0.99), Ranked::<K, C>)?
            .with_region(Region::new(0.5, prior, [1.0])?)?
            .with_initiation(Initiation::new(Rule::OnePoint, prior)?, 3.0, 0.5, [1.0])?
            .with_limits(most, 0.0)?;
        let model = Position::<f32, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?;
        // From detections that weigh less than a miss to ones that weigh more.
        let clutter = Clutter::Poisson(10f32.powf(rng.random_range(-4.5..-2.0)));
        let sensor = UniformSensor::new(model, rng.random_range(0.2..0.9), clutter, Gate::new::<2>(1e3)?)?;
        let mut state = Box::new(GlmbState::<f32, Mixture<f32, 4, 1, 1>, Ranked<K, C>, SLOTS, HYPS, LABELS, GATED, DETS>::new());
        let formula = GlmbState::<f32, Mixture<f32, 4, 1, 1>, Ranked<K, C>, SLOTS, HYPS, LABELS, GATED, DETS>::worst_case::<4, 1>(most);
        for k in 0..10 {
            let plots: Vec<_> = (0..DETS).map(|_| Detection::new([0, 1].map(|_| spread * rng.random_range(-1.0f32..=1.0)))).collect();
            let scan = Scan::new(Instant::from_millis(1000 * k), &plots);
            worst = larger(worst, held(&formula, || tracker.step(&mut state, &sensor, &scan).map(|_| ()))?);
        }
    }
    println!("largest shares of the formula: {worst:.3?}");
    Ok(worst)
}

#[test]
fn no_crowd_takes_more_work_than_the_formula() -> Outcome {
    let _alone = COUNTER.lock();
    let shares = [
        crowd::<8, 1, 2, 1, 2, 1, 4>(6, 1)?,
        crowd::<24, 16, 6, 4, 8, 16, 14>(12, usize::MAX)?,
        crowd::<24, 64, 6, 4, 8, 16, 14>(12, 20)?,
        crowd::<24, 64, 6, 8, 8, 40, 14>(12, usize::MAX)?,
        crowd::<32, 64, 10, 6, 32, 20, 24>(6, 20)?,
    ];
    // The formula is not idle: of every kind a fifth is reached.
    let worst = shares.into_iter().reduce(larger).unwrap_or_default();
    assert!(worst.iter().all(|share| *share > 0.2), "{worst:?}");
    Ok(())
}

/// The largest share of the formula over random matrices, from all alike to far apart, dense and sparse.
fn ranking<const ROWS: usize, const COLUMNS: usize, const K: usize>(count: usize) -> f64 {
    let (mut rng, mut memory) = (ChaCha8Rng::seed_from_u64(5), Box::new(KBest::<f32, ROWS, COLUMNS, K>::new()));
    let mut worst = 0;
    for round in 0..count {
        let (spread, density) = ([0.0, 0.1, 3.0, 30.0][round % 4], [0.3, 1.0][round / 4 % 2]);
        let mut draw = |density| if rng.random_bool(density) { rng.random_range(-spread..=spread) } else { f32::NEG_INFINITY };
        let matrix: [[f32; COLUMNS]; ROWS] = std::array::from_fn(|_| std::array::from_fn(|_| draw(density)));
        let miss: [f32; ROWS] = std::array::from_fn(|_| draw(1.0) - [0.0, 20.0][round / 8 % 2]);
        take_operations();
        memory.rank(ROWS, COLUMNS, |t| miss[t], |t, j| matrix[t][j]);
        worst = worst.max(take_operations());
    }
    worst as f64 / KBest::<f32, ROWS, COLUMNS, K>::worst_case() as f64
}

#[test]
fn no_matrix_takes_more_looks_than_the_formula() {
    let _alone = COUNTER.lock();
    let shares =
        [ranking::<1, 1, 1>(16), ranking::<4, 4, 64>(64), ranking::<6, 14, 16>(64), ranking::<10, 24, 20>(64), ranking::<12, 6, 50>(64)];
    println!("largest shares of the formula: {shares:.3?}");
    assert!(shares.iter().all(|share| *share > 0.1 && *share <= 1.0), "{shares:?}");
}
