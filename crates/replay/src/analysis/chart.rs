//! Charts of an analysis as SVG: no fonts, no bitmaps, nothing that a viewer would have to fetch.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::series::Series;
use super::{Analysis, Curves};
use crate::text::line;

/// Okabe and Ito's blue, orange and green, told apart with any colour vision.
const COLOURS: [RGBColor; 3] = [RGBColor(0, 114, 178), RGBColor(230, 159, 0), RGBColor(0, 158, 115)];
/// Their vermillion, for what went wrong.
const ALARM: RGBColor = RGBColor(213, 94, 0);
/// Width of a picture and height of a panel in drawing units: the SVG back end rounds to whole ones, so they must be small
/// against the lines.
const PANEL: (u32, u32) = (2000, 560);
/// Height of the title above all panels [drawing units].
const TITLE: u32 = 80;
/// Drawing units per pixel of the picture's own size.
const SCALE: u32 = 2;
const FONT: (&str, i32) = ("sans-serif", 30);
/// Values from the least to the greatest of which it is more than this factor are drawn on a logarithmic axis [-].
const WIDE: f64 = 30.0;

/// A drawing that failed.
pub type DrawError = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A curve of a panel.
struct Curve<'a> {
    name: &'static str,
    series: &'a Series,
    colour: RGBColor,
    dots: bool,
}

/// A panel: curves over time with one axis.
struct Panel<'a> {
    name: &'static str,
    unit: &'static str,
    /// Whether the axis begins at zero.
    from_zero: bool,
    /// Whether a logarithmic axis is wanted where values differ much.
    may_be_logarithmic: bool,
    curves: Vec<Curve<'a>>,
}

/// Kinetic energy, temperature, clusters, step size and iterations over time, those that the log has, below one another.
///
/// # Errors
/// A drawing that fails.
pub fn overview(analysis: &Analysis) -> Result<String, DrawError> {
    let name =
        if analysis.run.scene_name.is_empty() { "a scene without a name" } else { &line(&analysis.run.scene_name) };
    // A name may be of any length; the picture is not.
    let name: String = name.chars().filter(|c| !c.is_control()).take(90).collect();
    draw(Some(&name), &panels(&analysis.curves))
}

/// The same panels with the energy that nothing explains, each as a picture of its own: name and SVG.
///
/// # Errors
/// A drawing that fails.
pub fn pictures(analysis: &Analysis) -> Result<Vec<(&'static str, String)>, DrawError> {
    let mut panels = panels(&analysis.curves);
    let residual = [("energy unexplained", &analysis.curves.residual)];
    panels.insert(panels.len().min(1), panel("energy unexplained", "J", false, &residual));
    panels.retain(Panel::has_points);
    panels.iter().map(|panel| Ok((panel.name, draw(None, std::slice::from_ref(panel))?))).collect()
}

fn panel<'a>(
    name: &'static str,
    unit: &'static str,
    from_zero: bool,
    curves: &[(&'static str, &'a Series)],
) -> Panel<'a> {
    let curves = curves.iter().zip(COLOURS);
    let curves = curves.map(|(&(name, series), colour)| Curve { name, series, colour, dots: false }).collect();
    Panel { name, unit, from_zero, may_be_logarithmic: false, curves }
}

fn panels(curves: &Curves) -> Vec<Panel<'_>> {
    let temperatures = [("mean", &curves.mean_temperature), ("highest", &curves.max_temperature)];
    let clusters =
        [("clusters", &curves.clusters), ("size of the largest", &curves.largest), ("alone", &curves.singletons)];
    let mut steps = panel("step size", "s", true, &[("step size", &curves.step_size)]);
    steps.may_be_logarithmic = true;
    let mut iterations = panel("iterations", "", true, &[("of a step", &curves.iterations)]);
    iterations.curves.push(Curve { name: "rejected attempts", series: &curves.rejected, colour: ALARM, dots: true });
    let mut panels = vec![
        panel("kinetic energy", "J", true, &[("kinetic energy", &curves.kinetic)]),
        panel("temperature", "K", false, &temperatures),
        panel("clusters", "", true, &clusters),
        steps,
        iterations,
    ];
    panels.retain(Panel::has_points);
    panels
}

fn draw(title: Option<&str>, panels: &[Panel<'_>]) -> Result<String, DrawError> {
    let above = if title.is_some() { TITLE } else { 0 };
    let (width, height) = (PANEL.0, above + PANEL.1 * panels.len().max(1) as u32);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
        area.fill(&WHITE)?;
        let (strip, below) = area.split_vertically(above);
        if let Some(title) = title {
            let style = TextStyle::from(("sans-serif", 40)).pos(Pos::new(HPos::Left, VPos::Center));
            strip.draw(&Text::new(title, (40, 50), style))?;
        }
        if panels.is_empty() {
            let style = TextStyle::from(FONT).pos(Pos::new(HPos::Left, VPos::Center));
            below.draw(&Text::new("the log holds nothing to draw", (40, 60), style))?;
        }
        for (panel, part) in panels.iter().zip(below.split_evenly((panels.len().max(1), 1))) {
            panel.draw(&part)?;
        }
        area.present()?;
    }
    let own = format!("width=\"{width}\" height=\"{height}\"");
    let scaled = format!("width=\"{}\" height=\"{}\"", width / SCALE, height / SCALE);
    Ok(format!("{}\n", svg.replacen(&own, &scaled, 1).trim_end()))
}

/// How the numbers of an axis are written: over a power of ten, with so many decimals.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    exponent: i32,
    decimals: usize,
}

impl Scale {
    fn of(low: f64, high: f64) -> Self {
        let size = low.abs().max(high.abs());
        let exponent = if size > 0.0 { 3 * (size.log10() / 3.0).floor() as i32 } else { 0 };
        // Hundredths and thousands are read as they are.
        let exponent = if (1e-2..1e5).contains(&size) { 0 } else { exponent };
        let range = (high - low) / 10_f64.powi(exponent);
        let decimals = (1.0 - (range / 2.0).log10()).ceil().clamp(0.0, 12.0) as usize;
        Self { exponent, decimals: if range > 20.0 { 0 } else { decimals } }
    }

    fn label(self, value: f64) -> String {
        let decimals = self.decimals;
        let text = format!("{:.decimals$}", value / 10_f64.powi(self.exponent));
        if text.starts_with('-') && text.trim_start_matches(['-', '0', '.']).is_empty() {
            return text[1..].to_owned();
        }
        text
    }

    /// A name with its unit and the power of ten.
    fn axis(self, name: &str, unit: &str) -> String {
        match (self.exponent, unit) {
            (0, "") => name.to_owned(),
            (0, unit) => format!("{name} [{unit}]"),
            (exponent, unit) => {
                format!("{name} [10{}{}{unit}]", raised(exponent), if unit.is_empty() { "" } else { " " })
            }
        }
    }
}

/// A number in raised digits.
fn raised(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let text = number.to_string();
    text.chars().map(|c| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}

impl Panel<'_> {
    fn has_points(&self) -> bool {
        self.curves.iter().any(|curve| curve.series.points > 0)
    }

    fn bounds(&self, of: impl Fn(&super::series::Span) -> [f64; 2]) -> (f64, f64) {
        let values = self.curves.iter().flat_map(|curve| curve.series.spans()).flat_map(of);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    fn draw(&self, area: &Area<'_>) -> Result<(), DrawError> {
        let (caption, below) = area.split_vertically(60);
        self.caption(&caption)?;
        let times = self.bounds(|span| [span.first.0, span.last.0]);
        let times = if times.1 > times.0 { times } else { widened(times) };
        let (low, high) = self.bounds(|span| [span.low.1, span.high.1]);
        if self.may_be_logarithmic && low > 0.0 && high > WIDE * low {
            let axis = format!("{} [{}]", self.name, self.unit);
            return self.plot(&below, times, (low / 1.3..high * 1.3).log_scale(), &axis, &power);
        }
        let low = if self.from_zero { low.min(0.0) } else { low };
        let (low, high) = if high > low { (low, high + 0.05 * (high - low)) } else { widened((low, high)) };
        let scale = Scale::of(low, high);
        self.plot(&below, times, low..high, &scale.axis(self.name, self.unit), &|value| scale.label(*value))
    }

    /// Name of the panel at the left, names of the curves at the right.
    fn caption(&self, area: &Area<'_>) -> Result<(), DrawError> {
        let style = TextStyle::from(FONT).pos(Pos::new(HPos::Left, VPos::Center));
        let width = self.curves.iter().map(|curve| curve.series.width()).max().unwrap_or(1);
        let thinned = if width > 1 { format!(" (lowest and highest of every {width} points)") } else { String::new() };
        area.draw(&Text::new(format!("{}{thinned}", self.name), (40, 34), style.clone()))?;
        if self.curves.len() < 2 {
            return Ok(());
        }
        let slot = 330;
        for (k, curve) in (0..).zip(&self.curves) {
            let x = PANEL.0 as i32 - 40 - slot * (self.curves.len() as i32 - k);
            if curve.dots {
                area.draw(&Circle::new((x + 25, 34), 8, curve.colour.filled()))?;
            } else {
                area.draw(&PathElement::new([(x, 34), (x + 50, 34)], curve.colour.stroke_width(6)))?;
            }
            area.draw(&Text::new(curve.name, (x + 65, 34), style.clone()))?;
        }
        Ok(())
    }

    fn plot<Y>(
        &self,
        area: &Area<'_>,
        times: (f64, f64),
        values: Y,
        axis: &str,
        label: &dyn Fn(&f64) -> String,
    ) -> Result<(), DrawError>
    where
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let time = Scale::of(times.0, times.1);
        let mut chart = ChartBuilder::on(area)
            .margin_left(20)
            .margin_right(40)
            .margin_bottom(10)
            .margin_top(5)
            .x_label_area_size(80)
            .y_label_area_size(150)
            .build_cartesian_2d(times.0..times.1, values)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12).stroke_width(2))
            .axis_style(BLACK.stroke_width(3))
            .x_desc(time.axis("time", "s"))
            .y_desc(axis)
            .x_labels(10)
            .y_labels(6)
            .x_label_formatter(&|t| time.label(*t))
            .y_label_formatter(label)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        for curve in &self.curves {
            let mut points: Vec<(f64, f64)> = curve.series.line().collect();
            points.dedup();
            if curve.dots || points.len() == 1 {
                chart.draw_series(points.into_iter().map(|at| Circle::new(at, 5, curve.colour.filled())))?;
            } else {
                chart.draw_series(LineSeries::new(points, curve.colour.stroke_width(3)))?;
            }
        }
        Ok(())
    }
}

/// A label of a logarithmic axis.
fn power(value: &f64) -> String {
    let exponent = value.log10().floor();
    let factor = value / 10_f64.powf(exponent);
    if (factor - 1.0).abs() < 1e-6 { format!("10{}", raised(exponent as i32)) } else { format!("{value:.1e}") }
}

/// An axis must have some length, even where all values are the same.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (0.0, 1.0);
    }
    let by = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
    (low - by, high + by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_labelled_in_powers_of_a_thousand() {
        let micro = Scale::of(0.0, 3.2e-5);
        assert_eq!((micro.axis("time", "s").as_str(), micro.label(1.5e-5).as_str()), ("time [10⁻⁶ s]", "15"));
        assert_eq!(
            (Scale::of(0.0, 5.0).axis("time", "s").as_str(), Scale::of(0.0, 5.0).label(2.0).as_str()),
            ("time [s]", "2.0")
        );
        assert_eq!(Scale::of(300.0, 300.004).label(300.002), "300.0020");
        assert_eq!(Scale::of(-1.0, 1.0).label(-1e-9), "0.0");
        assert_eq!(power(&1e-4), "10⁻⁴");
    }

    #[test]
    fn any_curve_can_be_drawn() {
        let (mut none, mut one, mut flat, mut odd) =
            (Series::default(), Series::default(), Series::default(), Series::default());
        none.push(0.0, f64::NAN);
        one.push(1.0, 2.0);
        for k in 0..10 {
            flat.push(0.0, -3.0);
            odd.push(f64::from(k) * 1e-300, f64::from(k).powi(7) * 1e300);
        }
        for series in [&none, &one, &flat, &odd] {
            for log in [false, true] {
                let mut panel = panel("x", "m", false, &[("x", series)]);
                panel.may_be_logarithmic = log;
                let svg = draw(Some("</svg><script>"), &[panel]).expect("drawn");
                assert!(svg.starts_with("<svg") && !svg.contains("<script"), "{svg}");
            }
        }
    }
}
