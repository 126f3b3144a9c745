//! From the named cause to what it changes in a set-up.

use super::error::CorrectionError;
use super::not_correctable::Unwritten;
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_diagnosis::{
    Candidate, Diagnosis, EffectId, FittedParameter, Remedy, SetupKey, Verdict,
};

/// What is not as the set-up believes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    /// The speed of sound is this, m/s, above zero.
    SpeedOfSound(f64),
    /// The frequency is the believed one times this, above zero.
    Frequency(f64),
    /// The elements' places are the believed ones times this, above zero.
    Pitch(f64),
    /// These elements are silent.
    Silent(Vec<usize>),
    /// These are reversed.
    Reversed(Vec<usize>),
    /// These two hang on each other's outputs.
    Swapped([usize; 2]),
    /// Each element's amplitude is the believed one times one more than this.
    Amplitudes(Vec<f64>),
    /// Each element's phase is the believed one and this, radians.
    Phases(Vec<f64>),
    /// The array is turned about x, then about y, radians.
    Tilt([f64; 2]),
    /// The elements' faces are as large as believed times this, above zero.
    Faces(f64),
    /// The robot's origin stands here, array's frame, mm.
    Offset(Vec3),
    /// The robot's axes are turned about z, radians.
    Turn(f64),
    /// The driver rounds delays to so many steps in a period, at least one.
    Steps(f64),
    /// The simulator's own defects are mended.
    SimulatorModel,
}

/// A change with the effect that it stands for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Correction {
    pub effect: EffectId,
    pub change: Change,
    /// What was found, with standard errors, for comments.
    pub found: String,
}

/// What the named cause changes, and which of its effects change nothing that could be written.
///
/// # Errors
/// [`CorrectionError::NothingNamed`] if the diagnosis names no cause.
pub(super) fn corrections(
    diagnosis: &Diagnosis,
) -> Result<(Vec<Correction>, Vec<Unwritten>), CorrectionError> {
    let named = diagnosis
        .best()
        .filter(|best| diagnosis.verdict == Verdict::Explained && best.effects == diagnosis.effects)
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

/// The parameters of an effect as a comment gives them; the effect alone where it has none.
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

/// What an effect changes; else why it changes nothing.
fn change(effect: EffectId, named: &Candidate, simulator: Simulator) -> Result<Change, String> {
    let parameters = Parameters { effect, named };
    let key = match effect.remedy(simulator) {
        Remedy::Key(key) => key,
        Remedy::Manual(why) => return Err(why.to_owned()),
    };
    Ok(match key {
        SetupKey::SimulatorModel => Change::SimulatorModel,
        SetupKey::SpeedOfSound => Change::SpeedOfSound(parameters.above_zero("c_m_s")?),
        SetupKey::Frequency => Change::Frequency(parameters.above_zero("ratio")?),
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
        SetupKey::PhaseSteps => Change::Steps(parameters.above_zero("steps")?.round().max(1.0)),
    })
}

/// The parameters of one effect.
struct Parameters<'a> {
    effect: EffectId,
    named: &'a Candidate,
}

impl Parameters<'_> {
    /// A number, rounded to a tenth of its standard error so that a file does not pretend to know more.
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
        if value > 0.0 { Ok(value) } else { Err(format!("{name} came out as {value}")) }
    }

    /// A number for each element, each rounded as [`Parameters::real`] rounds.
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

/// A number to a tenth of the leading digit of its standard error; as it is where that is unknown.
fn rounded(value: f64, standard_error: f64) -> f64 {
    if !(standard_error.is_finite() && standard_error > 0.0) {
        return value;
    }
    let decimals = (1.0 - standard_error.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}").parse().expect("a number reads back")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_are_known() {
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
