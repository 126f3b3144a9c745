//! A laboratory as it is assumed to be: array, drives, air, and the unit and noise of its readings; and the world behind it.

use std::collections::BTreeMap;
use std::num::NonZeroU32;

use super::parameters::Parameters;
use super::random_sequence::RandomSequence;
use super::reception::Reception;
use super::survey::Survey;
use fieldgap_acoustics::{Array, Medium, Simulator, Vec3, delays_s};
use fieldgap_input::{Frequency, NonNegative, SoundSpeed, literal};
use fieldgap_records::{
    ArraySection, FocusSection, Layout, MediumSection, PhaseReference, PhaseSection, Rims,
    ScanSetup, SetupUncertainty,
};
use fieldgap_virtual_rig::drive::Drive;
use fieldgap_virtual_rig::truth::TrueSource;

/// The carrier, Hz.
pub(super) const FREQUENCY_HZ: f64 = 40e3;
/// The assumed speed of sound of the bench, m/s.
const SPEED_M_S: f64 = 343.0;

/// The noise of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseOfReadings {
    /// Relative standard deviation of the level.
    pub multiplicative: f64,
    /// Standard deviation of each quadrature that adds to it, V.
    pub additive_v: f64,
    /// Standard deviation of the phase, rad, where it is measured.
    pub phase_rad: Option<f64>,
}

impl NoiseOfReadings {
    /// Standard deviation of a reading at a level, V.
    pub fn at_v(self, level_v: f64) -> f64 {
        (self.multiplicative * level_v).hypot(self.additive_v)
    }

    /// Standard deviation across the phasor of a reading at a level, V: of its phase times the level. `None` where the phase is not
    /// measured.
    pub fn across_v(self, level_v: f64) -> Option<f64> {
        Some((self.phase_rad? * level_v).hypot(self.additive_v))
    }
}

/// The assumed set-up, and what the world behind it has beside the causes.
#[derive(Debug, Clone)]
pub(super) struct Laboratory {
    /// The array's section of `scan.toml`.
    pub array: ArraySection,
    /// Its drives.
    pub foci: Vec<FocusSection>,
    /// The assumed speed of sound, m/s.
    pub speed_m_s: f64,
    /// The simulator that the record names.
    pub simulator: Simulator,
    /// How the elements truly radiate.
    pub source: TrueSource,
    /// The robot's path.
    pub survey: Survey,
    /// The largest expected reading, V. It states the gain from pressure to reading.
    pub peak_v: f64,
    /// Relative standard deviation of each reading's level.
    pub multiplicative: f64,
    /// Standard deviation of each quadrature of the noise that adds, over the peak.
    pub additive_over_peak: f64,
    /// What befalls readings beside that noise.
    pub reception: Reception,
    /// Effects that every real set-up has, by their ids. They are no causes.
    pub imperfections: Vec<(&'static str, Parameters)>,
    /// How large it states that these are.
    pub uncertainty: Option<SetupUncertainty>,
    /// The class of the laboratory on each axis by which scores are divided; none for the bench.
    pub strata: BTreeMap<String, String>,
}

impl Laboratory {
    /// Draws the bench: one array of two, four planes, amplitudes with Gaussian noise, and no imperfection.
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
            foci: foci_mm.into_iter().map(FocusSection::Point).collect(),
            speed_m_s: SPEED_M_S,
            simulator: Simulator::Piston,
            source: TrueSource::default(),
            survey,
            peak_v: random.log_uniform(0.3, 4.0),
            multiplicative: random.uniform(0.012, 0.03),
            additive_over_peak: random.uniform(0.002, 0.008),
            reception: Reception::default(),
            imperfections: Vec::new(),
            uncertainty: None,
            strata: BTreeMap::new(),
        }
    }

    /// The assumed elements.
    pub fn elements(&self) -> &Array {
        self.array.array()
    }

    /// The assumed air.
    pub fn medium(&self) -> Medium {
        Medium { speed_of_sound_m_s: self.speed_m_s }
    }

    /// The speed of sound without any cause, m/s: the assumed one, unless the room's temperature is read a little wrong.
    pub fn true_speed_m_s(&self) -> f64 {
        let stated = self.imperfections.iter().find(|(id, _)| *id == "sound-speed");
        let speed = stated.and_then(|(_, parameters)| parameters.get("c_m_s")?.as_float());
        speed.unwrap_or(self.speed_m_s)
    }

    /// Where the drives focus, mm; nothing for a drive of given phases.
    pub fn foci_mm(&self) -> Vec<Vec3> {
        let point = |focus: &FocusSection| match focus {
            FocusSection::Point(at_mm) => Some(*at_mm),
            _ => None,
        };
        self.foci.iter().filter_map(point).collect()
    }

    /// The drive for each focus, with delays of full precision.
    pub fn drives(&self) -> Vec<Drive> {
        self.foci
            .iter()
            .map(|focus| {
                let excitation = focus.excitation();
                let delays_s = delays_s(&excitation, self.elements(), &self.medium(), FREQUENCY_HZ);
                let delays_s = delays_s.into_iter().map(Some).collect();
                Drive { emitting: true, delays_s, ..Drive::silent(self.elements().len()) }
            })
            .collect()
    }

    /// The noise of its readings. The slow part counts as noise of each.
    pub fn noise(&self) -> NoiseOfReadings {
        NoiseOfReadings {
            multiplicative: self.multiplicative.hypot(self.reception.slow),
            additive_v: self.additive_over_peak * self.peak_v,
            phase_rad: self.reception.phase.map(|phase| phase.noise_rad),
        }
    }

    /// The scan's set-up. Its date is the same for all scans, so it reveals nothing.
    pub fn setup(&self, name: &str) -> ScanSetup {
        let medium = SoundSpeed::new(self.speed_m_s).expect("that of air");
        let phase = self.reception.phase.map(|phase| PhaseSection {
            reference: PhaseReference::DriveSync,
            convention: phase.convention,
            // The standard uncertainty that a careful laboratory states: of the size of the drift.
            drift_u_rad: NonNegative::new(hundredths(phase.drift_rad.abs()).max(0.05)).ok(),
        });
        ScanSetup {
            name: name.to_owned(),
            recorded: jiff::Timestamp::UNIX_EPOCH,
            unit: "V".to_owned(),
            array: self.array.clone(),
            medium: MediumSection::SpeedOfSound(medium),
            receiver: None,
            phase,
            uncertainty: self.uncertainty,
            simulator: self.simulator,
            foci: self.foci.clone(),
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

/// A length in mm with four decimals.
pub(super) fn tenths_of_micrometre(mm: f64) -> f64 {
    (mm * 1e4).round() / 1e4
}

fn hundredths(value: f64) -> f64 {
    (value * 100.0).ceil() / 100.0
}
