//! A straight line through the centres of the crosses.

use serde::Serialize;

use super::cross::Cross;

/// A value with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Inclination of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Slope {
    /// dx/dz.
    pub x: Estimate,
    /// dy/dz.
    pub y: Estimate,
}

/// The beam axis in the array frame of the rig file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeamAxis {
    /// The crosses, in order of height.
    pub crosses: Vec<Cross>,
    /// x at the array face (z = 0), m.
    pub x_m: Estimate,
    /// y at the array face (z = 0), m.
    pub y_m: Estimate,
    /// Its inclination; `None` from one height.
    pub slope: Option<Slope>,
}

impl BeamAxis {
    /// The straight line through the centres of crosses, weighted by their standard errors. From a single height it is
    /// parallel to z.
    ///
    /// # Panics
    /// If there is no cross.
    pub fn through(crosses: Vec<Cross>) -> Self {
        let axis = |centre: fn(&Cross) -> Estimate| -> (Estimate, Option<Estimate>) {
            straight_line(
                &crosses.iter().map(|cross| (cross.z_m, centre(cross))).collect::<Vec<_>>(),
            )
        };
        let (x_m, x) = axis(|cross| cross.x_m);
        let (y_m, y) = axis(|cross| cross.y_m);
        let slope = x.zip(y).map(|(x, y)| Slope { x, y });
        Self { crosses, x_m, y_m, slope }
    }
}

/// Value at zero and slope of the straight line through values at heights (m), by weighted least squares. If the values
/// scatter more than their errors, the errors are scaled up by the scatter.
fn straight_line(figures: &[(f64, Estimate)]) -> (Estimate, Option<Estimate>) {
    let weight = |figure: &Estimate| figure.error.max(f64::MIN_POSITIVE.sqrt()).powi(-2);
    let sum = |term: &dyn Fn(f64, &Estimate) -> f64| -> f64 {
        figures.iter().map(|(z_m, figure)| weight(figure) * term(*z_m, figure)).sum()
    };
    let weights = sum(&|_, _| 1.0);
    let (mean_z_m, mean) = (sum(&|z_m, _| z_m) / weights, sum(&|_, figure| figure.value) / weights);
    let spread = sum(&|z_m, _| (z_m - mean_z_m).powi(2));
    if figures.len() < 2 || spread == 0.0 {
        return (Estimate { value: mean, error: weights.powf(-0.5) }, None);
    }
    let slope = sum(&|z_m, figure| (z_m - mean_z_m) * (figure.value - mean)) / spread;
    let at_zero = mean - slope * mean_z_m;
    let cost = sum(&|z_m, figure| (figure.value - at_zero - slope * z_m).powi(2));
    let freedom = figures.len() - 2;
    let scatter = if freedom > 0 { (cost / freedom as f64).sqrt().max(1.0) } else { 1.0 };
    let at_zero_error = (1.0 / weights + mean_z_m.powi(2) / spread).sqrt() * scatter;
    (
        Estimate { value: at_zero, error: at_zero_error },
        Some(Estimate { value: slope, error: spread.powf(-0.5) * scatter }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(values: &[(f64, f64)], error: f64) -> Vec<(f64, Estimate)> {
        values.iter().map(|&(z_m, value)| (z_m, Estimate { value, error })).collect()
    }

    #[test]
    fn points_on_a_line_give_the_line_with_textbook_errors() {
        let (at_zero, slope) = straight_line(&figures(&[(0.1, 2.1), (0.2, 2.2), (0.3, 2.3)], 0.05));
        let slope = slope.expect("three heights");
        assert!((at_zero.value - 2.0).abs() < 1e-12 && (slope.value - 1.0).abs() < 1e-12);
        // Σ(z - 0.2)² = 0.02; at zero: σ √(1/3 + 0.2²/0.02).
        assert!((slope.error - 0.05 / 0.02f64.sqrt()).abs() < 1e-12);
        assert!((at_zero.error - 0.05 * (1.0 / 3.0 + 2.0f64).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn one_height_gives_an_axis_parallel_to_z() {
        let (at_zero, slope) = straight_line(&figures(&[(0.1, 2.0)], 0.3));
        assert_eq!((at_zero.value, slope), (2.0, None));
        assert!((at_zero.error - 0.3).abs() < 1e-12);
    }

    #[test]
    fn scatter_beyond_the_errors_scales_them_up() {
        let bent = [(0.1, 0.0), (0.2, 1.0), (0.3, 0.0), (0.4, 1.0)];
        let (_, tight) = straight_line(&figures(&bent, 0.01));
        let (_, loose) = straight_line(&figures(&bent, 1.0));
        assert!(tight.expect("a slope").error > 1.0);
        assert!((loose.expect("a slope").error - 1.0 / 0.05f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn zero_errors_are_accepted() {
        let (at_zero, slope) = straight_line(&figures(&[(0.1, 1.0), (0.2, 1.0)], 0.0));
        assert!(at_zero.value.is_finite() && slope.is_some_and(|slope| slope.value.is_finite()));
    }
}
