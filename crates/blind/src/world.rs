//! The true field behind a scan, and the receiver's readings of it.
//!
//! The field is that of vibrating pistons by their Rayleigh integrals, with the effects of the virtual rig; no simulator
//! takes part. There is no robot firmware and no port: positions follow from the stops, and each reading is one sample.

use std::collections::HashMap;

use num_complex::Complex64;

use super::causes::Causes;
use super::kinematics::kinematics;
use super::laboratory::Laboratory;
use super::survey::Stop;
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::counter_rng::CounterRng;
use fieldgap_virtual_rig::drive::Drive;
use fieldgap_virtual_rig::true_field::{Contributions, TrueField};
use fieldgap_virtual_rig::truth::TrueSource;

/// The true field from some time on.
struct Epoch {
    begins_s: f64,
    field: TrueField,
    /// The amplitude of each element, for each drive.
    weights: Vec<Vec<Complex64>>,
}

/// The true set-up of one scan.
pub(super) struct World<'a> {
    laboratory: &'a Laboratory,
    causes: &'a Causes,
    epochs: Vec<Epoch>,
    /// Reading for a field of 1/m, V.
    volts: f64,
    noise: CounterRng,
}

/// The contributions computed so far, so that none is computed twice.
#[derive(Default)]
struct Cache(HashMap<(usize, [u64; 3]), Contributions>);

impl<'a> World<'a> {
    /// The true set-up of a laboratory with these causes.
    pub fn new(
        laboratory: &'a Laboratory,
        causes: &'a Causes,
        volts: f64,
        rng: CounterRng,
    ) -> Self {
        let drives = laboratory.drives();
        let epochs = causes
            .epochs()
            .into_iter()
            .map(|(begins_s, effects)| {
                let field = TrueField::new(
                    laboratory.elements(),
                    laboratory.medium(),
                    super::laboratory::FREQUENCY_HZ,
                    &TrueSource::default(),
                    effects,
                    rng.stream("world"),
                );
                let weights = drives.iter().map(|drive| weights(&field, drive, causes)).collect();
                Epoch { begins_s, field, weights }
            })
            .collect();
        Self { laboratory, causes, epochs, volts, noise: rng.stream("noise") }
    }

    /// The true field at the scan's beginning.
    pub fn field(&self) -> &TrueField {
        &self.epochs[0].field
    }

    /// The level at each of these stops before the receiver, without noise, V. `chosen` are numbers of stops.
    pub fn levels_v(&self, chosen: &[usize]) -> Vec<f64> {
        let stops = &self.laboratory.survey.stops;
        let motions = kinematics(stops, self.field().lag_s());
        let mut cache = Cache::default();
        chosen
            .iter()
            .map(|&n| {
                let stop = &stops[n];
                let Some(focus) = stop.focus else { return 0.0 };
                let (number, epoch) = self.epoch(stop);
                let at_m = epoch.field.place(motions[n].position_mm * 1e-3, &motions[n]);
                let contributions = self.contributions(&mut cache, number, at_m);
                let weights = &epoch.weights[focus];
                epoch.field.magnitude(&contributions, weights, stop.time_s) * self.volts
            })
            .collect()
    }

    /// The magnitude at positions, each with its focus, 1/m, for a robot at rest without errors.
    pub fn magnitudes(&self, places_m: impl Iterator<Item = (usize, Vec3)>) -> Vec<f64> {
        let epoch = &self.epochs[0];
        let mut cache = Cache::default();
        places_m
            .map(|(focus, at_m)| {
                let contributions = self.contributions(&mut cache, 0, at_m);
                epoch.field.magnitude(&contributions, &epoch.weights[focus], 0.0)
            })
            .collect()
    }

    /// The reading for a level without noise, V.
    pub fn noiseless_v(&self, stop: &Stop, level_v: f64) -> f64 {
        self.received_v(stop, level_v, 1.0)
    }

    /// The reading for a level with the noise of the `n`th reading, V.
    ///
    /// Additive noise has equal quadratures and adds to the carrier before its magnitude is taken. Multiplicative noise acts after
    /// the detector and before the converter.
    pub fn reading_v(&self, n: usize, stop: &Stop, level_v: f64) -> f64 {
        let noise = self.laboratory.noise();
        let normal = |part: u64| self.noise.normal(3 * n as u64 + part);
        let in_phase_v = level_v + noise.additive_v * normal(1);
        let detected_v = in_phase_v.hypot(noise.additive_v * normal(2));
        self.received_v(stop, detected_v, 1.0 + noise.multiplicative * normal(0))
    }

    fn received_v(&self, stop: &Stop, level_v: f64, noise: f64) -> f64 {
        let (_, epoch) = self.epoch(stop);
        let received_v = epoch.field.level_v(level_v, stop.time_s) * noise;
        let converted_v = received_v.min(epoch.field.full_scale_v(f64::INFINITY));
        self.causes.unmodelled().map_or(converted_v, |cause| cause.read_v(converted_v))
    }

    fn epoch(&self, stop: &Stop) -> (usize, &Epoch) {
        let begun = self.epochs.partition_point(|epoch| epoch.begins_s <= stop.time_s);
        let number = begun.saturating_sub(1);
        (number, &self.epochs[number])
    }

    fn contributions(&self, cache: &mut Cache, number: usize, at_m: Vec3) -> Contributions {
        let field = &self.epochs[number].field;
        let mut contributions = cache.at(number, field, at_m).clone();
        if let Some(cause) = self.causes.unmodelled() {
            for (from_m, factor) in cause.echoes(at_m, field.wavenumber_rad_m()) {
                contributions.add(cache.at(number, field, from_m), factor);
            }
        }
        contributions
    }
}

impl Cache {
    fn at(&mut self, number: usize, field: &TrueField, at_m: Vec3) -> &Contributions {
        let place = [at_m.x.to_bits(), at_m.y.to_bits(), at_m.z.to_bits()];
        self.0.entry((number, place)).or_insert_with(|| field.contributions(at_m))
    }
}

fn weights(field: &TrueField, drive: &Drive, causes: &Causes) -> Vec<Complex64> {
    let mut weights = field.weights(&drive.outputs());
    if let Some(cause) = causes.unmodelled() {
        cause.emit(&mut weights, &field.array().elements);
    }
    weights
}
