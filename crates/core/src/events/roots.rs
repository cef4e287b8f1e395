//! The first time at which a gap closes: the first sign change of a polynomial, by Bernstein's form.
//!
//! On [0, 1] a polynomial lies between its smallest and largest Bernstein coefficient, and has no more roots than these
//! change sign: most pairs are told apart from those that meet by a glance at five numbers. Intervals with several sign
//! changes are halved, those with one are solved by bracketed Newton steps. No speed and no grazing angle slips through.

/// Halvings before a double root is taken as a graze that never closes the gap.
const DEPTH: u32 = 48;

/// The first tau in (0, h] at which a polynomial of degree N - 1 in tau goes from positive to negative, coefficients in
/// ascending order. `None` if it does not. A polynomial that is negative at 0 is none of this function's business: `None`.
#[must_use]
pub fn first_closing<const N: usize>(coefficients: &[f64; N], h: f64) -> Option<f64> {
    let bernstein = bernstein(coefficients, h);
    if bernstein.iter().all(|&b| b >= 0.0) || bernstein[0] < 0.0 {
        return None;
    }
    let share = first(&bernstein, 0.0, 1.0, 0)?;
    // The Bernstein form of a far-off polynomial has lost digits: the last steps go by the polynomial itself.
    Some(polished(coefficients, share * h, h))
}

/// Coefficients over [0, h] in Bernstein's basis: b_k = sum over j <= k of C(k, j)/C(n, j) a_j h^j.
fn bernstein<const N: usize>(coefficients: &[f64; N], h: f64) -> [f64; N] {
    let degree = N - 1;
    let mut result = [0.0; N];
    let mut power = 1.0;
    let mut choose = 1.0;
    for j in 0..N {
        let scaled = coefficients[j] * power / choose;
        let mut ways = 1.0;
        for k in j..N {
            result[k] += ways * scaled;
            ways = ways * (k + 1) as f64 / (k + 1 - j) as f64;
        }
        power *= h;
        choose = choose * (degree - j) as f64 / (j + 1) as f64;
    }
    result
}

/// First closing on [from, to] of [0, 1], from the Bernstein coefficients there; b_0 >= 0.
fn first<const N: usize>(b: &[f64; N], from: f64, to: f64, depth: u32) -> Option<f64> {
    let changes = sign_changes(b);
    if changes == 0 {
        // From zero at once to negative: closes where it begins.
        return (b[0] == 0.0 && b.iter().any(|&x| x < 0.0)).then_some(from);
    }
    if changes == 1 && b[0] > 0.0 {
        return Some(from + (to - from) * single(b));
    }
    if depth == DEPTH {
        return None;
    }
    let (left, right) = halves(b);
    let middle = 0.5 * (from + to);
    first(&left, from, middle, depth + 1).or_else(|| {
        // Negative here means that the closing was on the left and a graze: nothing to find on the right.
        if right[0] < 0.0 { Some(middle) } else { first(&right, middle, to, depth + 1) }
    })
}

/// Changes of sign along the coefficients; zeros do not count.
fn sign_changes<const N: usize>(b: &[f64; N]) -> usize {
    let mut last = 0.0;
    let mut changes = 0;
    for &x in b {
        if x != 0.0 {
            changes += usize::from(x * last < 0.0 || (x < 0.0) != (last < 0.0) && last != 0.0);
            last = x;
        }
    }
    changes
}

/// De Casteljau's halving.
fn halves<const N: usize>(b: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut left, mut right) = ([0.0; N], *b);
    left[0] = b[0];
    right[N - 1] = b[N - 1];
    let mut row = *b;
    for level in 1..N {
        for k in 0..N - level {
            row[k] = 0.5 * (row[k] + row[k + 1]);
        }
        left[level] = row[0];
        right[N - 1 - level] = row[N - 1 - level];
    }
    (left, right)
}

/// The one root of a polynomial that is positive at 0 and negative at 1, by bisection with de Casteljau's value.
fn single<const N: usize>(b: &[f64; N]) -> f64 {
    let value = |t: f64| {
        let mut row = *b;
        for level in 1..N {
            for k in 0..N - level {
                row[k] += t * (row[k + 1] - row[k]);
            }
        }
        row[0]
    };
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (b[0], b[N - 1]);
    // Illinois' variant of the rule of false position.
    for _ in 0..60 {
        let t = low + (high - low) * (at_low / (at_low - at_high));
        if !(t > low && t < high) || high - low < 1e-15 {
            break;
        }
        let at = value(t);
        if at > 0.0 {
            (low, at_low) = (t, at);
            at_high *= 0.5;
        } else if at < 0.0 {
            (high, at_high) = (t, at);
            at_low *= 0.5;
        } else {
            return t;
        }
    }
    low
}

/// Two Newton steps on the polynomial itself, kept where they are small.
fn polished<const N: usize>(coefficients: &[f64; N], tau: f64, h: f64) -> f64 {
    let mut tau = tau;
    for _ in 0..2 {
        let (mut value, mut slope) = (0.0, 0.0);
        for &c in coefficients.iter().rev() {
            slope = slope * tau + value;
            value = value * tau + c;
        }
        let step = -value / slope;
        if slope < 0.0 && step.abs() <= 1e-6 * h {
            tau = (tau + step).clamp(0.0, h);
        }
    }
    tau
}

#[cfg(test)]
mod tests {
    use super::first_closing;
    use rand::{Rng, SeedableRng};

    /// A polynomial with known roots.
    fn from_roots(roots: &[f64; 4], sign: f64) -> [f64; 5] {
        let mut c = [0.0; 5];
        c[0] = sign;
        for (degree, root) in roots.iter().enumerate() {
            for k in (0..=degree + 1).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        c
    }

    #[test]
    fn the_first_closing_is_found_among_known_roots() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let mut uniform =
            |low: f64, high: f64| low + (high - low) * ((rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64);
        let mut found = 0;
        for _ in 0..20_000 {
            let roots: [f64; 4] = std::array::from_fn(|_| uniform(-1.0, 2.0));
            let mut sorted = roots;
            sorted.sort_by(f64::total_cmp);
            if sorted.windows(2).any(|pair| pair[1] - pair[0] < 1e-3) || sorted.iter().any(|x| x.abs() < 1e-3) {
                continue;
            }
            for sign in [1.0, -1.0] {
                let c = from_roots(&roots, sign);
                let h = 1.5;
                let expected = if c[0] < 0.0 { None } else { sorted.iter().copied().find(|&x| x > 0.0 && x <= h) };
                let closing = first_closing(&c, h);
                match (expected, closing) {
                    (Some(x), Some(y)) => {
                        found += 1;
                        // Roots 1e-3 apart magnify round-off of the coefficients by up to 1e9.
                        assert!((x - y).abs() <= 1e-9, "{roots:?}: {y}, not {x}");
                    }
                    (None, None) => {}
                    _ => panic!("{roots:?} {sign}: {closing:?}, not {expected:?}"),
                }
            }
        }
        assert!(found > 5_000, "{found}");
    }

    #[test]
    fn grazes_and_starts_at_zero() {
        // (tau - 1/2)^2 touches and never closes; a little lower it does.
        assert_eq!(first_closing(&[0.25, -1.0, 1.0], 1.0), None);
        let tau = first_closing(&[0.25 - 1e-12, -1.0, 1.0], 1.0).unwrap();
        assert!((tau - (0.5 - 1e-6)).abs() <= 1e-9, "{tau}");
        // Parting from contact, then pressed together again.
        let tau = first_closing(&[0.0, 1.0, -2.0], 1.0).unwrap();
        assert!((tau - 0.5).abs() <= 1e-15, "{tau}");
        // Pressed from the start: at once.
        assert_eq!(first_closing(&[0.0, 0.0, -1.0], 1.0), Some(0.0));
        assert_eq!(first_closing(&[0.0, 0.0, 1.0], 1.0), None);
    }
}
