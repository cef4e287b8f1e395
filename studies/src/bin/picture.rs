//! Draws `docs/clustering.svg`: the paper's clustering run at eight moments, spheres coloured by temperature.
//!
//! `cargo run --release -p agglo-studies --bin picture`, from the repository's root.

use agglo_core::observer::ObserverError;
use agglo_core::state::State;
use agglo_core::{Flow, Observer, Scene, SetupError, Simulation, StepReport};
use std::fmt::Write as _;

const FRAMES: usize = 8;
const COLUMNS: usize = 4;
/// Edge of a frame, in pixels and in metres.
const FRAME: f64 = 240.0;
const WIDTH: f64 = 1.7;
/// Temperatures at the ends of the colour scale [K]; the paper's Figure 5 has the lower end.
const COLD: f64 = 300.0;
const HOT: f64 = 1500.0;
/// A scale from dark blue over orange to pale yellow, told apart in grey and by the colour-blind.
const PALETTE: [[f64; 3]; 5] =
    [[40.0, 60.0, 140.0], [110.0, 60.0, 150.0], [200.0, 70.0, 110.0], [245.0, 130.0, 50.0], [252.0, 220.0, 120.0]];
/// Steps of the colour scale, one gradient each.
const SHADES: usize = 24;

/// Keeps the states at evenly spaced moments.
struct Moments {
    every: f64,
    states: Vec<(f64, State)>,
}

impl Observer for Moments {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        if report.time >= self.every * self.states.len() as f64 * (1.0 - 1e-9) {
            self.states.push((report.time, report.state.clone()));
        }
        Ok(Flow::Continue)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string("scenes/clustering.json")?;
    let scene = Scene::parse(&text, &[]).map_err(|problems| SetupError { problems })?;
    let mut simulation = Simulation::new(&scene)?;
    let mut moments = Moments { every: scene.duration / (FRAMES - 1) as f64, states: Vec::new() };
    simulation.run(&mut moments)?;
    std::fs::write("docs/clustering.svg", draw(&moments.states, &simulation.particles().radius))?;
    Ok(())
}

fn draw(states: &[(f64, State)], radius: &[f64]) -> String {
    let rows = FRAMES.div_ceil(COLUMNS);
    let (width, height) = (FRAME * COLUMNS as f64, FRAME * rows as f64 + 44.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n<defs>\n"
    );
    for shade in 0..SHADES {
        let base = colour(shade as f64 / (SHADES - 1) as f64);
        let (light, dark) = (mix(base, 255.0, 0.65), mix(base, 0.0, 0.35));
        let _ = writeln!(
            svg,
            "<radialGradient id=\"c{shade}\" cx=\".36\" cy=\".32\" r=\".75\"><stop stop-color=\"{}\"/><stop offset=\".5\" \
             stop-color=\"{}\"/><stop offset=\"1\" stop-color=\"{}\"/></radialGradient>",
            hex(light),
            hex(base),
            hex(dark)
        );
    }
    svg.push_str("</defs>\n");
    for (k, (time, state)) in states.iter().take(FRAMES).enumerate() {
        let (x, y) = ((k % COLUMNS) as f64 * FRAME, (k / COLUMNS) as f64 * FRAME);
        frame(&mut svg, (x, y), *time, state, radius);
    }
    scale(&mut svg, width, FRAME * rows as f64);
    svg.push_str("</svg>\n");
    svg
}

/// One moment, seen along y, centred on the cloud.
fn frame(svg: &mut String, (x, y): (f64, f64), time: f64, state: &State, radius: &[f64]) {
    let n = radius.len();
    let middle = |column: &[f64]| column.iter().sum::<f64>() / n as f64;
    let centre = [middle(&state.position.x), middle(&state.position.z)];
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| state.position.y[b].total_cmp(&state.position.y[a]));
    let _ = writeln!(
        svg,
        "<svg x=\"{x}\" y=\"{y}\" width=\"{FRAME}\" height=\"{FRAME}\"><rect x=\"3\" y=\"3\" width=\"{0}\" \
         height=\"{0}\" fill=\"#f4f4f6\" stroke=\"#d8d8de\"/>",
        FRAME - 6.0
    );
    for i in order {
        let to_pixels = |r: f64, centre: f64| FRAME * (0.5 + (r - centre) / WIDTH);
        let (cx, cy) = (to_pixels(state.position.x[i], centre[0]), to_pixels(-state.position.z[i], -centre[1]));
        let theta = state.temperature.as_ref().map_or(COLD, |theta| theta[i]);
        let share = ((theta - COLD) / (HOT - COLD)).clamp(0.0, 1.0);
        let shade = (share * (SHADES - 1) as f64).round() as usize;
        let _ = writeln!(
            svg,
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{:.1}\" fill=\"url(#c{shade})\"/>",
            FRAME * radius[i] / WIDTH
        );
    }
    let _ = writeln!(svg, "<text x=\"12\" y=\"22\">t = {time:.2} s</text></svg>");
}

/// The colour bar.
fn scale(svg: &mut String, width: f64, top: f64) {
    let (left, length) = (0.5 * width - 160.0, 320.0);
    for shade in 0..SHADES {
        let step = length / SHADES as f64;
        let _ = writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"12\" fill=\"{}\"/>",
            left + step * shade as f64,
            top + 10.0,
            step + 0.5,
            hex(colour(shade as f64 / (SHADES - 1) as f64))
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.0}\" y=\"{1:.0}\" text-anchor=\"end\">{COLD} K</text><text x=\"{2:.0}\" y=\"{1:.0}\">{HOT} K and \
         more</text>",
        left - 8.0,
        top + 21.0,
        left + length + 8.0
    );
}

/// Colour at a place between 0 and 1 on the scale.
fn colour(at: f64) -> [f64; 3] {
    let place = at * (PALETTE.len() - 1) as f64;
    let k = (place as usize).min(PALETTE.len() - 2);
    let share = place - k as f64;
    std::array::from_fn(|c| PALETTE[k][c] + share * (PALETTE[k + 1][c] - PALETTE[k][c]))
}

fn mix(colour: [f64; 3], with: f64, share: f64) -> [f64; 3] {
    colour.map(|c| c + share * (with - c))
}

fn hex(colour: [f64; 3]) -> String {
    let [r, g, b] = colour.map(|c| c.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
