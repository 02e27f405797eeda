//! Kinds `jpda`, `jpda_large`, `jpda_nonparametric` (one weight matrix) and `immjpdaf` (forty scans of up to five targets).
//!
//! All run `boresight::association::Jpda`, with room enough to be exact. Inputs: `w` (rows of 1 − P_D P_G and P_D L / λ),
//! or `N`, `Pd`, `V` and `validated` (else what any row gates) for diffuse clutter; for `immjpdaf` those of `immpdaf`, with `x0` per target.
//! Weights are handed over as logarithms, so that 1e±200 keeps its ratios.

use super::field::{Field, number, numbers};
use super::imm::{combined, densities, models};
use super::pda::{gate, plots};
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain, Jpda};
use boresight::evidence::{Evidence, innovations};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use serde_json::{Map, Value, json};

pub(super) const JPDA: Kind = Kind { name: "jpda", lists: &[("cases", jpda as CaseSolver)] };
pub(super) const LARGE: Kind = Kind { name: "jpda_large", lists: &[("cases", jpda as CaseSolver)] };
pub(super) const NONPARAMETRIC: Kind = Kind { name: "jpda_nonparametric", lists: &[("cases", jpda as CaseSolver)] };
pub(super) const IMMJPDAF: Kind = Kind { name: "immjpdaf", lists: &[("cases", immjpdaf as CaseSolver)] };

const TRACKS: usize = 32;
const DETS: usize = 64;
/// Sets of served tracks: 2^16 in each of thirty layers.
const NODES: usize = 1 << 21;
/// Stack for a thread that builds the memory of the association.
const STACK: usize = 256 << 20;

type Matrix<T> = AssociationMatrix<T, TRACKS, DETS>;

fn jpda(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    match precision {
        Precision::F32 => marginals::<f32>(case),
        Precision::F64 => marginals::<f64>(case),
    }
}

fn marginals<T: Scalar>(case: &Field<'_>) -> Result<Value, Failure> {
    let (rows, clutter) = match case.find("w")? {
        Some(w) => (weights(&w)?, ClutterPrior::Poisson),
        None => (diffuse_weights(case)?, ClutterPrior::Diffuse),
    };
    let columns = rows.first().map_or(0, |row| row.len().saturating_sub(1));
    if rows.len() > TRACKS || columns > DETS {
        return Err(case.failure(format!("{} tracks and {columns} detections where {TRACKS} and {DETS} fit", rows.len())));
    }
    let mut matrix = Matrix::<T>::new();
    matrix.reset(columns, clutter, Domain::Logarithmic);
    for (t, row) in rows.iter().enumerate() {
        if let Some((miss, hit)) = matrix.row_mut(t) {
            *miss = T::lit(row[0].ln());
            hit.iter_mut().zip(&row[1..]).for_each(|(h, w)| *h = T::lit(w.ln()));
        }
    }
    let completeness = in_room_enough(&mut matrix).map_err(|failure| failure.within(case.path()))?;
    if completeness.infeasible > 0 {
        return Ok(json!({ "infeasible": true, "beta": null }));
    }
    // In single precision the logarithms may be bounded to a few roundings of theirs.
    if completeness.approximated > 0 || completeness.error_bound > 1e-2 {
        return Err(case.failure(format!("too large to be exact: {completeness:?}")));
    }
    let beta: Vec<Vec<T>> = (0..rows.len()).filter_map(|t| matrix.row(t)).map(|(m, h)| [&[m], h].concat()).collect();
    let ln_beta = |row: &Vec<T>| row.iter().map(|b| number((*b).into().ln())).collect::<Value>();
    let mut result = json!({ "beta": beta.iter().map(|row| numbers(row)).collect::<Value>() });
    if case.find("w")?.is_some() {
        result["infeasible"] = json!(false);
        result["log_beta"] = beta.iter().map(ln_beta).collect();
    }
    Ok(result)
}

/// The rows of `w`, of equal length.
fn weights(w: &Field<'_>) -> Result<Vec<Vec<f64>>, Failure> {
    let rows = w.rows::<f64>()?;
    match rows.iter().position(|row| row.iter().any(|w| *w < 0.0) || row.is_empty()) {
        Some(t) => Err(w.items()?[t].failure("a weight is negative, or there is none")),
        None => Ok(rows),
    }
}

/// Rows of 1 − P_D and P_D N V / m for the validated detections.
fn diffuse_weights(case: &Field<'_>) -> Result<Vec<Vec<f64>>, Failure> {
    let likelihood = case.get("N")?;
    let validated: Vec<usize> = match case.find("validated")? {
        Some(numbers) => numbers.items()?.iter().map(Field::count).collect::<Result<_, _>>()?,
        None => {
            let rows = likelihood.rows::<f64>()?;
            let columns = rows.first().map_or(0, Vec::len);
            (1..=columns).filter(|j| rows.iter().any(|row| row[j - 1] > 0.0)).collect()
        }
    };
    let volume: f64 = case.get("V")?.number()?;
    let p_detect: Vec<f64> = case.get("Pd")?.numbers()?;
    let scale = volume / validated.len().max(1) as f64;
    let mut rows = Vec::new();
    for (row, p_detect) in likelihood.items()?.iter().zip(p_detect) {
        let n = row.numbers::<f64>()?;
        let mut weights = vec![1.0 - p_detect];
        for j in &validated {
            let n = j.checked_sub(1).and_then(|j| n.get(j)).ok_or_else(|| row.failure(format!("no detection {j}")))?;
            weights.push(p_detect * n * scale);
        }
        rows.push(weights);
    }
    Ok(rows)
}

/// Associates with memory of its own, on a stack that holds it.
fn in_room_enough<T: Scalar>(matrix: &mut Matrix<T>) -> Result<Completeness, Failure> {
    let work = || Jpda::<NODES>::new().associate(matrix, &mut Box::new(<Jpda<NODES> as Associator<T, TRACKS, DETS>>::MEMORY));
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work);
        let failed = || Failure::input("no room for the association");
        thread.map_err(|_| failed())?.join().map_err(|_| failed())
    })
}

fn immjpdaf(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("nz")?.count()?, case.get("n_models")?.count()?];
    by_size!(precision, many_scans(case), sizes, [4 2 1] [4 2 2] [4 2 3] [4 2 4] [6 2 1] [6 2 2] [6 2 3] [6 3 2] [6 3 3])
}

/// The associator of `immjpdaf`: at most eight targets.
const FEW: usize = 8;
type Few = Jpda<16384>;

fn many_scans<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (motion, model, jump) = models::<T, N, M, R>(case)?;
    let (p_detect, density) = (case.get("Pd")?, case.find("lam")?);
    let (clutter, prior) = match &density {
        Some(density) => (Clutter::Poisson(density.number()?), ClutterPrior::Poisson),
        // A density of one, to be scaled when m and V of all targets are known.
        None => (Clutter::Poisson(T::ONE), ClutterPrior::Diffuse),
    };
    // Under diffuse clutter these cases take 1 − P_D for a missed track.
    let mut gate = gate::<T, M>(case)?;
    if density.is_none() {
        gate = gate.with_probability(T::ONE).map_err(|e| case.failure(e))?;
    }
    let sensor = UniformSensor::new(model, p_detect.number()?, clutter, gate).map_err(|e| p_detect.failure(e))?;
    let mu0 = case.get("mu0")?.vector::<T, R>()?.data.0[0];
    let cov = Symmetric::from_matrix(&case.get("P0")?.matrix()?);
    let starts = case.get("x0")?.items()?;
    if starts.len() > FEW {
        return Err(case.failure(format!("{} targets where {FEW} fit", starts.len())));
    }
    let mut banks: Vec<ModeBank<T, N, R>> =
        starts.iter().map(|x| Ok(ModeBank::new(mu0, Gaussian::new(x.vector()?, cov)))).collect::<Result<_, Failure>>()?;
    let mut memory = Box::new(<Few as Associator<T, FEW, DETS>>::MEMORY);
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let plots: Vec<Detection<T, M>> = plots(&step.get("z")?)?;
        if plots.len() > DETS {
            return Err(step.failure(format!("{} detections where {DETS} fit", plots.len())));
        }
        let all: Vec<u16> = (0..).take(plots.len()).collect();
        let mut matrix = AssociationMatrix::<T, FEW, DETS>::new();
        matrix.reset(plots.len(), prior, Domain::Linear);
        let mut looks = Vec::new();
        let mut volume = T::ZERO;
        for (t, bank) in banks.iter_mut().enumerate() {
            bank.interact(&jump);
            bank.predict(&motion, T::ONE);
            let innovations = innovations(bank, &sensor.model);
            let mut evidence = Evidence::<T, DETS>::new();
            volume += evidence.collect(bank, &innovations, &sensor, &plots, Candidates::new(&plots, &all));
            let (weight_of_none, _) = evidence.weights();
            let Some((miss, hit)) = matrix.row_mut(t) else { continue };
            *miss = weight_of_none;
            evidence.scored().for_each(|(j, weight)| hit[usize::from(j)] = *weight);
            looks.push((bank.prob, innovations, evidence));
        }
        let validated: Vec<usize> = (0..plots.len()).filter(|j| looks.iter().any(|l| l.2.gated().contains(&(*j as u16)))).collect();
        if prior == ClutterPrior::Diffuse && !validated.is_empty() {
            let scale = volume / T::lit(validated.len() as f64);
            matrix.hit.iter_mut().flatten().for_each(|h| *h *= scale);
        }
        let completeness = Few::new().associate(&mut matrix, &mut memory);
        if !completeness.is_exact() {
            return Err(step.failure(format!("the association is not exact: {completeness:?}")));
        }
        let mut targets = Vec::new();
        for (t, (bank, (cbar, innovations, mut evidence))) in banks.iter_mut().zip(looks).enumerate() {
            let Some((beta_0, row)) = matrix.row(t) else { continue };
            let mut beta = vec![beta_0];
            beta.extend(validated.iter().map(|j| row[*j]));
            evidence.scored().for_each(|(j, weight)| *weight = row[usize::from(j)]);
            if evidence.absorb(beta_0, bank, &innovations, &sensor.model, &plots) > 0 {
                return Err(step.failure("a covariance would not stay definite"));
            }
            let mut target = Map::new();
            target.insert("gated".into(), json!(evidence.gated()));
            target.insert("cbar".into(), numbers(&cbar));
            target.insert("beta".into(), numbers(&beta));
            target.insert("mu".into(), numbers(&bank.prob));
            densities(&mut target, "x_j", "P_j", &bank.modes);
            combined(&mut target, "x", "P", bank);
            targets.push(Value::Object(target));
        }
        results.push(json!({ "validated": validated, "V": number(volume), "targets": targets }));
    }
    Ok(json!({ "steps": results }))
}
