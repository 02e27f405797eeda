//! Kind `kf`: the linear Kalman filter, predict then update at every step.
//!
//! ```text
//! x = F x, P = F P F' + Q;  S = H P H' + R, K = P H' S⁻¹;  x += K (z − H x), P −= K S K'
//! ```
//!
//! Inputs of a step: `F`, `Q`, `H`, `R`, `z` (null: no measurement). All result fields are filled.

use super::field::{Field, matrix, number, vector};
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::gaussian::{Gaussian, Innovation};
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::{MeasurementModel, MotionModel};
use boresight::symmetric::Symmetric;
use nalgebra::SVector;
use serde_json::{Map, Value, json};

pub(super) const KIND: Kind = Kind { name: "kf", lists: &[("cases", solve as CaseSolver)] };

fn solve(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let (n, m) = (case.get("n")?.count()?, case.get("m")?.count()?);
    by_size!(
        precision, filter(case), [n, m],
        [1 1] [2 1] [2 2] [3 1] [3 2] [3 3] [4 1] [4 2] [4 3] [4 4] [5 1] [5 2] [5 3]
        [6 1] [6 2] [6 3] [6 4] [9 1] [9 2] [9 3] [9 4]
    )
}

fn filter<T: Scalar, const N: usize, const M: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let mut g = initial::<T, N>(case, "x0", "P0")?;
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let motion = LinearMotion { transition: step.get("F")?.matrix::<T, N, N>()?, process_noise: symmetric(&step, "Q")? };
        let model = LinearMeasurement { matrix: step.get("H")?.matrix::<T, M, N>()?, noise: symmetric(&step, "R")? };
        motion.predict(&mut g, T::ONE);
        let mut result = predicted(&g);
        let innovation = model.innovation(&g);
        let z = step.find("z")?.map(|z| z.vector::<T, M>()).transpose()?;
        measured(&mut result, &innovation, z.map(|z| model.residual(&z, &innovation.z_hat)));
        if let Some(z) = z {
            // Where it would break the covariance the library keeps the prediction, and so does the result.
            let _ = g.update(&innovation, &model.residual(&z, &innovation.z_hat));
        }
        updated(&mut result, &g);
        results.push(Value::Object(result));
    }
    Ok(json!({ "steps": results }))
}

/// The density given by two fields of a case.
pub(super) fn initial<T: Scalar, const N: usize>(case: &Field<'_>, mean: &str, cov: &str) -> Result<Gaussian<T, N>, Failure> {
    Ok(Gaussian::new(case.get(mean)?.vector()?, symmetric(case, cov)?))
}

/// A symmetric matrix given by a field.
pub(super) fn symmetric<T: Scalar, const N: usize>(of: &Field<'_>, key: &str) -> Result<Symmetric<T, N>, Failure> {
    Ok(Symmetric::from_matrix(&of.get(key)?.matrix::<T, N, N>()?))
}

/// The fields of a prediction.
pub(super) fn predicted<T: Scalar, const N: usize>(g: &Gaussian<T, N>) -> Map<String, Value> {
    let mut result = Map::new();
    result.insert("x_pred".into(), vector(&g.mean));
    result.insert("P_pred".into(), matrix(&g.cov.to_matrix()));
    result
}

/// The fields of a predicted measurement and, where there is one, of its residual.
pub(super) fn measured<T: Scalar, const N: usize, const M: usize>(
    result: &mut Map<String, Value>,
    innovation: &Innovation<T, N, M>,
    nu: Option<SVector<T, M>>,
) {
    let density = &innovation.density;
    result.insert("z_pred".into(), vector(&innovation.z_hat));
    result.insert("S".into(), innovation_covariance(innovation));
    result.insert("K".into(), matrix(&innovation.gain()));
    result.insert("v".into(), nu.map_or(Value::Null, |nu| vector(&nu)));
    result.insert("nis".into(), nu.map_or(Value::Null, |nu| number(density.nis(&nu))));
    result.insert("loglik".into(), nu.map_or(Value::Null, |nu| number(density.ln_at(&nu))));
}

/// S, from S⁻¹.
pub(super) fn innovation_covariance<T: Scalar, const N: usize, const M: usize>(innovation: &Innovation<T, N, M>) -> Value {
    if innovation.density.is_proper() { matrix(&innovation.density.s_inv.inverse().matrix.to_matrix()) } else { Value::Null }
}

/// The fields of the updated density.
pub(super) fn updated<T: Scalar, const N: usize>(result: &mut Map<String, Value>, g: &Gaussian<T, N>) {
    result.insert("x".into(), vector(&g.mean));
    result.insert("P".into(), matrix(&g.cov.to_matrix()));
}
