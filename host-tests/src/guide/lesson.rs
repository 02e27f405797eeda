//! The lessons: of one number of the configuration, values that are too small, right, and too large.

use super::curve::Figures;

/// What the tracker is told.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// As the table calls it; the right one in bold
    pub label: &'static str,
    /// One model of constant acceleration with this variance \[(m/s²)²\], or the three models of the scenario
    pub noise: Option<f32>,
    /// Probability that a mode stays; `None` for the scenario's own jumps
    pub stay: Option<f32>,
    /// P_D
    pub p_detect: f32,
    /// Density of clutter \[1/m²\]
    pub clutter: f32,
    /// Gate
    pub gate: f32,
    /// Confirmed by hits, of scans, and deleted by misses; `None` for the probability of existence
    pub life: Option<[u8; 3]>,
}

/// All right.
const RIGHT: Setting = Setting { label: "", noise: None, stay: None, p_detect: 0.9, clutter: 9e-6, gate: 16.0, life: None };

/// What a picture shows over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// rms error of the tracks
    Error,
    /// Mean NEES of the tracks
    Nees,
    /// Share of the targets that have one
    Found,
    /// Tracks of nothing
    False,
}

/// One lesson.
pub struct Lesson {
    /// In file names and marks
    pub name: &'static str,
    /// Above the picture
    pub title: &'static str,
    /// Above the column of settings
    pub told: &'static str,
    /// What the picture shows
    pub shown: Shown,
    /// Whether the first run is drawn on a map
    pub map: bool,
    /// Whether the NEES of the tracks has a picture of its own
    pub nees: bool,
    /// Three of them
    pub settings: [Setting; 3],
    /// What the guide says of their figures
    pub holds: fn(&[Figures]) -> bool,
}

/// Too small, right, too large.
fn order(figures: &[Figures], of: impl Fn(&Figures) -> f64) -> [f64; 3] {
    std::array::from_fn(|number| figures.get(number).map_or(f64::NAN, &of))
}

/// All lessons, in the order of the guide.
pub const LESSONS: [Lesson; 6] = [
    Lesson {
        name: "noise",
        title: "One model, three process noises",
        told: "process noise Q",
        shown: Shown::Error,
        map: true,
        nees: true,
        settings: [
            Setting { label: "0.1 (m/s²)²", noise: Some(0.1), ..RIGHT },
            Setting { label: "**10 (m/s²)²**", noise: Some(10.0), ..RIGHT },
            Setting { label: "300 (m/s²)²", noise: Some(300.0), ..RIGHT },
        ],
        holds: |figures| {
            let (without, error, nees) = (order(figures, |f| f.without), order(figures, |f| f.quiet), order(figures, |f| f.nees));
            let lost = without[0] > 2.0 * without[1] && without[2] > 2.0 * without[1] && error[2] > 2.0 * error[1];
            lost && nees[0] > 1.5 * nees[1] && nees[2] < 0.7 * nees[1]
        },
    },
    Lesson {
        name: "jump",
        title: "Three modes, three probabilities to stay in one",
        told: "probability to stay in a mode",
        shown: Shown::Error,
        map: false,
        nees: false,
        settings: [
            Setting { label: "0.4", stay: Some(0.4), ..RIGHT },
            Setting { label: "**0.95**", stay: Some(0.95), ..RIGHT },
            Setting { label: "0.99999", stay: Some(0.99999), ..RIGHT },
        ],
        holds: |figures| {
            let (quiet, hard) = (order(figures, |f| f.quiet), order(figures, |f| f.manoeuvre));
            quiet[0] > 1.1 * quiet[1] && hard[2] > 1.1 * hard[1]
        },
    },
    Lesson {
        name: "detection",
        title: "Three values of P_D, where 0.9 is true",
        told: "P_D",
        shown: Shown::Found,
        map: false,
        nees: false,
        settings: [
            Setting { label: "0.3", p_detect: 0.3, ..RIGHT },
            Setting { label: "**0.9**", ..RIGHT },
            Setting { label: "0.999", p_detect: 0.999, ..RIGHT },
        ],
        holds: |figures| {
            let (without, false_) = (order(figures, |f| f.without), order(figures, |f| f.false_tracks));
            without[2] > 2.0 * without[1] && false_[0] > 2.0 * false_[1]
        },
    },
    Lesson {
        name: "clutter",
        title: "Three densities of clutter, where 9e-6 is true",
        told: "clutter density",
        shown: Shown::False,
        map: false,
        nees: false,
        settings: [
            Setting { label: "9e-8 /m²", clutter: 9e-8, ..RIGHT },
            Setting { label: "**9e-6 /m²**", ..RIGHT },
            Setting { label: "9e-4 /m²", clutter: 9e-4, ..RIGHT },
        ],
        holds: |figures| {
            let (without, false_) = (order(figures, |f| f.without), order(figures, |f| f.false_tracks));
            false_[0] > 3.0 * false_[1] && without[2] > 2.0 * without[1]
        },
    },
    Lesson {
        name: "gate",
        title: "Three gates",
        told: "gate",
        shown: Shown::Found,
        map: false,
        nees: false,
        settings: [
            Setting { label: "1", gate: 1.0, ..RIGHT },
            Setting { label: "**16**", ..RIGHT },
            Setting { label: "100", gate: 100.0, ..RIGHT },
        ],
        holds: |figures| {
            let [small, right, _] = order(figures, |f| f.without);
            small > 2.0 * right
        },
    },
    Lesson {
        name: "life",
        title: "Three rules of confirmation",
        told: "confirmed by M hits of N, deleted after K misses",
        shown: Shown::False,
        map: false,
        nees: false,
        settings: [
            Setting { label: "2 of 3, 3", life: Some([2, 3, 3]), ..RIGHT },
            Setting { label: "**5 of 5, 5**", life: Some([5, 5, 5]), ..RIGHT },
            Setting { label: "8 of 8, 2", life: Some([8, 8, 2]), ..RIGHT },
        ],
        holds: |figures| {
            let (without, false_) = (order(figures, |f| f.without), order(figures, |f| f.false_tracks));
            false_[0] > 2.0 * false_[1] && without[2] > 2.0 * without[1]
        },
    },
];
