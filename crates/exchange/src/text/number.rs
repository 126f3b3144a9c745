//! Numbers as programs of all languages write them.

use super::dialect::Decimal;

/// Words for a value that is missing, in lower case.
const MISSING: [&str; 11] =
    ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---", "missing"];

/// A cell as a number; NaN where the value is missing; `None` if it is neither.
pub(super) fn number(cell: &str, decimal: Decimal) -> Option<f64> {
    if is_missing(cell) {
        return Some(f64::NAN);
    }
    let plain = cell.bytes().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    if plain && decimal == Decimal::Point {
        return finite(cell.parse().ok()?);
    }
    let mut text = String::with_capacity(cell.len());
    for c in cell.chars() {
        match (c, decimal) {
            (',', Decimal::Comma) => text.push('.'),
            ('0'..='9' | '+' | '-' | 'e' | 'E', _) | ('.', Decimal::Point) => text.push(c),
            // The typographic minus.
            ('\u{2212}', _) => text.push('-'),
            // Exponents of Fortran.
            ('d' | 'D', _) => text.push('e'),
            _ => return infinite(cell),
        }
    }
    // `1,` is the cell of a list, not a number.
    if text.ends_with('.') && decimal == Decimal::Comma {
        return None;
    }
    finite(text.parse().ok()?)
}

/// Whether a cell says that its value is missing.
pub(super) fn is_missing(cell: &str) -> bool {
    cell.len() <= 7 && MISSING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Digits that name more than any number can hold are no number.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn infinite(cell: &str) -> Option<f64> {
    match cell.to_ascii_lowercase().as_str() {
        "inf" | "+inf" | "infinity" => Some(f64::INFINITY),
        "-inf" | "-infinity" => Some(f64::NEG_INFINITY),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_programs_are_read() {
        for (cell, value) in [
            ("1.5", 1.5),
            ("-1e-3", -1e-3),
            ("+2", 2.0),
            ("1.0D-03", 1e-3),
            ("\u{2212}4.5", -4.5),
            (".5", 0.5),
            ("-inf", f64::NEG_INFINITY),
        ] {
            assert_eq!(number(cell, Decimal::Point), Some(value), "{cell}");
        }
        assert_eq!(number("1,5", Decimal::Comma), Some(1.5));
        assert_eq!(number("-1,5E-3", Decimal::Comma), Some(-1.5e-3));
        for missing in ["", "NaN", "N/A", "--"] {
            assert!(number(missing, Decimal::Point).is_some_and(f64::is_nan), "{missing}");
        }
        for (wrong, decimal) in [
            ("1,5", Decimal::Point),
            ("1.5", Decimal::Comma),
            ("1,", Decimal::Comma),
            ("x", Decimal::Point),
            ("1e999", Decimal::Point),
            ("0x10", Decimal::Point),
            ("1+2i", Decimal::Point),
        ] {
            assert_eq!(number(wrong, decimal), None, "{wrong}");
        }
    }
}
