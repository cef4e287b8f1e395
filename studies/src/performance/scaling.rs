//! Cost of a particle-step against the number of particles, as a diagram.

use plotters::prelude::*;

use crate::Failure;

/// Size in drawing units, two per pixel: the SVG back end rounds to whole ones.
const SIZE: (u32, u32) = (1200, 800);
const FONT: (&str, i32) = ("sans-serif", 28);

/// Nanoseconds per particle-step (medians) at numbers of particles, as SVG.
pub fn svg(points: &[(f64, f64)]) -> Result<String, Failure> {
    let most = points.iter().map(|point| point.1).fold(0.0, f64::max);
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Err("no sizes to draw".into()) };
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(20)
            .margin_right(60)
            .x_label_area_size(80)
            .y_label_area_size(120)
            .build_cartesian_2d((0.7 * first.0..1.4 * last.0).log_scale(), 0.0..1.2 * most)?;
        chart
            .configure_mesh()
            .light_line_style(RGBColor(235, 235, 235))
            .x_desc("particles")
            .y_desc("ns per particle-step")
            .x_label_formatter(&|x| format!("{x:.0e}"))
            .y_label_formatter(&|y| format!("{y:.0}"))
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        let colour = RGBColor(0, 114, 178);
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(4)))?;
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 8, colour.filled())))?;
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
