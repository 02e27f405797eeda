//! Kinds `pda` (one scan, one model) and `immpdaf` (forty scans, two or three models), Poisson and diffuse clutter.
//!
//! Both run the evidence of one track through `Pda`; the equations are those of `boresight::evidence`. Inputs: `H`,
//! `R`, `Pd`, `Pg`, `gamma`, `lam` (null in `immpdaf`: diffuse), for `pda` `x_pred`, `P_pred`, `z_all` (both clutter
//! models are solved), for `immpdaf` the models as in `imm`, `mu0`, `x0`, `P0` and `z` (every plot of the scan).

use super::field::{Field, matrix, number, numbers, vector};
use super::imm::{combined, densities, models, seen};
use super::kf::{initial, innovation_covariance, symmetric};
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::association::{Gate, Pda, SingleAssociator};
use boresight::evidence::{Evidence, innovations};
use boresight::mode::ModeBank;
use boresight::model::linear::LinearMeasurement;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use nalgebra::SVector;
use serde_json::{Map, Value, json};

pub(super) const PDA: Kind = Kind { name: "pda", lists: &[("cases", pda as CaseSolver)] };
pub(super) const IMMPDAF: Kind = Kind { name: "immpdaf", lists: &[("cases", immpdaf as CaseSolver)] };

/// The largest scan a case may have.
const DETS: usize = 256;

fn pda(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("nz")?.count()?];
    by_size!(
        precision, one_scan(case), sizes,
        [1 1] [2 1] [2 2] [4 1] [4 2] [4 3] [5 1] [5 2] [5 3] [6 1] [6 2] [6 3] [9 1] [9 2] [9 3]
    )
}

fn one_scan<T: Scalar, const N: usize, const M: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let g = initial::<T, N>(case, "x_pred", "P_pred")?;
    let bank = ModeBank::new([T::ONE], g);
    let model = LinearMeasurement::<T, N, M> { matrix: case.get("H")?.matrix()?, noise: symmetric(case, "R")? };
    let plots = plots::<T, M>(&case.get("z_all")?)?;
    let mut results = Map::new();
    let innovation = innovations(&bank, &model)[0];
    results.insert("z_pred".into(), vector(&innovation.z_hat));
    results.insert("S".into(), innovation_covariance(&innovation));
    results.insert("K".into(), matrix(&innovation.gain()));
    let nis = |d: &Detection<T, M>| number(innovation.density.nis(&(d.z - innovation.z_hat)));
    results.insert("d2_all".into(), plots.iter().map(nis).collect());
    results.insert("V".into(), number(gate::<T, M>(case)?.volume(innovation.density.root_det())));
    let poisson = Clutter::Poisson(case.get("lam")?.number()?);
    for (name, clutter) in [("parametric", poisson), ("nonparametric", Clutter::Diffuse)] {
        let mut bank = bank;
        let track = update(case, &mut bank, model, clutter, &plots)?;
        results.insert("validated".into(), json!(track.validated));
        let mut nu = SVector::<T, M>::zeros();
        for (index, beta) in track.validated.iter().zip(&track.beta[1..]) {
            nu += (plots[usize::from(*index)].z - innovation.z_hat) * *beta;
        }
        let mut result = Map::new();
        result.insert("beta".into(), numbers(&track.beta));
        result.insert("nu".into(), vector(&nu));
        combined(&mut result, "x", "P", &bank);
        results.insert(name.into(), Value::Object(result));
    }
    Ok(Value::Object(results))
}

fn immpdaf(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("nz")?.count()?, case.get("n_models")?.count()?];
    by_size!(precision, many_scans(case), sizes, [4 2 1] [4 2 2] [4 2 3] [4 2 4] [6 2 1] [6 2 2] [6 2 3] [6 2 4] [6 3 2] [6 3 3] [9 3 2] [9 3 3])
}

fn many_scans<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let (motion, model, jump) = models::<T, N, M, R>(case)?;
    let clutter = match case.find("lam")? {
        Some(density) => Clutter::Poisson(density.number()?),
        None => Clutter::Diffuse,
    };
    let mut bank = ModeBank::new(case.get("mu0")?.vector::<T, R>()?.data.0[0], initial::<T, N>(case, "x0", "P0")?);
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let plots = plots::<T, M>(&step.get("z")?)?;
        let mut result = Map::new();
        bank.interact(&jump);
        bank.predict(&motion, T::ONE);
        result.insert("cbar".into(), numbers(&bank.prob));
        seen(&mut result, &innovations(&bank, &model));
        let track = update(case, &mut bank, model, clutter, &plots)?;
        result.insert("validated".into(), json!(track.validated));
        result.insert("mu".into(), numbers(&bank.prob));
        densities(&mut result, "x_j", "P_j", &bank.modes);
        combined(&mut result, "x", "P", &bank);
        results.push(Value::Object(result));
    }
    Ok(json!({ "steps": results }))
}

pub(super) fn gate<T: Scalar, const M: usize>(case: &Field<'_>) -> Result<Gate<T>, Failure> {
    let (gamma, p_gate) = (case.get("gamma")?, case.get("Pg")?);
    let gate = Gate::new::<M>(gamma.number()?).map_err(|e| gamma.failure(e))?;
    gate.with_probability(p_gate.number()?).map_err(|e| p_gate.failure(e))
}

pub(super) fn plots<T: Scalar, const M: usize>(list: &Field<'_>) -> Result<Vec<Detection<T, M>>, Failure> {
    let items = list.items()?;
    if items.len() > DETS {
        return Err(list.failure(format!("{} detections where at most {DETS} fit", items.len())));
    }
    items.iter().map(|z| Ok(Detection::new(z.vector::<T, M>()?.data.0[0]))).collect()
}

/// What a scan said of one track.
struct Outcome<T> {
    validated: Vec<u16>,
    /// β_0, and β of the validated plots
    beta: Vec<T>,
}

/// Gates, scores, associates and absorbs one scan.
fn update<T: Scalar, const N: usize, const M: usize, const R: usize>(
    case: &Field<'_>,
    bank: &mut ModeBank<T, N, R>,
    model: LinearMeasurement<T, N, M>,
    clutter: Clutter<T>,
    plots: &[Detection<T, M>],
) -> Result<Outcome<T>, Failure> {
    let p_detect = case.get("Pd")?;
    let sensor = UniformSensor::new(model, p_detect.number()?, clutter, gate::<T, M>(case)?).map_err(|e| p_detect.failure(e))?;
    let candidates: Vec<u16> = (0..).take(plots.len()).collect();
    let innovations = innovations(bank, &sensor.model);
    let mut evidence = Evidence::<T, DETS>::new();
    evidence.collect(bank, &innovations, &sensor, plots, Candidates::new(plots, &candidates));
    let (miss, weights) = evidence.weights();
    let mut beta = vec![Pda.associate(miss, weights)];
    beta.extend_from_slice(weights);
    if evidence.absorb(beta[0], bank, &innovations, &sensor.model, plots) > 0 {
        return Err(case.failure("a covariance would not stay definite"));
    }
    Ok(Outcome { validated: evidence.gated().to_vec(), beta })
}
