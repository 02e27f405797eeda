//! Sets of modes against the standard library's, and the interaction between two sets against its formula.

use super::{MODES, chain};
use boresight::gaussian::Gaussian;
use boresight::mode::{ActiveSet, Deviations, ModeBank};
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use std::collections::BTreeSet;

fn sets() -> impl Strategy<Value = BTreeSet<usize>> {
    prop::collection::btree_set(0..ActiveSet::MOST, 0..=ActiveSet::MOST)
}

fn modes_of(set: ActiveSet) -> BTreeSet<usize> {
    set.iter().collect()
}

proptest! {
    #[test]
    fn set_operations_are_those_of_sets(a in sets(), b in sets(), mode in 0..40_usize) {
        let [x, y]: [ActiveSet; 2] = [&a, &b].map(|set| set.iter().copied().collect());
        prop_assert_eq!(modes_of(x), a.clone());
        prop_assert!(x.iter().is_sorted());
        prop_assert_eq!((x.len(), x.is_empty(), x.contains(mode)), (a.len(), a.is_empty(), a.contains(&mode)));
        prop_assert_eq!(modes_of(x.with(y)), a.union(&b).copied().collect());
        prop_assert_eq!(modes_of(x.without(y)), a.difference(&b).copied().collect());
        prop_assert_eq!(modes_of(ActiveSet::of(mode)), (mode..=mode).filter(|m| *m < ActiveSet::MOST).collect());
        prop_assert_eq!(modes_of(ActiveSet::first(mode)), (0..mode.min(ActiveSet::MOST)).collect());
    }

    /// c_j and the moments of the mixture by their definitions, with matrices.
    #[test]
    fn interaction_between_sets_is_that_of_the_formula(
        before in prop::collection::btree_set(0..MODES, 1..=MODES),
        to in prop::collection::btree_set(0..MODES, 1..=MODES),
        values in prop::collection::vec(-1.0..1.0_f64, 40 * MODES),
    ) {
        let jump = chain();
        let value = |r: usize, k: usize| values[40 * r + k];
        let g = |r: usize| {
            let root = SMatrix::<f64, 4, 4>::from_fn(|i, j| 10.0 * value(r, 4 * i + j) + if i == j { 30.0 } else { 0.0 });
            Gaussian::new(SVector::from_fn(|k, _| 100.0 * value(r, 20 + k)), Symmetric::from_matrix(&(root * root.transpose())))
        };
        let weight = |r: usize| if before.contains(&r) { value(r, 30).abs() + 0.01 } else { 0.0 };
        let total: f64 = (0..MODES).map(weight).sum();
        let old = ModeBank { prob: std::array::from_fn(|r| weight(r) / total), modes: std::array::from_fn(g) };
        prop_assert_eq!(modes_of(old.active()), before.clone());

        let run: ActiveSet = to.iter().copied().collect();
        let mut new = ModeBank { prob: [0.0; MODES], ..old };
        new.interact_from(&Deviations::new(&old, old.active()), &jump, run, run);

        let reach = |j: usize| (0..MODES).map(|i| jump[i][j] * old.prob[i]).sum::<f64>();
        let sum: f64 = to.iter().map(|j| reach(*j)).sum();
        for j in 0..MODES {
            if !to.contains(&j) {
                prop_assert_eq!((new.prob[j], new.modes[j]), (0.0, old.modes[j]));
                continue;
            }
            // What cannot be reached gets the combined estimate and no probability.
            let part = |i: usize| if reach(j) > 0.0 { jump[i][j] * old.prob[i] / reach(j) } else { old.prob[i] };
            let c = if sum > 0.0 { reach(j) / sum } else { 0.0 };
            let mean = (0..MODES).fold(SVector::<f64, 4>::zeros(), |mean, i| mean + old.modes[i].mean * part(i));
            let cov = (0..MODES).fold(SMatrix::<f64, 4, 4>::zeros(), |cov, i| {
                let d = old.modes[i].mean - mean;
                cov + (old.modes[i].cov.to_matrix() + d * d.transpose()) * part(i)
            });
            prop_assert!((new.prob[j] - c).abs() < 1e-14);
            prop_assert!((new.modes[j].mean - mean).amax() < 1e-11);
            prop_assert!((new.modes[j].cov.to_matrix() - cov).amax() < 1e-9);
        }
    }
}
