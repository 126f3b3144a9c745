//! The distance of a peak from a point.

use fieldgap_comparison::Uncertain;

/// Distance in x and y from a point to a peak, all metres, with the standard error from the peak's position.
pub(super) fn peak_distance_m(peak_m: [Uncertain; 2], (x_m, y_m): (f64, f64)) -> Uncertain {
    let (dx, dy) = (peak_m[0].value - x_m, peak_m[1].value - y_m);
    let [error_x, error_y] = peak_m.map(|along| along.standard_error);
    let value = dx.hypot(dy);
    let standard_error = if value > 0.0 {
        (dx / value * error_x).hypot(dy / value * error_y)
    } else {
        // The distance has no direction; the larger error is the safe one.
        error_x.max(error_y)
    };
    Uncertain { value, standard_error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_error_along_the_distance_counts() {
        let at = |x, y| {
            [(x, 0.3), (y, 0.4)].map(|(value, standard_error)| Uncertain { value, standard_error })
        };
        assert_eq!(
            peak_distance_m(at(5.0, 1.0), (2.0, 1.0)),
            Uncertain { value: 3.0, standard_error: 0.3 }
        );
        assert_eq!(
            peak_distance_m(at(5.0, 1.0), (5.0, 3.0)),
            Uncertain { value: 2.0, standard_error: 0.4 }
        );
        assert_eq!(
            peak_distance_m(at(5.0, 1.0), (5.0, 1.0)),
            Uncertain { value: 0.0, standard_error: 0.4 }
        );
        let slanted = peak_distance_m(at(3.0, 4.0), (0.0, 0.0));
        assert!(
            (slanted.value - 5.0).abs() < 1e-12
                && (slanted.standard_error - 0.18f64.hypot(0.32)).abs() < 1e-12
        );
    }
}
