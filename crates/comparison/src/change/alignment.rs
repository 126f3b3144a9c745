//! The second record laid on the first: a shift, or a turn about z and a shift, by which its readings agree best with the map of the first.
//!
//! The reference is a measured map. It is read between its points by polynomials ([`Polynomial`]), and each reading has the noise of both records and
//! the error of the interpolation. Noise makes slopes of a map that its field does not have; what it adds to the information about a shift
//! is known and taken off, so that a flat field is told as undetermined and not as known.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde::Serialize;

use super::alignment_search::starts;
use super::polynomial::Polynomial;
use crate::registration::Estimate;
use fieldgap_text::{Uncertain, uncertain};

/// A direction of the parameters, and its information.
type Informed = (DVector<f64>, f64);

/// How the second record is aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aligning {
    /// Not at all.
    None,
    /// By a shift in x and y.
    Shift,
    /// By a turn about z and a shift in x and y.
    Pose,
    /// By as much as the readings show.
    Auto,
}

/// Share of the places of the second record that must lie within the first.
pub(super) const LEAST_OVERLAP: f64 = 0.5;

/// Readings with which a start is compared at most.
const SOME: usize = 400;

/// Standard errors by which `auto` must see a shift, and a turn, before it applies one.
const SHOWN: f64 = 4.0;

/// An alignment with at most this times the squared difference is as good, as in a registration.
const AS_GOOD: f64 = 1.1;

/// Standard deviations by which the information about a direction exceeds that of noise alone.
const BEYOND_NOISE: f64 = 4.0;

/// Correlation below which two maps are unlike in every position, as in a registration.
const ALIKE: f64 = 0.6;

/// Steps of a fit at most; a shift of a hundredth of a micrometre ends it.
const STEPS: usize = 25;
const ENOUGH_M: f64 = 1e-8;

/// Where the second record lies in the coordinates of the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alignment {
    /// What was asked for.
    pub requested: Aligning,
    /// What was applied; never [`Aligning::Auto`].
    pub chosen: Aligning,
    /// The reason, in a sentence.
    pub why: String,
    /// Shift along x and y, m: places of B after their turn about the origin, plus this, are places of A.
    pub shift_m: [Estimate; 2],
    /// Turn about z, rad.
    pub turn_rad: Estimate,
    /// Share of the places of B that lie within the map of A.
    pub overlap: f64,
    /// What the readings do not determine, in sentences.
    pub undetermined: Vec<String>,
    /// Root mean square of the difference over that of A, as read, at the places as recorded; `None` where the records have none in common.
    pub gap_as_read: Option<f64>,
    /// The same with the gain taken out.
    pub gap_after_gain: Option<f64>,
    /// The same with gain and alignment taken out.
    pub gap_after_alignment: f64,
}

/// Why an alignment cannot be found.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Unaligned {
    /// No drive and height of both is a map.
    NoMap,
    /// In the best position too few places are common.
    LittleOverlap(f64),
    /// The maps agree in no position.
    Unlike(f64),
}

/// Where B lies: turned about the origin, then shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    pub shift_m: [f64; 2],
    pub turn_rad: f64,
}

impl Placement {
    pub const AS_RECORDED: Self = Self { shift_m: [0.0; 2], turn_rad: 0.0 };

    /// A place of B in the coordinates of A, m.
    pub fn of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        [cos * x - sin * y + self.shift_m[0], sin * x + cos * y + self.shift_m[1]]
    }
}

/// A place of B that was read, in its own coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaceOfB {
    pub at_m: [f64; 2],
    pub reading: f64,
    pub error: f64,
}

/// One drive at one height in both.
pub(super) struct Layer<'m> {
    pub map: Polynomial<'m>,
    pub places: Vec<PlaceOfB>,
}

/// All drives and heights that both records have.
pub(super) struct Layers<'m> {
    pub layers: Vec<Layer<'m>>,
    pub wavelength_m: f64,
}

/// A placement with what it leaves.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub placement: Placement,
    /// Mean squared difference in units of its variance.
    pub chi_square: f64,
    pub overlap: f64,
    pub correlation: f64,
    /// Standard errors of shift along x and y, and of the turn; infinite where undetermined, zero where held.
    pub errors: [f64; 3],
    /// Directions of (x, y, turn) that the readings do not determine, each of unit length with the turn in its arc at the map's edge.
    pub undetermined: Vec<[f64; 3]>,
}

impl<'m> Layers<'m> {
    pub fn places(&self) -> usize {
        self.layers.iter().map(|layer| layer.places.len()).sum()
    }

    /// Arc of one radian at the edge of the maps, m.
    fn arm_m(&self) -> f64 {
        let sides = self.layers.iter().map(|layer| {
            let [x, y] = layer.map.half_sides_m();
            x.max(y)
        });
        sides.fold(1e-3, f64::max)
    }

    /// Fits a placement from a start, on one place in `stride`.
    pub fn fitted(&self, start: Placement, turns: bool, stride: usize) -> Fitted {
        let arm_m = self.arm_m();
        let free = if turns { 3 } else { 2 };
        let mut placement = start;
        let mut normal = self.normal_equations(placement, arm_m, stride);
        for _ in 0..STEPS {
            let step = normal.step(free, self.wavelength_m);
            let longest = step.iter().fold(0.0f64, |most, part| most.max(part.abs()));
            // Beyond a fraction of a lobe the slopes mean nothing.
            let shrink = (0.1 * self.wavelength_m / longest.max(f64::MIN_POSITIVE)).min(1.0);
            let mut moved = false;
            for halving in 0..6 {
                let factor = shrink * 0.5f64.powi(halving);
                let next = Placement {
                    shift_m: [0, 1].map(|axis| placement.shift_m[axis] + factor * step[axis]),
                    turn_rad: placement.turn_rad + factor * step[2] / arm_m,
                };
                let there = self.normal_equations(next, arm_m, stride);
                if there.count > 0 && there.chi_square() < normal.chi_square() {
                    (placement, normal, moved) = (next, there, true);
                    break;
                }
            }
            if !moved || longest * shrink < ENOUGH_M {
                break;
            }
        }
        let (errors, undetermined) = normal.errors(free, self.wavelength_m, arm_m);
        let places = self.layers.iter().map(|layer| layer.places.len().div_ceil(stride));
        Fitted {
            placement,
            chi_square: normal.chi_square(),
            overlap: normal.count as f64 / places.sum::<usize>().max(1) as f64,
            correlation: normal.correlation,
            errors,
            undetermined,
        }
    }

    /// Everything that one placement says.
    fn normal_equations(&self, placement: Placement, arm_m: f64, stride: usize) -> Normal {
        let mut read = Vec::new();
        for layer in &self.layers {
            for place in layer.places.iter().step_by(stride) {
                let [x, y] = placement.of(place.at_m);
                if let Some(a) = layer.map.at(x, y) {
                    // The turn moves a place along its arc.
                    let arc = [-(y - placement.shift_m[1]), x - placement.shift_m[0]];
                    read.push((a, *place, arc.map(|arc| arc / arm_m)));
                }
            }
        }
        let sums = read.iter().fold([0.0; 5], |[a, b, aa, bb, ab], (of_a, of_b, _)| {
            let (x, y) = (of_a.value, of_b.reading);
            [a + x, b + y, aa + x * x, bb + y * y, ab + x * y]
        });
        let count = read.len() as f64;
        let gain = sums[4] / sums[2].max(f64::MIN_POSITIVE);
        let covariance = sums[4] - sums[0] * sums[1] / count;
        let spreads = (sums[2] - sums[0] * sums[0] / count) * (sums[3] - sums[1] * sums[1] / count);
        let mut normal = Normal {
            count: read.len(),
            cost: 0.0,
            correlation: covariance / spreads.max(f64::MIN_POSITIVE).sqrt(),
            information: DMatrix::zeros(4, 4),
            of_noise: DMatrix::zeros(3, 3),
            downhill: DVector::zeros(4),
        };
        for (a, b, arc) in read {
            let variance = (b.error * b.error + gain * gain * a.variance).max(f64::MIN_POSITIVE);
            let along_arc = a.slopes[0] * arc[0] + a.slopes[1] * arc[1];
            let columns = DVector::from_vec(vec![
                gain * a.slopes[0],
                gain * a.slopes[1],
                gain * along_arc,
                gain * a.value,
            ]);
            let residual = b.reading - gain * a.value;
            normal.cost += residual * residual / variance;
            normal.downhill += &columns * (residual / variance);
            normal.information += &columns * columns.transpose() / variance;
            let [x, y] = a.slope_variances.map(|square| gain * gain * square / variance);
            // The slopes along x and y are independent, and that along the arc is made of them.
            let [along_x, along_y] =
                [[1.0, 0.0, arc[0]], [0.0, 1.0, arc[1]]].map(|by| DVector::from_row_slice(&by));
            normal.of_noise +=
                &along_x * along_x.transpose() * x + &along_y * along_y.transpose() * y;
        }
        normal
    }
}

/// The normal equations for x, y, turn (in its arc) and the logarithm of the gain.
struct Normal {
    count: usize,
    cost: f64,
    correlation: f64,
    information: DMatrix<f64>,
    /// What noise adds to the information about x, y and turn.
    of_noise: DMatrix<f64>,
    downhill: DVector<f64>,
}

impl Normal {
    fn chi_square(&self) -> f64 {
        self.cost / self.count.max(1) as f64
    }

    /// Information about the free parameters with the gain fitted, and what noise alone would give of it.
    fn reduced(&self, free: usize) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let of_gain = self.information[(3, 3)].max(f64::MIN_POSITIVE);
        let reduced = DMatrix::from_fn(free, free, |i, j| {
            self.information[(i, j)] - self.information[(i, 3)] * self.information[(j, 3)] / of_gain
        });
        let downhill = DVector::from_fn(free, |i, _| {
            self.downhill[i] - self.information[(i, 3)] * self.downhill[3] / of_gain
        });
        let of_noise = self.of_noise.view((0, 0), (free, free)).into_owned();
        (reduced, downhill, of_noise)
    }

    /// The directions that the readings determine, and those that they do not.
    fn known(&self, free: usize, wavelength_m: f64) -> (Vec<Informed>, Vec<DVector<f64>>) {
        let (reduced, _, of_noise) = self.reduced(free);
        let eigen = SymmetricEigen::new(&reduced - &of_noise);
        let inflation = self.chi_square().max(1.0);
        let (mut known, mut unknown) = (Vec::new(), Vec::new());
        for (n, information) in eigen.eigenvalues.iter().enumerate() {
            let direction = eigen.eigenvectors.column(n).into_owned();
            let noise = direction.dot(&(&of_noise * &direction));
            // A sum of so many squares scatters by √(2/n) of itself.
            let by_chance = BEYOND_NOISE * (2.0 / self.count.max(1) as f64).sqrt() * noise;
            let error_m = (inflation / information.max(f64::MIN_POSITIVE)).sqrt();
            match *information > by_chance && error_m < wavelength_m / 8.0 {
                true => known.push((direction, *information)),
                false => unknown.push(direction),
            }
        }
        (known, unknown)
    }

    /// The step of x, y and turn (in its arc), along the directions that are determined.
    fn step(&self, free: usize, wavelength_m: f64) -> [f64; 3] {
        let (reduced, downhill, _) = self.reduced(free);
        let mut step = [0.0; 3];
        for (direction, _) in self.known(free, wavelength_m).0 {
            let curvature = direction.dot(&(&reduced * &direction)).max(f64::MIN_POSITIVE);
            let along = direction.dot(&downhill) / curvature;
            (0..free).for_each(|n| step[n] += along * direction[n]);
        }
        step
    }

    /// Standard errors of x, y and turn in rad, and the directions without one.
    ///
    /// The estimate's scatter is that of the slope of the cost, whose variance holds what noise adds, over the curvature by the field alone.
    fn errors(&self, free: usize, wavelength_m: f64, arm_m: f64) -> ([f64; 3], Vec<[f64; 3]>) {
        /// Component along an axis from which on an undetermined direction leaves it unknown.
        const PART: f64 = 0.1;
        let (known, unknown) = self.known(free, wavelength_m);
        let (reduced, _, _) = self.reduced(free);
        let inflation = self.chi_square().max(1.0);
        let mut errors = [0.0; 3];
        for (axis, error) in errors.iter_mut().enumerate().take(free) {
            let square: f64 = known
                .iter()
                .map(|(direction, information)| {
                    let scatter = direction.dot(&(&reduced * direction));
                    direction[axis].powi(2) * scatter / information.powi(2)
                })
                .sum();
            *error = (inflation * square).sqrt();
            if unknown.iter().any(|direction| direction[axis].abs() > PART) {
                *error = f64::INFINITY;
            }
        }
        errors[2] /= arm_m;
        let whole =
            |direction: &DVector<f64>| [0, 1, 2].map(|n| if n < free { direction[n] } else { 0.0 });
        (errors, unknown.iter().map(whole).collect())
    }
}

/// The alignment of layers that are not empty. What it removes of the gap is filled in by the comparison.
pub(super) fn align(
    layers: &Layers<'_>,
    requested: Aligning,
) -> Result<(Fitted, Alignment), Unaligned> {
    if layers.layers.is_empty() {
        return Err(Unaligned::NoMap);
    }
    let stride = layers.places().div_ceil(SOME).max(1);
    let turns = requested == Aligning::Pose;
    let here = layers.fitted(Placement::AS_RECORDED, turns, 1);
    let free = if turns { 3 } else { 2 };
    let is_flat = here.undetermined.len() == free;
    let (shifted, rival) = match is_flat {
        true => (here, None),
        false => best(layers, turns, stride),
    };
    if shifted.overlap < LEAST_OVERLAP {
        return Err(Unaligned::LittleOverlap(shifted.overlap));
    }
    if !is_flat && shifted.correlation < ALIKE {
        return Err(Unaligned::Unlike(shifted.correlation));
    }
    let (chosen, mut fitted, why) = match requested {
        Aligning::Auto => chosen(layers, shifted),
        _ if is_flat => (
            Aligning::None,
            Fitted { placement: Placement::AS_RECORDED, ..shifted },
            "the field is too flat to show a shift".to_owned(),
        ),
        _ => (requested, shifted, "as asked".to_owned()),
    };
    if chosen == Aligning::None {
        fitted.placement = Placement::AS_RECORDED;
    }
    let mut undetermined: Vec<String> = fitted.undetermined.iter().map(in_words).collect();
    undetermined.extend(rival.map(|rival| {
        let [x, y] = rival.placement.shift_m.map(|m| m * 1e3);
        format!(
            "which of several positions; a shift of {x:.1} mm along x and {y:.1} mm along y with a turn of {:.1}° agrees nearly as well, as the field \
             repeats itself",
            rival.placement.turn_rad.to_degrees()
        )
    }));
    let applied = chosen != Aligning::None;
    let estimate = |value: f64, error: f64, estimated: bool| Estimate {
        value: if estimated { value } else { 0.0 },
        standard_error: if estimated { error } else { 0.0 },
        estimated,
    };
    let alignment = Alignment {
        requested,
        chosen,
        why,
        shift_m: [0, 1]
            .map(|axis| estimate(fitted.placement.shift_m[axis], fitted.errors[axis], applied)),
        turn_rad: estimate(fitted.placement.turn_rad, fitted.errors[2], chosen == Aligning::Pose),
        overlap: fitted.overlap,
        undetermined,
        gap_as_read: None,
        gap_after_gain: None,
        gap_after_alignment: f64::NAN,
    };
    Ok((fitted, alignment))
}

/// The best placement from all starts, and another that is as good and far from it.
fn best(layers: &Layers<'_>, turns: bool, stride: usize) -> (Fitted, Option<Fitted>) {
    /// Starts of which the best are fitted to all places.
    const FITTED: usize = 3;
    let mut tried: Vec<Fitted> = starts(layers, turns)
        .into_iter()
        .map(|start| layers.fitted(start, turns, stride))
        .filter(|fitted| fitted.overlap >= LEAST_OVERLAP)
        .collect();
    if tried.is_empty() {
        tried.push(layers.fitted(Placement::AS_RECORDED, turns, stride));
    }
    tried.sort_by(|one, other| one.chi_square.total_cmp(&other.chi_square));
    let is_far = |one: &Fitted, other: &Fitted| {
        let apart = [0, 1].map(|n| one.placement.shift_m[n] - other.placement.shift_m[n]);
        let turn = one.placement.turn_rad - other.placement.turn_rad;
        apart[0].hypot(apart[1]) + turn.abs() * layers.arm_m() > 0.25 * layers.wavelength_m
    };
    let mut distinct: Vec<Fitted> = Vec::new();
    for fitted in tried {
        if distinct.len() < FITTED && distinct.iter().all(|kept| is_far(kept, &fitted)) {
            distinct.push(fitted);
        }
    }
    let mut fitted: Vec<Fitted> =
        distinct.iter().map(|start| layers.fitted(start.placement, turns, 1)).collect();
    fitted.sort_by(|one, other| one.chi_square.total_cmp(&other.chi_square));
    let best = fitted.remove(0);
    let rival = fitted
        .into_iter()
        .find(|other| is_far(&best, other) && other.chi_square < AS_GOOD * best.chi_square);
    (best, rival)
}

/// What `auto` applies: no more than the readings show.
fn chosen(layers: &Layers<'_>, shifted: Fitted) -> (Aligning, Fitted, String) {
    let turned = layers.fitted(shifted.placement, true, 1);
    let turn = Uncertain {
        value: turned.placement.turn_rad.to_degrees(),
        standard_error: turned.errors[2].to_degrees(),
    };
    if turn.value.abs() > SHOWN * turn.standard_error && turned.chi_square < shifted.chi_square {
        let why = format!("the readings show a turn of {}°", uncertain(turn));
        return (Aligning::Pose, turned, why);
    }
    let is_shown =
        (0..2).any(|axis| shifted.placement.shift_m[axis].abs() > SHOWN * shifted.errors[axis]);
    match is_shown {
        true => (Aligning::Shift, shifted, "the readings show a shift and no turn".to_owned()),
        false => {
            let why = "the readings show neither a shift nor a turn".to_owned();
            (Aligning::None, shifted, why)
        }
    }
}

/// A direction that is not determined, in words.
fn in_words([x, y, turn]: &[f64; 3]) -> String {
    const PART: f64 = 0.3;
    let parts: Vec<&str> = [(x, "the shift along x"), (y, "the shift along y"), (turn, "the turn")]
        .into_iter()
        .filter(|(part, _)| part.abs() > PART)
        .map(|(_, name)| name)
        .collect();
    match parts.len() {
        1 => format!("{}; the field hardly changes with it", parts[0]),
        _ => format!("a combination of {}", parts.join(" and ")),
    }
}
