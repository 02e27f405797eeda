//! Where everything on a chart goes, in pixels.
//!
//! ```text
//!     title
//!     +--------------------------+  -- first curve
//!   y |                          |  -- second curve
//!     |           plot           |   . plots
//!     +--------------------------+
//!                  x
//! ```
//!
//! Curves get a plot of fixed size. A map's size follows from its data, so that equal axes leave no wide
//! blank margins; what little remains is filled by widening the shorter axis.

use super::axis::{Axis, extent, padded};
use super::{Chart, Series};
use std::ops::Range;

/// Space above the plot.
pub(super) const TITLE: u32 = 32;
/// Space below the plot.
pub(super) const X_LABELS: u32 = 48;
/// Space left of the plot.
pub(super) const Y_LABELS: u32 = 84;
/// Space around everything.
pub(super) const MARGIN: u32 = 16;
/// Height of a line of the legend.
pub(super) const LEGEND_LINE: u32 = 23;
/// Length of the sample of a line in the legend.
pub(super) const LEGEND_SAMPLE: u32 = 28;

/// Width of a plot of curves, and the most that a map gets.
const PLOT_WIDTH: f64 = 660.0;
/// Height of a plot of curves.
const CURVES_HEIGHT: f64 = 400.0;
/// The most that a map gets in height.
const MAP_HEIGHT: f64 = 700.0;
/// The least that a map gets in either direction.
const MAP_LEAST: f64 = 300.0;
/// Average width of a letter of the legend.
const LETTER: f64 = 7.4;

/// A series in the coordinates of the axes, with its place in the palette.
pub(super) struct Placed<'a> {
    /// The series.
    pub series: &'a Series,
    /// Its colour: an index into the palette, `None` for the neutral one of its mark.
    pub colour: Option<usize>,
    /// Its points; the second coordinate is log10 on a logarithmic axis.
    pub points: Vec<[f64; 2]>,
}

/// Axes and sizes.
pub(super) struct Layout<'a> {
    /// What to draw, from bottom to top.
    pub placed: Vec<Placed<'a>>,
    /// The x axis.
    pub x: Axis,
    /// The y axis.
    pub y: Axis,
    /// Size of the plot.
    pub plot: [u32; 2],
    /// Width of the legend beside it, 0 without one.
    pub legend: u32,
}

impl<'a> Layout<'a> {
    /// Lays out a chart; a failure says which limits make no axis.
    pub fn of(chart: &'a Chart) -> Result<Self, String> {
        let placed = place(chart);
        let data = |axis: usize| extent(placed.iter().flat_map(|p| &p.points).map(|q| q[axis]));
        let x = match limits(chart.x_limits, false)? {
            Some(range) => range,
            None => padded(&data(0).unwrap_or(0.0..1.0), if chart.equal_axes { 0.04 } else { 0.0 }),
        };
        let y = match limits(chart.y_limits, chart.log_y)? {
            Some(range) => range,
            None => vertical(chart, &data(1).unwrap_or(0.0..1.0)),
        };
        let (x, y, plot) = match chart.equal_axes {
            true => equalised(&x, &y),
            false => (x, y, [PLOT_WIDTH, CURVES_HEIGHT]),
        };
        if [&x, &y].iter().any(|range| !(range.end - range.start).is_finite()) {
            return Err("the data are too far apart to be drawn".to_owned());
        }
        let x = Axis::linear(x, plot[0], 65.0);
        let y = match chart.log_y {
            true => Axis::logarithmic(y),
            false => Axis::linear(y, plot[1], 50.0),
        };
        let longest = chart.series.iter().map(|series| series.name.chars().count()).max();
        let legend = longest.map_or(0, |letters| LEGEND_SAMPLE + MARGIN + (letters as f64 * LETTER).ceil() as u32);
        Ok(Self { placed, x, y, plot: plot.map(|length| length.round() as u32), legend })
    }

    /// The legend's entries: the first series of each name, in order.
    pub fn entries(&self) -> Vec<&Placed<'a>> {
        let first = |(i, p): &(usize, &Placed<'_>)| self.placed[..*i].iter().all(|before| before.series.name != p.series.name);
        self.placed.iter().enumerate().filter(first).map(|(_, placed)| placed).collect()
    }

    /// Size of the whole picture.
    pub fn size(&self) -> [u32; 2] {
        let legend_height = self.entries().len() as u32 * LEGEND_LINE;
        let width = 2 * MARGIN + Y_LABELS + self.plot[0] + self.legend;
        [width, 2 * MARGIN + TITLE + X_LABELS + self.plot[1].max(legend_height)]
    }
}

/// Gives every series its colour and its points in the coordinates of the axes.
///
/// The names of coloured series take the palette in turn.
fn place(chart: &Chart) -> Vec<Placed<'_>> {
    let mut names: Vec<&str> = Vec::new();
    for series in chart.series.iter().filter(|series| series.mark.is_coloured()) {
        if !names.contains(&series.name.as_str()) {
            names.push(&series.name);
        }
    }
    let turn = |series: &Series| {
        let place = names.iter().position(|name| *name == series.name);
        place.filter(|_| series.mark.is_coloured())
    };
    let scaled = |&[x, y]: &[f64; 2]| match chart.log_y {
        true if y > 0.0 => [x, y.log10()],
        true => [x, f64::NAN],
        false => [x, y],
    };
    let placed =
        |series| Placed { series, colour: series.colour.or_else(|| turn(series)), points: series.points.iter().map(scaled).collect() };
    chart.series.iter().map(placed).collect()
}

/// The limits asked for, in the coordinates of the axis.
fn limits(limits: Option<[f64; 2]>, logarithmic: bool) -> Result<Option<Range<f64>>, String> {
    let Some([from, to]) = limits else { return Ok(None) };
    let (start, end) = if logarithmic { (from.log10(), to.log10()) } else { (from, to) };
    match start.is_finite() && end.is_finite() && start < end {
        true => Ok(Some(start..end)),
        false => Err(format!("no axis from {from} to {to}")),
    }
}

/// The y axis for data in `range`: with some room, and from zero where nothing is negative, since the
/// height of an error above zero is what the eye compares.
fn vertical(chart: &Chart, range: &Range<f64>) -> Range<f64> {
    let roomy = padded(range, 0.05);
    match chart.equal_axes || chart.log_y || range.start < 0.0 {
        true => roomy,
        false => 0.0..roomy.end,
    }
}

/// Ranges with the same metres per pixel, and the size of the plot that shows them.
fn equalised(x: &Range<f64>, y: &Range<f64>) -> (Range<f64>, Range<f64>, [f64; 2]) {
    let (width, height) = (x.end - x.start, y.end - y.start);
    let scale = (width / PLOT_WIDTH).max(height / MAP_HEIGHT);
    let plot = [width, height].map(|length| (length / scale).max(MAP_LEAST));
    let widened = |range: &Range<f64>, pixels: f64| {
        let centre = f64::midpoint(range.start, range.end);
        let half = scale * pixels / 2.0;
        centre - half..centre + half
    };
    (widened(x, plot[0]), widened(y, plot[1]), plot)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: f64, height: f64) -> Chart {
        let corners = vec![[0.0, 0.0], [width, height]];
        Chart::map("t", "x [m]", "y [m]").with(Series::truth("truth", corners))
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes_of_a_map() -> Result<(), String> {
        for (width, height) in [(100.0, 100.0), (9000.0, 50.0), (2.0, 4000.0), (0.0, 0.0)] {
            let chart = map(width, height);
            let layout = Layout::of(&chart)?;
            let per_pixel = |axis: &Axis, i: usize| (axis.range.end - axis.range.start) / f64::from(layout.plot[i]);
            let ratio = per_pixel(&layout.x, 0) / per_pixel(&layout.y, 1);
            assert!((ratio - 1.0).abs() < 0.01, "{width} x {height}: {ratio}");
            assert!(layout.plot.iter().all(|&length| (300..=700).contains(&length)));
        }
        Ok(())
    }

    #[test]
    fn errors_are_shown_from_zero_and_logarithms_are_not() -> Result<(), String> {
        let chart = Chart::curves("t", "k", "e").with(Series::curve("e", vec![[0.0, 10.0], [1.0, 1000.0]]));
        assert_eq!(Layout::of(&chart)?.y.range.start, 0.0);
        let logarithmic = chart.log_y();
        let y = Layout::of(&logarithmic)?.y.range;
        assert!(0.8 < y.start && y.start < 1.0 && 3.0 < y.end && y.end < 3.2, "{y:?}");
        Ok(())
    }

    #[test]
    fn colours_follow_names() -> Result<(), String> {
        let path = || vec![[0.0, 0.0], [1.0, 1.0]];
        let chart = Chart::curves("t", "x", "y")
            .with(Series::truth("truth", path()))
            .with(Series::curve("a", path()))
            .with(Series::curve("b", path()))
            .with(Series::curve("a", path()))
            .with(Series::curve("c", path()).coloured(7));
        let layout = Layout::of(&chart)?;
        let colours: Vec<_> = layout.placed.iter().map(|placed| placed.colour).collect();
        assert_eq!(colours, [None, Some(0), Some(1), Some(0), Some(7)]);
        assert_eq!(layout.entries().len(), 4);
        Ok(())
    }
}
