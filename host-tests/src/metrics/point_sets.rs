//! OSPA and GOSPA: the distance between the set X of true points and the set Y of estimates.
//!
//! With m = min(|X|, |Y|), n = max(|X|, |Y|) and the optimal pairing of [`super::matching`]:
//!
//! ```text
//! OSPA(c, p)  = ((sum over m pairs of min(c, d)^p + c^p (n - m)) / n)^(1/p)      0 if both are empty
//! GOSPA(c, p) = (sum over pairs with d < c of d^p + c^p/2 (missed + false))^(1/p)        alpha = 2
//! ```
//!
//! with `missed` = |X| - pairs and `false` = |Y| - pairs. OSPA is an error per point, at most c; GOSPA
//! grows with the number of errors. Decompositions: OSPA^p = localisation^p + cardinality^p;
//! GOSPA^p = localisation + missed + false (p-th powers themselves).
//!
//! References: D. Schuhmacher, B.-T. Vo, B.-N. Vo, IEEE Trans. Signal Processing 56(8), 2008;
//! A. S. Rahmathullah, A. F. Garcia-Fernandez, L. Svensson, FUSION 2017.

use super::matching::match_points;

/// OSPA and its two parts, each under its own root \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ospa {
    /// The metric, 0 to c.
    pub ospa: f64,
    /// Part due to paired points.
    pub localisation: f64,
    /// Part due to the difference in numbers.
    pub cardinality: f64,
}

/// GOSPA with alpha = 2 \[m\] and its three parts as p-th powers \[m^p\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gospa {
    /// The metric.
    pub gospa: f64,
    /// Sum of d^p over the pairs.
    pub localisation: f64,
    /// c^p/2 for each true point without an estimate.
    pub missed: f64,
    /// c^p/2 for each estimate without a true point.
    pub false_: f64,
    /// Number of pairs.
    pub n_assigned: usize,
    /// Number of true points without an estimate.
    pub n_missed: usize,
    /// Number of estimates without a true point.
    pub n_false: usize,
}

/// OSPA with cut-off `cutoff` \[m\] and order `order` >= 1.
pub fn ospa<X: AsRef<[f64]>, Y: AsRef<[f64]>>(truth: &[X], estimates: &[Y], cutoff: f64, order: f64) -> Ospa {
    let larger = truth.len().max(estimates.len());
    let smaller = truth.len().min(estimates.len());
    if larger == 0 {
        return Ospa::default();
    }
    let matching = match_points(truth, estimates, cutoff, order);
    let cap = cutoff.powf(order);
    let beyond = smaller - matching.pairs.len();
    let localisation = matching.cost(order) + cap * beyond as f64;
    let cardinality = cap * (larger - smaller) as f64;
    let root = |sum: f64| (sum / larger as f64).powf(order.recip());
    Ospa { ospa: root(localisation + cardinality), localisation: root(localisation), cardinality: root(cardinality) }
}

/// GOSPA with cut-off `cutoff` \[m\], order `order` >= 1 and alpha = 2.
pub fn gospa<X: AsRef<[f64]>, Y: AsRef<[f64]>>(truth: &[X], estimates: &[Y], cutoff: f64, order: f64) -> Gospa {
    let matching = match_points(truth, estimates, cutoff, order);
    let n_assigned = matching.pairs.len();
    let (n_missed, n_false) = (truth.len() - n_assigned, estimates.len() - n_assigned);
    let charge = cutoff.powf(order) / 2.0;
    let localisation = matching.cost(order);
    let (missed, false_) = (charge * n_missed as f64, charge * n_false as f64);
    Gospa { gospa: (localisation + missed + false_).powf(order.recip()), localisation, missed, false_, n_assigned, n_missed, n_false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const C: f64 = 30.0;

    fn points() -> impl Strategy<Value = Vec<[f64; 2]>> {
        prop::collection::vec([-40.0..40.0, -40.0..40.0_f64], 0..7)
    }

    fn orders() -> impl Strategy<Value = f64> {
        prop_oneof![Just(1.0), Just(2.0), Just(3.5)]
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * (1.0 + a.abs().max(b.abs()))
    }

    proptest! {
        #[test]
        fn a_set_is_at_zero_from_itself(x in points(), p in orders()) {
            prop_assert_eq!(ospa(&x, &x, C, p).ospa, 0.0);
            prop_assert_eq!(gospa(&x, &x, C, p).gospa, 0.0);
        }

        #[test]
        fn both_are_symmetric(x in points(), y in points(), p in orders()) {
            prop_assert!(close(ospa(&x, &y, C, p).ospa, ospa(&y, &x, C, p).ospa));
            let (there, back) = (gospa(&x, &y, C, p), gospa(&y, &x, C, p));
            prop_assert!(close(there.gospa, back.gospa));
            prop_assert_eq!((there.n_missed, there.n_false), (back.n_false, back.n_missed));
        }

        #[test]
        fn both_obey_the_triangle_inequality(
            x in points(), y in points(), z in points(), p in orders(),
        ) {
            let slack = 1e-9;
            prop_assert!(ospa(&x, &z, C, p).ospa
                <= ospa(&x, &y, C, p).ospa + ospa(&y, &z, C, p).ospa + slack);
            prop_assert!(gospa(&x, &z, C, p).gospa
                <= gospa(&x, &y, C, p).gospa + gospa(&y, &z, C, p).gospa + slack);
        }

        #[test]
        fn order_of_the_points_does_not_matter(
            (y, shuffled) in points().prop_flat_map(|y| (Just(y.clone()), Just(y).prop_shuffle())),
            x in points(), p in orders(),
        ) {
            prop_assert!(close(ospa(&x, &y, C, p).ospa, ospa(&x, &shuffled, C, p).ospa));
            prop_assert!(close(gospa(&x, &y, C, p).gospa, gospa(&x, &shuffled, C, p).gospa));
        }

        #[test]
        fn parts_add_up(x in points(), y in points(), p in orders()) {
            let o = ospa(&x, &y, C, p);
            prop_assert!(close(o.ospa.powf(p), o.localisation.powf(p) + o.cardinality.powf(p)));
            prop_assert!(o.ospa <= C * (1.0 + 1e-12));
            let g = gospa(&x, &y, C, p);
            prop_assert!(close(g.gospa.powf(p), g.localisation + g.missed + g.false_));
            prop_assert_eq!(g.n_assigned + g.n_missed, x.len());
            prop_assert_eq!(g.n_assigned + g.n_false, y.len());
        }

        #[test]
        fn one_more_false_estimate_costs_gospa_half_a_cutoff(x in points(), p in orders()) {
            let mut y = x.clone();
            y.push([1e6, 1e6]);
            prop_assert!(close(gospa(&x, &y, C, p).gospa, (C.powf(p) / 2.0).powf(p.recip())));
        }
    }

    #[test]
    fn worked_by_hand() {
        // Two pairs at 3 and 4 m, one estimate too many.
        let x = [[0.0, 0.0], [100.0, 0.0]];
        let y = [[100.0, 4.0], [0.0, 3.0], [500.0, 500.0]];
        let o = ospa(&x, &y, 10.0, 1.0);
        assert!(close(o.ospa, (3.0 + 4.0 + 10.0) / 3.0), "{o:?}");
        let g = gospa(&x, &y, 10.0, 2.0);
        assert!(close(g.gospa, (9.0_f64 + 16.0 + 50.0).sqrt()), "{g:?}");
    }

    #[test]
    fn empty_sets() {
        let none: [[f64; 2]; 0] = [];
        assert_eq!(ospa(&none, &none, C, 1.0), Ospa::default());
        assert_eq!(ospa(&none, &[[1.0, 2.0]], C, 2.0).ospa, C);
        assert_eq!(gospa(&[[1.0, 2.0]], &none, C, 1.0).gospa, C / 2.0);
    }
}
