//! Sections through a simulated volume, for its pictures.

use fieldgap_acoustics::{PlaneGrid, Simulation, Vec3};
use fieldgap_report::{SectionPlane, SimulatedSection};

/// Points along a side of a section, at most: more than the pixels of its picture at 300 dpi in a column of a journal.
const MOST_POINTS_A_SIDE: usize = 600;

/// The planes xy, xz and yz through the focus, or through the place of the volume that is nearest to it, on the points of the volume or
/// on every second, third and so on of them.
pub(super) fn sections(
    simulation: &Simulation,
    grid: &PlaneGrid,
    heights_m: &[f64],
) -> Vec<SimulatedSection> {
    let sides_m = [&grid.x_m[..], &grid.y_m[..], heights_m];
    let middle_m = Vec3::from_fn(|side, _| 0.5 * (sides_m[side][0] + last(sides_m[side])));
    let focus_m = simulation.excitation.focus_m();
    let through_m = focus_m.unwrap_or(middle_m);
    SectionPlane::ALL
        .into_iter()
        .map(|plane| {
            let [across, up, normal] = plane.coordinates();
            let (across_m, up_m) = (thinned(sides_m[across]), thinned(sides_m[up]));
            let at_m = through_m[normal].clamp(sides_m[normal][0], last(sides_m[normal]));
            let points_m: Vec<Vec3> = up_m
                .iter()
                .flat_map(|&up_m| {
                    across_m.iter().map(move |&across_m| plane.point(across_m, up_m, at_m))
                })
                .collect();
            let field = simulation.field(&points_m);
            SimulatedSection {
                plane,
                across_m,
                up_m,
                at_m,
                amplitude: field.iter().copied().map(simulation.rms()).collect(),
                phase_rad: field.iter().map(|pressure| pressure.arg()).collect(),
                focus_m,
            }
        })
        .collect()
}

fn last(side_m: &[f64]) -> f64 {
    side_m[side_m.len() - 1]
}

/// Evenly spaced points of a side, from its first on.
fn thinned(side_m: &[f64]) -> Vec<f64> {
    side_m.iter().copied().step_by(side_m.len().div_ceil(MOST_POINTS_A_SIDE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::{Array, Excitation, Medium, Simulator};

    fn simulation(focus_m: Vec3) -> Simulation {
        Simulation {
            simulator: Simulator::Piston,
            array: Array::square(6, 6, 10.5e-3).expect("an array"),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Focus(focus_m),
        }
    }

    #[test]
    fn sections_are_turned_as_they_say_and_meet_at_the_focus() {
        // Three different coordinates, so that no two axes can be exchanged unnoticed.
        let focus_m = Vec3::new(0.005, -0.01, 0.1);
        let simulation = simulation(focus_m);
        let grid = PlaneGrid::square(0.02, 0.005, 0.0);
        let heights_m: Vec<f64> = (0..5).map(|n| 0.09 + 0.005 * f64::from(n)).collect();
        let sections = sections(&simulation, &grid, &heights_m);
        let at = |section: &SimulatedSection, across_m: f64, up_m: f64| {
            let place = |side: &[f64], at: f64| {
                side.iter().position(|value| (value - at).abs() < 1e-9).expect("on the grid")
            };
            let number = place(&section.up_m, up_m) * section.across_m.len()
                + place(&section.across_m, across_m);
            section.amplitude[number]
        };
        let expected = |x, y, z| simulation.magnitudes(&[Vec3::new(x, y, z)])[0];
        let [xy, xz, yz] = &sections[..] else { panic!("{}", sections.len()) };
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-9, "{a} is not {b}");
        close(at(xy, 0.015, -0.02), expected(0.015, -0.02, 0.1));
        close(at(xz, 0.015, 0.11), expected(0.015, -0.01, 0.11));
        close(at(yz, -0.02, 0.11), expected(0.005, -0.02, 0.11));
        close(at(xy, 0.005, -0.01), at(xz, 0.005, 0.1));
        close(at(xy, 0.005, -0.01), at(yz, -0.01, 0.1));
    }

    #[test]
    fn a_focus_outside_is_replaced_by_the_nearest_place_and_long_sides_are_thinned() {
        let grid = PlaneGrid::square(0.35, 0.001, 0.0);
        let sections = sections(&simulation(Vec3::new(0.0, 0.0, 0.3)), &grid, &[0.1, 0.2]);
        assert_eq!(sections[0].at_m, 0.2);
        assert!(sections.iter().all(|section| section.across_m.len() == 351));
        assert_eq!(sections[1].up_m, [0.1, 0.2]);
    }
}
