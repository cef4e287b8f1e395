//! Elementary functions of eight numbers at a time.
//!
//! They use only + - x, bit operations and (in `ln`) ÷, so they give the same bits on every instruction set. Errors
//! are those of their scalar twins in `math`.

use crate::math::{EXP_SERIES, LN_SERIES, LN2_HIGH, LN2_LOW, ROUND};
use crate::simd::{Bits, Lanes, Simd};

/// x = 2^k m with m in [sqrt(1/2), sqrt(2)), for positive, finite, normal numbers: k + 1023 as an integer, and m.
#[inline(always)]
fn split<S: Simd>(simd: S, x: S::F) -> (S::F, S::F) {
    const SQRT_HALF: u64 = 0x3FE6_A09E_0000_0000;
    const ONE: u64 = 0x3FF0_0000_0000_0000;
    let shifted = x.add_bits(simd.bits(ONE - SQRT_HALF));
    let mantissa = shifted.and_bits(simd.bits(0x000F_FFFF_FFFF_FFFF)).add_bits(simd.bits(SQRT_HALF));
    (shifted.shift_down::<52>(), mantissa)
}

/// An integer from 0 to 2^52, less `bias`.
#[inline(always)]
fn number<S: Simd>(simd: S, integer: S::F, bias: f64) -> S::F {
    const TWO_TO_52: u64 = 0x4330_0000_0000_0000;
    integer.or_bits(simd.bits(TWO_TO_52)) - simd.splat(4_503_599_627_370_496.0 + bias)
}

/// As [`crate::math::ln`], to the last bit.
#[inline(always)]
pub fn ln<S: Simd>(simd: S, x: S::F) -> S::F {
    let (biased, m) = split(simd, x);
    let k = number(simd, biased, 1023.0);
    let f = m - simd.splat(1.0);
    let s = f / (simd.splat(2.0) + f);
    let z = s * s;
    let r = polynomial(simd, &LN_SERIES, z) * z;
    let half_square = simd.splat(0.5) * f * f;
    k * simd.splat(LN2_HIGH) - ((half_square - (s * (half_square + r) + k * simd.splat(LN2_LOW))) - f)
}

/// Sums of logarithms as the logarithm of a product, which cannot overflow: one logarithm for any number of terms.
#[derive(Clone, Copy)]
pub struct LogarithmSum<F> {
    /// Sum of k + 1023, an integer.
    exponent: F,
    mantissa: F,
    /// Terms of each lane.
    terms: u64,
}

impl<F: Bits> LogarithmSum<F> {
    /// Of no terms.
    #[inline(always)]
    pub fn new<S: Simd<F = F>>(simd: S) -> Self {
        Self { exponent: simd.bits(0), mantissa: simd.splat(1.0), terms: 0 }
    }

    /// Adds ln x of positive, finite, normal numbers.
    #[inline(always)]
    pub fn add<S: Simd<F = F>>(&mut self, simd: S, x: F) {
        let (biased, mantissa) = split(simd, self.mantissa * x);
        *self = Self { exponent: self.exponent.add_bits(biased), mantissa, terms: self.terms + 1 };
    }

    /// The sum, off by at most half an ulp of 1 for each term beside the error of [`ln`].
    #[inline(always)]
    pub fn value<S: Simd<F = F>>(self, simd: S) -> F {
        // Exact below 10^12 terms, as in floating point.
        let exponent = number(simd, self.exponent, 1023.0 * self.terms as f64);
        exponent * simd.splat(LN2_HIGH) + (exponent * simd.splat(LN2_LOW) + ln(simd, self.mantissa))
    }
}

/// As [`crate::math::exp`], to the last bit.
#[inline(always)]
pub fn exp<S: Simd>(simd: S, x: S::F) -> S::F {
    let x = x.max(simd.splat(-708.0)).min(simd.splat(709.0));
    let shifted = x * simd.splat(std::f64::consts::LOG2_E) + simd.splat(ROUND);
    let k = shifted - simd.splat(ROUND);
    let r = (x - k * simd.splat(LN2_HIGH)) - k * simd.splat(LN2_LOW);
    polynomial(simd, &EXP_SERIES, r).add_bits(shifted.shift_up::<52>())
}

/// As in `math`: a polynomial, highest coefficient first, as two in x^2 side by side.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, coefficients: &[f64; N], x: S::F) -> S::F {
    let square = x * x;
    let mut sums = [simd.splat(coefficients[0]), simd.splat(coefficients[1])];
    for (k, &coefficient) in coefficients.iter().enumerate().skip(2) {
        sums[k % 2] = sums[k % 2] * square + simd.splat(coefficient);
    }
    let (even, odd) = (sums[(N - 1) % 2], sums[N % 2]);
    even + x * odd
}

/// Rounds to the nearest integer, ties to even, for |x| < 2^51.
#[inline(always)]
pub fn round<S: Simd>(simd: S, x: S::F) -> S::F {
    (x + simd.splat(ROUND)) - simd.splat(ROUND)
}

#[cfg(test)]
mod tests {
    use super::{LogarithmSum, exp, ln, round};
    use crate::math;
    use crate::simd::{Eight, Kernel, LEVELS, Lanes, Simd, dispatch_at};

    struct Map<F>(F, Eight);

    trait Function {
        fn of<S: Simd>(&self, simd: S, x: S::F) -> S::F;
    }

    macro_rules! functions {
        ($($name:ident => $function:path),*) => {
            $(#[derive(Clone, Copy)]
            struct $name;
            impl Function for $name {
                #[inline(always)]
                fn of<S: Simd>(&self, simd: S, x: S::F) -> S::F {
                    $function(simd, x)
                }
            })*
        };
    }
    functions!(Ln => ln, Exp => exp, Round => round);

    impl<F: Function> Kernel for Map<F> {
        type Output = Eight;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Eight {
            self.0.of(simd, simd.load(&self.1)).to_array()
        }
    }

    /// Values over the whole range, of both signs where wanted.
    fn samples(from: f64, to: f64) -> impl Iterator<Item = Eight> {
        (0..20_000).map(move |k| {
            std::array::from_fn(|l| from + (to - from) * (f64::from(8 * k + l as i32) + 0.37) / 160_000.0)
        })
    }

    fn same<F: Function + Copy>(f: F, twin: fn(f64) -> f64, from: f64, to: f64) {
        for level in LEVELS {
            for x in samples(from, to) {
                let got = dispatch_at(level, Map(f, x));
                assert_eq!(got.map(f64::to_bits), x.map(|x| twin(x).to_bits()), "{level:?} at {x:?}");
            }
        }
    }

    struct Added<'a>(&'a [Eight]);

    impl Kernel for Added<'_> {
        type Output = Eight;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Eight {
            let mut sum = LogarithmSum::new(simd);
            for x in self.0 {
                sum.add(simd, simd.load(x));
            }
            sum.value(simd).to_array()
        }
    }

    /// Products far beyond the largest number, on both sides of 1; each of 4000 terms may cost half an ulp of 1.
    #[test]
    fn logarithms_are_added_as_a_product() {
        let terms: Vec<Eight> = samples(1e-9, 3.0).take(2000).chain(samples(1e200, 1e300).take(2000)).collect();
        let first = dispatch_at(LEVELS[0], Added(&terms));
        for (k, got) in first.into_iter().enumerate() {
            let direct: math::Sum = terms.iter().map(|x| libm::log(x[k])).collect();
            let direct = direct.value();
            assert!(
                (got - direct).abs() <= 4000.0 * 0.5 * f64::EPSILON + direct.abs() * f64::EPSILON,
                "{got} {direct}"
            );
        }
        for level in LEVELS {
            assert_eq!(dispatch_at(level, Added(&terms)).map(f64::to_bits), first.map(f64::to_bits), "{level:?}");
        }
    }

    #[test]
    fn they_are_their_scalar_twins() {
        same(Ln, math::ln, 1e-3, 2.0);
        same(Ln, math::ln, 2.0, 1e9);
        same(Exp, math::exp, -720.0, 720.0);
        same(Exp, math::exp, -1.0, 1.0);
        same(Round, math::round, -10.0, 10.0);
    }
}
