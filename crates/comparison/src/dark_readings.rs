//! Quadrature noise and detector floor from dark readings.
//!
//! Of r² = (floor² + b² (n₁² + n₂²)) (1 + a n₀)² the excess over the floor is exponential with mean 2 b²; beside a floor the noise in
//! proportion, a, may be the larger, and r² is the sum of an exponential and a normal number. A reading in steps of a converter lies within half a step of
//! its value.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use fieldgap_acoustics::golden_section;
use fieldgap_records::RecordedScan;

use super::averaging::{averaged_magnitudes, within_readings};
use super::converter_steps::{powers_rounded_to, step_from_zero};
use super::rice::lost_in_noise;
use super::within_readings::WithinReadings;

/// Dark readings below which they say nothing: eight tell a standard deviation to 25 %.
const FEWEST_DARK_READINGS: usize = 8;

/// Nats by which dark readings must prefer a floor: one number is fitted, over some decades. Set by judgement.
const FLOOR_BY_DARK_READINGS: f64 = 7.0;

/// Noise in proportion to the level before repeats show it: some percent, as receivers have. Set by judgement.
pub const USUAL_PROPORTIONAL_NOISE: f64 = 0.02;

/// Mean reading of noise alone, in quadratures' standard deviations: √(π/2).
pub const OF_NOISE_ALONE: f64 = 1.253_314_137_315_500_1;

/// Least share of the dark power that is attributed to noise.
const LEAST_NOISE: f64 = 1e-5;

/// Variance of a magnitude of noise alone, in quadratures' variances.
const RAYLEIGH_VARIANCE: f64 = 2.0 - 0.5 * PI;

/// Dark readings, squared.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkReadings {
    /// Between which each lies: the steps of the converter hide where.
    powers: Vec<[f64; 2]>,
    /// Mean square of the readings.
    mean: f64,
    /// Of the readings themselves.
    mean_reading: f64,
    /// How many magnitudes each is the mean of.
    averaged: f64,
    /// What the scatter of these magnitudes tells.
    within: Option<WithinReadings>,
}

/// The noise that dark readings show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DarkNoise {
    /// Each quadrature's standard deviation.
    pub additive: f64,
    /// The floor; zero for none.
    pub floor: f64,
    /// By how much dark readings prefer that floor to none, in nats.
    pub evidence: f64,
    /// Whether noise comes in after the floor, which then takes nothing from it.
    pub before_noise: bool,
}

impl DarkNoise {
    /// Without a floor.
    pub fn without_floor(additive: f64) -> Self {
        Self { additive, floor: 0.0, evidence: 0.0, before_noise: false }
    }

    /// The floor that takes from the scatter of readings: one that is added after the noise.
    pub fn floor_after_noise(&self) -> f64 {
        if self.before_noise { 0.0 } else { self.floor }
    }
}

impl DarkReadings {
    /// Of a scan; `None` if it has too few.
    pub fn of_scan(scan: &RecordedScan) -> Option<Self> {
        let silent: Vec<f64> = scan.silent().map(|sample| sample.reading).collect();
        Some(Self::of(&silent, averaged_magnitudes(scan))?.with_scatter(within_readings(scan)))
    }

    /// The same readings, with what the scatter within readings tells.
    pub fn with_scatter(self, within: Option<WithinReadings>) -> Self {
        Self { within, ..self }
    }

    /// Of readings, each the mean of `averaged` magnitudes; `None` if they are too few.
    pub fn of(readings: &[f64], averaged: f64) -> Option<Self> {
        let mean_reading = readings.iter().sum::<f64>() / readings.len() as f64;
        let mean = readings.iter().map(|r| r * r).sum::<f64>() / readings.len() as f64;
        // A mean of magnitudes is not rounded itself.
        let step = step_from_zero(readings).filter(|_| averaged == 1.0).unwrap_or(0.0);
        let powers: Vec<[f64; 2]> =
            readings.iter().map(|&reading| powers_rounded_to(reading, step)).collect();
        (powers.len() >= FEWEST_DARK_READINGS && mean > 0.0).then_some(Self {
            powers,
            mean,
            mean_reading,
            averaged,
            within: None,
        })
    }

    /// The noise, given the proportional noise.
    pub fn noise(&self, share: f64) -> DarkNoise {
        if self.averaged > 1.0 {
            return self.noise_of_averages();
        }
        let of = |noise: f64| self.cost((0.5 * noise * self.mean).sqrt(), share);
        let none = DarkNoise::without_floor((0.5 * self.mean).sqrt());
        let (noise, cost) = golden_section::least_positive(LEAST_NOISE, 1.0, of);
        let evidence = self.cost(none.additive, share) - cost - 1.0;
        if evidence < FLOOR_BY_DARK_READINGS {
            return none;
        }
        let additive = (0.5 * noise * self.mean).sqrt();
        let floor = self.floor_beside(additive);
        DarkNoise { additive, floor, evidence, before_noise: false }
    }

    /// The noise from means of magnitudes. Without a floor single magnitudes have Rayleigh's distribution. Beside a larger floor f a
    /// magnitude is f + σ² (n₁² + n₂²) / 2f and scatters by σ²/f. A mean of n scatters by 1/√n of that.
    fn noise_of_averages(&self) -> DarkNoise {
        let additive = self.mean_reading / OF_NOISE_ALONE / self.averaged.sqrt();
        let none = DarkNoise::without_floor(additive);
        if let Some(within) = self.within {
            return match within.floor_power() {
                (_, evidence) if evidence < FLOOR_BY_DARK_READINGS => none,
                (power, evidence) => DarkNoise {
                    additive: (within.variance / self.averaged).sqrt(),
                    floor: power.sqrt(),
                    evidence,
                    before_noise: is_before_noise(&within, power.sqrt()),
                },
            };
        }
        let variance = (self.mean - self.mean_reading * self.mean_reading).max(1e-12 * self.mean);
        let ratio = variance / (RAYLEIGH_VARIANCE * additive * additive);
        let evidence = 0.5 * self.powers.len() as f64 * (ratio - 1.0 - ratio.ln()) - 1.0;
        if ratio > 1.0 || evidence < FLOOR_BY_DARK_READINGS {
            return none;
        }
        let additive = additive.min((self.mean_reading * (variance / self.averaged).sqrt()).sqrt());
        let floor = self.floor_beside(additive);
        DarkNoise { additive, floor, evidence, before_noise: false }
    }

    /// Negative logarithm of the likelihood of a quadrature's noise beside no floor, less a constant.
    pub fn cost_without_floor(&self, additive: f64) -> f64 {
        if self.averaged > 1.0 {
            let count = self.powers.len() as f64;
            let variance = RAYLEIGH_VARIANCE * additive * additive;
            let off = self.mean_reading - OF_NOISE_ALONE * additive * self.averaged.sqrt();
            let scattered = self.mean - self.mean_reading * self.mean_reading;
            return 0.5 * count * (variance.ln() + (scattered + off * off) / variance);
        }
        let power = 2.0 * additive * additive;
        let of_reading = |&[least, most]: &[f64; 2]| {
            let width = (most - least) / power;
            let share = if width > NARROW { -(-width).exp_m1() / width } else { 1.0 - 0.5 * width };
            power.ln() + least / power - share.ln()
        };
        self.powers.iter().map(of_reading).sum()
    }

    /// Slope of the logarithm of that likelihood by the square of the noise, and its information.
    pub fn slope_and_information(&self, additive: f64) -> (f64, f64) {
        let variance = additive * additive;
        let count = self.powers.len() as f64;
        (
            (0.5 * self.mean / (variance * self.averaged) - 1.0) * count / variance,
            count / (variance * variance),
        )
    }

    /// The floor, if the quadratures' noise is this.
    pub fn floor_beside(&self, additive: f64) -> f64 {
        (self.mean - 2.0 * additive * additive * self.averaged).max(0.0).sqrt()
    }

    /// The least reading; of readings in steps, the largest level that reads so.
    pub fn least(&self) -> f64 {
        let most = self.powers.iter().map(|[_, most]| *most);
        most.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Negative logarithm of the likelihood of a quadrature's noise, the floor being the rest of the power.
    pub fn cost(&self, additive: f64, share: f64) -> f64 {
        let rate = 1.0 / (2.0 * additive * additive);
        let floor = self.floor_beside(additive).powi(2);
        let deviation = (2.0 * share * self.mean).max(1e-6 * self.mean);
        let of_reading = |[least, most]: &[f64; 2]| {
            -log_mean_density([least - floor, most - floor], rate, deviation)
        };
        self.powers.iter().map(of_reading).sum()
    }
}

/// Whether silent magnitudes scatter as if noise came in after a floor, and not before it.
///
/// After it, they have Rice's distribution. Before it, their squares are f² and an exponential number of mean 2 b²: the mean magnitude is
/// f + b √(π/2) exp(x²) erfc(x), with x = f/(b √2).
fn is_before_noise(within: &WithinReadings, floor: f64) -> bool {
    /// From here on exp(x²) erfc(x) is 1/(x √π) to a percent.
    const LARGE: f64 = 6.0;
    let variance = within.variance;
    let after_floor = variance * (1.0 - lost_in_noise(floor, variance));
    let x = floor / (2.0 * variance).sqrt();
    let scaled = if x < LARGE { (x * x).exp() * libm::erfc(x) } else { 1.0 / (x * PI.sqrt()) };
    let mean = floor + OF_NOISE_ALONE * variance.sqrt() * scaled;
    let before_floor = (floor * floor + 2.0 * variance - mean * mean).max(1e-9 * variance);
    let off = |expected: f64| (within.silent_variance / expected).ln().abs();
    off(after_floor) < off(before_floor)
}

/// Logarithm of the density of the sum of an exponential number with a rate and a normal one with a standard deviation.
fn log_density(x: f64, rate: f64, deviation: f64) -> f64 {
    let spread = rate * deviation;
    let z = FRAC_1_SQRT_2 * (spread - x / deviation);
    if z < 20.0 {
        return (0.5 * rate * libm::erfc(z)).ln() + spread * (0.5 * spread - x / deviation);
    }
    // erfc(z) → exp(-z²) / (z √π), its exponent and the other's cancelling but for the normal number's own.
    (rate / (2.0 * z * PI.sqrt())).ln() - 0.5 * (x / deviation).powi(2)
}

/// Width, in the narrower of the two distributions, below which a density hardly changes.
const NARROW: f64 = 0.02;

/// Logarithm of the mean of that density between two numbers. Its integral is that of the normal number less the density over the rate.
fn log_mean_density([least, most]: [f64; 2], rate: f64, deviation: f64) -> f64 {
    let middle = 0.5 * (least + most);
    if (most - least) * rate.max(deviation.recip()) < NARROW {
        return log_density(middle, rate, deviation);
    }
    let density = |x: f64| log_density(x, rate, deviation).exp();
    // On each side the smaller part, which keeps its digits.
    let beyond = |x: f64| 0.5 * libm::erfc(FRAC_1_SQRT_2 * x / deviation) + density(x) / rate;
    let below = |x: f64| 0.5 * libm::erfc(-FRAC_1_SQRT_2 * x / deviation) - density(x) / rate;
    let mass = if middle > 0.0 { beyond(least) - beyond(most) } else { below(most) - below(least) };
    // Far below zero both vanish. The density rises there, so that its end has most of the mass.
    let at_end = log_density(most, rate, deviation) - NARROW.recip().ln();
    (mass / (most - least)).max(f64::MIN_POSITIVE).ln().max(at_end)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::SQRT_2;

    use super::*;

    /// Dark readings with a floor, drawn by a generator of its own.
    fn readings(floor: f64, additive: f64, share: f64) -> Vec<f64> {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal =
            || (-2.0 * uniform().max(1e-300).ln()).sqrt() * (2.0 * PI * uniform()).cos();
        (0..400)
            .map(|_| {
                let noise = (additive * normal()).hypot(additive * normal());
                noise.hypot(floor) * (1.0 + share * normal())
            })
            .collect()
    }

    #[test]
    fn a_floor_is_told_from_noise_even_where_the_share_scatters_more() {
        let dark = DarkReadings::of(&readings(0.21, 0.02, 0.02), 1.0).expect("enough");
        let noise = dark.noise(0.02);
        assert!((noise.floor / 0.21 - 1.0).abs() < 0.01, "{noise:?}");
        assert!((noise.additive / 0.02 - 1.0).abs() < 0.3, "{noise:?}");
        assert!(noise.evidence > 100.0, "{noise:?}");
    }

    #[test]
    fn silence_without_a_floor_shows_none() {
        let dark = DarkReadings::of(&readings(0.0, 0.02, 0.02), 1.0).expect("enough");
        let noise = dark.noise(0.02);
        assert_eq!((noise.floor, noise.evidence), (0.0, 0.0));
        assert!((noise.additive / 0.02 - 1.0).abs() < 0.1, "{noise:?}");
    }

    #[test]
    fn means_of_magnitudes_that_scatter_too_little_show_a_floor() {
        let averages: Vec<f64> = readings(0.21, 0.02, 0.0)
            .chunks(16)
            .map(|chunk| chunk.iter().sum::<f64>() / 16.0)
            .collect();
        let noise = DarkReadings::of(&averages, 16.0).expect("enough").noise(0.02);
        assert!((noise.floor / 0.21 - 1.0).abs() < 0.01, "{noise:?}");
        assert!((noise.additive / 0.005 - 1.0).abs() < 0.3, "{noise:?}");
    }

    #[test]
    fn a_mean_of_magnitudes_shows_no_floor() {
        let averages: Vec<f64> = readings(0.0, 0.02, 0.0)
            .chunks(16)
            .map(|chunk| chunk.iter().sum::<f64>() / 16.0)
            .collect();
        let noise = DarkReadings::of(&averages, 16.0).expect("enough").noise(0.02);
        assert_eq!(noise.floor, 0.0);
        assert!((noise.additive / 0.005 - 1.0).abs() < 0.1, "{noise:?}");
    }

    /// Noise of less than a step reads as one step nearly always, which a floor would too.
    #[test]
    fn noise_in_coarse_steps_is_no_floor_and_a_floor_in_them_is_one() {
        let rounded = |readings: Vec<f64>, step: f64| -> Vec<f64> {
            readings.iter().map(|reading| (reading / step).round() * step).collect()
        };
        for step in [0.01, 0.02, 0.03, 0.06] {
            let dark = DarkReadings::of(&rounded(readings(0.0, 0.02, 0.02), step), 1.0);
            let noise = dark.expect("enough").noise(0.02);
            assert_eq!((noise.floor, noise.evidence), (0.0, 0.0), "{step}");
        }
        for step in [0.01, 0.02, 0.03] {
            let dark = DarkReadings::of(&rounded(readings(0.21, 0.02, 0.02), step), 1.0);
            let noise = dark.expect("enough").noise(0.02);
            assert!((noise.floor / 0.21 - 1.0).abs() < 0.02, "{step}: {noise:?}");
            assert!(noise.evidence > 100.0, "{step}: {noise:?}");
        }
    }

    /// Against the rectangle rule.
    #[test]
    fn the_mean_density_between_two_numbers_is_its_integral_over_their_distance() {
        for (rate, deviation) in [(1.0, 0.05), (1.0, 1.0), (20.0, 1.0)] {
            for (least, most) in [(-0.4, 0.3), (0.1, 2.0), (2.0, 2.1), (-3.0, -1.0)] {
                let step = (most - least) / 20_000.0;
                let at = |n: u32| log_density(least + (f64::from(n) + 0.5) * step, rate, deviation);
                let mean = (0..20_000).map(|n| at(n).exp()).sum::<f64>() / 20_000.0;
                let found = log_mean_density([least, most], rate, deviation);
                if mean > 1e-12 {
                    assert!(
                        (found - mean.ln()).abs() < 1e-3,
                        "{rate} {deviation} {least}: {found}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_density_is_one_in_all_on_both_sides_of_its_bend() {
        for (rate, deviation) in [(1.0, 0.01), (1.0, 1.0), (30.0, 1.0)] {
            let step = 1e-3 / f64::max(rate, 1.0 / deviation);
            let range = 12.0 * deviation + 30.0 / rate;
            let steps = (2.0 * range / step) as usize;
            let sum: f64 = (0..steps)
                .map(|i| log_density(i as f64 * step - range, rate, deviation).exp())
                .sum();
            assert!((sum * step - 1.0).abs() < 3e-3, "{rate} {deviation} {}", sum * step);
            let bend = deviation * (rate * deviation - 20.0 * SQRT_2);
            let [below, above] =
                [bend - 1e-9, bend + 1e-9].map(|x| log_density(x, rate, deviation));
            assert!((below - above).abs() < 2e-3, "{below} {above}");
        }
    }
}
