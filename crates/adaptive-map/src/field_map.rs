//! The map of a record, with its standard errors.

use fieldgap_acoustics::Vec3;
use fieldgap_comparison::Incomparable;
use fieldgap_diagnosis::{EffectId, Findings, FoundField, Options, PossibleReading};
use fieldgap_records::{MapPrior, RecordedScan};

use crate::checks::Checks;
use crate::estimate::{Estimate, FieldEstimate};
use crate::posterior::Posterior;
use crate::stationary::Stationary;

/// A map cannot be made of a record.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The readings cannot be compared with a simulation.
    #[error(transparent)]
    Incomparable(#[from] Incomparable),
    /// The readings contradict each other, or are no numbers.
    #[error("no map can be made of these {0} readings: their covariance is not positive definite")]
    NotPositive(usize),
    /// An amplitude or its error is no finite number.
    #[error(
        "no map can be made of these readings: at {0:?} mm (array's frame) the corrected simulation gives no finite number"
    )]
    NotFinite([f64; 3]),
}

/// The amplitude on a grid, with standard errors.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldMap {
    /// Place, array's frame, m, and number of the drive of each.
    pub places: Vec<(Vec3, usize)>,
    /// The amplitude at each.
    pub estimates: Vec<Estimate>,
    /// Effects that the simulation was corrected by.
    pub effects: Vec<EffectId>,
    /// What the process was found to be.
    pub sizes: MapSizes,
    /// Factor on the standard errors that checks called for; one without.
    pub factor: f64,
}

/// What the simulation misses, as found by the evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSizes {
    /// Standard deviation of the errors of elements, relative; zero for a map without simulation.
    pub elements: f64,
    /// Root mean square of the diffuse field, in the unit of the readings; zero for a map without simulation.
    pub diffuse: f64,
}

/// Errors of a map.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct MapErrors {
    /// The largest amplitude.
    pub peak: f64,
    /// Root mean square of the standard errors.
    pub rms: f64,
    /// The largest standard error.
    pub largest: f64,
}

impl FieldMap {
    /// The errors of the map.
    pub fn errors(&self) -> MapErrors {
        MapErrors::of(&self.estimates)
    }
}

impl MapErrors {
    pub(crate) fn of(estimates: &[Estimate]) -> Self {
        let squares: f64 = estimates.iter().map(|e| e.standard_error.powi(2)).sum();
        let largest = |of: fn(&Estimate) -> f64| estimates.iter().map(of).fold(0.0, f64::max);
        Self {
            peak: largest(|e| e.amplitude).max(f64::MIN_POSITIVE),
            rms: (squares / estimates.len().max(1) as f64).sqrt(),
            largest: largest(|e| e.standard_error),
        }
    }
}

/// What a map is made of.
pub(crate) struct Learnt<'r> {
    record: &'r RecordedScan,
    findings: Option<Findings<'r>>,
}

impl<'r> Learnt<'r> {
    /// Searches for what the simulation is to be corrected by, unless the map has no simulation.
    pub fn of(
        record: &'r RecordedScan,
        prior: MapPrior,
        options: &Options,
    ) -> Result<Self, Incomparable> {
        let findings = match prior {
            MapPrior::Simulation => Some(Findings::of(std::slice::from_ref(record), options)?),
            MapPrior::Process => None,
        };
        Ok(Self { record, findings })
    }

    /// The set that the simulation is corrected by, and what the readings say of the field then.
    pub fn field<R>(
        &self,
        then: impl FnOnce(&[EffectId], MapSizes, &dyn FieldEstimate) -> R,
    ) -> Result<R, MapError> {
        let driven = || self.record.samples.iter().filter(|sample| sample.focus.is_some());
        let not_positive = || MapError::NotPositive(driven().count());
        let Some(findings) = &self.findings else {
            let process = Stationary::of(self.record).ok_or_else(not_positive)?;
            return Ok(then(&[], MapSizes { elements: 0.0, diffuse: 0.0 }, &process));
        };
        let field: FoundField<'_> = findings.field();
        let posterior = Posterior::of(&field, &field.readings()).ok_or_else(not_positive)?;
        let sizes = posterior.sizes();
        let sizes = MapSizes { elements: sizes.elements, diffuse: sizes.diffuse };
        Ok(then(&field.effects(), sizes, &posterior))
    }
}

/// The map of a record on a grid: `places` are array's frame, m, each with a drive that has readings. `checks` make the standard errors
/// larger where they call for it.
///
/// # Errors
/// [`MapError`] if the readings cannot be compared with a simulation, or contradict each other.
pub fn map(
    record: &RecordedScan,
    places: &[(Vec3, usize)],
    prior: MapPrior,
    checks: Option<Checks>,
) -> Result<FieldMap, MapError> {
    let options =
        Options { simulator: Some(record.setup.simulator), few_causes: true, ..Options::default() };
    let learnt = Learnt::of(record, prior, &options)?;
    let factor = checks.map_or(1.0, |checks| checks.factor);
    let of_map = possible(places);
    learnt.field(|effects, sizes, field| {
        Ok(FieldMap {
            places: places.to_vec(),
            estimates: estimates(field, &of_map, factor)?,
            effects: effects.to_vec(),
            sizes,
            factor,
        })
    })?
}

/// The amplitudes at some places, with errors that are larger by a factor.
pub(crate) fn estimates(
    field: &dyn FieldEstimate,
    places: &[PossibleReading],
    factor: f64,
) -> Result<Vec<Estimate>, MapError> {
    let scaled = |(estimate, place): (Estimate, &PossibleReading)| {
        let standard_error = factor * estimate.standard_error;
        if estimate.amplitude.is_finite() && standard_error.is_finite() {
            return Ok(Estimate { standard_error, ..estimate });
        }
        Err(MapError::NotFinite((place.at_m * 1e3).into()))
    };
    field.map(places).into_iter().zip(places).map(scaled).collect()
}

/// Places of a map as readings that could be taken there, the robot coming from smaller x as in a raster.
pub(crate) fn possible(places: &[(Vec3, usize)]) -> Vec<PossibleReading> {
    let of = |&(at_m, focus): &(Vec3, usize)| PossibleReading {
        at_m,
        focus,
        from_below: true,
        velocity_m_s: Vec3::zeros(),
    };
    places.iter().map(of).collect()
}

/// Readings on a robot's way from a place, with the direction from which it comes to each.
pub(crate) fn on_the_way(from_m: Vec3, readings: &[(Vec3, usize)]) -> Vec<PossibleReading> {
    let (mut before_m, mut from_below) = (from_m, true);
    let of = |&(at_m, focus): &(Vec3, usize)| {
        if at_m.x != before_m.x {
            from_below = at_m.x > before_m.x;
        }
        before_m = at_m;
        PossibleReading { at_m, focus, from_below, velocity_m_s: Vec3::zeros() }
    };
    readings.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use fieldgap_input::TomlSource;
    use fieldgap_records::{RecordedSample, ScanSetup};
    use fieldgap_virtual_rig::{Visit, noise_free_readings};

    use super::*;

    const SETUP: &str = "format = 1\nname = \"map\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
                         layout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
                         [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
                         [[focus]]\nx_mm = 5.0\ny_mm = 0.0\nz_mm = 100.0\n";

    /// Amplitudes or phases that differ from element to element, by the virtual rig's physics, where no effect may be named: errors of the
    /// elements' weights alone take them up, real or imaginary ones.
    #[test]
    fn errors_of_elements_are_learnt_where_no_effect_is_named() {
        let source = TomlSource::new(Path::new("scan.toml"), SETUP);
        let setup = ScanSetup::parse(&source).expect("a set-up");
        let simulation = setup.simulation(setup.simulator, 0).expect("one focus");
        let at = |n: usize, of: usize, z: f64| {
            let n = n as f64 / of as f64;
            let [x, y] = [9.0, 23.0].map(|turns| 0.02 * (std::f64::consts::TAU * turns * n).sin());
            (Vec3::new(x, y + 0.004 * (n - 0.5), z), 0)
        };
        let read: Vec<_> = (0..300).map(|n| at(n, 300, 0.08 + 0.03 * (n % 2) as f64)).collect();
        let places: Vec<_> = (0..101).map(|n| at(n, 101, 0.095)).collect();
        for cause in ["element-gain = { spread = 0.1 }", "element-phase = { spread_rad = 0.1 }"] {
            let effects: toml::Table = cause.parse().expect("TOML");
            let true_at = |effects: &toml::Table, places: &[(Vec3, usize)]| {
                let visit = |(position_m, _): &(Vec3, usize)| Visit {
                    position_m: *position_m,
                    velocity_m_s: Vec3::zeros(),
                    time_s: 0.0,
                };
                let visits: Vec<Visit> = places.iter().map(visit).collect();
                noise_free_readings(&simulation, effects, 0.02, &visits, 7)
                    .expect("the effects fit")
            };
            let readings = true_at(&effects, &read);
            let peak = readings.iter().copied().fold(0.0, f64::max);
            let dark = (0..30).map(|n| {
                let reading = 0.001 * peak * (1.0 + f64::from(n % 5) / 5.0);
                RecordedSample::measured(f64::from(n) - 40.0, None, read[0].0, reading, None)
            });
            let driven = readings.iter().zip(&read).enumerate().map(|(n, (reading, (at_m, _)))| {
                let ripple = 1.0 + 0.01 * (1.7 * n as f64).sin();
                RecordedSample::measured(n as f64, Some(0), *at_m, ripple * reading, None)
            });
            let record =
                RecordedScan { setup: setup.clone(), samples: dark.chain(driven).collect() };
            let options = Options { effects: Some(BTreeSet::new()), ..Options::default() };
            let learnt = Learnt::of(&record, MapPrior::Simulation, &options).expect("comparable");
            let of_map = possible(&places);
            let made = learnt.field(|effects, _, field| {
                assert!(effects.is_empty());
                estimates(field, &of_map, 1.0)
            });
            let made = made.expect("a field").expect("a map");
            let rms = |of: &mut dyn Iterator<Item = f64>, truth: &[f64]| -> f64 {
                let squares = of.zip(truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                (squares / truth.len() as f64).sqrt() / peak
            };
            let truth = true_at(&effects, &places);
            let left = rms(&mut made.iter().map(|estimate| estimate.amplitude), &truth);
            let simulated = true_at(&toml::Table::new(), &places);
            let before = rms(&mut simulated.into_iter(), &truth);
            assert!(left < 0.3 * before, "{cause}: {left} of {before}");
        }
    }
}
