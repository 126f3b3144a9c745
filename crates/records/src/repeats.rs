//! Points that were measured more than once.

use std::collections::HashMap;

use super::sample::RecordedSample;
use fieldgap_acoustics::Vec3;

/// Largest difference between the reported positions of two visits of one point, millimetres, along each axis.
pub const SAME_POINT_MM: f64 = 0.1;

/// The visits of one point under one drive (or with the array silent), in the order of acquisition.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeat<'s> {
    /// Number of the focus; none if the array was silent.
    pub focus: Option<usize>,
    /// Position of the first visit, millimetres, array frame.
    pub position_mm: Vec3,
    /// The samples; of [`repeats`] at least two.
    pub samples: Vec<&'s RecordedSample>,
}

impl Repeat<'_> {
    /// Mean of the readings.
    pub fn mean(&self) -> f64 {
        self.samples.iter().map(|sample| sample.reading).sum::<f64>() / self.samples.len() as f64
    }
}

/// Finds the points that were measured more than once, in the order of their first visits.
///
/// A sample belongs to the first point under the same drive that is within `tolerance_mm` along each axis.
pub fn repeats(samples: &[RecordedSample], tolerance_mm: f64) -> Vec<Repeat<'_>> {
    let mut points = visited(samples, tolerance_mm);
    points.retain(|point| point.samples.len() > 1);
    points
}

/// All points that were measured, once or more, in the order of their first visits; see [`repeats`].
pub fn visited(samples: &[RecordedSample], tolerance_mm: f64) -> Vec<Repeat<'_>> {
    let mut points: Vec<Repeat<'_>> = Vec::new();
    let mut points_in_cell: HashMap<(Option<usize>, [i64; 3]), Vec<usize>> = HashMap::new();
    for sample in samples {
        // Cells as wide as the tolerance: a point that is near enough is in this cell or a neighbour.
        let cell = sample.position_mm.map(|along| (along / tolerance_mm).floor() as i64);
        let known = touching(cell.into())
            .filter_map(|cell| points_in_cell.get(&(sample.focus, cell)))
            .flatten()
            .copied()
            .filter(|&point| {
                (points[point].position_mm - sample.position_mm).amax() <= tolerance_mm
            })
            .min();
        match known {
            Some(point) => points[point].samples.push(sample),
            None => {
                points_in_cell.entry((sample.focus, cell.into())).or_default().push(points.len());
                points.push(Repeat {
                    focus: sample.focus,
                    position_mm: sample.position_mm,
                    samples: vec![sample],
                });
            }
        }
    }
    points
}

fn touching(cell: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27_i64).map(move |n| {
        let steps = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        [0, 1, 2].map(|axis| cell[axis].saturating_add(steps[axis]))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sample(focus: Option<usize>, x_mm: f64, reading: f64) -> RecordedSample {
        let position_mm = Vec3::new(x_mm, -x_mm, 100.0);
        RecordedSample { time_s: 0.0, focus, position_mm, reading, phase_rad: None, spread: None }
    }

    #[test]
    fn a_point_is_recognised_across_a_cell_edge_but_not_under_another_drive() {
        let samples = [
            sample(Some(0), 0.999, 1.0),
            sample(Some(0), 1.001, 3.0),
            sample(Some(1), 1.0, 9.0),
            sample(None, 1.0, 0.0),
            sample(Some(0), 2.0, 5.0),
        ];
        let repeats = repeats(&samples, 0.1);
        assert_eq!(repeats.len(), 1);
        assert_eq!((repeats[0].focus, repeats[0].samples.len()), (Some(0), 2));
        assert_eq!(repeats[0].mean(), 2.0);
    }

    proptest! {
        #[test]
        fn on_a_grid_repeats_are_the_points_that_occur_twice(at in prop::collection::vec(-4i32..4, 0..20)) {
            let samples: Vec<RecordedSample> =
                at.iter().map(|&step| sample(Some(0), f64::from(step), 1.0)).collect();
            let mut counts = std::collections::BTreeMap::new();
            at.iter().for_each(|step| *counts.entry(step).or_insert(0) += 1);
            let mut found: Vec<usize> =
                repeats(&samples, SAME_POINT_MM).iter().map(|r| r.samples.len()).collect();
            let mut expected: Vec<usize> = counts.into_values().filter(|&n| n > 1).collect();
            found.sort_unstable();
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
