//! The receiver's signal while the array is silent: whether noise averages out, drift, mains hum.

use serde::Serialize;

/// Frequencies at which mains hum, and their first overtones, Hz.
const MAINS_HZ: [f64; 4] = [50.0, 60.0, 100.0, 120.0];

/// Power at one frequency over the mean of all, above which it is no chance: white noise goes beyond z with a
/// probability of exp(-z) (J. D. Scargle, Astrophys. J. 263, 835, 1982).
const HUMS: f64 = 12.0;

/// Means that scatter by this many times what white noise would leave do not average out.
const EXCESS: f64 = 2.5;

/// A trend of so many standard errors is none by chance.
const TRENDS: f64 = 5.0;

/// A mean over a few readings, or a single reading, and when it was taken on the receiver's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimedValue {
    pub(super) t_s: f64,
    pub(super) value: f64,
}

/// The signal while the array was silent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    /// Standard deviation of means over as many readings as a point has, in the receiver's unit.
    pub of_means: f64,
    /// What white noise of the same readings would leave of it.
    pub of_means_if_white: f64,
    /// By how much the means rise in a second, in the receiver's unit, where that is no chance.
    pub drift_per_s: Option<f64>,
    /// The mains' hum, where there is any.
    pub hum: Option<Hum>,
}

/// A hum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hum {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Its amplitude, in the receiver's unit.
    pub amplitude: f64,
}

impl Noise {
    /// Of means over `count` readings whose standard deviation is `std`, and of single readings.
    pub(super) fn of(means: &[TimedValue], count: usize, std: f64, singles: &[TimedValue]) -> Self {
        let trend = Line::through(means);
        Self {
            of_means: deviation(means),
            of_means_if_white: std / (count.max(1) as f64).sqrt(),
            drift_per_s: trend.filter(Line::is_no_chance).map(|line| line.slope),
            hum: hum(singles),
        }
    }

    /// What is wrong, and what to do about it.
    pub(super) fn findings(&self, unit: &str) -> Vec<(String, &'static str)> {
        let mut findings = Vec::new();
        if let Some(Hum { frequency_hz, amplitude }) = self.hum {
            findings.push((
                format!("mains hum of {amplitude:.4} {unit} at {frequency_hz:.0} Hz"),
                "look for a ground loop, use another power supply, keep the cable away from mains and motors",
            ));
        }
        if let Some(drift) = self.drift_per_s {
            findings.push((
                format!("the level drifts by {drift:+.2e} {unit} per second"),
                "let the receiver warm up for 15 minutes; if it still drifts, check its power supply",
            ));
        } else if self.of_means > EXCESS * self.of_means_if_white && self.hum.is_none() {
            findings.push((
                format!(
                    "the noise does not average out: means scatter by {:.5} {unit}, where white noise would leave {:.5} {unit}",
                    self.of_means, self.of_means_if_white
                ),
                "look for another source of ultrasound, draughts, a loose wire or an unstable power supply",
            ));
        }
        findings
    }
}

fn mean(values: &[TimedValue]) -> f64 {
    values.iter().map(|at| at.value).sum::<f64>() / values.len().max(1) as f64
}

fn deviation(values: &[TimedValue]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|at| (at.value - mean).powi(2)).sum();
    (squares / values.len().saturating_sub(1).max(1) as f64).sqrt()
}

/// A straight line through values in time.
struct Line {
    slope: f64,
    error: f64,
}

impl Line {
    fn through(values: &[TimedValue]) -> Option<Self> {
        let count = values.len() as f64;
        let (mean_t, mean) = (values.iter().map(|at| at.t_s).sum::<f64>() / count, mean(values));
        let spread: f64 = values.iter().map(|at| (at.t_s - mean_t).powi(2)).sum();
        if values.len() < 4 || spread == 0.0 {
            return None;
        }
        let product = |at: &TimedValue| (at.t_s - mean_t) * (at.value - mean);
        let slope = values.iter().map(product).sum::<f64>() / spread;
        let left = |at: &TimedValue| (at.value - mean - slope * (at.t_s - mean_t)).powi(2);
        let left: f64 = values.iter().map(left).sum();
        Some(Self { slope, error: (left / (count - 2.0) / spread).sqrt() })
    }

    fn is_no_chance(&self) -> bool {
        self.slope.abs() > TRENDS * self.error
    }
}

/// The strongest hum among the mains' frequencies, where it is no chance.
///
/// Sines and cosines are fitted to readings at uneven times, which leaves no frequency hidden behind another.
fn hum(singles: &[TimedValue]) -> Option<Hum> {
    if singles.len() < 20 {
        return None;
    }
    let (mean, variance) = (mean(singles), deviation(singles).powi(2));
    let strongest = MAINS_HZ
        .into_iter()
        .map(|frequency_hz| (frequency_hz, amplitude(singles, mean, frequency_hz)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (frequency_hz, amplitude) = strongest;
    let power = singles.len() as f64 * amplitude.powi(2) / 4.0 / variance;
    // Over less than two periods of the slowest, a trend would be taken for a hum.
    let span_s = singles[singles.len() - 1].t_s - singles[0].t_s;
    (power > HUMS && span_s > 2.0 / MAINS_HZ[0]).then_some(Hum { frequency_hz, amplitude })
}

/// Amplitude of the sine at a frequency that fits best.
fn amplitude(singles: &[TimedValue], mean: f64, frequency_hz: f64) -> f64 {
    let (mut cc, mut ss, mut cs, mut cv, mut sv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for at in singles {
        let (sin, cos) = (std::f64::consts::TAU * frequency_hz * at.t_s).sin_cos();
        let value = at.value - mean;
        cc += cos * cos;
        ss += sin * sin;
        cs += cos * sin;
        cv += cos * value;
        sv += sin * value;
    }
    let determinant = cc * ss - cs * cs;
    // Readings all at one phase do not determine the amplitude.
    if determinant < 0.05 * cc * ss {
        return 0.0;
    }
    ((cv * ss - sv * cs) / determinant).hypot((sv * cc - cv * cs) / determinant)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// Single readings at uneven times, of white noise and what is added to it.
    fn singles(seed: u64, added: impl Fn(f64) -> f64) -> Vec<TimedValue> {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.02, 0.01).expect("a normal");
        let mut t_s = 3.0;
        (0..100)
            .map(|_| {
                t_s += 0.002 + 0.004 * draws.random::<f64>();
                TimedValue { t_s, value: noise.sample(&mut draws) + added(t_s) }
            })
            .collect()
    }

    fn sine(frequency_hz: f64, amplitude: f64) -> impl Fn(f64) -> f64 {
        move |t_s| amplitude * (std::f64::consts::TAU * frequency_hz * t_s + 0.7).sin()
    }

    #[test]
    fn a_hum_is_found_at_its_frequency_with_its_amplitude() {
        for frequency_hz in MAINS_HZ {
            let found = hum(&singles(1, sine(frequency_hz, 0.02))).expect("it hums");
            assert_eq!(found.frequency_hz, frequency_hz);
            assert!((found.amplitude / 0.02 - 1.0).abs() < 0.25, "{found:?}");
        }
    }

    #[test]
    fn white_noise_does_not_hum() {
        let hums = (0..500).filter(|&seed| hum(&singles(seed, |_| 0.0)).is_some()).count();
        assert_eq!(hums, 0);
    }

    #[test]
    fn white_noise_gives_no_finding_a_drift_and_a_wandering_one_do() {
        let white = singles(4, |_| 0.0);
        assert!(Noise::of(&white, 1, 0.01, &white).findings("V").is_empty());
        let drift = singles(4, |t_s| 0.5 * t_s);
        let noise = Noise::of(&drift, 1, 0.01, &white);
        assert!((noise.drift_per_s.expect("it drifts") - 0.5).abs() < 0.05, "{noise:?}");
        assert!(noise.findings("V")[0].0.contains("the level drifts by +"));
        let wanders = singles(4, sine(7.0, 0.06));
        let findings = Noise::of(&wanders, 1, 0.01, &white).findings("V");
        assert!(findings[0].0.contains("does not average out"), "{findings:?}");
    }

    #[test]
    fn a_receiver_that_repeats_one_number_gives_no_finding() {
        let same: Vec<TimedValue> =
            (0..50).map(|k| TimedValue { t_s: f64::from(k), value: 1.0 }).collect();
        assert!(Noise::of(&same, 16, 0.0, &same).findings("V").is_empty());
        assert!(Noise::of(&[], 16, 0.0, &[]).findings("V").is_empty());
    }
}
