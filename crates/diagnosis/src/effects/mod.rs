//! The effects that a simulator may leave out, each as a change of what is supposed.
//!
//! One file each, with its physics, its source, its parameters with unit and plausible range, and **one line in the registry
//! below**. Nothing here is shared with the virtual rig's effects, which act on paths of sound: what makes a field and what
//! explains it were written apart.

mod absorption;
mod aperture;
mod array_tilt;
mod axis_scale;
mod backlash;
mod clipping;
mod dead_elements;
mod defect;
mod directivity;
mod drive_frequency;
mod element_gain;
mod element_phase;
mod flow;
mod gain_drift;
mod lag;
mod noise_floor;
mod of_elements;
mod offset;
mod on_axis_unit;
mod phase_plane;
pub(super) mod phase_quantisation;
mod pitch;
mod polarity;
mod random;
mod receiver_directivity;
mod reflection;
mod rotation;
mod saturation;
mod skew;
mod sound_speed;
mod spreading;
mod standing_wave;
mod swapped_channels;
mod temperature_gradient;
pub(super) mod turbulence;

use std::collections::BTreeMap;

use super::FittedParameter;
use super::observations::Observations;
use super::supposed::Supposed;
use fieldgap_acoustics::Simulation;

/// A real parameter as a fit works on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameter {
    /// Where the effect does nothing.
    pub neutral: f64,
    /// A change that matters: about what a good scan tells.
    pub scale: f64,
    /// Least plausible value.
    pub least: f64,
    /// Largest plausible value.
    pub most: f64,
}

/// What is chosen, not fitted: whole numbers.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Choice {
    /// Nothing is.
    None,
    /// These elements.
    Elements(Vec<usize>),
    /// One of two laws.
    Law(u8),
    /// So many steps, counted from so many sixteenths of a step.
    Steps(u32, u8),
}

/// How an effect is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Search {
    /// From its starts, downhill.
    Smooth,
    /// Every set of up to three elements, then downhill in what remains.
    Sets,
    /// Every pair of elements.
    Exchanges,
    /// Every number of steps.
    Steps,
    /// Every height of a plane, its coefficient solved for.
    Heights,
    /// A random number for each element, the same spread for all.
    Random,
}

impl Search {
    /// Whether the cost has many minima, so that what was found depends on what else was known.
    pub fn has_many_minima(self) -> bool {
        self.is_of_elements() || self == Self::Heights
    }

    /// Whether what is found is something that single elements' departures show.
    pub fn is_of_elements(self) -> bool {
        matches!(self, Self::Sets | Self::Exchanges | Self::Steps)
    }
}

/// A fitted number and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fitted {
    pub value: f64,
    pub error: f64,
}

impl Fitted {
    /// Through a function with this value and slope.
    fn map(self, value: f64, slope: f64) -> Self {
        Self { value, error: self.error * slope.abs() }
    }

    fn real(self) -> FittedParameter {
        FittedParameter::Real { value: self.value, standard_error: self.error }
    }
}

/// What an effect's fit says, in its own parameters and in words.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Said {
    /// Parameters by the names of the catalogue.
    pub parameters: BTreeMap<&'static str, FittedParameter>,
    /// Their meaning, one sentence.
    pub sentence: String,
}

impl Said {
    fn new<const N: usize>(
        parameters: [(&'static str, FittedParameter); N],
        sentence: String,
    ) -> Self {
        Self { parameters: BTreeMap::from(parameters), sentence }
    }
}

/// One effect of the catalogue.
pub(super) trait Effect: Sync {
    /// Its name in the catalogue.
    fn id(&self) -> &'static str;

    /// Its real parameters.
    fn parameters(&self) -> &'static [Parameter] {
        &[]
    }

    /// How it is looked for.
    fn search(&self) -> Search {
        Search::Smooth
    }

    /// Where it does nothing.
    fn neutral(&self) -> Vec<f64> {
        self.parameters().iter().map(|parameter| parameter.neutral).collect()
    }

    /// Where a search begins; as many numbers as parameters.
    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![self.neutral()]
    }

    /// What may be chosen besides, all of it tried.
    fn choices(&self) -> Vec<Choice> {
        vec![Choice::None]
    }

    /// Whether the cost is flat where the effect does nothing, or it does nothing nowhere: then its slope there says
    /// nothing about it.
    fn begins_flat(&self, _believed: &Context) -> bool {
        self.parameters().is_empty()
    }

    /// Whether it can act on what was observed at all.
    fn can_act(&self, _observations: &Observations) -> bool {
        true
    }

    /// Whether it is the simulator's own defect, and no physics.
    fn is_defect(&self) -> bool {
        false
    }

    /// Adds it to what is supposed.
    fn suppose(&self, values: &[f64], choice: &Choice, believed: &Context, supposed: &mut Supposed);

    /// What shows it without a scan of the field, as a clause.
    fn shown_by(&self) -> Option<&'static str> {
        None
    }

    /// What a fit of it says.
    fn say(&self, fitted: &[Fitted], choice: &Choice, believed: &Context) -> Said;
}

/// What effects measure themselves against.
#[derive(Debug, Clone)]
pub(super) struct Context {
    /// The set-up as believed.
    pub believed: Simulation,
    /// The largest reading.
    pub largest_reading: f64,
    /// Unit of the readings.
    pub unit: String,
    /// The highest point, m.
    pub highest_m: f64,
    /// The floor that silence shows, in the reading's unit; zero for none.
    pub silent_floor: f64,
}

/// Every effect of the catalogue, in its order.
pub(super) static CATALOGUE: [&dyn Effect; 32] = [
    &phase_plane::PHASE_PLANE,
    &on_axis_unit::ON_AXIS_UNIT,
    &sound_speed::SoundSpeed,
    &absorption::Absorption,
    &flow::Flow,
    &temperature_gradient::TemperatureGradient,
    &turbulence::Turbulence,
    &spreading::Spreading,
    &directivity::Directivity,
    &element_gain::ELEMENT_GAIN,
    &element_phase::ELEMENT_PHASE,
    &dead_elements::DEAD_ELEMENTS,
    &polarity::POLARITY,
    &swapped_channels::SWAPPED_CHANNELS,
    &pitch::Pitch,
    &array_tilt::ArrayTilt,
    &phase_quantisation::PhaseQuantisation,
    &drive_frequency::DriveFrequency,
    &offset::Offset,
    &rotation::Rotation,
    &axis_scale::AxisScale,
    &skew::Skew,
    &backlash::Backlash,
    &lag::Lag,
    &receiver_directivity::ReceiverDirectivity,
    &aperture::Aperture,
    &saturation::Saturation,
    &noise_floor::NoiseFloor,
    &clipping::Clipping,
    &reflection::Reflection,
    &standing_wave::StandingWave,
    &gain_drift::GainDrift,
];

/// Numbers in a list, for sentences.
fn listed(elements: &[usize]) -> String {
    let numbers: Vec<String> = elements.iter().map(usize::to_string).collect();
    match numbers.split_last() {
        Some((last, [])) => format!("element {last}"),
        Some((last, rest)) => format!("elements {} and {last}", rest.join(", ")),
        None => "no element".to_owned(),
    }
}

impl Choice {
    /// The elements chosen; none where none are.
    pub fn elements(&self) -> &[usize] {
        match self {
            Self::Elements(elements) => elements,
            Self::None | Self::Law(_) | Self::Steps(..) => &[],
        }
    }
}
