//! Score tests for causes outside the catalogue.
//!
//! Along a direction that was not fitted, the slope of the likelihood is zero except for noise of known variance (C. R. Rao, Proc. Camb.
//! Phil. Soc. 44, 50, 1948). The fitted directions are projected out of each direction. A cause that the fit can imitate is not seen;
//! any other shows nearly undiminished.

use fieldgap_acoustics::{Element, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::fit::score_statistic::{ScoreStatistic, ScoreStatistics};
use crate::limits::{FEWEST_ELEMENTS, IMITATED, MOST_OF_SCATTER, PATTERN_LIMIT};
use crate::model::observations::Visit;
use crate::residual_structure::patterns::mean_square;
use crate::residual_structure::test::Test;
use crate::selection::starts::turns_along;
use crate::statistics::significance::{less_by_chance, z_of_sum_of_squares};

/// Effects that are tested in addition to the fitted ones: those of the air, which changes first.
const OF_THE_AIR: [EffectId; 2] = [EffectId::SoundSpeed, EffectId::Flow];

/// Cosines over the time of a scan: four contain nine tenths of the power of a step.
const ORDERS: usize = 4;

/// The same over the field, along each axis.
const ORDERS_OF_PLACE: usize = 2;

/// Exponent by which the amplitude of an element follows the speed of sound at its place, as a standard deviation. A face of given velocity emits
/// in proportion to the density, c^-2 in a gas; along a ray the amplitude goes as the root of ρc (Pierce, *Acoustics*, section 8-5), c^-1/2; and
/// the resonance of a transducer moves with its temperature.
const WITH_AIR: f64 = 2.0;

/// Smooth functions of the place of an element, over an array of unit size.
const GRADED: [fn(f64, f64) -> f64; 5] =
    [|x, _| x, |_, y| y, |x, y| x * x + y * y, |x, y| x * x - y * y, |x, y| x * y];

/// The tests of a fit with these residuals.
pub(crate) fn tests(scores: &ScoreStatistics<'_>, residuals: &[f64]) -> Vec<Test> {
    let asked = Asked { scores, power: mean_square(residuals), directions: directions(scores) };
    let tests = [asked.on_the_way(), asked.over_the_field(), asked.screws()];
    asked.graded_elements().into_iter().chain(tests).collect()
}

/// A fit under test.
struct Asked<'p, 'o> {
    scores: &'p ScoreStatistics<'o>,
    /// Mean square of the residuals.
    power: f64,
    /// Derivatives of the readings, each with the name of its quantity.
    directions: Vec<(&'static str, Vec<f64>)>,
}

/// Derivatives of the readings by the fitted quantities and by those of the air. Quantities that change the scatter are left out: their
/// slope is not a sum over readings.
fn directions(scores: &ScoreStatistics<'_>) -> Vec<(&'static str, Vec<f64>)> {
    let held = scores.fit.ids();
    let asked = OF_THE_AIR.into_iter().filter(|id| !held.contains(id));
    let of_air = asked.flat_map(|id| {
        let effect = effect(id);
        let columns = scores.columns_of(effect, &effect.neutral());
        columns.into_iter().map(move |column| (id.as_str(), column))
    });
    let readings = scores.observations.len();
    let only_means = |(_, column): &(&str, Vec<f64>)| {
        let phases = if scores.observations.have_phases() { readings } else { 0 };
        let (of_means, of_scatter) = column[..column.len() - phases].split_at(readings);
        let power = |part: &[f64]| part.iter().map(|d| d * d).sum::<f64>();
        power(of_scatter) <= MOST_OF_SCATTER * power(of_means)
    };
    let fitted = scores.smooth_columns().map(|(name, column)| (name, column.to_vec()));
    fitted.chain(of_air).filter(only_means).collect()
}

impl Asked<'_, '_> {
    /// Whether amplitudes or phases vary smoothly across the array: a bowed board, a sagging supply. A linear slope of phases only steers the
    /// beam, which the catalogue covers. Fitted departures have a test of their own, and what a fitted gradient of the air does to the
    /// amplitudes is none.
    fn graded_elements(&self) -> Option<Test> {
        let scores = self.scores;
        let elements = scores.observations.first().believed.array.elements();
        if elements.len() < FEWEST_ELEMENTS || scores.fit.has_random_elements() {
            return None;
        }
        let from_middle = elements.iter().map(|element| element.centre_m.xy().norm());
        let size_m = from_middle.fold(f64::MIN_POSITIVE, f64::max);
        let along = |by_element: &[Vec<f64>], weight: &dyn Fn(&Element) -> f64| {
            let mut along = vec![0.0; by_element[0].len()];
            for (element, column) in elements.iter().zip(by_element) {
                let weight = weight(element);
                along.iter_mut().zip(column).for_each(|(sum, value)| *sum += weight * value);
            }
            along
        };
        let [gains, phases] = [EffectId::ElementGain, EffectId::ElementPhase]
            .map(|id| scores.columns_of(effect(id), &vec![0.0; elements.len()]));
        let mut directions = Vec::new();
        for (by_element, shapes) in [(&gains, &GRADED[..]), (&phases, &GRADED[2..])] {
            directions.extend(shapes.iter().map(|shape| {
                along(by_element, &|element| {
                    shape(element.centre_m.x / size_m, element.centre_m.y / size_m)
                })
            }));
        }
        let count = directions.len() as f64;
        let with_air = scores.fit.values_of(EffectId::TemperatureGradient).map(|gradient_per_m| {
            let gradient_per_m = Vec3::from_column_slice(gradient_per_m);
            along(&gains, &|element| gradient_per_m.dot(&element.centre_m))
        });
        let statistic = match with_air {
            Some(column) => {
                directions.push(column);
                scores.of_columns(&directions).beside_last(WITH_AIR)
            }
            None => scores.of_columns(&directions),
        };
        let z = self.z_of(&statistic, count);
        Some(Test::of_one_thing("elements graded across the array", z, None))
    }

    /// Whether a fitted quantity, or the air, changes during the scan (parameter constancy: F. Nyblom, J. Am. Stat. Assoc. 84, 223, 1989): a
    /// step of gain, a wind that sets in, a room that cools.
    fn on_the_way(&self) -> Test {
        let cosines =
            |order: usize| self.at_visits(|visit| (PI * order as f64 * visit.progress).cos());
        let over_time: Vec<Vec<f64>> = (1..=ORDERS).map(cosines).collect();
        self.of_directions("a set-up that changes on the way", &over_time)
    }

    /// Whether it changes over the field: warm air over a device, a bent axis.
    fn over_the_field(&self) -> Test {
        let mut over_field = Vec::new();
        for axis in 0..3 {
            let (along_m, [from_m, to_m]) = self.along(axis);
            if to_m > from_m {
                over_field.extend((1..=ORDERS_OF_PLACE).map(|order| -> Vec<f64> {
                    let turn = PI * order as f64 / (to_m - from_m);
                    along_m.iter().map(|m| (turn * (m - from_m)).cos()).collect()
                }));
            }
        }
        // (This many directions also find small errors of the formulas.)
        Test {
            limit: PATTERN_LIMIT.get(),
            ..self.of_directions("a set-up that differs over the field", &over_field)
        }
    }

    /// Whether the position along an axis has a periodic error: a bent or badly cut lead screw.
    fn screws(&self) -> Test {
        let shifts = self.scores.shift_columns();
        let mut found = Vec::new();
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let (along_m, _) = self.along(axis);
            for per_m in turns_along(&along_m) {
                let shapes = [f64::cos, f64::sin].map(|shape| -> Vec<f64> {
                    along_m.iter().map(|m| shape(TAU * per_m * m)).collect()
                });
                let sign = format!("of {name}, {:.1} mm a turn", 1e3 / per_m);
                found.push((self.z_of_shapes(&shifts[axis], &shapes), sign));
            }
        }
        rarest("a screw that is out of true", found)
    }

    /// Whether a quantity varies over the readings in one of these shapes.
    fn of_directions(&self, name: &'static str, shapes: &[Vec<f64>]) -> Test {
        let found = self
            .directions
            .par_iter()
            .map(|(of, direction)| (self.z_of_shapes(direction, shapes), format!("of {of}")));
        rarest(name, found.collect())
    }

    /// A function of every visit, in the order of the readings.
    fn at_visits(&self, of: impl Fn(&Visit) -> f64) -> Vec<f64> {
        let drives = self.scores.observations.scans.iter().flat_map(|scan| &scan.drives);
        drives.flat_map(|drive| drive.visits.iter().map(&of)).collect()
    }

    /// The position of every visit along an axis, and their range, m.
    fn along(&self, axis: usize) -> (Vec<f64>, [f64; 2]) {
        let along_m = self.at_visits(|visit| visit.at_m[axis]);
        let from_m = along_m.iter().copied().fold(f64::INFINITY, f64::min);
        let to_m = along_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (along_m, [from_m, to_m])
    }

    fn z_of_shapes(&self, direction: &[f64], shapes: &[Vec<f64>]) -> f64 {
        let shaped = |shape: &Vec<f64>| -> Vec<f64> {
            // (The variance terms follow the readings, in the same order.)
            direction.iter().zip(shape.iter().cycle()).map(|(d, s)| d * s).collect()
        };
        self.z(&shapes.iter().map(shaped).collect::<Vec<_>>())
    }

    /// Significance of the residuals' sum of squares along a group of directions.
    fn z(&self, directions: &[Vec<f64>]) -> f64 {
        self.z_of(&self.scores.of_columns(directions), directions.len() as f64)
    }

    fn z_of(&self, statistic: &ScoreStatistic, directions: f64) -> f64 {
        let gained = statistic.gained_beside(IMITATED).unwrap_or(0.0);
        z_of_sum_of_squares(gained / self.power, directions)
    }
}

/// The most significant result, with its interpretation.
fn rarest(name: &'static str, found: Vec<(f64, String)>) -> Test {
    let count = found.len() as f64;
    let rarest = found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let (z, sign) = rarest.map_or((0.0, None), |(z, sign)| (less_by_chance(z, count), Some(sign)));
    Test::of_one_thing(name, z, sign)
}
