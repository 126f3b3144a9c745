//! Where the search for a wall begins. Every direction and distance is tried with few readings, the coefficient solved for; from the best ones the way goes on
//! with more.

use fieldgap_acoustics::Vec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::effects::wall::Wall;
use crate::limits::{BEYOND_CHANCE, FARTHEST_WALL_M, WALLS};
use crate::model::effect::Context;
use crate::model::mirror::Mirror;
use crate::selection::quick_scores::{QuickScores, best_of};
use crate::selection::stray_waves::{Descent, wavelength_m, worth_a_fit};

/// Directions of a wall that are tried, all around: 16 cm away an image is 7 mm from that of the next, and the phase turns by a radian over half of
/// a scan of 70 mm.
const DIRECTIONS: usize = 72;

/// Distance, m, from which on the steps between walls grow with its square: the paths to the top and to the bottom of a scan differ by z²/2d, so that they
/// change by less and less. (At 15 cm, half a wavelength changes them by a quarter of a turn over a scan 20 cm high.)
const NEAR_WALL_M: f64 = 0.15;

/// Least and greatest lean of a wall towards the field, in steps as wide as those of its azimuth: from 10 degrees away from the array to 20 towards it. One that
/// leans farther away sends the sound past the field.
const LEANS: [f64; 2] = [-2.0, 4.0];

/// Turn of the phase, rad, at the top and the bottom of a scan from one lean to the next, and most leans in one step of the azimuth.
const TURN_OF_LEAN_RAD: f64 = 2.0;
const LEANS_A_STEP: f64 = 3.0;

/// Walls that are compared again on more readings, and those of them from which the way goes on.
const RESCORED: usize = 100;
const CLIMBED: usize = 12;

/// Steps in direction, and steps in distance, beyond which two walls are different ones.
const APART: [f64; 2] = [1.5, 3.0];

/// Steps from a wall to better ones around it, at most: a quarter of the way around.
const MOST_STEPS: usize = 20;

impl QuickScores<'_> {
    /// The walls, upright or leaning, that explain most, as a fit works on them.
    pub fn walls(&self, context: &Context) -> Vec<Vec<f64>> {
        let step_m = 0.5 * wavelength_m(context);
        let stride = self.stride_of_waves(context);
        let still = self.slopes(stride, &[], Complex64::ZERO);
        let elements_m = context.believed.array.elements().iter().map(|element| element.centre_m);
        let places_m: Vec<Vec3> =
            elements_m.chain(self.each_drive(1).into_iter().flat_map(|(_, at_m)| at_m)).collect();
        let turn_rad = TAU / DIRECTIONS as f64;
        let drives = self.each_drive(stride);
        let heights_m = drives.iter().flat_map(|(_, at_m)| at_m.iter().map(|at_m| at_m.z));
        let (lowest_m, highest_m) = heights_m
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let half_height_m = 0.5 * (highest_m - lowest_m).max(0.0);
        let wavenumber = self.model.wavenumber_rad_m(&context.believed);
        let leans_a_step =
            (turn_rad * wavenumber * half_height_m / TURN_OF_LEAN_RAD).clamp(1.0, LEANS_A_STEP);
        let leans = ((LEANS[1] - LEANS[0]) * leans_a_step).ceil();
        let directions: Vec<[f64; 2]> = (0..=leans as usize)
            .map(|n| turn_rad * (LEANS[0] + (LEANS[1] - LEANS[0]) * n as f64 / leans))
            .flat_map(|lean_rad| (0..DIRECTIONS).map(move |n| [turn_rad * n as f64, lean_rad]))
            .collect();
        let of_direction = |direction: [f64; 2]| {
            let facing = |distance_m: f64| Wall::facing(direction, distance_m);
            let normal = facing(0.0).normal;
            // A wall does not cut through what was measured.
            let nearest_m = places_m.iter().map(|at_m| normal.dot(at_m)).fold(0.0, f64::max);
            let farther_m =
                |at_m: &f64| Some(at_m + step_m * (at_m / NEAR_WALL_M).max(1.0).powi(2));
            let distances_m: Vec<f64> = std::iter::successors(farther_m(&nearest_m), farther_m)
                .take_while(|at_m| *at_m < nearest_m + FARTHEST_WALL_M)
                .collect();
            let count = distances_m.len();
            // The field of the images is that of the array at the images of the places, but for the receiver's directivity.
            let images_m: Vec<Vec<Vec3>> = (drives.iter())
                .map(|(_, places_m)| {
                    let mirrors = distances_m.iter().map(|at_m| facing(*at_m));
                    let of_wall =
                        |mirror: Mirror| places_m.iter().map(move |at_m| mirror.of_place(at_m));
                    mirrors.flat_map(of_wall).collect()
                })
                .collect();
            let at = drives.iter().zip(&images_m);
            let fields = self.fields(at.map(|((drive, _), at_m)| (*drive, at_m.as_slice())));
            let of_wall = |(number, distance_m): (usize, f64)| {
                let mut mirrored = Vec::new();
                let mut before = 0;
                for (_, places_m) in &drives {
                    let first = before + number * places_m.len();
                    mirrored.extend_from_slice(&fields[first..first + places_m.len()]);
                    before += count * places_m.len();
                }
                (-Descent::of(&still, &mirrored).expected_fall(), Place { direction, distance_m })
            };
            distances_m.into_iter().enumerate().map(of_wall).collect::<Vec<_>>()
        };
        let quick: Vec<_> = directions.into_par_iter().flat_map_iter(of_direction).collect();
        let ways = quick.len() as f64;
        let scored = apart(quick, RESCORED, step_m).into_iter();
        let scored = scored.map(|place| (-self.strength(&place).0, place)).collect();
        let finest = best_of(scored, CLIMBED).into_par_iter().map(|from| {
            let (fall, coefficient, place) = self.climbed(from, &places_m, step_m);
            let Place { direction, distance_m } = place;
            let scaled = self.stride as f64 * fall;
            (-scaled, Wall::returning(direction, distance_m, coefficient, context))
        });
        worth_a_fit(finest.collect(), ways.ln() + BEYOND_CHANCE, WALLS)
    }

    /// How far the cost falls by a wall, on a part of the readings, and what it returns.
    fn strength(&self, place: &Place) -> (f64, Complex64) {
        let mirror = Wall::facing(place.direction, place.distance_m);
        self.solved(self.stride, &self.images(self.stride, &mirror))
    }

    /// From a wall to one around it that explains more, until none does. Walls that lean the other way are nearer or farther where they explain as much:
    /// between two such minima a fit finds no way.
    fn climbed(&self, from: Place, places_m: &[Vec3], step_m: f64) -> (f64, Complex64, Place) {
        let (fall, coefficient) = self.strength(&from);
        let mut best = (fall, coefficient, from);
        for _ in 0..MOST_STEPS {
            let beside = best.2.beside(step_m).filter(|place| place.is_beyond(places_m));
            let scored = beside.map(|place| {
                let (fall, coefficient) = self.strength(&place);
                (fall, coefficient, place)
            });
            let next = scored.max_by(|one, other| one.0.total_cmp(&other.0));
            match next.filter(|next| next.0 > best.0) {
                Some(next) => best = next,
                None => break,
            }
        }
        best
    }
}

/// Where a wall is: azimuth and elevation of its normal, rad, and its distance from the array's centre.
#[derive(Clone, Copy)]
struct Place {
    direction: [f64; 2],
    distance_m: f64,
}

impl Place {
    /// The step in distance from here, where one of a near wall is `step_m`.
    fn step_m(&self, step_m: f64) -> f64 {
        step_m * (self.distance_m / NEAR_WALL_M).max(1.0).powi(2)
    }

    /// Places around it, half a step of the search in direction, and up to two in distance, away.
    fn beside(self, step_m: f64) -> impl Iterator<Item = Self> {
        let turn_rad = 0.5 * TAU / DIRECTIONS as f64;
        let farther_m = self.step_m(step_m);
        let turned = move |turn: i32, lean: i32| {
            let [azimuth_rad, elevation_rad] = self.direction;
            let by = |n: i32| turn_rad * f64::from(n);
            [azimuth_rad + by(turn), elevation_rad + by(lean)]
        };
        let around = (-1..=1).flat_map(|turn| (-1..=1).map(move |lean| (turn, lean)));
        around.flat_map(move |(turn, lean)| {
            (-2..=2).map(move |n| Self {
                direction: turned(turn, lean),
                distance_m: self.distance_m + farther_m * f64::from(n),
            })
        })
    }

    /// Whether it does not cut through what was measured, or through the array.
    fn is_beyond(&self, places_m: &[Vec3]) -> bool {
        let normal = Wall::facing(self.direction, 0.0).normal;
        places_m.iter().all(|at_m| normal.dot(at_m) <= self.distance_m)
    }

    /// Whether it differs from another by more than neighbours of the search do.
    fn is_apart(&self, other: &Self, step_m: f64) -> bool {
        let turn_rad = TAU / DIRECTIONS as f64;
        let normals = [self, other].map(|place| Wall::facing(place.direction, 0.0).normal);
        let farther_m = (self.distance_m - other.distance_m).abs();
        normals[0].angle(&normals[1]) > APART[0] * turn_rad
            || farther_m > APART[1] * self.step_m(step_m)
    }
}

/// The best of some scored walls, each apart from those that are better.
fn apart(mut scored: Vec<(f64, Place)>, most: usize, step_m: f64) -> Vec<Place> {
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<Place> = Vec::new();
    for (_, place) in scored {
        if chosen.len() == most {
            break;
        }
        if chosen.iter().all(|other| place.is_apart(other, step_m)) {
            chosen.push(place);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Excitation;

    use super::*;
    use crate::effect_id::EffectId;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, nuisance};
    use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
    use crate::model::effect::Choice;
    use crate::model::instance::Instance;

    /// Of two drives with different places.
    #[test]
    fn the_search_for_walls_begins_where_a_fit_finds_the_one_that_is_there() {
        // The first half way between two leans.
        is_found([0.7, 0.305], 0.37);
        is_found([3.6575, -0.0809], 0.1594);
    }

    fn is_found(direction: [f64; 2], distance_m: f64) {
        let bench = Bench::new();
        let places = |count: u32, z_m: f64| -> Vec<Vec3> {
            let at = |n: u32| Vec3::new(f64::from(n % 20) - 9.5, f64::from(n / 20) - 4.5, 0.0);
            (0..count).map(|n| 4e-3 * at(n) + Vec3::z() * z_m).collect()
        };
        let focused = bench.believed().excitation.clone();
        let mut observations = bench
            .observations(&[(focused, places(200, 0.1)), (Excitation::Uniform, places(120, 0.13))]);
        let coefficient = Complex64::from(0.4);
        let wall = Wall::returning(direction, distance_m, coefficient, &bench.context);
        let model = bench.model(EffectId::Wall, &wall);
        let mut readings = model.expected_readings(&observations, &[nuisance()]).into_iter();
        let scan = &mut observations.scans[0];
        for drive in &mut scan.drives {
            drive.readings = readings.by_ref().take(drive.visits.len()).collect();
            drive.stabilised =
                drive.readings.iter().map(|reading| scan.scale.of(*reading)).collect();
        }
        let nothing = Fit::of_nothing(vec![nuisance()]);
        let found = QuickScores::of(&nothing, &observations, &bench.context).walls(&bench.context);
        let best = &found[0];
        let step_rad = TAU / DIRECTIONS as f64;
        for (found_rad, truly_rad) in best.iter().zip(direction) {
            assert!((found_rad - truly_rad).abs() < step_rad, "{found:?}");
        }
        // Of a wall that leans a little more the distance is a little larger: the fit finds its way from there.
        let instance = Instance { effect: effect(EffectId::Wall), choice: Choice::None };
        let start = Start {
            instances: vec![instance],
            values: vec![best.clone()],
            spreads: vec![f64::NAN],
            nuisance: Some(vec![nuisance()].into()),
        };
        let fitted = &fit(&observations, &bench.context, start, SEARCH).values[0];
        for (found_rad, truly_rad) in fitted.iter().zip(direction) {
            assert!((found_rad - truly_rad).abs() < 5e-3, "{found:?} {fitted:?}");
        }
        assert!((fitted[2] / (1e3 * distance_m) - 1.0).abs() < 0.015, "{found:?} {fitted:?}");
    }
}
