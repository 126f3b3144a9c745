//! Many simulations over planes, each element summed as seldom as can be.
//!
//! Square arrays that grow about one focus hold one another's elements, and an element's own field is the same in all of
//! them, but for a phase that the whole array shares: delays are counted from the farthest element. So an array that holds
//! another's elements begins with that one's field, and only what it has beyond is summed.

use std::collections::HashSet;

use num_complex::Complex64;
use rayon::prelude::*;

use fieldgap_acoustics::{Element, Excitation, PlaneGrid, Simulation};

/// A simulation, and the plane that it is wanted on.
pub(super) type Job<'a> = (&'a Simulation, &'a PlaneGrid);

/// The root mean square pressures of each job, handed to `read` with the job's number; what it makes of them, in the order
/// of the jobs.
pub(super) fn shared_magnitudes<T: Send>(
    jobs: &[Job<'_>],
    read: impl Fn(usize, Vec<f64>) -> T + Sync,
) -> Vec<T> {
    let mut made: Vec<(usize, T)> = chains(jobs)
        .par_iter()
        .flat_map_iter(|chain| {
            let mut begun: Option<Begun<'_>> = None;
            chain
                .iter()
                .map(|&job| {
                    let (simulation, grid) = jobs[job];
                    let field = continued(simulation, grid, begun.take());
                    let values = field.iter().copied().map(simulation.rms()).collect();
                    begun = Some(Begun { simulation, field });
                    (job, read(job, values))
                })
                .collect::<Vec<_>>()
        })
        .collect();
    made.sort_by_key(|(job, _)| *job);
    made.into_iter().map(|(_, made)| made).collect()
}

/// Jobs by number, each chain rising, each of its arrays holding the one before.
fn chains(jobs: &[Job<'_>]) -> Vec<Vec<usize>> {
    let mut rising: Vec<usize> = (0..jobs.len()).collect();
    rising.sort_by_key(|&job| jobs[job].0.array.len());
    let mut chains: Vec<Vec<usize>> = Vec::new();
    for job in rising {
        let own = keys(jobs[job].0);
        let end = |chain: &&mut Vec<usize>| {
            let last = jobs[chain[chain.len() - 1]];
            alike(last, jobs[job])
                && last.0.array.elements().iter().all(|element| own.contains(&key(element)))
        };
        match chains.iter_mut().rev().find(end) {
            Some(chain) => chain.push(job),
            None => chains.push(vec![job]),
        }
    }
    chains
}

/// Whether two jobs differ in nothing but their elements, and have a focus, whose delays alone share their phases.
fn alike((a, grid_a): Job<'_>, (b, grid_b): Job<'_>) -> bool {
    matches!(a.excitation, Excitation::Focus(_))
        && a.excitation == b.excitation
        && a.simulator == b.simulator
        && a.medium == b.medium
        && a.frequency_hz == b.frequency_hz
        && grid_a == grid_b
}

/// An element, to the last bit.
type Key = [u64; 9];

fn key(element: &Element) -> Key {
    let [x, y, z]: [f64; 3] = element.centre_m.into();
    let [nx, ny, nz]: [f64; 3] = element.normal.into();
    // Zero has two signs that are the same place.
    [x, y, z, nx, ny, nz, element.radius_m, element.amplitude, element.phase_rad]
        .map(|number| (number + 0.0).to_bits())
}

fn keys(simulation: &Simulation) -> HashSet<Key> {
    simulation.array.elements().iter().map(key).collect()
}

struct Begun<'a> {
    simulation: &'a Simulation,
    field: Vec<Complex64>,
}

/// The field of a simulation, taken on from that of an array whose elements it has.
fn continued(
    simulation: &Simulation,
    grid: &PlaneGrid,
    begun: Option<Begun<'_>>,
) -> Vec<Complex64> {
    let points = grid.points();
    let Some(begun) = begun else { return simulation.field(&points) };
    let known = keys(begun.simulation);
    let elements = simulation.array.elements();
    let new: Vec<usize> =
        (0..elements.len()).filter(|&index| !known.contains(&key(&elements[index]))).collect();
    let turned = Complex64::cis(latest_rad(simulation) - latest_rad(begun.simulation));
    let mut field: Vec<Complex64> = begun.field.into_iter().map(|part| part * turned).collect();
    if !new.is_empty() {
        let added = simulation.kernel().of_elements(&new).at(&points);
        field.iter_mut().zip(added).for_each(|(field, added)| *field += added);
    }
    field
}

/// The phase at which all waves reach the focus, radians: the farthest element's travel.
fn latest_rad(simulation: &Simulation) -> f64 {
    let focus_m = simulation.excitation.focus_m().unwrap_or_default();
    let travels = simulation.array.elements().iter().map(|e| (focus_m - e.centre_m).norm());
    simulation.medium.wavenumber_rad_m(simulation.frequency_hz) * travels.fold(0.0, f64::max)
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
    fn growing_arrays_have_the_fields_that_each_has_alone() {
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
                for (ours, alone) in values.iter().zip(alone) {
                    assert!((ours - alone).abs() < 1e-12 * peak, "{ours} {alone}");
                }
            }
        }
    }

    #[test]
    fn arrays_that_share_nothing_go_apart() {
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
