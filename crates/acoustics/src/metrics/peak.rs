//! The largest value of a map and its position, refined below the step.

use super::PlaneMap;

/// The peak of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The largest value of the map.
    pub value: f64,
    /// Its column, metres.
    pub x_m: f64,
    /// Its row, metres.
    pub y_m: f64,
    /// The value at the vertex of the parabolas through it and its neighbours.
    pub refined_value: f64,
    /// Position of that vertex along x, metres.
    pub refined_x_m: f64,
    /// Position of that vertex along y, metres.
    pub refined_y_m: f64,
    /// Whether the largest value is on the map's edge or beside unmeasured points. The field's peak may then lie outside, and the
    /// position is not refined in that direction.
    pub at_edge: bool,
}

/// Finds the peak: the largest value, refined by a parabola along x and one along y through it and its neighbours.
///
/// `None` if nothing was measured.
pub fn peak(map: &PlaneMap) -> Option<Peak> {
    let (column, row, value) = map.largest()?;
    let beside = |index: usize, at: &dyn Fn(usize) -> Option<f64>| {
        Some((at(index.checked_sub(1)?)?, at(index + 1)?))
    };
    let along_x = beside(column, &|column| map.at(column, row))
        .map(|(before, after)| vertex(map.x_m(), column, [before, value, after]));
    let along_y = beside(row, &|row| map.at(column, row))
        .map(|(before, after)| vertex(map.y_m(), row, [before, value, after]));
    let (x_m, y_m) = (map.x_m()[column], map.y_m()[row]);
    let (refined_x_m, rise_x) = along_x.unwrap_or((x_m, 0.0));
    let (refined_y_m, rise_y) = along_y.unwrap_or((y_m, 0.0));
    Some(Peak {
        value,
        x_m,
        y_m,
        refined_value: value + rise_x + rise_y,
        refined_x_m,
        refined_y_m,
        at_edge: along_x.is_none() || along_y.is_none(),
    })
}

/// Position of the vertex of the parabola through three neighbours, and its rise above the middle one, which is the
/// largest of the three.
fn vertex(along_m: &[f64], index: usize, [before, middle, after]: [f64; 3]) -> (f64, f64) {
    let at_m = along_m[index];
    let (left_m, right_m) = (at_m - along_m[index - 1], along_m[index + 1] - at_m);
    let (left, right) = (before - middle, after - middle);
    // middle + slope s + curve s², through (-left_m, before) and (right_m, after).
    let curve = (left / left_m + right / right_m) / (left_m + right_m);
    let slope = right / right_m - curve * right_m;
    if curve < 0.0 {
        let step_m = -slope / (2.0 * curve);
        (at_m + step_m, slope * step_m / 2.0)
    } else {
        (at_m, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_paraboloid_gives_its_vertex(x0 in -3.0..3.0f64, y0 in -3.0..3.0f64, a in 0.1..2.0f64, b in 0.1..2.0f64) {
            let along: Vec<f64> = (-5..=5).map(f64::from).collect();
            let values = along.iter().flat_map(|y| along.iter().map(move |x| {
                100.0 - a * (x - x0).powi(2) - b * (y - y0).powi(2)
            })).collect();
            let peak = peak(&PlaneMap::new(along.clone(), along, values).expect("a map")).expect("measured");
            prop_assert!((peak.refined_x_m - x0).abs() < 1e-9 && (peak.refined_y_m - y0).abs() < 1e-9);
            prop_assert!((peak.refined_value - 100.0).abs() < 1e-9);
            prop_assert!(!peak.at_edge && peak.value <= peak.refined_value);
        }
    }

    #[test]
    fn a_peak_at_the_edge_says_so_and_stays_on_the_map() {
        let map =
            PlaneMap::new(vec![0.0, 1.0, 2.0], vec![0.0], vec![1.0, 2.0, 3.0]).expect("a map");
        let peak = peak(&map).expect("measured");
        assert!(peak.at_edge);
        assert_eq!((peak.refined_x_m, peak.refined_value), (2.0, 3.0));
    }

    #[test]
    fn nothing_measured_has_no_peak() {
        let map = PlaneMap::new(vec![0.0], vec![0.0], vec![f64::NAN]).expect("a map");
        assert_eq!(peak(&map), None);
    }
}
