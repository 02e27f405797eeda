//! Cuts lines at the edge of the plot, so that limits can show a part of the data.
//!
//! A segment a + s (b - a), 0 <= s <= 1, is inside the box between the largest s at which it enters and
//! the smallest s at which it leaves one of the four half planes (Liang & Barsky 1984).

use std::ops::Range;

/// The parts of a line through `points` inside the box; a point that is not finite breaks the line.
pub(super) fn line(points: &[[f64; 2]], x: &Range<f64>, y: &Range<f64>) -> Vec<Vec<[f64; 2]>> {
    let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in points.windows(2) {
        let Some([a, b]) = segment(pair[0], pair[1], x, y) else { continue };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&a) && a == pair[0] => part.push(b),
            _ => parts.push(vec![a, b]),
        }
    }
    parts
}

/// Whether a point is inside the box.
pub(super) fn inside([px, py]: [f64; 2], x: &Range<f64>, y: &Range<f64>) -> bool {
    (x.start..=x.end).contains(&px) && (y.start..=y.end).contains(&py)
}

fn segment(a: [f64; 2], b: [f64; 2], x: &Range<f64>, y: &Range<f64>) -> Option<[[f64; 2]; 2]> {
    if !a.iter().chain(&b).all(|value| value.is_finite()) {
        return None;
    }
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (from, to, range) in [(a[0], b[0], x), (a[1], b[1], y)] {
        let direction = to - from;
        if direction == 0.0 {
            if from < range.start || from > range.end {
                return None;
            }
            continue;
        }
        let (s, t) = ((range.start - from) / direction, (range.end - from) / direction);
        enter = enter.max(s.min(t));
        leave = leave.min(s.max(t));
    }
    let at = |s: f64| match s {
        0.0 => a,
        1.0 => b,
        _ => [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])],
    };
    (enter <= leave).then(|| [at(enter), at(leave)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const X: Range<f64> = 0.0..10.0;
    const Y: Range<f64> = 0.0..5.0;

    #[test]
    fn line_is_cut_at_the_edge_and_broken_at_gaps() {
        let points = [[-5.0, 1.0], [5.0, 1.0], [5.0, 9.0], [5.0, f64::NAN], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]];
        let expected = [vec![[0.0, 1.0], [5.0, 1.0], [5.0, 5.0]], vec![[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]];
        assert_eq!(line(&points, &X, &Y), expected);
    }

    #[test]
    fn line_that_leaves_and_returns_is_two_lines() {
        let points = [[1.0, 1.0], [1.0, 9.0], [2.0, 1.0]];
        let expected = [vec![[1.0, 1.0], [1.0, 5.0]], vec![[1.5, 5.0], [2.0, 1.0]]];
        assert_eq!(line(&points, &X, &Y), expected);
    }

    proptest! {
        #[test]
        fn nothing_is_left_outside(points in prop::collection::vec([-20.0..20.0, -20.0..20.0_f64], 0..20)) {
            let slack = |r: &Range<f64>| r.start - 1e-9..r.end + 1e-9;
            for point in line(&points, &X, &Y).concat() {
                prop_assert!(inside(point, &slack(&X), &slack(&Y)), "{point:?}");
            }
        }

        #[test]
        fn what_is_inside_is_kept(points in prop::collection::vec([0.0..10.0, 0.0..5.0_f64], 2..20)) {
            prop_assert_eq!(line(&points, &X, &Y), [points]);
        }
    }
}
