//! Samples grouped by drive and height.

use super::sample::RecordedSample;

/// Largest difference between neighbouring heights within one plane, millimetres: twice the allowed position error of a robot.
pub const SAME_HEIGHT_MM: f64 = 0.1;

/// Heights beyond which readings may be scattered rather than in planes, and readings at one height on average below which they then are.
const MOST_HEIGHTS: usize = 24;
const FEWEST_OF_A_PLANE: usize = 4;

/// Depth of the layers in which scattered readings are grouped, millimetres: about the depth of the focus of an array of 6 x 6 elements.
pub const LAYER_MM: f64 = 20.0;

/// Whether readings at so many heights are scattered: they lie in no planes.
pub fn are_scattered(heights: usize, readings: usize) -> bool {
    heights > MOST_HEIGHTS && heights * FEWEST_OF_A_PLANE > readings
}

/// The samples of one focus at one height, in the order of acquisition.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane<'s> {
    /// Number of the focus.
    pub focus: usize,
    /// Mean height of the samples, millimetres, array frame.
    pub z_mm: f64,
    /// The samples; at least one.
    pub samples: Vec<&'s RecordedSample>,
}

/// Groups the samples taken with the array driven: by focus, then by height, ascending.
///
/// Heights belong to one plane if no gap between neighbours is wider than `tolerance_mm`. Scattered samples are grouped in layers of
/// [`LAYER_MM`].
pub fn planes(samples: &[RecordedSample], tolerance_mm: f64) -> Vec<Plane<'_>> {
    let mut driven: Vec<Driven<'_>> = samples
        .iter()
        .enumerate()
        .filter_map(|(row, sample)| Some((sample.focus?, row, sample)))
        .collect();
    driven.sort_by(|(focus_a, _, a), (focus_b, _, b)| {
        focus_a.cmp(focus_b).then(a.position_mm.z.total_cmp(&b.position_mm.z))
    });
    let height = |(focus_a, _, a): &Driven<'_>, (focus_b, _, b): &Driven<'_>| {
        focus_a == focus_b && b.position_mm.z - a.position_mm.z <= tolerance_mm
    };
    let layer = |(focus_a, _, a): &Driven<'_>, (focus_b, _, b): &Driven<'_>| {
        let [a, b] = [a, b].map(|sample| (sample.position_mm.z / LAYER_MM).floor());
        focus_a == focus_b && a == b
    };
    let groups: Vec<&[Driven<'_>]> =
        match are_scattered(driven.chunk_by(height).count(), driven.len()) {
            true => driven.chunk_by(layer).collect(),
            false => driven.chunk_by(height).collect(),
        };
    groups
        .into_iter()
        .map(|same| {
            let mut same = same.to_vec();
            same.sort_by_key(|(_, row, _)| *row);
            let samples: Vec<&RecordedSample> = same.iter().map(|(_, _, sample)| *sample).collect();
            let heights_mm: f64 = samples.iter().map(|sample| sample.position_mm.z).sum();
            Plane { focus: same[0].0, z_mm: heights_mm / samples.len() as f64, samples }
        })
        .collect()
}

/// Focus, row and sample of one taken with the array driven.
type Driven<'s> = (usize, usize, &'s RecordedSample);

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use fieldgap_acoustics::Vec3;

    fn sample(time_s: f64, focus: Option<usize>, z_mm: f64) -> RecordedSample {
        let position_mm = Vec3::new(0.0, 0.0, z_mm);
        RecordedSample { time_s, focus, position_mm, reading: 1.0, phase_rad: None, spread: None }
    }

    #[test]
    fn scattered_samples_are_grouped_in_layers() {
        let samples: Vec<RecordedSample> =
            (0..100).map(|n| sample(0.0, Some(0), 60.0 + 0.8 * f64::from(n))).collect();
        let layers = planes(&samples, SAME_HEIGHT_MM);
        assert_eq!(layers.len(), 4);
        assert!(layers.iter().all(|layer| layer.samples.len() == 25));
        assert!((layers[0].z_mm - 69.6).abs() < 1e-9);
        // A few heights are planes, however few their samples.
        assert_eq!(planes(&samples[..20], SAME_HEIGHT_MM).len(), 20);
    }

    #[test]
    fn planes_are_told_apart_by_focus_and_height_and_keep_the_order_of_their_samples() {
        let samples = [
            sample(0.0, Some(1), 100.0),
            sample(1.0, Some(0), 150.02),
            sample(2.0, None, 100.0),
            sample(3.0, Some(0), 149.98),
            sample(4.0, Some(0), 50.0),
        ];
        let planes = planes(&samples, SAME_HEIGHT_MM);
        let seen: Vec<(usize, f64, Vec<f64>)> = planes
            .iter()
            .map(|plane| {
                (plane.focus, plane.z_mm, plane.samples.iter().map(|s| s.time_s).collect())
            })
            .collect();
        let expected = [(0, 50.0, vec![4.0]), (0, 150.0, vec![1.0, 3.0]), (1, 100.0, vec![0.0])];
        assert_eq!(seen, expected);
    }

    proptest! {
        #[test]
        fn every_driven_sample_is_in_one_plane(
            rows in prop::collection::vec((prop::option::of(0usize..3), 0.0..3.0f64), 0..40),
        ) {
            let samples: Vec<RecordedSample> = rows.iter().enumerate()
                .map(|(row, &(focus, z_mm))| sample(row as f64, focus, z_mm)).collect();
            let planes = planes(&samples, SAME_HEIGHT_MM);
            let mut times: Vec<f64> = planes.iter()
                .flat_map(|plane| plane.samples.iter().map(|sample| sample.time_s)).collect();
            times.sort_by(f64::total_cmp);
            let driven: Vec<f64> =
                samples.iter().filter(|s| s.focus.is_some()).map(|s| s.time_s).collect();
            prop_assert_eq!(times, driven);
            for pair in planes.windows(2).filter(|pair| pair[0].focus == pair[1].focus) {
                prop_assert!(pair[1].z_mm > pair[0].z_mm);
            }
        }
    }
}
