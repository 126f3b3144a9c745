//! The changes of a set-up that follow from the named cause.

use super::error::CorrectionError;
use super::not_correctable::Unwritten;
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_diagnosis::{Candidate, Diagnosis, EffectId, FittedParameter, Remedy, SetupKey};

/// A change of the nominal set-up.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    /// Speed of sound, m/s, above zero.
    SpeedOfSound(f64),
    /// Factor of the frequency, above zero, and whether the driver emits delays within one period.
    Frequency(f64, bool),
    /// Factor of the elements' positions, above zero.
    Pitch(f64),
    /// Silent elements.
    Silent(Vec<usize>),
    /// Reversed elements.
    Reversed(Vec<usize>),
    /// Two elements with exchanged outputs.
    Swapped([usize; 2]),
    /// Relative deviation of each element's amplitude.
    Amplitudes(Vec<f64>),
    /// Deviation of each element's phase, radians.
    Phases(Vec<f64>),
    /// Rotation of the array about x, then about y, radians.
    Tilt([f64; 2]),
    /// Factor of the elements' face radius, above zero.
    Faces(f64),
    /// Position of the robot's origin in the array's frame, mm.
    Offset(Vec3),
    /// Rotation of the robot's axes about z, radians.
    Turn(f64),
    /// Delay steps per period of the driver, at least one, and from where each drive counts them, in parts of a step: one for every drive,
    /// one for all, or none where all count from zero.
    Steps(f64, Vec<f64>),
    /// A simulator without the known bugs.
    SimulatorModel,
}

/// A change and its effect.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Correction {
    pub effect: EffectId,
    pub change: Change,
    /// The fitted parameters with standard errors, for comments.
    pub found: String,
}

/// The changes of the named cause, and its effects that no set-up file has a key for.
///
/// # Errors
/// [`CorrectionError::NothingNamed`] if the diagnosis names no cause.
pub(super) fn corrections(
    diagnosis: &Diagnosis,
) -> Result<(Vec<Correction>, Vec<Unwritten>), CorrectionError> {
    let named = diagnosis
        .best()
        .filter(|best| diagnosis.verdict.names_a_cause() && best.effects == diagnosis.effects)
        .ok_or(CorrectionError::NothingNamed(diagnosis.verdict))?;
    let (mut corrections, mut unwritten) = (Vec::new(), Vec::new());
    for &effect in &named.effects {
        match change(effect, named, diagnosis.simulator) {
            Ok(change) => {
                let found = found(effect, named, &diagnosis.reading_unit);
                corrections.push(Correction { effect, change, found });
            }
            Err(why) => unwritten.push(Unwritten::new(effect, why)),
        }
    }
    Ok((corrections, unwritten))
}

/// The parameters of an effect for a comment; its name if it has none.
fn found(effect: EffectId, named: &Candidate, reading_unit: &str) -> String {
    let own = named.parameters.iter().filter(|(name, _)| belongs(name, effect.as_str()));
    let own: Vec<String> = own
        .map(|(name, value)| format!("{name} = {}", value.in_words(name, reading_unit)))
        .collect();
    if own.is_empty() { effect.to_string() } else { own.join(", ") }
}

fn belongs(name: &str, effect: &str) -> bool {
    name.strip_prefix(effect).is_some_and(|rest| rest.starts_with('.'))
}

/// The change of an effect, or the reason why there is none.
fn change(effect: EffectId, named: &Candidate, simulator: Simulator) -> Result<Change, String> {
    let parameters = Parameters { effect, named };
    let key = match effect.remedy(simulator) {
        Remedy::Key(key) => key,
        Remedy::Manual(why) => return Err(why.to_owned()),
    };
    Ok(match key {
        SetupKey::SimulatorModel => Change::SimulatorModel,
        SetupKey::SpeedOfSound => Change::SpeedOfSound(parameters.above_zero("c_m_s")?),
        SetupKey::Frequency => Change::Frequency(
            parameters.above_zero("ratio")?,
            parameters.real("within_a_period").is_ok_and(|within| within == 1.0),
        ),
        SetupKey::Pitch => Change::Pitch(parameters.above_zero("ratio")?),
        SetupKey::SilentElements => Change::Silent(parameters.elements()?),
        SetupKey::ReversedElements => Change::Reversed(parameters.elements()?),
        SetupKey::SwappedElements => {
            let elements = parameters.elements()?;
            let two = <[usize; 2]>::try_from(elements);
            Change::Swapped(two.map_err(|_| "the diagnosis does not name two elements".to_owned())?)
        }
        SetupKey::Amplitudes => Change::Amplitudes(parameters.each("departures")?),
        SetupKey::Phases => Change::Phases(parameters.each("departures_rad")?),
        SetupKey::Tilt => {
            Change::Tilt([parameters.real("about_x_rad")?, parameters.real("about_y_rad")?])
        }
        SetupKey::FaceRadius => Change::Faces(1.0 / parameters.above_zero("width_ratio")?),
        SetupKey::Origin => Change::Offset(Vec3::new(
            parameters.real("x_mm")?,
            parameters.real("y_mm")?,
            parameters.real("z_mm")?,
        )),
        SetupKey::Turn => Change::Turn(parameters.real("rad")?),
        SetupKey::PhaseSteps => Change::Steps(
            parameters.above_zero("steps")?.round().max(1.0),
            parameters.each("zeros").unwrap_or_default(),
        ),
    })
}

/// The parameters of one effect.
struct Parameters<'a> {
    effect: EffectId,
    named: &'a Candidate,
}

impl Parameters<'_> {
    /// A number, rounded to a tenth of its standard error.
    fn real(&self, name: &str) -> Result<f64, String> {
        match self.named.parameters.get(&format!("{}.{name}", self.effect)) {
            Some(FittedParameter::Real { value, standard_error }) if value.is_finite() => {
                Ok(rounded(*value, *standard_error))
            }
            _ => Err(format!("the diagnosis gives no value of {name}")),
        }
    }

    fn above_zero(&self, name: &str) -> Result<f64, String> {
        let value = self.real(name)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(format!("{name} = {value}, which is not above zero"))
        }
    }

    /// A number for each element, rounded as in [`Parameters::real`].
    fn each(&self, name: &str) -> Result<Vec<f64>, String> {
        match self.named.parameters.get(&format!("{}.{name}", self.effect)) {
            Some(FittedParameter::Each { value, standard_error })
                if !value.is_empty() && value.iter().all(|value| value.is_finite()) =>
            {
                let errors = standard_error.iter().copied().chain(std::iter::repeat(f64::NAN));
                Ok(value.iter().zip(errors).map(|(value, error)| rounded(*value, error)).collect())
            }
            _ => Err(format!("the diagnosis gives no value of {name} for each element")),
        }
    }

    fn elements(&self) -> Result<Vec<usize>, String> {
        match self.named.parameters.get(&format!("{}.elements", self.effect)) {
            Some(FittedParameter::Elements { value }) if !value.is_empty() => Ok(value.clone()),
            _ => Err("the diagnosis names no elements".to_owned()),
        }
    }
}

/// A number rounded to a tenth of the leading digit of its standard error, if that is known.
fn rounded(value: f64, standard_error: f64) -> f64 {
    if !(standard_error.is_finite() && standard_error > 0.0) {
        return value;
    }
    let decimals = (1.0 - standard_error.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}").parse().expect("a formatted number")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_by_their_standard_error() {
        assert_eq!(rounded(347.123_456, 0.2061), 347.12);
        assert_eq!(rounded(-1.234_567e-3, 4.2e-5), -1.235e-3);
        assert_eq!(rounded(1234.6, 30.0), 1235.0);
        assert_eq!(rounded(1.23456, f64::NAN), 1.23456);
    }

    #[test]
    fn parameters_belong_to_one_effect() {
        assert!(belongs("pitch.ratio", "pitch") && !belongs("pitch-two.ratio", "pitch"));
    }
}
