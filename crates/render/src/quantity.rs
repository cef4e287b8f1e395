//! Numbers on pictures: units with prefixes, round steps, and as many decimals as are needed.

/// A unit that values are shown in.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// What a value in SI units is multiplied by [-].
    pub factor: f64,
    /// How it is written.
    pub name: String,
}

const PREFIXES: [(i32, &str); 12] = [
    (-24, "y"),
    (-21, "z"),
    (-18, "a"),
    (-15, "f"),
    (-12, "p"),
    (-9, "n"),
    (-6, "µ"),
    (-3, "m"),
    (3, "k"),
    (6, "M"),
    (9, "G"),
    (12, "T"),
];

impl Unit {
    /// The unit of an SI symbol in which numbers up to this one are short. Seconds and kelvins have no prefixes for many
    /// of them, and kelvins none at all.
    pub fn new(symbol: &str, largest: f64) -> Self {
        let largest = largest.abs();
        let plain = Self { factor: 1.0, name: symbol.to_owned() };
        if !largest.is_finite() || largest == 0.0 || (0.1..1e4).contains(&largest) {
            return plain;
        }
        let exponent = 3 * libm::floor(libm::log10(largest) / 3.0) as i32;
        let usual = match symbol {
            "K" => false,
            "s" => exponent < 0,
            _ => true,
        };
        let (factor, power) = (libm::pow(10.0, -f64::from(exponent)), power_of_ten(exponent));
        match PREFIXES.iter().find(|(of, _)| *of == exponent) {
            _ if exponent == 0 || (symbol == "K" && largest < 1e6) => plain,
            Some((_, prefix)) if usual => Self { factor, name: format!("{prefix}{symbol}") },
            _ => Self { factor, name: format!("{power} {symbol}") },
        }
    }
}

/// 10 with a raised exponent.
fn power_of_ten(exponent: i32) -> String {
    let raised = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).unwrap_or(c),
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

/// The largest of 1, 2, 5 times a power of ten that is at most `value`.
pub fn round_down(value: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(value)));
    let lead = value / power * (1.0 + 1e-9);
    power
        * if lead >= 5.0 {
            5.0
        } else if lead >= 2.0 {
            2.0
        } else {
            1.0
        }
}

/// The least number of two digits that is at least `value`; `value` itself where that is not above zero.
pub fn round_up(value: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(value)) - 1.0);
    let rounded = libm::ceil(value / power * (1.0 - 1e-12)) * power;
    if rounded.is_finite() && value > 0.0 { rounded } else { value }
}

/// Round numbers from `low` to `high`, at most about `count`, and how many decimals they need.
pub fn ticks(low: f64, high: f64, count: usize) -> (Vec<f64>, usize) {
    let least = (high - low) / count as f64;
    // Tenfold, because rounding down is what there is.
    let step = [1.0, 2.0, 2.5, 5.0, 10.0]
        .map(|lead| lead * libm::pow(10.0, libm::floor(libm::log10(least))))
        .into_iter()
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(least);
    let (first, last) = (libm::ceil(low / step - 1e-6), libm::floor(high / step + 1e-6));
    // Steps that twelve digits do not show are none.
    if !(step > 1e-12 * low.abs().max(high.abs()) && step.is_finite() && last - first < 100.0) {
        return (vec![low, high], 6);
    }
    let values = (0..=(last - first) as u32).map(|k| (first + f64::from(k)) * step).collect();
    (values, decimals(step))
}

/// Decimals that a step of this size needs to be told from none.
pub fn decimals(step: f64) -> usize {
    (0..12)
        .find(|&k| {
            (step * libm::pow(10.0, k as f64)).fract().min(1.0 - (step * libm::pow(10.0, k as f64)).fract()) < 1e-6
        })
        .unwrap_or(12)
}

/// A number with a proper minus sign.
pub fn label(value: f64, decimals: usize) -> String {
    // Zero has no sign.
    let text = format!("{:.decimals$}", value + 0.0);
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// How the times of moments are written: all alike, with three digits, and more where two would look the same.
#[derive(Clone, Debug)]
pub struct Clock {
    unit: Unit,
    decimals: usize,
}

impl Clock {
    /// For these times in rising order [s].
    pub fn new(times: &[f64]) -> Self {
        let latest = times.iter().fold(0.0_f64, |latest, t| latest.max(t.abs()));
        let unit = Unit::new("s", latest);
        let nearest = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|d| *d > 0.0).fold(latest, f64::min);
        let digits = |value: f64| (-libm::floor(libm::log10(value * unit.factor * (1.0 + 1e-9)))).clamp(0.0, 9.0);
        let decimals =
            if latest > 0.0 { (digits(latest) + 2.0).min(digits(latest / 100.0)).max(digits(nearest)) } else { 0.0 };
        Self { decimals: decimals as usize, unit }
    }

    /// A time [s].
    pub fn text(&self, t: f64) -> String {
        format!("t = {} {}", label(t * self.unit.factor, self.decimals), self.unit.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_keep_numbers_short() {
        for (symbol, largest, name, shown) in [
            ("s", 5.0, "s", 5.0),
            ("s", 3.5e-8, "ns", 35.0),
            ("s", 2e5, "10³ s", 200.0),
            ("K", 400.0, "K", 400.0),
            ("K", 34_600.0, "K", 34_600.0),
            ("K", 2e7, "10⁶ K", 20.0),
            ("C", 1e-7, "nC", 100.0),
            ("m/s", 0.02, "mm/s", 20.0),
            ("m/s", 2e30, "10³⁰ m/s", 2.0),
            ("m", 0.0, "m", 0.0),
        ] {
            let unit = Unit::new(symbol, largest);
            assert_eq!(unit.name, name);
            assert!((largest * unit.factor - shown).abs() <= 1e-9 * shown, "{largest}: {unit:?}");
        }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |low, high| {
            let (values, decimals) = ticks(low, high, 6);
            values.iter().map(|&v| label(v, decimals)).collect::<Vec<_>>()
        };
        assert_eq!(labels(300.0, 400.0), ["300", "320", "340", "360", "380", "400"]);
        assert_eq!(labels(-1.0, 1.0), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(0.0, 0.13), ["0.000", "0.025", "0.050", "0.075", "0.100", "0.125"]);
        assert_eq!(ticks(1.0, 1.0 + 1e-14, 6).0.len(), 2, "too narrow for round numbers");
    }

    #[test]
    fn times_are_told_apart() {
        let text = |times: &[f64]| times.iter().map(|&t| Clock::new(times).text(t)).collect::<Vec<_>>();
        assert_eq!(text(&[0.0, 0.71, 5.0]), ["t = 0.00 s", "t = 0.71 s", "t = 5.00 s"]);
        assert_eq!(text(&[4.999, 5.0]), ["t = 4.999 s", "t = 5.000 s"]);
        assert_eq!(text(&[0.0]), ["t = 0 s"]);
        assert_eq!(text(&[0.2]), ["t = 0.200 s"]);
        assert_eq!(text(&[1200.0]), ["t = 1200 s"]);
    }

    #[test]
    fn ends_are_rounded_up() {
        for (value, round) in [(1234.0, 1300.0), (1200.0, 1200.0), (0.0101, 0.011), (99.5, 100.0)] {
            assert!((round_up(value) / round - 1.0).abs() < 1e-9, "{value}");
        }
        assert_eq!(round_up(0.0), 0.0);
    }

    #[test]
    fn lengths_are_rounded_down() {
        for (value, round) in [(0.3, 0.2), (0.5, 0.5), (9.9, 5.0), (1.0, 1.0), (0.0021, 0.002)] {
            assert!((round_down(value) / round - 1.0).abs() < 1e-9, "{value}");
        }
    }
}
