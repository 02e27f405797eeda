//! Draws a chart that [`super::layout`] has laid out.
//!
//! The backend rounds coordinates to whole units, which would show as steps in a smooth curve. So
//! everything is drawn `FINE` times larger, and the file's `width` and `height` shrink it back.

use super::axis::Axis;
use super::layout::{LEGEND_LINE, LEGEND_SAMPLE, Layout, MARGIN, Placed, TITLE, X_LABELS, Y_LABELS};
use super::{Chart, Mark, clip};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt::Display;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plane<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// Drawing units per pixel.
const FINE: u32 = 8;
const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(226, 226, 226);
const GREY: RGBColor = RGBColor(110, 110, 110);
const PALE: RGBColor = RGBColor(160, 160, 160);

/// Okabe & Ito's colours without black and yellow, then four more.
const PALETTE: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(110, 60, 150),
    RGBColor(140, 86, 75),
    RGBColor(128, 128, 0),
    RGBColor(200, 30, 60),
];

/// The text of the SVG file, or why there is none.
pub(super) fn svg(chart: &Chart) -> Result<String, String> {
    let layout = Layout::of(chart)?;
    let [width, height] = layout.size();
    let mut svg = String::new();
    {
        let size = (width * FINE, height * FINE);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&root, chart, &layout)?;
        root.present().map_err(told)?;
    }
    let (large, small) = (size_attributes(width * FINE, height * FINE), size_attributes(width, height));
    Ok(svg.replacen(&large, &small, 1))
}

fn size_attributes(width: u32, height: u32) -> String {
    format!("width=\"{width}\" height=\"{height}\"")
}

fn draw(root: &Area<'_>, chart: &Chart, layout: &Layout<'_>) -> Result<(), String> {
    root.fill(&WHITE).map_err(told)?;
    let left = units(MARGIN + Y_LABELS);
    root.draw(&Text::new(chart.title.clone(), (left, units(MARGIN)), text(17))).map_err(told)?;

    let [plot_width, plot_height] = layout.plot;
    let corner = (units(MARGIN), units(MARGIN + TITLE));
    let area = root.clone().shrink(corner, ((Y_LABELS + plot_width) * FINE, (plot_height + X_LABELS) * FINE));
    let mut plane = ChartBuilder::on(&area)
        .x_label_area_size(units(X_LABELS))
        .y_label_area_size(units(Y_LABELS))
        .build_cartesian_2d(layout.x.clone(), layout.y.clone())
        .map_err(told)?;
    mesh(&mut plane, chart)?;
    for placed in &layout.placed {
        series(&mut plane, placed, layout)?;
    }
    legend(root, layout, (left + units(plot_width + MARGIN), units(MARGIN + TITLE)))
}

/// Grid, axes, ticks and labels.
fn mesh(plane: &mut Plane<'_, '_>, chart: &Chart) -> Result<(), String> {
    plane
        .configure_mesh()
        .bold_line_style(FAINT.stroke_width(FINE))
        .axis_style(GREY.stroke_width(FINE))
        .set_all_tick_mark_size(units(5))
        .label_style(text(13))
        .axis_desc_style(text(14))
        .x_desc(&chart.x_label)
        .y_desc(&chart.y_label)
        .draw()
        .map_err(told)
}

fn series(plane: &mut Plane<'_, '_>, placed: &Placed<'_>, layout: &Layout<'_>) -> Result<(), String> {
    let (x, y) = (&layout.x.range, &layout.y.range);
    let mark = placed.series.mark;
    let pair = |[x, y]: [f64; 2]| (x, y);
    let lines: Vec<Vec<(f64, f64)>> = if placed.series.level {
        let level = placed.points.iter().map(|&[_, y]| vec![[x.start, y], [x.end, y]]);
        level.flat_map(|ends| clip::line(&ends, x, y)).map(|line| line.into_iter().map(pair).collect()).collect()
    } else {
        let lines = clip::line(&placed.points, x, y).into_iter();
        lines.map(|line| line.into_iter().map(pair).collect()).collect()
    };
    let style = line_style(placed);
    match mark {
        Mark::Dots => {}
        Mark::Dashed => {
            for line in lines {
                plane.draw_series(DashedLineSeries::new(line, units(7), units(5), style)).map_err(told)?;
            }
        }
        Mark::Line | Mark::Track | Mark::Truth => {
            let paths = lines.into_iter().map(|line| PathElement::new(line, style));
            plane.draw_series(paths).map_err(told)?;
        }
    }
    let Some(radius) = dot_radius(mark) else { return Ok(()) };
    let dots = placed.points.iter().copied().filter(|&point| clip::inside(point, x, y));
    plane.draw_series(dots.map(|point| Circle::new(pair(point), radius, colour(placed).filled()))).map(drop).map_err(told)
}

/// A sample and the name of every entry, from `corner` downwards.
fn legend(root: &Area<'_>, layout: &Layout<'_>, corner: (i32, i32)) -> Result<(), String> {
    for (row, placed) in layout.entries().into_iter().enumerate() {
        let y = corner.1 + units(LEGEND_LINE) * row as i32 + units(LEGEND_LINE) / 2;
        let (start, end) = (corner.0, corner.0 + units(LEGEND_SAMPLE));
        let style = line_style(placed);
        match placed.series.mark {
            Mark::Dots => Ok(()),
            Mark::Dashed => {
                let dash = |from: u32| {
                    let from = start + units(from);
                    PathElement::new(vec![(from, y), ((from + units(7)).min(end), y)], style)
                };
                [0, 11, 21].into_iter().try_for_each(|from| root.draw(&dash(from)))
            }
            _ => root.draw(&PathElement::new(vec![(start, y), (end, y)], style)),
        }
        .map_err(told)?;
        if let Some(radius) = dot_radius(placed.series.mark) {
            let centre = (i32::midpoint(start, end), y);
            root.draw(&Circle::new(centre, radius, colour(placed).filled())).map_err(told)?;
        }
        let name = placed.series.name.clone();
        let place = (end + units(8), y);
        root.draw(&Text::new(name, place, text(13))).map_err(told)?;
    }
    Ok(())
}

fn colour(placed: &Placed<'_>) -> RGBColor {
    match (placed.colour, placed.series.mark) {
        (Some(index), _) => PALETTE[index % PALETTE.len()],
        (None, Mark::Dashed) => GREY,
        (None, Mark::Dots) => PALE,
        (None, Mark::Line | Mark::Track | Mark::Truth) => INK,
    }
}

fn line_style(placed: &Placed<'_>) -> ShapeStyle {
    let quarters = match placed.series.mark {
        Mark::Line => 7,
        Mark::Track => 6,
        Mark::Truth | Mark::Dashed | Mark::Dots => 5,
    };
    colour(placed).stroke_width(quarters * FINE / 4)
}

/// The size of the points of a mark, `None` for a mere line.
fn dot_radius(mark: Mark) -> Option<u32> {
    match mark {
        Mark::Dots => Some(3 * FINE / 2),
        Mark::Track => Some(9 * FINE / 4),
        Mark::Line | Mark::Truth | Mark::Dashed => None,
    }
}

/// Text of a height in pixels; the backend takes a font size 1.24 times the one it writes.
fn text(pixels: u32) -> TextStyle<'static> {
    let size = f64::from(pixels * FINE) * 1.24;
    let style = TextStyle::from((FONT, size).into_font());
    style.color(&INK).pos(Pos::new(HPos::Left, VPos::Center))
}

fn units(pixels: u32) -> i32 {
    (pixels * FINE) as i32
}

fn told(error: impl Display) -> String {
    error.to_string()
}
