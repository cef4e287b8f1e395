//! The page: where pictures, title and legend stand, and what is written on it.

use crate::camera::Camera;
use crate::canvas::{Canvas, Rect, Rgb};
use crate::error::RenderError;
use crate::options::{Format, Options};
use crate::quantity::{Unit, decimals, label, round_down};
use crate::text::{Anchor, Text};

/// Longest side of a picture [pixels].
const LONGEST: u32 = 8192;
/// Longest side of an animation, of which two pictures are held [pixels].
const LONGEST_MOVING: u32 = 4096;
/// Shortest side of a picture [pixels].
const SHORTEST: u32 = 64;
/// Shortest side of one of the pictures of a sheet [pixels].
const SMALLEST_CELL: usize = 24;
/// Side of a picture of a sheet, where no size is given [pixels].
const CELL: u32 = 360;

/// The colours of the page.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    /// Around the pictures.
    pub page: Rgb,
    /// Behind the spheres.
    pub ground: Rgb,
    /// Text.
    pub ink: Rgb,
    /// Text beside the matter.
    pub pale: Rgb,
    /// Box and walls.
    pub line: Rgb,
}

impl Theme {
    /// Light or dark.
    pub fn new(dark: bool) -> Self {
        if dark {
            Self {
                page: [0x10, 0x12, 0x16],
                ground: [0x1a, 0x1d, 0x23],
                ink: [0xea, 0xec, 0xf0],
                pale: [0xa0, 0xa7, 0xb2],
                line: [0x6a, 0x72, 0x80],
            }
        } else {
            Self {
                page: [0xff; 3],
                ground: [0xf3, 0xf4, 0xf7],
                ink: [0x1e, 0x22, 0x28],
                pale: [0x5c, 0x64, 0x70],
                line: [0x9a, 0xa2, 0xae],
            }
        }
    }
}

impl Theme {
    /// The colours that a picture of few colours keeps exactly.
    pub fn exact(&self) -> [Rgb; 4] {
        [self.page, self.ground, self.ink, self.pale]
    }
}

/// Where things stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Width and height [pixels].
    pub size: [usize; 2],
    /// Size of text [pixels].
    pub em: f32,
    /// The strip of the title.
    pub title: Option<Rect>,
    /// The pictures, row by row.
    pub cells: Vec<Rect>,
    /// The strip of the legend.
    pub legend: Option<Rect>,
}

impl Layout {
    /// For so many pictures.
    ///
    /// # Errors
    /// A size out of range, and more pictures than fit.
    pub fn new(options: &Options, count: usize, legend: bool) -> Result<Self, RenderError> {
        let columns =
            options.columns.map_or_else(|| usual_columns(count), |columns| columns as usize).clamp(1, count.max(1));
        let rows = count.div_ceil(columns).max(1);
        let size = size(options, [columns, rows])?;
        let em = ((size[0] * size[1]) as f32).sqrt() * 0.0185;
        let em = em.clamp(10.0, 64.0);
        let pixels = |ems: f32| (ems * em).round() as usize;
        let [width, height] = size;
        let (margin, gap) = (pixels(0.7), pixels(0.45));
        let strip = |y: usize, height: usize| Rect { x: margin, y, width: width.saturating_sub(2 * margin), height };
        let title = options.title.then(|| strip(0, pixels(2.4)));
        let legend = legend.then(|| strip(height.saturating_sub(pixels(3.3)), pixels(3.3)));
        let top = title.map_or(margin, |strip| strip.height);
        let bottom = legend.map_or(margin, |strip| strip.height);
        let side = |all: usize, around: usize, count: usize| all.saturating_sub(around + (count - 1) * gap) / count;
        let cell = [side(width, 2 * margin, columns), side(height, top + bottom, rows)];
        if cell[0].min(cell[1]) < SMALLEST_CELL {
            let text = format!("{count} pictures do not fit on {width}x{height} pixels");
            let hint = "choose fewer moments with --at, a larger --size, or an animation (.gif, .apng)";
            return Err(RenderError::asked(text, hint));
        }
        let cells = (0..count)
            .map(|k| Rect {
                x: margin + k % columns * (cell[0] + gap),
                y: top + k / columns * (cell[1] + gap),
                width: cell[0],
                height: cell[1],
            })
            .collect();
        Ok(Self { size, em, title, cells, legend })
    }
}

/// As many columns as leave the fewest places empty, of a sheet that is wide rather than high.
fn usual_columns(count: usize) -> usize {
    let least = (1..).find(|k| k * k >= count).unwrap_or(1);
    (least..=2 * least).min_by_key(|&columns| (count.div_ceil(columns) * columns - count, columns)).unwrap_or(least)
}

fn size(options: &Options, [columns, rows]: [usize; 2]) -> Result<[usize; 2], RenderError> {
    let longest = if options.format == Format::Png { LONGEST } else { LONGEST_MOVING };
    let usual = || match (options.format, columns * rows) {
        (Format::Png, 1) => [1200, 1000],
        (Format::Png, _) => {
            let side = |count: usize, more: u32| (count as u32).saturating_mul(CELL).saturating_add(more).min(LONGEST);
            [side(columns, 20), side(rows, 120)]
        }
        _ => [720, 640],
    };
    let size = options.size.unwrap_or_else(usual);
    if size.iter().any(|side| !(SHORTEST..=longest).contains(side)) {
        let text = format!("{}x{} pixels are no size that can be drawn", size[0], size[1]);
        return Err(RenderError::asked(text, format!("either side is {SHORTEST} to {longest}")));
    }
    Ok(size.map(|side| side as usize))
}

/// Writes the title.
pub fn title(canvas: &mut Canvas, layout: &Layout, text: &Text, theme: &Theme, title: &str) {
    let Some(strip) = layout.title else { return };
    let size = 1.15 * layout.em;
    let shown = text.fit(title, size, strip.width as f32);
    let place = [strip.x as f32 + 0.5 * strip.width as f32, 1.55 * layout.em];
    text.draw(canvas, place, Anchor::Middle, &shown, (size, theme.ink));
}

/// Writes the time of a picture into its corner.
pub fn time(cell: &mut Canvas, em: f32, text: &Text, theme: &Theme, time: &str) {
    if text.width(time, em) < cell.width() as f32 - em {
        text.draw(cell, [0.6 * em, 1.3 * em], Anchor::Left, time, (em, theme.ink));
    }
}

/// Where axes and a length stand: in the corners of a picture that is alone, of several in the corners of the legend.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// The origin of the axes.
    pub origin: [f32; 2],
    /// The right end of the length.
    pub end: [f32; 2],
    /// Size of text [pixels].
    pub em: f32,
}

impl Corners {
    /// In the lower corners of a picture of this size, if it is large enough.
    pub fn of_picture([width, height]: [usize; 2], em: f32) -> Option<Self> {
        let (width, height) = (width as f32, height as f32);
        let corners = Self { origin: [2.5 * em, height - 2.4 * em], end: [width - 0.9 * em, height - 0.9 * em], em };
        (width.min(height) > 12.0 * em).then_some(corners)
    }

    /// In the corners of the legend's strip, if it leaves room.
    pub fn of_legend(strip: Rect, em: f32) -> Option<Self> {
        let (left, right) = (strip.x as f32, (strip.x + strip.width) as f32);
        let y = strip.y as f32 + 2.1 * em;
        let corners = Self { origin: [left + 2.2 * em, y], end: [right - 0.5 * em, y], em: 0.9 * em };
        (strip.width as f32 > 58.0 * em).then_some(corners)
    }
}

/// Draws the directions of x, y and z.
pub fn triad(canvas: &mut Canvas, corners: &Corners, (text, theme): (&Text, &Theme), camera: &Camera) {
    let (em, size, origin) = (corners.em, 0.8 * corners.em, corners.origin);
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let along = [camera.axes[0][k] as f32, -camera.axes[1][k] as f32];
        let end = [0, 1].map(|c| origin[c] + 1.5 * em * along[c]);
        canvas.line(origin, end, (0.085 * em).max(1.0), theme.pale);
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        // An axis that points at the eye has no name: it would stand on the origin.
        if length > 0.2 {
            let away = [0, 1].map(|c| end[c] + 0.55 * em * along[c] / length);
            text.draw(canvas, [away[0], away[1] + 0.28 * size], Anchor::Middle, name, (size, theme.pale));
        }
    }
}

/// Draws a length of pictures `width` pixels wide; in perspective it is that at a distance, in the middle of the cloud.
pub fn ruler(
    canvas: &mut Canvas,
    corners: &Corners,
    (text, theme): (&Text, &Theme),
    (camera, depth, width): (&Camera, f64, usize),
) {
    let em = corners.em;
    let scale = if camera.perspective { camera.scale / depth } else { camera.scale };
    let longest = (0.25 * width as f64).min(9.0 * f64::from(em)) / scale;
    if !(longest > 0.0 && longest.is_finite()) {
        return;
    }
    let length = round_down(longest);
    let unit = Unit::new("m", length);
    let shown = length * unit.factor;
    let about = if camera.perspective { "≈ " } else { "" };
    let name = format!("{about}{} {}", label(shown, decimals(shown)), unit.name);
    let [right, y] = corners.end;
    let left = right - (length * scale) as f32;
    let thick = (0.1 * em).max(1.0);
    canvas.line([left, y], [right, y], thick, theme.pale);
    for x in [left, right] {
        canvas.line([x, y - 0.22 * em], [x, y + 0.22 * em], thick, theme.pale);
    }
    // A short one has a name that is longer.
    let middle = (0.5 * (left + right)).min(right - 0.5 * text.width(&name, 0.8 * em));
    text.draw(canvas, [middle, y - 0.5 * em], Anchor::Middle, &name, (0.8 * em, theme.pale));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(size: [u32; 2]) -> Options {
        Options { size: Some(size), ..Options::default() }
    }

    #[test]
    fn pictures_stand_beside_each_other_on_the_page() {
        for count in 1..60 {
            let layout = Layout::new(&options([1500, 900]), count, true).unwrap();
            assert_eq!(layout.cells.len(), count);
            for (k, a) in layout.cells.iter().enumerate() {
                assert!(a.x + a.width <= 1500 && a.y + a.height <= layout.legend.unwrap().y);
                for b in &layout.cells[..k] {
                    assert!(a.x >= b.x + b.width || a.y >= b.y + b.height || b.x >= a.x + a.width, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn eight_moments_make_two_rows_of_four() {
        assert_eq!([1, 2, 3, 4, 6, 8, 9, 12].map(usual_columns), [1, 2, 3, 2, 3, 4, 3, 4]);
    }

    #[test]
    fn sizes_have_limits() {
        for (size, count) in [([63, 500], 1), ([500, 8193], 1), ([500, 500], 2000), ([64, 64], 100)] {
            assert!(Layout::new(&options(size), count, true).is_err(), "{size:?}");
        }
        let moving = Options { format: Format::Gif, ..options([5000, 500]) };
        assert!(Layout::new(&moving, 1, true).unwrap_err().to_string().contains("4096"));
        for count in [1, 7, 400] {
            assert!(Layout::new(&Options::default(), count, true).is_ok(), "{count}");
        }
    }
}
