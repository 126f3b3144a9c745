//! The air's speed of sound is not the believed one; the delays were computed for the believed one.
//!
//! The wavenumber is ω/c with the true c; delays stay as they were in seconds. For dry air c = 331.3 √(1 + T/273.15 K)
//! m/s (Pierce, *Acoustics*, section 1-9), which turns the speed into a temperature.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct SoundSpeed;

impl Effect for SoundSpeed {
    fn id(&self) -> &'static str {
        "sound-speed"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.92, most: 1.08 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.97], vec![1.03]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.speed_ratio = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a thermometer in the sound's way shows its speed")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, context: &Context) -> Said {
        let c0 = context.believed.medium.speed_of_sound_m_s;
        let speed = fitted[0].map(c0 * fitted[0].value, c0);
        let celsius = |c_m_s: f64| 273.15 * ((c_m_s / 331.3).powi(2) - 1.0);
        let sentence = format!(
            "sound travels at {:.1} ± {:.1} m/s: {:.0} °C in dry air, not the {:.0} °C that the believed {c0:.1} m/s stand for",
            speed.value,
            speed.error,
            celsius(speed.value),
            celsius(c0)
        );
        Said::new([("c_m_s", speed.real())], sentence)
    }
}
