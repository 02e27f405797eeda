//! Kind `lms`: the variable-structure IMM with a likely-model set, one measurement a scan (`boresight::mode::LikelyModes`).
//!
//! Inputs of a case: `F` per model, `Q`, `H`, `R`, `pi`, `x0`, `P0`, `initial_set`, `mu0` in its order, `t1`, `t2`, `K`; of a step:
//! `z` (null: no measurement). Results of a step are the sets by name, and lists of [model, value] over the union.

use super::field::{Field, matrix, number, vector};
use super::kf::symmetric;
use super::sizes::by_size;
use super::{CaseSolver, Kind};
use crate::Failure;
use crate::precision::{Precision, Scalar};
use boresight::evidence::{SomeInnovations, correct_by_one, no_innovations, predict_measurements};
use boresight::gaussian::Gaussian;
use boresight::mode::{ActiveSet, Adaptation, Deviations, LikelyModes, ModeBank, ModeSet};
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::scalar::exp;
use serde_json::{Map, Value, json};

pub(super) const KIND: Kind = Kind { name: "lms", lists: &[("cases", solve as CaseSolver)] };

fn solve(case: &Field<'_>, precision: Precision) -> Result<Value, Failure> {
    let sizes = [case.get("n")?.count()?, case.get("m")?.count()?, case.get("F")?.items()?.len()];
    by_size!(precision, filter(case), sizes, [4 2 3] [4 2 4] [4 2 5] [4 2 6] [4 2 7] [4 2 8] [4 2 9])
}

fn filter<T: Scalar, const N: usize, const M: usize, const R: usize>(case: &Field<'_>) -> Result<Value, Failure> {
    let noise = symmetric(case, "Q")?;
    let mut motion = [LinearMotion { transition: nalgebra::SMatrix::<T, N, N>::zeros(), process_noise: noise }; R];
    for (model, f) in motion.iter_mut().zip(&case.get("F")?.items()?) {
        model.transition = f.matrix()?;
    }
    let sensor = LinearMeasurement { matrix: case.get("H")?.matrix()?, noise: symmetric(case, "R")? };
    let pi = case.get("pi")?.matrix::<T, R, R>()?;
    let jump = std::array::from_fn(|i| std::array::from_fn(|j| pi[(i, j)]));
    let likely = LikelyModes::new(&jump, case.get("t1")?.number()?, case.get("t2")?.number()?, case.get("K")?.count()?);
    let likely = likely.map_err(|error| case.failure(error))?.without_recall();

    let mut prob = [T::ZERO; R];
    for (mode, p) in case.get("initial_set")?.items()?.iter().zip(case.get("mu0")?.numbers()?) {
        *prob.get_mut(mode.count()?).ok_or_else(|| mode.failure("no such model"))? = p;
    }
    let mut bank = ModeBank::new(prob, Gaussian::new(case.get("x0")?.vector()?, symmetric(case, "P0")?));
    let mut run = bank.active();
    let mut results = Vec::new();
    for step in case.get("steps")?.items()? {
        let z = step.find("z")?.map(|z| z.vector::<T, M>()).transpose()?;
        let before = Deviations::new(&bank, bank.active());
        bank.prob = [T::ZERO; R];
        let mut refused = 0;
        // Mixes, predicts and corrects modes; ln L, zero where nothing was measured.
        let mut cycle = |bank: &mut ModeBank<T, N, R>, modes: ActiveSet| {
            bank.interact_from(&before, &jump, run, modes);
            bank.advance_active(&motion, modes, &motion.steps(T::ONE));
            let Some(z) = &z else { return [T::ZERO; R] };
            let (ln_likelihood, resets) = {
                let mut innovations = no_innovations();
                predict_measurements(&mut innovations, bank, modes, &sensor);
                correct_by_one(bank, &SomeInnovations::new(&innovations, modes), &sensor, z)
            };
            refused += resets;
            ln_likelihood
        };
        let first = cycle(&mut bank, run);
        let largest = first.iter().fold(-T::ONE / T::ZERO, |most, l| if *l > most { *l } else { most });
        let relative = |ln_likelihood: [T; R]| ln_likelihood.map(|l| exp(l - largest));
        let adaptation = likely.adapt(&mut bank, run, relative(first), false, |bank, new| Some(relative(cycle(bank, new))));
        if refused > 0 {
            return Err(step.failure("a covariance would not stay definite"));
        }
        results.push(Value::Object(result(&adaptation, run, &bank)));
        run = adaptation.next;
    }
    Ok(json!({ "steps": results }))
}

fn result<T: Scalar, const N: usize, const R: usize>(
    adaptation: &Adaptation<T, R>,
    run: ActiveSet,
    bank: &ModeBank<T, N, R>,
) -> Map<String, Value> {
    let Adaptation { prob, unlikely, principal, adjacent, new, removed, next } = *adaptation;
    let union = run.with(new);
    let set = |modes: ActiveSet| modes.iter().map(Value::from).collect::<Value>();
    let values = |modes: ActiveSet, value: &dyn Fn(usize) -> Value| modes.iter().map(|r| json!([r, value(r)])).collect::<Value>();
    let combined = combined(bank, union);
    Map::from_iter([
        ("run".into(), set(run)),
        ("mu_first".into(), values(run, &|r| number(prob[r]))),
        ("unlikely".into(), set(unlikely)),
        ("principal".into(), set(principal)),
        ("adjacent".into(), set(adjacent)),
        ("new".into(), set(new)),
        ("union".into(), set(union)),
        ("discardable".into(), set(unlikely.without(adjacent))),
        ("removed".into(), set(removed)),
        ("next".into(), set(next)),
        ("mu".into(), values(union, &|r| number(bank.prob[r]))),
        ("x_j".into(), values(union, &|r| vector(&bank.modes[r].mean))),
        ("P_j".into(), values(union, &|r| matrix(&bank.modes[r].cov.to_matrix()))),
        ("x".into(), vector(&combined.mean)),
        ("P".into(), matrix(&combined.cov.to_matrix())),
    ])
}

/// The combined estimate.
fn combined<T: Scalar, const N: usize, const R: usize>(bank: &ModeBank<T, N, R>, active: ActiveSet) -> Gaussian<T, N> {
    let mut bank = *bank;
    bank.anchor(active);
    bank.combined()
}
