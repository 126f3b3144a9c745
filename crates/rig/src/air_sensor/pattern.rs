//! The values in a line of a sensor, read by a pattern such as `T={temperature_c} RH={humidity_percent}`.

use serde::Deserialize;

use super::AirReading;

/// Plausible temperatures in a laboratory, °C; other values are taken for damage.
const TEMPERATURES_C: std::ops::RangeInclusive<f64> = -60.0..=100.0;
/// Plausible pressures, kPa.
const PRESSURES_KPA: std::ops::RangeInclusive<f64> = 30.0..=120.0;
/// Plausible humidities, percent; a sensor in fog reports slightly more than 100.
const HUMIDITIES_PERCENT: std::ops::RangeInclusive<f64> = 0.0..=105.0;

/// Text with numbers in it that have a meaning.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct LinePattern(Vec<Part>);

#[derive(Debug, Clone, PartialEq)]
enum Part {
    /// Stands there as it is; a space stands for any number of them.
    Text(String),
    Number(Meaning),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Celsius,
    Fahrenheit,
    Kelvin,
    Percent,
    Kilopascals,
    Hectopascals,
    Pascals,
    Nothing,
}

const NAMES: [(&str, Meaning); 8] = [
    ("temperature_c", Meaning::Celsius),
    ("temperature_f", Meaning::Fahrenheit),
    ("temperature_k", Meaning::Kelvin),
    ("humidity_percent", Meaning::Percent),
    ("pressure_kpa", Meaning::Kilopascals),
    ("pressure_hpa", Meaning::Hectopascals),
    ("pressure_pa", Meaning::Pascals),
    ("", Meaning::Nothing),
];

impl TryFrom<String> for LinePattern {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        let mut parts = Vec::new();
        let mut rest = text.as_str();
        while let Some((before, after)) = rest.split_once('{') {
            let (name, behind) =
                after.split_once('}').ok_or_else(|| format!("`{{{after}` has no closing brace"))?;
            let meaning = NAMES.iter().find(|(known, _)| *known == name).map(|(_, m)| *m);
            let meaning = meaning.ok_or_else(|| {
                let known: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
                format!("`{{{name}}}` is unknown; use one of {{{}}}", known.join("}, {"))
            })?;
            if !before.is_empty() {
                parts.push(Part::Text(before.to_owned()));
            } else if matches!(parts.last(), Some(Part::Number(_))) {
                return Err("two numbers need something between them".to_owned());
            }
            parts.push(Part::Number(meaning));
            rest = behind;
        }
        if !rest.is_empty() {
            parts.push(Part::Text(rest.to_owned()));
        }
        let temperatures = [Meaning::Celsius, Meaning::Fahrenheit, Meaning::Kelvin];
        let says_one = parts
            .iter()
            .any(|part| matches!(part, Part::Number(meaning) if temperatures.contains(meaning)));
        if says_one {
            Ok(Self(parts))
        } else {
            Err("a pattern needs a temperature, such as `{temperature_c}`".to_owned())
        }
    }
}

impl LinePattern {
    /// The values in a line; `None` if the pattern does not occur in it, or a value is implausible.
    pub(super) fn read(&self, line: &str) -> Option<AirReading> {
        line.char_indices().find_map(|(start, _)| self.read_at(&line[start..]))
    }

    fn read_at(&self, mut rest: &str) -> Option<AirReading> {
        let (mut temperature_c, mut humidity_percent, mut pressure_kpa) = (None, None, None);
        for part in &self.0 {
            match part {
                Part::Text(text) => rest = after_text(rest, text)?,
                Part::Number(meaning) => {
                    let (number, after) = leading_number(rest.trim_start())?;
                    rest = after;
                    match meaning {
                        Meaning::Celsius => temperature_c = Some(number),
                        Meaning::Fahrenheit => temperature_c = Some((number - 32.0) / 1.8),
                        Meaning::Kelvin => temperature_c = Some(number - 273.15),
                        Meaning::Percent => humidity_percent = Some(number),
                        Meaning::Kilopascals => pressure_kpa = Some(number),
                        Meaning::Hectopascals => pressure_kpa = Some(number / 10.0),
                        Meaning::Pascals => pressure_kpa = Some(number / 1000.0),
                        Meaning::Nothing => {}
                    }
                }
            }
        }
        let can_be = |value: Option<f64>, range: &std::ops::RangeInclusive<f64>| {
            value.is_none_or(|value| range.contains(&value))
        };
        (can_be(temperature_c, &TEMPERATURES_C)
            && can_be(humidity_percent, &HUMIDITIES_PERCENT)
            && can_be(pressure_kpa, &PRESSURES_KPA))
        .then_some(AirReading {
            temperature_c: temperature_c?,
            humidity_percent: humidity_percent.map(|percent| percent.min(100.0)),
            pressure_kpa,
        })
    }
}

/// What follows upon `text`, in which each space stands for any number of them.
fn after_text<'a>(mut rest: &'a str, text: &str) -> Option<&'a str> {
    for character in text.chars() {
        rest = match character {
            ' ' => rest.trim_start_matches([' ', '\t']),
            other => rest.strip_prefix(other)?,
        };
    }
    Some(rest)
}

/// The decimal number at the start of a text, and what follows.
fn leading_number(text: &str) -> Option<(f64, &str)> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let length = unsigned.find(|c: char| !(c.is_ascii_digit() || c == '.'));
    let end = text.len() - unsigned.len() + length.unwrap_or(unsigned.len());
    Some((text[..end].parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(pattern: &str, line: &str) -> Option<AirReading> {
        LinePattern::try_from(pattern.to_owned()).expect("a pattern").read(line)
    }

    fn air(temperature_c: f64, humidity: Option<f64>, pressure: Option<f64>) -> Option<AirReading> {
        Some(AirReading { temperature_c, humidity_percent: humidity, pressure_kpa: pressure })
    }

    #[test]
    fn named_values_and_columns_are_read() {
        let named = "T={temperature_c} RH={humidity_percent}";
        assert_eq!(read(named, "T=21.3 RH=45"), air(21.3, Some(45.0), None));
        assert_eq!(read(named, "#12 T= -3.50   RH=  7.5 %"), air(-3.5, Some(7.5), None));
        let columns = "{},{temperature_c},{humidity_percent},{pressure_hpa}";
        assert_eq!(read(columns, "1234,21.3,45.0,1013.25"), air(21.3, Some(45.0), Some(101.325)));
        assert_eq!(read("{temperature_k} K", "293.15 K"), air(20.0, None, None));
        assert_eq!(
            read("{temperature_f} {pressure_pa}", "68 101325"),
            air(20.0, None, Some(101.325))
        );
    }

    #[test]
    fn what_does_not_fit_or_cannot_be_is_no_reading() {
        let named = "T={temperature_c} RH={humidity_percent}";
        for line in
            ["", "T=21.3", "T=x RH=45", "T=213 RH=45", "T=21.3 RH=450", "T=2.1.3 RH=4", "21.3 45"]
        {
            assert_eq!(read(named, line), None, "{line}");
        }
        assert_eq!(read(named, "T=21 RH=102"), air(21.0, Some(100.0), None), "fog");
    }

    #[test]
    fn a_pattern_without_a_temperature_is_refused() {
        for (pattern, words) in [
            ("RH={humidity_percent}", "needs a temperature"),
            ("T={temperature}", "is unknown"),
            ("T={temperature_c", "no closing brace"),
            ("{temperature_c}{humidity_percent}", "between"),
        ] {
            let refusal = LinePattern::try_from(pattern.to_owned()).expect_err(pattern);
            assert!(refusal.contains(words), "{refusal}");
        }
    }

    proptest! {
        #[test]
        fn what_is_printed_is_read(t in -60.0..100.0f64, rh in 0.0..100.0f64) {
            let line = format!("T={t:.2} RH={rh:.1}");
            let reading = read("T={temperature_c} RH={humidity_percent}", &line).expect("it fits");
            prop_assert!((reading.temperature_c - t).abs() <= 0.005 + 1e-9);
            prop_assert!((reading.humidity_percent.expect("it is reported") - rh).abs() <= 0.05 + 1e-9);
        }

        #[test]
        fn no_line_makes_it_panic(line in "\\PC{0,60}", pattern in "\\PC{0,20}") {
            read("T={temperature_c} {}", &line);
            if let Ok(pattern) = LinePattern::try_from(format!("{pattern}{{temperature_c}}")) {
                pattern.read(&line);
            }
        }
    }
}
