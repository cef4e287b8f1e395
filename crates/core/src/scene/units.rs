//! Reads strings such as `1 um` where a number belongs, to say which number was meant.

/// A hint for a string that stands where a number in `expected` unit belongs, if the string can be understood.
pub(super) fn hint(text: &str, expected: Option<&str>) -> Option<String> {
    let text = text.trim();
    let (number, unit) = split(text)?;
    if unit.is_empty() {
        return Some(format!("write {number} without quotes"));
    }
    let Some(quantity) = quantity(unit, expected) else {
        return Some(match expected {
            Some(expected) => format!("write the number alone, in {expected}"),
            None => "write the number alone, without a unit".into(),
        });
    };
    if let Some(expected) = expected
        && expected != quantity.base
    {
        return Some(format!("`{unit}` is no unit of this quantity; write the number alone, in {expected}"));
    }
    Some(format!("write {}", quantity.convert(number)))
}

/// A unit as a multiple of an SI unit.
struct Quantity {
    /// SI unit.
    base: &'static str,
    /// Decimal exponent of the multiple.
    exponent: i32,
    /// The rest of the multiple.
    factor: f64,
    /// What is added after multiplying.
    offset: f64,
}

impl Quantity {
    fn convert(&self, number: &str) -> String {
        // Moving the decimal exponent in the text is exact where multiplying by 1e-6 is not.
        let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
        let exponent = exponent.parse::<i32>().unwrap_or(0).saturating_add(self.exponent);
        let value = format!("{mantissa}e{exponent}").parse::<f64>().unwrap_or(f64::NAN) * self.factor + self.offset;
        if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
    }
}

/// Splits a leading number from what follows it.
fn split(text: &str) -> Option<(&str, &str)> {
    // The longest prefix that is a number; prefixes are tried from the end, so that `1e3` is not `1` and `e3`.
    let ends = text.char_indices().map(|(k, c)| k + c.len_utf8()).filter(|&end| end <= 40);
    let mut best = None;
    for end in ends {
        let candidate = &text[..end];
        let digits = candidate.ends_with(|c: char| c.is_ascii_digit());
        if digits && candidate.parse::<f64>().is_ok_and(f64::is_finite) {
            best = Some(end);
        }
    }
    best.map(|end| (&text[..end], text[end..].trim()))
}

fn quantity(unit: &str, expected: Option<&str>) -> Option<Quantity> {
    let decimal = |base, exponent| Some(Quantity { base, exponent, factor: 1.0, offset: 0.0 });
    let scaled = |base, factor| Some(Quantity { base, exponent: 0, factor, offset: 0.0 });
    let unit = unit.replace(['µ', 'μ'], "u").replace('²', "^2").replace('³', "^3").replace(['·', '*'], " ");
    match unit.as_str() {
        "°C" | "℃" | "degC" | "celsius" | "Celsius" => {
            return Some(Quantity { base: "K", exponent: 0, factor: 1.0, offset: 273.15 });
        }
        // A coulomb where a charge is asked for, a degree where a temperature is.
        "C" if expected == Some("K") => return Some(Quantity { base: "K", exponent: 0, factor: 1.0, offset: 273.15 }),
        "min" => return scaled("s", 60.0),
        "h" => return scaled("s", 3600.0),
        "d" => return scaled("s", 86_400.0),
        "Å" => return decimal("m", -10),
        "km/h" => return scaled("m/s", 1.0 / 3.6),
        "g/cm^3" | "g/cm3" | "g/cc" => return decimal("kg/m^3", 3),
        "kg/m3" => return decimal("kg/m^3", 0),
        "e" => return scaled("C", 1.602_176_634e-19),
        "t" => return decimal("kg", 3),
        "J/kg/K" | "J/kgK" => return decimal("J/(kg K)", 0),
        "J/m2" => return decimal("J/m^2", 0),
        "m/s2" => return decimal("m/s^2", 0),
        "%" => return None,
        _ => {}
    }
    // The numerator may carry a prefix; what follows the first stroke must be as in the SI unit.
    let (head, tail) = unit.find('/').map_or((unit.as_str(), ""), |at| unit.split_at(at));
    let (symbol, exponent) = prefixed(head)?;
    let whole = format!("{symbol}{tail}");
    let base = BASES.iter().find(|base| **base == whole)?;
    decimal(base, exponent)
}

/// SI units that a scene uses.
const BASES: [&str; 15] =
    ["m", "s", "kg", "K", "C", "N", "J", "V", "Hz", "m/s", "m/s^2", "kg/m^3", "J/m^2", "V/m", "J/(kg K)"];

/// Splits `um` into `m` and −6. The kilogram counts from the gram.
fn prefixed(symbol: &str) -> Option<(&'static str, i32)> {
    const PREFIXES: [(&str, i32); 11] = [
        ("", 0),
        ("f", -15),
        ("p", -12),
        ("n", -9),
        ("u", -6),
        ("m", -3),
        ("c", -2),
        ("d", -1),
        ("k", 3),
        ("M", 6),
        ("G", 9),
    ];
    const SYMBOLS: [(&str, &str, i32); 9] = [
        ("m", "m", 0),
        ("s", "s", 0),
        ("g", "kg", -3),
        ("K", "K", 0),
        ("C", "C", 0),
        ("N", "N", 0),
        ("J", "J", 0),
        ("V", "V", 0),
        ("Hz", "Hz", 0),
    ];
    PREFIXES.iter().find_map(|(prefix, power)| {
        let rest = symbol.strip_prefix(prefix)?;
        let (_, base, shift) = SYMBOLS.iter().find(|(name, ..)| *name == rest)?;
        Some((*base, power + shift))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_with_units_are_understood() {
        for (text, unit, expected) in [
            ("1 um", "m", "write 1e-6"),
            ("1um", "m", "write 1e-6"),
            ("3 µm", "m", "write 3e-6"),
            ("2.5 mm", "m", "write 0.0025"),
            ("12 cm", "m", "write 0.12"),
            ("7e2 nm", "m", "write 7e-7"),
            ("5 ms", "s", "write 0.005"),
            ("20 us", "s", "write 2e-5"),
            ("2 min", "s", "write 120"),
            ("5 g", "kg", "write 0.005"),
            ("3 kg", "kg", "write 3"),
            ("1 mg", "kg", "write 1e-6"),
            ("20 °C", "K", "write 293.15"),
            ("20 C", "K", "write 293.15"),
            ("20 nC", "C", "write 2e-8"),
            ("-3 C", "C", "write -3"),
            ("2 g/cm^3", "kg/m^3", "write 2000"),
            ("2000 kg/m³", "kg/m^3", "write 2000"),
            ("2 MJ/m^2", "J/m^2", "write 2e6"),
            ("10 cm/s", "m/s", "write 0.1"),
            ("5", "m", "write 5 without quotes"),
            ("1e-3", "m", "write 1e-3 without quotes"),
            ("5 ms", "m", "`ms` is no unit of this quantity; write the number alone, in m"),
            ("5 furlongs", "m", "write the number alone, in m"),
        ] {
            assert_eq!(hint(text, Some(unit)).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(hint("fast", Some("m/s")), None);
        assert_eq!(hint("", None), None);
        assert_eq!(hint("20 %", None).as_deref(), Some("write the number alone, without a unit"));
    }
}
