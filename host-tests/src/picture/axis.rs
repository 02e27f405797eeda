//! Ranges and ticks of an axis.
//!
//! Ticks are multiples of 1, 2 or 5 times a power of ten; on a logarithmic axis powers of ten, with 2 and
//! 5 between them where fewer than three decades are shown. A logarithmic axis lives in log10 of the
//! value throughout; only the tick's text shows the value.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// A range of values on an axis and where its ticks are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// From left to right or bottom to top.
    pub range: Range<f64>,
    /// Ticks inside the range.
    pub ticks: Vec<f64>,
    logarithmic: bool,
    step: f64,
}

impl Axis {
    /// An axis over `range` that is `pixels` long, with a tick about every `spacing` pixels.
    pub fn linear(range: Range<f64>, pixels: f64, spacing: f64) -> Self {
        let wanted = (range.end - range.start) * spacing / pixels;
        let decade = 10_f64.powf(wanted.log10().floor());
        let step = [1.0, 2.0, 5.0].map(|factor| factor * decade).into_iter().find(|&step| step >= wanted).unwrap_or(10.0 * decade);
        // A hair of slack: the last multiple may miss the end by a rounding error.
        let (first, last) = (range.start / step - 1e-9, range.end / step + 1e-9);
        let count = (last.floor() - first.ceil()).max(-1.0) as usize + 1;
        let ticks = (0..count).map(|i| (first.ceil() + i as f64) * step).collect();
        Self { range, ticks, logarithmic: false, step }
    }

    /// An axis over log10 of the values.
    pub fn logarithmic(range: Range<f64>) -> Self {
        let decades = range.end - range.start;
        let every = (decades / 10.0).ceil().max(1.0);
        let between: &[f64] = if decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let count = (decades / every).ceil() as usize + 2;
        let inside = |tick: &f64| range.start - 1e-9 <= *tick && *tick <= range.end + 1e-9;
        let first = (range.start / every).floor() * every;
        let ticks =
            (0..count).flat_map(|i| between.iter().map(move |factor| first + i as f64 * every + factor.log10())).filter(inside).collect();
        Self { range, ticks, logarithmic: true, step: every }
    }

    /// The text at a tick: as many decimals as the step needs, powers of ten for the very large and small.
    pub fn text(&self, tick: f64) -> String {
        let value = if self.logarithmic { 10_f64.powf(tick) } else { tick };
        let step = if self.logarithmic { value } else { self.step };
        let largest = if self.logarithmic { value } else { self.range.start.abs().max(self.range.end.abs()) };
        if !(1e-3..1e6).contains(&largest) {
            return if value.abs() < step / 2.0 { "0".to_owned() } else { scientific(value) };
        }
        let decimals = (-step.log10() - 1e-9).ceil().max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        if text.trim_start_matches('-').bytes().all(|b| matches!(b, b'0' | b'.')) { text.trim_start_matches('-').to_owned() } else { text }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (low, high): (i32, i32)) -> i32 {
        let part = (value - self.range.start) / (self.range.end - self.range.start);
        low + (part * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // Light points would be grid lines without a label; there are none.
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(tick: &f64) -> String {
        tick.to_string()
    }

    fn format_ext(&self, tick: &f64) -> String {
        self.text(*tick)
    }
}

/// Two significant digits are enough for a tick; a zero after the point is dropped.
fn scientific(value: f64) -> String {
    format!("{value:.1e}").replace(".0e", "e")
}

/// The smallest range that holds all finite values; `None` without any.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |range: Option<Range<f64>>, value| Some(range.map_or(value..value, |r| r.start.min(value)..r.end.max(value))))
}

/// `range` widened on both sides by a fraction of its width; a single value gets a width of its own.
pub(super) fn padded(range: &Range<f64>, fraction: f64) -> Range<f64> {
    let width = range.end - range.start;
    let least = 1e-6 * range.start.abs().max(range.end.abs());
    let margin = match width > least {
        true => width * fraction,
        false => (0.5 * range.end.abs()).max(0.5),
    };
    range.start - margin..range.end + margin
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shown(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|&tick| axis.text(tick)).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(shown(&Axis::linear(0.0..1.0, 500.0, 100.0)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(shown(&Axis::linear(-30.0..149.0, 400.0, 100.0)), ["0", "50", "100"]);
        assert_eq!(shown(&Axis::linear(-0.5..0.5, 300.0, 100.0)), ["-0.5", "0.0", "0.5"]);
        assert_eq!(shown(&Axis::linear(0.0..2e6, 300.0, 100.0)), ["0", "1e6", "2e6"]);
    }

    #[test]
    fn logarithmic_ticks_are_decades() {
        assert_eq!(shown(&Axis::logarithmic(0.2..4.1)), ["10", "100", "1000", "10000"]);
        assert_eq!(shown(&Axis::logarithmic(0.5..1.5)), ["5", "10", "20"]);
        assert_eq!(shown(&Axis::logarithmic(-2.0..-1.0)), ["0.01", "0.02", "0.05", "0.1"]);
    }

    #[test]
    fn extents() {
        assert_eq!(extent([3.0, f64::NAN, -1.0, f64::INFINITY].into_iter()), Some(-1.0..3.0));
        assert_eq!(extent([f64::NAN].into_iter()), None);
        assert_eq!(padded(&(0.0..10.0), 0.1), -1.0..11.0);
        assert_eq!(padded(&(0.0..0.0), 0.1), -0.5..0.5);
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_and_are_neither_few_nor_many(
            start in -1e5..1e5_f64, exponent in -3.0..6.0_f64, pixels in 300.0..900.0_f64,
        ) {
            let width = 10_f64.powf(exponent);
            let axis = Axis::linear(start..start + width, pixels, 90.0);
            let slack = 1e-6 * width;
            prop_assert!(axis.ticks.iter().all(|&t| start - slack <= t && t <= start + width + slack));
            prop_assert!((1..=12).contains(&axis.ticks.len()), "{:?}", axis.ticks);
        }
    }
}
