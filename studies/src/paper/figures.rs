//! The curves of the paper's Figures 6-9 as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::curves::{Curves, DURATION, Quantity, times};
use super::plan::{Binding, KAPPAS, Results};
use crate::Failure;

/// Okabe and Ito's palette, told apart with any colour vision; one colour per kappa.
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(230, 159, 0), RGBColor(0, 158, 115), RGBColor(213, 94, 0)];
/// Size in drawing units: the SVG back end rounds to whole ones, so they must be small against the lines.
const SIZE: (u32, u32) = (2400, 1040);
/// Drawing units per pixel of the picture's own size.
const SCALE: u32 = 2;
const FONT: (&str, i32) = ("sans-serif", 44);
/// Height of the legend [drawing units].
const LEGEND: u32 = 90;
const THICK: u32 = 5;
const THIN: u32 = 2;

/// The paper's figures: number, what is plotted, which runs.
pub const FIGURES: [(u32, Quantity, Binding); 4] = [
    (6, Quantity::Kinetic, Binding::Free),
    (7, Quantity::Kinetic, Binding::Bound),
    (8, Quantity::Temperature, Binding::Free),
    (9, Quantity::Temperature, Binding::Bound),
];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// One figure, two panels, a colour per kappa.
///
/// # Errors
/// A drawing that fails.
pub fn draw(quantity: Quantity, binding: Binding, results: &Results) -> Result<String, Failure> {
    let panels = match quantity {
        Quantity::Kinetic => kinetic(binding, results),
        Quantity::Temperature => temperature(binding, results),
    };
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let (strip, below) = area.split_vertically(LEGEND);
        legend(&strip)?;
        for (panel, half) in panels.iter().zip(below.split_evenly((1, 2))) {
            panel.draw(&half)?;
        }
        area.present()?;
    }
    let (width, height) = SIZE;
    let own = format!("width=\"{width}\" height=\"{height}\"");
    let scaled = format!("width=\"{}\" height=\"{}\"", width / SCALE, height / SCALE);
    Ok(format!("{}\n", svg.replacen(&own, &scaled, 1).trim_end()))
}

/// Left: the first seed over the range of all runs. Right: what kappa changes, for every seed. Both figures of the
/// kinetic energy have the same scales.
fn kinetic(binding: Binding, results: &Results) -> [Panel; 2] {
    let curves = Curves::new(Quantity::Kinetic, binding, results);
    let deviations = curves.deviations();
    let both = [Binding::Free, Binding::Bound].map(|binding| Curves::new(Quantity::Kinetic, binding, results));
    // An axis must have some length, even where the curves do not differ.
    let (mut low, mut high, mut widest) = (f64::INFINITY, 0.0_f64, 1e-3_f64);
    for curves in &both {
        let (lowest, highest) = curves.range();
        let (below, above) = curves.deviations().range();
        (low, high, widest) = (low.min(lowest), high.max(highest), widest.max(-below).max(above));
    }
    let left = Panel {
        caption: "seed 1; grey: all seeds".to_owned(),
        axis: "kinetic energy / mass [J/kg]",
        decimals: 1,
        range: ((10.0 * low).floor() / 10.0, (10.0 * high).ceil() / 10.0),
        bands: vec![(curves.band(), BLACK.mix(0.1))],
        lines: curves.first().into_iter().map(|line| vec![line]).collect(),
        width: THICK,
    };
    let right = Panel {
        caption: "difference from the mean over κ, all seeds".to_owned(),
        axis: "difference [J/kg]",
        decimals: 2,
        range: (-1.05 * widest, 1.05 * widest),
        bands: Vec::new(),
        lines: deviations.by_kappa,
        width: THIN,
    };
    [left, right]
}

/// Left: the first seed. Right: mean and range over seeds.
fn temperature(binding: Binding, results: &Results) -> [Panel; 2] {
    let curves = Curves::new(Quantity::Temperature, binding, results);
    let (low, high) = curves.range();
    let left = Panel {
        caption: "seed 1".to_owned(),
        axis: "mean temperature [K]",
        decimals: 0,
        range: (low, low + 1.05 * (high - low).max(1.0)),
        bands: Vec::new(),
        lines: curves.first().into_iter().map(|line| vec![line]).collect(),
        width: THICK,
    };
    let right = Panel {
        caption: format!("mean and range of {} seeds", results.seeds().tables),
        bands: curves.bands().into_iter().zip(COLOURS).map(|(band, colour)| (band, colour.mix(0.15))).collect(),
        lines: curves.means().into_iter().map(|line| vec![line]).collect(),
        ..left.clone()
    };
    [left, right]
}

/// One line per kappa above both panels.
fn legend(area: &Area<'_>) -> Drawn {
    let text = TextStyle::from(FONT).pos(Pos::new(HPos::Left, VPos::Center));
    let (width, middle) = (SIZE.0 as i32 / KAPPAS.len() as i32, LEGEND as i32 / 2 + 8);
    for ((k, kappa), colour) in (0..).zip(KAPPAS).zip(COLOURS) {
        let x = 170 + k * (width - 40);
        area.draw(&PathElement::new([(x, middle), (x + 80, middle)], colour.stroke_width(2 * THICK)))?;
        area.draw(&Text::new(format!("κ = {kappa}·10⁶ J/m²"), (x + 100, middle), text.clone()))?;
    }
    Ok(())
}

/// Axes with bands and lines.
#[derive(Clone)]
struct Panel {
    caption: String,
    axis: &'static str,
    decimals: usize,
    range: (f64, f64),
    bands: Vec<(Vec<(f64, f64)>, RGBAColor)>,
    /// By kappa, then by seed; values at the times of all curves.
    lines: Vec<Vec<Vec<f64>>>,
    width: u32,
}

impl Panel {
    fn draw(&self, area: &Area<'_>) -> Drawn {
        let decimals = self.decimals;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.caption, FONT)
            .margin(30)
            .x_label_area_size(115)
            .y_label_area_size(170)
            .build_cartesian_2d(0.0..DURATION, self.range.0..self.range.1)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12).stroke_width(2))
            .axis_style(BLACK.stroke_width(3))
            .x_desc("time [s]")
            .y_desc(self.axis)
            .x_labels(6)
            .y_labels(8)
            .x_label_formatter(&|t| format!("{t:.0}"))
            .y_label_formatter(&|value| format!("{value:.decimals$}"))
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        let times = times();
        for (band, colour) in &self.bands {
            let lower = times.iter().zip(band).map(|(&t, &(low, _))| (t, low));
            let upper = times.iter().zip(band).map(|(&t, &(_, high))| (t, high));
            let outline: Vec<(f64, f64)> = lower.chain(upper.rev()).collect();
            chart.draw_series([Polygon::new(outline, *colour)])?;
        }
        for (lines, colour) in self.lines.iter().zip(COLOURS) {
            for line in lines {
                let points = times.iter().copied().zip(line.iter().copied());
                chart.draw_series(LineSeries::new(points, colour.stroke_width(self.width)))?;
            }
        }
        Ok(())
    }
}
