//! What differs between the set-ups of two records, and what change the simulation predicts from it.

use serde::Serialize;

use super::{HeightChange, Scaling};
use crate::agreement::best_gain;
use fieldgap_acoustics::Vec3;
use fieldgap_records::RecordedScan;

/// Something that differs between the set-ups.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Condition {
    /// What it is.
    pub what: &'static str,
    /// In the first record.
    pub a: String,
    /// In the second record.
    pub b: String,
}

/// Everything that differs between two set-ups, the time first.
pub(super) fn conditions(a: &RecordedScan, b: &RecordedScan) -> Vec<Condition> {
    let of = |scan: &RecordedScan| {
        let (setup, array) = (&scan.setup, scan.setup.array.array());
        [
            ("recorded", setup.recorded.to_string()),
            ("unit", setup.unit.clone()),
            ("speed of sound", format!("{:.2} m/s", setup.medium.medium().speed_of_sound_m_s)),
            ("frequency", format!("{} Hz", setup.array.frequency_hz())),
            ("elements", array.elements().len().to_string()),
            ("simulator", setup.simulator.to_string()),
            ("drives", setup.foci.len().to_string()),
        ]
    };
    let mut conditions: Vec<Condition> = of(a)
        .into_iter()
        .zip(of(b))
        .filter(|((_, a), (_, b))| a != b)
        .map(|((what, a), (_, b))| Condition { what, a, b })
        .collect();
    if let Some(apart_m) = elements_apart_m(a, b)
        && apart_m > 0.0
    {
        conditions.push(Condition {
            what: "places of the elements",
            a: "as named".to_owned(),
            b: format!("up to {:.3} mm away", apart_m * 1e3),
        });
    }
    conditions
}

/// The largest distance between elements of one number, m; `None` if their numbers differ.
fn elements_apart_m(a: &RecordedScan, b: &RecordedScan) -> Option<f64> {
    let (a, b) = (a.setup.array.array().elements(), b.setup.array.array().elements());
    let apart = a.iter().zip(b).map(|(a, b)| (a.centre_m - b.centre_m).norm());
    (a.len() == b.len()).then(|| apart.fold(0.0, f64::max))
}

/// The change that the simulator of the first record predicts at each common place; `None` if array and medium are the same.
pub(super) fn predicted(
    a: &RecordedScan,
    b: &RecordedScan,
    scaling: Scaling,
    heights: &[HeightChange],
) -> Option<Vec<f64>> {
    if a.setup.array == b.setup.array && a.setup.medium == b.setup.medium {
        return None;
    }
    let simulator = a.setup.simulator;
    let (mut of_a, mut of_b, mut readings) = (Vec::new(), Vec::new(), Vec::new());
    for height in heights {
        let drive = a.setup.foci.get(height.focus)?;
        let same = b.setup.foci.iter().position(|other| other == drive)?;
        let places: Vec<Vec3> = height.places.iter().map(|place| place.at_m).collect();
        of_a.extend(a.setup.simulation(simulator, height.focus)?.magnitudes(&places));
        of_b.extend(b.setup.simulation(simulator, same)?.magnitudes(&places));
        readings.extend(height.places.iter().map(|place| place.a));
    }
    let level = best_gain(&of_a, &readings);
    // A gain that is taken out of the readings is taken out of the simulation too.
    let scale = if scaling == Scaling::Gain { best_gain(&of_a, &of_b) } else { 1.0 };
    Some(of_a.iter().zip(&of_b).map(|(a, b)| level * (b / scale - a)).collect())
}
