//! The figures of a field at one height, with their uncertainties.
//!
//! Scan and simulation go through the same rules on the same points. The uncertainties of the scan's figures are
//! found by adding its noise to it again, many times from a fixed seed, and looking how each figure scatters: one way
//! for a peak's height, its place and a radius alike. Those of the simulation follow from the registration's.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::comparison::{Discrepancy, FieldFigures, FocalRadiusFigure, Noise, Uncertain};
use super::registration::Registration;
use fieldgap_acoustics::Vec3;
use fieldgap_acoustics::metrics::{
    Convention, PlaneMap, THESIS_THRESHOLD, focal_radius, peak, sub_peaks,
};

/// How often noise is added again: their spread is known to 1/√(2·64), 9 %.
const REPLICAS: usize = 64;

/// Any number; the same, so that the same scan gives the same report.
const SEED: u64 = 20;

impl FieldFigures {
    /// The figures of a map, without uncertainty; `None` if nothing was measured.
    fn plain(map: &PlaneMap) -> Option<Self> {
        let exact = |value| Uncertain { value, standard_error: 0.0 };
        let peak = peak(map)?;
        let radius = focal_radius(map, THESIS_THRESHOLD, Convention::Corrected)?;
        Some(Self {
            peak: exact(peak.refined_value),
            peak_position_m: [exact(peak.refined_x_m), exact(peak.refined_y_m)],
            peak_at_edge: peak.at_edge,
            focal_radius: Some(FocalRadiusFigure {
                radius_m: radius.radius_m.map(exact),
                sides_m: radius.half_widths_m,
            }),
            sub_peaks: Some(sub_peaks(map, THESIS_THRESHOLD).len()),
        })
    }

    /// The figures of a scanned map; `None` if nothing was measured.
    pub fn of_scan(map: &PlaneMap, noise: &Noise) -> Option<Self> {
        let mut figures = Self::plain(map)?;
        let mut draws = ChaCha8Rng::seed_from_u64(SEED);
        let replicas: Vec<Self> = (0..REPLICAS)
            .filter_map(|_| {
                let noisy = map
                    .values()
                    .iter()
                    .map(|value| {
                        let draw: f64 = StandardNormal.sample(&mut draws);
                        value + noise.at(*value) * draw
                    })
                    .collect();
                let noisy = PlaneMap::new(map.x_m().to_vec(), map.y_m().to_vec(), noisy);
                Self::plain(&noisy.expect("the grid of a map"))
            })
            .collect();
        let scatter = |of: &dyn Fn(&Self) -> Option<f64>, about: f64| {
            let squares: Vec<f64> =
                replicas.iter().filter_map(of).map(|value| (value - about).powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        figures.peak.standard_error = scatter(&|f| Some(f.peak.value), figures.peak.value);
        for axis in 0..2 {
            let position = &mut figures.peak_position_m[axis];
            position.standard_error =
                scatter(&|f| Some(f.peak_position_m[axis].value), position.value);
        }
        if let Some(radius) = figures.focal_radius.as_mut().and_then(|f| f.radius_m.as_mut()) {
            let of = |f: &Self| Some(f.focal_radius.as_ref()?.radius_m?.value);
            radius.standard_error = scatter(&of, radius.value);
        }
        Some(figures)
    }

    /// The figures of a simulated map in the scan's coordinates and unit; `None` if no point counts.
    pub fn of_simulation(map: &PlaneMap, registration: &Registration) -> Option<Self> {
        let mut figures = Self::plain(map)?;
        figures.add_registration_errors(registration);
        Some(figures)
    }

    /// The largest of scattered readings, where there is no map to refine it on.
    pub fn of_scattered(positions_m: &[Vec3], values: &[f64], error: impl Fn(f64) -> f64) -> Self {
        let largest = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
        let unknown = |value| Uncertain { value, standard_error: f64::NAN };
        let (value, at) =
            largest.map_or((f64::NAN, Vec3::repeat(f64::NAN)), |i| (values[i], positions_m[i]));
        Self {
            peak: Uncertain { value, standard_error: error(value) },
            peak_position_m: [unknown(at.x), unknown(at.y)],
            peak_at_edge: false,
            focal_radius: None,
            sub_peaks: None,
        }
    }

    fn add_registration_errors(&mut self, registration: &Registration) {
        let gain = registration.gain;
        self.peak.standard_error = self.peak.value * gain.standard_error / gain.value.abs();
        let stretch = registration.step_ratio.standard_error / registration.step_ratio.value;
        let turn = registration.turn_rad.standard_error;
        let at = self.peak_position_m.map(|position| position.value);
        for axis in 0..2 {
            let shift = registration.shift_m[axis].standard_error;
            self.peak_position_m[axis].standard_error =
                shift.hypot(stretch * at[axis]).hypot(turn * at[1 - axis]);
        }
        if let Some(radius) = self.focal_radius.as_mut().and_then(|f| f.radius_m.as_mut()) {
            radius.standard_error = stretch * radius.value;
        }
    }
}

impl Discrepancy {
    /// How the scan's figures differ from the simulation's.
    pub fn between(scan: &FieldFigures, simulation: &FieldFigures) -> Self {
        let ratio = scan.peak.value / simulation.peak.value;
        let relative = |u: &Uncertain| u.standard_error / u.value;
        let shift = [0, 1].map(|axis| {
            let (s, m) = (scan.peak_position_m[axis], simulation.peak_position_m[axis]);
            Uncertain {
                value: s.value - m.value,
                standard_error: s.standard_error.hypot(m.standard_error),
            }
        });
        let distance = shift[0].value.hypot(shift[1].value);
        let along = |axis: usize| shift[axis].value / distance * shift[axis].standard_error;
        let across = shift[0].standard_error.hypot(shift[1].standard_error);
        let distance_error = if distance > 0.0 { along(0).hypot(along(1)) } else { across };
        Self {
            peak_ratio: Uncertain {
                value: ratio,
                standard_error: ratio * relative(&scan.peak).hypot(relative(&simulation.peak)),
            },
            peak_shift_m: shift,
            peak_distance_m: Uncertain { value: distance, standard_error: distance_error },
            focal_radius_m: radius_difference(scan, simulation),
            sub_peaks: scan
                .sub_peaks
                .zip(simulation.sub_peaks)
                .map(|(scan, simulation)| scan as i64 - simulation as i64),
        }
    }
}

/// Over the sides that neither map's edge cuts off, so that a cut side does not pass for a difference.
fn radius_difference(scan: &FieldFigures, simulation: &FieldFigures) -> Option<Uncertain> {
    let (scan, simulation) = (scan.focal_radius.as_ref()?, simulation.focal_radius.as_ref()?);
    let differences: Vec<f64> = scan
        .sides_m
        .iter()
        .zip(&simulation.sides_m)
        .filter_map(|(scan, simulation)| Some((*scan)? - (*simulation)?))
        .collect();
    let error = scan.radius_m?.standard_error.hypot(simulation.radius_m?.standard_error);
    (!differences.is_empty()).then(|| Uncertain {
        value: differences.iter().sum::<f64>() / differences.len() as f64,
        standard_error: error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoiseSource;

    fn bump(x0: f64, y0: f64) -> PlaneMap {
        let axis: Vec<f64> = (-20..=20).map(|i| f64::from(i) * 1e-3).collect();
        let values = axis
            .iter()
            .flat_map(|y| {
                axis.iter().map(move |x| (-((x - x0).powi(2) + (y - y0).powi(2)) / 72e-6).exp())
            })
            .collect();
        PlaneMap::new(axis.clone(), axis, values).expect("a grid")
    }

    fn noise(additive: f64) -> Noise {
        Noise { additive, multiplicative: 0.0, source: NoiseSource::Repeats }
    }

    /// A parabola through three points of noise s about a top of curvature c errs by about s/(√2 c h).
    #[test]
    fn a_peak_is_uncertain_by_what_noise_does_to_it() {
        let figures = FieldFigures::of_scan(&bump(0.0, 0.0), &noise(0.001)).expect("a map");
        let expected_m = 0.001 / (2f64.sqrt() * (2.0 / 72e-6) * 1e-3);
        let error_m = figures.peak_position_m[0].standard_error;
        assert!((0.7..1.4).contains(&(error_m / expected_m)), "{error_m} {expected_m}");
        assert!(figures.peak_position_m[0].value.abs() < 1e-9);
        let radius = figures.focal_radius.expect("a map").radius_m.expect("inside");
        assert!((radius.value - (72e-6 * 2f64.ln()).sqrt()).abs() < 0.05e-3);
        assert!(radius.standard_error > 0.0 && radius.standard_error < 0.05e-3);
        let exact = FieldFigures::of_scan(&bump(0.3e-3, 0.0), &noise(0.0)).expect("a map");
        assert_eq!(exact.peak.standard_error, 0.0);
    }

    #[test]
    fn a_cut_side_is_no_difference() {
        // The second bump's left side is cut off by the edge; on the other sides both are equally wide.
        let centred = FieldFigures::of_scan(&bump(0.0, 0.0), &noise(0.0)).expect("a map");
        let cut = FieldFigures::of_scan(&bump(-16e-3, 0.0), &noise(0.0)).expect("a map");
        assert!(cut.focal_radius.as_ref().expect("a map").sides_m[1].is_none());
        let discrepancy = Discrepancy::between(&cut, &centred);
        assert!(discrepancy.focal_radius_m.expect("three sides").value.abs() < 1e-9);
        assert!((discrepancy.peak_shift_m[0].value + 16e-3).abs() < 1e-5);
        assert!((discrepancy.peak_distance_m.value - 16e-3).abs() < 1e-5);
    }
}
