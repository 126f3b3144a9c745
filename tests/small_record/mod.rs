//! A record of one focus, as text to be changed.

/// Its `scan.toml`.
pub const SETUP: &str = r#"format = 1
name = "small"
recorded = 2026-01-01T00:00:00Z
reading = "V"
[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0
[medium]
speed_of_sound_m_s = 343.0
[simulator]
model = "corrected"
[[focus]]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
"#;

/// The header of its `samples.csv`.
pub const HEADER: &str = "time_s,focus,x_mm,y_mm,z_mm,reading";
