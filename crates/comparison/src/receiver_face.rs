//! The receiver's directivity as a part of the gain from pressure to reading.
//!
//! By reciprocity a receiver with a face of radius b has the directivity of a piston of that radius. If it faces the array, the angle
//! of arrival of an element's sound is the angle of emission, so that the directivities of emitter and receiver multiply. To second
//! order in k a sin θ, which determines the width of a lobe, the product of two pistons of radii a and b is a piston of radius
//! √(a² + b²) (2 J1(x)/x = 1 - x²/8 + ...). This applies only to a simulator with a directivity that follows from the radius of the
//! face, and to elements that face the receiver.

use super::pose::Pose;
use super::readings::{Drive, Readings};
use super::refine::{Fit, PoseParameter, Search, refine};
use fieldgap_acoustics::{Array, Element, Simulation, Simulator, Vec3, golden_section};

/// Largest radius of the search, metres: twice the face of a common 40 kHz receiver.
const LARGEST_M: f64 = 10e-3;

/// Readings for the search; the result is refined on all.
const SOME: usize = 1500;

/// The search ends at this width, metres.
const WIDTH_M: f64 = 0.05e-3;

/// The receiver's directivity is taken into the gain if it reduces the squared residual to this share or less. Smaller effects are left
/// to the diagnosis.
const WORTHWHILE: f64 = 0.9;

/// A registration with a gain that falls with the angle of arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverFace {
    /// Radius of the receiver's face, metres.
    pub face_radius_m: f64,
    /// Its standard error, metres, with the pose free.
    pub standard_error_m: f64,
    /// Pose and gain with it.
    pub fit: Fit,
}

/// The receiver's face that explains a good part of the residual of a pose; `None` if there is none, or if the simulator does not allow
/// it.
pub fn find_receiver_face(readings: &Readings, posed: &Fit) -> Option<ReceiverFace> {
    if !readings.drives().iter().all(|drive| is_applicable(&drive.simulation)) {
        return None;
    }
    let some = readings.thinned(SOME);
    let free: Vec<_> = PoseParameter::ALL.map(|parameter| (parameter, None)).to_vec();
    let fit = |readings: &Readings, start: Pose, radius_m: f64, iterations: usize| {
        refine(
            &with_receiver_face(readings, radius_m),
            start,
            &Search { free: free.clone(), iterations },
        )
    };
    let squared = |radius_m: f64| fit(&some, posed.pose, radius_m, 4).residual_ratio.powi(2);
    let golden_section::Minimum { at: face_radius_m, value: least, .. } =
        golden_section::minimise([0.0, LARGEST_M], WIDTH_M, squared);
    let start = fit(&some, posed.pose, face_radius_m, 6).pose;
    let heard = fit(readings, start, face_radius_m, 3);
    if heard.residual_ratio.powi(2) > WORTHWHILE * posed.residual_ratio.powi(2) {
        return None;
    }
    // The curvature of the squared residual, from its rise at a millimetre to either side.
    const BESIDE_M: f64 = 1e-3;
    let rise = [-BESIDE_M, BESIDE_M].map(|by| squared((face_radius_m + by).max(0.0)) - least);
    let curvature = (rise[0] + rise[1]) / (BESIDE_M * BESIDE_M);
    let independent = super::standard_errors::Blocks::of(&some).count().max(1) as f64;
    let standard_error_m =
        if curvature > 0.0 { (least / (independent * curvature / 2.0)).sqrt() } else { f64::NAN };
    Some(ReceiverFace { face_radius_m, standard_error_m, fit: heard })
}

/// The same readings, simulated for a receiver with a face of that radius.
pub fn with_receiver_face(readings: &Readings, face_radius_m: f64) -> Readings {
    let drives = readings.drives().iter().map(|drive| Drive {
        simulation: simulation_with_receiver_face(&drive.simulation, face_radius_m),
        ..drive.clone()
    });
    readings.with_drives(drives.collect())
}

/// A simulation for a receiver with a face of that radius.
pub fn simulation_with_receiver_face(simulation: &Simulation, face_radius_m: f64) -> Simulation {
    let wider =
        |element: &Element| Element { radius_m: element.radius_m.hypot(face_radius_m), ..*element };
    let elements = simulation.array.elements().iter().map(wider).collect();
    let array = Array::from_elements(elements).expect("as many elements as before");
    Simulation { array, ..simulation.clone() }
}

fn is_applicable(simulation: &Simulation) -> bool {
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
        Readings::from_drives(vec![Drive {
            focus: 0,
            simulation,
            positions_m,
            readings,
            phases: Vec::new(),
        }])
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
