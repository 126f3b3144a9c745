//! A map as a table, and its errors in words.

use std::fmt::Write as _;

use fieldgap_records::AdaptiveMap;

use crate::field_map::FieldMap;
use crate::normal::two_sided;
use crate::round::MapEnd;

/// The map as CSV: place in millimetres (array's frame), number of the drive, amplitude and standard error in the unit of the readings.
pub fn to_csv(map: &FieldMap) -> String {
    let mut text = "x_mm,y_mm,z_mm,focus,amplitude,standard_error\n".to_owned();
    for ((at_m, focus), estimate) in map.places.iter().zip(&map.estimates) {
        // Micrometres: no robot here is finer.
        let [x, y, z] = [at_m.x, at_m.y, at_m.z].map(|m| (m * 1e6).round() / 1e3);
        let _ = writeln!(
            text,
            "{x},{y},{z},{focus},{:.6e},{:.3e}",
            estimate.amplitude, estimate.standard_error
        );
    }
    text
}

/// How many readings a map took and how certain it is; with `stated`, whether that error was met, and if not, why the rounds ended.
pub fn in_words(
    map: &FieldMap,
    readings: usize,
    unit: &str,
    stated: Option<&AdaptiveMap>,
    end: Option<MapEnd>,
) -> String {
    let errors = map.errors();
    let percent = |value: f64| 100.0 * value / errors.peak;
    let peak = format!("{:.3} {unit}", errors.peak);
    let mut text = format!(
        "map of {} places from {readings} readings; peak {}\nstandard error: {:.2} % of the peak rms, {:.2} % at most\n",
        map.places.len(),
        peak.trim_end(),
        percent(errors.rms),
        percent(errors.largest)
    );
    if map.factor > 1.0 {
        let _ = writeln!(
            text,
            "the standard errors were made {:.2} times larger, because the last readings departed by more than was foretold",
            map.factor
        );
    }
    if !map.effects.is_empty() {
        let effects: Vec<&str> = map.effects.iter().map(|id| id.as_str()).collect();
        let _ = writeln!(text, "the simulation was corrected by: {}", effects.join(", "));
    }
    let Some(stated) = stated else { return text.trim_end().to_owned() };
    let wanted = in_percent(stated);
    let is_met = two_sided(stated.confidence) * errors.largest <= stated.error * errors.peak;
    text += &match (is_met, end) {
        (true, _) => format!("the stated error of {wanted} is met everywhere"),
        (false, end) => format!("the stated error of {wanted} is not met: {}", why(end)),
    };
    text
}

/// The stated error: "1 % of the peak at 95 %".
pub(crate) fn in_percent(stated: &AdaptiveMap) -> String {
    // Digits that a person would give, and none of the binary fraction's.
    let percent = |share: f64| (1e6 * share).round() / 1e4;
    format!("{} % of the peak at {} %", percent(stated.error), percent(stated.confidence))
}

/// Why rounds ended before the stated error was met.
pub(crate) fn why(end: Option<MapEnd>) -> &'static str {
    match end {
        Some(MapEnd::NoGain) => {
            "with the noise of this receiver further readings would gain almost nothing"
        }
        Some(MapEnd::Readings) => "the readings of the plan are used up",
        Some(MapEnd::Time) => "the time of the plan is used up",
        Some(MapEnd::Sounding) => "the sounding time of the plan is used up",
        Some(MapEnd::Met) => "it was met at the places that the rounds looked at, and not at all",
        None => "the rounds have not ended",
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Vec3;
    use fieldgap_diagnosis::EffectId;
    use fieldgap_records::{Axis, Layers};

    use super::*;
    use crate::estimate::Estimate;
    use crate::field_map::MapSizes;

    fn made(largest: f64, factor: f64) -> FieldMap {
        let estimate = |amplitude, standard_error| Estimate { amplitude, standard_error };
        FieldMap {
            places: vec![(Vec3::new(0.0175, -0.0225, 0.1), 0), (Vec3::new(0.0, 0.0, 0.1), 1)],
            estimates: vec![estimate(2.0, largest), estimate(0.5, 0.001)],
            effects: vec![EffectId::Pitch, EffectId::Saturation],
            sizes: MapSizes { elements: 0.01, diffuse: 0.002 },
            factor,
        }
    }

    fn stated() -> AdaptiveMap {
        let axis = Axis { first_mm: 0.0, step_mm: 1.0, count: 2 };
        AdaptiveMap::on(Layers { x: axis, y: axis, z_mm: vec![100.0] }, 1)
    }

    #[test]
    fn the_table_has_a_row_for_each_place() {
        assert_eq!(
            to_csv(&made(0.004, 1.0)),
            "x_mm,y_mm,z_mm,focus,amplitude,standard_error\n\
             17.5,-22.5,100,0,2.000000e0,4.000e-3\n0,0,100,1,5.000000e-1,1.000e-3\n"
        );
    }

    #[test]
    fn the_words_say_whether_the_stated_error_is_met_and_if_not_why() {
        assert_eq!(
            in_words(&made(0.004, 1.0), 288, "V", Some(&stated()), Some(MapEnd::Met)),
            "map of 2 places from 288 readings; peak 2.000 V\n\
             standard error: 0.15 % of the peak rms, 0.20 % at most\n\
             the simulation was corrected by: pitch, saturation\n\
             the stated error of 1 % of the peak at 95 % is met everywhere"
        );
        assert_eq!(
            in_words(&made(0.04, 1.3), 672, "V", Some(&stated()), Some(MapEnd::NoGain)),
            "map of 2 places from 672 readings; peak 2.000 V\n\
             standard error: 1.41 % of the peak rms, 2.00 % at most\n\
             the standard errors were made 1.30 times larger, because the last readings departed by more than was foretold\n\
             the simulation was corrected by: pitch, saturation\n\
             the stated error of 1 % of the peak at 95 % is not met: with the noise of this receiver further readings would gain \
             almost nothing"
        );
        let of_any = in_words(&made(0.04, 1.0), 672, "V", None, None);
        assert!(!of_any.contains("stated"), "{of_any}");
    }
}
