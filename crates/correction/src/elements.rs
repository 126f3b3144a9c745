//! Changes of single elements.

use nalgebra::{Rotation3, Vector3};

use super::change::Change;
use super::error::CorrectionError;
use fieldgap_acoustics::{Array, Element};

/// Whether a change is one of single elements, which no lattice can hold.
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

/// The elements of an array with a change made to them; other changes leave them as they are.
///
/// # Errors
/// [`CorrectionError::NoSuchElement`] if the change names one that is not there.
pub(super) fn changed(
    mut elements: Vec<Element>,
    change: &Change,
) -> Result<Vec<Element>, CorrectionError> {
    let count = elements.len();
    let there = |numbers: &[usize]| match numbers.iter().find(|&&number| number >= count) {
        Some(&element) => Err(CorrectionError::NoSuchElement { element, elements: count }),
        None => Ok(()),
    };
    let of_each = |values: &[f64]| there(&[values.len().saturating_sub(1)]);
    match change {
        Change::Silent(numbers) => {
            there(numbers)?;
            numbers.iter().for_each(|&number| elements[number].amplitude = 0.0);
        }
        Change::Reversed(numbers) => {
            there(numbers)?;
            for &number in numbers {
                elements[number].phase_rad += std::f64::consts::PI;
            }
        }
        Change::Swapped([a, b]) => {
            there(&[*a, *b])?;
            // An element's number is that of its output.
            elements.swap(*a, *b);
        }
        Change::Amplitudes(departures) => {
            of_each(departures)?;
            for (element, departure) in elements.iter_mut().zip(departures) {
                element.amplitude *= 1.0 + departure;
            }
        }
        Change::Phases(departures_rad) => {
            of_each(departures_rad)?;
            for (element, departure_rad) in elements.iter_mut().zip(departures_rad) {
                element.phase_rad += departure_rad;
            }
        }
        Change::Tilt([about_x_rad, about_y_rad]) => {
            let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), *about_y_rad)
                * Rotation3::from_axis_angle(&Vector3::x_axis(), *about_x_rad);
            turn(&mut elements, tilt);
        }
        // Where the robot's axes are turned one way, the array is turned the other way in them.
        Change::Turn(rad) => {
            turn(&mut elements, Rotation3::from_axis_angle(&Vector3::z_axis(), -rad));
        }
        Change::Faces(ratio) => elements.iter_mut().for_each(|element| element.radius_m *= ratio),
        Change::Pitch(ratio) => elements.iter_mut().for_each(|element| element.centre_m *= *ratio),
        Change::Offset(offset_mm) => {
            elements.iter_mut().for_each(|element| element.centre_m -= offset_mm / 1e3);
        }
        Change::SpeedOfSound(_)
        | Change::Frequency(_)
        | Change::Steps(_)
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

/// What differs between two arrays, if anything that a scan could tell does.
pub(super) fn difference(believed: &Array, scanned: &Array) -> Option<&'static str> {
    /// Closer than any lattice is made, wider than a file rounds, metres.
    const SAME_PLACE_M: f64 = 1e-6;
    if believed.len() != scanned.len() {
        return Some("the number of elements");
    }
    let pairs = || believed.elements().iter().zip(scanned.elements());
    if pairs().any(|(a, b)| (a.centre_m - b.centre_m).norm() > SAME_PLACE_M) {
        return Some("the places of its elements");
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
    fn single_elements_change_and_no_other() {
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
    fn a_turned_robot_sees_the_field_where_it_is() {
        // The array's frame is turned back by as much as the robot's axes are turned forth: distances agree.
        let rad = 0.02;
        let said = Vec3::new(0.03, -0.01, 0.1);
        let truly = Rotation3::from_axis_angle(&Vector3::z_axis(), rad) * said;
        let turned = changed(three(), &Change::Turn(rad)).expect("there");
        for (element, turned) in three().iter().zip(turned) {
            let (there, here) =
                ((truly - element.centre_m).norm(), (said - turned.centre_m).norm());
            assert!((there - here).abs() < 1e-15);
        }
    }

    #[test]
    fn an_offset_robot_sees_the_field_where_it_is() {
        let (offset_mm, said) = (Vec3::new(1.0, -2.0, 0.5), Vec3::new(0.03, -0.01, 0.1));
        let moved = changed(three(), &Change::Offset(offset_mm)).expect("there");
        let truly = said + offset_mm / 1e3;
        assert!(((truly - three()[0].centre_m) - (said - moved[0].centre_m)).norm() < 1e-15);
    }
}
