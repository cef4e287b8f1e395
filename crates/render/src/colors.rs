//! From values to colours.
//!
//! Sequential maps have lightness that grows evenly from end to end, the diverging one falls off evenly to both sides of
//! grey, and clusters have colours that the colour-blind tell apart.

use agglo_record::palette;

use crate::canvas::Rgb;
use crate::options::Quantity;

/// Stops of the map of temperatures, evenly spaced: "plasma" of matplotlib (CC0), from blue to yellow.
const WARM: [u32; 9] =
    [0x0d_0887, 0x4c_02a1, 0x7e_03a8, 0xa9_2395, 0xcc_4778, 0xe5_6b5d, 0xf8_9540, 0xfd_c527, 0xf0_f921];
/// The part of it that is used: its last yellow is greenish, as if it went on to something else [-].
const WARM_END: f64 = 0.94;
/// Stops of the map of speeds: "viridis" of matplotlib (CC0), from violet over green to yellow.
const COOL: [u32; 9] =
    [0x44_0154, 0x47_2d7b, 0x3b_528b, 0x2c_728e, 0x21_918c, 0x28_ae80, 0x5e_c962, 0xad_dc30, 0xfd_e725];
/// Colours of clusters: those of Okabe and Ito, with indigo, wine and olive of Tol.
pub const CLUSTERS: [u32; 10] =
    [0xe6_9f00, 0x56_b4e9, 0x00_9e73, 0xd5_5e00, 0x00_72b2, 0xcc_79a7, 0xf0_e442, 0x33_2288, 0x88_2255, 0x99_9933];
/// Single particles beside clusters.
pub const SINGLE: Rgb = [0xb8, 0xb8, 0xbc];
/// Particles whose value is no number: a colour that no scale has.
pub const MISSING: Rgb = [0xff; 3];
/// Particles whose colour stands for nothing.
pub const PLAIN: Rgb = [0x9f, 0xb4, 0xc8];

/// A range of values and the colours in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// What it is of: temperature, speed or charge.
    pub quantity: Quantity,
    /// Value at the lower end.
    pub low: f64,
    /// Value at the upper end.
    pub high: f64,
}

impl Scale {
    /// The colour of a value; beyond the ends those of the ends.
    pub fn color(&self, value: f64) -> Rgb {
        let share = (value - self.low) / (self.high - self.low);
        if share.is_finite() { self.at(share.clamp(0.0, 1.0)) } else { MISSING }
    }

    /// The colour at a share of the way from the lower to the upper end.
    pub fn at(&self, share: f64) -> Rgb {
        match self.quantity {
            Quantity::Temperature => ramp(&WARM, WARM_END * share),
            Quantity::Speed => ramp(&COOL, share),
            Quantity::Charge => {
                let [r, g, b, _] = palette::ramp(share);
                [r, g, b]
            }
            Quantity::Cluster | Quantity::None => PLAIN,
        }
    }
}

/// The colour of the cluster with this place in the cycle.
pub fn cluster(place: usize) -> Rgb {
    rgb(CLUSTERS[place % CLUSTERS.len()])
}

fn rgb(hex: u32) -> Rgb {
    let [_, r, g, b] = hex.to_be_bytes();
    [r, g, b]
}

fn ramp(stops: &[u32; 9], share: f64) -> Rgb {
    let place = share * (stops.len() - 1) as f64;
    let k = (place as usize).min(stops.len() - 2);
    let (from, to, rest) = (rgb(stops[k]), rgb(stops[k + 1]), place - k as f64);
    std::array::from_fn(|c| (f64::from(from[c]) + (f64::from(to[c]) - f64::from(from[c])) * rest).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::linear;

    /// CIE lightness of a colour, 0 to 100.
    fn lightness(color: Rgb) -> f64 {
        let [r, g, b] = color.map(|byte| f64::from(linear(byte)));
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 216.0 / 24389.0 { 116.0 * libm::cbrt(y) - 16.0 } else { y * 24389.0 / 27.0 }
    }

    fn scale(quantity: Quantity) -> Scale {
        Scale { quantity, low: -1.0, high: 1.0 }
    }

    #[test]
    fn lightness_of_sequential_maps_grows_evenly() {
        for quantity in [Quantity::Temperature, Quantity::Speed] {
            let steps: Vec<f64> = (0..=16).map(|k| lightness(scale(quantity).at(f64::from(k) / 16.0))).collect();
            let mean = (steps[16] - steps[0]) / 16.0;
            for (k, pair) in steps.windows(2).enumerate() {
                // Even to a quarter: bytes and stops are rounded, and a lightness of 5 is one of a kind.
                let step = (pair[1] - pair[0]) / mean;
                assert!((0.5..1.5).contains(&step), "{quantity:?}: step {k} is {step} of the mean");
            }
        }
    }

    #[test]
    fn charges_fall_off_to_both_sides_of_grey() {
        let at = |q: f64| lightness(scale(Quantity::Charge).color(q));
        for (outer, inner) in [(-1.0, -0.5), (-0.5, 0.0), (0.5, 0.0), (1.0, 0.5)] {
            assert!(at(outer) + 5.0 < at(inner), "{outer} {inner}");
        }
        let [r, g, b] = scale(Quantity::Charge).color(0.0);
        assert!(r == g && g == b);
    }

    #[test]
    fn values_beyond_the_ends_have_the_colours_of_the_ends() {
        let scale = scale(Quantity::Speed);
        assert_eq!(scale.color(7.0), scale.at(1.0));
        assert_eq!(scale.color(-7.0), scale.at(0.0));
        assert_eq!([scale.color(f64::NAN), scale.color(f64::INFINITY)], [MISSING; 2]);
        assert_eq!(scale.at(1.0), [0xfd, 0xe7, 0x25]);
    }
}
