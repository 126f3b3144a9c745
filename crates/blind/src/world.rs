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
use fieldgap_virtual_rig::true_field::{AirStep, Contributions, TrueField};

/// The true field from some time on.
struct Epoch {
    begins_s: f64,
    field: TrueField,
    /// The amplitude of each element, for each drive.
    weights: Vec<Vec<Complex64>>,
    /// The same where all elements are driven in phase.
    in_phase: Vec<Complex64>,
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
struct Cache(HashMap<(usize, AirStep, [u64; 3]), Contributions>);

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
            .epochs(&laboratory.imperfections)
            .into_iter()
            .map(|(begins_s, effects)| {
                let field = TrueField::new(
                    laboratory.elements(),
                    laboratory.medium(),
                    super::laboratory::FREQUENCY_HZ,
                    &laboratory.source,
                    effects,
                    rng.stream("world"),
                );
                let weights = drives.iter().map(|drive| field.weights(&drive.outputs())).collect();
                let count = laboratory.elements().len();
                let all = Drive { emitting: true, ..Drive::silent(count) };
                let in_phase = field.weights(&all.outputs());
                Epoch { begins_s, field, weights, in_phase }
            })
            .collect();
        Self { laboratory, causes, epochs, volts, noise: rng.stream("noise") }
    }

    /// The true field at the scan's beginning.
    pub fn field(&self) -> &TrueField {
        &self.epochs[0].field
    }

    /// The phasor at each of these stops before the receiver, without noise, V: the level, and the phase against the clock of the drives
    /// (exp(-iωt)). `chosen` are numbers of stops.
    pub fn phasors_v(&self, chosen: &[usize]) -> Vec<Complex64> {
        self.phasors_beside_v(chosen, Vec3::zeros())
    }

    /// The same at another place: from each stop's true one by `by_m`.
    pub fn phasors_beside_v(&self, chosen: &[usize], by_m: Vec3) -> Vec<Complex64> {
        let survey = &self.laboratory.survey;
        // A robot at rest is where it was a moment ago.
        let lag_s = if survey.flown { self.field().lag_s() } else { 0.0 };
        let motions = kinematics(&survey.stops, lag_s);
        let mut cache = Cache::default();
        chosen
            .iter()
            .map(|&n| {
                let cause = self.causes.unmodelled();
                let n = cause.map_or(n, |cause| cause.reads_stop(n));
                let stop = &survey.stops[n];
                let Some(focus) = stop.focus else { return Complex64::ZERO };
                let (number, epoch) = self.epoch(stop);
                let beside_mm = cause.map_or(Vec3::zeros(), |cause| cause.displacement_mm(stop));
                let reported_m = motions[n].position_mm * 1e-3;
                let at_m = epoch.field.place(reported_m, &motions[n]) + beside_mm * 1e-3 + by_m;
                let contributions = cache.at(number, &epoch.field, stop.time_s, at_m);
                let weights = match cause.is_some_and(|cause| cause.is_unfocused(n)) {
                    true => &epoch.in_phase,
                    false => &epoch.weights[focus],
                };
                let own = epoch.field.phasor(contributions, weights, stop.time_s);
                let k = epoch.field.wavenumber_rad_m();
                let other = cause.map_or(Complex64::ZERO, |cause| cause.beside(at_m, k));
                (own + other) * self.volts
            })
            .collect()
    }

    /// The phasor of the reading without noise, V, for one before the receiver.
    pub fn noiseless_v(&self, stop: &Stop, phasor_v: Complex64) -> Complex64 {
        with_norm(phasor_v, self.received_v(stop, phasor_v.norm(), 1.0))
    }

    /// The phasor of the `n`th reading with its noise, V, for one before the receiver; `None` if the reading is lost.
    ///
    /// Additive noise has equal quadratures and adds to the carrier before its magnitude is taken. Multiplicative noise acts after
    /// the detector and before the converter.
    pub fn reading_v(&self, n: usize, stop: &Stop, phasor_v: Complex64) -> Option<Complex64> {
        let Laboratory { reception, peak_v, .. } = self.laboratory;
        if reception.is_lost(n, self.noise) {
            return None;
        }
        let noise = self.laboratory.noise();
        let normal = |part: u64| self.noise.normal(3 * n as u64 + part);
        let level_v = phasor_v.norm();
        let beside =
            Complex64::new(level_v + noise.additive_v * normal(1), noise.additive_v * normal(2));
        let factor = reception.slow_factor(n, self.noise)
            * (1.0 + self.laboratory.multiplicative * normal(0));
        let received_v = self.received_v(stop, beside.norm(), factor);
        let outlier_v = reception.outlier_sigma(n, self.noise) * noise.at_v(received_v);
        let read_v = (received_v + outlier_v).max(0.0);
        let Some(phase) = reception.phase else {
            return Some(reception.converted_v(read_v, *peak_v).into());
        };
        let share = (stop.time_s / self.laboratory.survey.lasts_s().max(1e-9)).clamp(0.0, 1.0);
        let turned = beside * Complex64::from_polar(1.0, phasor_v.arg());
        let read = with_norm(turned, read_v) * phase.turn(n, share, self.noise);
        let part_v = |part_v: f64| reception.converted_v(part_v, *peak_v);
        Some(Complex64::new(part_v(read.re), part_v(read.im)))
    }

    fn received_v(&self, stop: &Stop, level_v: f64, noise: f64) -> f64 {
        let (_, epoch) = self.epoch(stop);
        let cause = self.causes.unmodelled();
        let level_v = level_v * cause.map_or(1.0, |cause| cause.gain(stop));
        let received_v = epoch.field.level_v(level_v, stop.time_s) * noise;
        let converted_v = received_v.min(epoch.field.full_scale_v(f64::INFINITY));
        cause.map_or(converted_v, |cause| cause.read_v(converted_v))
    }

    fn epoch(&self, stop: &Stop) -> (usize, &Epoch) {
        let begun = self.epochs.partition_point(|epoch| epoch.begins_s <= stop.time_s);
        let number = begun.saturating_sub(1);
        (number, &self.epochs[number])
    }
}

impl Cache {
    fn at(&mut self, number: usize, field: &TrueField, time_s: f64, at_m: Vec3) -> &Contributions {
        let air = field.air_at(time_s);
        let place = [at_m.x.to_bits(), at_m.y.to_bits(), at_m.z.to_bits()];
        self.0.entry((number, air, place)).or_insert_with(|| field.contributions_in(air, at_m))
    }
}

/// A phasor with the same phase.
fn with_norm(phasor: Complex64, norm: f64) -> Complex64 {
    Complex64::from_polar(norm, phasor.arg())
}
