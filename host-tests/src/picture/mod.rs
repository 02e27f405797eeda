//! SVG charts: maps with equal axes, and curves over time.
//!
//! ```
//! use host_tests::picture::{Chart, Series};
//! let rms = vec![[1.0, 7.2], [2.0, 6.9], [3.0, 8.4]];
//! let svg = Chart::curves("Position error", "time [s]", "rms [m]")
//!     .with(Series::curve("IMM-PDAF", rms))
//!     .with(Series::level("measurement error", 7.07))
//!     .render()?;
//! assert!(svg.starts_with("<svg"));
//! # Ok::<(), host_tests::Failure>(())
//! ```
//!
//! Series are drawn in the order they are added, later ones above. A point that is not finite breaks
//! its line, so one series can hold several tracks or leave a gap. The legend stands beside the plot and
//! never covers data; series of the same name share an entry. Curves take their colours in turn from a
//! palette that stays legible with colour-blind eyes (Okabe & Ito's, extended); [`Series::coloured`] pins
//! one, so that a filter keeps its colour from picture to picture.

mod axis;
mod clip;
mod draw;
mod layout;

use crate::Failure;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mark {
    /// A solid line in a palette colour.
    Line,
    /// A solid line in a palette colour with a point at every value: a track with its updates.
    Track,
    /// A thin black line: the truth.
    Truth,
    /// A thin dashed grey line: something to compare with.
    Dashed,
    /// Small grey points: plots and clutter.
    Dots,
}

impl Mark {
    /// Whether it takes the next colour of the palette by itself.
    fn is_coloured(self) -> bool {
        matches!(self, Self::Line | Self::Track)
    }
}

/// A named set of points and how to draw them.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    name: String,
    points: Vec<[f64; 2]>,
    mark: Mark,
    colour: Option<usize>,
    /// Whether the single value is to be drawn across the whole width.
    level: bool,
}

impl Series {
    /// A curve: a solid coloured line.
    pub fn curve(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Mark::Line)
    }

    /// A track on a map: a coloured line with a point at every estimate.
    pub fn track(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Mark::Track)
    }

    /// The truth: a thin black line.
    pub fn truth(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Mark::Truth)
    }

    /// Plots or clutter: small grey points. Add it first, so that it lies below.
    pub fn clutter(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Mark::Dots)
    }

    /// Something to compare with: a thin dashed grey line.
    pub fn reference(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Mark::Dashed)
    }

    /// A value to compare with, drawn across the whole width like [`Series::reference`].
    pub fn level(name: impl Into<String>, value: f64) -> Self {
        Self { level: true, ..Self::new(name, vec![[f64::NAN, value]], Mark::Dashed) }
    }

    /// Pins the colour, also of a series that is grey or black otherwise: the `index`-th of the palette, counted from 0 and starting over at its end.
    #[must_use]
    pub fn coloured(self, index: usize) -> Self {
        Self { colour: Some(index), ..self }
    }

    fn new(name: impl Into<String>, points: Vec<[f64; 2]>, mark: Mark) -> Self {
        Self { name: name.into(), points, mark, colour: None, level: false }
    }
}

/// A chart that is being put together; [`Chart::render`] draws it.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    title: String,
    x_label: String,
    y_label: String,
    equal_axes: bool,
    log_y: bool,
    x_limits: Option<[f64; 2]>,
    y_limits: Option<[f64; 2]>,
    series: Vec<Series>,
}

impl Chart {
    /// A map: a metre is as long on both axes. Labels carry the unit, `x [m]`.
    pub fn map(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self { equal_axes: true, ..Self::curves(title, x_label, y_label) }
    }

    /// Curves over a common x, usually time. Labels carry the unit, `time [s]`.
    pub fn curves(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            equal_axes: false,
            log_y: false,
            x_limits: None,
            y_limits: None,
            series: Vec::new(),
        }
    }

    /// Draws y logarithmically; values that are not positive become gaps. Not for maps.
    #[must_use]
    pub fn log_y(self) -> Self {
        Self { log_y: true, ..self }
    }

    /// Shows only this part of the x axis; what lies outside is cut off.
    #[must_use]
    pub fn x_limits(self, from: f64, to: f64) -> Self {
        Self { x_limits: Some([from, to]), ..self }
    }

    /// Shows only this part of the y axis; what lies outside is cut off.
    #[must_use]
    pub fn y_limits(self, from: f64, to: f64) -> Self {
        Self { y_limits: Some([from, to]), ..self }
    }

    /// Adds a series above those already there; one without points is left out of chart and legend.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        if !series.points.is_empty() {
            self.series.push(series);
        }
        self
    }

    /// Draws the chart as the text of an SVG file.
    pub fn render(&self) -> Result<String, Failure> {
        draw::svg(self).map_err(|reason| Failure::input(reason).within(&self.title))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_carry_their_labels_and_survive_gaps() -> Result<(), Failure> {
        let points = vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0], [3.0, f64::INFINITY], [4.0, 1.0], [5.0, 2.0]];
        let svg = Chart::curves("Error <of> a & b", "time [s]", "rms [m]")
            .with(Series::curve("first", points.clone()))
            .with(Series::level("bound", 7.07))
            .render()?;
        for text in ["Error &lt;of&gt; a &amp; b", "time [s]", "rms [m]", "first", "bound"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(
            svg,
            Chart::curves("Error <of> a & b", "time [s]", "rms [m]")
                .with(Series::curve("first", points))
                .with(Series::level("bound", 7.07))
                .render()?
        );
        Ok(())
    }

    #[test]
    fn same_name_has_one_legend_entry() -> Result<(), Failure> {
        let path = |y| vec![[0.0, y], [10.0, y]];
        let svg = Chart::map("Map", "x [m]", "y [m]")
            .with(Series::truth("truth", path(0.0)))
            .with(Series::truth("truth", path(5.0)))
            .with(Series::clutter("nothing", vec![]))
            .render()?;
        assert_eq!((svg.matches("truth\n").count(), svg.contains("nothing")), (1, false));
        Ok(())
    }

    #[test]
    fn degenerate_data_still_make_a_chart() -> Result<(), Failure> {
        let single = |x: f64, y: f64| vec![Series::curve("one", vec![[x, y]])];
        for series in [vec![], single(1.0, 1.0), single(0.0, 0.0), single(f64::NAN, 1.0), single(1e-300, 1e300)] {
            for chart in [Chart::map("t", "x", "y"), Chart::curves("t", "x", "y"), Chart::curves("t", "x", "y").log_y()] {
                let svg = series.iter().cloned().fold(chart, Chart::with).render()?;
                assert!(svg.ends_with("</svg>\n"));
            }
        }
        Ok(())
    }

    #[test]
    fn senseless_limits_are_refused() {
        let chart = Chart::curves("t", "x", "y").x_limits(3.0, 3.0);
        assert!(chart.render().is_err_and(|f| f.to_string().starts_with("t: ")));
        assert!(Chart::curves("t", "x", "y").log_y().y_limits(0.0, 3.0).render().is_err());
    }
}
