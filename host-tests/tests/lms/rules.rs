//! The rules of the likely-model set, against a plain statement of them.

use super::{MODES, Outcome, chain};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::mode::{ActiveSet, JumpMatrix, LikelyModes, ModeBank};
use proptest::prelude::*;
use std::collections::BTreeSet;

type Modes = BTreeSet<usize>;

/// Ring in one direction: a mode stays or changes to the next.
fn ring() -> JumpMatrix<f64, MODES> {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            if j == i {
                0.8
            } else if j == (i + 1) % MODES {
                0.2
            } else {
                0.0
            }
        })
    })
}

fn set(modes: &Modes) -> ActiveSet {
    modes.iter().copied().collect()
}

/// Normalised over some modes.
fn normalised(weights: &[f64; MODES], modes: &Modes) -> [f64; MODES] {
    let sum: f64 = modes.iter().map(|r| weights[*r]).sum();
    std::array::from_fn(|r| if modes.contains(&r) { weights[r] / sum } else { 0.0 })
}

/// The union of a scan and the modes of the next, by the letter of table 3: [run] and the weights c L of all modes.
fn by_the_table(jump: &JumpMatrix<f64, MODES>, run: &Modes, weights: &[f64; MODES], [t1, t2]: [f64; 2], least: usize) -> [Modes; 2] {
    let first = normalised(weights, run);
    let principal: Modes = run.iter().copied().filter(|r| first[*r] > t2).collect();
    let adjacent: Modes = (0..MODES).filter(|j| principal.iter().any(|i| i != j && jump[*i][*j] != 0.0)).collect();
    let union: Modes = run.union(&adjacent).copied().collect();
    let fused = normalised(weights, &union);
    let mut discardable: Vec<usize> = run.iter().copied().filter(|r| first[*r] < t1 && !adjacent.contains(r)).collect();
    discardable.sort_by(|a, b| fused[*a].total_cmp(&fused[*b]));
    let removed: Modes = discardable.into_iter().take(union.len().saturating_sub(least)).collect();
    let next = union.difference(&removed).copied().collect();
    [union, next]
}

proptest! {
    #[test]
    fn sets_and_probabilities_are_those_of_the_table(
        one_way in any::<bool>(),
        run in prop::collection::btree_set(0..MODES, 1..=MODES),
        exponents in prop::collection::vec(-9.0..0.0_f64, MODES),
        thresholds in (0.001..0.2_f64, 0.2..0.9_f64),
        least in 1..=MODES,
    ) {
        let jump = if one_way { ring() } else { chain() };
        let weights: [f64; MODES] = std::array::from_fn(|r| exponents[r].exp());
        let likely = LikelyModes::new(&jump, thresholds.0, thresholds.1, least).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let c = normalised(&[1.0; MODES], &run);
        let mut bank = ModeBank::<f64, 4, MODES>::new(c, Gaussian::ZERO);
        let adaptation = likely.adapt(&mut bank, set(&run), weights, false, |bank, new| {
            new.iter().for_each(|r| bank.prob[r] = 1.0 / run.len() as f64);
            Some(weights)
        });
        let [union, next] = by_the_table(&jump, &run, &weights, [thresholds.0, thresholds.1], least);
        prop_assert_eq!(set(&run).with(adaptation.new), set(&union));
        prop_assert_eq!(bank.active(), set(&union));
        prop_assert_eq!(adaptation.next, set(&next));
        prop_assert!(adaptation.next.len() >= least.min(union.len()));
        for (p, expected) in bank.prob.iter().zip(normalised(&weights, &union)) {
            prop_assert!((p - expected).abs() < 1e-12);
        }
    }
}

#[test]
fn adjacency_follows_the_direction_of_jumps_or_what_was_given() -> Outcome {
    let activated = |likely: LikelyModes<f64, MODES>| {
        let run: ActiveSet = [3, 4].into_iter().collect();
        let mut bank = ModeBank::<f64, 4, MODES>::new([0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0], Gaussian::ZERO);
        likely.adapt(&mut bank, run, [1.0, 1.0, 1.0, 9.0, 1.0, 1.0, 1.0], false, |_, _| Some([1.0; MODES])).new
    };
    let likely = |jump: &JumpMatrix<f64, MODES>| LikelyModes::new(jump, 0.01, 0.5, 1);
    assert_eq!(activated(likely(&ring())?), ActiveSet::EMPTY, "3 may change to 4 alone, which runs");
    assert_eq!(activated(likely(&chain())?), ActiveSet::of(2));
    let mut adjacent = [ActiveSet::EMPTY; MODES];
    adjacent[3] = ActiveSet::of(0).with(ActiveSet::of(6));
    assert_eq!(activated(likely(&chain())?.with_adjacency(adjacent)), adjacent[3]);
    Ok(())
}

#[test]
fn recall_brings_all_modes_back_with_the_probability_of_an_unlikely_one() -> Outcome {
    let likely = LikelyModes::new(&chain(), 0.01, 0.3, 2)?;
    let run: ActiveSet = [2, 3].into_iter().collect();
    let mut bank = ModeBank::<f64, 4, MODES>::new([0.0, 0.0, 0.4, 0.6, 0.0, 0.0, 0.0], Gaussian::ZERO);
    let adaptation = likely.adapt(&mut bank, run, [1.0; MODES], true, |_, _| Some([1.0; MODES]));
    assert_eq!((adaptation.next, bank.active()), (ActiveSet::first(MODES), ActiveSet::first(MODES)));
    for r in [0, 1, 4, 5, 6] {
        assert!((bank.prob[r] / bank.prob[2] - 0.01 / 0.4).abs() < 1e-12);
    }
    let calls = |likely: LikelyModes<f64, MODES>, nis: Option<f64>| likely.recalls(2, |most| nis.is_some_and(|nis| nis <= most));
    // (8 - 2) / 2 is the default.
    assert_eq!([Some(7.9), Some(8.1), None].map(|nis| calls(likely, nis)), [false, true, true]);
    assert_eq!([Some(8.1), None].map(|nis| calls(likely.with_recall(f64::INFINITY).unwrap_or(likely), nis)), [false, true]);
    assert_eq!([Some(1e9), None].map(|nis| calls(likely.without_recall(), nis)), [false, false]);
    Ok(())
}

#[test]
fn impossible_rules_are_refused() {
    let new = |t1, t2, least| LikelyModes::<f64, MODES>::new(&chain(), t1, t2, least).err();
    for (t1, t2, least) in
        [(0.3, 0.3, 3), (-0.1, 0.3, 3), (0.1, 1.1, 3), (f64::NAN, 0.3, 3), (0.1, f64::NAN, 3), (0.1, 0.3, 0), (0.1, 0.3, 8)]
    {
        assert_eq!(new(t1, t2, least), Some(ConfigError::BadLikelyModes), "{t1} {t2} {least}");
    }
    assert_eq!(new(0.0, 1.0, MODES), None);
    let recall = |s: f64| LikelyModes::<f64, MODES>::new(&chain(), 0.0, 1.0, 1).and_then(|likely| likely.with_recall(s)).err();
    assert_eq!([0.0, -1.0, f64::NAN].map(recall), [Some(ConfigError::NotPositive); 3]);
}
