//! What an effect is to the rest of a diagnosis: its parameters, where it acts on the way from the drive to the reading, how it is
//! looked for, and how it is told to a reader.
//!
//! An effect acts at one or more points of the measurement chain. Each point is a method of [`Effect`] that does nothing by default:
//!
//! | point of the chain | method |
//! |---|---|
//! | speed of sound and frequency | [`Effect::carrier`], [`Effect::speed_ratio_at`] |
//! | delays of the driver, routing of its outputs | [`Effect::drive_phases`], [`Effect::coupled`] |
//! | places, amplitudes and phases of the elements | [`Effect::elements`] |
//! | lobe, on-axis law, path lengths of the simulator | [`Effect::radiation`] |
//! | propagation along each path | [`Effect::air`], [`Effect::scintillating`] |
//! | place of the receiver | [`Effect::position`], [`Effect::scattered_position`] |
//! | sensitivity to the angle of arrival | [`Effect::sensitivity`] |
//! | waves that come from elsewhere | [`Effect::added_waves`] |
//! | gain, amplifier and detector, converter | [`Effect::gain`], [`Effect::transfer`], [`Effect::clipped`] |

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use num_complex::Complex64;

use fieldgap_acoustics::transducer::{OnAxis, Transducer};
use fieldgap_acoustics::{
    Element, FieldSum, PathLengths, Propagation, Simulation, Simulator, Vec3,
};
use fieldgap_text::{listed, with_minus_signs};

use super::instance::{Instance, Setting};
use super::mirror::Mirror;
use super::observations::{Observations, Visit};
use super::pressure::Pressure;
use super::stated_uncertainty::StatedUncertainty;
use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::remedy::Remedy;
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::scatter::Scatter;

/// A real parameter as a fit works on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Parameter {
    /// Where the effect does nothing.
    pub neutral: f64,
    /// A change that matters: about what a good scan resolves. Difference quotients step a thousandth of it.
    pub scale: f64,
    /// Least plausible value.
    pub least: f64,
    /// Largest plausible value.
    pub most: f64,
}

/// What is chosen, not fitted.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Choice {
    /// Nothing.
    None,
    /// These elements.
    Elements(Vec<usize>),
    /// One of several laws.
    Law(u8),
    /// A number of steps in a period, and where each drive counts them from, in 65,536ths of a step: one for every drive by its number, or
    /// one for all.
    Steps(u32, Vec<u16>),
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

/// How an effect is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Search {
    /// From its starts, downhill.
    Smooth,
    /// Every set of up to three elements, or of up to a twelfth of those of a large array, then downhill in what remains.
    Sets,
    /// Every pair of elements.
    Exchanges,
    /// Every number of steps.
    Steps,
    /// Every height of a plane, its coefficient solved for.
    Heights,
    /// Every axis and every period along it, the error solved for.
    Periods,
    /// Every direction and distance of a wall, its coefficient solved for.
    Walls,
    /// Every place of an object, what it scatters solved for.
    Objects,
    /// A random number for each element, the same spread for all.
    Random,
}

impl Search {
    /// Whether the cost has many minima, so that what was found depends on what else was known.
    pub fn has_many_minima(self) -> bool {
        self.is_of_elements()
            || matches!(self, Self::Heights | Self::Walls | Self::Objects | Self::Periods)
    }

    /// Whether what is found is something that single elements' departures show.
    pub fn is_of_elements(self) -> bool {
        matches!(self, Self::Sets | Self::Exchanges | Self::Steps)
    }
}

/// Where in the measurement chain an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// On the field, or on where it is sampled.
    Field,
    /// On the gain, the same for all levels.
    Gain,
    /// In amplifier and detector: it depends on the level and changes how readings scatter.
    Detector,
    /// In the converter, after the noise.
    Converter,
}

/// What an effect asks about the robot's motion before a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Timing {
    /// Nothing: only the place matters.
    Place,
    /// The moment within the scan.
    Moment,
    /// The direction of travel.
    Direction,
    /// The velocity.
    Velocity,
}

impl Timing {
    /// Whether it matters how the robot arrived at a reading.
    pub fn is_of_arrival(self) -> bool {
        matches!(self, Self::Direction | Self::Velocity)
    }
}

/// What differs from element to element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PerElement {
    /// Nothing: the effect concerns the array as a whole, or no element.
    No,
    /// Some elements are named.
    Named,
    /// Each has an amplitude of its own.
    Amplitude,
    /// Each has a phase of its own.
    Phase,
    /// Each has an axis of its own.
    Axis,
}

impl PerElement {
    /// How many departures each element has, where they are random.
    pub fn departures(self) -> usize {
        if self == Self::Axis { 2 } else { 1 }
    }
}

/// A fitted number and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    pub value: f64,
    pub error: f64,
}

impl Estimate {
    /// A spread that was found from so many draws: its relative error is 1/√(2n).
    pub fn of_spread(spread: f64, draws: usize) -> Self {
        Self { value: spread, error: spread / (2.0 * draws as f64).sqrt() }
    }

    /// Through a function with this value and slope.
    pub fn map(self, value: f64, slope: f64) -> Self {
        Self { value, error: self.error * slope.abs() }
    }

    /// As a parameter of a diagnosis.
    pub fn real(self) -> FittedParameter {
        FittedParameter::Real { value: self.value, standard_error: self.error }
    }
}

/// What a fit of an effect found, in the catalogue's parameters and in words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finding {
    /// Parameters by the names of the catalogue.
    pub parameters: BTreeMap<&'static str, FittedParameter>,
    /// Their meaning, one sentence.
    pub sentence: String,
}

impl Finding {
    pub fn new(
        parameters: impl IntoIterator<Item = (&'static str, FittedParameter)>,
        sentence: String,
    ) -> Self {
        let parameters = parameters.into_iter().collect();
        Self { parameters, sentence: with_minus_signs(&sentence) }
    }
}

/// The set-up as believed, and what effects measure themselves against.
#[derive(Debug, Clone)]
pub(crate) struct Context {
    /// The set-up as believed.
    pub believed: Simulation,
    /// Pairs of elements that are nearest to each other.
    pub neighbours: Arc<[(usize, usize)]>,
    /// The largest reading.
    pub largest_reading: f64,
    /// Unit of the readings.
    pub unit: String,
    /// The highest point, m.
    pub highest_m: f64,
    /// Time from the first driven reading of the (first) scan to the last, s.
    pub lasts_s: f64,
    /// The floor that dark readings show, in the reading's unit; zero for none.
    pub dark_floor: f64,
    /// What is known from another record of the same rig, and held; `None` where the set-up alone is believed.
    pub common: Option<Common>,
    /// How well the set-up is known.
    pub stated: StatedUncertainty,
    /// The only effects that are tried; without it, all.
    pub tried: Option<BTreeSet<EffectId>>,
}

impl Context {
    /// Whether an effect is tried.
    pub fn tries(&self, effect: EffectId) -> bool {
        self.tried.as_ref().is_none_or(|tried| tried.contains(&effect))
    }
}

/// What two records of one rig have in common, whatever changed between them.
#[derive(Debug, Clone)]
pub(crate) struct Common {
    /// Effects that act in both, with their values.
    pub effects: Vec<(Instance, Vec<f64>)>,
    /// Share of a piston's near field that the elements show.
    pub near_field: f64,
}

/// Speed of sound and frequency, over the believed ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Carrier {
    /// True speed of sound over the believed one.
    pub speed_ratio: f64,
    /// True frequency over the believed one.
    pub frequency_ratio: f64,
}

/// How an element radiates.
pub(crate) struct Radiation<'t> {
    /// The model of the transducer.
    pub transducer: &'t dyn Transducer,
    /// Width of its lobe over the modelled one.
    pub width_ratio: f64,
    /// Whether the lobe is wider because the face is smaller, and not because every angle is stretched.
    pub by_face: bool,
    /// Its shape; see [`Shaped`](fieldgap_acoustics::transducer::Shaped).
    pub shape: [f64; 2],
    /// Another law on the axis.
    pub on_axis: Option<OnAxis>,
    /// Where path lengths are taken.
    pub paths: PathLengths,
}

/// The field around a set of points, for waves that come from elsewhere than the elements.
pub(crate) trait SurroundingField {
    /// Where the pressures are, m, array's frame.
    fn points_m(&self) -> &[Vec3];
    /// The wavenumber, rad/m.
    fn wavenumber_rad_m(&self) -> f64;
    /// The field of the array's images in a plane, if it reflects all of it.
    fn images(&self, mirror: &Mirror) -> Vec<Complex64>;
    /// Where each element is, m, and its pressure at a place.
    fn waves_at(&self, at_m: &Vec3) -> Vec<(Vec3, Complex64)>;
}

/// The sums over elements at the points of interest, each path attenuated by so much more, Np/m.
pub(crate) type AttenuatedSums<'f> = dyn Fn(f64) -> Vec<FieldSum> + 'f;

/// The pressures at any points.
pub(crate) type FieldAt<'f> = dyn Fn(&[Vec3]) -> Vec<Pressure> + 'f;

/// The expected reading, and the variance of a reading about it over that of the scan's scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    pub reading: f64,
    pub variance_ratio: f64,
}

/// What the phases of a diagnosis ask about an effect.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facts {
    /// Where it acts.
    pub stage: Stage,
    /// What it asks about the robot's motion.
    pub timing: Timing,
    /// What differs from element to element.
    pub per_element: PerElement,
    /// Effects that a single scan mistakes for it. A test holds them against the Fisher information of a scan, where both act to first
    /// order.
    pub mimics: &'static [EffectId],
    /// What shows it without a scan of the field, as a clause; `None` where nothing simple does.
    pub independent_check: Option<&'static str>,
}

/// One effect of the catalogue.
///
/// What every effect must say has no default. What acts at one point of the chain overrides the method of that point.
pub(crate) trait Effect: Sync {
    /// Its name in the catalogue.
    fn id(&self) -> EffectId;

    /// Its real parameters, as a fit works on them.
    fn parameters(&self) -> &'static [Parameter];

    /// What the phases of a diagnosis ask about it.
    fn facts(&self) -> Facts;

    /// What corrects it: a key of a set-up file, or a work at the rig.
    fn remedy(&self, simulator: Simulator) -> Remedy;

    /// What a fit of it found.
    fn describe(&self, fitted: &[Estimate], choice: &Choice, context: &Context) -> Finding;

    /// Its real parameters under one of its choices.
    fn parameters_of(&self, _choice: &Choice) -> &'static [Parameter] {
        self.parameters()
    }

    /// Values that were fitted under another choice, as a start under this one: neutral where there are more or fewer of them.
    fn carried(&self, values: Vec<f64>, choice: &Choice) -> Vec<f64> {
        let parameters = self.parameters_of(choice);
        let random = self.search() == Search::Random;
        match random || values.len() == parameters.len() {
            true => values,
            false => parameters.iter().map(|parameter| parameter.neutral).collect(),
        }
    }

    // How it is looked for.

    /// How it is looked for.
    fn search(&self) -> Search {
        Search::Smooth
    }

    /// Where it does nothing.
    fn neutral(&self) -> Vec<f64> {
        self.parameters().iter().map(|parameter| parameter.neutral).collect()
    }

    /// Departures of so many elements where none departs, for effects whose departures are random: of each kind all elements in turn.
    fn no_departures(&self, elements: usize) -> Vec<f64> {
        vec![0.0; self.facts().per_element.departures() * elements]
    }

    /// Where a search begins; as many numbers as parameters.
    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![self.neutral()]
    }

    /// Nats by which these values are less likely than smaller ones that laboratories have.
    fn against_size(&self, _values: &[f64]) -> f64 {
        0.0
    }

    /// What may be chosen besides, all of it tried.
    fn choices(&self) -> Vec<Choice> {
        vec![Choice::None]
    }

    /// Whether the slope at the neutral point says nothing about the effect: the cost is flat there, or there is no neutral point.
    fn begins_flat(&self, _context: &Context) -> bool {
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

    /// Whether it makes a reading differ from its own repeat. It is considered only if repeats show it, or if the fit is near the noise.
    fn scatters_repeats(&self) -> bool {
        false
    }

    /// Whether the free shift of a scan takes it up, so that a shift larger than careful setting-up leaves is its sign.
    fn is_told_by_shift(&self) -> bool {
        false
    }

    /// The most of its first parameters that repeats and dark readings of a scan allow; none of others.
    fn most(&self, _scatter: &Scatter, _context: &Context) -> Vec<f64> {
        Vec::new()
    }

    /// What the dark readings of a scan say for it, in nats.
    fn evidence_of_dark_readings(&self, _scatter: &Scatter) -> f64 {
        0.0
    }

    // Where it acts.

    /// Changes the speed of sound or the frequency.
    fn carrier(&self, _at: Setting<'_>, _carrier: &mut Carrier) {}

    /// Changes the phases that the elements are driven with, rad, one for each element.
    fn drive_phases(
        &self,
        _at: Setting<'_>,
        _drive: usize,
        _carrier: &Carrier,
        _phases_rad: &mut [f64],
    ) {
    }

    /// Whether the drives of other elements change what an element emits.
    fn couples(&self) -> bool {
        false
    }

    /// Changes the elements by the phases, rad, that they all are driven with.
    fn coupled(&self, _at: Setting<'_>, _phases_rad: &[f64], _elements: &mut [Element]) {}

    /// Factor on the speed of sound at a moment of the scan, seconds after its first driven reading.
    fn speed_ratio_at(&self, _at: Setting<'_>, _time_s: f64) -> f64 {
        1.0
    }

    /// Changes the elements.
    fn elements(&self, _at: Setting<'_>, _elements: &mut [Element]) {}

    /// Factor on the complex amplitude of an element with this departure; one where its wave changes otherwise in each direction.
    fn element_weight(&self, _departure: f64) -> Complex64 {
        Complex64::ONE
    }

    /// Changes how the elements radiate.
    fn radiation(&self, _at: Setting<'_>, _radiation: &mut Radiation<'_>) {}

    /// Changes the propagation; `speed_m_s` is the true speed of sound.
    fn air(&self, _at: Setting<'_>, _speed_m_s: f64, _air: &mut Propagation) {}

    /// The fluctuation of the field that it makes, with its cause.
    fn fluctuation(&self, _values: &[f64], _choice: &Choice) -> Option<(f64, Fluctuation)> {
        None
    }

    /// The pressures where the phase of each path fluctuates, from sums over the elements.
    fn scintillating(&self, _at: Setting<'_>, _sums: &AttenuatedSums<'_>) -> Option<Vec<Pressure>> {
        None
    }

    /// Where the receiver truly is, m, if the robot believes it to be at `at_m`; both in the array's frame.
    fn position(&self, _at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        at_m
    }

    /// The pressures where the place scatters about these points from reading to reading.
    fn scattered_position(
        &self,
        _at: Setting<'_>,
        _points_m: &[Vec3],
        _field: &FieldAt<'_>,
    ) -> Option<Vec<Pressure>> {
        None
    }

    /// Sensitivity of the receiver to a plane wave from an angle, rad, at a wavenumber, rad/m; `None` where it is one for all angles.
    fn sensitivity<'a>(
        &self,
        _at: Setting<'a>,
        _wavenumber_rad_m: f64,
    ) -> Option<Box<dyn Fn(f64) -> f64 + 'a>> {
        None
    }

    /// Adds waves that come from elsewhere than the elements.
    fn added_waves(
        &self,
        _at: Setting<'_>,
        _field: &dyn SurroundingField,
        _pressures: &mut [Pressure],
    ) {
    }

    /// Factor on the gain at a moment of the scan, 0 at its first reading to 1 at its last.
    fn gain(&self, _at: Setting<'_>, _progress: f64) -> f64 {
        1.0
    }

    /// Whether readings scatter otherwise than the scan's scatter says.
    fn changes_scatter(&self, _at: Setting<'_>) -> bool {
        false
    }

    /// What amplifier and detector make of a level.
    fn transfer(&self, _at: Setting<'_>, level: f64) -> f64 {
        level
    }

    /// The slope of that where it makes `output` of `input`.
    fn transfer_slope(&self, _input: f64, _output: f64) -> f64 {
        1.0
    }

    /// A floor that is added in power, in the reading's unit.
    fn floor(&self, _at: Setting<'_>) -> f64 {
        0.0
    }

    /// Whether noise in proportion to the level comes in before the detector; `None` where the effect does not ask.
    fn proportional_noise_before_detector(&self, _choice: &Choice) -> Option<bool> {
        None
    }

    /// What the converter leaves of readings with this mean, variance and standard deviation.
    fn clipped(&self, _at: Setting<'_>, expected: Expected, _deviation: f64) -> Expected {
        expected
    }
}

/// Elements as the subject of a clause.
pub(crate) fn elements_listed(elements: &[usize]) -> String {
    let numbers: Vec<String> = elements.iter().map(usize::to_string).collect();
    match numbers.as_slice() {
        [] => "no element".to_owned(),
        [one] => format!("element {one}"),
        several => format!("elements {}", listed(several)),
    }
}
