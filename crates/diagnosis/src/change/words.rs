//! A change in words: a clause for each effect, and the sentence that an alarm states.

use std::collections::BTreeMap;

use fieldgap_comparison::Uncertain;
use fieldgap_text::{percent, significant, uncertain, with_minus_signs};

use crate::change::result::{ChangeCandidate, ChangeVerdict, ParameterChange, RecordName};
use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::elements_listed;

/// One effect's change.
pub(crate) struct Clause<'c> {
    pub id: EffectId,
    /// By the names of the catalogue.
    pub changes: &'c BTreeMap<&'static str, ParameterChange>,
    pub reading_unit: &'c str,
}

/// The change of one effect as a clause with a verb, without a full stop.
pub(crate) fn clause(of: &Clause<'_>) -> String {
    let elements = of.changes.get("elements").and_then(|change| match &change.after {
        FittedParameter::Elements { value } => Some(value.as_slice()),
        _ => None,
    });
    let departure = of.changes.get("departure").and_then(|change| change.change);
    let words = match (of.id, elements, departure) {
        (EffectId::DeadElements, Some(elements), _) => {
            format!("{} died", elements_listed(elements))
        }
        (EffectId::Polarity, Some(elements), _) => {
            format!("{} reversed polarity", elements_listed(elements))
        }
        (EffectId::SwappedChannels, Some(elements), _) => {
            format!("{} were exchanged", elements_listed(elements))
        }
        (EffectId::ElementGain, Some(elements), Some(departure)) => {
            format!("the amplitude of {} {}", elements_listed(elements), fell_or_rose(departure))
        }
        (EffectId::ElementPhase, Some(elements), Some(departure)) => {
            format!(
                "the phase of {} changed by {} rad",
                elements_listed(elements),
                signed(departure)
            )
        }
        (EffectId::ElementGain, ..) => of_each(of, "spread", "amplitudes of the elements", ""),
        (EffectId::ElementPhase, ..) => of_each(of, "spread_rad", "phases of the elements", " rad"),
        (EffectId::ElementTilt, ..) => of_each(of, "spread_rad", "axes of the elements", " rad"),
        _ => with_numbers(of),
    };
    with_minus_signs(&words)
}

fn of_each(of: &Clause<'_>, spread: &str, what: &str, unit: &str) -> String {
    let spread = of.changes.get(spread).and_then(|change| change.change);
    let by = spread
        .map_or(String::new(), |spread| format!(", with a spread of {}{unit}", uncertain(spread)));
    format!("the {what} changed{by}")
}

/// The cause, and how each of its parameters changed.
fn with_numbers(of: &Clause<'_>) -> String {
    let parts: Vec<String> = of
        .changes
        .iter()
        .map(|(name, change)| {
            let full = format!("{}.{name}", of.id);
            let unit = FittedParameter::unit(&full, of.reading_unit);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let label = label(name);
            match (change.change, change.before) {
                (Some(by), Some(before)) if before != 0.0 => format!(
                    "{label}{}{unit}, from {} to {}",
                    signed(by),
                    rounded_like(before, by),
                    rounded_like(before + by.value, by),
                ),
                (Some(by), _) => format!("{label}{}{unit}", signed(by)),
                (None, _) => format!("{label}{}", change.after.in_words(&full, of.reading_unit)),
            }
        })
        .collect();
    let what = changed_thing(of.id);
    match parts.is_empty() {
        true => format!("{what} changed"),
        false => format!("{what} changed: {}", parts.join("; ")),
    }
}

/// The parameter's name where one alone would not be clear.
fn label(name: &str) -> String {
    let bare = ["_m_s", "_mm", "_rad", "_deg", "_s"]
        .iter()
        .find_map(|unit| name.strip_suffix(unit))
        .unwrap_or(name);
    match bare {
        "c" | "ratio" | "rad" | "mm" | "s" | "exponent" | "level" | "width_ratio" | "db_per_m" => {
            String::new()
        }
        other => format!("{} ", other.replace('_', " ")),
    }
}

/// What is not as it was.
fn changed_thing(id: EffectId) -> &'static str {
    match id {
        EffectId::SoundSpeed => "the speed of sound",
        EffectId::Absorption => "the absorption of the air",
        EffectId::Flow => "the wind across the field",
        EffectId::TemperatureGradient => "the temperature gradient",
        EffectId::TemperatureDrift => "the drift of the temperature",
        EffectId::Turbulence => "the turbulence of the air",
        EffectId::Spreading => "the decay with distance",
        EffectId::Directivity => "the width of the elements' lobes",
        EffectId::Crosstalk => "the crosstalk between the elements",
        EffectId::Pitch => "the pitch of the array",
        EffectId::ArrayTilt => "the tilt of the array",
        EffectId::BowedArray => "the bow of the array",
        EffectId::PhaseQuantisation => "the steps of the driven phases",
        EffectId::DriveFrequency => "the frequency of the drive, as a ratio to the nominal,",
        EffectId::Offset => "the place of the robot's origin",
        EffectId::Rotation => "the rotation of the robot's axes",
        EffectId::Skew => "the angle between the robot's axes",
        EffectId::AxisScale => "the robot's steps per millimetre",
        EffectId::LeadScrew => "the periodic error of an axis",
        EffectId::Backlash => "the backlash of the robot",
        EffectId::Lag => "the lag of the readings",
        EffectId::PositionJitter => "the scatter of the robot's position",
        EffectId::ReceiverDirectivity => "the directivity of the receiver",
        EffectId::Aperture => "the effective face of the receiver",
        EffectId::Saturation => "the saturation of the receiver",
        EffectId::NoiseFloor => "the floor of the detector",
        EffectId::Clipping => "the full scale of the receiver",
        EffectId::Reflection => "the reflection above the field",
        EffectId::Wall => "the wall beside the field",
        EffectId::Scatterer => "the object in the field",
        EffectId::StandingWave => "the standing wave at the receiver",
        EffectId::GainDrift => "the drift of the gain",
        EffectId::PhasePlane
        | EffectId::OnAxisUnit
        | EffectId::ElementGain
        | EffectId::ElementPhase
        | EffectId::ElementTilt
        | EffectId::DeadElements
        | EffectId::Polarity
        | EffectId::SwappedChannels => id.as_cause(),
    }
}

fn signed(change: Uncertain) -> String {
    let sign = if change.value > 0.0 { "+" } else { "" };
    format!("{sign}{}", uncertain(change))
}

/// A number with the decimals that a change with this error has.
fn rounded_like(value: f64, change: Uncertain) -> String {
    let error = change.standard_error;
    match error > 0.0 && error.is_finite() {
        true => format!("{value:.*}", (1.0 - error.log10().floor()).clamp(0.0, 6.0) as usize),
        false => significant(value, 4),
    }
}

/// A relative change as a verb with percent.
pub(crate) fn fell_or_rose(change: Uncertain) -> String {
    let verb = if change.value < 0.0 { "fell" } else { "rose" };
    let by = Uncertain {
        value: 100.0 * change.value.abs(),
        standard_error: 100.0 * change.standard_error,
    };
    format!("{verb} by {}\u{a0}%", uncertain(by))
}

/// What the sentence rests on.
pub(crate) struct Headline<'h> {
    pub records: [&'h RecordName; 2],
    pub verdict: ChangeVerdict,
    /// The named candidates, the best first.
    pub named: Vec<&'h ChangeCandidate>,
    pub level: Uncertain,
    pub size_in_sigma: f64,
    /// Tests that find structure in what the best candidate leaves.
    pub structure: Vec<String>,
}

impl Headline<'_> {
    /// What changed, in one sentence.
    pub fn sentence(&self) -> String {
        let when = self.when();
        let sentence = match self.verdict {
            ChangeVerdict::None => "Nothing changed beyond noise.".to_owned(),
            ChangeVerdict::Level => {
                format!("The level {}{when}; the shape of the field did not change.", self.level())
            }
            ChangeVerdict::Explained | ChangeVerdict::MostlyExplained => {
                let named = self.named[0];
                let beside = match self.level_changed(named.level) {
                    true => {
                        format!(" Beside it the level {}.", fell_or_rose(relative(named.level)))
                    }
                    false => String::new(),
                };
                let left = match self.verdict {
                    ChangeVerdict::MostlyExplained => format!(
                        "this explains {} of the change, and a small share is left that is not noise",
                        percent(named.explained_fraction)
                    ),
                    _ => "what is left is noise".to_owned(),
                };
                let clauses = named.readings.join(", and ");
                let clauses = match clauses.split_once(':') {
                    Some((what, numbers)) => format!("{what}{when}:{numbers}"),
                    None => format!("{clauses}{when}"),
                };
                format!("{clauses}; {left}.{beside}")
            }
            ChangeVerdict::Ambiguous => {
                let rivals: Vec<String> =
                    self.named.iter().map(|rival| rival.readings.join(", and ")).collect();
                format!("Either {}{when}; the readings do not tell which.", rivals.join(", or "))
            }
            ChangeVerdict::Unexplained => format!(
                "The field changed{when} by {} standard deviations of a reading, and no effect of the catalogue explains it{}.",
                significant(self.size_in_sigma, 2),
                match self.structure.is_empty() {
                    true => String::new(),
                    false => format!(" ({})", self.structure.join("; ")),
                }
            ),
        };
        let mut letters = sentence.chars();
        let first = letters.next().map(char::to_uppercase);
        first.into_iter().flatten().chain(letters).collect()
    }

    fn level(&self) -> String {
        fell_or_rose(relative(self.level))
    }

    fn level_changed(&self, level: Uncertain) -> bool {
        (level.value - 1.0).abs() > crate::limits::LEVEL_SIGMA * level.standard_error
    }

    /// The times between which it happened; nothing where the records have no order in time.
    fn when(&self) -> String {
        let [a, b] = self.records.map(|record| record.recorded.as_str());
        let parts = |time: &str| Some((time.get(..10)?.to_owned(), time.get(11..16)?.to_owned()));
        let (Some((day_a, time_a)), Some((day_b, time_b))) = (parts(a), parts(b)) else {
            return String::new();
        };
        if a >= b {
            return String::new();
        }
        match (day_a == day_b, time_a == time_b) {
            (true, true) => format!(" at {time_a} UTC"),
            (true, false) => format!(" between {time_a} and {time_b} UTC"),
            (false, _) => format!(" between {day_a} {time_a} and {day_b} {time_b} UTC"),
        }
    }
}

fn relative(level: Uncertain) -> Uncertain {
    Uncertain { value: level.value - 1.0, ..level }
}
