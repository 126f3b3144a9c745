//! `[adaptive]` of a plan: the map that is wanted, how certain it is to be, and what it may cost.

use serde::Deserialize;
use toml::Spanned;

use super::closed_loop::count_of_readings;
use super::one_or_many::OneOrMany;
use super::region::{Layers, Reader};
use fieldgap_input::{Exact, Fault, Fraction, Length, Place, Time};

/// Error by default, as a share of the peak, and the probability with which no place has a larger one.
const ERROR: f64 = 0.01;
const CONFIDENCE: f64 = 0.95;

/// Readings of the first round and of a later one by default: a later one takes some twenty seconds of a robot that stops at each place.
const FIRST_READINGS: usize = 192;
const ROUND_READINGS: usize = 96;

/// Readings in all by default: a quarter of the places of the map.
const PLACES_PER_READING: usize = 4;

/// Most places of a map, those of all drives together: more than a screen shows, and a minute of work after each round.
const MOST_PLACES: usize = 200_000;

/// The keys of `[adaptive]`: those of a `[[plane]]` or of a `[[volume]]`, and what the map may cost.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AdaptiveTable {
    z_mm: Option<Spanned<OneOrMany<Place>>>,
    centre_mm: Option<Exact<Place, 2>>,
    size_mm: Option<Spanned<Exact<Length, 2>>>,
    min_mm: Option<Exact<Place, 3>>,
    max_mm: Option<Spanned<Exact<Place, 3>>>,
    step_mm: Spanned<OneOrMany<Length>>,
    error: Option<Spanned<Fraction>>,
    confidence: Option<Spanned<Fraction>>,
    readings: Option<Spanned<usize>>,
    minutes: Option<Time>,
    sounding_minutes: Option<Time>,
    first_readings: Option<Spanned<usize>>,
    round_readings: Option<Spanned<usize>>,
    #[serde(default)]
    prior: MapPrior,
}

/// What is believed of the field before the readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapPrior {
    /// The simulation, corrected by what has been learnt, and a process of what it misses.
    #[default]
    Simulation,
    /// A process of the amplitude alone, to compare with.
    Process,
}

/// A map that the rig measures where it is least certain.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptiveMap {
    /// The grid of the map.
    pub grid: Layers,
    /// Error that is wanted everywhere, as a share of the largest amplitude of the map.
    pub error: f64,
    /// Probability with which a place of the map has no larger error.
    pub confidence: f64,
    /// Readings at most, silent ones and repeats included.
    pub most_readings: usize,
    /// Longest time from the first reading to the last on the rig's clock, s.
    pub longest_s: Option<f64>,
    /// Longest time with the array driven, s.
    pub longest_sounding_s: Option<f64>,
    /// Readings of the first round.
    pub first_readings: usize,
    /// Readings of each later round.
    pub round_readings: usize,
    /// What is believed of the field before the readings.
    pub prior: MapPrior,
}

impl AdaptiveMap {
    /// With the defaults, on this grid for so many drives.
    pub fn on(grid: Layers, foci: usize) -> Self {
        let places = grid.points().saturating_mul(foci);
        Self {
            grid,
            error: ERROR,
            confidence: CONFIDENCE,
            most_readings: (places / PLACES_PER_READING).max(FIRST_READINGS),
            longest_s: None,
            longest_sounding_s: None,
            first_readings: FIRST_READINGS,
            round_readings: ROUND_READINGS,
            prior: MapPrior::default(),
        }
    }

    pub(super) fn read(table: &Spanned<AdaptiveTable>, reader: &Reader<'_>) -> Result<Self, Fault> {
        let (keys, source) = (table.get_ref(), reader.source);
        let grid = grid_of(table, reader)?;
        let usual = Self::on(grid, reader.foci.max(1));
        let places = usual.grid.points().saturating_mul(reader.foci.max(1));
        if places > MOST_PLACES {
            return Err(source.fault(
                keys.step_mm.span(),
                format!("the map has {places} places, those of all drives together; at most {MOST_PLACES} are allowed"),
                "make the step larger; between its places a map can be interpolated",
            ));
        }
        for (share, what) in [(&keys.error, "error"), (&keys.confidence, "confidence")] {
            if let Some(given) = share.as_ref().filter(|given| {
                let share = given.get_ref().get();
                share <= 0.0 || share >= 1.0
            }) {
                return Err(source.fault(
                    given.span(),
                    format!("`{what}` is a share between 0 and 1, both excluded"),
                    "for 1 % write 0.01, for 95 % write 0.95",
                ));
            }
        }
        let share = |given: &Option<Spanned<Fraction>>, otherwise: f64| {
            given.as_ref().map_or(otherwise, |given| given.get_ref().get())
        };
        let first_readings = count_of_readings(&keys.first_readings, usual.first_readings, source)?;
        let most_readings =
            count_of_readings(&keys.readings, usual.most_readings.max(first_readings), source)?;
        if let Some(given) = keys.readings.as_ref().filter(|_| most_readings < first_readings) {
            return Err(source.fault(
                given.span(),
                format!("the first round alone has {first_readings} readings"),
                "allow more `readings`, or fewer `first_readings`",
            ));
        }
        let seconds = |minutes: Option<Time>| minutes.map(|minutes| 60.0 * minutes.get());
        Ok(Self {
            error: share(&keys.error, usual.error),
            confidence: share(&keys.confidence, usual.confidence),
            most_readings,
            longest_s: seconds(keys.minutes),
            longest_sounding_s: seconds(keys.sounding_minutes),
            first_readings,
            round_readings: count_of_readings(&keys.round_readings, usual.round_readings, source)?,
            prior: keys.prior,
            ..usual
        })
    }
}

/// The grid of planes, or of a box.
fn grid_of(table: &Spanned<AdaptiveTable>, reader: &Reader<'_>) -> Result<Layers, Fault> {
    let keys = table.get_ref();
    match (&keys.z_mm, &keys.size_mm, &keys.min_mm, &keys.max_mm) {
        (Some(z_mm), Some(size_mm), None, None) => {
            let [step_mm] = keys.step_mm.get_ref().0[..] else {
                return Err(reader.source.fault(
                    keys.step_mm.span(),
                    "planes have one step",
                    "give one number, for columns and rows",
                ));
            };
            let step_mm = (step_mm.get(), keys.step_mm.span());
            let centre_mm = keys.centre_mm.unwrap_or_default();
            let mut layers = reader.planes(z_mm, centre_mm, size_mm, step_mm)?;
            layers.z_mm.dedup();
            Ok(layers)
        }
        (None, None, Some(min_mm), Some(max_mm)) if keys.centre_mm.is_none() => {
            reader.layers(min_mm, max_mm, &keys.step_mm)
        }
        _ => Err(reader.source.fault(
            table.span(),
            "a map is of planes or of a box",
            "give `z_mm` and `size_mm`, or `min_mm` and `max_mm`; and `step_mm` with either",
        )),
    }
}
