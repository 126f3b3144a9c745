//! The air warms or cools during the scan, linearly in time from the first driven reading on.
//!
//! The speed of sound goes with the root of the absolute temperature: c = 331.3 m/s √(1 + T/273.15) (O. Cramer, J. Acoust. Soc. Am. 93, 2510, 1993, of
//! dry air to 0.1 %).

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Observations;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct TemperatureDrift;

/// Speed of sound at the freezing point, m/s, and that temperature, K.
const FREEZING: (f64, f64) = (331.3, 273.15);

impl Effect for TemperatureDrift {
    fn id(&self) -> EffectId {
        EffectId::TemperatureDrift
    }

    /// K/h. A cold room that is heated gains ten degrees in an hour; a scan of minutes sees no less than some kelvin an hour.
    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.5, least: -600.0, most: 600.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Moment,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some(
                "a thermometer beside the path of sound, read at the beginning and at the end",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "a set-up has one speed of sound; keep the room's temperature, or record the air with an [air] sensor",
        )
    }

    fn can_act(&self, observations: &Observations) -> bool {
        let drives = observations.scans.iter().flat_map(|scan| &scan.drives);
        drives.flat_map(|drive| &drive.visits).any(|visit| visit.time_s > 0.0)
    }

    fn speed_ratio_at(&self, at: Setting<'_>, time_s: f64) -> f64 {
        let (speed_m_s, temperature_k) = FREEZING;
        let believed = at.context.believed.medium.speed_of_sound_m_s / speed_m_s;
        let began_k = temperature_k * believed * believed;
        (1.0 + at.values[0] * time_s / 3600.0 / began_k).max(LEAST_SQUARE).sqrt()
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let Estimate { value, error } = fitted[0];
        let what = if value < 0.0 { "cools" } else { "warms" };
        let sentence = format!("the air {what} by {:.2} ± {error:.2} K in an hour", value.abs());
        Finding::new([("k_per_h", fitted[0].real())], sentence)
    }
}

/// The ratio is kept above the root of this: no air is that cold.
const LEAST_SQUARE: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::model::observations::Visit;
    use fieldgap_acoustics::Vec3;

    /// Air of 20 °C that warms by 6 K an hour has 23 °C after half an hour, where the speed is 1.75 m/s higher (0.58 m/s for each kelvin).
    #[test]
    fn a_reading_has_the_speed_of_sound_of_its_moment() {
        let bench = Bench::new();
        let at_m = Vec3::new(0.01, 0.005, 0.12);
        let drifts = bench.model(EffectId::TemperatureDrift, &[6.0]);
        let ratio = TemperatureDrift.speed_ratio_at(bench.at(&[6.0]), 1800.0);
        assert!((343.0 * (ratio - 1.0) - 1.75).abs() < 0.02, "{ratio}");
        let visits: Vec<Visit> = [0.0, 700.0, 1800.0]
            .map(|time_s| Visit { at_m, time_s, ..visit() })
            .into_iter()
            .collect();
        let found = drifts.pressures_at(bench.believed(), &visits, &nuisance());
        for (visit, found) in visits.iter().zip(found) {
            let ratio = TemperatureDrift.speed_ratio_at(bench.at(&[6.0]), visit.time_s);
            let steady = bench.model(EffectId::SoundSpeed, &[ratio]);
            let expected = steady.pressures_at(bench.believed(), &[*visit], &nuisance())[0];
            let off = (found.coherent - expected.coherent).norm() / expected.coherent.norm();
            assert!(off < 2e-3, "{}: {off}", visit.time_s);
        }
    }
}
