//! Covariance intersection and the convex combination.

use crate::least;
use crate::support::{draws, gaussian, wide, wide_cov, within};
use boresight::fusion::{Rule, Weight, fuse_probabilities};
use boresight::gaussian::Gaussian;
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{DMatrix, SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;

const CRITERIA: [Weight<f64>; 2] = [Weight::Determinant, Weight::Trace];

fn fail(what: &str) -> TestCaseError {
    TestCaseError::fail(what.to_owned())
}

fn inverse<const N: usize>(m: &SMatrix<f64, N, N>) -> Result<SMatrix<f64, N, N>, TestCaseError> {
    let inverse = DMatrix::from_column_slice(N, N, m.as_slice()).try_inverse().ok_or_else(|| fail("singular"))?;
    Ok(SMatrix::from_column_slice(inverse.as_slice()))
}

fn objective<const N: usize>(criterion: Weight<f64>, p: &SMatrix<f64, N, N>) -> f64 {
    match criterion {
        Weight::Trace => p.trace(),
        _ => DMatrix::from_column_slice(N, N, p.as_slice()).determinant().ln(),
    }
}

/// P⁻¹ = α P_1⁻¹ + β P_2⁻¹ and x, as the textbooks have it.
fn information<const N: usize>(
    a: &Gaussian<f64, N>,
    b: &Gaussian<f64, N>,
    [alpha, beta]: [f64; 2],
) -> Result<(SVector<f64, N>, SMatrix<f64, N, N>), TestCaseError> {
    let (y1, y2) = (inverse(&a.cov.to_matrix())? * alpha, inverse(&b.cov.to_matrix())? * beta);
    let p = inverse(&(y1 + y2))?;
    Ok((p * (y1 * a.mean + y2 * b.mean), p))
}

/// In this precision, within rounding of the information form in double precision, rounding magnified by the condition number.
fn matches_information_form<T: Real, const N: usize>(one: &[f64], other: &[f64], w: f64, ratio: f64) -> TestCaseResult {
    let (a, b) = (gaussian::<T, N>(one, 100.0, 5.0), gaussian::<T, N>(other, 100.0, 5.0 * ratio));
    let exact = |g: &Gaussian<T, N>| Gaussian::<f64, N>::new(wide(&g.mean), Symmetric::from_matrix(&wide_cov(&g.cov)));
    for (rule, shares) in [(Rule::NaiveConvex, [1.0; 2]), (Rule::Intersection(Weight::Fixed(T::lit(w))), [w, 1.0 - w])] {
        let fused = rule.fuse(&a, &b).ok_or_else(|| fail("refused"))?;
        let (mean, cov) = information(&exact(&a), &exact(&b), shares)?;
        // Three products of N terms on either side of M⁻; a condition number of 4 N² + 1, as `support::gaussian` bounds it.
        let unit = T::EPSILON.to_f64() * (6 * N * (4 * N * N + 1)) as f64;
        let size = SVector::<f64, N>::repeat(unit * (100.0 + a.cov.to_matrix().map(Real::to_f64).abs().max().sqrt()));
        within("mean", &wide(&fused.mean), &mean, &size)?;
        within("cov", &wide_cov(&fused.cov), &cov, &SMatrix::repeat(unit * cov.abs().max().max(25.0)))?;
    }
    Ok(())
}

proptest! {
    #[test]
    fn both_rules_are_the_information_form(one in draws(), other in draws(), w in 0.01..0.99f64, ratio in 0.3..3.0f64) {
        matches_information_form::<f64, 2>(&one, &other, w, ratio)?;
        matches_information_form::<f64, 4>(&one, &other, w, ratio)?;
        matches_information_form::<f64, 6>(&one, &other, w, ratio)?;
        matches_information_form::<f32, 2>(&one, &other, w, ratio)?;
        matches_information_form::<f32, 4>(&one, &other, w, ratio)?;
        matches_information_form::<f32, 6>(&one, &other, w, ratio)?;
    }

    /// Errors with any joint covariance whose blocks on the diagonal are P_1 and P_2: P12 = L_1 C L_2' with |C| ≤ 1.
    #[test]
    fn intersection_is_never_overconfident(one in draws(), other in draws(), mixing in draws(), w in 0.0..=1.0f64, ratio in 0.1..10.0f64) {
        let (a, b) = (gaussian::<f64, 4>(&one, 10.0, 1.0), gaussian::<f64, 4>(&other, 10.0, ratio));
        let contraction = SMatrix::<f64, 4, 4>::from_fn(|i, j| mixing[4 * i + j]);
        let contraction = contraction / (contraction * contraction.transpose()).trace().sqrt().max(1e-9);
        let root = |g: &Gaussian<f64, 4>| g.cov.to_matrix().cholesky().map(|c| c.l()).ok_or_else(|| fail("no root"));
        let (p1, p2) = (a.cov.to_matrix(), b.cov.to_matrix());
        let p12 = root(&a)? * contraction * root(&b)?.transpose();
        for weight in [Weight::Fixed(w), Weight::Determinant, Weight::Trace] {
            let w = weight.of(&a.cov, &b.cov).ok_or_else(|| fail("no weight"))?;
            let fused = Rule::Intersection(weight).fuse(&a, &b).ok_or_else(|| fail("refused"))?;
            // What the estimate is made of: x = K_1 x_1 + K_2 x_2.
            let p = fused.cov.to_matrix();
            let (k1, k2) = (p * inverse(&p1)? * w, p * inverse(&p2)? * (1.0 - w));
            let shared = k1 * p12 * k2.transpose();
            let actual = k1 * p1 * k1.transpose() + k2 * p2 * k2.transpose() + shared + shared.transpose();
            prop_assert!((k1 * a.mean + k2 * b.mean - fused.mean).norm() < 1e-9 * (1.0 + fused.mean.norm()));
            prop_assert!(least(&(p - actual)) > -1e-9 * p.trace(), "{weight:?}: {}", least(&(p - actual)));
        }
    }

    #[test]
    fn the_optimum_is_that_of_a_dense_scan(one in draws(), other in draws(), ratio in 0.2..5.0f64) {
        let (a, b) = (gaussian::<f64, 4>(&one, 10.0, 1.0), gaussian::<f64, 4>(&other, 10.0, ratio));
        for criterion in CRITERIA {
            let fused = Rule::Intersection(criterion).fuse(&a, &b).ok_or_else(|| fail("refused"))?;
            let found = objective(criterion, &fused.cov.to_matrix());
            let mut least = f64::INFINITY;
            for step in 1..1000 {
                let w = f64::from(step) / 1000.0;
                least = least.min(objective(criterion, &information(&a, &b, [w, 1.0 - w])?.1));
            }
            prop_assert!(found <= least + 1e-9 * (1.0 + least.abs()), "{criterion:?}: {found} for {least}");
        }
    }

    #[test]
    fn exchanging_the_estimates_changes_nothing_but_the_weight(one in draws(), other in draws(), ratio in 0.2..5.0f64) {
        let (a, b) = (gaussian::<f64, 4>(&one, 10.0, 1.0), gaussian::<f64, 4>(&other, 10.0, ratio));
        for rule in [Rule::NaiveConvex, Rule::Intersection(Weight::Determinant), Rule::Intersection(Weight::Trace)] {
            let (forth, back) = (rule.fuse(&a, &b), rule.fuse(&b, &a));
            let (forth, back) = forth.zip(back).ok_or_else(|| fail("refused"))?;
            // The weights of both searches agree to √ε.
            prop_assert!((forth.mean - back.mean).norm() < 1e-6 * (1.0 + forth.mean.norm()));
            prop_assert!((forth.cov.to_matrix() - back.cov.to_matrix()).abs().max() < 1e-6 * forth.cov.to_matrix().trace());
        }
        for weight in CRITERIA {
            let sum = weight.of(&a.cov, &b.cov).zip(weight.of(&b.cov, &a.cov)).map(|(w, v)| w + v);
            prop_assert!(sum.is_some_and(|sum| (sum - 1.0).abs() < 1e-7), "{sum:?}");
        }
    }

    /// P_2 = P_1 + A A' knows less of everything: nothing is to be had from it.
    #[test]
    fn an_estimate_that_knows_less_of_everything_gets_no_weight(one in draws(), more in draws()) {
        let a = gaussian::<f32, 4>(&one, 10.0, 1.0);
        let worse = Gaussian::new(a.mean, a.cov.plus(&gaussian::<f32, 4>(&more, 0.0, 1.0).cov));
        for weight in [Weight::Determinant, Weight::Trace] {
            prop_assert_eq!(weight.of(&a.cov, &worse.cov), Some(1.0));
            prop_assert_eq!(weight.of(&worse.cov, &a.cov), Some(0.0));
            prop_assert_eq!(Rule::Intersection(weight).fuse(&worse, &a), Some(a));
        }
    }

    #[test]
    fn single_precision_finds_the_optimum_of_double_precision(one in draws(), other in draws(), ratio in 0.2..5.0f64) {
        let narrow = [gaussian::<f32, 4>(&one, 10.0, 1.0), gaussian::<f32, 4>(&other, 10.0, ratio)];
        let [a, b] = narrow.map(|g| Gaussian::<f64, 4>::new(wide(&g.mean), Symmetric::from_matrix(&wide_cov(&g.cov))));
        for (weight, exact) in [(Weight::Determinant, Weight::Determinant), (Weight::Trace, Weight::Trace)] {
            let w = weight.of(&narrow[0].cov, &narrow[1].cov).ok_or_else(|| fail("no weight"))?;
            let at = |w: f64| Ok::<_, TestCaseError>(objective(exact, &information(&a, &b, [w, 1.0 - w])?.1));
            let best = Rule::Intersection(exact).fuse(&a, &b).map(|g| objective(exact, &g.cov.to_matrix()));
            // Rounding of the slope moves the weight by some 1e-6 of a bracket of 7e-4: second order in what is lost.
            let lost = at(f64::from(w).clamp(1e-6, 1.0 - 1e-6))? - best.ok_or_else(|| fail("refused"))?;
            prop_assert!(lost < 1e-5 * (1.0 + at(0.5)?.abs()), "{weight:?}: {lost}");
        }
    }

    #[test]
    fn what_both_know_exactly_is_kept_and_the_rest_fused_without_it(one in draws(), other in draws(), w in 0.05..0.95f64) {
        let (a, b) = (gaussian::<f32, 4>(&one, 10.0, 2.0), gaussian::<f32, 4>(&other, 10.0, 2.0));
        let place = [0, 1, 3, 4];
        let padded = |g: &Gaussian<f32, 4>| {
            let (mut mean, mut cov) = (SVector::<f32, 6>::zeros(), Symmetric::<f32, 6>::zeros());
            for (i, to) in place.iter().enumerate() {
                mean[*to] = g.mean[i];
                for (j, and) in place.iter().enumerate().skip(i) {
                    cov.upper_mut()[*to][*and] = g.cov.upper()[i][j];
                }
            }
            Gaussian::new(mean, cov)
        };
        let rules = [Rule::NaiveConvex, Rule::Intersection(Weight::Fixed(w as f32)), Rule::Intersection(Weight::Determinant), Rule::Intersection(Weight::Trace)];
        for rule in rules {
            let (small, large) = rule.fuse(&a, &b).zip(rule.fuse(&padded(&a), &padded(&b))).ok_or_else(|| fail("refused"))?;
            let small = padded(&small);
            prop_assert!((small.mean - large.mean).norm() < 1e-4 * (1.0 + small.mean.norm()), "{rule:?}");
            prop_assert!((small.cov.to_matrix() - large.cov.to_matrix()).abs().max() < 1e-4 * small.cov.to_matrix().trace(), "{rule:?}");
        }
    }

    #[test]
    fn fused_mode_probabilities_are_the_normalised_geometric_mean(p in 0.01..0.99f64, q in 0.01..0.99f64, r in 0.01..0.99f64) {
        let of = [[p, 1.0 - p], [q, 1.0 - q], [r, 1.0 - r]];
        let (yes, no) = ((p * q * r).cbrt(), ((1.0 - p) * (1.0 - q) * (1.0 - r)).cbrt());
        let got = fuse_probabilities(of.iter());
        prop_assert!((got[0] - yes / (yes + no)).abs() < 1e-12 && (got[0] + got[1] - 1.0).abs() < 1e-15);
    }
}

#[test]
fn the_ends_of_the_weight_are_the_estimates_themselves() {
    let (a, b) = (gaussian::<f32, 4>(&[0.3; 90], 10.0, 1.0), gaussian::<f32, 4>(&[-0.7; 90], 10.0, 2.0));
    let at = |w| Rule::Intersection(Weight::Fixed(w)).fuse(&a, &b);
    assert_eq!((at(1.0), at(0.0)), (Some(a), Some(b)));
    assert!(Rule::Intersection(Weight::Fixed(1.1f32)).check().is_err() && Rule::Intersection(Weight::Fixed(f32::NAN)).check().is_err());
}

#[test]
fn of_equal_estimates_every_weight_is_as_good_and_nothing_is_gained() {
    let a = gaussian::<f32, 4>(&[0.4; 90], 10.0, 1.0);
    for weight in [Weight::Determinant, Weight::Trace] {
        assert_eq!(weight.of(&a.cov, &a.cov), Some(0.5));
        let same = Rule::Intersection(weight).fuse(&a, &a);
        assert!(same.is_some_and(|g| (g.cov.to_matrix() - a.cov.to_matrix()).abs().max() < 1e-5));
        let halved = Rule::NaiveConvex.fuse(&a, &a);
        assert!(halved.is_some_and(|g| (g.cov.to_matrix() * 2.0 - a.cov.to_matrix()).abs().max() < 1e-5));
    }
}

#[test]
fn fusion_in_order_of_the_convex_rule_adds_all_information() {
    let of = [[4.0, 1.0], [4.0, 2.0], [2.0, 2.0]].map(|v| Gaussian::new(SVector::from([v[0], v[1]]), Symmetric::from_diagonal(v)));
    let fused = Rule::<f64>::NaiveConvex.fuse_in_order(of.iter());
    // 1/4 + 1/4 + 1/2 and 1 + 1/2 + 1/2 of information.
    assert!(fused.is_some_and(|g| (g.cov.to_matrix() - SMatrix::<f64, 2, 2>::from([[1.0, 0.0], [0.0, 0.5]])).norm() < 1e-12));
    assert!(fused.is_some_and(|g| (g.mean - SVector::from([3.0, 1.5])).norm() < 1e-12));
    assert_eq!(Rule::<f64>::NaiveConvex.fuse_in_order([].iter().map(|g: &Gaussian<f64, 2>| g)), None);
}

#[test]
fn what_is_no_covariance_is_refused() {
    let good = Gaussian::<f32, 2>::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 1.0]));
    for bad in [[-2.0, 1.0], [f32::NAN, 1.0], [f32::INFINITY, 1.0]] {
        let bad = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(bad));
        for rule in [Rule::NaiveConvex, Rule::Intersection(Weight::Fixed(0.4)), Rule::Intersection(Weight::Trace)] {
            assert!(rule.fuse(&good, &bad).is_none_or(|g| g.cov.has_valid_variances() && g.mean.iter().all(|v| v.is_finite())));
            assert!(rule.fuse(&bad, &good).is_none_or(|g| g.cov.has_valid_variances() && g.mean.iter().all(|v| v.is_finite())));
        }
        assert_eq!(Rule::NaiveConvex.fuse(&good, &bad), None);
    }
}

#[test]
fn modes_that_one_excludes_are_excluded_unless_nothing_is_left() {
    assert_eq!(fuse_probabilities([[0.0, 1.0f32], [0.5, 0.5]].iter()), [0.0, 1.0]);
    assert_eq!(fuse_probabilities([[0.0, 1.0f32], [1.0, 0.0]].iter()), [0.5, 0.5]);
    assert_eq!(fuse_probabilities([[0.3, 0.7f32]].iter()), [0.3, 0.7]);
    assert_eq!(fuse_probabilities::<f32, 2>([].iter()), [0.0, 0.0]);
}
