//! Units and example values of keys, for messages.

use std::borrow::Cow;

/// Units by the ending of a key; an ending that contains another one comes first.
const UNITS: [(&str, &str); 19] = [
    ("_mm_s", "mm/s"),
    ("_m_s", "m/s"),
    ("_mm", "mm"),
    ("_um", "\u{b5}m"),
    ("_m", "m"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_us", "\u{b5}s"),
    ("_s", "s"),
    ("_minutes", "min"),
    ("_c", "\u{b0}C"),
    ("_kpa", "kPa"),
    ("_pa", "Pa"),
    ("_percent", "percent"),
    ("_rad", "rad"),
    ("_deg", "degrees"),
    ("_db", "dB"),
    ("_v", "V"),
    ("_mv", "mV"),
];

/// Values of keys that occur in files of a usual laboratory.
const USUAL: [(&str, &str); 35] = [
    ("name", "\"my-lab\""),
    ("frequency_hz", "40000.0"),
    ("layout", "\"square\""),
    ("columns", "6"),
    ("rows", "6"),
    ("count", "6"),
    ("rings", "3"),
    ("seed", "1"),
    ("file", "\"elements.csv\""),
    ("element_diameter_mm", "10.0"),
    ("spacing_mm", "0.5"),
    ("speed_of_sound_m_s", "343.0"),
    ("temperature_c", "20.0"),
    ("origin_mm", "[250.0, 250.0, 40.0]"),
    ("travel_mm", "{ x = [0.0, 500.0], y = [0.0, 500.0], z = [0.0, 500.0] }"),
    ("min_mm", "[190.0, 190.0, 0.0]"),
    ("max_mm", "[310.0, 310.0, 50.0]"),
    ("feed_mm_s", "50.0"),
    ("position_tolerance_mm", "0.05"),
    ("settle_ms", "50.0"),
    ("samples", "16"),
    ("modulation_hz", "200.0"),
    ("modulation_duty_percent", "50.0"),
    ("port", "\"/dev/ttyUSB0\""),
    ("baud", "115200"),
    ("home", "[\"G28 Z\", \"G28 X Y\"]"),
    ("z_mm", "100.0"),
    ("centre_mm", "[0.0, 0.0]"),
    ("size_mm", "[100.0, 100.0]"),
    ("step_mm", "2.0"),
    ("model", "\"corrected\""),
    ("truth", "\"truth.toml\""),
    ("format", "1"),
    ("recorded", "2026-11-20T17:00:00Z"),
    ("reading", "\"V\""),
];

/// Values of every kind, for keys that are not listed.
const ANY: [&str; 9] =
    ["1.0", "1", "\"name\"", "true", "{}", "[0.0, 0.0, 0.0]", "[0.0, 0.0]", "[\"name\"]", "[]"];

/// The unit of a key, by its ending.
pub(super) fn unit(key: &str) -> Option<&'static str> {
    UNITS.iter().find(|(ending, _)| key.ends_with(ending)).map(|(_, unit)| *unit)
}

/// Values that a key may have, as TOML, the likeliest first.
pub(super) fn candidates(key: &str) -> Vec<Cow<'static, str>> {
    let usual = USUAL.iter().filter(|(name, _)| *name == key).map(|(_, value)| *value);
    usual.chain(ANY).map(Cow::Borrowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_ending_gives_the_unit() {
        assert_eq!(unit("speed_of_sound_m_s"), Some("m/s"));
        assert_eq!(unit("feed_mm_s"), Some("mm/s"));
        assert_eq!(unit("settle_ms"), Some("ms"));
        assert_eq!(unit("within_s"), Some("s"));
        assert_eq!(unit("columns"), None);
    }

    #[test]
    fn every_example_is_toml() {
        for (key, value) in USUAL.iter().copied().chain(ANY.map(|value| ("x", value))) {
            assert!(toml::de::DeValue::parse(value).is_ok(), "{key} = {value}");
        }
    }
}
