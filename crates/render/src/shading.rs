//! Light on spheres, in linear light, and its way to sRGB and back.

use crate::canvas::Rgb;

/// Red, green, blue in linear light, 0 to 1.
pub type Light = [f32; 3];

/// Where light comes from, as a unit vector in the directions of the camera (right, up, forward): over the left shoulder.
const LAMP: [f32; 3] = [-0.422, 0.422, -0.802];
/// Light from all around [-].
const AROUND: f32 = 0.54;
/// Light of the lamp on what faces it [-].
const DIRECT: f32 = 0.58;
/// Brightness of the lamp's reflection [-].
const GLOSS: f32 = 0.08;

/// Linear light of an sRGB byte.
pub fn linear(byte: u8) -> f32 {
    let value = f64::from(byte) / 255.0;
    (if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }) as f32
}

/// A colour in linear light.
pub fn light(color: Rgb) -> Light {
    color.map(linear)
}

/// Turns linear light into sRGB bytes.
#[derive(Clone, Debug)]
pub struct Development {
    table: Vec<u8>,
}

impl Development {
    /// Fine enough that every byte is met.
    const STEPS: usize = 1 << 13;

    /// Makes the table.
    pub fn new() -> Self {
        let byte = |k: usize| {
            let value = k as f64 / Self::STEPS as f64;
            let value = if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * libm::pow(value, 1.0 / 2.4) - 0.055 };
            (value * 255.0).round() as u8
        };
        Self { table: (0..=Self::STEPS).map(byte).collect() }
    }

    /// The colour of light; what is too bright is white.
    pub fn color(&self, light: Light) -> Rgb {
        light.map(|channel| self.table[(channel.clamp(0.0, 1.0) * Self::STEPS as f32 + 0.5) as usize])
    }
}

/// What a surface of a colour sends to the eye. `normal` and `to_eye` are unit vectors in the directions of the camera,
/// `open` is the part of the surroundings that is not hidden from it.
pub fn shade(color: Light, normal: [f32; 3], to_eye: [f32; 3], open: f32) -> Light {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // The terminator is soft, as under a sky.
    let direct = ((dot(normal, LAMP) + 0.2) / 1.2).max(0.0);
    let around = 0.85 + 0.15 * normal[1];
    // Surfaces that turn away are darker, which sets spheres apart from those behind them.
    let rim = 0.72 + 0.28 * dot(normal, to_eye).max(0.0);
    let brightness = rim * (AROUND * around * open + DIRECT * direct * (0.4 + 0.6 * open));
    let half = [0, 1, 2].map(|k| LAMP[k] + to_eye[k]);
    let cosine = (dot(normal, half) / dot(half, half).sqrt()).max(0.0);
    let gloss = GLOSS * open * (0..6).fold(cosine, |power, _| power * power);
    color.map(|channel| channel * brightness + gloss)
}

/// A mixture: all of `a` at 0, all of `b` at 1.
pub fn mix(a: Light, b: Light, share: f32) -> Light {
    [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * share)
}

/// A mixture as the eye counts shares: half of black and white is mid-grey, where [`mix`] makes it light grey.
pub fn veil(a: Light, b: Light, share: f32) -> Light {
    mix(a.map(f32::sqrt), b.map(f32::sqrt), share).map(|root| root * root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_way_to_light_and_back() {
        let development = Development::new();
        for byte in 0..=255_u8 {
            assert_eq!(development.color([linear(byte); 3]), [byte; 3]);
        }
        assert_eq!(development.color([7.0, -1.0, f32::NAN]), [255, 0, 0]);
    }

    #[test]
    fn what_faces_lamp_and_eye_has_its_own_colour() {
        let facing = shade([0.5; 3], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0], 1.0)[0];
        // To a tenth: the legend's colour is that of the lit side.
        assert!((facing / 0.5 - 1.0).abs() < 0.1, "{facing}");
        let hidden = shade([0.5; 3], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0], 0.3)[0];
        assert!(hidden < 0.75 * facing);
    }

    #[test]
    fn the_lamp_is_a_unit_vector() {
        assert!((LAMP.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3);
        assert_eq!(LAMP[0], -LAMP[1], "light is symmetric about the diagonal");
    }
}
