//! What is a little wrong in every careful set-up. It is no cause, and gaps of causes are counted from it.

use super::super::catalogue::Sizes;
use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use fieldgap_input::{OutOfRange, literal};
use fieldgap_records::{PossibleReflection, SetupUncertainty};

/// Relative spread of the elements' gains: what makers state for one type of transducer.
const GAIN_SPREAD: (f64, f64) = (0.05, 0.10);
/// Spread of their phases, rad: 5 to 10 degrees.
const PHASE_SPREAD_RAD: (f64, f64) = (0.087, 0.175);
/// Error of the origin along each axis, mm: set with a ruler or a pin.
const OFFSET_MM: (f64, f64) = (0.3, 1.0);
/// Drift of the level over the scan, relative.
const DRIFT: (f64, f64) = (0.003, 0.007);
/// Error of the air's temperature, K: a room's thermometer, some metres away.
const TEMPERATURE_K: (f64, f64) = (0.2, 1.0);
/// Reflection of the ceiling or of the robot's head, of pressure.
const REFLECTION: (f64, f64) = (0.01, 0.03);

/// Draws the imperfections of a laboratory, which states how large they usually are. Effects that are causes there, by their ids, are left out: the
/// cause takes the place.
pub(in super::super) fn make_imperfect(
    laboratory: &mut Laboratory,
    causes: &[&'static str],
    random: &mut RandomSequence,
) {
    let mut of = |(low, high): (f64, f64)| random.uniform(low, high);
    let (gain, phase_rad) = (of(GAIN_SPREAD), of(PHASE_SPREAD_RAD));
    let (drift, reflection) = (of(DRIFT), of(REFLECTION));
    let mut offset_mm = || random.sign() * random.uniform(OFFSET_MM.0, OFFSET_MM.1);
    let [x_mm, y_mm, z_mm] = [offset_mm(), offset_mm(), offset_mm()];
    let drift = random.sign() * drift;
    let (sin, cos) = random.angle_rad().sin_cos();
    let top_mm = laboratory.survey.corners_mm().1.z;
    let height_mm = top_mm + random.uniform(20.0, 600.0);
    let by_k = random.sign() * random.uniform(TEMPERATURE_K.0, TEMPERATURE_K.1);
    let c_m_s = warmer_m_s(laboratory.speed_m_s, by_k);
    let over_s = laboratory.survey.lasts_s();
    let all: [(&'static str, Parameters); 6] = [
        ("sound-speed", toml::toml! { c_m_s = (c_m_s) }),
        ("element-gain", toml::toml! { spread = (gain) }),
        ("element-phase", toml::toml! { spread_rad = (phase_rad) }),
        (
            "offset",
            toml::toml! {
                x_mm = (x_mm)
                y_mm = (y_mm)
                z_mm = (z_mm)
            },
        ),
        (
            "reflection",
            toml::toml! {
                height_mm = (height_mm)
                coefficient = [(reflection * cos), (reflection * sin)]
            },
        ),
        (
            "gain-drift",
            toml::toml! {
                relative = (drift)
                over_s = (over_s)
            },
        ),
    ];
    laboratory.uncertainty = Some(stated(height_mm));
    laboratory.imperfections = all.into_iter().filter(|(id, _)| !causes.contains(id)).collect();
}

/// What a laboratory states of its imperfections: how large they are in all laboratories, and the height of a plane that reflects, by a tape measure.
fn stated(height_mm: f64) -> SetupUncertainty {
    SetupUncertainty {
        element_gain: Some(hundredths(rms(GAIN_SPREAD))),
        element_phase_rad: Some(hundredths(rms(PHASE_SPREAD_RAD))),
        origin_mm: Some(hundredths(rms(OFFSET_MM))),
        temperature_k: Some(hundredths(rms(TEMPERATURE_K))),
        level_drift: Some(rounded(rms(DRIFT), 1e3)),
        reflection: Some(PossibleReflection {
            height_mm: literal((0.1 * height_mm).round() * 10.0),
            coefficient: hundredths(rms(REFLECTION)),
        }),
    }
}

/// Root mean square of a number that is anywhere from one to another with the same probability.
fn rms((low, high): (f64, f64)) -> f64 {
    ((high.powi(3) - low.powi(3)) / (3.0 * (high - low))).sqrt()
}

fn hundredths<T: TryFrom<f64, Error = OutOfRange>>(value: f64) -> T {
    rounded(value, 1e2)
}

/// To a whole number of parts, of which `parts` are one.
fn rounded<T: TryFrom<f64, Error = OutOfRange>>(value: f64, parts: f64) -> T {
    literal((parts * value).round() / parts)
}

/// The speed of sound in air that is warmer than at the given speed, m/s: c² is proportional to the absolute temperature.
fn warmer_m_s(speed_m_s: f64, by_k: f64) -> f64 {
    let kelvin = 273.15 * (speed_m_s / 331.3).powi(2);
    331.3 * ((kelvin + by_k) / 273.15).sqrt()
}

/// The sizes of a cause of which every set-up has a little: at least twice the most that is ordinary.
pub(in super::super) fn beyond_the_ordinary(id: &str, sizes: Sizes) -> Sizes {
    let ordinary = match id {
        // 1 K is 0.17 % of the sound speed at room temperature.
        "sound-speed" => 0.0017 * TEMPERATURE_K.1,
        "element-gain" => GAIN_SPREAD.1,
        "element-phase" => PHASE_SPREAD_RAD.1,
        // Along all three axes.
        "offset" => 3f64.sqrt() * OFFSET_MM.1,
        "reflection" => REFLECTION.1,
        "gain-drift" => DRIFT.1,
        _ => 0.0,
    };
    match sizes {
        Sizes::Any { largest, at, .. } => Sizes::Any { largest, least: 2.0 * ordinary, at },
        drawn @ Sizes::OneOf(_) => drawn,
    }
}
