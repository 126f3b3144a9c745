//! Two records compared after the second was laid on the first.

use super::alignment::{Aligning, Fitted, Layer, Layers, PlaceOfB, Placement, Unaligned, align};
use super::polynomial::Polynomial;
use super::{
    Change, Differing, HeightChange, NoChange, PlaceChange, Scaling, change, extent, figures,
    noise_of_both, owned, same_unit,
};
use crate::comparison::{FieldFigures, Noise, Uncertain};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{
    MappedPlane, OFF_LINE_MM, Plane, RecordedScan, SAME_HEIGHT_MM, SAME_POINT_MM, plane_map,
    visited,
};

/// Compares two records after the second was aligned to the first.
///
/// The places of the difference are those of the second record, in the coordinates of the first, which is interpolated there. Heights are
/// not aligned: nothing is interpolated between them.
///
/// # Errors
/// [`NoChange`].
pub fn aligned_change(
    a: &RecordedScan,
    b: &RecordedScan,
    aligning: Aligning,
    scaling: Scaling,
) -> Result<Change, NoChange> {
    if aligning == Aligning::None {
        return change(a, b, scaling);
    }
    same_unit(a, b, scaling)?;
    let (noise_a, noise_b) = noise_of_both(a, b);
    let planes_b = b.planes(SAME_HEIGHT_MM);
    let planes_a = a.planes(SAME_HEIGHT_MM);
    let pairs: Vec<(&Plane<'_>, &Plane<'_>, MappedPlane)> = planes_a
        .iter()
        .filter_map(|plane| {
            let drive = a.setup.foci.get(plane.focus);
            let other = planes_b.iter().find(|other| {
                b.setup.foci.get(other.focus) == drive
                    && (other.z_mm - plane.z_mm).abs() <= SAME_POINT_MM
            })?;
            Some((plane, other, plane_map(plane, OFF_LINE_MM).ok()?))
        })
        .collect();
    let mut kept = Vec::new();
    let mut layers = Vec::new();
    for (plane, other, mapped) in &pairs {
        if let Some(map) = Polynomial::of(&mapped.map, noise_of_map(plane, &noise_a)) {
            kept.push((*plane, *other, mapped));
            layers.push(Layer { map, places: places_of(other, &noise_b) });
        }
    }
    let wavelength_m = a.setup.medium.medium().wavelength_m(a.setup.array.frequency_hz());
    let layers = Layers { layers, wavelength_m };
    let [name_a, name_b] = [a, b].map(|scan| scan.setup.name.clone());
    let (fitted, mut alignment) = align(&layers, aligning).map_err(|why| match why {
        Unaligned::NoMap => {
            NoChange::NoMap { a: name_a, b: name_b, extent_a: extent(a), extent_b: extent(b) }
        }
        Unaligned::LittleOverlap(share) => NoChange::LittleOverlap { a: name_a, b: name_b, share },
        Unaligned::Unlike(correlation) => NoChange::Unlike { a: name_a, b: name_b, correlation },
    })?;
    if let Ok(as_recorded) = change(a, b, Scaling::Gain) {
        alignment.gap_after_gain = Some(as_recorded.overall.gap);
        let as_read = change(a, b, Scaling::AsRead);
        alignment.gap_as_read = as_read.ok().map(|change| change.overall.gap);
    }
    if alignment.chosen == Aligning::None {
        // The records are comparable where they were taken, without interpolation where their places are the same.
        let mut change = change(a, b, scaling)?;
        alignment.gap_after_alignment = alignment.gap_after_gain.unwrap_or(change.overall.gap);
        change.alignment = Some(alignment);
        return Ok(change);
    }
    let mut left_out = 0;
    let heights: Vec<HeightChange> = kept
        .iter()
        .zip(&layers.layers)
        .map(|((plane, other, mapped), layer)| {
            let places = laid(layer, &fitted, plane.z_mm);
            left_out += layer.places.len() - places.len();
            HeightChange {
                focus: plane.focus,
                z_m: plane.z_mm * 1e-3,
                figures: figures(&[], Uncertain { value: f64::NAN, standard_error: f64::NAN }),
                interpolation_error: Some(layer.map.error()),
                a_figures: FieldFigures::of_scan(&mapped.map, &noise_a),
                b_figures: figures_of_b(other, &noise_b, &fitted.placement),
                places,
            }
        })
        .filter(|height| !height.places.is_empty())
        .collect();
    let noises = [noise_a.clone(), noise_b.clone()];
    let differing = |heights| Differing { a, b, noises: noises.clone(), heights, left_out };
    alignment.gap_after_alignment = differing(heights.clone()).compared(Scaling::Gain)?.overall.gap;
    let mut change = differing(heights).compared(scaling)?;
    change.alignment = Some(alignment);
    Ok(change)
}

/// Noise of a point of a map, which is the mean of its readings.
fn noise_of_map(plane: &Plane<'_>, noise: &Noise) -> Noise {
    let places = visited(&owned(&plane.samples), SAME_POINT_MM).len();
    let less = (places as f64 / plane.samples.len() as f64).sqrt();
    Noise {
        additive: noise.additive * less,
        multiplicative: noise.multiplicative * less,
        source: noise.source,
    }
}

/// The places of a plane in its own coordinates, each read once or more often.
fn places_of(plane: &Plane<'_>, noise: &Noise) -> Vec<PlaceOfB> {
    visited(&owned(&plane.samples), SAME_POINT_MM)
        .iter()
        .map(|point| {
            let reading = point.mean();
            let at_m = point.position_mm * 1e-3;
            PlaceOfB {
                at_m: [at_m.x, at_m.y],
                reading,
                error: noise.at(reading) / (point.samples.len() as f64).sqrt(),
            }
        })
        .collect()
}

/// The common places in the coordinates of A.
fn laid(layer: &Layer<'_>, fitted: &Fitted, z_mm: f64) -> Vec<PlaceChange> {
    layer
        .places
        .iter()
        .filter_map(|place| {
            let [x, y] = fitted.placement.of(place.at_m);
            let a = layer.map.at(x, y)?;
            Some(PlaceChange {
                at_m: Vec3::new(x, y, z_mm * 1e-3),
                a: a.value,
                b: place.reading,
                a_error: a.variance.sqrt(),
                b_error: place.error,
                interpolated: true,
            })
        })
        .collect()
}

/// Peak and focal radius of B, its peak in the coordinates of A.
fn figures_of_b(plane: &Plane<'_>, noise: &Noise, placement: &Placement) -> Option<FieldFigures> {
    let map = plane_map(plane, OFF_LINE_MM).ok()?;
    let mut figures = FieldFigures::of_scan(&map.map, noise)?;
    let at = [0, 1].map(|axis| figures.peak_position_m[axis].value);
    let there = placement.of(at);
    for (axis, value) in there.into_iter().enumerate() {
        figures.peak_position_m[axis].value = value;
    }
    Some(figures)
}
