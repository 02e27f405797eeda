//! No scan makes more work than the formula says, and one that has all detections in all gates makes all of it.

use crate::counting::{Asked, Counting, take};
use boresight::association::Gate;
use boresight::coupled::Cross;
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::resolution::Resolution;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{CoupledState, ImmCoupled};

type Motion = [ConstantVelocity<f64, 2>; 2];

const DETS: usize = 6;
type Filter = ImmCoupled<f64, Counting<Motion>, 4, 2>;

/// What a scan of `plots` counts, with targets whose variances are `variance`.
fn counted(plots: usize, variance: f64) -> [u64; 3] {
    let modes = Counting([1.0, 9.0].map(|noise| ConstantVelocity::new(ProcessNoise::Discrete(noise)).expect("sound")));
    let filter = Filter::new(modes, [[0.9, 0.1], [0.1, 0.9]], [0.5, 0.5]).expect("sound");
    let model = Counting(Position::<f64, 2, 2>::new(Symmetric::from_diagonal([25.0; 2])).expect("sound"));
    let gate = Gate::new::<2>(16.0).expect("sound");
    let sensor = UniformSensor::new(model, 0.9, Clutter::Diffuse, gate).expect("sound");
    let sensor = Unresolving { sensor, resolution: Resolution::new([20.0; 2]).expect("sound") };
    let mut state = CoupledState::<f64, 4, 2, DETS, Cross<f64, 4>>::new();
    let target = |x: f64| Gaussian::new([x, 0.0, 0.0, 0.0].into(), Symmetric::from_diagonal([variance; 4]));
    filter.start(&mut state, [target(-5.0), target(5.0)], Instant::ZERO).expect("accepted");
    let plots: Vec<_> = (0..plots).map(|k| Detection::new([3.0 * k as f64, -2.0 * k as f64])).collect();
    take();
    filter.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000), &plots)).expect("accepted");
    let Asked { predictions, innovations, residuals, .. } = take();
    [predictions, innovations, residuals]
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
