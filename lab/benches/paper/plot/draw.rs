//! The layout of a plot: axes and grid on the left, the legend below.

use plotters::{
    chart::ChartBuilder,
    coord::Shift,
    drawing::{DrawingArea, DrawingAreaErrorKind},
    element::{Circle, PathElement, Text},
    prelude::DrawingBackend,
    series::{DashedLineSeries, LineSeries},
    style::{
        Color, FontStyle, HSLColor, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE,
        register_font,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::{Line, LinePlot};

const WIDTH: u32 = 720;
const CHART_HEIGHT: u32 = 560;
const LEGEND_LINE: u32 = 20;
const LEGEND_MARGIN: u32 = 14;
const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(40, 44, 52);
const GRID: RGBColor = RGBColor(225, 228, 232);

/// Distinguishable with color blindness (Okabe and Ito, Color Universal Design, 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(20, 20, 20),
];

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Width and height.
pub(super) fn size(plot: &LinePlot) -> (u32, u32) {
    let lines = u32::try_from(plot.lines.len()).unwrap_or(u32::MAX);
    (WIDTH, CHART_HEIGHT + LEGEND_LINE * lines + LEGEND_MARGIN)
}

/// Draws the plot, `scale` times as large.
pub(super) fn draw<DB: DrawingBackend>(
    plot: &LinePlot,
    area: &DrawingArea<DB, Shift>,
    scale: u32,
) -> Drawn<DB> {
    // It fails only for an invalid font, which would also fail when text is drawn.
    let _ = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let text = |height: u32| TextStyle::from((FONT, height * scale).into_font()).color(&INK);
    area.fill(&WHITE)?;
    let (chart_area, legend) = area.split_vertically(CHART_HEIGHT * scale);
    let mut chart = ChartBuilder::on(&chart_area)
        .margin(14 * scale)
        .caption(&plot.title, text(20))
        .x_label_area_size(44 * scale)
        .y_label_area_size(56 * scale)
        .build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
    chart
        .configure_mesh()
        .x_labels(11)
        .y_labels(11)
        .max_light_lines(0)
        .bold_line_style(GRID.stroke_width(scale))
        .axis_style(INK.stroke_width(scale))
        .label_style(text(14))
        .axis_desc_style(text(16))
        .x_desc(&plot.x_name)
        .y_desc(&plot.y_name)
        .x_label_formatter(&|value| format!("{value:.1}"))
        .y_label_formatter(&|value| format!("{value:.1}"))
        .draw()?;
    for (index, line) in plot.lines.iter().enumerate() {
        let style = style(index, plot.lines.len(), scale);
        let points = |points: &[[f64; 2]]| points.iter().map(|[x, y]| (*x, *y)).collect::<Vec<_>>();
        let (dash, gap) = (6 * scale, 4 * scale);
        chart.draw_series(DashedLineSeries::new(
            points(&line.dashed),
            dash,
            gap,
            style,
        ))?;
        chart.draw_series(LineSeries::new(points(&line.points), style))?;
        if line.marked {
            let mark = |at| Circle::new(at, 3 * scale, style.filled());
            chart.draw_series(points(&line.points).into_iter().map(mark))?;
        }
        name(&legend, index, line, style, &text(15), scale)?;
    }
    area.present()
}

/// One line of the legend.
fn name<DB: DrawingBackend>(
    legend: &DrawingArea<DB, Shift>,
    index: usize,
    line: &Line,
    style: ShapeStyle,
    text: &TextStyle<'_>,
    scale: u32,
) -> Drawn<DB> {
    let scaled = |units: u32| i32::try_from(units * scale).unwrap_or(i32::MAX);
    let row = u32::try_from(index).unwrap_or(u32::MAX) * LEGEND_LINE;
    let middle = scaled(row + LEGEND_LINE / 2);
    legend.draw(&PathElement::new(
        vec![(scaled(70), middle), (scaled(100), middle)],
        style,
    ))?;
    let text = text.pos(Pos::new(HPos::Left, VPos::Center));
    let at = (scaled(110), middle);
    legend.draw(&Text::new(line.name.as_str(), at, text))
}

/// The style of a line among `count`.
fn style(index: usize, count: usize, scale: u32) -> ShapeStyle {
    let width = 2 * scale;
    if count <= COLORS.len() {
        return COLORS[index].stroke_width(width);
    }
    let hue = index as f64 / count as f64;
    let lightness = if index.is_multiple_of(2) { 0.35 } else { 0.55 };
    HSLColor(hue, 0.8, lightness).stroke_width(width)
}
