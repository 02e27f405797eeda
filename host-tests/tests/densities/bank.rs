//! Banks of modes: mixing and combination against mixtures in double precision, modes that cannot be reached.
//!
//! The sums run over deviations from the first mode, d_i = x_i − x_1. With D the largest deviation and σ² the largest
//! variance of a state, entry (a, b) of a mixed covariance is a sum of some 2 MODES + 6 roundings of terms no larger than
//! σ_a σ_b + D_a D_b; mixed means are rounded like the coordinates, which moves deviations by ε |x|.

use crate::support::{draws, gaussian, least_eigenvalue, wide, wide_cov, within};
use crate::{deviations, mixture};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, ModeBank};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// A bank with its jump matrix, as numbers: for up to five modes of up to six states.
#[derive(Clone, Debug)]
struct Case {
    densities: Vec<Vec<f64>>,
    /// Weights of the modes, and of jumps between them; about a quarter are zero.
    weights: Vec<f64>,
    jumps: Vec<f64>,
    /// Distance of everything from the origin
    distance: f64,
    /// Deviation between the means of modes
    apart: f64,
}

fn cases() -> impl Strategy<Value = Case> {
    let weights = |n| prop::collection::vec(prop_oneof![1 => Just(0.0), 3 => 0.0..1.0f64], n);
    (prop::collection::vec(draws(), 5), weights(5), weights(25), 0.0..5.0f64, 0.0..60.0f64)
        .prop_map(|(densities, weights, jumps, decades, apart)| Case { densities, weights, jumps, distance: 10f64.powf(decades), apart })
}

/// Probabilities in proportion to `weights`, rounded to `T`; all on the entry `fallback` where all are zero.
fn distribution<T: Real, const N: usize>(weights: &[f64], fallback: usize) -> [T; N] {
    let sum: f64 = weights.iter().take(N).sum();
    std::array::from_fn(|i| if sum > 0.0 { T::lit(weights[i] / sum) } else { T::lit(f64::from(u8::from(i == fallback))) })
}

impl Case {
    fn bank<T: Real, const NX: usize, const MODES: usize>(&self) -> ModeBank<T, NX, MODES> {
        let modes = std::array::from_fn(|r| {
            let g = gaussian::<f64, NX>(&self.densities[r], self.apart, 20.0);
            Gaussian::new(g.mean.map(|v| T::lit(v + self.distance)), Symmetric::from_fn(|i, j| T::lit(g.cov.upper()[i][j])))
        });
        ModeBank { prob: distribution(&self.weights, 0), modes }
    }

    fn jump<T: Real, const MODES: usize>(&self) -> JumpMatrix<T, MODES> {
        std::array::from_fn(|i| distribution(&self.jumps[5 * i..], i))
    }
}

type Component<const NX: usize> = (f64, SVector<f64, NX>, SMatrix<f64, NX, NX>);

/// The modes in double precision with the weights `weight`.
fn components<T: Real, const NX: usize, const MODES: usize>(
    bank: &ModeBank<T, NX, MODES>,
    weight: impl Fn(usize) -> f64,
) -> Vec<Component<NX>> {
    bank.modes.iter().enumerate().map(|(r, g)| (weight(r), wide(&g.mean), wide_cov(&g.cov))).collect()
}

/// Bounds of a mixed mean and covariance of the modes of `bank`.
fn rounding<T: Real, const NX: usize, const MODES: usize>(bank: &ModeBank<T, NX, MODES>) -> (SVector<f64, NX>, SMatrix<f64, NX, NX>) {
    let (epsilon, n) = (T::EPSILON.to_f64(), MODES as f64);
    let first = wide(&bank.modes[0].mean);
    let mut apart = SVector::<f64, NX>::zeros();
    let mut sigma = SVector::<f64, NX>::zeros();
    let mut coordinate = SVector::<f64, NX>::zeros();
    for g in &bank.modes {
        let x = wide(&g.mean);
        apart = apart.sup(&(x - first).abs());
        coordinate = coordinate.sup(&x.abs());
        sigma = sigma.sup(&deviations(&wide_cov(&g.cov)));
    }
    // Weights are quotients of sums that add up to 1 within N ε.
    let mean = (coordinate + apart * (2.0 * n + 2.0)) * epsilon;
    let terms = sigma * sigma.transpose() + apart * apart.transpose();
    let moved = apart * mean.transpose() + mean * apart.transpose() + mean * mean.transpose();
    (mean, terms * (epsilon * (4.0 * n + 6.0)) + moved * 2.0)
}

fn interaction<T: Real, const NX: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let before = case.bank::<T, NX, MODES>();
    let jump = case.jump::<T, MODES>();
    let mut after = before;
    after.interact(&jump);
    let (mean_bound, cov_bound) = rounding(&before);
    for j in 0..MODES {
        // Mode j is the mixture of all modes by π_ij μ_i.
        let weight = |i: usize| jump[i][j].to_f64() * before.prob[i].to_f64();
        let reached: f64 = (0..MODES).map(weight).sum();
        // A mode out of reach waits at the combined estimate.
        let (x, p) =
            if reached > 0.0 { mixture(&components(&before, weight)) } else { mixture(&components(&before, |i| before.prob[i].to_f64())) };
        within("mixed mean", &wide(&after.modes[j].mean), &x, &mean_bound)?;
        within("mixed covariance", &wide_cov(&after.modes[j].cov), &p, &cov_bound)?;
        // A sum of MODES products, over a sum of MODES of those.
        let bound = (2 * MODES + 3) as f64 * T::EPSILON.to_f64() * reached;
        prop_assert!((after.prob[j].to_f64() - reached).abs() <= bound, "c_{j} = {} for {reached}", after.prob[j]);
    }
    // The mixture as a whole is what it was: jumps change which mode, not where.
    let (x, p) = mixture(&components(&before, |i| before.prob[i].to_f64()));
    let (mixed_x, mixed_p) = mixture(&components(&after, |j| after.prob[j].to_f64()));
    within("overall mean", &mixed_x, &x, &(mean_bound * 2.0))?;
    within("overall covariance", &mixed_p, &p, &(cov_bound * 2.0))
}

fn combination<T: Real, const NX: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let bank = case.bank::<T, NX, MODES>();
    let combined = bank.combined();
    let (x, p) = mixture(&components(&bank, |i| bank.prob[i].to_f64()));
    let (mean_bound, cov_bound) = rounding(&bank);
    within("mean", &wide(&combined.mean), &x, &mean_bound)?;
    within("covariance", &wide_cov(&combined.cov), &p, &cov_bound)?;
    let matched = Gaussian::moment_match(bank.prob.iter().copied().zip(&bank.modes));
    // The moment match sums coordinates by weights: MODES products, and weights that sum to 1 within as much.
    let coordinates = x.map(|v| (2 * MODES + 2) as f64 * T::EPSILON.to_f64() * (v.abs() + case.apart));
    within("mean", &wide(&matched.mean), &wide(&combined.mean), &(mean_bound + coordinates))?;
    within("covariance", &wide_cov(&matched.cov), &wide_cov(&combined.cov), &(cov_bound * 2.0 + coordinates * coordinates.transpose()))?;
    let best = bank.most_probable();
    prop_assert!(bank.prob.iter().all(|p| *p <= bank.prob[best]));
    Ok(())
}

/// Modes within about two standard deviations of each other, as one interaction a scan keeps them, stay definite.
fn stays_definite<T: Real>(case: &Case) -> TestCaseResult {
    let mut bank = Case { apart: case.apart.min(20.0), ..case.clone() }.bank::<T, 6, 3>();
    bank.interact(&case.jump());
    for g in bank.modes.iter().chain([&bank.combined()]) {
        prop_assert!(least_eigenvalue(&g.cov) > 0.0);
    }
    Ok(())
}

fn one_mode_is_left_alone<T: Real>(case: &Case) -> TestCaseResult {
    let before = case.bank::<T, 6, 1>();
    let mut after = before;
    after.interact(&[[T::ONE]]);
    prop_assert_eq!(after, before);
    prop_assert_eq!(after.combined(), before.modes[0]);
    Ok(())
}

proptest! {
    #[test]
    fn mixing_keeps_the_mixture(case in cases()) {
        interaction::<f32, 4, 2>(&case)?;
        interaction::<f32, 6, 3>(&case)?;
        interaction::<f32, 2, 5>(&case)?;
        interaction::<f64, 4, 2>(&case)?;
        interaction::<f64, 6, 3>(&case)?;
        interaction::<f64, 2, 5>(&case)?;
    }

    #[test]
    fn the_combined_estimate_has_the_moments_of_the_mixture(case in cases()) {
        combination::<f32, 4, 2>(&case)?;
        combination::<f32, 6, 3>(&case)?;
        combination::<f64, 4, 2>(&case)?;
        combination::<f64, 2, 5>(&case)?;
    }

    #[test]
    fn covariances_stay_definite(case in cases()) {
        stays_definite::<f32>(&case)?;
        stays_definite::<f64>(&case)?;
    }

    #[test]
    fn one_mode_has_nothing_to_mix(case in cases()) {
        one_mode_is_left_alone::<f32>(&case)?;
        one_mode_is_left_alone::<f64>(&case)?;
    }
}

/// A mode whose probability fades to nothing, under a jump matrix that lets it, down to the least number there is: it keeps
/// its density until it counts as out of reach, and has the combined estimate from then on. The other is left alone.
fn fading<T: Real>() -> TestCaseResult {
    let g = |x: f64| Gaussian::new(SVector::<T, 2>::repeat(T::lit(x)), Symmetric::from_diagonal([T::lit(4.0); 2]));
    let (mut vanishing, mut out_of_reach) = (T::lit(1e-20), false);
    while vanishing > T::ZERO {
        let before = ModeBank { prob: [T::ONE, vanishing], modes: [g(1.0), g(2.0)] };
        let mut bank = before;
        bank.interact(&[[T::ONE, T::ZERO], [T::ZERO, T::ONE]]);
        prop_assert!(bank.is_valid(), "probability {vanishing:?}: {bank:?}");
        prop_assert_eq!((bank.prob[0], bank.modes[0]), (T::ONE, g(1.0)));
        out_of_reach |= bank.prob[1] == T::ZERO;
        prop_assert_eq!(bank.prob[1], if out_of_reach { T::ZERO } else { vanishing });
        prop_assert_eq!(bank.modes[1], if out_of_reach { before.combined() } else { g(2.0) });
        vanishing *= T::lit(0.5);
    }
    prop_assert!(out_of_reach);
    Ok(())
}

#[test]
fn a_fading_mode_stays_finite() -> Result<(), TestCaseError> {
    fading::<f32>()?;
    fading::<f64>()
}
