//! No scan makes more work than the formula says, and one that has all detections in all gates makes all of it.

use boresight::association::Gate;
use boresight::coupled::Cross;
use boresight::gaussian::{Gaussian, Innovation};
use boresight::mode::ModeSet;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::resolution::Resolution;
use boresight::model::{Layout, MeasurementModel};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{CoupledState, ImmCoupled};
use nalgebra::{SMatrix, SVector};
use std::cell::Cell;

thread_local! {
    /// Predictions, predicted measurements, residuals
    static COUNTED: Cell<[u64; 3]> = const { Cell::new([0; 3]) };
}

fn count(kind: usize) {
    let mut counted = COUNTED.get();
    counted[kind] += 1;
    COUNTED.set(counted);
}

/// A model that counts its calls.
#[derive(Clone, Copy, Debug)]
struct Counting<M>(M);

type Motion = [ConstantVelocity<f64, 2>; 2];

impl ModeSet<f64, 4, 2> for Counting<Motion> {
    const LAYOUT: Layout = <Motion as ModeSet<f64, 4, 2>>::LAYOUT;
    type Steps = <Motion as ModeSet<f64, 4, 2>>::Steps;

    fn steps(&self, dt: f64) -> Self::Steps {
        <Motion as ModeSet<f64, 4, 2>>::steps(&self.0, dt)
    }
    fn advance(&self, mode: usize, g: &mut Gaussian<f64, 4>, steps: &Self::Steps) {
        count(0);
        self.0.advance(mode, g, steps);
    }
    fn propagate(&self, mode: usize, x: &SVector<f64, 4>, v: &mut SMatrix<f64, 4, 4>, dt: f64) {
        self.0.propagate(mode, x, v, dt);
    }
}

impl MeasurementModel<f64, 4, 2> for Counting<Position<f64, 2, 2>> {
    const LAYOUT: Layout = <Position<f64, 2, 2> as MeasurementModel<f64, 4, 2>>::LAYOUT;

    fn observe(&self, x: &SVector<f64, 4>) -> SVector<f64, 2> {
        self.0.observe(x)
    }
    fn jacobian(&self, x: &SVector<f64, 4>) -> SMatrix<f64, 2, 4> {
        self.0.jacobian(x)
    }
    fn noise(&self, x: &SVector<f64, 4>) -> Symmetric<f64, 2> {
        self.0.noise(x)
    }
    fn residual(&self, z: &SVector<f64, 2>, z_hat: &SVector<f64, 2>) -> SVector<f64, 2> {
        count(2);
        z - z_hat
    }
    fn difference(&self, a: &SVector<f64, 2>, b: &SVector<f64, 2>) -> SVector<f64, 2> {
        a - b
    }
    fn innovation(&self, g: &Gaussian<f64, 4>) -> Innovation<f64, 4, 2> {
        count(1);
        self.0.innovation(g)
    }
}

const DETS: usize = 6;
type Filter = ImmCoupled<f64, Counting<Motion>, 4, 2>;

/// What a scan of `plots` counts, with targets whose variances are `variance`.
fn counted(plots: usize, variance: f64) -> [u64; 3] {
    let modes = Counting([1.0, 9.0].map(|noise| ConstantVelocity::new(ProcessNoise::Discrete(noise)).expect("sound")));
    let filter = Filter::new(modes, [[0.9, 0.1], [0.1, 0.9]], [0.5, 0.5]).expect("sound");
    let model = Counting(Position::new(Symmetric::from_diagonal([25.0; 2])).expect("sound"));
    let gate = Gate::new::<2>(16.0).expect("sound");
    let sensor = UniformSensor::new(model, 0.9, Clutter::Diffuse, gate).expect("sound");
    let sensor = Unresolving { sensor, resolution: Resolution::new([20.0; 2]).expect("sound") };
    let mut state = CoupledState::<f64, 4, 2, DETS, Cross<f64, 4>>::new();
    let target = |x: f64| Gaussian::new([x, 0.0, 0.0, 0.0].into(), Symmetric::from_diagonal([variance; 4]));
    filter.start(&mut state, [target(-5.0), target(5.0)], Instant::ZERO).expect("accepted");
    let plots: Vec<_> = (0..plots).map(|k| Detection::new([3.0 * k as f64, -2.0 * k as f64])).collect();
    COUNTED.set([0; 3]);
    filter.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000), &plots)).expect("accepted");
    COUNTED.get()
}

#[test]
fn no_scan_makes_more_work_than_stated() {
    for plots in 0..=DETS + 2 {
        let most = Filter::worst_case(plots.min(DETS));
        let most = [most.predictions, most.innovations, most.residuals];
        assert_eq!(counted(plots, 1e4), most);
        assert!(counted(plots, 1.0).iter().zip(&most).all(|(counted, most)| counted <= most));
    }
}
