//! Power laws s^-beta and their potentials, evaluated for eight pairs at a time.
//!
//! P(beta) = s^(1 - beta) / (1 - beta), and ln s for beta = 1 (where the paper's (5) divides by zero), is the potential
//! whose slope is s^-beta. Whole and half exponents up to 32 are chains of products, all others go through exp and ln.

use crate::math;
use crate::simd::{Arithmetic, Lanes};

/// A power law s^-beta with one of the known ways to evaluate it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Exponent beta [-].
    pub exponent: f64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// A whole number, and a half where `half`: squarings and products.
    Chain { whole: u32, half: bool },
    /// Through ln and exp.
    Real,
}

/// Largest exponent that is made of products: beyond it their rounding errors pass those of ln and exp.
const LONGEST_CHAIN: f64 = 32.0;

impl Power {
    /// For an exponent >= 0.
    #[must_use]
    pub fn new(exponent: f64) -> Self {
        let doubled = 2.0 * exponent;
        let kind = if doubled == doubled.floor() && exponent <= LONGEST_CHAIN {
            Kind::Chain { whole: exponent.floor() as u32, half: exponent != exponent.floor() }
        } else {
            Kind::Real
        };
        Self { exponent, kind }
    }

    /// Whether the power goes through ln and exp.
    #[must_use]
    pub fn needs_logarithm(&self) -> bool {
        self.kind == Kind::Real
    }

    /// Whether the potential is a logarithm, or needs one.
    #[must_use]
    pub fn potential_needs_logarithm(&self) -> bool {
        self.needs_logarithm() || self.exponent == 1.0
    }

    /// s^-beta from ln s^2, if [`Power::needs_logarithm`], and 1/s.
    #[inline(always)]
    pub(crate) fn lanes<S: Arithmetic>(&self, simd: S, logarithm: S::F, q: S::F) -> S::F {
        match self.kind {
            Kind::Chain { mut whole, half } => {
                let mut product = if half { q.sqrt() } else { simd.splat(1.0) };
                let mut square = q;
                while whole > 0 {
                    if whole & 1 == 1 {
                        product = product * square;
                    }
                    square = square * square;
                    whole >>= 1;
                }
                product
            }
            Kind::Real => simd.exp(simd.splat(-0.5 * self.exponent) * logarithm),
        }
    }

    /// P(beta) from s^2, ln s^2 if beta = 1, 1/s and s^-beta.
    #[inline(always)]
    pub(crate) fn potential_lanes<S: Arithmetic>(
        &self,
        simd: S,
        square: S::F,
        logarithm: S::F,
        inverse: S::F,
        power: S::F,
    ) -> S::F {
        if self.exponent == 1.0 {
            simd.splat(0.5) * logarithm
        } else {
            // s = s^2 * (1/s)
            simd.splat(1.0 / (1.0 - self.exponent)) * (square * inverse) * power
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
