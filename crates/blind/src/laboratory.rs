//! A laboratory as it is assumed to be: array, foci, unit and noise of its readings.

use std::num::NonZeroU32;

use super::random_sequence::RandomSequence;
use super::survey::Survey;
use fieldgap_acoustics::{Array, Medium, Simulator, Vec3, delays_s};
use fieldgap_input::{Frequency, SoundSpeed, literal};
use fieldgap_records::{ArraySection, FocusSection, Layout, MediumSection, Rims, ScanSetup};
use fieldgap_virtual_rig::drive::Drive;

/// The carrier, Hz.
pub(super) const FREQUENCY_HZ: f64 = 40e3;
/// The assumed speed of sound, m/s.
pub(super) const SPEED_M_S: f64 = 343.0;

/// The noise of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseOfReadings {
    /// Relative standard deviation of the level.
    pub multiplicative: f64,
    /// Standard deviation of each quadrature that adds to it, V.
    pub additive_v: f64,
}

impl NoiseOfReadings {
    /// Standard deviation of a reading at a level, V.
    pub fn at_v(self, level_v: f64) -> f64 {
        (self.multiplicative * level_v).hypot(self.additive_v)
    }
}

/// The assumed set-up.
#[derive(Debug, Clone)]
pub(super) struct Laboratory {
    /// The array's section of `scan.toml`.
    pub array: ArraySection,
    /// The foci, mm.
    pub foci_mm: Vec<Vec3>,
    /// The robot's path.
    pub survey: Survey,
    /// The largest expected reading, V. It states the gain from pressure to reading.
    pub peak_v: f64,
    /// Relative standard deviation of each reading's level.
    pub multiplicative: f64,
    /// Standard deviation of each quadrature of the noise that adds, over the peak.
    pub additive_over_peak: f64,
}

impl Laboratory {
    /// Draws a laboratory.
    pub fn draw(random: &mut RandomSequence) -> Self {
        let array = if random.chance(0.5) { square() } else { hexagon() };
        let mut foci_mm = vec![if random.chance(0.5) {
            Vec3::new(17.5, -22.5, 100.0)
        } else {
            let mut within = |low: f64, high: f64| tenths_of_micrometre(random.uniform(low, high));
            Vec3::new(within(-20.0, 20.0), within(-20.0, 20.0), within(80.0, 120.0))
        }];
        if random.chance(1.0 / 3.0) {
            let mut within = |low: f64, high: f64| tenths_of_micrometre(random.uniform(low, high));
            foci_mm.push(Vec3::new(within(-20.0, 20.0), within(-20.0, 20.0), 130.0));
        }
        let survey = Survey::new(foci_mm.len(), random);
        Self {
            array,
            foci_mm,
            survey,
            peak_v: random.log_uniform(0.3, 4.0),
            multiplicative: random.uniform(0.012, 0.03),
            additive_over_peak: random.uniform(0.002, 0.008),
        }
    }

    /// The assumed elements.
    pub fn elements(&self) -> &Array {
        self.array.array()
    }

    /// The assumed air.
    pub fn medium(&self) -> Medium {
        Medium { speed_of_sound_m_s: SPEED_M_S }
    }

    /// The drive for each focus, with delays of full precision.
    pub fn drives(&self) -> Vec<Drive> {
        self.foci_mm
            .iter()
            .map(|focus_mm| {
                let excitation = FocusSection::Point(*focus_mm).excitation();
                let delays_s = delays_s(&excitation, self.elements(), &self.medium(), FREQUENCY_HZ);
                let delays_s = delays_s.into_iter().map(Some).collect();
                Drive { emitting: true, delays_s, ..Drive::silent(self.elements().len()) }
            })
            .collect()
    }

    /// The noise of its readings.
    pub fn noise(&self) -> NoiseOfReadings {
        NoiseOfReadings {
            multiplicative: self.multiplicative,
            additive_v: self.additive_over_peak * self.peak_v,
        }
    }

    /// The scan's set-up. Its date is the same for all scans, so it reveals nothing.
    pub fn setup(&self, name: &str) -> ScanSetup {
        ScanSetup {
            name: name.to_owned(),
            recorded: jiff::Timestamp::UNIX_EPOCH,
            unit: "V".to_owned(),
            array: self.array.clone(),
            medium: MediumSection::SpeedOfSound(SoundSpeed::new(SPEED_M_S).expect("that of air")),
            receiver: None,
            phase: None,
            simulator: Simulator::Piston,
            foci: self.foci_mm.iter().copied().map(FocusSection::Point).collect(),
        }
    }
}

fn square() -> ArraySection {
    let six = NonZeroU32::new(6).expect("six is not zero");
    built(Layout::Square { columns: six, rows: six, rims: rims() })
}

fn hexagon() -> ArraySection {
    built(Layout::Hexagonal { rings: 3, rims: rims() })
}

fn rims() -> Rims {
    Rims { diameter_mm: literal(10.5), spacing_mm: literal(0.0) }
}

fn built(layout: Layout) -> ArraySection {
    ArraySection::of_layout(Frequency::new(FREQUENCY_HZ).expect("ultrasound"), layout)
        .expect("both lattices have elements")
}

fn tenths_of_micrometre(mm: f64) -> f64 {
    (mm * 1e4).round() / 1e4
}
