//! Kinds `ekf` and `ukf`: a linear motion or a coordinated turn of unknown rate, seen by a radar.
//!
//! Inputs of a case: `dynamics` (`linear` with `F`, or `ct_unknown_rate`), `T`, `Q`, `meas` (component names), `pos`
//! (where the positions stand), `sensor` (its position), `R`, `x0`, `P0`, and for `ukf` `alpha`, `beta`, `kappa` and
//! `redraw`; of a step: `z`. The equations are those of `boresight::model::{turn, radar, unscented}`.

use super::field::Field;
use super::kf::{initial, measured, predicted, symmetric, updated};
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::gaussian::{Gaussian, Innovation};
use boresight::model::linear::LinearMotion;
use boresight::model::motion::ProcessNoise;
use boresight::model::radar::{Component, Mount, Radar};
use boresight::model::turn::UnknownTurn;
use boresight::model::unscented::{Scaling, SigmaPoints};
use boresight::model::{MeasurementModel, MotionModel};
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use serde_json::{Value, json};

pub(super) const EKF: Kind = Kind { name: "ekf", lists: &[("cases", ekf as CaseSolver)] };
pub(super) const UKF: Kind = Kind { name: "ukf", lists: &[("cases", ukf as CaseSolver)] };

/// Which filter runs a case.
trait Filter<T: Scalar, const N: usize> {
    /// Reads what the case says of the filter.
    fn read(case: &Field<'_>) -> Result<Self, Failure>
    where
        Self: Sized;

    /// Predicts `g` and its measurement.
    fn predict<D: MotionModel<T, N>, M: MeasurementModel<T, N, NZ>, const NZ: usize>(
        &self,
        g: &mut Gaussian<T, N>,
        motion: (&D, T),
        model: &M,
    ) -> Innovation<T, N, NZ>;
}

/// Linearised by Jacobians.
struct Extended;

impl<T: Scalar, const N: usize> Filter<T, N> for Extended {
    fn read(_case: &Field<'_>) -> Result<Self, Failure> {
        Ok(Self)
    }
    fn predict<D: MotionModel<T, N>, M: MeasurementModel<T, N, NZ>, const NZ: usize>(
        &self,
        g: &mut Gaussian<T, N>,
        (motion, dt): (&D, T),
        model: &M,
    ) -> Innovation<T, N, NZ> {
        motion.predict(g, dt);
        model.innovation(g)
    }
}

/// By sigma points, drawn anew after the prediction or used again.
struct Sigma<T> {
    scaling: Scaling<T>,
    redraw: bool,
}

impl<T: Scalar, const N: usize> Filter<T, N> for Sigma<T> {
    fn read(case: &Field<'_>) -> Result<Self, Failure> {
        let number = |key: &str| case.get(key)?.number::<T>();
        let scaling = Scaling::new::<N>(number("alpha")?, number("beta")?, number("kappa")?).map_err(|e| case.failure(e))?;
        Ok(Self { scaling, redraw: case.get("redraw")?.flag()? })
    }
    fn predict<D: MotionModel<T, N>, M: MeasurementModel<T, N, NZ>, const NZ: usize>(
        &self,
        g: &mut Gaussian<T, N>,
        (motion, dt): (&D, T),
        model: &M,
    ) -> Innovation<T, N, NZ> {
        // As `Unscented` does: without a factor of the covariance the linearised model serves.
        let Some(points) = SigmaPoints::draw(g, self.scaling) else {
            motion.predict(g, dt);
            return model.innovation(g);
        };
        let (moved, predicted) = points.propagate(motion, dt);
        *g = predicted;
        let points = if self.redraw { SigmaPoints::draw(g, self.scaling) } else { Some(moved) };
        points.map_or_else(|| model.innovation(g), |points| points.observe(model, &g.mean))
    }
}

/// A coordinated turn of unknown rate with the process noise that a case gives as a matrix.
struct GivenNoise<T, const N: usize> {
    turn: UnknownTurn<T, 2>,
    noise: Symmetric<T, N>,
}

impl<T: Scalar, const N: usize> MotionModel<T, N> for GivenNoise<T, N> {
    type Step = T;

    fn transition(&self, x: &SVector<T, N>, dt: T) -> SVector<T, N> {
        self.turn.transition(x, dt)
    }
    fn jacobian(&self, x: &SVector<T, N>, dt: T) -> SMatrix<T, N, N> {
        self.turn.jacobian(x, dt)
    }
    fn process_noise(&self, _x: &SVector<T, N>, _dt: T) -> Symmetric<T, N> {
        self.noise
    }
    fn step(&self, dt: T) -> T {
        dt
    }
    fn advance(&self, g: &mut Gaussian<T, N>, dt: &T) {
        self.turn.advance(g, dt);
        g.cov = g.cov.plus(&self.noise);
    }
}

fn ekf(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    match precision {
        Precision::F32 => by_dimension::<f32, Extended>(case),
        Precision::F64 => by_dimension::<f64, Extended>(case),
    }
}

fn ukf(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    match precision {
        Precision::F32 => by_dimension::<f32, Sigma<f32>>(case),
        Precision::F64 => by_dimension::<f64, Sigma<f64>>(case),
    }
}

/// Chooses the sizes: states, axes and states per axis.
fn by_dimension<T: Scalar, F>(case: &Field<'_>) -> Result<Value, Failure>
where
    F: Filter<T, 4> + Filter<T, 5> + Filter<T, 6> + Filter<T, 9>,
{
    let n = case.get("n")?.count()?;
    let pos = case.get("pos")?;
    let places = pos.items()?.iter().map(Field::count).collect::<Result<Vec<_>, _>>()?;
    match (n, places.as_slice()) {
        (4, [0, 2]) => linear::<T, F, 4, 2, 2>(case),
        (5, [0, 2]) if case.get("dynamics")?.text()? == "ct_unknown_rate" => turning::<T, F>(case),
        (5, [0, 2]) => linear::<T, F, 5, 2, 2>(case),
        (6, [0, 2, 4]) => linear::<T, F, 6, 3, 2>(case),
        (6, [0, 3]) => linear::<T, F, 6, 2, 3>(case),
        (9, [0, 3, 6]) => linear::<T, F, 9, 3, 3>(case),
        _ => Err(pos.failure(format!("positions {places:?} in a state of {n} are not among the layouts that were built"))),
    }
}

fn linear<T: Scalar, F: Filter<T, N>, const N: usize, const AXES: usize, const STRIDE: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let dynamics = case.get("dynamics")?;
    if dynamics.text()? != "linear" {
        return Err(dynamics.failure(format!("not known for a state of {N}")));
    }
    let motion = LinearMotion { transition: case.get("F")?.matrix()?, process_noise: symmetric(case, "Q")? };
    by_components::<T, F, _, N, AXES, STRIDE>(case, &motion)
}

fn turning<T: Scalar, F: Filter<T, 5>>(case: &Field<'_>) -> Result<Value, Failure> {
    let still = ProcessNoise::Discrete(T::ZERO);
    let turn = UnknownTurn::new(still, still).map_err(|e| case.failure(e))?;
    by_components::<T, F, _, 5, 2, 2>(case, &GivenNoise { turn, noise: symmetric(case, "Q")? })
}

fn by_components<T: Scalar, F: Filter<T, N>, D: MotionModel<T, N>, const N: usize, const AXES: usize, const STRIDE: usize>(
    case: &Field<'_>,
    motion: &D,
) -> Result<Value, Failure> {
    let meas = case.get("meas")?;
    let components = meas.items()?.iter().map(component).collect::<Result<Vec<_>, _>>()?;
    match components.as_slice() {
        &[a] => run::<T, F, D, N, 1, AXES, STRIDE>(case, motion, [a]),
        &[a, b] => run::<T, F, D, N, 2, AXES, STRIDE>(case, motion, [a, b]),
        &[a, b, c] => run::<T, F, D, N, 3, AXES, STRIDE>(case, motion, [a, b, c]),
        &[a, b, c, d] => run::<T, F, D, N, 4, AXES, STRIDE>(case, motion, [a, b, c, d]),
        other => Err(meas.failure(format!("{} components where 1 to 4 belong", other.len()))),
    }
}

fn component(name: &Field<'_>) -> Result<Component, Failure> {
    match name.text()? {
        "range" => Ok(Component::Range),
        "bearing" | "azimuth" => Ok(Component::Azimuth),
        "elevation" => Ok(Component::Elevation),
        "range_rate" => Ok(Component::RangeRate),
        other => Err(name.failure(format!("{other:?} is none of range, bearing, azimuth, elevation, range_rate"))),
    }
}

fn run<T: Scalar, F: Filter<T, N>, D: MotionModel<T, N>, const N: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
    case: &Field<'_>,
    motion: &D,
    components: [Component; NZ],
) -> Result<Value, Failure> {
    let filter = F::read(case)?;
    let mut place = [T::ZERO; 3];
    let sensor = case.get("sensor")?;
    for (to, from) in place.iter_mut().zip(sensor.vector::<T, AXES>()?.iter()) {
        *to = *from;
    }
    let noise = case.get("R")?;
    let radar = Radar::<T, NZ, AXES, STRIDE>::new(components, symmetric(case, "R")?).map_err(|e| noise.failure(e))?.on(Mount::at(place));
    let dt = case.get("T")?.number()?;
    let mut g = initial::<T, N>(case, "x0", "P0")?;
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let innovation = filter.predict(&mut g, (motion, dt), &radar);
        let mut result = predicted(&g);
        let z = step.find("z")?.map(|z| z.vector::<T, NZ>()).transpose()?;
        let nu = z.map(|z| MeasurementModel::<T, N, NZ>::residual(&radar, &z, &innovation.z_hat));
        measured(&mut result, &innovation, nu);
        if let Some(nu) = nu {
            // Where it would break the covariance the library keeps the prediction, and so does the result.
            let _ = g.update(&innovation, &nu);
        }
        updated(&mut result, &g);
        results.push(Value::Object(result));
    }
    Ok(json!({ "steps": results }))
}
