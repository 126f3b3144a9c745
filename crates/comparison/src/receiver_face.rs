//! The receiver's own directivity, as a part of the gain from pressure to reading.
//!
//! A receiver with a face of radius b hears less of what comes from the side, as a piston of that radius radiates less
//! to it. Facing the array it hears each element at the angle at which it left, so emitter and receiver multiply; and
//! to second order in k a sin θ, which is what the width of a lobe depends on, the product of two pistons a and b is
//! one of radius √(a² + b²) (2 J1(x)/x = 1 - x²/8 + ...). Only a simulator whose directivity follows from the radius of its
//! faces can be asked, and only elements that face the receiver.

use super::pose::Pose;
use super::readings::{Drive, Readings};
use super::refine::{Fit, PoseParameter, Search, refine};
use fieldgap_acoustics::{Array, Element, Simulation, Simulator, Vec3, golden_section};

/// Radii that are tried, metres: up to twice the face of a common 40 kHz receiver.
const LARGEST_M: f64 = 10e-3;

/// Readings that the search is made on; the end is refined on all.
const SOME: usize = 1500;

/// The search ends at this width, metres.
const WIDTH_M: f64 = 0.05e-3;

/// The receiver's directivity is part of the gain if it leaves no more than this share of the squared residual: less than
/// that, and it is a matter of diagnosis.
const TELLS: f64 = 0.9;

/// A registration in which the gain falls off with the angle of arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// Radius of the receiver's face, metres.
    pub face_radius_m: f64,
    /// Its standard error, metres, the pose following.
    pub standard_error_m: f64,
    /// Pose and gain under it.
    pub fit: Fit,
}

/// Looks for a receiver's face that makes a good part of what a pose leaves unexplained go away; `None` if there is
/// none, or if the simulator cannot be asked.
pub fn find_receiver_face(readings: &Readings, posed: &Fit) -> Option<Heard> {
    if !readings.drives().iter().all(|drive| can_tell(&drive.simulation)) {
        return None;
    }
    let some = readings.thinned(SOME);
    let free: Vec<_> = PoseParameter::ALL.map(|parameter| (parameter, None)).to_vec();
    let fit = |readings: &Readings, start: Pose, radius_m: f64, iterations: usize| {
        refine(&heard_by(readings, radius_m), start, &Search { free: free.clone(), iterations })
    };
    let squared = |radius_m: f64| fit(&some, posed.pose, radius_m, 4).residual_ratio.powi(2);
    let golden_section::Minimum { at: face_radius_m, value: least, .. } =
        golden_section::minimise([0.0, LARGEST_M], WIDTH_M, squared);
    let start = fit(&some, posed.pose, face_radius_m, 6).pose;
    let heard = fit(readings, start, face_radius_m, 3);
    if heard.residual_ratio.powi(2) > TELLS * posed.residual_ratio.powi(2) {
        return None;
    }
    // Half the curvature of the squared residual, by its rise a millimetre to either side.
    const BESIDE_M: f64 = 1e-3;
    let rise = [-BESIDE_M, BESIDE_M].map(|by| squared((face_radius_m + by).max(0.0)) - least);
    let curvature = (rise[0] + rise[1]) / (BESIDE_M * BESIDE_M);
    let independent = super::standard_errors::Blocks::of(&some).count().max(1) as f64;
    let standard_error_m =
        if curvature > 0.0 { (least / (independent * curvature / 2.0)).sqrt() } else { f64::NAN };
    Some(Heard { face_radius_m, standard_error_m, fit: heard })
}

/// The same readings, simulated as a receiver with a face of that radius hears them.
pub fn heard_by(readings: &Readings, face_radius_m: f64) -> Readings {
    let drives = readings.drives().iter().map(|drive| Drive {
        simulation: as_heard(&drive.simulation, face_radius_m),
        ..drive.clone()
    });
    Readings::from_drives(drives.collect())
}

/// A set-up as a receiver with a face of that radius hears it.
pub fn as_heard(simulation: &Simulation, face_radius_m: f64) -> Simulation {
    let wider =
        |element: &Element| Element { radius_m: element.radius_m.hypot(face_radius_m), ..*element };
    let elements = simulation.array.elements().iter().map(wider).collect();
    let array = Array::from_elements(elements).expect("as many elements as before");
    Simulation { array, ..simulation.clone() }
}

fn can_tell(simulation: &Simulation) -> bool {
    simulation.simulator == Simulator::Piston
        && simulation.array.elements().iter().all(|element| element.normal == Vec3::z())
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::{Excitation, Medium};

    /// The product of the two directivities, summed pair by pair with the library's Bessel function.
    fn reading(elements: &[Element], k: f64, receiver_m: f64, at: Vec3) -> f64 {
        let piston = |x: f64| if x < 1e-6 { 1.0 } else { 2.0 * libm::j1(x) / x };
        let pressure: num_complex::Complex64 = elements
            .iter()
            .map(|element| {
                let r = at - element.centre_m;
                let (d, sine) = (r.norm(), r.xy().norm() / r.norm());
                let level = piston(k * element.radius_m * sine) * piston(k * receiver_m * sine) / d;
                num_complex::Complex64::from_polar(level, k * d)
            })
            .sum();
        pressure.norm()
    }

    fn readings(receiver_m: f64) -> Readings {
        let array = Array::square(12, 12, 10.5e-3).expect("not empty");
        let simulation = Simulation {
            simulator: Simulator::Piston,
            array,
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Uniform,
        };
        let k = simulation.medium.wavenumber_rad_m(40e3);
        let positions_m: Vec<Vec3> = (0..900)
            .map(|i| {
                Vec3::new((i % 30) as f64 * 4e-3 - 58e-3, (i / 30) as f64 * 4e-3 - 58e-3, 0.12)
            })
            .collect();
        let readings = positions_m
            .iter()
            .map(|at| 7.0 * reading(simulation.array.elements(), k, receiver_m, *at))
            .collect();
        Readings::from_drives(vec![Drive { focus: 0, simulation, positions_m, readings }])
    }

    #[test]
    fn the_face_of_a_receiver_is_found_and_explains_what_the_pose_cannot() {
        let readings = readings(4.5e-3);
        let posed = Fit::at(&readings, Pose::default());
        let heard = find_receiver_face(&readings, &posed).expect("a face");
        assert!((heard.face_radius_m - 4.5e-3).abs() < 0.5e-3, "{heard:?}");
        assert!(heard.fit.residual_ratio < 0.2 * posed.residual_ratio, "{heard:?}");
        assert!(heard.standard_error_m.is_finite());
    }

    #[test]
    fn a_point_receiver_gives_no_face() {
        let readings = readings(0.0);
        let posed = Fit::at(&readings, Pose::default());
        assert_eq!(find_receiver_face(&readings, &posed), None);
    }
}
