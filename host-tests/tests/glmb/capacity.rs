//! Little room: the heaviest stays, whatever came first, and the report says that something went.

use super::{All, Outcome, Problem, ample, sets, time};
use boresight::glmb::Mixture;
use boresight::scan::{Detection, Scan};
use boresight::tracker::GlmbState;

/// Eight hypotheses, few tracks.
type Small = GlmbState<f64, Mixture<f64, 4, 2, 1>, All, 16, 8, 6, 4, 4>;

fn run(problem: &Problem) -> Result<(Box<Small>, f32), Box<dyn std::error::Error>> {
    let (tracker, sensor) = (problem.tracker(All::default())?, problem.sensor()?);
    let (mut state, mut truncated) = (Box::new(Small::new()), 0f32);
    for k in 0..problem.scans.len() {
        let report = tracker.step(&mut state, &sensor, &Scan::new(time(k), &problem.plots(k)))?;
        truncated = truncated.max(report.truncated_mass);
    }
    Ok((state, truncated))
}

#[test]
fn what_stays_does_not_depend_on_the_order_of_arrival() -> Outcome {
    let mut truncated = 0;
    for seed in 800..860 {
        let mut problem = Problem::draw(seed);
        let (before, mass) = run(&problem)?;
        problem.scans.iter_mut().for_each(|scan| scan.reverse());
        let (after, same) = run(&problem)?;
        assert_eq!((sets(&*before), mass), (sets(&*after), same), "seed {seed}");
        truncated += usize::from(mass > 0.0);
    }
    assert!(truncated > 30, "{truncated}");
    Ok(())
}

/// After one scan, what is kept is the head of the list of all hypotheses.
#[test]
fn the_heaviest_stay() -> Outcome {
    for seed in 900..930 {
        let mut problem = Problem::draw(seed);
        problem.scans.truncate(1);
        let ((small, mass), all) = (run(&problem)?, ample::<f64>(&problem, 1)?);
        let weights: Vec<f64> = all.hypotheses().map(|(weight, _)| weight).collect();
        let kept: f64 = weights.iter().take(8).sum();
        for ((weight, _), known) in small.hypotheses().zip(&weights) {
            assert!((weight - known / kept).abs() < 1e-12, "seed {seed}");
        }
        assert_eq!(small.hypotheses().count(), weights.len().min(8));
        assert!((f64::from(mass) - (1.0 - kept)).abs() < 1e-6, "seed {seed}: {mass} of {}", 1.0 - kept);
    }
    Ok(())
}

#[test]
fn more_detections_than_fit_are_told() -> Outcome {
    let problem = Problem::draw(4);
    let (tracker, sensor) = (problem.tracker(All::default())?, problem.sensor()?);
    let mut state = Box::new(Small::new());
    let plots: Vec<_> = (0..7).map(|i| Detection::new([f64::from(i), 0.0]).with_amplitude(f64::from(i))).collect();
    let report = tracker.step(&mut state, &sensor, &Scan::new(time(0), &plots))?;
    assert_eq!((report.detections, report.detections_dropped), (4, 3));
    assert!(!report.is_complete());
    Ok(())
}

/// A crowd of detections around all targets for many scans: the table and the list stay full, and nothing else happens.
#[test]
fn overload_is_survived() -> Outcome {
    let problem = Problem::draw(7);
    let (tracker, sensor) = (problem.tracker(All::default())?, problem.sensor()?);
    let (mut state, mut full) = (Box::new(Small::new()), 0);
    for k in 0..50 {
        let plots = [[0.0, 0.0], [5.0, 5.0], [-5.0, 5.0], [5.0, -5.0]].map(Detection::new);
        let report = tracker.step(&mut state, &sensor, &Scan::new(time(k), &plots))?;
        assert!((0.0..=1.0).contains(&report.truncated_mass) && report.numeric_resets == 0, "{report:?}");
        full += usize::from(report.truncated_mass > 0.0);
        let sum: f64 = state.hypotheses().map(|(weight, _)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-12 && state.tracks() <= 13);
    }
    assert!(full >= 48, "{full}");
    Ok(())
}
