//! What the colours mean: a bar with round numbers, or a line on clusters.

use crate::canvas::{Canvas, Rect, Rgb};
use crate::colors::{self, Scale};
use crate::options::Quantity;
use crate::quantity::{Unit, label, ticks};
use crate::sheet::Theme;
use crate::text::{Anchor, Text};

/// Whether a quantity has a legend.
pub fn has(quantity: Quantity) -> bool {
    quantity != Quantity::None
}

/// A scale and what there is to say of it.
#[derive(Clone, Copy, Debug)]
pub struct Bar<'a> {
    /// The scale.
    pub scale: &'a Scale,
    /// Whether values lie below and above it.
    pub beyond: [bool; 2],
    /// Colours that the bar is made of; `None`: one for every column of pixels.
    pub steps: Option<u32>,
}

impl Bar<'_> {
    /// The colour at a share of the bar's length.
    fn color(&self, share: f64) -> Rgb {
        let share = self.steps.map_or(share, |steps| {
            let last = f64::from(steps.max(2) - 1);
            libm::round(share * last) / last
        });
        self.scale.at(share)
    }
}

/// Draws the legend of a scale into a strip.
pub fn bar(canvas: &mut Canvas, strip: Rect, em: f32, (text, theme): (&Text, &Theme), bar: Bar<'_>) {
    let (scale, beyond) = (bar.scale, bar.beyond);
    let (name, symbol) = match scale.quantity {
        Quantity::Temperature => ("temperature", "K"),
        Quantity::Speed => ("speed", "m/s"),
        _ => ("charge", "C"),
    };
    let unit = Unit::new(symbol, scale.low.abs().max(scale.high.abs()));
    let name = format!("{name} [{}]", unit.name);
    let named = text.width(&name, em) + em;
    let length = (22.0 * em).min(strip.width as f32 - named - 4.0 * em).max(2.0 * em);
    // The bar with its name, in the middle.
    let left = (strip.x as f32 + 0.5 * (strip.width as f32 - length - named) + named).round();
    let (top, height) = (strip.y as f32 + 0.85 * em, (0.85 * em).round());
    let length = length.round();
    text.draw(canvas, [left - 0.9 * em, top + 0.72 * em], Anchor::Right, &name, (em, theme.ink));
    for k in 0..length as usize {
        let color = bar.color((k as f64 + 0.5) / f64::from(length));
        canvas.fill(Rect { x: left as usize + k, y: top as usize, width: 1, height: height as usize }, color);
    }
    for (k, is_beyond) in beyond.into_iter().enumerate() {
        if is_beyond {
            let (x, way) = if k == 0 { (left, -1.0) } else { (left + length, 1.0) };
            arrow(canvas, [x, top.floor()], [way, height], scale.at(k as f64));
        }
    }
    let (mut values, decimals) =
        ticks(scale.low * unit.factor, scale.high * unit.factor, (length / (3.2 * em)).clamp(1.0, 6.0) as usize);
    let width = (0.07 * em).max(1.0);
    // An end without a tick near it is named as well, where it is as round as they are.
    let room = |value: f64, other: f64| {
        let width = |value: f64| text.width(&label(value, decimals), 0.85 * em);
        let apart = (value - other).abs() / (unit.factor * (scale.high - scale.low)) * f64::from(length);
        apart as f32 > 0.5 * (width(value) + width(other)) + 0.4 * em
    };
    for end in [scale.low * unit.factor, scale.high * unit.factor] {
        let round =
            (end - label(end, decimals).replace('−', "-").parse().unwrap_or(f64::NAN)).abs() <= 1e-9 * end.abs();
        if round && values.iter().all(|&value| room(value, end)) {
            values.push(end);
        }
    }
    for value in values {
        let share = (value / unit.factor - scale.low) / (scale.high - scale.low);
        let x = left + length * share.clamp(0.0, 1.0) as f32;
        let bottom = top.floor() + height;
        canvas.line([x, bottom], [x, bottom + 0.25 * em], width, theme.pale);
        text.draw(canvas, [x, bottom + 1.15 * em], Anchor::Middle, &label(value, decimals), (0.85 * em, theme.pale));
    }
}

/// A triangle at an end of the bar: there is more beyond it.
fn arrow(canvas: &mut Canvas, [x, top]: [f32; 2], [way, height]: [f32; 2], color: Rgb) {
    let length = 0.6 * height;
    for column in 0..length.ceil() as i64 {
        let half = 0.5 * height * (1.0 - (column as f32 + 0.5) / length).max(0.0);
        let at = if way > 0.0 { x as i64 + column } else { x as i64 - 1 - column };
        for row in 0..height as i64 {
            let inside = half + 0.5 - (row as f32 + 0.5 - 0.5 * height).abs();
            canvas.blend(at, top as i64 + row, color, inside.clamp(0.0, 1.0));
        }
    }
}

/// Draws what the colours of clusters mean.
pub fn clusters(canvas: &mut Canvas, strip: Rect, em: f32, (text, theme): (&Text, &Theme)) {
    let (first, second) = ("clusters", "single particles");
    let (step, gap) = (1.0 * em, 1.6 * em);
    let shown = 5;
    let width = shown as f32 * step + text.width(first, em) + gap + 1.4 * em + text.width(second, em) + 0.8 * em;
    let y = strip.y as f32 + 1.3 * em;
    let mut x = strip.x as f32 + 0.5 * (strip.width as f32 - width).max(0.0) + 0.5 * em;
    for place in 0..shown {
        canvas.disc([x, y], 0.42 * em, colors::cluster(place));
        x += step;
    }
    text.draw(canvas, [x, y + 0.34 * em], Anchor::Left, first, (em, theme.ink));
    x += text.width(first, em) + gap;
    canvas.disc([x, y], 0.42 * em, colors::SINGLE);
    text.draw(canvas, [x + step, y + 0.34 * em], Anchor::Left, second, (em, theme.ink));
}
