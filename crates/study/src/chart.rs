//! The diagram of a study: wall time against the error of the positions, on logarithmic axes.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::fit::schemes;
use crate::measure::Measurement;
use crate::study::Study;

/// Okabe and Ito's colours, told apart with any colour vision.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(213, 94, 0),
    RGBColor(230, 159, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
];
/// Size in drawing units, two per pixel: the SVG back end rounds to whole ones.
const SIZE: (u32, u32) = (1600, 1100);
const FONT: (&str, i32) = ("sans-serif", 28);

/// A drawing that failed.
pub type DrawError = DrawingAreaErrorKind<std::io::Error>;

/// A curve from elsewhere, such as another program's: name and pairs of error [mean diameters] and wall time [s].
pub type Peer = (String, Vec<(f64, f64)>);

/// Wall time [s] against the error of the positions [mean diameters]: a curve per scheme and way of choosing the step,
/// solid with tolerances and dashed (open circles) with fixed steps; peers with crosses.
///
/// # Errors
/// A drawing that fails.
pub fn svg(study: &Study, peers: &[Peer]) -> Result<String, DrawError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area, study, peers)?;
        area.present()?;
    }
    let (width, height) = SIZE;
    // Drawn large, shown at half the size.
    Ok(text.replacen(
        &format!("width=\"{width}\" height=\"{height}\""),
        &format!("width=\"{}\" height=\"{}\"", width / 2, height / 2),
        1,
    ))
}

fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, study: &Study, peers: &[Peer]) -> Result<(), DrawError> {
    let shown = |m: &&Measurement| m.errors.position.is_finite() && m.errors.position > 0.0;
    let own = study.measurements.iter().filter(shown).map(|m| (m.errors.position, m.wall_seconds));
    let all: Vec<(f64, f64)> = own.chain(peers.iter().flat_map(|peer| peer.1.iter().copied())).collect();
    let range = |f: &dyn Fn(&(f64, f64)) -> f64| {
        let (low, high) = all.iter().map(f).fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        if low < high { 0.5 * low..2.0 * high } else { 1e-16..1.0 }
    };
    let (errors, walls) = (range(&|p| p.0), range(&|p| p.1));
    let mut chart = ChartBuilder::on(area)
        .margin(20)
        .margin_right(40)
        .x_label_area_size(80)
        .y_label_area_size(120)
        .build_cartesian_2d(errors.log_scale(), walls.log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(235, 235, 235))
        .x_desc("error of the positions, root mean square / mean diameter")
        .y_desc("wall time [s]")
        .x_label_formatter(&|x| format!("{x:.0e}"))
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .label_style(FONT)
        .axis_desc_style(FONT)
        .draw()?;
    for (name, colour) in schemes(&study.measurements).into_iter().zip(COLOURS.iter().cycle()) {
        for fixed in [true, false] {
            let points: Vec<(f64, f64)> = (study.measurements.iter().filter(shown))
                .filter(|m| m.scheme == name && m.step.is_some() == fixed)
                .map(|m| (m.errors.position, m.wall_seconds))
                .collect();
            if points.is_empty() {
                continue;
            }
            let (width, label) = if fixed { (2, format!("{name}, fixed steps")) } else { (4, name.to_owned()) };
            let style = colour.stroke_width(width);
            let dots = points.clone();
            let series = if fixed {
                chart.draw_series(DashedLineSeries::new(points, 12, 8, style))?
            } else {
                chart.draw_series(LineSeries::new(points, style))?
            };
            let colour = *colour;
            series
                .label(label)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 40, y)], colour.stroke_width(width)));
            let filled = if fixed { colour.stroke_width(2) } else { colour.filled() };
            chart.draw_series(dots.into_iter().map(|point| Circle::new(point, 6, filled)))?;
        }
    }
    for ((name, points), colour) in peers.iter().zip(COLOURS.iter().rev().cycle()) {
        let colour = *colour;
        chart
            .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
            .label(name.clone())
            .legend(move |(x, y)| Cross::new((x + 20, y), 8, colour.stroke_width(3)));
        chart.draw_series(points.iter().map(|&point| Cross::new(point, 8, colour.stroke_width(3))))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(FONT)
        .legend_area_size(60)
        .draw()
}
