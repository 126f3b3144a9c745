//! A directivity measured angle by angle.

/// Angles closer than this are taken as one angle measured twice, rad (0.1°).
const CLOSEST_RAD: f64 = 1.745e-3;

/// Why a table of angles and pressures is not a directivity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// The numbers of pressures and angles differ, or are below two.
    #[error("{angles} angles and {pressures} pressures; equal numbers are needed, at least two")]
    Lengths {
        /// Angles given.
        angles: usize,
        /// Pressures given.
        pressures: usize,
    },
    /// Angles out of range or order.
    #[error(
        "angle {number}, {angle_deg}°, is not between 0° and 90° and at least 0.1° above the angle before it"
    )]
    Angle {
        /// Which angle, from 1.
        number: usize,
        /// The angle, degrees.
        angle_deg: f64,
    },
    /// A pressure that is not finite.
    #[error("pressure {number} is {pressure}")]
    Pressure {
        /// Which pressure, from 1.
        number: usize,
        /// The pressure.
        pressure: f64,
    },
}

/// Relative pressure as a function of angle, interpolated without overshoot.
///
/// Between two angles the curve is a cubic that is monotone where the table is (F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal.
/// 17, 238 (1980), with the harmonic slopes of Fritsch and Butland). Below the first angle and beyond the last it is constant.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredTable {
    angles_rad: Vec<f64>,
    pressures: Vec<f64>,
    slopes: Vec<f64>,
}

impl MeasuredTable {
    /// Takes angles from the axis, degrees, ascending from 0 to 90, and pressures relative to that on the axis.
    ///
    /// # Errors
    /// [`TableError`] for the first invalid number.
    pub fn new(angles_deg: &[f64], pressures: &[f64]) -> Result<Self, TableError> {
        if angles_deg.len() != pressures.len() || angles_deg.len() < 2 {
            let (angles, pressures) = (angles_deg.len(), pressures.len());
            return Err(TableError::Lengths { angles, pressures });
        }
        let mut least_deg = 0.0;
        for (index, &angle_deg) in angles_deg.iter().enumerate() {
            if !(least_deg..=90.0).contains(&angle_deg) {
                return Err(TableError::Angle { number: index + 1, angle_deg });
            }
            least_deg = angle_deg + CLOSEST_RAD.to_degrees();
        }
        if let Some(index) = pressures.iter().position(|pressure| !pressure.is_finite()) {
            return Err(TableError::Pressure { number: index + 1, pressure: pressures[index] });
        }
        let angles_rad: Vec<f64> = angles_deg.iter().map(|angle| angle.to_radians()).collect();
        let slopes = monotone_slopes(&angles_rad, pressures);
        Ok(Self { angles_rad, pressures: pressures.to_vec(), slopes })
    }

    /// The angles, rad, ascending.
    pub fn angles_rad(&self) -> &[f64] {
        &self.angles_rad
    }

    /// The relative pressures, one for each angle.
    pub fn pressures(&self) -> &[f64] {
        &self.pressures
    }

    /// The relative pressure at an angle from the axis, rad.
    pub fn at(&self, theta_rad: f64) -> f64 {
        let last = self.angles_rad.len() - 1;
        if theta_rad <= self.angles_rad[0] {
            return self.pressures[0];
        }
        if theta_rad >= self.angles_rad[last] {
            return self.pressures[last];
        }
        let right = self.angles_rad.partition_point(|&angle| angle <= theta_rad).clamp(1, last);
        let left = right - 1;
        let width = self.angles_rad[right] - self.angles_rad[left];
        let t = (theta_rad - self.angles_rad[left]) / width;
        let rise = self.pressures[right] - self.pressures[left];
        let (from, to) = (width * self.slopes[left], width * self.slopes[right]);
        // Hermite's cubic in powers of t.
        self.pressures[left]
            + t * (from + t * (3.0 * rise - 2.0 * from - to + t * (from + to - 2.0 * rise)))
    }
}

/// A slope for each point: the harmonic mean of those on both sides, weighted by their distances; zero at an extremum and at both
/// ends, beyond which the curve is constant.
fn monotone_slopes(at: &[f64], values: &[f64]) -> Vec<f64> {
    let mut slopes = vec![0.0; at.len()];
    for n in 1..at.len() - 1 {
        let (before, after) = (at[n] - at[n - 1], at[n + 1] - at[n]);
        let left = (values[n] - values[n - 1]) / before;
        let right = (values[n + 1] - values[n]) / after;
        if left * right > 0.0 {
            let (w1, w2) = (2.0 * after + before, after + 2.0 * before);
            slopes[n] = (w1 + w2) / (w1 / left + w2 / right);
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_table_of_a_piston_gives_the_piston_back() {
        let piston =
            |deg: f64| crate::rayleigh::far_field_directivity(3.3 * deg.to_radians().sin());
        let angles: Vec<f64> = (0..=45).map(|n| 2.0 * f64::from(n)).collect();
        let pressures: Vec<f64> = angles.iter().map(|&deg| piston(deg)).collect();
        let table = MeasuredTable::new(&angles, &pressures).expect("a table");
        for step in 0..900 {
            let deg = 0.1 * f64::from(step);
            assert!((table.at(deg.to_radians()) - piston(deg)).abs() < 4e-4, "{deg}");
        }
    }

    #[test]
    fn an_invalid_table_is_refused_with_the_number_at_fault() {
        let refusal = |angles: &[f64], pressures: &[f64]| {
            MeasuredTable::new(angles, pressures).expect_err("no table").to_string()
        };
        assert!(refusal(&[0.0], &[1.0]).contains("at least two"));
        assert!(refusal(&[0.0, 10.0, 5.0], &[1.0; 3]).starts_with("angle 3, 5°"));
        assert!(refusal(&[0.0, 95.0], &[1.0; 2]).starts_with("angle 2, 95°"));
        assert!(refusal(&[0.0, 10.0], &[1.0, f64::NAN]).starts_with("pressure 2"));
    }

    proptest! {
        #[test]
        fn between_two_angles_nothing_overshoots(
            pressures in prop::collection::vec(-1.0..1.0f64, 2..12), share in 0.0..1.0f64, cell in 0usize..11,
        ) {
            let angles: Vec<f64> = (0..pressures.len()).map(|n| 7.0 * n as f64).collect();
            let table = MeasuredTable::new(&angles, &pressures).expect("a table");
            let left = cell % (pressures.len() - 1);
            let at = table.at((7.0 * (left as f64 + share)).to_radians());
            let (low, high) = (pressures[left].min(pressures[left + 1]), pressures[left].max(pressures[left + 1]));
            prop_assert!((low - 1e-12..=high + 1e-12).contains(&at), "{} {} {}", low, at, high);
        }
    }
}
