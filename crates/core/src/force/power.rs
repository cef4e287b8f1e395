//! Power laws s^-beta and their potentials, evaluated for a block of pairs at a time.
//!
//! P(beta) = s^(1 - beta) / (1 - beta), and ln s for beta = 1 (where the paper's (5) divides by zero), is the potential
//! whose slope is s^-beta. Exponents that matter have their own multiplication chain, all others go through exp and ln.

use crate::math;

/// Pairs in a block: small enough for the first cache level, a multiple of every vector width.
pub const BLOCK: usize = 32;
/// Lanes that sums are kept in, the same on every instruction set.
pub const LANES: usize = 8;
/// A block of numbers, one per pair.
pub type Lane = [f64; BLOCK];

/// A power law s^-beta with one of the known ways to evaluate it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Exponent beta [-].
    pub exponent: f64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Zero,
    Half,
    One,
    ThreeHalves,
    Two,
    FiveHalves,
    Three,
    Four,
    Six,
    Seven,
    Twelve,
    Thirteen,
    Real,
}

impl Power {
    /// For an exponent >= 0.
    #[must_use]
    pub fn new(exponent: f64) -> Self {
        const KNOWN: [(f64, Kind); 12] = [
            (0.0, Kind::Zero),
            (0.5, Kind::Half),
            (1.0, Kind::One),
            (1.5, Kind::ThreeHalves),
            (2.0, Kind::Two),
            (2.5, Kind::FiveHalves),
            (3.0, Kind::Three),
            (4.0, Kind::Four),
            (6.0, Kind::Six),
            (7.0, Kind::Seven),
            (12.0, Kind::Twelve),
            (13.0, Kind::Thirteen),
        ];
        let kind = KNOWN.iter().find(|(known, _)| *known == exponent).map_or(Kind::Real, |&(_, kind)| kind);
        Self { exponent, kind }
    }

    /// out = s^-beta, from s^2 and 1/s of the first `LEN` of N pairs.
    #[inline(always)]
    pub fn block<const LEN: usize, const N: usize>(&self, square: &[f64; N], inverse: &[f64; N], out: &mut [f64; N]) {
        macro_rules! chain {
            ($q:ident => $value:expr) => {
                for k in 0..LEN {
                    let $q = inverse[k];
                    out[k] = $value;
                }
            };
        }
        match self.kind {
            Kind::Zero => out[..LEN].fill(1.0),
            Kind::Half => chain!(q => q.sqrt()),
            Kind::One => chain!(q => q),
            Kind::ThreeHalves => chain!(q => q * q.sqrt()),
            Kind::Two => chain!(q => q * q),
            Kind::FiveHalves => chain!(q => q * q * q.sqrt()),
            Kind::Three => chain!(q => q * (q * q)),
            Kind::Four => chain!(q => (q * q) * (q * q)),
            Kind::Six => chain!(q => { let c = q * q * q; c * c }),
            Kind::Seven => chain!(q => { let c = q * q * q; c * c * q }),
            Kind::Twelve => chain!(q => { let c = q * q * q; (c * c) * (c * c) }),
            Kind::Thirteen => chain!(q => { let c = q * q * q; (c * c) * (c * c) * q }),
            Kind::Real => {
                let half = -0.5 * self.exponent;
                for k in 0..LEN {
                    out[k] = math::exp(half * math::ln(square[k]));
                }
            }
        }
    }

    /// potential = P(beta) of the first `LEN` of N pairs, from s^2, 1/s and `power` = s^-beta.
    #[inline(always)]
    pub fn potential_block<const LEN: usize, const N: usize>(
        &self,
        square: &[f64; N],
        inverse: &[f64; N],
        power: &[f64; N],
        potential: &mut [f64; N],
    ) {
        if self.exponent == 1.0 {
            for k in 0..LEN {
                potential[k] = 0.5 * math::ln(square[k]);
            }
        } else {
            let factor = 1.0 / (1.0 - self.exponent);
            // s = s^2 * (1/s)
            for k in 0..LEN {
                potential[k] = factor * (square[k] * inverse[k]) * power[k];
            }
        }
    }

    /// s^-beta at one distance s > 0 [m].
    #[must_use]
    pub fn at(&self, s: f64) -> f64 {
        if self.exponent == 0.0 { 1.0 } else { math::exp(-self.exponent * math::ln(s)) }
    }

    /// P(beta) at one distance s > 0 [m].
    #[must_use]
    pub fn potential_at(&self, s: f64) -> f64 {
        if self.exponent == 1.0 { math::ln(s) } else { s * self.at(s) / (1.0 - self.exponent) }
    }
}
