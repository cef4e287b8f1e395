//! Pictures to files: PNG, and as animations APNG and GIF, of which each picture holds only what changed.

use std::io::Write;

use color_quant::NeuQuant;
use rayon::prelude::*;

use crate::canvas::{Canvas, Rect, Rgb};

/// Colours of a GIF.
const COLORS: usize = 256;
/// How much pixels are made lighter and darker in turn, so that steps between colours do not show [of 255].
const DITHER: f32 = 8.0;
/// The order in which they are, in a square of 4 by 4.
const BAYER: [[f32; 4]; 4] =
    [[0.0, 8.0, 2.0, 10.0], [12.0, 4.0, 14.0, 6.0], [3.0, 11.0, 1.0, 9.0], [15.0, 7.0, 13.0, 5.0]];
/// Most colours that a palette is made of.
const LEARNT: usize = 400_000;
/// Of so many colours one is learnt from: 1 is best, 30 is fast.
const LEARN_EVERY: i32 = 1;

fn other(error: impl std::error::Error + Send + Sync + 'static) -> std::io::Error {
    std::io::Error::other(error)
}

fn png_error(error: png::EncodingError) -> std::io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        error => other(error),
    }
}

fn gif_error(error: gif::EncodingError) -> std::io::Error {
    match error {
        gif::EncodingError::Io(error) => error,
        error => other(error),
    }
}

fn encoder<W: Write>(out: W, canvas: &Canvas) -> png::Encoder<'static, W> {
    let mut encoder = png::Encoder::new(out, canvas.width() as u32, canvas.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder
}

/// Writes one picture.
///
/// # Errors
/// An output that refuses bytes.
pub fn png<W: Write>(out: W, canvas: &Canvas) -> std::io::Result<()> {
    let mut writer = encoder(out, canvas).write_header().map_err(png_error)?;
    writer.write_image_data(canvas.bytes()).map_err(png_error)?;
    writer.finish().map_err(png_error)
}

/// Writes one picture in 256 colours, with those of `exact` kept as they are.
///
/// # Errors
/// An output that refuses bytes.
pub fn png_indexed<W: Write>(out: W, canvas: &Canvas, exact: &[Rgb]) -> std::io::Result<()> {
    let palette = Palette::new(std::slice::from_ref(canvas), exact);
    let mut encoder = encoder(out, canvas);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(palette.bytes.clone());
    encoder.set_compression(png::Compression::High);
    // Neighbouring numbers are not neighbouring colours, so there is nothing to predict.
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header().map_err(png_error)?;
    writer.write_image_data(&palette.indices(canvas)).map_err(png_error)?;
    writer.finish().map_err(png_error)
}

/// An animation being written.
pub trait Animation {
    /// Adds a picture that is shown for so many times the usual time.
    ///
    /// # Errors
    /// An output that refuses bytes.
    fn add(&mut self, canvas: &Canvas, times: u32) -> std::io::Result<()>;

    /// Ends it.
    ///
    /// # Errors
    /// An output that refuses bytes.
    fn finish(self: Box<Self>) -> std::io::Result<()>;
}

/// An animated PNG.
pub struct Apng<W: Write> {
    writer: png::Writer<W>,
    last: Option<Canvas>,
    per_second: f64,
}

impl<W: Write> Apng<W> {
    /// Begins an animation of so many pictures of this one's size; it repeats for ever.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn new(out: W, first: &Canvas, count: u32, per_second: f64) -> std::io::Result<Self> {
        let mut encoder = encoder(out, first);
        encoder.set_animated(count.max(1), 0).map_err(png_error)?;
        let writer = encoder.write_header().map_err(png_error)?;
        Ok(Self { writer, last: None, per_second })
    }
}

impl<W: Write> Animation for Apng<W> {
    fn add(&mut self, canvas: &Canvas, times: u32) -> std::io::Result<()> {
        let delay = (1000.0 * f64::from(times) / self.per_second).round().clamp(1.0, 65535.0) as u16;
        self.writer.set_frame_delay(delay, 1000).map_err(png_error)?;
        match &self.last {
            // The first picture is the whole page.
            None => self.writer.write_image_data(canvas.bytes()).map_err(png_error)?,
            Some(last) => {
                let rect = changed(last.bytes(), canvas.bytes(), canvas.width(), 3);
                self.writer.reset_frame_position().map_err(png_error)?;
                self.writer.set_frame_dimension(rect.width as u32, rect.height as u32).map_err(png_error)?;
                self.writer.set_frame_position(rect.x as u32, rect.y as u32).map_err(png_error)?;
                self.writer.write_image_data(&cut(canvas.bytes(), canvas.width(), 3, rect)).map_err(png_error)?;
            }
        }
        self.last = Some(canvas.clone());
        Ok(())
    }

    fn finish(self: Box<Self>) -> std::io::Result<()> {
        self.writer.finish().map_err(png_error)
    }
}

/// An animated GIF.
pub struct Gif<W: Write> {
    encoder: gif::Encoder<W>,
    palette: Palette,
    last: Option<Vec<u8>>,
    per_second: f64,
    /// Time shown too much or too little by rounding so far [1/100 s].
    rest: f64,
}

impl<W: Write> Gif<W> {
    /// Begins an animation in the colours of some of its pictures, with those of `exact` kept as they are.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn new(out: W, samples: &[Canvas], exact: &[Rgb], per_second: f64) -> std::io::Result<Self> {
        let palette = Palette::new(samples, exact);
        let size = |side: fn(&Canvas) -> usize| samples.first().map_or(1, side) as u16;
        let mut encoder =
            gif::Encoder::new(out, size(Canvas::width), size(Canvas::height), &palette.bytes).map_err(gif_error)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(gif_error)?;
        Ok(Self { encoder, palette, last: None, per_second, rest: 0.0 })
    }
}

impl<W: Write> Animation for Gif<W> {
    fn add(&mut self, canvas: &Canvas, times: u32) -> std::io::Result<()> {
        let indices = self.palette.indices(canvas);
        let whole = Rect { x: 0, y: 0, width: canvas.width(), height: canvas.height() };
        let rect = self.last.as_ref().map_or(whole, |last| changed(last, &indices, canvas.width(), 1));
        let exact = 100.0 * f64::from(times) / self.per_second + self.rest;
        let delay = exact.round().clamp(1.0, 65535.0);
        self.rest = (exact - delay).clamp(-1.0, 1.0);
        let frame = gif::Frame {
            delay: delay as u16,
            left: rect.x as u16,
            top: rect.y as u16,
            width: rect.width as u16,
            height: rect.height as u16,
            buffer: cut(&indices, canvas.width(), 1, rect).into(),
            ..gif::Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(gif_error)?;
        self.last = Some(indices);
        Ok(())
    }

    fn finish(self: Box<Self>) -> std::io::Result<()> {
        self.encoder.into_inner().map_err(gif_error)?.flush()
    }
}

/// 256 colours that stand for all.
struct Palette {
    exact: Vec<Rgb>,
    learnt: NeuQuant,
    bytes: Vec<u8>,
}

impl Palette {
    fn new(samples: &[Canvas], exact: &[Rgb]) -> Self {
        // Every colour counts once: bright spots, edges and the colour bar are small, and their steps show the most.
        let mut colors: Vec<&[u8]> = samples.iter().flat_map(|canvas| canvas.bytes().chunks_exact(3)).collect();
        colors.par_sort_unstable();
        colors.dedup();
        colors.retain(|color| exact.iter().all(|exact| exact != color));
        let step = colors.len() / LEARNT + 1;
        let rgba = colors.iter().step_by(step).flat_map(|color| [color[0], color[1], color[2], 255]);
        let mut rgba: Vec<u8> = rgba.collect();
        if rgba.is_empty() {
            rgba.extend([128, 128, 128, 255]);
        }
        // Enough to learn anything from.
        while rgba.len() < 4 * 4096 {
            rgba.extend_from_within(..);
        }
        let learnt = NeuQuant::new(LEARN_EVERY, COLORS - exact.len(), &rgba);
        let mut bytes = exact.concat();
        bytes.extend(learnt.color_map_rgb());
        Self { exact: exact.to_vec(), learnt, bytes }
    }

    fn indices(&self, canvas: &Canvas) -> Vec<u8> {
        let mut indices = vec![0; canvas.width() * canvas.height()];
        let rows = indices.par_chunks_mut(canvas.width()).zip(canvas.bytes().par_chunks(3 * canvas.width()));
        rows.enumerate().for_each(|(y, (row, pixels))| {
            for (x, (index, pixel)) in row.iter_mut().zip(pixels.chunks_exact(3)).enumerate() {
                *index = self.index(pixel, DITHER * (BAYER[y % 4][x % 4] - 7.5) / 15.0);
            }
        });
        indices
    }

    /// The number of an exact colour, or of the one nearest to the pixel made lighter by so much.
    fn index(&self, pixel: &[u8], lighter: f32) -> u8 {
        let index = match self.exact.iter().position(|color| color == pixel) {
            Some(index) => index,
            None => {
                let [r, g, b] = [0, 1, 2].map(|k| (f32::from(pixel[k]) + lighter).round().clamp(0.0, 255.0) as u8);
                self.exact.len() + self.learnt.index_of(&[r, g, b, 255])
            }
        };
        index.min(COLORS - 1) as u8
    }
}

/// The smallest rectangle outside which two pictures of pixels of `depth` bytes agree; one pixel where they agree all over.
fn changed(before: &[u8], now: &[u8], width: usize, depth: usize) -> Rect {
    let row = width * depth;
    let (mut columns, mut rows) = ((usize::MAX, 0), (usize::MAX, 0));
    for (y, (a, b)) in before.chunks_exact(row).zip(now.chunks_exact(row)).enumerate() {
        let Some(first) = a.iter().zip(b).position(|(a, b)| a != b) else { continue };
        let last = a.iter().zip(b).rposition(|(a, b)| a != b).unwrap_or(first);
        columns = (columns.0.min(first / depth), columns.1.max(last / depth));
        rows = (rows.0.min(y), y);
    }
    if rows.0 > rows.1 {
        return Rect { x: 0, y: 0, width: 1, height: 1 };
    }
    Rect { x: columns.0, y: rows.0, width: columns.1 - columns.0 + 1, height: rows.1 - rows.0 + 1 }
}

/// The bytes of a rectangle.
fn cut(bytes: &[u8], width: usize, depth: usize, rect: Rect) -> Vec<u8> {
    let rows = bytes.chunks_exact(width * depth).skip(rect.y).take(rect.height);
    rows.flat_map(|row| &row[rect.x * depth..(rect.x + rect.width) * depth]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_changed_is_written_again() {
        let before = Canvas::new(10, 8, [1; 3]);
        let mut now = before.clone();
        assert_eq!(changed(before.bytes(), now.bytes(), 10, 3), Rect { x: 0, y: 0, width: 1, height: 1 });
        let rect = Rect { x: 2, y: 3, width: 5, height: 4 };
        now.fill(rect, [1, 1, 9]);
        assert_eq!(changed(before.bytes(), now.bytes(), 10, 3), rect);
        assert_eq!(cut(now.bytes(), 10, 3, rect), [1, 1, 9].repeat(20));
    }

    #[test]
    fn grounds_keep_their_colour_and_others_are_near() {
        let mut canvas = Canvas::new(64, 64, [250, 251, 252]);
        for k in 0..60 {
            let level = (4 * k) as u8;
            canvas.fill(Rect { x: k, y: 0, width: 1, height: 50 }, [level, 255 - level, level / 2]);
        }
        let palette = Palette::new(std::slice::from_ref(&canvas), &[[250, 251, 252]]);
        assert_eq!(palette.bytes.len(), 3 * COLORS);
        let indices = palette.indices(&canvas);
        assert_eq!(indices[63 * 64], 0);
        for (index, pixel) in indices.iter().zip(canvas.bytes().chunks_exact(3)) {
            let color = &palette.bytes[3 * usize::from(*index)..][..3];
            // There are more colours in the palette than in the picture.
            assert!(color.iter().zip(pixel).all(|(a, b)| a.abs_diff(*b) <= 12), "{color:?} {pixel:?}");
        }
    }
}
