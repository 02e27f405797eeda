//! Joint association against enumeration of all events, at every capacity from too little to plenty.

mod approximate;
mod bounds;
mod events;
mod exact;
mod large;
mod problems;

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use boresight::scalar::Real;
use events::Problem;

/// Most tracks of the problems of these tests.
pub const TRACKS: usize = 8;
/// Most detections.
pub const DETS: usize = 12;

/// Probabilities per track: β_t0 and β_tj.
pub type Rows = Vec<(f64, Vec<f64>)>;

/// What `associator` makes of `problem` in the precision `T`.
pub fn associate<T: Real, A: Associator<T, TRACKS, DETS>>(associator: &A, problem: &Problem) -> (Completeness, Rows) {
    associate_in(associator, problem, Domain::Linear)
}

/// The same with the weights handed over in `domain`.
pub fn associate_in<T: Real, A: Associator<T, TRACKS, DETS>>(associator: &A, problem: &Problem, domain: Domain) -> (Completeness, Rows) {
    let mut matrix = AssociationMatrix::<T, TRACKS, DETS>::new();
    let clutter = if problem.diffuse { ClutterPrior::Diffuse } else { ClutterPrior::Poisson };
    matrix.reset(problem.detections(), clutter, domain);
    let entry = |w: f64| T::lit(if domain == Domain::Linear { w } else { w.ln() });
    for (t, (miss, hit)) in problem.miss.iter().zip(&problem.hit).enumerate() {
        if let Some((m, h)) = matrix.row_mut(t) {
            *m = entry(*miss);
            h.iter_mut().zip(hit).for_each(|(h, w)| *h = entry(*w));
        }
    }
    let completeness = associator.associate(&mut matrix, &mut A::MEMORY.clone());
    let row = |t| matrix.row(t).map_or((0.0, vec![]), |(m, h)| (m.to_f64(), h.iter().map(|h| h.to_f64()).collect()));
    (completeness, (0..problem.tracks()).map(row).collect())
}

/// The largest difference of any probability.
pub fn difference(a: &Rows, b: &Rows) -> f64 {
    let flat = |rows: &Rows| rows.iter().flat_map(|(m, h)| std::iter::once(*m).chain(h.clone())).collect::<Vec<_>>();
    let (a, b) = (flat(a), flat(b));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).fold(0.0, |worst, (a, b)| if (a - b).is_nan() { f64::INFINITY } else { (a - b).abs().max(worst) })
}
