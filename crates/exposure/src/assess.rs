//! The levels of a driven array where people are, their uncertainty, and what they say of the limits.

use num_complex::Complex64;
use serde::Serialize;

use super::section::Exposure;
use super::source::SourceLevel;
use fieldgap_acoustics::transducer::OnAxis;
use fieldgap_acoustics::{Array, Excitation, FieldKernel, PathLengths, Simulator, Vec3};
use fieldgap_level::{Budget, Kind, Line, Place, Standing, level_db, usual};
use fieldgap_records::MediumSection;

/// Points along the radius of a ball in which the largest level is sought, at most. The field of an array of size D varies over λ d/D, and for
/// places of people, far from the array, this is many times the step.
const STEPS: f64 = 10.0;

/// What radiates.
#[derive(Debug, Clone, Copy)]
pub struct Radiating<'a> {
    /// The array.
    pub array: &'a Array,
    /// The medium as stated.
    pub medium: &'a MediumSection,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Directivity of the elements. The decay is that of a spherical wave in absorbing air, whatever the simulator.
    pub simulator: Simulator,
}

/// How the array is driven.
#[derive(Debug, Clone, Copy)]
pub enum Drives<'a> {
    /// One after another.
    These(&'a [Excitation]),
    /// Focused at each place: the most that the array can give there.
    AtEachPlace,
}

/// The levels of a driven array at places.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assessment {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Whether the array is focused at each place.
    pub focused_at_places: bool,
    /// Where the level of the elements comes from; `None` if it is unknown.
    pub source: Option<String>,
    /// Level at each place; empty if the level of the elements is unknown.
    pub places: Vec<PlaceLevel>,
    /// Names of the limits that have no level at this frequency.
    pub not_at_frequency: Vec<String>,
    /// Number of limits.
    pub limits: usize,
}

/// The level at a place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceLevel {
    /// Name of the place.
    pub name: String,
    /// Radius of the ball in which the largest level was sought, mm.
    pub within_mm: f64,
    /// Largest level, dB re 20 µPa rms.
    pub level_db: f64,
    /// Its pressure, Pa rms.
    pub rms_pa: f64,
    /// Where it is, array frame, mm.
    pub at_mm: [f64; 3],
    /// With which drive, counted from 0; `None` if the array is focused at the place.
    pub drive: Option<usize>,
    /// Its uncertainty.
    pub budget: Budget,
    /// The limits at this frequency.
    pub against: Vec<Against>,
}

/// A level against a limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Against {
    /// Name of the limit.
    pub limit: String,
    /// Its level, dB.
    pub limit_db: f64,
    /// Limit less level, dB.
    pub margin_db: f64,
    /// What the level with its uncertainty says.
    pub standing: Standing,
}

impl Assessment {
    /// The worst of all places and limits; `None` if the level is unknown. Without a limit at this frequency nothing is exceeded.
    pub fn standing(&self) -> Option<Standing> {
        self.source.as_ref()?;
        let all = self.places.iter().flat_map(|place| &place.against);
        Some(all.map(|against| against.standing).max().unwrap_or(Standing::Within))
    }
}

/// Levels at the places of `exposure`, for elements of a level. Without one nothing is known of them.
pub fn assess(
    exposure: &Exposure,
    radiating: Radiating<'_>,
    source: Option<&SourceLevel>,
    drives: Drives<'_>,
) -> Assessment {
    let frequency_hz = radiating.frequency_hz;
    let elsewhere =
        exposure.people.limits.iter().filter(|limit| limit.at_db(frequency_hz).is_none());
    let places = source.map_or_else(Vec::new, |source| {
        exposure
            .people
            .places
            .iter()
            .map(|place| at_place(exposure, place, radiating, source, drives))
            .collect()
    });
    Assessment {
        frequency_hz,
        focused_at_places: matches!(drives, Drives::AtEachPlace),
        source: source.map(|source| source.origin.clone()),
        places,
        not_at_frequency: elsewhere.map(|limit| limit.name.clone()).collect(),
        limits: exposure.people.limits.len(),
    }
}

/// Middle of a place, array frame, m.
fn at_m(place: &Place) -> Vec3 {
    Vec3::from(place.at_mm) / 1e3
}

fn at_place(
    exposure: &Exposure,
    place: &Place,
    radiating: Radiating<'_>,
    source: &SourceLevel,
    drives: Drives<'_>,
) -> PlaceLevel {
    let at_the_place = [Excitation::Focus(at_m(place))];
    let (excitations, named) = match drives {
        Drives::These(excitations) => (excitations, true),
        Drives::AtEachPlace => (&at_the_place[..], false),
    };
    let points = ball(place, radiating);
    let mut loudest = (0.0, 0, at_m(place));
    for (number, excitation) in excitations.iter().enumerate() {
        let pressures: Vec<Complex64> = radiating.kernel(source, excitation, [0.0; 2]).at(&points);
        for (point, pressure) in points.iter().zip(pressures) {
            let rms_pa = pressure.norm();
            // A pressure that is no number is above all others.
            if rms_pa.total_cmp(&loudest.0).is_gt() {
                loudest = (rms_pa, number, *point);
            }
        }
    }
    let (rms_pa, drive, at_m) = loudest;
    let level = |changed: [f64; 2]| match excitations.get(drive) {
        Some(excitation) => {
            let at = radiating.kernel(source, excitation, changed).at(&[at_m]);
            level_db(at.first().map_or(0.0, |pressure: &Complex64| pressure.norm()))
        }
        None => f64::NEG_INFINITY,
    };
    let mut lines = source.lines.clone();
    let or_usual = |stated: Option<f64>, taken: f64| (stated.unwrap_or(taken), stated.is_none());
    let (u, assumed) = or_usual(exposure.temperature_u_c, usual::TEMPERATURE_C);
    let of_air = |what: &str, u, unit, changed: fn(f64) -> [f64; 2], assumed| {
        Line::of_model(what, Kind::B, u, unit, |by| level(changed(by))).assumed_if(assumed)
    };
    lines.push(of_air("temperature of the air", u, "°C", |warmer| [warmer, 0.0], assumed));
    let (u, assumed) = or_usual(exposure.humidity_u_percent, usual::HUMIDITY_PERCENT);
    lines.push(of_air("relative humidity", u, "%", |wetter| [0.0, wetter], assumed));
    let (u, assumed) = or_usual(exposure.model_u_db, usual::SIMULATION_DB);
    lines.push(Line::decibels("simulation", Kind::B, u).assumed_if(assumed));
    let budget = Budget::new(lines);
    let db = level_db(rms_pa);
    let against = exposure.people.limits.iter().filter_map(|limit| {
        let limit_db = limit.at_db(radiating.frequency_hz)?;
        Some(Against {
            limit: limit.name.clone(),
            limit_db,
            margin_db: limit_db - db,
            standing: Standing::of(db, budget.expanded_db(), limit_db),
        })
    });
    PlaceLevel {
        name: place.name.clone(),
        within_mm: place.within_mm,
        level_db: db,
        rms_pa,
        at_mm: (at_m * 1e3).map(|mm| (mm * 1e3).round() / 1e3).into(),
        drive: named.then_some(drive),
        against: against.collect(),
        budget,
    }
}

impl Radiating<'_> {
    /// Pressure at a place, array frame, m, for elements whose pressure times distance is one, per metre: a measured pressure over it is the
    /// level of the elements.
    pub fn of_unit_elements(&self, excitation: &Excitation, at_m: Vec3) -> f64 {
        let unit = SourceLevel { pa_m: 1.0, origin: String::new(), lines: Vec::new() };
        let at = self.kernel(&unit, excitation, [0.0; 2]).at(&[at_m]);
        at.first().map_or(0.0, |pressure| pressure.norm())
    }

    /// The field in pascals rms, in air that is warmer and wetter than stated. The delays stay those of the stated medium.
    fn kernel(
        &self,
        source: &SourceLevel,
        excitation: &Excitation,
        [warmer_c, wetter_percent]: [f64; 2],
    ) -> FieldKernel {
        let phases_rad =
            excitation.phases_rad(self.array, &self.medium.medium(), self.frequency_hz);
        let air = self.medium.changed(warmer_c, wetter_percent, self.frequency_hz);
        FieldKernel::new(
            self.array,
            &phases_rad,
            self.simulator.transducer(self.array),
            air.medium.wavenumber_rad_m(self.frequency_hz),
            PathLengths::Observed,
        )
        .with_on_axis(OnAxis::Absorbed {
            amplitude: source.pa_m * air.density_ratio,
            attenuation_np_m: air.attenuation_np_m,
        })
    }
}

/// The points of a place's ball before the array's faces; its middle is one of them.
fn ball(place: &Place, radiating: Radiating<'_>) -> Vec<Vec3> {
    let (middle_m, radius_m) = (at_m(place), place.within_mm / 1e3);
    let wavelength_m = radiating.medium.medium().wavelength_m(radiating.frequency_hz);
    let step_m = (radius_m / STEPS).max(wavelength_m / 4.0);
    let steps = (radius_m / step_m).floor() as i32;
    let along = || (-steps..=steps).map(move |n| f64::from(n) * step_m);
    along()
        .flat_map(|x| along().flat_map(move |y| along().map(move |z| Vec3::new(x, y, z))))
        .filter(|offset| offset.norm() <= radius_m)
        .map(|offset| middle_m + offset)
        .filter(|point| point.z > 0.0)
        .collect()
}

#[cfg(test)]
mod tests;
