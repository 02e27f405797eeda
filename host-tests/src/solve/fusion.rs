//! Kind `fusion`: two estimates of one target made one, and which of two lists are one target's.
//!
//! | list | what | inputs |
//! |---|---|---|
//! | `cases` | covariance intersection: least determinant, least trace, `fixed` weights | `x1`, `P1`, `x2`, `P2` |
//! | `bar_shalom_campo` | fusion and test by a known cross-covariance, and as if independent (`*_indep`) | the same, `P12`, `alpha` |
//! | `cross_covariance_runs` | two Kalman filters of one target and their P12, scan by scan | `F`, `Q`, `H1`, `R1`, `H2`, `R2`, `x0`, `P0`, `P12_0`, `z1`, `z2` |
//! | `assignment` | the pairs of least Σ d² + `threshold` · (tracks of list 1 left alone) | `tracks1`, `tracks2`, `threshold` |
//!
//! Where P1 = P2 every weight is optimal, so `omega` and `x` are null.

use super::field::{Field, matrix, number, numbers, vector};
use super::kf::{initial, symmetric};
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::metrics::chi_square_quantile;
use crate::precision::{Precision, Scalar};
use boresight::association::Assignment;
use boresight::fusion::{CrossCovariance, Distance, Rule, Weight, distance};
use boresight::gaussian::Gaussian;
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::{Layout, MeasurementModel, MotionModel};
use serde_json::{Value, json};

pub(super) const KIND: Kind = Kind {
    name: "fusion",
    lists: &[
        ("cases", intersection as CaseSolver),
        ("bar_shalom_campo", known_correlation),
        ("cross_covariance_runs", recursion),
        ("assignment", assignment),
    ],
};

/// Rows and columns that an assignment may have.
const TRACKS: usize = 16;

fn intersection(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    by_size!(precision, intersect(case), [case.get("n")?.count()?], [2][4][6])
}

fn intersect<T: Scalar, const N: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (a, b) = (initial::<T, N>(case, "x1", "P1")?, initial::<T, N>(case, "x2", "P2")?);
    let by = |weight: Weight<T>| {
        let (omega, fused) = (weight.of(&a.cov, &b.cov), fused(case, Rule::Intersection(weight).fuse(&a, &b))?);
        let any = a.cov == b.cov;
        let log_det = fused.cov.inverse().root.into();
        Ok::<_, Failure>(json!({
            "omega": if any { Value::Null } else { omega.map_or(Value::Null, number) },
            "x": if any { Value::Null } else { vector(&fused.mean) },
            "P": matrix(&fused.cov.to_matrix()),
            "log_det": number(-2.0 * log_det.ln()),
            "trace": number(fused.cov.to_matrix().trace()),
        }))
    };
    let mut result = json!({ "det": by(Weight::Determinant)?, "trace": by(Weight::Trace)? });
    if let Some(list) = case.find("fixed")? {
        let entries = list.items()?;
        let fixed = entries.iter().map(|entry| {
            let fused = fused(case, Rule::Intersection(Weight::Fixed(entry.get("omega")?.number::<T>()?)).fuse(&a, &b))?;
            Ok(json!({ "x": vector(&fused.mean), "P": matrix(&fused.cov.to_matrix()) }))
        });
        result["fixed"] = fixed.collect::<Result<Vec<Value>, Failure>>()?.into();
    }
    Ok(result)
}

fn known_correlation(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    by_size!(precision, correlated(case), [case.get("n")?.count()?], [2][4][6])
}

fn correlated<T: Scalar, const N: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (a, b) = (initial::<T, N>(case, "x1", "P1")?, initial::<T, N>(case, "x2", "P2")?);
    let cross = CrossCovariance(case.get("P12")?.matrix::<T, N, N>()?);
    let alpha: f64 = case.get("alpha")?.number()?;
    let threshold = chi_square_quantile(N as f64, 1.0 - alpha).ok_or_else(|| case.failure("alpha is no probability"))?;
    let (known, naive) = (fused(case, cross.fuse(&a, &b))?, fused(case, CrossCovariance::zeros().fuse(&a, &b))?);
    let square = |d: Option<Distance<T>>| d.map_or(f64::NAN, |d| d.square.into());
    let (d2, d2_indep) = (square(cross.distance(&a, &b, Layout::UNKNOWN)), square(distance(&a, &b, Layout::UNKNOWN)));
    Ok(json!({
        "x": vector(&known.mean), "P": matrix(&known.cov.to_matrix()),
        "x_indep": vector(&naive.mean), "P_indep": matrix(&naive.cov.to_matrix()),
        "d2": number(d2), "d2_indep": number(d2_indep), "threshold": threshold,
        "same_target": d2 <= threshold, "same_target_indep": d2_indep <= threshold,
    }))
}

fn recursion(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("x0")?.items()?.len(), case.get("H1")?.items()?.len(), case.get("H2")?.items()?.len()];
    by_size!(precision, run(case), sizes, [4 2 2])
}

fn run<T: Scalar, const N: usize, const M1: usize, const M2: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let motion = LinearMotion { transition: case.get("F")?.matrix::<T, N, N>()?, process_noise: symmetric(case, "Q")? };
    let first = LinearMeasurement { matrix: case.get("H1")?.matrix::<T, M1, N>()?, noise: symmetric(case, "R1")? };
    let second = LinearMeasurement { matrix: case.get("H2")?.matrix::<T, M2, N>()?, noise: symmetric(case, "R2")? };
    let mut a = initial::<T, N>(case, "x0", "P0")?;
    let mut b = a;
    let mut cross = CrossCovariance(case.get("P12_0")?.matrix::<T, N, N>()?);
    let mut steps = Vec::new();
    for step in case.get("steps")?.items()? {
        motion.predict(&mut a, T::ONE);
        motion.predict(&mut b, T::ONE);
        cross.predict(&motion.transition, &motion.process_noise);
        if let Some(z) = step.find("z1")? {
            let innovation = first.innovation(&a);
            let _ = a.update(&innovation, &(z.vector()? - innovation.z_hat));
            cross.first_updated(&innovation.gain(), &first.matrix);
        }
        if let Some(z) = step.find("z2")? {
            let innovation = second.innovation(&b);
            let _ = b.update(&innovation, &(z.vector()? - innovation.z_hat));
            cross.second_updated(&innovation.gain(), &second.matrix);
        }
        let fused = fused(&step, cross.fuse(&a, &b))?;
        let d2 = cross.distance(&a, &b, Layout::UNKNOWN).map_or(Value::Null, |d| number(d.square));
        steps.push(json!({
            "x1": vector(&a.mean), "P1": matrix(&a.cov.to_matrix()), "x2": vector(&b.mean), "P2": matrix(&b.cov.to_matrix()),
            "P12": matrix(&cross.0), "x": vector(&fused.mean), "P": matrix(&fused.cov.to_matrix()), "d2": d2,
        }));
    }
    Ok(json!({ "steps": steps }))
}

fn assignment(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    by_size!(precision, assign(case), [case.get("n")?.count()?], [2][4][6])
}

fn assign<T: Scalar, const N: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let list =
        |key: &str| case.get(key)?.items()?.iter().map(|track| initial::<T, N>(track, "x", "P")).collect::<Result<Vec<_>, Failure>>();
    let (rows, columns) = (list("tracks1")?, list("tracks2")?);
    if rows.len().max(columns.len()) > TRACKS {
        return Err(case.failure(format!("more than {TRACKS} tracks in a list")));
    }
    let threshold: T = case.get("threshold")?.number()?;
    let between = |a: &Gaussian<T, N>, b: &Gaussian<T, N>| distance(a, b, Layout::UNKNOWN).map_or(T::ONE / T::ZERO, |d| d.square);
    let squares: Vec<Vec<T>> = rows.iter().map(|a| columns.iter().map(|b| between(a, b)).collect()).collect();
    let mut memory = Assignment::<T, TRACKS, TRACKS>::new();
    let allowed = |square: T| if square <= threshold { -square } else { -T::ONE / T::ZERO };
    if !memory.solve(rows.len(), columns.len(), |_| -threshold, |row, column| allowed(squares[row][column])) {
        return Err(case.failure("no assignment"));
    }
    let pairs: Vec<Option<usize>> = (0..rows.len()).map(|row| memory.column(row)).collect();
    let cost = |(row, column): (usize, &Option<usize>)| column.map_or(threshold, |column| squares[row][column]);
    let sum: f64 = pairs.iter().enumerate().map(|pair| cost(pair).into()).sum();
    let d2: Vec<Value> = squares.iter().map(|row| numbers(row)).collect();
    let assignment: Vec<i64> = pairs.iter().map(|column| column.map_or(-1, |column| column as i64)).collect();
    Ok(json!({ "d2": d2, "assignment": assignment, "cost": sum }))
}

/// What the library fused, or a failure where it refused.
fn fused<T: Scalar, const N: usize>(case: &Field<'_>, fused: Option<Gaussian<T, N>>) -> Result<Gaussian<T, N>, Failure> {
    let finite = |g: &Gaussian<T, N>| g.mean.iter().all(|v| v.is_finite());
    fused.filter(finite).ok_or_else(|| case.failure("no covariance"))
}
