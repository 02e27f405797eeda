//! Kind `imm`: mix, predict, update by the one measurement, mode probabilities, combine (`boresight::mode`).
//!
//! Inputs of a case: `F`, `Q` per model, `H`, `R`, `pi`, `mu0`, `x0`, `P0_j`; of a step: `z` (null: no measurement).

use super::field::{Field, matrix, numbers, vector};
use super::kf::{innovation_covariance, symmetric};
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::evidence::{Innovations, innovations, update_by_one};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, ModeBank};
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::symmetric::Symmetric;
use serde_json::{Map, Value, json};

pub(super) const KIND: Kind = Kind { name: "imm", lists: &[("cases", solve as CaseSolver)] };

fn solve(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("m")?.count()?, case.get("n_models")?.count()?];
    by_size!(
        precision, filter(case), sizes,
        [2 1 2] [2 1 3] [2 2 2] [2 2 3] [4 1 2] [4 1 3] [4 2 1] [4 2 2] [4 2 3] [4 2 4]
        [5 2 2] [5 2 3] [6 2 1] [6 2 2] [6 2 3] [6 2 4] [6 3 2] [6 3 3] [9 2 2] [9 2 3] [9 3 2] [9 3 3]
    )
}

fn filter<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (motion, model, jump) = models::<T, N, M, R>(case)?;
    let mean = case.get("x0")?.vector()?;
    let mut bank = ModeBank::new(case.get("mu0")?.vector::<T, R>()?.data.0[0], Gaussian::new(mean, Symmetric::zeros()));
    let covariances = case.get("P0_j")?.items()?;
    for (g, cov) in bank.modes.iter_mut().zip(&covariances) {
        g.cov = Symmetric::from_matrix(&cov.matrix()?);
    }
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let mut result = Map::new();
        bank.interact(&jump);
        result.insert("cbar".into(), numbers(&bank.prob));
        densities(&mut result, "x_mixed", "P_mixed", &bank.modes);
        bank.predict(&motion, T::ONE);
        densities(&mut result, "x_pred_j", "P_pred_j", &bank.modes);
        combined(&mut result, "x_pred", "P_pred", &bank);
        let innovations = innovations(&bank, &model);
        seen(&mut result, &innovations);
        if let Some(z) = step.find("z")? {
            let z = z.vector::<T, M>()?;
            let ln_likelihood = innovations.each_ref().map(|i| i.density.ln_at(&(z - i.z_hat)));
            result.insert("loglik_j".into(), numbers(&ln_likelihood));
            if update_by_one(&mut bank, &model, &z) > 0 {
                return Err(step.failure("a covariance would not stay definite"));
            }
        }
        result.insert("mu".into(), numbers(&bank.prob));
        densities(&mut result, "x_j", "P_j", &bank.modes);
        combined(&mut result, "x", "P", &bank);
        results.push(Value::Object(result));
    }
    Ok(json!({ "steps": results }))
}

/// Motion of every model, the sensor and the jump matrix of a case.
pub(super) type Models<T, const N: usize, const M: usize, const R: usize> =
    ([LinearMotion<T, N>; R], LinearMeasurement<T, N, M>, JumpMatrix<T, R>);

/// Reads `F`, `Q` (lists), `H`, `R` and `pi`.
pub(super) fn models<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Models<T, N, M, R>, Failure> {
    let list = |key: &str| {
        let field = case.get(key)?;
        let items = field.items()?;
        if items.len() == R { Ok(items) } else { Err(field.failure(format!("{} models where {R} belong", items.len()))) }
    };
    let mut motion = Vec::with_capacity(R);
    for (f, q) in list("F")?.iter().zip(&list("Q")?) {
        motion.push(LinearMotion { transition: f.matrix()?, process_noise: Symmetric::from_matrix(&q.matrix()?) });
    }
    let motion = <[_; R]>::try_from(motion).map_err(|_| case.failure("too few models"))?;
    let model = LinearMeasurement { matrix: case.get("H")?.matrix()?, noise: symmetric(case, "R")? };
    let pi = case.get("pi")?.matrix::<T, R, R>()?;
    Ok((motion, model, std::array::from_fn(|i| std::array::from_fn(|j| pi[(i, j)]))))
}

/// Means and covariances of all modes under two names.
pub(super) fn densities<T: Scalar, const N: usize>(result: &mut Map<String, Value>, mean: &str, cov: &str, modes: &[Gaussian<T, N>]) {
    result.insert(mean.into(), modes.iter().map(|g| vector(&g.mean)).collect());
    result.insert(cov.into(), modes.iter().map(|g| matrix(&g.cov.to_matrix())).collect());
}

/// The combined estimate under two names.
pub(super) fn combined<T: Scalar, const N: usize, const R: usize>(
    result: &mut Map<String, Value>,
    mean: &str,
    cov: &str,
    bank: &ModeBank<T, N, R>,
) {
    let g = bank.combined();
    result.insert(mean.into(), vector(&g.mean));
    result.insert(cov.into(), matrix(&g.cov.to_matrix()));
}

/// The predicted measurements of all modes.
pub(super) fn seen<T: Scalar, const N: usize, const M: usize, const R: usize>(
    result: &mut Map<String, Value>,
    innovations: &Innovations<T, N, M, R>,
) {
    result.insert("z_pred_j".into(), innovations.iter().map(|i| vector(&i.z_hat)).collect());
    result.insert("S_j".into(), innovations.iter().map(innovation_covariance).collect());
}
