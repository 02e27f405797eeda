//! Kinds `coupled_jpdam` (one scan, two targets in one pair of modes) and `coupled_cycle` (a whole cycle over all pairs of modes, one
//! sensor or several): the coupled filter with merged measurements (`boresight::coupled`), in the variant `consistent`.
//!
//! Inputs of a scan: `x_pred`, `P_pred` of both targets together, `z_pred1`, `z_pred2`, `H1`, `H2`, `R`, `R_a`, `R_d`, `alpha`, `Pd`,
//! `Pd_a`, `lam` or `V` (diffuse), `y` with `valid1`, `valid2`, `valid_merged`. Inputs of a cycle: `F`, `Q` per model, `pi`, `mu`, `x_J`,
//! `P_J`, `alpha` and the `sensors`, each with `H`, `R`, `R_a`, `R_d`, `Pd`, `V`, `y`.

use super::field::{Field, number, numbers};
use super::kf::symmetric;
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::coupled::{Blocks, Candidate, CoupledBank, CoupledGaussian, CoupledInnovation, Cross, Event, Odds, Sums};
use boresight::gaussian::{Gaussian, ResidualDensity};
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::resolution::Resolution;
use boresight::scalar::{exp, ln};
use boresight::scan::Detection;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use serde_json::{Value, json};

pub(super) const ONE_SCAN: Kind = Kind { name: "coupled_jpdam", lists: &[("cases", one_scan as CaseSolver)] };
pub(super) const CYCLE: Kind = Kind { name: "coupled_cycle", lists: &[("cases", cycle as CaseSolver)] };

type Targets<T, const N: usize> = CoupledGaussian<T, N, Cross<T, N>>;

fn one_scan(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("nz")?.count()?];
    by_size!(precision, scan(case), sizes, [4 2] [6 2] [6 3] [9 2] [9 3])
}

fn cycle(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("nz")?.count()?, case.get("n_models")?.count()?];
    by_size!(precision, whole_cycle(case), sizes, [4 2 2] [4 2 3] [6 2 2] [6 2 3] [9 2 2] [9 2 3])
}

fn scan<T: Scalar, const N: usize, const M: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let mut targets = targets::<T, N>(&case.get("x_pred")?, &case.get("P_pred")?)?;
    let h = [case.get("H1")?.matrix::<T, M, N>()?, case.get("H2")?.matrix()?];
    let seen =
        Seen { model: LinearMeasurement { matrix: h[0], noise: symmetric(case, "R")? }, case, p_merged: case.get("Pd_a")?.number()? };
    let z_hat = [case.get("z_pred1")?.vector()?, case.get("z_pred2")?.vector()?];
    let innovation = linearised(&targets, z_hat, &h, &seen.model.noise);
    let flags = |key: &str| case.get(key)?.items()?.iter().map(Field::flag).collect::<Result<Vec<_>, _>>();
    let scan = Scan::new(case, Some([flags("valid1")?, flags("valid2")?, flags("valid_merged")?]))?;
    let mut events = Vec::new();
    let sums = seen.weigh(&innovation, &scan, case.get("alpha")?.number()?, |event, ln_weight| events.push((event, ln_weight)))?;
    let (w, e) = sums.correction();
    if !targets.correct(&innovation, &w, &e) {
        return Err(case.failure("a covariance would not stay definite"));
    }
    let mut marginal = vec![vec![T::ZERO; scan.detections.len() + 1]; 2];
    let (mut merged, mut kinds, mut probabilities) = (T::ZERO, Vec::new(), Vec::new());
    for (event, ln_weight) in events {
        let p = exp(ln_weight - sums.ln_evidence());
        let (kind, of): (_, [Option<usize>; 2]) = match event {
            Event::Nothing => ("none", [None; 2]),
            Event::Unseen => ("unseen", [None; 2]),
            Event::One(0, i) => ("only1", [Some(i), None]),
            Event::One(_, i) => ("only2", [None, Some(i)]),
            Event::Both(i, j) => ("both", [Some(i), Some(j)]),
            Event::Merged(i) => ("merged", [Some(i); 2]),
        };
        merged += if kind == "merged" { p } else { T::ZERO };
        for (marginal, of) in marginal.iter_mut().zip(of) {
            marginal[of.map_or(0, |i| i + 1)] += p;
        }
        kinds.push(json!([kind, of[0], of[1]]));
        probabilities.push(p);
    }
    let (x, p) = estimate(&targets);
    let marginal: Value = marginal.iter().map(|row| numbers(row)).collect();
    let prob = numbers(&probabilities);
    Ok(
        json!({"result": {"consistent": {"hypotheses": kinds, "weights": prob, "P_merged": number(merged), "marginal": marginal, "x": x, "P": p}}}),
    )
}

fn whole_cycle<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let mut motion = [LinearMotion { transition: SMatrix::<T, N, N>::zeros(), process_noise: Symmetric::zeros() }; R];
    for ((model, f), q) in motion.iter_mut().zip(&case.get("F")?.items()?).zip(&case.get("Q")?.items()?) {
        (model.transition, model.process_noise) = (f.matrix()?, Symmetric::from_matrix(&q.matrix()?));
    }
    let pi = case.get("pi")?.matrix::<T, R, R>()?;
    let mut bank = CoupledBank::<T, N, R, Cross<T, N>>::ZERO;
    let (x, p) = (case.get("x_J")?.items()?, case.get("P_J")?.items()?);
    let mu = case.get("mu")?.numbers::<T>()?;
    if [x.len(), p.len(), mu.len()] != [R * R; 3] {
        return Err(case.failure(format!("x_J, P_J and mu need {} entries each", R * R)));
    }
    for joint in 0..R * R {
        bank.prob[joint / R][joint % R] = mu[joint];
        bank.pairs[joint / R][joint % R] = targets(&x[joint], &p[joint])?;
    }
    bank.interact(&std::array::from_fn(|i| std::array::from_fn(|j| pi[(i, j)])));
    bank.predict(&motion, T::ONE);
    let alpha = case.get("alpha")?.number()?;
    for sensor in case.get("sensors")?.items()? {
        let model = LinearMeasurement { matrix: sensor.get("H")?.matrix::<T, M, N>()?, noise: symmetric(&sensor, "R")? };
        let p_merged = sensor.find("Pd_a")?.map_or_else(|| sensor.get("Pd"), Ok)?.number()?;
        let (seen, scan) = (Seen { model, case: &sensor, p_merged }, Scan::new(&sensor, None)?);
        let mut ln_evidence = [[T::ZERO; R]; R];
        for (ln_evidence, pair) in ln_evidence.iter_mut().flatten().zip(bank.pairs.iter_mut().flatten()) {
            let innovation = pair.innovation(&seen.model);
            let sums = seen.weigh(&innovation, &scan, alpha, |_, _| ())?;
            *ln_evidence = sums.ln_evidence();
            let (w, e) = sums.correction();
            if !pair.correct(&innovation, &w, &e) {
                return Err(sensor.failure("a covariance would not stay definite"));
            }
        }
        bank.weigh(&ln_evidence);
    }
    let (x, p) = estimate(&bank.combined());
    let [mu1, mu2] = [0, 1].map(|target| numbers(&bank.mode_probabilities(target)));
    Ok(json!({"result": {"consistent": {"mu_J": numbers(bank.prob.as_flattened()), "mu1": mu1, "mu2": mu2, "x": x, "P": p}}}))
}

/// The detections of a scan.
struct Scan<T: Scalar, const M: usize> {
    detections: Vec<Detection<T, M>>,
    candidates: Vec<Candidate<T>>,
    /// What two detections of two targets weigh more than the product of both
    ln_pair: T,
}

impl<T: Scalar, const M: usize> Scan<T, M> {
    /// `y` with the clutter of the case, and which detections are valid for the targets and for both; all where it is not said.
    fn new(case: &Field<'_>, valid: Option<[Vec<bool>; 3]>) -> Result<Self, Failure> {
        let read = |y: &Field<'_>| Ok(Detection::new(y.vector::<T, M>()?.data.0[0]));
        let detections: Vec<_> = case.get("y")?.items()?.iter().map(read).collect::<Result<_, Failure>>()?;
        let count = T::from_count(detections.len());
        let (ln_rate, ln_pair) = match case.find("lam")? {
            Some(density) => (-ln(density.number::<T>()?), T::ZERO),
            None if detections.len() < 2 => (ln(case.get("V")?.number()?), T::ZERO),
            None => (ln(case.get("V")?.number::<T>()? / count), ln(count / (count - T::ONE))),
        };
        let is_valid = |kind: usize, i: usize| valid.as_ref().is_none_or(|valid| valid[kind].get(i).copied().unwrap_or(false));
        let candidate = |i: usize| Candidate { number: i as u16, gated: [is_valid(0, i), is_valid(1, i)], merged: is_valid(2, i), ln_rate };
        Ok(Self { candidates: (0..detections.len()).map(candidate).collect(), detections, ln_pair })
    }
}

/// A sensor of a case, which holds `R_a`, `R_d` and `Pd`.
struct Seen<'a, 'b, T: Scalar, const N: usize, const M: usize> {
    model: LinearMeasurement<T, N, M>,
    case: &'a Field<'b>,
    p_merged: T,
}

impl<T: Scalar, const N: usize, const M: usize> Seen<'_, '_, T, N, M> {
    fn weigh(
        &self,
        innovation: &CoupledInnovation<T, N, M>,
        scan: &Scan<T, M>,
        share: T,
        mut visit: impl FnMut(Event, T),
    ) -> Result<Sums<T, M>, Failure> {
        let (noise, cells) = (symmetric(self.case, "R_a")?, symmetric(self.case, "R_d")?);
        let resolution = Resolution::from_covariance(cells)
            .and_then(|resolution| resolution.with_share(share)?.with_noise(noise)?.with_p_detect(self.p_merged));
        let resolution = resolution.map_err(|error| self.case.failure(error))?;
        let odds = Odds { p_detect: [self.case.get("Pd")?.number()?; 2], p_gate: T::ONE, ln_pair: scan.ln_pair };
        let mut sums = Sums::new();
        innovation.hypotheses(&self.model, Some(&resolution), &odds, &scan.detections, &scan.candidates, |hypothesis| {
            sums.take(hypothesis);
            visit(hypothesis.event, hypothesis.ln_weight);
        });
        Ok(sums)
    }
}

/// Two targets from a vector and a matrix of both.
fn targets<T: Scalar, const N: usize>(x: &Field<'_>, p: &Field<'_>) -> Result<Targets<T, N>, Failure> {
    let (mean, cov) = (x.numbers::<T>()?, p.rows::<T>()?);
    if mean.len() != 2 * N || cov.len() != 2 * N || cov[0].len() != 2 * N {
        return Err(x.failure(format!("two targets have {} states", 2 * N)));
    }
    let target = |r: usize| Gaussian::new(SVector::from_fn(|i, _| mean[r * N + i]), Symmetric::from_fn(|i, j| cov[r * N + i][r * N + j]));
    Ok(CoupledGaussian { targets: [target(0), target(1)], cross: Cross(SMatrix::from_fn(|i, j| cov[i][N + j])) })
}

/// The predicted measurements where they and their Jacobians are given.
fn linearised<T: Scalar, const N: usize, const M: usize>(
    targets: &Targets<T, N>,
    z_hat: [SVector<T, M>; 2],
    h: &[SMatrix<T, M, N>; 2],
    noise: &Symmetric<T, M>,
) -> CoupledInnovation<T, N, M> {
    let [p1, p2] = targets.targets.each_ref().map(|target| target.cov.to_matrix());
    let c = targets.cross.0;
    let gain = [[p1 * h[0].transpose(), c * h[1].transpose()], [c.transpose() * h[0].transpose(), p2 * h[1].transpose()]];
    let cross = h[0] * gain[0][1];
    let own = [Symmetric::from_matrix(&(h[0] * gain[0][0])), Symmetric::from_matrix(&(h[1] * gain[1][1]))];
    let density = own.map(|own: Symmetric<T, M>| ResidualDensity::new(&own.plus(noise)));
    let spread = Blocks { own, cross: std::array::from_fn(|k| std::array::from_fn(|l| cross[(k, l)])) };
    CoupledInnovation { z_hat, gain, spread, noise: [*noise; 2], density }
}

/// The vector and the matrix of both targets.
fn estimate<T: Scalar, const N: usize>(targets: &Targets<T, N>) -> (Value, Value) {
    let ([first, second], c) = (&targets.targets, &targets.cross.0);
    let mean: Vec<T> = first.mean.iter().chain(second.mean.iter()).copied().collect();
    let [p1, p2] = [first.cov.to_matrix(), second.cov.to_matrix()];
    let row = |i: usize| -> Vec<T> {
        if i < N {
            p1.row(i).iter().chain(c.row(i).iter()).copied().collect()
        } else {
            c.column(i - N).iter().chain(p2.row(i - N).iter()).copied().collect()
        }
    };
    (numbers(&mean), (0..2 * N).map(|i| numbers(&row(i))).collect())
}
