//! Changes of single elements.

use nalgebra::{Rotation3, Vector3};

use super::change::Change;
use super::error::CorrectionError;
use fieldgap_acoustics::{Array, Element};

/// Whether a change applies to single elements, which a lattice cannot represent.
pub(super) fn is_of_elements(change: &Change) -> bool {
    matches!(
        change,
        Change::Silent(_)
            | Change::Reversed(_)
            | Change::Swapped(_)
            | Change::Amplitudes(_)
            | Change::Phases(_)
            | Change::Tilt(_)
            | Change::Faces(_)
            | Change::Turn(_)
    )
}

/// The elements of an array after a change.
///
/// # Errors
/// [`CorrectionError::NoSuchElement`] if the change names an element that does not exist.
pub(super) fn changed(
    mut elements: Vec<Element>,
    change: &Change,
) -> Result<Vec<Element>, CorrectionError> {
    let count = elements.len();
    let check = |numbers: &[usize]| match numbers.iter().find(|&&number| number >= count) {
        Some(&element) => Err(CorrectionError::NoSuchElement { element, elements: count }),
        None => Ok(()),
    };
    let check_each = |values: &[f64]| check(&[values.len().saturating_sub(1)]);
    match change {
        Change::Silent(numbers) => {
            check(numbers)?;
            numbers.iter().for_each(|&number| elements[number].amplitude = 0.0);
        }
        Change::Reversed(numbers) => {
            check(numbers)?;
            for &number in numbers {
                elements[number].phase_rad += std::f64::consts::PI;
            }
        }
        Change::Swapped([a, b]) => {
            check(&[*a, *b])?;
            // The number of an element is that of its output.
            elements.swap(*a, *b);
        }
        Change::Amplitudes(departures) => {
            check_each(departures)?;
            for (element, departure) in elements.iter_mut().zip(departures) {
                element.amplitude *= 1.0 + departure;
            }
        }
        Change::Phases(departures_rad) => {
            check_each(departures_rad)?;
            for (element, departure_rad) in elements.iter_mut().zip(departures_rad) {
                element.phase_rad += departure_rad;
            }
        }
        Change::Tilt([about_x_rad, about_y_rad]) => {
            let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), *about_y_rad)
                * Rotation3::from_axis_angle(&Vector3::x_axis(), *about_x_rad);
            turn(&mut elements, tilt);
        }
        // A rotation of the robot's axes is the opposite rotation of the array in them.
        Change::Turn(rad) => {
            turn(&mut elements, Rotation3::from_axis_angle(&Vector3::z_axis(), -rad));
        }
        Change::Faces(ratio) => elements.iter_mut().for_each(|element| element.radius_m *= ratio),
        Change::Pitch(ratio) => elements.iter_mut().for_each(|element| element.centre_m *= *ratio),
        Change::Offset(offset_mm) => {
            elements.iter_mut().for_each(|element| element.centre_m -= offset_mm / 1e3);
        }
        Change::SpeedOfSound(_)
        | Change::Frequency(..)
        | Change::Steps(..)
        | Change::SimulatorModel => {}
    }
    Ok(elements)
}

fn turn(elements: &mut [Element], rotation: Rotation3<f64>) {
    for element in elements {
        element.centre_m = rotation * element.centre_m;
        element.normal = rotation * element.normal;
    }
}

/// The difference between two arrays that a scan depends on, if any.
pub(super) fn difference(nominal: &Array, scanned: &Array) -> Option<&'static str> {
    /// Tolerance of positions, metres: above the rounding of files.
    const SAME_POSITION_M: f64 = 1e-6;
    if nominal.len() != scanned.len() {
        return Some("the number of elements");
    }
    let pairs = || nominal.elements().iter().zip(scanned.elements());
    if pairs().any(|(a, b)| (a.centre_m - b.centre_m).norm() > SAME_POSITION_M) {
        return Some("the positions of its elements");
    }
    if pairs().any(|(a, b)| a.amplitude != b.amplitude || a.phase_rad != b.phase_rad) {
        return Some("the amplitudes or phases of its elements");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;

    fn three() -> Vec<Element> {
        [-0.01, 0.0, 0.01].map(|x_m| Element::at(x_m, 0.0)).to_vec()
    }

    #[test]
    fn only_the_named_elements_change() {
        let elements = changed(three(), &Change::Silent(vec![1])).expect("there");
        assert_eq!(elements.iter().map(|e| e.amplitude).collect::<Vec<_>>(), [1.0, 0.0, 1.0]);
        let elements = changed(elements, &Change::Swapped([0, 1])).expect("there");
        assert_eq!((elements[0].amplitude, elements[0].centre_m.x), (0.0, 0.0));
        let elements = changed(elements, &Change::Reversed(vec![2])).expect("there");
        assert_eq!(elements[2].phase_rad, std::f64::consts::PI);
        let elements =
            changed(elements, &Change::Amplitudes(vec![0.1, -0.2, 0.0])).expect("all there");
        let amplitudes: Vec<f64> = elements.iter().map(|element| element.amplitude).collect();
        assert!((amplitudes[1] - 0.8).abs() < 1e-15 && amplitudes[2] == 1.0, "{amplitudes:?}");
        let elements = changed(elements, &Change::Phases(vec![0.3, 0.0, 0.0])).expect("all there");
        assert_eq!(elements[0].phase_rad, 0.3);
        let error = changed(elements, &Change::Silent(vec![3])).expect_err("not there");
        assert!(error.to_string().contains("element 3"), "{error}");
    }

    #[test]
    fn a_rotated_robot_keeps_distances_to_the_elements() {
        // The array is rotated opposite to the robot's axes, so that distances agree.
        let rad = 0.02;
        let reported = Vec3::new(0.03, -0.01, 0.1);
        let actual = Rotation3::from_axis_angle(&Vector3::z_axis(), rad) * reported;
        let turned = changed(three(), &Change::Turn(rad)).expect("there");
        for (element, turned) in three().iter().zip(turned) {
            let (expected, found) =
                ((actual - element.centre_m).norm(), (reported - turned.centre_m).norm());
            assert!((expected - found).abs() < 1e-15);
        }
    }

    #[test]
    fn an_offset_robot_keeps_distances_to_the_elements() {
        let (offset_mm, reported) = (Vec3::new(1.0, -2.0, 0.5), Vec3::new(0.03, -0.01, 0.1));
        let moved = changed(three(), &Change::Offset(offset_mm)).expect("there");
        let actual = reported + offset_mm / 1e3;
        assert!(((actual - three()[0].centre_m) - (reported - moved[0].centre_m)).norm() < 1e-15);
    }
}
