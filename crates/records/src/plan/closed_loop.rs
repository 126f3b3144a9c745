//! `[closed_loop]` of a plan: where a rig may choose its own readings, and when it stops.

use serde::Deserialize;
use toml::Spanned;

use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Fault, Fraction, Place, Positive, Time, TomlSource};

/// Readings of the first round by default: about eight at each of twelve drives, and as many places again.
const FIRST_READINGS: usize = 240;

/// Readings of a later round by default: some twenty seconds of a robot that stops at each place.
const ROUND_READINGS: usize = 96;

/// Readings in all by default: a third of the thesis's scan.
const MOST_READINGS: usize = 1800;

/// Probability at which a cause is accepted by default.
const PROBABILITY: f64 = 0.95;

/// Fresh readings of a verification by default: they tell a residual of 1.2 times the noise from the noise by 2.4 standard deviations.
const VERIFIED_READINGS: usize = 64;

/// Smallest gap of interest by default, in standard deviations of a reading: some thousand readings show it.
const SMALLEST_GAP_SIGMA: f64 = 0.15;

/// Fewest readings of a round or a verification, and most of a plan.
const FEWEST: usize = 16;
const MOST: usize = 100_000;

/// The keys of `[closed_loop]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ClosedLoopTable {
    min_mm: Exact<Place, 3>,
    max_mm: Spanned<Exact<Place, 3>>,
    minutes: Option<Time>,
    sounding_minutes: Option<Time>,
    readings: Option<Spanned<usize>>,
    first_readings: Option<Spanned<usize>>,
    round_readings: Option<Spanned<usize>>,
    probability: Option<Fraction>,
    smallest_gap_sigma: Option<Positive>,
    #[serde(default)]
    criterion: Criterion,
    verify: Option<Spanned<VerifyTable>>,
}

/// The keys of `[closed_loop.verify]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct VerifyTable {
    readings: Option<Spanned<usize>>,
    min_mm: Option<Exact<Place, 3>>,
    max_mm: Option<Spanned<Exact<Place, 3>>>,
}

/// What makes one possible reading better than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// The expected information about which cause holds, per second.
    #[default]
    Information,
    /// The largest uncertainty that the most probable cause leaves in the expected reading (D-optimality), per second.
    Parameters,
    /// None: places spread evenly.
    Even,
}

/// A box in the array's frame, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxMm {
    /// Its lowest corner.
    pub least: Vec3,
    /// Its highest corner; above the lowest along every axis.
    pub most: Vec3,
}

/// Where a rig may choose its own readings, and when it stops.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// Where it may measure.
    pub within: BoxMm,
    /// Longest time from the first reading to the last on the rig's clock, s.
    pub longest_s: Option<f64>,
    /// Longest time with the array driven, s.
    pub longest_sounding_s: Option<f64>,
    /// Readings at most, those of verifications included.
    pub most_readings: usize,
    /// Readings of the first round.
    pub first_readings: usize,
    /// Readings of each later round.
    pub round_readings: usize,
    /// Probability at which a cause is accepted.
    pub probability: f64,
    /// Smallest gap of interest, in standard deviations of a reading's noise: no gap is accepted before the readings would show it.
    pub smallest_gap_sigma: f64,
    /// What makes one possible reading better than another.
    pub criterion: Criterion,
    /// Fresh readings that test a cause; zero for none.
    pub verify_readings: usize,
    /// Where they are drawn.
    pub verify_within: BoxMm,
}

impl ClosedLoop {
    /// With the defaults, in this box.
    pub fn within(within: BoxMm) -> Self {
        Self {
            within,
            longest_s: None,
            longest_sounding_s: None,
            most_readings: MOST_READINGS,
            first_readings: FIRST_READINGS,
            round_readings: ROUND_READINGS,
            probability: PROBABILITY,
            smallest_gap_sigma: SMALLEST_GAP_SIGMA,
            criterion: Criterion::default(),
            verify_readings: VERIFIED_READINGS,
            verify_within: within,
        }
    }

    pub(super) fn read(
        table: &Spanned<ClosedLoopTable>,
        source: &TomlSource,
    ) -> Result<Self, Fault> {
        let keys = table.get_ref();
        let usual = Self::within(box_of(&keys.min_mm, &keys.max_mm, source)?);
        let count =
            |key: &Option<Spanned<usize>>, otherwise| count_of_readings(key, otherwise, source);
        let first_readings = count(&keys.first_readings, usual.first_readings)?;
        let most_readings = count(&keys.readings, usual.most_readings.max(first_readings))?;
        if let Some(given) = keys.readings.as_ref().filter(|_| most_readings < first_readings) {
            return Err(source.fault(
                given.span(),
                format!("the first round alone has {first_readings} readings"),
                "allow more `readings`, or fewer `first_readings`",
            ));
        }
        let verify = keys.verify.as_ref().map(Spanned::get_ref);
        let verify_within = match verify.map(|verify| (&verify.min_mm, &verify.max_mm)) {
            None | Some((None, None)) => usual.within,
            Some((Some(min_mm), Some(max_mm))) => box_of(min_mm, max_mm, source)?,
            Some(_) => {
                return Err(source.fault(
                    keys.verify.as_ref().map(Spanned::span).unwrap_or_default(),
                    "a box has two corners",
                    "give both `min_mm` and `max_mm`, or neither to verify where the loop measures",
                ));
            }
        };
        let verify_readings = match verify.and_then(|verify| verify.readings.as_ref()) {
            Some(none) if *none.get_ref() == 0 => 0,
            _ => count(&verify.and_then(|verify| verify.readings.clone()), usual.verify_readings)?,
        };
        let seconds = |minutes: Option<Time>| minutes.map(|minutes| 60.0 * minutes.get());
        Ok(Self {
            longest_s: seconds(keys.minutes),
            longest_sounding_s: seconds(keys.sounding_minutes),
            most_readings,
            first_readings,
            round_readings: count(&keys.round_readings, usual.round_readings)?,
            probability: keys.probability.map_or(usual.probability, Fraction::get),
            smallest_gap_sigma: keys
                .smallest_gap_sigma
                .map_or(usual.smallest_gap_sigma, Positive::get),
            criterion: keys.criterion,
            verify_readings,
            verify_within,
            ..usual
        })
    }
}

/// A number of readings that a round or a plan can have.
pub(super) fn count_of_readings(
    key: &Option<Spanned<usize>>,
    otherwise: usize,
    source: &TomlSource,
) -> Result<usize, Fault> {
    match key {
        None => Ok(otherwise),
        Some(given) if (FEWEST..=MOST).contains(given.get_ref()) => Ok(*given.get_ref()),
        Some(given) => Err(source.fault(
            given.span(),
            format!("{} readings are too few or too many", given.get_ref()),
            format!("give a number from {FEWEST} to {MOST}"),
        )),
    }
}

fn box_of(
    min_mm: &Exact<Place, 3>,
    max_mm: &Spanned<Exact<Place, 3>>,
    source: &TomlSource,
) -> Result<BoxMm, Fault> {
    let least = Vec3::from(min_mm.map(Place::get));
    let most = Vec3::from(max_mm.get_ref().map(Place::get));
    match (0..3).find(|&axis| most[axis] <= least[axis]) {
        None => Ok(BoxMm { least, most }),
        Some(axis) => Err(source.fault(
            max_mm.span(),
            format!("`max_mm` is not above `min_mm` along {}", ["x", "y", "z"][axis]),
            "give the lowest corner as `min_mm` and the highest as `max_mm`",
        )),
    }
}
