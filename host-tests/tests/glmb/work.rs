//! The most work of a scan: what models are asked under the heaviest load, counted, against the formula.

use super::Outcome;
use boresight::association::Gate;
use boresight::gaussian::{Gaussian, Innovation};
use boresight::glmb::{Density, Mixture, Particles, Ranked, Region};
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::{Fix, Layout, MeasurementModel, MotionModel};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use nalgebra::{SMatrix, SVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Predictions, innovations, residuals.
#[derive(Debug, Default)]
struct Counts([AtomicU64; 3]);

impl Counts {
    fn add(&self, kind: usize) {
        self.0[kind].fetch_add(1, Relaxed);
    }

    fn take(&self) -> [u64; 3] {
        [0, 1, 2].map(|kind| self.0[kind].swap(0, Relaxed))
    }
}

/// A model that counts what it is asked.
#[derive(Debug, Clone, Copy)]
struct Counting<'a, M> {
    model: M,
    counts: &'a Counts,
}

impl<M: MotionModel<f64, 4>> MotionModel<f64, 4> for Counting<'_, M> {
    const LAYOUT: Layout = M::LAYOUT;
    type Step = M::Step;

    fn transition(&self, x: &SVector<f64, 4>, dt: f64) -> SVector<f64, 4> {
        self.model.transition(x, dt)
    }
    fn jacobian(&self, x: &SVector<f64, 4>, dt: f64) -> SMatrix<f64, 4, 4> {
        self.model.jacobian(x, dt)
    }
    fn process_noise(&self, x: &SVector<f64, 4>, dt: f64) -> Symmetric<f64, 4> {
        self.model.process_noise(x, dt)
    }
    fn step(&self, dt: f64) -> M::Step {
        self.model.step(dt)
    }
    fn advance(&self, g: &mut Gaussian<f64, 4>, step: &M::Step) {
        self.counts.add(0);
        self.model.advance(g, step);
    }
}

impl<M: MeasurementModel<f64, 4, 2>> MeasurementModel<f64, 4, 2> for Counting<'_, M> {
    const LAYOUT: Layout = M::LAYOUT;

    fn observe(&self, x: &SVector<f64, 4>) -> SVector<f64, 2> {
        self.model.observe(x)
    }
    fn jacobian(&self, x: &SVector<f64, 4>) -> SMatrix<f64, 2, 4> {
        self.model.jacobian(x)
    }
    fn noise(&self, x: &SVector<f64, 4>) -> Symmetric<f64, 2> {
        self.model.noise(x)
    }
    fn residual(&self, z: &SVector<f64, 2>, z_hat: &SVector<f64, 2>) -> SVector<f64, 2> {
        self.counts.add(2);
        self.model.residual(z, z_hat)
    }
    fn innovation(&self, g: &Gaussian<f64, 4>) -> Innovation<f64, 4, 2> {
        self.counts.add(1);
        self.model.innovation(g)
    }
    fn locate(&self, z: &SVector<f64, 2>, noise: &Symmetric<f64, 2>) -> Option<Fix<f64>> {
        self.model.locate(z, noise)
    }
}

/// Detections of a scan
const DETS: usize = 8;
type Events = Ranked<16, 16>;
type Memory<D> = GlmbState<f64, D, Events, 24, 32, 6, 4, DETS>;

/// Everything full: all detections in the gates of all tracks, births from every one of them.
fn crowd<D: Density<f64, 4, 2>>() -> Outcome {
    let counts = Counts::default();
    let moving = |acceleration: f64| -> Result<_, boresight::error::ConfigError> {
        Ok(Counting { model: ConstantVelocity::<f64, 2>::new(ProcessNoise::Discrete(acceleration))?, counts: &counts })
    };
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([100.0, 25.0, 100.0, 25.0]));
    let jump = [[0.9, 0.1], [0.1, 0.9]];
    let tracker = JmsGlmb::<f64, _, Events, 4, 2, 4>::new((moving(1.0)?, moving(9.0)?), jump, 0.95, Ranked)?
        .with_region(Region::new(0.3, prior, [0.5, 0.5])?)?
        .with_initiation(Initiation::new(Rule::OnePoint, prior)?, 2.0, 0.3, [0.5, 0.5])?;
    let model = Counting { model: Position::<f64, 2, 2>::new(Symmetric::from_diagonal([25.0; 2]))?, counts: &counts };
    let sensor = UniformSensor::new(model, 0.7, Clutter::Poisson(1e-3), Gate::new::<2>(1e4)?)?;
    let (mut state, mut rng) = (Box::new(Memory::<D>::new()), ChaCha8Rng::seed_from_u64(1));
    let most = Memory::<D>::worst_case::<4, 2>(usize::MAX);
    let most = [most.predictions, most.innovations, most.residuals];
    let mut seen = [0; 3];
    for k in 0..12u32 {
        let plots: Vec<_> = (0..DETS as u32).map(|i| Detection::new([f64::from(i % 3) * 6.0, f64::from((i * k) % 7) * 5.0])).collect();
        tracker.step_with(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * u64::from(k)), &plots), &mut rng)?;
        let counted = counts.take();
        assert!(counted.iter().zip(&most).all(|(count, most)| count <= most), "{counted:?} of {most:?}");
        seen = [0, 1, 2].map(|kind| seen[kind].max(counted[kind]));
    }
    // The load is one: more than half of what may be.
    assert!(seen.iter().zip(&most).all(|(seen, most)| 2 * seen > *most), "{seen:?} of {most:?}");
    Ok(())
}

#[test]
fn no_scan_asks_more_of_gaussians_than_the_formula_says() -> Outcome {
    crowd::<Mixture<f64, 4, 2, 1>>()?;
    crowd::<Mixture<f64, 4, 2, 3>>()
}

#[test]
fn no_scan_asks_more_of_points_than_the_formula_says() -> Outcome {
    crowd::<Particles<f64, 4, 2, 50>>()
}
