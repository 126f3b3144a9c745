//! Fitted parameters in words: as many digits as the standard error allows, and the unit.

use fieldgap_text::{ABSENT, Uncertain, fixed, significant, uncertain};

use crate::fitted_parameter::FittedParameter;
use crate::limits::MOST_HALF_ANGLE_DEG;

/// How the names of parameters end, and the unit that says so.
const UNITS: [(&str, &str); 10] = [
    ("rad_per_sqrt_m", "rad/√m"),
    ("db_per_m", "dB/m"),
    ("_m_s", "m/s"),
    ("_deg", "°"),
    ("_rad", "rad"),
    ("_mm", "mm"),
    ("k_per_h", "K/h"),
    (".rad", "rad"),
    (".mm", "mm"),
    (".s", "s"),
];

impl FittedParameter {
    /// Unit of the parameter of this name (`effect.parameter`), as the catalogue of effects gives it; empty for ratios and
    /// for lists. Levels have the unit of the readings.
    pub fn unit<'a>(name: &str, reading_unit: &'a str) -> &'a str {
        match name.rsplit('.').next() {
            Some("level") => reading_unit,
            Some("gx" | "gy" | "gz") => "/m",
            _ => UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |unit| unit.1),
        }
    }

    /// The value with its standard error and the unit, for a reader.
    pub fn in_words(&self, name: &str, reading_unit: &str) -> String {
        let unit = Self::unit(name, reading_unit);
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match self {
            Self::Real { value, .. }
                if name.ends_with("half_angle_deg") && *value >= MOST_HALF_ANGLE_DEG =>
            {
                "not determined".to_owned()
            }
            Self::Real { value, standard_error } => {
                format!("{}{unit}", with_error(*value, *standard_error))
            }
            Self::Complex { value: [real, imaginary], standard_error: [of_real, of_imaginary] } => {
                format!(
                    "({}) + ({}) i{unit}, size {} at {}°",
                    with_error(*real, *of_real),
                    with_error(*imaginary, *of_imaginary),
                    significant(real.hypot(*imaginary), 3),
                    fixed(imaginary.atan2(*real).to_degrees(), 0)
                )
            }
            Self::Word { value } => (*value).to_owned(),
            Self::Elements { value } => {
                let numbers: Vec<String> = value.iter().map(usize::to_string).collect();
                numbers.join(", ")
            }
            Self::Each { value, standard_error } if value.len() == 1 => {
                let error = standard_error.first().copied().unwrap_or(f64::NAN);
                format!("{}{unit}", with_error(value[0], error))
            }
            Self::Each { value, standard_error } => {
                let least = value.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
                let most = value.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
                let at = |place: Option<(usize, &f64)>| {
                    let (element, value) = place?;
                    let error = standard_error.get(element).copied().unwrap_or(f64::NAN);
                    let whose = if name.ends_with(".zeros") { "drive" } else { "element" };
                    Some(format!("{}{unit} ({whose} {element})", with_error(*value, error)))
                };
                match (at(least), at(most)) {
                    (Some(least), Some(most)) => format!("from {least} to {most}"),
                    _ => ABSENT.to_owned(),
                }
            }
        }
    }
}

/// A number with its standard error, for a reader; says so where no error is known.
fn with_error(value: f64, standard_error: f64) -> String {
    let unknown = value.is_finite() && standard_error.is_nan();
    let number = uncertain(Uncertain { value, standard_error });
    if unknown { number + " (error unknown)" } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_end_in_their_unit() {
        let of = |name| FittedParameter::unit(name, "V");
        let cases = [
            ("sound-speed.c_m_s", "m/s"),
            ("flow.vx_m_s", "m/s"),
            ("absorption.db_per_m", "dB/m"),
            ("turbulence.rad_per_sqrt_m", "rad/√m"),
            ("temperature-gradient.gz", "/m"),
            ("array-tilt.about_x_rad", "rad"),
            ("rotation.rad", "rad"),
            ("backlash.mm", "mm"),
            ("offset.x_mm", "mm"),
            ("lag.s", "s"),
            ("receiver-directivity.half_angle_deg", "°"),
            ("saturation.level", "V"),
            ("axis-scale.x", ""),
            ("pitch.ratio", ""),
            ("dead-elements.elements", ""),
            ("phase-quantisation.steps", ""),
        ];
        for (name, unit) in cases {
            assert_eq!(of(name), unit, "{name}");
        }
    }

    #[test]
    fn a_value_has_the_digits_that_its_error_allows() {
        let real = |value, standard_error| {
            FittedParameter::Real { value, standard_error }.in_words("sound-speed.c_m_s", "V")
        };
        assert_eq!(real(347.1234, 0.21), "347.12 ± 0.21 m/s");
        assert_eq!(real(347.1234, f64::NAN), "347.1 (error unknown) m/s");
        assert_eq!(real(f64::NAN, 1.0), "– m/s");
        let half_angle = FittedParameter::Real { value: 1710.0, standard_error: 618_257.0 };
        let name = "receiver-directivity.half_angle_deg";
        assert_eq!(half_angle.in_words(name, "V"), "not determined");
        let complex = FittedParameter::Complex { value: [0.3, -0.1], standard_error: [0.02, 0.03] };
        assert_eq!(
            complex.in_words("reflection.coefficient", "V"),
            "(0.300 ± 0.020) + (−0.100 ± 0.030) i, size 0.316 at −18°"
        );
        let elements = FittedParameter::Elements { value: vec![3, 17] };
        assert_eq!(elements.in_words("dead-elements.elements", "V"), "3, 17");
    }
}
