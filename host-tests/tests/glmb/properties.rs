//! What must hold whatever the data: weights, order, the random walk, the bound.

use super::{All, Ample, Outcome, Problem, ample, l1, sets, time};
use boresight::glmb::{Density, Gibbs, Label, Mixture, Ranked, Truncation};
use boresight::scan::{Detection, Report, Scan};
use boresight::tracker::GlmbState;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::error::Error;

#[test]
fn weights_and_probabilities_sum_to_one() -> Outcome {
    for seed in 100..130 {
        let problem = Problem::draw(seed);
        let state = ample::<f64>(&problem, problem.scans.len())?;
        let sum: f64 = state.hypotheses().map(|(weight, _)| weight).sum();
        let numbers: f64 = (0..=6).map(|n| state.cardinality(n)).sum();
        assert!((sum - 1.0).abs() < 1e-12 && (numbers - 1.0).abs() < 1e-12);
        assert!(state.labels().all(|e| (e.modes.iter().sum::<f64>() - 1.0).abs() < 1e-12 && (0.0..=1.0).contains(&e.existence)));
        let expected: f64 = (0..=6).map(|n| n as f64 * state.cardinality(n)).sum();
        let existence: f64 = state.labels::<4, 2>().map(|e| e.existence).sum();
        assert!((expected - existence).abs() < 1e-12, "the expected number of targets is the sum of their existences");
        let weights: Vec<f64> = state.hypotheses().map(|(weight, _)| weight).collect();
        assert!(weights.is_sorted_by(|a, b| a >= b));
    }
    Ok(())
}

/// All numbers that a state tells, by label.
fn told(state: &Ample<f64>) -> Vec<(Label, Vec<u64>)> {
    let mut told: Vec<_> = state
        .labels::<4, 2>()
        .map(|e| {
            let numbers = e.state.mean.iter().chain(&e.modes).chain([&e.existence]);
            (e.label, numbers.map(|x| (x + 0.0).to_bits()).collect())
        })
        .collect();
    told.sort();
    told
}

#[test]
fn the_order_of_detections_changes_no_bit() -> Outcome {
    for seed in 200..230 {
        let mut problem = Problem::draw(seed);
        let before = told(&*ample::<f64>(&problem, problem.scans.len())?);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        problem.scans.iter_mut().for_each(|scan| scan.shuffle(&mut rng));
        assert_eq!(told(&*ample::<f64>(&problem, problem.scans.len())?), before, "seed {seed}");
    }
    Ok(())
}

#[test]
fn the_order_of_regions_changes_names_only() -> Outcome {
    for seed in 300..330 {
        let mut problem = Problem::draw(seed);
        let count = problem.births.len() as u16;
        let before = sets(&*ample::<f64>(&problem, problem.scans.len())?);
        problem.births.reverse();
        let after = sets(&*ample::<f64>(&problem, problem.scans.len())?);
        let rename = |label: &Label| Label { index: count - 1 - label.index, ..*label };
        let renamed = after.into_iter().map(|(labels, weight)| {
            let mut labels: Vec<Label> = labels.iter().map(rename).collect();
            labels.sort();
            (labels, weight)
        });
        let apart = l1(&renamed.collect(), &before);
        assert!(apart < 1e-12, "seed {seed}: {apart:e}");
    }
    Ok(())
}

type Walked<const SWEEPS: usize> = GlmbState<f64, Mixture<f64, 4, 2, 4>, Gibbs<SWEEPS>, 128, 4096, 6, 4, 4>;

fn walk<const SWEEPS: usize>(problem: &Problem, seed: u64) -> Result<super::Sets, Box<dyn Error>> {
    let (tracker, sensor) = (problem.tracker(Gibbs::<SWEEPS>)?, problem.sensor()?);
    let (mut state, mut rng) = (Box::new(Walked::<SWEEPS>::new()), ChaCha8Rng::seed_from_u64(seed));
    for k in 0..problem.scans.len() {
        tracker.step_with(&mut state, &sensor, &Scan::new(time(k), &problem.plots(k)), &mut rng)?;
    }
    Ok(sets(&*state))
}

/// The mean over problems of the L1 distance falls as the walk gets longer, and ends near nothing.
#[test]
fn a_long_walk_finds_what_ranking_finds() -> Outcome {
    let mut means = [0.0; 3];
    for seed in 400..420 {
        let problem = Problem::draw(seed);
        let ranked = sets(&*ample::<f64>(&problem, problem.scans.len())?);
        for (mean, walked) in means.iter_mut().zip([walk::<4>(&problem, seed)?, walk::<40>(&problem, seed)?, walk::<800>(&problem, seed)?])
        {
            *mean += l1(&ranked, &walked) / 20.0;
        }
    }
    assert!(means[0] > means[1] && means[1] > means[2] && means[2] < 2e-2, "{means:?}");
    Ok(())
}

/// The last scan of a problem, from a state with nothing given up, by a tracker with less room. Returns the report and the
/// distance of its sets from the truth.
fn tight<D, A, const S: usize, const H: usize, const L: usize, const G: usize>(
    problem: &Problem,
    truncation: A,
    most: usize,
    share: f64,
) -> Result<Option<(Report, f64)>, Box<dyn Error>>
where
    D: Density<f64, 4, 2>,
    A: Truncation<f64, L> + Copy,
{
    let (sensor, scans) = (problem.sensor()?, problem.scans.len());
    let generous = problem.tracker(truncation)?;
    let sparing = problem.tracker(truncation)?.with_limits(most, share)?;
    let (mut state, mut rng) = (Box::new(GlmbState::<f64, D, A, S, H, L, G, 4>::new()), ChaCha8Rng::seed_from_u64(1));
    for k in 0..scans {
        let last = k + 1 == scans;
        let tracker = if last { &sparing } else { &generous };
        let report = tracker.step_with(&mut state, &sensor, &Scan::new(time(k), &problem.plots(k)), &mut rng)?;
        if last {
            return Ok(Some((report, l1(&sets(&*state), &sets(&*ample::<f64>(problem, scans)?)))));
        }
        if report.truncated_mass > 0.0 {
            // Not from the same state.
            return Ok(None);
        }
    }
    Ok(None)
}

/// The L1 distance of the sets is at most twice the truncated mass, whatever was short: hypotheses, a threshold, events, columns.
#[test]
fn the_bound_always_holds() -> Outcome {
    type Two = Mixture<f64, 4, 2, 4>;
    let (mut held, mut useful) = (0, 0);
    for seed in 500..560 {
        let problem = Problem::draw(seed);
        let mut reports = Vec::new();
        for most in [1, 2, 5, 20] {
            reports.push(tight::<Two, _, 128, 4096, 6, 4>(&problem, All::default(), most, 0.0)?);
        }
        for share in [0.3, 0.01, 1e-4] {
            reports.push(tight::<Two, _, 128, 4096, 6, 4>(&problem, All::default(), 4096, share)?);
        }
        for (report, apart) in reports.into_iter().flatten() {
            let bound = 2.0 * f64::from(report.truncated_mass);
            assert!(apart <= bound + 1e-12, "seed {seed}: {apart} > {bound}");
            held += 1;
            // No more than what was given up counts twice, when up to six detections are shared.
            useful += usize::from(bound < 10.0 * apart + 1e-9);
        }
    }
    assert!(held > 300 && useful > held / 2, "{useful} of {held}");
    Ok(())
}

/// Where the capacities themselves are short from the first scan on: one scan, so that all begin with nothing.
#[test]
fn the_bound_holds_for_every_capacity() -> Outcome {
    type Two = Mixture<f64, 4, 2, 4>;
    let mut short = [0; 5];
    for seed in 600..660 {
        let mut problem = Problem::draw(seed);
        problem.scans.truncate(1);
        let all = 4096;
        let results = [
            tight::<Two, _, 128, 4, 6, 4>(&problem, All::default(), all, 0.0)?,
            tight::<Two, _, 4, 64, 1, 4>(&problem, All::default(), all, 0.0)?,
            tight::<Two, _, 128, 64, 6, 1>(&problem, All::default(), all, 0.0)?,
            tight::<Two, _, 128, 64, 6, 4>(&problem, Ranked::<3, 16>, all, 0.0)?,
            tight::<Two, _, 128, 64, 6, 4>(&problem, Ranked::<256, 2>, all, 0.0)?,
        ];
        for (short, (report, apart)) in short.iter_mut().zip(results.into_iter().map(|r| r.unwrap_or_default())) {
            let bound = 2.0 * f64::from(report.truncated_mass);
            assert!(apart <= bound + 1e-12, "seed {seed}: {apart} > {bound}");
            *short += usize::from(report.truncated_mass > 0.0);
        }
    }
    assert!(short.iter().all(|count| *count >= 10), "{short:?}");
    Ok(())
}

#[test]
fn a_far_clutter_point_changes_nothing() -> Outcome {
    for seed in 700..720 {
        let mut problem = Problem::draw(seed);
        let before = sets(&*ample::<f64>(&problem, problem.scans.len())?);
        problem.scans.iter_mut().for_each(|scan| scan.push([5e3, 5e3]));
        assert!(l1(&sets(&*ample::<f64>(&problem, problem.scans.len())?), &before) < 1e-12, "seed {seed}");
    }
    Ok(())
}

/// A detection with the sensor's own noise is the same as one without.
#[test]
fn noise_of_its_own_counts() -> Outcome {
    let problem = Problem::draw(5);
    let (tracker, sensor) = (problem.tracker::<f64, _>(All::default())?, problem.sensor()?);
    let run = |noise: Option<f64>| -> Result<super::Sets, Box<dyn Error>> {
        let mut state = Box::new(Ample::<f64>::new());
        for k in 0..problem.scans.len() {
            let own = |d: Detection<f64, 2>| match noise {
                Some(noise) => d.with_noise(boresight::symmetric::Symmetric::from_diagonal([noise; 2])),
                None => d,
            };
            let plots: Vec<_> = problem.plots(k).into_iter().map(own).collect();
            tracker.step(&mut state, &sensor, &Scan::new(time(k), &plots))?;
        }
        Ok(sets(&*state))
    };
    let (plain, same, other) = (run(None)?, run(Some(super::NOISE))?, run(Some(4.0 * super::NOISE))?);
    assert!(l1(&plain, &same) < 1e-12 && l1(&plain, &other) > 1e-3);
    Ok(())
}
