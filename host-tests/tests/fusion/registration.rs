//! Frames: a sensor's own axes and place against the common ones.

use crate::bank;
use crate::support::{draws, gaussian, least_eigenvalue};
use boresight::error::ConfigError;
use boresight::fusion::Frame;
use boresight::model::Layout;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

const PLANE: Layout = Layout { axes: 2, stride: 3 };
const SPACE: Layout = Layout { axes: 3, stride: 3 };

proptest! {
    #[test]
    fn a_track_is_moved_and_turned_with_its_covariance(draws in draws(), heading in -3.2..3.2f64, east in -1e4..1e4, north in -1e4..1e4f64) {
        let frame = Frame::new([east, north, 50.0], heading).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let before = gaussian::<f64, 9>(&draws, 1000.0, 10.0);
        let mut after = before;
        frame.register(&mut after, SPACE);
        let (sin, cos) = heading.sin_cos();
        let mut turn = SMatrix::<f64, 9, 9>::identity();
        for k in 0..3 {
            (turn[(k, k)], turn[(k, k + 3)], turn[(k + 3, k)], turn[(k + 3, k + 3)]) = (cos, -sin, sin, cos);
        }
        let mut mean = turn * before.mean;
        (mean[0], mean[3], mean[6]) = (mean[0] + east, mean[3] + north, mean[6] + 50.0);
        prop_assert!((after.mean - mean).norm() < 1e-9 * (1.0 + mean.norm()));
        let cov = turn * before.cov.to_matrix() * turn.transpose();
        prop_assert!((after.cov.to_matrix() - cov).norm() < 1e-9 * cov.norm());
    }

    /// The linear share of an uncertain heading, against the difference that a small turn makes.
    #[test]
    fn what_is_not_known_of_place_and_heading_is_added(draws in draws(), heading in -3.0..3.0f64) {
        let place = Symmetric::from_diagonal([9.0, 16.0, 25.0]);
        let register = |heading: f64, variance: f64, place| {
            let mut g = gaussian::<f64, 6>(&draws, 1000.0, 1.0);
            let frame = Frame::new([300.0, -200.0, 0.0], heading).and_then(|f| f.with_uncertainty(place, variance));
            frame.map(|frame| frame.register(&mut g, PLANE)).map(|()| g)
        };
        let fail = |e: ConfigError| TestCaseError::fail(e.to_string());
        let (certain, uncertain) = (register(heading, 0.0, Symmetric::zeros()).map_err(fail)?, register(heading, 1e-4, place).map_err(fail)?);
        let ahead = register(heading + 1e-6, 0.0, Symmetric::zeros()).map_err(fail)?;
        let lever = (ahead.mean - certain.mean) / 1e-6;
        let mut more = lever * lever.transpose() * 1e-4;
        (more[(0, 0)], more[(3, 3)]) = (more[(0, 0)] + 9.0, more[(3, 3)] + 16.0);
        let added = uncertain.cov.to_matrix() - certain.cov.to_matrix();
        prop_assert!((added - more).norm() < 1e-5 * more.norm(), "{added} for {more}");
        prop_assert_eq!(certain.mean, uncertain.mean);
    }

    #[test]
    fn every_mode_of_a_bank_is_registered_and_stays_definite(draws in draws(), heading in -3.2..3.2f32) {
        let frame = Frame::new([1e4f32, -2e4, 0.0], heading).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let before = bank::<f32>(&draws, 1000.0, 5.0);
        let mut after = before;
        frame.register_bank(&mut after, PLANE);
        prop_assert_eq!(after.prob, before.prob);
        for (mode, g) in before.modes.iter().zip(&after.modes) {
            let mut alone = *mode;
            frame.register(&mut alone, PLANE);
            prop_assert_eq!(alone, *g);
            prop_assert!(least_eigenvalue(&g.cov) > -1e-5);
        }
    }
}

#[test]
fn the_common_frame_changes_nothing() {
    let before = gaussian::<f32, 6>(&[0.3; 90], 1000.0, 5.0);
    let mut after = before;
    Frame::COMMON.register(&mut after, PLANE);
    assert_eq!(before, after);
}

#[test]
fn what_does_not_belong_to_an_axis_stays() {
    let mut g = gaussian::<f64, 5>(&[0.3; 90], 10.0, 1.0);
    let before = g;
    let frame = Frame::new([5.0, 6.0, 7.0], 0.5);
    assert!(frame.map(|frame| frame.register(&mut g, Layout { axes: 2, stride: 2 })).is_ok());
    assert_eq!((g.mean[4], g.cov.get(4, 4)), (before.mean[4], before.cov.get(4, 4)));
    // One axis is moved, and nothing is there to be turned into.
    let mut line = gaussian::<f64, 2>(&[0.3; 90], 10.0, 1.0);
    let before = line;
    assert!(frame.map(|frame| frame.register(&mut line, Layout { axes: 1, stride: 2 })).is_ok());
    assert_eq!(line.mean - before.mean, SVector::from([5.0, 0.0]));
    assert_eq!(line.cov, before.cov);
}

#[test]
fn frames_that_are_none_are_refused() {
    assert_eq!(Frame::new([f32::NAN, 0.0, 0.0], 0.0), Err(ConfigError::NotFinite));
    assert_eq!(Frame::new([0.0; 3], f32::INFINITY), Err(ConfigError::NotFinite));
    let with = |variance: f32, heading: f32| Frame::COMMON.with_uncertainty(Symmetric::from_diagonal([variance, 0.0, 0.0]), heading);
    assert!(with(1.0, 0.0).is_ok());
    assert_eq!(with(-1.0, 0.0), Err(ConfigError::NotDefinite));
    assert_eq!(with(1.0, -1.0), Err(ConfigError::NotDefinite));
    assert_eq!(with(f32::NAN, 0.0), Err(ConfigError::NotFinite));
}
