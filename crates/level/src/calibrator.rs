//! The sensitivity of a receiver from readings in a sound calibrator.

use super::budget::{Budget, Kind, Line};
use super::decibel::of_level_pa;

/// A sound calibrator on a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibrator {
    /// Level in its cavity, dB re 20 µPa rms.
    pub level_db: f64,
    /// Standard uncertainty of this level, dB; `None` if it is not known.
    pub level_u_db: Option<f64>,
    /// Response of the receiver in the field at the carrier, relative to its response in the cavity at the calibrator's frequency, dB.
    /// `None` if it is not known.
    pub carrier_response: Option<Relative>,
}

/// A response relative to another, with its standard uncertainty, dB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative {
    /// Level, dB.
    pub db: f64,
    /// Standard uncertainty, dB; `None` if it is not known.
    pub u_db: Option<f64>,
}

/// Why readings give no sensitivity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoSensitivity {
    /// There are too few readings.
    #[error(
        "{0} readings were taken with the calibrator on the receiver; at least two are needed, to know how they scatter"
    )]
    TooFew(usize),
    /// The mean is not above zero.
    #[error("the mean of the readings is {0}: was the calibrator on?")]
    Silent(f64),
}

/// A sensitivity that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedReceiver {
    /// Reading per pascal rms, at the carrier.
    pub readings_a_pa: f64,
    /// Mean of the readings.
    pub mean: f64,
    /// Standard deviation of one reading.
    pub scatter: f64,
    /// Number of readings.
    pub readings: usize,
    /// Times that the calibrator was put on.
    pub placements: usize,
    /// Its uncertainty, as far as it is known.
    pub budget: Budget,
    /// What must be known for the uncertainty to be complete.
    pub unknown: Vec<&'static str>,
}

impl CalibratedReceiver {
    /// Takes the readings of each time that the calibrator was put on.
    ///
    /// With several such placements the scatter of their means is the repeatability: it contains how the calibrator sits. With one, it
    /// is the scatter of the readings (GUM, 4.2.3).
    ///
    /// # Errors
    /// [`NoSensitivity`]
    pub fn of(placements: &[Vec<f64>], calibrator: Calibrator) -> Result<Self, NoSensitivity> {
        let all: Vec<f64> = placements.concat();
        if all.len() < 2 {
            return Err(NoSensitivity::TooFew(all.len()));
        }
        let (of_all, scatter) = mean_and_scatter(&all);
        let means: Vec<f64> = placements
            .iter()
            .filter(|some| !some.is_empty())
            .map(|some| mean_and_scatter(some).0)
            .collect();
        let (mean, of_mean, degrees) = match means.len() {
            0 | 1 => (of_all, scatter / (all.len() as f64).sqrt(), all.len() - 1),
            count => {
                let (mean, scatter) = mean_and_scatter(&means);
                (mean, scatter / (count as f64).sqrt(), count - 1)
            }
        };
        if mean <= 0.0 {
            return Err(NoSensitivity::Silent(mean));
        }
        let what = if means.len() > 1 {
            "repeatability, calibrator put on anew"
        } else {
            "repeatability of the readings"
        };
        let mut lines = vec![
            Line::relative(what, Kind::A, of_mean / mean).with_degrees_of_freedom(degrees as f64),
        ];
        let mut unknown = Vec::new();
        match calibrator.level_u_db {
            Some(u_db) => lines.push(Line::decibels("level of the calibrator", Kind::B, u_db)),
            None => unknown.push("the uncertainty of the calibrator's level"),
        }
        match calibrator.carrier_response {
            None => {
                unknown.push("the response at the carrier relative to the calibrator's frequency")
            }
            Some(Relative { u_db: Some(u_db), .. }) => {
                lines.push(Line::decibels("response at the carrier", Kind::B, u_db));
            }
            Some(Relative { u_db: None, .. }) => {
                unknown.push("the uncertainty of the response at the carrier")
            }
        }
        let response_db = calibrator.carrier_response.map_or(0.0, |response| response.db);
        let readings_a_pa =
            mean / of_level_pa(calibrator.level_db) * 10f64.powf(response_db / 20.0);
        Ok(Self {
            readings_a_pa,
            mean,
            scatter,
            readings: all.len(),
            placements: means.len(),
            budget: Budget::new(lines),
            unknown,
        })
    }
}

/// Mean and sample standard deviation; the latter is 0 of one number.
fn mean_and_scatter(numbers: &[f64]) -> (f64, f64) {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let squares: f64 = numbers.iter().map(|number| (number - mean).powi(2)).sum();
    (mean, if numbers.len() > 1 { (squares / (count - 1.0)).sqrt() } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const AT_114: Calibrator = Calibrator {
        level_db: 114.0,
        level_u_db: Some(0.1),
        carrier_response: Some(Relative { db: 0.0, u_db: Some(0.0) }),
    };

    #[test]
    fn at_114_db_the_pressure_is_ten_pascals() {
        // 20 µPa times 10^5.7 is 10.02 Pa.
        let found =
            CalibratedReceiver::of(&[vec![0.0301, 0.0299, 0.0300]], AT_114).expect("readings");
        assert!((found.readings_a_pa - 0.03 / 10.0237).abs() < 1e-7, "{found:?}");
        // 0.0001/√3 of 0.03, and 0.1 dB, which is 1.15 %.
        let expected = (0.0001f64 / 3f64.sqrt() / 0.03).hypot(0.1 / crate::DB_PER_NEPER);
        assert!((found.budget.relative() - expected).abs() < 1e-9);
        assert!(found.unknown.is_empty());
    }

    #[test]
    fn the_response_at_the_carrier_lowers_the_sensitivity() {
        let response = Relative { db: -6.0206, u_db: Some(0.5) };
        let at_carrier = Calibrator { carrier_response: Some(response), ..AT_114 };
        let [cavity, carrier] = [AT_114, at_carrier].map(|calibrator| {
            CalibratedReceiver::of(&[vec![0.03; 4]], calibrator).expect("readings")
        });
        assert!((cavity.readings_a_pa / carrier.readings_a_pa - 2.0).abs() < 1e-4);
        assert!((carrier.budget.combined_db - 0.1f64.hypot(0.5)).abs() < 1e-9);
    }

    #[test]
    fn placements_scatter_by_their_means() {
        let found =
            CalibratedReceiver::of(&[vec![0.98, 0.98], vec![1.02, 1.02], vec![1.0, 1.0]], AT_114)
                .expect("readings");
        let repeatability = &found.budget.lines[0];
        assert!(
            (repeatability.standard_uncertainty - 2.0 / 3f64.sqrt()).abs() < 1e-9,
            "{repeatability:?}"
        );
        assert_eq!((repeatability.degrees_of_freedom, found.placements), (Some(2.0), 3));
    }

    #[test]
    fn what_is_not_known_is_named() {
        let unknown = Calibrator { level_u_db: None, carrier_response: None, ..AT_114 };
        let found = CalibratedReceiver::of(&[vec![0.03, 0.031]], unknown).expect("readings");
        assert_eq!((found.unknown.len(), found.budget.lines.len()), (2, 1));
        assert_eq!(CalibratedReceiver::of(&[vec![0.03]], AT_114), Err(NoSensitivity::TooFew(1)));
        assert_eq!(
            CalibratedReceiver::of(&[vec![0.0, 0.0]], AT_114),
            Err(NoSensitivity::Silent(0.0))
        );
    }

    /// Propagation of distributions (JCGM 101): laboratories whose calibrator, response and readings differ from what is stated.
    #[test]
    fn the_budget_agrees_with_a_monte_carlo() {
        const DRAWS: usize = 20_000;
        const TRUE_V_PA: f64 = 0.003;
        let stated = Calibrator {
            level_db: 114.0,
            level_u_db: Some(0.15),
            carrier_response: Some(Relative { db: -1.8, u_db: Some(0.4) }),
        };
        let mut draws = ChaCha8Rng::seed_from_u64(5);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut draws) };
        let mut combined = 0.0;
        let errors_db: Vec<f64> = (0..DRAWS)
            .map(|_| {
                let true_pa = 20e-6 * 10f64.powf((114.0 + 0.15 * normal()) / 20.0);
                let true_response = 10f64.powf((-1.8 + 0.4 * normal()) / 20.0);
                let volts = TRUE_V_PA / true_response * true_pa;
                let readings = (0..40).map(|_| volts * (1.0 + 0.12 * normal())).collect();
                let found = CalibratedReceiver::of(&[readings], stated).expect("readings");
                combined += found.budget.combined_db.powi(2) / DRAWS as f64;
                20.0 * (found.readings_a_pa / TRUE_V_PA).log10()
            })
            .collect();
        let mean = errors_db.iter().sum::<f64>() / DRAWS as f64;
        let squares: f64 = errors_db.iter().map(|error| (error - mean).powi(2)).sum();
        let (drawn, combined) = ((squares / DRAWS as f64).sqrt(), combined.sqrt());
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((combined / drawn - 1.0).abs() < 0.05, "{combined} {drawn}");
        let within = errors_db.iter().filter(|error| error.abs() <= 2.0 * combined).count();
        let covered = within as f64 / DRAWS as f64;
        assert!((0.93..0.97).contains(&covered), "{covered}");
    }
}
