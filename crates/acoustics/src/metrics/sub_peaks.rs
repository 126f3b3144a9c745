//! Local maxima other than the peak.

use super::PlaneMap;

/// Columns and rows of the local maxima without the peak that reach `threshold` times the largest value; the largest first.
///
/// A local maximum is a connected set of equal values (eight neighbours) with only lower values around it, as `imregionalmax` defines
/// it in the thesis's listing. A plateau counts once. The peak is the first of the largest.
pub fn sub_peaks(map: &PlaneMap, threshold: f64) -> Vec<(usize, usize)> {
    let Some((_, _, largest)) = map.largest() else { return Vec::new() };
    let (columns, rows) = (map.x_m().len(), map.y_m().len());
    let mut seen = vec![false; columns * rows];
    let mut maxima: Vec<(f64, usize, usize)> = Vec::new();
    for column in 0..columns {
        for row in 0..rows {
            let Some(value) = map.at(column, row) else { continue };
            if seen[row * columns + column] || value < threshold * largest {
                continue;
            }
            if is_regional_maximum(map, (column, row), value, &mut seen) {
                maxima.push((value, column, row));
            }
        }
    }
    maxima.sort_by(|a, b| b.0.total_cmp(&a.0));
    maxima.into_iter().skip(1).map(|(_, column, row)| (column, row)).collect()
}

/// Whether the plateau that contains `start` has only lower values around it; marks its points as seen.
fn is_regional_maximum(
    map: &PlaneMap,
    start: (usize, usize),
    value: f64,
    seen: &mut [bool],
) -> bool {
    let columns = map.x_m().len();
    let mut maximum = true;
    let mut plateau = vec![start];
    seen[start.1 * columns + start.0] = true;
    while let Some((column, row)) = plateau.pop() {
        for near_column in column.saturating_sub(1)..=column + 1 {
            for near_row in row.saturating_sub(1)..=row + 1 {
                let Some(near) = map.at(near_column, near_row) else { continue };
                if near > value {
                    maximum = false;
                } else if near == value && !seen[near_row * columns + near_column] {
                    seen[near_row * columns + near_column] = true;
                    plateau.push((near_column, near_row));
                }
            }
        }
    }
    maximum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(columns: usize, values: &[f64]) -> PlaneMap {
        let along = |count: usize| (0..count).map(|i| i as f64).collect();
        PlaneMap::new(along(columns), along(values.len() / columns), values.to_vec())
            .expect("a map")
    }

    #[test]
    fn separate_hills_above_the_threshold_count() {
        let hills = map(5, &[9.0, 1.0, 4.4, 1.0, 5.0]);
        assert_eq!(sub_peaks(&hills, 0.5), [(4, 0)]);
        assert_eq!(sub_peaks(&hills, 0.4), [(4, 0), (2, 0)]);
    }

    #[test]
    fn a_plateau_counts_once_and_only_if_nothing_beside_it_is_higher() {
        let plateau = map(4, &[5.0, 5.0, 1.0, 8.0, 5.0, 5.0, 1.0, 1.0]);
        assert_eq!(sub_peaks(&plateau, 0.5).len(), 1);
        let shoulder = map(4, &[1.0, 5.0, 5.0, 8.0]);
        assert!(sub_peaks(&shoulder, 0.5).is_empty());
    }

    #[test]
    fn diagonal_neighbours_belong_together() {
        assert!(sub_peaks(&map(2, &[9.0, 1.0, 1.0, 8.0]), 0.5).is_empty());
    }
}
