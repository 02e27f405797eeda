//! Monte Carlo figures with the error they carry.
//!
//! ```text
//! standard error of a mean = s / sqrt(N),   s^2 = sum (x - mean)^2 / (N - 1)
//! Wilson interval of k of N at z = 1.96:
//!     (p + z^2/2N  -+  z sqrt(p (1-p)/N + z^2/4N^2)) / (1 + z^2/N),   p = k/N
//! ```
//!
//! Sums run in the order of the values, so the same runs give the same bits. Reference: E. B. Wilson,
//! J. American Statistical Association 22(158), 1927.

/// The standard normal quantile of 0.975: 95 % of the distribution lie within +- this.
const Z_95: f64 = 1.959_963_984_540_054;

/// A mean and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Arithmetic mean.
    pub mean: f64,
    /// One standard error; `None` with a single value.
    pub standard_error: Option<f64>,
    /// Number of values.
    pub count: usize,
}

/// Mean and standard error; `None` without values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<Mean> {
    let values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    let standard_error = (values.len() > 1).then(|| (squares / (n - 1.0) / n).sqrt());
    Some(Mean { mean, standard_error, count: values.len() })
}

/// Root mean square; `None` without values.
pub fn rms(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(values.into_iter().map(|x| x * x)).map(|m| m.mean.sqrt())
}

/// The middle value, or the mean of the middle two; `None` without values or with one that is NaN.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// The `fraction` quantile (0..=1), linear between order statistics (Hyndman & Fan's definition 7).
///
/// `None` without values, with one that is NaN, or with a fraction outside 0..=1.
pub fn quantile(values: impl IntoIterator<Item = f64>, fraction: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    if !(0.0..=1.0).contains(&fraction) || sorted.iter().any(|x| x.is_nan()) {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let place = fraction * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    let part = place.fract();
    // Equal neighbours are returned as they are: infinity minus infinity is not a number.
    Some(if below == above { below } else { below + part * (above - below) })
}

/// A proportion with its 95 % Wilson interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proportion {
    /// `successes` / `trials`.
    pub fraction: f64,
    /// Lower end of the interval, >= 0.
    pub lower: f64,
    /// Upper end of the interval, <= 1.
    pub upper: f64,
}

/// The proportion of `successes` among `trials`; `None` without trials or with more successes than trials.
#[must_use]
pub fn wilson(successes: usize, trials: usize) -> Option<Proportion> {
    if trials == 0 || successes > trials {
        return None;
    }
    let n = trials as f64;
    let p = successes as f64 / n;
    let z2n = Z_95 * Z_95 / n;
    let centre = p + z2n / 2.0;
    let half = (z2n * (p * (1.0 - p) + z2n / 4.0)).sqrt();
    let scale = 1.0 + z2n;
    Some(Proportion { fraction: p, lower: ((centre - half) / scale).max(0.0), upper: ((centre + half) / scale).min(1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn mean_worked_by_hand() {
        // Squared deviations 4 + 1 + 0 + 1 + 4 = 10; variance 2.5; standard error sqrt(0.5).
        let m = mean([1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(m.is_some_and(|m| m.mean == 3.0 && m.count == 5 && m.standard_error.is_some_and(|e| (e - 0.5_f64.sqrt()).abs() < 1e-15)));
        assert_eq!(mean([2.0]).and_then(|m| m.standard_error), None);
        assert_eq!(mean([]), None);
        assert_eq!(rms([3.0, -4.0, 0.0, 0.0]), Some(2.5));
    }

    #[test]
    fn quantiles_worked_by_hand() {
        assert_eq!(median([5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median([4.0, 1.0]), Some(2.5));
        assert_eq!(quantile([0.0, 10.0, 20.0], 0.9), Some(18.0));
        assert_eq!(median([1.0, f64::INFINITY, f64::INFINITY]), Some(f64::INFINITY));
        assert_eq!((median([]), median([f64::NAN]), quantile([1.0], 1.5)), (None, None, None));
    }

    #[test]
    fn wilson_against_published_counts() {
        // Per mille, rounded outwards, as printed beside 77 and 5 of 1000 in the scenario tables.
        for (k, lower, upper) in [(77, 0.062, 0.0952), (5, 0.0021, 0.0117), (68, 0.054, 0.0853)] {
            let p = wilson(k, 1000);
            assert!(p.is_some_and(|p| (p.lower - lower).abs() < 5e-4 && (p.upper - upper).abs() < 5e-4), "{k}: {p:?}");
        }
        assert_eq!((wilson(0, 0), wilson(3, 2)), (None, None));
    }

    proptest! {
        #[test]
        fn wilson_holds_the_fraction_within_0_and_1(n in 1_usize..2000, part in 0.0..=1.0_f64) {
            let k = (n as f64 * part) as usize;
            let p = wilson(k, n);
            prop_assert!(p.is_some_and(|p| 0.0 <= p.lower && p.lower <= p.fraction + 1e-12
                && p.fraction <= p.upper + 1e-12 && p.upper <= 1.0));
            let mirrored = wilson(n - k, n);
            prop_assert!(p.zip(mirrored).is_some_and(|(a, b)| (a.lower + b.upper - 1.0).abs() < 1e-9));
        }
    }
}
