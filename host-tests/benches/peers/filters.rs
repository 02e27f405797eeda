//! The filters, one function each: from the matrices to something that runs all scans and tells where it ends.

use crate::{Matrices, SCANS, State};
use adskalman::{CovarianceUpdateMethod, KalmanFilterNoControl, StateAndCovariance};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use minikalman::prelude::*;
use minikalman::regular::builder::KalmanFilterBuilder;
use nalgebra::SMatrix;
use nalgebra_of_adskalman as na35;
use std::hint::black_box;
use tracktor::filters::kalman::{KalmanFilter, KalmanState};
use tracktor::types::spaces::{Covariance, Measurement, MeasurementCovariance, StateCovariance, StateVector};
use tracktor::types::transforms::{ObservationMatrix, TransitionMatrix};
use twin::workloads::data::DT;

/// What all of them can calculate with: `f32` and `f64`.
pub trait Scalar: Real + MatrixDataType + num_traits::Float + na35::RealField {}
impl Scalar for f32 {}
impl Scalar for f64 {}

fn cast<T: Real, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<T, R, C> {
    m.map(T::lit)
}

fn state<T: Real>(x: impl Fn(usize) -> T, p: impl Fn(usize, usize) -> T) -> State {
    (std::array::from_fn(|i| x(i).to_f64()), std::array::from_fn(|i| std::array::from_fn(|j| p(i, j).to_f64())))
}

pub fn boresight<T: Scalar>(m: &Matrices) -> Result<impl Fn() -> State, ConfigError> {
    let motion = ConstantVelocity::<T, 2>::new(ProcessNoise::Discrete(T::lit(0.25)))?;
    let position = Position::<T, 2, 2>::new(Symmetric::from_matrix(&cast(&m.r)))?;
    let start = Gaussian::new(cast(&m.x), Symmetric::from_matrix(&cast(&m.p)));
    let plots = m.z.map(|z| cast(&z));
    Ok(move || {
        let mut g = black_box(start);
        for z in black_box(&plots) {
            motion.predict(&mut g, T::lit(DT.into()));
            let innovation = position.innovation(&g);
            let nu = MeasurementModel::<T, 4, 2>::residual(&position, z, &innovation.z_hat);
            let _ = g.update(&innovation, &nu);
        }
        let p = g.cov.to_matrix();
        state(|i| g.mean[i], |i, j| p[(i, j)])
    })
}

pub fn minikalman<T: Scalar + Default>(m: &Matrices) -> impl FnMut() -> State {
    fn write<T: Scalar, const R: usize, const C: usize>(to: &mut impl MatrixMut<R, C, T>, from: &SMatrix<f64, R, C>) {
        (0..R).for_each(|i| (0..C).for_each(|j| to.set_at(i, j, T::lit(from[(i, j)]))));
    }
    let builder = KalmanFilterBuilder::<4, T>::default();
    let (mut filter, mut sensor) = (builder.build(), builder.observations().build::<2>());
    write(filter.state_transition_mut(), &m.f);
    write(filter.direct_process_noise_mut(), &m.q);
    write(sensor.observation_matrix_mut(), &m.h);
    write(sensor.measurement_noise_covariance_mut(), &m.r);
    let (x, p, plots) = (m.x, m.p, m.z.map(|z| cast::<T, 2, 1>(&z)));
    move || {
        write(filter.state_vector_mut(), &x);
        write(filter.estimate_covariance_mut(), &p);
        for z in black_box(&plots) {
            filter.predict();
            sensor.measurement_vector_mut().apply(|v| (v[0], v[1]) = (z[0], z[1]));
            filter.correct(&mut sensor);
        }
        state(|i| filter.state_vector()[i], |i, j| filter.estimate_covariance().get_at(i, j))
    }
}

/// F, its transpose and Q.
struct Motion<T>([na35::SMatrix<T, 4, 4>; 3]);

impl<T: Scalar> adskalman::TransitionModelLinearNoControl<T, na35::U4> for Motion<T> {
    fn F(&self) -> &na35::SMatrix<T, 4, 4> {
        &self.0[0]
    }
    fn FT(&self) -> &na35::SMatrix<T, 4, 4> {
        &self.0[1]
    }
    fn Q(&self) -> &na35::SMatrix<T, 4, 4> {
        &self.0[2]
    }
}

/// H, its transpose and R.
struct Sensor<T>(na35::SMatrix<T, 2, 4>, na35::SMatrix<T, 4, 2>, na35::SMatrix<T, 2, 2>);

impl<T: Scalar> adskalman::ObservationModel<T, na35::U4, na35::U2> for Sensor<T> {
    fn H(&self) -> &na35::SMatrix<T, 2, 4> {
        &self.0
    }
    fn HT(&self) -> &na35::SMatrix<T, 4, 2> {
        &self.1
    }
    fn R(&self) -> &na35::SMatrix<T, 2, 2> {
        &self.2
    }
}

pub fn adskalman<T: Scalar>(m: &Matrices, form: fn() -> CovarianceUpdateMethod) -> impl Fn() -> State {
    fn other<T: Scalar, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> na35::SMatrix<T, R, C> {
        na35::SMatrix::from_fn(|i, j| T::lit(m[(i, j)]))
    }
    let motion = Motion::<T>([other(&m.f), other(&m.f.transpose()), other(&m.q)]);
    let sensor = Sensor::<T>(other(&m.h), other(&m.h.transpose()), other(&m.r));
    let start = StateAndCovariance::new(other::<T, 4, 1>(&m.x), other(&m.p));
    let plots = m.z.map(|z| other::<T, 2, 1>(&z));
    move || {
        let filter = KalmanFilterNoControl::new(&motion, &sensor);
        let mut at = black_box(&start).clone();
        for z in black_box(&plots) {
            if let Ok(next) = filter.step_with_options(&at, z, form()) {
                at = next;
            }
        }
        state(|i| at.state()[i], |i, j| at.covariance()[(i, j)])
    }
}

/// F and Q.
struct Transition<T>(SMatrix<T, 4, 4>, SMatrix<T, 4, 4>);

impl<T: Scalar> tracktor::models::TransitionModel<T, 4> for Transition<T> {
    fn transition_matrix(&self, _: T) -> TransitionMatrix<T, 4> {
        TransitionMatrix::from_matrix(self.0)
    }
    fn process_noise(&self, _: T) -> StateCovariance<T, 4> {
        Covariance::from_matrix(self.1)
    }
    fn survival_probability(&self, _: &StateVector<T, 4>) -> T {
        T::ONE
    }
}

/// H and R.
struct Observation<T>(SMatrix<T, 2, 4>, SMatrix<T, 2, 2>);

impl<T: Scalar> tracktor::models::ObservationModel<T, 4, 2> for Observation<T> {
    fn observation_matrix(&self) -> ObservationMatrix<T, 2, 4> {
        ObservationMatrix::from_matrix(self.0)
    }
    fn measurement_noise(&self) -> MeasurementCovariance<T, 2> {
        Covariance::from_matrix(self.1)
    }
    fn detection_probability(&self, _: &StateVector<T, 4>) -> T {
        T::ONE
    }
}

pub fn tracktor<T: Scalar>(m: &Matrices) -> impl Fn() -> State {
    let filter = KalmanFilter::new(Transition::<T>(cast(&m.f), cast(&m.q)), Observation(cast(&m.h), cast(&m.r)));
    let start = KalmanState::new(StateVector::from_svector(cast(&m.x)), Covariance::from_matrix(cast(&m.p)));
    let plots: [_; SCANS] = m.z.map(|z| Measurement::from_svector(cast(&z)));
    move || {
        let mut at = black_box(&start).clone();
        for z in black_box(&plots) {
            if let Some(next) = filter.step(&at, T::lit(DT.into()), z) {
                at = next;
            }
        }
        state(|i| at.mean.as_svector()[i], |i, j| at.covariance.as_matrix()[(i, j)])
    }
}
