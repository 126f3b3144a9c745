//! The noise of two records of one field.

use crate::comparison::{Noise, NoiseSource};
use crate::noise::Roughness;
use fieldgap_records::{
    MappedPlane, OFF_LINE_MM, Plane, RecordedScan, SAME_HEIGHT_MM, SAME_POINT_MM, plane_map,
};

/// Noise of the first and of the second record, each in its own unit.
///
/// A record with repeats or dark readings tells its own. Else the noise has an upper bound: that of the third differences of its own maps, or,
/// where both records have the same places, of the difference of the two maps. On a coarse grid the field itself has large third differences,
/// and in the difference of the maps it cancels; half of the variance there is that of each record. The smaller bound counts.
pub(super) fn noise_of_both(a: &RecordedScan, b: &RecordedScan) -> (Noise, Noise) {
    let (own_a, own_b) = (noise_of(a), noise_of(b));
    let Some((of_a, of_b)) = noise_of_difference(a, b) else { return (own_a, own_b) };
    (lesser(own_a, of_a, a), lesser(own_b, of_b, b))
}

/// Noise of a record; where it has neither repeats nor dark readings, an upper bound from the third differences of its own maps.
fn noise_of(scan: &RecordedScan) -> Noise {
    let mut roughness = Roughness::default();
    for mapped in scan.planes(SAME_HEIGHT_MM).iter().filter_map(map_of) {
        let nothing = vec![0.0; mapped.map.values().len()];
        roughness.add(mapped.map.values(), &nothing, mapped.map.x_m().len());
    }
    let unknown = Noise { additive: f64::NAN, multiplicative: 0.0, source: NoiseSource::Residual };
    Noise::of(scan, roughness.noise().unwrap_or(unknown))
}

/// The noise that the difference of maps with the same places shows, for each of the two records; `None` where none have the same.
fn noise_of_difference(a: &RecordedScan, b: &RecordedScan) -> Option<(Noise, Noise)> {
    let planes_b = b.planes(SAME_HEIGHT_MM);
    let (mut products, mut squares) = (0.0, 0.0);
    let mut pairs = Vec::new();
    for plane in a.planes(SAME_HEIGHT_MM) {
        let drive = a.setup.foci.get(plane.focus);
        let other = planes_b.iter().find(|other| {
            b.setup.foci.get(other.focus) == drive
                && (other.z_mm - plane.z_mm).abs() <= SAME_POINT_MM
        });
        let maps = other.and_then(|other| Some((map_of(&plane)?, map_of(other)?)));
        let Some((a, b)) = maps.filter(|(a, b)| same_places(a, b)) else { continue };
        for (a, b) in a.map.values().iter().zip(b.map.values()) {
            if a.is_finite() && b.is_finite() {
                products += a * b;
                squares += a * a;
            }
        }
        pairs.push((a, b));
    }
    let gain = (squares > 0.0).then_some(products / squares)?;
    let mut roughness = Roughness::default();
    for (a, b) in &pairs {
        let expected: Vec<f64> = a.map.values().iter().map(|reading| gain * reading).collect();
        roughness.add(b.map.values(), &expected, b.map.x_m().len());
    }
    let both = roughness.noise()?;
    let share = |scale: f64| Noise { additive: both.additive * scale, ..both.clone() };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let of_each = |scale| Noise { multiplicative: both.multiplicative * half, ..share(scale) };
    (gain > 0.0).then(|| (of_each(half / gain), of_each(half)))
}

/// The bound from the difference where a record tells no noise of its own, and that is the smaller one at its mean square reading.
fn lesser(own: Noise, of_difference: Noise, scan: &RecordedScan) -> Noise {
    let driven = scan.samples.iter().filter(|sample| sample.focus.is_some());
    let readings: Vec<f64> = driven.map(|sample| sample.reading).collect();
    let level = crate::agreement::rms(readings.into_iter());
    let smaller = own.at(level).is_nan() || of_difference.at(level) < own.at(level);
    let told = own.source != NoiseSource::Residual;
    if told || !smaller { own } else { of_difference }
}

fn map_of(plane: &Plane<'_>) -> Option<MappedPlane> {
    plane_map(plane, OFF_LINE_MM).ok()
}

fn same_places(a: &MappedPlane, b: &MappedPlane) -> bool {
    let same = |a: &[f64], b: &[f64]| {
        let mut pairs = a.iter().zip(b);
        a.len() == b.len() && pairs.all(|(a, b)| (a - b).abs() * 1e3 <= SAME_POINT_MM)
    };
    same(a.map.x_m(), b.map.x_m()) && same(a.map.y_m(), b.map.y_m())
}
