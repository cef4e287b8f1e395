//! Collocation points on [0, 1]: Gauss and Radau nodes as roots of Legendre polynomials, found to the last bits.

/// Which family of points; the number is how many there are, s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// s Gauss-Legendre points, both ends excluded; quadrature of order 2 s, symmetric.
    Gauss(usize),
    /// s Gauss-Radau points with the start of the step; quadrature of order 2 s - 1.
    Radau(usize),
}

impl Family {
    /// The points, ascending, length s [-].
    #[must_use]
    pub fn nodes(self) -> Vec<f64> {
        match self {
            Self::Gauss(s) => roots(s, |c| legendre(s, c)),
            // P_s + P_(s-1) vanishes at x = -1, which is the start.
            Self::Radau(s) => {
                std::iter::once(0.0).chain(roots(s - 1, |c| legendre(s, c) + legendre(s - 1, c))).collect()
            }
        }
    }

    /// Order of the quadrature, and of the scheme on smooth motion.
    #[must_use]
    pub fn order(self) -> u32 {
        let order = match self {
            Self::Gauss(s) => 2 * s,
            Self::Radau(s) => 2 * s - 1,
        };
        order as u32
    }
}

/// Points and weights of the Gauss-Legendre quadrature with s points on [0, 1] [-].
#[must_use]
pub fn gauss_quadrature(s: usize) -> Vec<(f64, f64)> {
    let weight = |c: f64| {
        // 1 - x^2 = 4 c (1 - c); w = 2 (1 - x^2) / (s P_(s-1))^2 on [-1, 1], half of that here.
        let p = s as f64 * legendre(s - 1, c);
        4.0 * c * (1.0 - c) / (p * p)
    };
    Family::Gauss(s).nodes().into_iter().map(|c| (c, weight(c))).collect()
}

/// Legendre polynomial P_n(2 c - 1), by its recurrence.
fn legendre(n: usize, c: f64) -> f64 {
    let x = 2.0 * c - 1.0;
    let (mut before, mut p) = (1.0, x);
    if n == 0 {
        return before;
    }
    for k in 1..n {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0));
    }
    p
}

/// The simple roots of f inside (0, 1), of which there are `count` no closer than 1/1000: a scan, then bisection to
/// neighbouring numbers.
fn roots(count: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    const SCAN: u32 = 2000;
    // Half a cell off, so that 1/2 and the ends are not met exactly.
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SCAN);
    let mut found = Vec::with_capacity(count);
    for k in 0..SCAN - 1 {
        let (mut low, mut high) = (at(k), at(k + 1));
        let rising = f(low) < 0.0;
        if rising == (f(high) < 0.0) {
            continue;
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if (f(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        found.push(low);
    }
    debug_assert_eq!(found.len(), count);
    found
}

#[cfg(test)]
mod tests {
    use super::{Family, gauss_quadrature};

    /// Against the closed forms, and the Radau spacings that Everhart (1985) printed.
    #[test]
    fn nodes_are_the_known_ones() {
        let close = |found: &[f64], known: &[f64]| {
            assert_eq!(found.len(), known.len());
            for (a, b) in found.iter().zip(known) {
                // Points of [0, 1], from a recurrence in x = 2 c - 1: two ulps of 1.
                assert!((a - b).abs() <= 4.5e-16, "{a} for {b}");
            }
        };
        let third = (1.0_f64 / 3.0).sqrt() / 2.0;
        close(&Family::Gauss(2).nodes(), &[0.5 - third, 0.5 + third]);
        close(&Family::Radau(2).nodes(), &[0.0, 2.0 / 3.0]);
        close(
            &Family::Radau(8).nodes(),
            &[
                0.0,
                0.056_262_560_536_922_15,
                0.180_240_691_736_892_36,
                0.352_624_717_113_169_6,
                0.547_153_626_330_555_4,
                0.734_210_177_215_410_5,
                0.885_320_946_839_095_8,
                0.977_520_613_561_287_5,
            ],
        );
    }

    #[test]
    fn quadrature_is_exact_up_to_its_order() {
        let rule = gauss_quadrature(9);
        for power in 0..18 {
            let sum: f64 = rule.iter().map(|(c, w)| w * c.powi(power)).sum();
            let exact = 1.0 / (f64::from(power) + 1.0);
            // Nine terms of at most 1, each within a few ulps.
            assert!((sum - exact).abs() <= 2e-15, "{power}: {sum} for {exact}");
        }
    }
}
