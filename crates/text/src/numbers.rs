//! Numbers as text, with as many digits as their uncertainty justifies.

use serde::{Deserialize, Deserializer, Serialize};

/// A number and its standard error, both in the same unit. In JSON, `null` stands for NaN.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncertain {
    /// Best estimate.
    #[serde(deserialize_with = "or_nan")]
    pub value: f64,
    /// Standard error (one standard deviation); NaN if it is not determined.
    #[serde(deserialize_with = "or_nan")]
    pub standard_error: f64,
}

/// JSON has no NaN: writers put `null` in its place.
fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Placeholder for a missing number.
pub const ABSENT: &str = "\u{2013}";

/// A number with its standard error to two digits, `12.34 ± 0.56`; four digits and no error if the error is zero or
/// unknown.
pub fn uncertain(number: Uncertain) -> String {
    let Uncertain { value, standard_error: error } = number;
    if !value.is_finite() {
        return ABSENT.to_owned();
    }
    if !error.is_finite() || error <= 0.0 {
        return significant(value, 4);
    }
    let largest = value.abs().max(error);
    if !(1e-4..1e6).contains(&largest) {
        let power = largest.log10().floor() as i32;
        let unit = 10f64.powi(power);
        let mantissa = with_error(value / unit, error / unit);
        return format!("({mantissa}) × 10{}", superscript(power));
    }
    with_error(value, error)
}

fn with_error(value: f64, error: f64) -> String {
    let decimals = (1.0 - error.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{} ± {error:.decimals$}", fixed(value, decimals))
}

/// A length in metres as millimetres with its error, without the unit.
pub fn millimetres(length_m: Uncertain) -> String {
    uncertain(Uncertain {
        value: length_m.value * 1e3,
        standard_error: length_m.standard_error * 1e3,
    })
}

/// A height in metres as millimetres, to the micrometre, without trailing zeros and without the unit.
pub fn height_mm(height_m: f64) -> String {
    let text = fixed(height_m * 1e3, 3);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A ratio as a percentage: three digits, two decimals at most; a no-break space before the sign.
pub fn percent(ratio: f64) -> String {
    let percent = 100.0 * ratio;
    if !percent.is_finite() {
        return ABSENT.to_owned();
    }
    let decimals = match percent.abs() {
        below if below < 10.0 => 2,
        below if below < 100.0 => 1,
        _ => 0,
    };
    format!("{}\u{a0}%", fixed(percent, decimals))
}

/// A number to some significant digits; digits before the decimal point are never dropped.
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return ABSENT.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let power = value.abs().log10().floor() as i32;
    if !(-4..6).contains(&power) {
        let decimals = (digits - 1).max(0) as usize;
        return format!(
            "{} × 10{}",
            fixed(value / 10f64.powi(power), decimals),
            superscript(power)
        );
    }
    fixed(value, (digits - 1 - power).max(0) as usize)
}

/// A number with some decimals and a true minus sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return ABSENT.to_owned();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        // No minus before a number rounded to zero.
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => text,
    }
}

/// A text in which `10^12` is written as 10¹².
pub fn raised(words: &str) -> String {
    let mut pieces = words.split("10^");
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let end = piece.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(piece.len());
        text += "10";
        match piece[..end].parse() {
            Ok(power) => text += &superscript(power),
            Err(_) => text.extend(["^", &piece[..end]]),
        }
        text += &piece[end..];
    }
    text
}

fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect()
}

/// A text with minus signs in place of hyphens before numbers: `-6 dB`, but not `6-8 mm`.
pub fn with_minus_signs(text: &str) -> String {
    let characters: Vec<char> = text.chars().collect();
    let is_minus = |place: usize| {
        let before = place.checked_sub(1).map(|before| characters[before]);
        let after = characters.get(place + 1);
        characters[place] == '-'
            && after.is_some_and(char::is_ascii_digit)
            && before.is_none_or(|before| !before.is_alphanumeric())
    };
    (0..characters.len())
        .map(|place| if is_minus(place) { '\u{2212}' } else { characters[place] })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64, standard_error: f64) -> String {
        uncertain(Uncertain { value, standard_error })
    }

    #[test]
    fn the_error_determines_the_digits() {
        assert_eq!(number(12.3456, 0.234), "12.35 ± 0.23");
        assert_eq!(number(-0.98765, 0.0123), "−0.988 ± 0.012");
        assert_eq!(number(8588.0, 296.0), "8588 ± 296");
        assert_eq!(number(0.001, 0.12), "0.00 ± 0.12");
        assert_eq!(number(3.1e-7, 2.2e-9), "(3.100 ± 0.022) × 10⁻⁷");
    }

    #[test]
    fn powers_of_ten_are_superscripts() {
        assert_eq!(raised("beyond 1 : 10^12"), "beyond 1 : 10¹²");
        assert_eq!(raised("10^-9, 10^3 and 10^"), "10⁻⁹, 10³ and 10^");
        assert_eq!(raised("pitch"), "pitch");
    }

    #[test]
    fn numbers_without_error_have_four_digits() {
        assert_eq!(number(12.3456, f64::NAN), "12.35");
        assert_eq!(number(0.0, 0.0), "0");
        assert_eq!(number(f64::NAN, 1.0), ABSENT);
        assert_eq!(significant(-0.00000123, 3), "−1.23 × 10⁻⁶");
    }

    #[test]
    fn percentages_have_three_digits() {
        assert_eq!(percent(0.0134), "1.34\u{a0}%");
        assert_eq!(percent(0.182), "18.2\u{a0}%");
        assert_eq!(percent(1.0), "100\u{a0}%");
        assert_eq!(percent(f64::NAN), ABSENT);
        assert_eq!(percent(-1e-9), "0.00\u{a0}%");
    }

    #[test]
    fn negative_zero_is_written_as_zero() {
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-1.006, 2), "−1.01");
    }

    #[test]
    fn heights_have_no_trailing_zeros() {
        assert_eq!((height_mm(0.1), height_mm(0.0125)), ("100".to_owned(), "12.5".to_owned()));
        assert_eq!(height_mm(0.0), "0");
    }

    #[test]
    fn hyphens_before_numbers_become_minus_signs() {
        assert_eq!(
            with_minus_signs("-1 (-6 dB), d^-1.002, 6-8 mm, on-axis"),
            "\u{2212}1 (\u{2212}6 dB), d^\u{2212}1.002, 6-8 mm, on-axis"
        );
    }
}
