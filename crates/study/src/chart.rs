//! The diagram of a study: wall time against the error of the positions, on logarithmic axes.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::fit::schemes;
use crate::measure::Measurement;
use crate::study::Study;

/// Okabe and Ito's colours, told apart with any colour vision, and two more.
const COLOURS: [RGBColor; 9] = [
    RGBColor(0, 0, 0),
    RGBColor(213, 94, 0),
    RGBColor(230, 159, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(160, 160, 60),
    RGBColor(100, 140, 120),
];
/// Colours of other programs.
const PEERS: [RGBColor; 3] = [RGBColor(120, 60, 20), RGBColor(110, 110, 110), RGBColor(70, 50, 140)];
/// Size in drawing units, two per pixel: the SVG back end rounds to whole ones.
const SIZE: (u32, u32) = (1900, 1000);
/// Width of the strip with the names.
const NAMES: u32 = 460;
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
        let (plot, names) = area.split_horizontally(SIZE.0 - NAMES);
        draw(&plot, study, peers)?;
        legend(&names, study, peers)?;
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
            let style = colour.stroke_width(if fixed { 2 } else { 4 });
            let dots = points.clone();
            if fixed {
                chart.draw_series(DashedLineSeries::new(points, 12, 8, style))?;
            } else {
                chart.draw_series(LineSeries::new(points, style))?;
            }
            let filled = if fixed { colour.stroke_width(2) } else { colour.filled() };
            chart.draw_series(dots.into_iter().map(|point| Circle::new(point, 6, filled)))?;
        }
    }
    for ((_, points), colour) in peers.iter().zip(PEERS.iter().cycle()) {
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        chart.draw_series(points.iter().map(|&point| Cross::new(point, 8, colour.stroke_width(3))))?;
    }
    Ok(())
}

/// The names, one below another, beside the plot.
fn legend(area: &DrawingArea<SVGBackend<'_>, Shift>, study: &Study, peers: &[Peer]) -> Result<(), DrawError> {
    let mut y = 60;
    let text = |name: &str, y: i32| Text::new(name.to_owned(), (70, y - 14), FONT.into_font());
    for (name, colour) in schemes(&study.measurements).into_iter().zip(COLOURS.iter().cycle()) {
        area.draw(&PathElement::new(vec![(0, y), (56, y)], colour.stroke_width(4)))?;
        area.draw(&text(name, y))?;
        y += 44;
    }
    for ((name, _), colour) in peers.iter().zip(PEERS.iter().cycle()) {
        area.draw(&Cross::new((28, y), 8, colour.stroke_width(3)))?;
        area.draw(&text(name, y))?;
        y += 44;
    }
    for line in ["dashed, open: fixed steps", "solid, full: by tolerance"] {
        area.draw(&Text::new(line, (0, y), FONT.into_font()))?;
        y += 44;
    }
    Ok(())
}
