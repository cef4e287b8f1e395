//! Text, from a font that comes along.

use ab_glyph::{Font as _, FontRef, Glyph, PxScale, ScaleFont as _, point};

use crate::canvas::{Canvas, Rgb};

const FONT: &[u8] = include_bytes!("../fonts/DejaVuSans-subset.ttf");

/// Draws and measures text.
#[derive(Debug)]
pub struct Text {
    font: FontRef<'static>,
}

/// Where a text stands relative to the place that is given for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Left,
    /// Its middle is there.
    Middle,
    /// It ends there.
    Right,
}

impl Text {
    /// The font.
    pub fn new() -> Self {
        // A test reads it: it is part of the program.
        Self { font: FontRef::try_from_slice(FONT).expect("the font is whole") }
    }

    /// Width of a text of this size [pixels].
    pub fn width(&self, text: &str, size: f32) -> f32 {
        self.glyphs(text, size).1
    }

    /// Draws a text whose base line passes through `place`; `size` is the distance of lines [pixels].
    pub fn draw(&self, canvas: &mut Canvas, place: [f32; 2], anchor: Anchor, text: &str, (size, color): (f32, Rgb)) {
        let (glyphs, width) = self.glyphs(text, size);
        let left = match anchor {
            Anchor::Left => place[0],
            Anchor::Middle => place[0] - 0.5 * width,
            Anchor::Right => place[0] - width,
        };
        for mut glyph in glyphs {
            // Whole pixels keep the base line sharp.
            glyph.position += point(left, place[1].round());
            let Some(outline) = self.font.outline_glyph(glyph) else { continue };
            let bounds = outline.px_bounds();
            let (x0, y0) = (bounds.min.x as i64, bounds.min.y as i64);
            outline
                .draw(|x, y, share| canvas.blend(x0 + i64::from(x), y0 + i64::from(y), color, share.clamp(0.0, 1.0)));
        }
    }

    /// As much of a text as fits into a width, with an ellipsis where that is not all.
    pub fn fit(&self, text: &str, size: f32, width: f32) -> String {
        // Names come from files: what is no letter or sign is left out, and no more is looked at than any page can hold.
        let clean: Vec<char> = text.chars().filter(|c| !c.is_control()).take(1000).collect();
        let whole: String = clean.iter().collect();
        if clean.len() < 1000 && self.width(&whole, size) <= width {
            return whole;
        }
        let shortened = |count: usize| clean[..count].iter().collect::<String>().trim_end().to_owned() + "…";
        let mut counts = 0..clean.len();
        while counts.len() > 1 {
            let middle = counts.start + counts.len() / 2;
            if self.width(&shortened(middle), size) <= width { counts.start = middle } else { counts.end = middle }
        }
        shortened(counts.start)
    }

    fn glyphs(&self, text: &str, size: f32) -> (Vec<Glyph>, f32) {
        let font = self.font.as_scaled(PxScale::from(size));
        let (mut glyphs, mut x, mut last) = (Vec::new(), 0.0, None);
        for c in text.chars() {
            let id = self.font.glyph_id(c);
            if let Some(last) = last {
                x += font.kern(last, id);
            }
            glyphs.push(id.with_scale_and_position(size, point(x, 0.0)));
            x += font.h_advance(id);
            last = Some(id);
        }
        (glyphs, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_all_that_legends_say() {
        let text = Text::new();
        for c in "temperature [K] t = 0.5 s, 3·10⁻⁹ µn ≈ ≥ ≤ … κ − × äöüß".chars() {
            assert!(c == ' ' || text.font.glyph_id(c).0 != 0, "{c:?} is missing");
        }
    }

    #[test]
    fn texts_are_shortened_to_what_fits() {
        let text = Text::new();
        assert_eq!(text.fit("short", 16.0, 200.0), "short");
        let long = "a name that goes on and on ".repeat(100);
        let short = text.fit(&long, 16.0, 200.0);
        assert!(short.ends_with('…') && text.width(&short, 16.0) <= 200.0, "{short}");
        assert!(text.width(&short, 16.0) > 180.0, "as much as fits: {short}");
        assert_eq!(text.fit("a\u{7}\nb", 16.0, 200.0), "ab");
    }
}
