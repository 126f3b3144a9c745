//! Units of lengths and readings in files of other programs.

use std::fmt;
use std::str::FromStr;

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Metre.
    Metre,
    /// Centimetre.
    Centimetre,
    /// Millimetre.
    Millimetre,
    /// Micrometre.
    Micrometre,
    /// International inch, 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Micrometre, Self::Inch];

    /// A length in this unit, in millimetres. Millimetres stay as they are, other lengths are rounded to the nanometre.
    pub fn to_mm(self, length: f64) -> f64 {
        // Rounding gives a position its usual digits: 17.5, not 17.500000000000004.
        let nanometres = |mm: f64| (mm * 1e6).round() / 1e6;
        match self {
            Self::Millimetre => length,
            Self::Metre => nanometres(length * 1e3),
            Self::Centimetre => nanometres(length * 10.0),
            Self::Micrometre => nanometres(length / 1e3),
            Self::Inch => nanometres(length * 25.4),
        }
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Micrometre => "um",
            Self::Inch => "in",
        })
    }
}

impl FromStr for LengthUnit {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        Ok(match text.trim() {
            "m" | "metre" | "metres" | "meter" | "meters" => Self::Metre,
            "cm" => Self::Centimetre,
            "mm" | "millimetre" | "millimeter" => Self::Millimetre,
            "um" | "\u{b5}m" | "\u{3bc}m" | "micron" | "microns" => Self::Micrometre,
            "in" | "inch" | "inches" => Self::Inch,
            other => return Err(UnknownUnit::Length(other.to_owned())),
        })
    }
}

/// A unit of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleUnit {
    /// Radian.
    Radian,
    /// Degree.
    Degree,
}

impl AngleUnit {
    /// A value in this unit as radians.
    pub fn to_rad(self, value: f64) -> f64 {
        match self {
            Self::Radian => value,
            Self::Degree => value.to_radians(),
        }
    }
}

/// A unit of readings.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadingUnit {
    /// In proportion to the reading.
    Linear(Linear),
    /// Decibels above a reference; `None` means the largest reading of the file.
    Decibel(Option<Reference>),
    /// A phase, which stands beside an amplitude.
    Phase(AngleUnit),
}

/// A unit in proportion to one that a record keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// The unit of the record.
    pub base: Base,
    /// Power of ten of one unit in that of the record.
    exponent: i32,
}

/// A reading that decibels count from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Its value in the unit of the record, above zero.
    pub value: f64,
    /// The unit of the record.
    pub base: Base,
}

/// A unit that a record keeps readings in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// Volt.
    Volt,
    /// Pascal.
    Pascal,
    /// Steps of a converter.
    Count,
    /// No unit: relative to some reading.
    Relative,
}

impl Base {
    /// The unit as a record states it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Volt => "V",
            Self::Pascal => "Pa",
            Self::Count => "count",
            Self::Relative => "relative",
        }
    }

    /// Readings above this are absurd: a thousand volts is beyond every receiver, and the amplitude of sound in air cannot exceed the
    /// pressure of the air. In the unit itself; infinite if there is no such limit.
    pub fn most(self) -> f64 {
        match self {
            Self::Volt => 1e3,
            Self::Pascal => 101_325.0,
            Self::Count | Self::Relative => f64::INFINITY,
        }
    }
}

impl Linear {
    /// A reading in this unit, in the unit of the record.
    pub fn to_base(self, reading: f64) -> f64 {
        // Division by a power of ten is exact to the last digit where multiplication by a tenth is not.
        match self.exponent {
            0 => reading,
            down if down < 0 => reading / 10f64.powi(-down),
            up => reading * 10f64.powi(up),
        }
    }
}

impl ReadingUnit {
    /// The unit of the record that readings in this one are kept in; `None` for a phase.
    pub fn base(&self) -> Option<Base> {
        match self {
            Self::Linear(linear) => Some(linear.base),
            Self::Decibel(Some(reference)) => Some(reference.base),
            Self::Decibel(None) => Some(Base::Relative),
            Self::Phase(_) => None,
        }
    }
}

/// A unit that is not known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnknownUnit {
    /// Not one of length.
    #[error("`{0}` is not a unit of length: m, cm, mm, um or in is expected")]
    Length(String),
    /// Not one of readings.
    #[error(
        "`{0}` is not a unit of readings: V, mV, uV, Pa, kPa, count, relative, dB (relative to the largest reading), dB:1V or dB:20uPa is \
         expected; rad or deg for a phase beside an amplitude"
    )]
    Reading(String),
}

fn linear(text: &str) -> Option<Linear> {
    let (base, exponent) = match text {
        "V" | "volt" | "volts" => (Base::Volt, 0),
        "mV" => (Base::Volt, -3),
        "uV" | "\u{b5}V" | "\u{3bc}V" => (Base::Volt, -6),
        "Pa" => (Base::Pascal, 0),
        "kPa" => (Base::Pascal, 3),
        "mPa" => (Base::Pascal, -3),
        "uPa" | "\u{b5}Pa" | "\u{3bc}Pa" => (Base::Pascal, -6),
        "count" | "counts" => (Base::Count, 0),
        "relative" | "1" => (Base::Relative, 0),
        _ => return None,
    };
    Some(Linear { base, exponent })
}

/// A reference such as `1V` or `20 uPa`.
fn reference(text: &str) -> Option<Reference> {
    let text = text.trim();
    let unit_at = text.find(|c: char| !(c.is_ascii_digit() || ".+-".contains(c)))?;
    let (number, unit) = text.split_at(unit_at);
    let unit = linear(unit.trim())?;
    let value = unit.to_base(number.parse().ok()?);
    (value.is_finite() && value > 0.0).then_some(Reference { value, base: unit.base })
}

impl FromStr for ReadingUnit {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        let unknown = || UnknownUnit::Reading(text.trim().to_owned());
        let text = text.trim();
        if let Some(linear) = linear(text) {
            return Ok(Self::Linear(linear));
        }
        match text {
            "dB" => Ok(Self::Decibel(None)),
            "dBV" => Ok(Self::Decibel(reference("1V"))),
            "dBmV" => Ok(Self::Decibel(reference("1mV"))),
            "dBuV" => Ok(Self::Decibel(reference("1uV"))),
            "rad" => Ok(Self::Phase(AngleUnit::Radian)),
            "deg" | "\u{b0}" => Ok(Self::Phase(AngleUnit::Degree)),
            _ => {
                let reference = text.strip_prefix("dB:").and_then(reference).ok_or_else(unknown)?;
                Ok(Self::Decibel(Some(reference)))
            }
        }
    }
}

impl fmt::Display for ReadingUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear(linear) => match (linear.exponent, linear.base) {
                (0, base) => f.write_str(base.label()),
                (3, base) => write!(f, "k{}", base.label()),
                (-3, base) => write!(f, "m{}", base.label()),
                (_, base) => write!(f, "u{}", base.label()),
            },
            Self::Decibel(None) => f.write_str("dB relative to the largest reading"),
            Self::Decibel(Some(reference)) => {
                write!(f, "dB relative to {} {}", reference.value, reference.base.label())
            }
            Self::Phase(AngleUnit::Radian) => f.write_str("rad"),
            Self::Phase(AngleUnit::Degree) => f.write_str("deg"),
        }
    }
}

/// A name as it heads a column, without its unit, and the unit: `x_mm`, `x (mm)`, `x [mm]`, `x / mm`.
pub fn name_and_unit(heading: &str) -> (&str, Option<&str>) {
    let heading = heading.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some(inside) = heading.strip_suffix(close)
            && let Some((name, unit)) = inside.rsplit_once(open)
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    // Inches are not meant by the word `in` at the end of a name.
    let is_unit = |unit: &str| {
        unit != "in"
            && unit != "1"
            && (unit.parse::<LengthUnit>().is_ok() || unit.parse::<ReadingUnit>().is_ok())
    };
    for separator in ['/', '_', ' '] {
        if let Some((name, unit)) = heading.rsplit_once(separator)
            && is_unit(unit.trim())
            && !name.trim().is_empty()
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (heading, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_become_millimetres_with_their_usual_digits() {
        for (unit, length, mm) in [
            ("m", 0.0175, 17.5),
            ("cm", 1.75, 17.5),
            ("mm", 17.500000000000004, 17.500000000000004),
            ("\u{b5}m", 17500.0, 17.5),
            ("um", 0.1, 0.0001),
            ("in", 1.0, 25.4),
        ] {
            assert_eq!(unit.parse::<LengthUnit>().expect(unit).to_mm(length), mm, "{unit}");
        }
        assert!("furlong".parse::<LengthUnit>().is_err());
    }

    #[test]
    fn readings_have_a_unit_of_the_record() {
        for (unit, base, shown) in [
            ("V", Base::Volt, "V"),
            ("\u{3bc}V", Base::Volt, "uV"),
            ("kPa", Base::Pascal, "kPa"),
            ("dB", Base::Relative, "dB relative to the largest reading"),
            ("dB:1V", Base::Volt, "dB relative to 1 V"),
            ("dB:20uPa", Base::Pascal, "dB relative to 0.00002 Pa"),
            ("dBmV", Base::Volt, "dB relative to 0.001 V"),
        ] {
            let parsed: ReadingUnit = unit.parse().expect(unit);
            assert_eq!(parsed.base(), Some(base), "{unit}");
            assert_eq!(parsed.to_string(), shown);
        }
        for wrong in ["dB:", "dB:0V", "dB:-1V", "dB:1", "bar", "dB:1dB"] {
            assert!(wrong.parse::<ReadingUnit>().is_err(), "{wrong}");
        }
        let Ok(ReadingUnit::Linear(millivolt)) = "mV".parse() else { panic!("linear") };
        assert_eq!(millivolt.to_base(123.0), 0.123);
    }

    #[test]
    fn units_in_headings_are_recognised() {
        for (heading, name, unit) in [
            ("x_mm", "x", Some("mm")),
            ("x (mm)", "x", Some("mm")),
            ("Spannung [mV]", "Spannung", Some("mV")),
            ("x / mm", "x", Some("mm")),
            ("x mm", "x", Some("mm")),
            ("focus", "focus", None),
            ("log_in", "log_in", None),
            ("m", "m", None),
        ] {
            assert_eq!(name_and_unit(heading), (name, unit), "{heading}");
        }
    }
}
