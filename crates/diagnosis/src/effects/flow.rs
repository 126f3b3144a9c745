//! A steady wind across the field: a path of direction n takes d / (c + v·n) (Pierce, *Acoustics*, section 8-1).

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Flow;

impl Effect for Flow {
    fn id(&self) -> &'static str {
        "flow"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.1, least: -30.0, most: 30.0 },
            Parameter { neutral: 0.0, scale: 0.1, least: -30.0, most: 30.0 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.wind_m_s.x = values[0];
        supposed.wind_m_s.y = values[1];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("smoke or a thread shows whether the air moves")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [x, y] = [fitted[0], fitted[1]];
        let sentence = format!(
            "air flows across the field at {:.2} m/s: {:.2} ± {:.2} along x, {:.2} ± {:.2} along y",
            x.value.hypot(y.value),
            x.value,
            x.error,
            y.value,
            y.error
        );
        Said::new([("vx_m_s", x.real()), ("vy_m_s", y.real())], sentence)
    }
}
