//! A page of pixels: rectangles, lines and other canvases on it.

/// Red, green, blue as sRGB.
pub type Rgb = [u8; 3];

/// A rectangle of whole pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rect {
    /// Left edge [pixels].
    pub x: usize,
    /// Upper edge [pixels].
    pub y: usize,
    /// Width [pixels].
    pub width: usize,
    /// Height [pixels].
    pub height: usize,
}

/// Pixels in rows from the top, three bytes each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Canvas {
    /// A page of one colour.
    pub fn new(width: usize, height: usize, color: Rgb) -> Self {
        Self { width, height, bytes: color.repeat(width * height) }
    }

    /// Width [pixels].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height [pixels].
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The rows, to be written to side by side.
    pub fn rows_mut(&mut self, count: usize) -> std::slice::ChunksMut<'_, u8> {
        self.bytes.chunks_mut(3 * self.width * count)
    }

    /// A pixel; black outside.
    #[cfg(test)]
    pub fn pixel(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        self.bytes.get(at..at + 3).and_then(|bytes| bytes.try_into().ok()).unwrap_or_default()
    }

    /// Mixes a colour into a pixel by a share of 0 to 1; nothing outside the page.
    pub fn blend(&mut self, x: i64, y: i64, color: Rgb, share: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x >= self.width || y >= self.height {
            return;
        }
        let at = 3 * (y * self.width + x);
        for (byte, channel) in self.bytes[at..at + 3].iter_mut().zip(color) {
            *byte = (f32::from(*byte) + (f32::from(channel) - f32::from(*byte)) * share).round() as u8;
        }
    }

    /// Fills a rectangle, as far as it is on the page.
    pub fn fill(&mut self, rect: Rect, color: Rgb) {
        let end = (rect.x + rect.width).min(self.width);
        for y in rect.y..(rect.y + rect.height).min(self.height) {
            for x in rect.x..end {
                let at = 3 * (y * self.width + x);
                self.bytes[at..at + 3].copy_from_slice(&color);
            }
        }
    }

    /// Puts a canvas onto this one; what reaches beyond is cut off.
    pub fn paste(&mut self, from: &Self, x: usize, y: usize) {
        let width = from.width.min(self.width.saturating_sub(x));
        for row in 0..from.height.min(self.height.saturating_sub(y)) {
            let (to, of) = (3 * ((y + row) * self.width + x), 3 * row * from.width);
            self.bytes[to..to + 3 * width].copy_from_slice(&from.bytes[of..of + 3 * width]);
        }
    }

    /// A straight line with smooth edges and round ends, `width` pixels wide.
    pub fn line(&mut self, from: [f32; 2], to: [f32; 2], width: f32, color: Rgb) {
        let reach = 0.5 * width + 1.0;
        let range = |k: usize| (from[k].min(to[k]) - reach).floor() as i64..=(from[k].max(to[k]) + reach).ceil() as i64;
        for y in range(1) {
            for x in range(0) {
                let distance = distance([x as f32 + 0.5, y as f32 + 0.5], from, to);
                let share = (0.5 * width + 0.5 - distance).clamp(0.0, 1.0);
                if share > 0.0 {
                    self.blend(x, y, color, share);
                }
            }
        }
    }

    /// A disc with a smooth edge.
    pub fn disc(&mut self, centre: [f32; 2], radius: f32, color: Rgb) {
        self.line(centre, centre, 2.0 * radius, color);
    }
}

/// Distance of a point from a segment.
pub fn distance(p: [f32; 2], from: [f32; 2], to: [f32; 2]) -> f32 {
    let (d, q) = ([to[0] - from[0], to[1] - from[1]], [p[0] - from[0], p[1] - from[1]]);
    let square = d[0] * d[0] + d[1] * d[1];
    let at = if square > 0.0 { ((q[0] * d[0] + q[1] * d[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    let rest = [q[0] - at * d[0], q[1] - at * d[1]];
    (rest[0] * rest[0] + rest[1] * rest[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_cover_their_length_times_their_width() {
        let mut canvas = Canvas::new(60, 40, [0; 3]);
        canvas.line([10.0, 10.0], [50.0, 30.0], 3.0, [255; 3]);
        let covered: f64 = canvas.bytes().iter().step_by(3).map(|&byte| f64::from(byte) / 255.0).sum();
        let exact = 3.0 * 2000.0_f64.sqrt() + std::f64::consts::PI * 2.25;
        // Coverage by distance is exact for straight edges to a percent or so.
        assert!((covered / exact - 1.0).abs() < 0.02, "{covered} {exact}");
    }

    #[test]
    fn what_is_off_the_page_is_cut_off() {
        let mut canvas = Canvas::new(4, 3, [9; 3]);
        canvas.fill(Rect { x: 2, y: 1, width: 100, height: 100 }, [1; 3]);
        canvas.paste(&Canvas::new(10, 10, [7; 3]), 3, 2);
        canvas.line([-5.0, -5.0], [-1.0, 90.0], 1.0, [0; 3]);
        assert_eq!([canvas.pixel(1, 1), canvas.pixel(2, 1), canvas.pixel(3, 2)], [[9; 3], [1; 3], [7; 3]]);
    }
}
