//! What the receiver makes of a pressure: gain, drift, quadrature noise, compression, floor, noise in proportion, full scale.

use fieldgap_comparison::rice_mean;

use super::effect::Expected;
use super::forward_model::ForwardModel;
use super::instance::Active;
use super::nuisance::Nuisance;
use super::observations::{Observations, ObservedScan};
use super::pressure::Pressure;
use crate::limits::LEAST_VARIANCE_RATIO;
use crate::statistics::detector::Detected;
use crate::statistics::reading_pairs::Compression;

/// The expected reading on the scan's noise scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaled {
    pub value: f64,
    /// Its slope by the natural logarithm of the level.
    pub by_log_level: f64,
    /// Variance of a reading about it, over that of the scan's scatter.
    pub variance_ratio: f64,
}

impl ForwardModel<'_> {
    /// What the receiver reads of a pressure: gain, drift, quadrature noise, compression, floor, noise in proportion (or that
    /// before compression and floor), full scale, in this order.
    pub fn expected(
        &self,
        pressure: &Pressure,
        gain: f64,
        progress: f64,
        scan: &ObservedScan,
    ) -> Expected {
        let scatter = &scan.scatter;
        let gain = self.gain_at(gain, progress);
        let floor = self.floor();
        let (level, floor) = match scan.scatter.floor_before_noise {
            true => (level(pressure, gain).hypot(floor), 0.0),
            false => (level(pressure, gain), floor),
        };
        // Of magnitudes that are averaged, each has the noise of one.
        let single = scatter.additive * scan.averaged.sqrt();
        if !self.changes_scatter() {
            let reading = rice_mean(level, single);
            return self.cut(Expected { reading, variance_ratio: 1.0 }, scan);
        }
        let noise = single * single;
        let speckle = pressure.speckle_along_and_across().map(|square| gain * gain * square);
        let [along, across] = speckle.map(|square| (noise + square).sqrt());
        let detected = Detected::of(level, along, across);
        let (reading, quadrature) = detected.received(floor, |level| self.detected(level, floor));
        // Of a floor that comes in before all noise, readings scatter as they do of any level.
        let before_detector =
            self.proportional_noise_before_detector() && !scan.scatter.floor_before_noise;
        let proportional = match before_detector {
            false => scatter.share * reading,
            true => scatter.share * level * self.slope(level, reading),
        };
        // Averaging takes from the noise, and not from what changes more slowly.
        let of_noise = 2.0 * noise / (2.0 * noise + speckle[0] + speckle[1]).max(f64::MIN_POSITIVE);
        let quadrature = quadrature * (1.0 - of_noise * (1.0 - 1.0 / scan.averaged));
        let variance = quadrature + proportional * proportional;
        let variance_ratio =
            (variance * scan.scale.slope(reading).powi(2)).max(LEAST_VARIANCE_RATIO);
        self.cut(Expected { reading, variance_ratio }, scan)
    }

    /// The same on the scan's scale.
    #[inline]
    pub fn expected_on_scale(
        &self,
        pressure: &Pressure,
        gain: f64,
        progress: f64,
        scan: &ObservedScan,
    ) -> Scaled {
        /// Relative step of the level for its slope.
        const LOUDER: f64 = 1e-5;
        if !self.changes_scatter() && !self.clips() {
            let level = level(pressure, self.gain_at(gain, progress));
            let (value, by_log_level) = scan.scale.of_level(level);
            return Scaled { value, by_log_level, variance_ratio: 1.0 };
        }
        let Expected { reading, variance_ratio } = self.expected(pressure, gain, progress, scan);
        // Neither a mean in the noise nor one at full scale follows its level.
        let louder = self.expected(pressure, gain * (1.0 + LOUDER), progress, scan).reading;
        let by_log_level = scan.scale.slope(reading) * (louder - reading) / LOUDER;
        Scaled { value: scan.scale.of(reading), by_log_level, variance_ratio }
    }

    /// One reading of a pressure, with these normal numbers as what scatters: along the phase of the pressure, across it, and in proportion.
    /// Full scale is left out, and of averaged magnitudes the noise is that of their mean.
    pub fn drawn(
        &self,
        pressure: &Pressure,
        progress: f64,
        scan: &ObservedScan,
        lots: [f64; 3],
    ) -> f64 {
        let scatter = &scan.scatter;
        let gain = self.gain_at(1.0, progress);
        let speckle = pressure.speckle_along_and_across().map(|square| gain * gain * square);
        let [along, across] =
            speckle.map(|square| (scatter.additive * scatter.additive + square).sqrt());
        let (level, floor) = match scatter.floor_before_noise {
            true => (level(pressure, gain).hypot(self.floor()), 0.0),
            false => (level(pressure, gain), self.floor()),
        };
        let magnitude = (level + along * lots[0]).hypot(across * lots[1]);
        let in_proportion = (1.0 + scatter.share * lots[2]).max(0.0);
        match self.proportional_noise_before_detector() && !scatter.floor_before_noise {
            false => self.detected(magnitude, floor) * in_proportion,
            true => self.detected(magnitude * in_proportion, floor),
        }
    }

    fn gain_at(&self, gain: f64, progress: f64) -> f64 {
        /// A gain is kept above this share of its first value: nothing drifts to zero.
        const LEAST: f64 = 1e-3;
        let effects = self.as_added().iter();
        let drift: f64 =
            effects.map(|active| active.effect.gain(active.setting(), progress)).product();
        gain * drift.max(LEAST)
    }

    /// What amplifier and detector make of a level, with a floor if this is above zero.
    fn detected(&self, level: f64, floor: f64) -> f64 {
        let acts =
            |active: &&Active<'_>| floor > 0.0 || active.effect.floor(active.setting()) == 0.0;
        let detector = self.detector().filter(acts);
        detector.fold(level, |level, active| active.effect.transfer(active.setting(), level))
    }

    /// The slope of that, at a level whose mean reading is known. A floor in power makes it the ratio of the level before the floor to
    /// the reading.
    fn slope(&self, level: f64, reading: f64) -> f64 {
        if level <= 0.0 {
            return 0.0;
        }
        let (slope, output) = self.slope_and_output(level, Some(reading));
        slope * output / reading
    }

    /// The slope by the level of what amplifier and detector make of it, and that itself. What adds a floor makes this reading of a level, and is left out
    /// without one.
    fn slope_and_output(&self, level: f64, beside_floor: Option<f64>) -> (f64, f64) {
        let (mut slope, mut input) = (1.0, level);
        for active in self.detector() {
            let setting = active.setting();
            let output = match (active.effect.floor(setting) > 0.0, beside_floor) {
                (true, Some(reading)) => reading,
                (true, None) => continue,
                (false, _) => active.effect.transfer(setting, input),
            };
            slope *= active.effect.transfer_slope(input, output);
            input = output;
        }
        (slope, input)
    }

    /// How far the detector compresses each reading, in the order of the observations; empty if it does not.
    pub fn compressions(
        &self,
        observations: &Observations,
        nuisance: &[Nuisance],
    ) -> Vec<Compression> {
        if self.detector().all(|active| active.effect.floor(active.setting()) > 0.0) {
            return Vec::new();
        }
        let of = |pressure: &Pressure| {
            let level = level(pressure, 1.0).max(f64::MIN_POSITIVE);
            let (slope, output) = self.slope_and_output(level, None);
            Compression { slope, of_logarithms: slope * level / output }
        };
        self.levels(observations, nuisance).iter().map(of).collect()
    }

    fn floor(&self) -> f64 {
        self.detector().map(|active| active.effect.floor(active.setting())).sum()
    }

    /// Whether noise in proportion to the level comes in before the detector, by the effect added last that asks for it.
    fn proportional_noise_before_detector(&self) -> bool {
        let asked = self.as_added().iter().rev().find_map(|active| {
            active.effect.proportional_noise_before_detector(active.setting().choice)
        });
        asked.unwrap_or(false)
    }

    fn cut(&self, expected: Expected, scan: &ObservedScan) -> Expected {
        if !self.clips() {
            return expected;
        }
        self.effects().fold(expected, |expected, active| {
            let deviation = scan.scale.deviation(expected.reading) * expected.variance_ratio.sqrt();
            active.effect.clipped(active.setting(), expected, deviation)
        })
    }
}

/// The magnitude of a pressure at a gain. (The library's norm guards against overflow, at five times the time.)
fn level(pressure: &Pressure, gain: f64) -> f64 {
    pressure.coherent.norm_sqr().sqrt() * gain
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Vec3;

    use crate::effect_id::EffectId;
    use crate::effects::testing::{Bench, nuisance};
    use crate::model::forward_model::ForwardModel;

    /// A reading at full scale follows its level no longer, one far below as it would.
    #[test]
    fn the_slope_of_a_reading_is_that_by_its_level() {
        const LOUDER: f64 = 1e-4;
        let bench = Bench::new();
        let places = (0..60).map(|n| Vec3::new(1e-3 * f64::from(n), 0.0, 0.1)).collect();
        let observations = bench.observations(&[(bench.believed().excitation.clone(), places)]);
        let scan = &observations.scans[0];
        let believed = ForwardModel::believed();
        let levels = believed.expected_readings(&observations, &[nuisance()]);
        let largest = levels.iter().copied().fold(0.0, f64::max);
        let model = bench.model(EffectId::Clipping, &[0.3 * largest]);
        let pressures = model.pressures(&observations, &[nuisance()]);
        let gain = nuisance().log_gain.exp();
        let mut clipped = 0;
        for pressure in &pressures[0][0] {
            let here = model.expected_on_scale(pressure, gain, 0.0, scan);
            let mut louder = *pressure;
            louder.coherent *= 1.0 + LOUDER;
            let there = model.expected_on_scale(&louder, gain, 0.0, scan);
            let slope = (there.value - here.value) / LOUDER;
            assert!((here.by_log_level - slope).abs() < 0.01 * slope.abs() + 0.1, "{slope}");
            clipped += usize::from(slope < 0.1);
        }
        assert!((1..pressures[0][0].len()).contains(&clipped), "{clipped}");
    }
}
