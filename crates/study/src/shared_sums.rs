//! Many simulations over planes that share the fields of common elements.
//!
//! Arrays of growing size with one focus contain each other's elements. The field of an element is the same in all of them,
//! up to a common phase: delays count from the farthest element. The field of a larger array therefore starts from that of
//! the smaller one, and only the additional elements are summed.

use std::collections::HashSet;

use num_complex::Complex64;
use rayon::prelude::*;

use fieldgap_acoustics::{Element, Excitation, PlaneGrid, Simulation};

/// A simulation and its plane.
pub(super) type Job<'a> = (&'a Simulation, &'a PlaneGrid);

/// Calls `read` with the number and the rms pressures of each job; returns the results in the order of the jobs.
pub(super) fn shared_magnitudes<T: Send>(
    jobs: &[Job<'_>],
    read: impl Fn(usize, Vec<f64>) -> T + Sync,
) -> Vec<T> {
    let mut results: Vec<(usize, T)> = chains(jobs)
        .par_iter()
        .flat_map_iter(|chain| {
            let mut previous: Option<Previous<'_>> = None;
            chain
                .iter()
                .map(|&job| {
                    let (simulation, grid) = jobs[job];
                    let field = continued_field(simulation, grid, previous.take());
                    let values = field.iter().copied().map(simulation.rms()).collect();
                    previous = Some(Previous { simulation, field });
                    (job, read(job, values))
                })
                .collect::<Vec<_>>()
        })
        .collect();
    results.sort_by_key(|(job, _)| *job);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Chains of job numbers; each array of a chain contains the elements of the one before.
fn chains(jobs: &[Job<'_>]) -> Vec<Vec<usize>> {
    let mut by_size: Vec<usize> = (0..jobs.len()).collect();
    by_size.sort_by_key(|&job| jobs[job].0.array.len());
    let mut chains: Vec<Vec<usize>> = Vec::new();
    for job in by_size {
        let own = keys(jobs[job].0);
        let end = |chain: &&mut Vec<usize>| {
            let last = jobs[chain[chain.len() - 1]];
            compatible(last, jobs[job])
                && last.0.array.elements().iter().all(|element| own.contains(&key(element)))
        };
        match chains.iter_mut().rev().find(end) {
            Some(chain) => chain.push(job),
            None => chains.push(vec![job]),
        }
    }
    chains
}

/// Whether two jobs differ only in their elements and have a focus, as only its delays share their phases.
fn compatible((a, grid_a): Job<'_>, (b, grid_b): Job<'_>) -> bool {
    matches!(a.excitation, Excitation::Focus(_))
        && a.excitation == b.excitation
        && a.simulator == b.simulator
        && a.medium == b.medium
        && a.frequency_hz == b.frequency_hz
        && grid_a == grid_b
}

/// An element, bit by bit.
type Key = [u64; 9];

fn key(element: &Element) -> Key {
    let [x, y, z]: [f64; 3] = element.centre_m.into();
    let [nx, ny, nz]: [f64; 3] = element.normal.into();
    // Negative zero becomes zero.
    [x, y, z, nx, ny, nz, element.radius_m, element.amplitude, element.phase_rad]
        .map(|number| (number + 0.0).to_bits())
}

fn keys(simulation: &Simulation) -> HashSet<Key> {
    simulation.array.elements().iter().map(key).collect()
}

struct Previous<'a> {
    simulation: &'a Simulation,
    field: Vec<Complex64>,
}

/// The field of a simulation, continued from that of an array with a subset of its elements.
fn continued_field(
    simulation: &Simulation,
    grid: &PlaneGrid,
    previous: Option<Previous<'_>>,
) -> Vec<Complex64> {
    let points = grid.points();
    let Some(previous) = previous else { return simulation.field(&points) };
    let known = keys(previous.simulation);
    let elements = simulation.array.elements();
    let new: Vec<usize> =
        (0..elements.len()).filter(|&index| !known.contains(&key(&elements[index]))).collect();
    let rotation =
        Complex64::cis(focus_phase_rad(simulation) - focus_phase_rad(previous.simulation));
    let mut field: Vec<Complex64> =
        previous.field.into_iter().map(|part| part * rotation).collect();
    if !new.is_empty() {
        let added = simulation.kernel().of_elements(&new).at(&points);
        field.iter_mut().zip(added).for_each(|(field, added)| *field += added);
    }
    field
}

/// The common phase of all waves at the focus, radians: that of the longest path.
fn focus_phase_rad(simulation: &Simulation) -> f64 {
    let focus_m = simulation.excitation.focus_m().unwrap_or_default();
    let paths_m = simulation.array.elements().iter().map(|e| (focus_m - e.centre_m).norm());
    simulation.medium.wavenumber_rad_m(simulation.frequency_hz) * paths_m.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::{Array, Medium, Simulator, Vec3};

    fn simulation(array: Array, simulator: Simulator) -> Simulation {
        Simulation {
            simulator,
            array,
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Focus(Vec3::new(0.012, -0.02, 0.1)),
        }
    }

    #[test]
    fn shared_sums_agree_with_independent_ones() {
        let grid = PlaneGrid::square(0.03, 3e-3, 0.08);
        for simulator in Simulator::ALL {
            let squares: Vec<Simulation> = (1..=9)
                .map(|side| Array::square(side, side, 10.5e-3).expect("not empty"))
                .chain([
                    Array::square(3, 3, 11e-3).expect("not empty"),
                    Array::hexagonal(2, 10.5e-3),
                ])
                .map(|array| simulation(array, simulator))
                .collect();
            let jobs: Vec<Job<'_>> = squares.iter().map(|square| (square, &grid)).collect();
            let chains = chains(&jobs);
            assert!(chains.contains(&vec![1, 3, 5, 7]), "{chains:?}");
            let shared = shared_magnitudes(&jobs, |job, values| (job, values));
            for (job, (simulation, (number, values))) in squares.iter().zip(shared).enumerate() {
                assert_eq!(job, number);
                let alone = simulation.magnitudes(&grid.points());
                let peak = alone.iter().copied().fold(0.0, f64::max);
                for (shared, alone) in values.iter().zip(alone) {
                    assert!((shared - alone).abs() < 1e-12 * peak, "{shared} {alone}");
                }
            }
        }
    }

    #[test]
    fn incompatible_jobs_are_not_chained() {
        let grid = PlaneGrid::square(0.01, 5e-3, 0.1);
        let array = || Array::square(2, 2, 10.5e-3).expect("not empty");
        let near = simulation(array(), Simulator::Piston);
        let mut far = near.clone();
        far.excitation = Excitation::Focus(Vec3::new(0.0, 0.0, 0.2));
        let mut alike = near.clone();
        alike.excitation = Excitation::Uniform;
        let jobs = [(&near, &grid), (&far, &grid), (&alike, &grid), (&alike, &grid)];
        assert_eq!(chains(&jobs).len(), 4);
        assert_eq!(chains(&[(&near, &grid), (&near, &grid)]), [vec![0, 1]]);
    }
}
