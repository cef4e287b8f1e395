//! Branch-free elementary functions that the compiler can put into vector lanes.
//!
//! They use only + - x / and bit operations, so they give the same bits on every machine and instruction set; the
//! standard library's may not. Errors against correctly rounded values are measured by the tests below.

/// ln 2 in two parts: the first has 20 trailing zero bits, so that k * LN2_HIGH is exact for every exponent k.
pub(crate) const LN2_HIGH: f64 = f64::from_bits(0x3FE6_2E42_FEE0_0000);
/// The rest of ln 2.
pub(crate) const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Adding and subtracting 1.5 * 2^52 rounds to the nearest integer, and leaves it in the low bits.
pub(crate) const ROUND: f64 = 6_755_399_441_055_744.0;

/// 2 artanh(s) - 2 s over s^3 as a series in z = s^2. The next term, 2/25 z^10, is below 2e-18 of the sum for |s| <= 0.1716.
pub(crate) const LN_SERIES: [f64; 11] = [
    2.0 / 23.0,
    2.0 / 21.0,
    2.0 / 19.0,
    2.0 / 17.0,
    2.0 / 15.0,
    2.0 / 13.0,
    2.0 / 11.0,
    2.0 / 9.0,
    2.0 / 7.0,
    2.0 / 5.0,
    2.0 / 3.0,
];
/// The exponential series: 1/13!, .., 1/2!, 1, 1; the next term is below 5e-18.
pub(crate) const EXP_SERIES: [f64; 14] = {
    let mut series = [1.0; 14];
    let mut n = 12;
    while n > 0 {
        n -= 1;
        series[n] = series[n + 1] / (13 - n) as f64;
    }
    series
};

/// Natural logarithm of a positive, finite, normal number; at most 1 ulp off.
///
/// x = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)); ln(1 + f) = 2 artanh(f / (2 + f)) as its Taylor series.
#[inline(always)]
#[must_use]
pub fn ln(x: f64) -> f64 {
    const SQRT_HALF: u64 = 0x3FE6_A09E_0000_0000;
    const ONE: u64 = 0x3FF0_0000_0000_0000;
    const TWO_TO_52: u64 = 0x4330_0000_0000_0000;
    let shifted = x.to_bits().wrapping_add(ONE - SQRT_HALF);
    let k = f64::from_bits(TWO_TO_52 | (shifted >> 52)) - (4_503_599_627_370_496.0 + 1023.0);
    let f = f64::from_bits((shifted & 0x000F_FFFF_FFFF_FFFF) + SQRT_HALF) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let r = polynomial(&LN_SERIES, z);
    let r = r * z;
    let half_square = 0.5 * f * f;
    k * LN2_HIGH - ((half_square - (s * (half_square + r) + k * LN2_LOW)) - f)
}

/// Exponential function; at most 1 ulp off for -708 <= x <= 709, clamped to those ends beyond them.
///
/// x = k ln 2 + r with |r| <= ln(2)/2; e^r as its Taylor series, 2^k added to the exponent bits.
#[inline(always)]
#[must_use]
pub fn exp(x: f64) -> f64 {
    let x = if x > -708.0 { x } else { -708.0 };
    let x = if x < 709.0 { x } else { 709.0 };
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN2_HIGH) - k * LN2_LOW;
    let sum = polynomial(&EXP_SERIES, r);
    f64::from_bits(sum.to_bits().wrapping_add(shifted.to_bits() << 52))
}

/// A polynomial, highest coefficient first, as two in x^2 (even and odd powers) that can be evaluated side by side.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let square = x * x;
    // sums[p] holds the powers of the parity of N - 1 - p.
    let mut sums = [coefficients[0], coefficients[1]];
    for (k, &coefficient) in coefficients.iter().enumerate().skip(2) {
        sums[k % 2] = sums[k % 2] * square + coefficient;
    }
    // The last coefficient, of x^0, went to parity (N - 1) % 2.
    let (even, odd) = (sums[(N - 1) % 2], sums[N % 2]);
    even + x * odd
}

/// Rounds to the nearest integer, ties to even, for |x| < 2^51.
#[inline(always)]
#[must_use]
pub fn round(x: f64) -> f64 {
    (x + ROUND) - ROUND
}

/// The median of some numbers, the upper one of two; 0 of none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if finite.is_empty() {
        return 0.0;
    }
    let middle = finite.len() / 2;
    *finite.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// A sum that keeps the low bits (Neumaier): its error does not grow with the number of terms.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sum {
    sum: f64,
    low: f64,
}

impl Sum {
    /// Adds a term.
    #[inline]
    pub fn add(&mut self, x: f64) {
        let t = self.sum + x;
        self.low += if self.sum.abs() >= x.abs() { (self.sum - t) + x } else { (x - t) + self.sum };
        self.sum = t;
    }

    /// The sum so far.
    #[must_use]
    pub fn value(self) -> f64 {
        self.sum + self.low
    }
}

impl FromIterator<f64> for Sum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::default();
        for term in terms {
            sum.add(term);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::{Sum, exp, ln};

    /// Largest error in units in the last place against libm, itself within 1 ulp (so 2 allows ours 1).
    fn worst_ulp(ours: fn(f64) -> f64, reference: fn(f64) -> f64, from: f64, to: f64) -> f64 {
        let mut worst: f64 = 0.0;
        for k in 0..200_000 {
            let x = from + (to - from) * (f64::from(k) + 0.37) / 200_000.0;
            let (a, b) = (ours(x), reference(x));
            let ulp = f64::from_bits(b.abs().to_bits() + 1) - b.abs();
            worst = worst.max((a - b).abs() / ulp);
        }
        worst
    }

    #[test]
    fn ln_and_exp_are_within_their_stated_error() {
        assert!(worst_ulp(ln, libm::log, 1e-3, 0.9) <= 2.0);
        assert!(worst_ulp(ln, libm::log, 0.9, 1.1) <= 2.0);
        assert!(worst_ulp(ln, libm::log, 1.1, 1e6) <= 2.0);
        assert!(worst_ulp(|x| ln(libm::exp(x)), |x| x, 300.0, 700.0) <= 2.0);
        assert!(worst_ulp(exp, libm::exp, -700.0, 700.0) <= 2.0);
        assert!(worst_ulp(exp, libm::exp, -1.0, 1.0) <= 2.0);
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(exp(0.0), 1.0);
    }

    #[test]
    fn a_sum_keeps_what_cancels() {
        let sum: Sum = [1e100, 1.0, -1e100].into_iter().collect();
        assert_eq!(sum.value(), 1.0);
    }
}
