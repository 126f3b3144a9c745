//! The level at each reading of a plane, and its derivatives.
//!
//! a = √( |Σ d w T exp(λ·u - ik u·δ + L(sin² θ))|² + b² ): d is the drive of an element, w its weight, T the simulator's field of it, u the
//! direction from it to the reading, δ its place beside the nominal one, λ the lean of its lobe, L what the lobes of all have beyond the
//! simulator's, b the floor. The readings lie where the pose has them.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;

use super::dense::{add_down, add_gram};
use super::grid::Grid;
use super::parameters::{Group, Layout, Shared};
use crate::readings::CodedReadings;
use fieldgap_acoustics::{Array, Element, FieldKernel, PathLengths, Simulation, Vec3};
use fieldgap_comparison::{Mirror, Pose};

/// Readings whose derivatives are held at once.
const CHUNK: usize = 2048;

/// Readings of planes and the array that is thought to have made them.
pub struct PlaneModel<'a> {
    simulation: &'a Simulation,
    /// The simulator's field of each element.
    kernels: Arc<[FieldKernel]>,
    readings: &'a CodedReadings,
    grid: &'a Grid,
    mirror: Mirror,
    wavenumber: f64,
    /// Unit of the levels: rms of all readings.
    rms: f64,
    /// Readings that are used.
    pub keep: Vec<usize>,
}

/// Half the curvature of the squared residuals, and the way down.
pub struct Normal {
    /// Jᵀ J.
    pub curvature: DMatrix<f64>,
    /// -Jᵀ r.
    pub downhill: DVector<f64>,
}

/// An element seen from some readings.
struct Seen {
    /// Its field with weight one, with the drive.
    unit: Vec<Complex32>,
    /// Direction cosines along x, y and z, and sin² of the angle from its axis.
    directions: Vec<[f32; 4]>,
}

impl<'a> PlaneModel<'a> {
    /// The model of all readings.
    pub fn new(
        simulation: &'a Simulation,
        readings: &'a CodedReadings,
        grid: &'a Grid,
        mirror: Mirror,
    ) -> Self {
        let level = |&element: &Element| Element { amplitude: 1.0, phase_rad: 0.0, ..element };
        let elements = simulation.array.elements().iter().map(level).collect();
        let mut array = Array::from_elements(elements).expect("as many elements as before");
        if let Some(transducer) = simulation.array.shared_transducer() {
            array = array.with_transducer(transducer);
        }
        let wavenumber = simulation.medium.wavenumber_rad_m(simulation.frequency_hz);
        let transducer = simulation.simulator.transducer(&array);
        let still = vec![0.0; array.len()];
        let kernel =
            FieldKernel::new(&array, &still, transducer, wavenumber, PathLengths::Observed);
        let kernels = (0..array.len()).map(|n| kernel.of_element(n)).collect();
        let (rms, keep) = (readings.rms(), (0..readings.readings.len()).collect());
        Self { simulation, kernels, readings, grid, mirror, wavenumber, rms, keep }
    }

    /// The same of some readings.
    pub fn of(&self, keep: Vec<usize>) -> Self {
        Self { kernels: self.kernels.clone(), keep, ..*self }
    }

    /// The readings that are used, in units of the rms of all.
    pub fn values(&self) -> Vec<f64> {
        self.keep.iter().map(|&n| self.readings.readings[n].value / self.rms).collect()
    }

    /// The grid of the readings.
    pub fn grid(&self) -> &Grid {
        self.grid
    }

    /// Radians per metre.
    pub fn wavenumber(&self) -> f64 {
        self.wavenumber
    }

    /// How steeply the simulator's lobe falls: a of exp(-a sin² θ) near the axis, mean of all elements.
    pub fn steepness(&self) -> f64 {
        let elements = self.simulation.array.elements();
        let fall = |(element, kernel): (&Element, &FieldKernel)| {
            // Far from the face, on the axis and ten degrees off it.
            let across = element.normal.cross(&Vec3::x());
            let across = if across.norm() > 0.1 { across.normalize() } else { Vec3::z() };
            let off = 10f64.to_radians();
            let aside = element.centre_m + element.normal * off.cos() + across * off.sin();
            let fields = kernel.at(&[element.centre_m + element.normal, aside]);
            (fields[0].norm() / fields[1].norm()).ln() / off.sin().powi(2)
        };
        elements.iter().zip(&*self.kernels).map(fall).sum::<f64>() / elements.len() as f64
    }

    /// The parameters of an array as it is thought to be, in a pose.
    pub fn start(&self, layout: &Layout, pose: &Pose, face_m: f64) -> Vec<f64> {
        let mut x = vec![0.0; layout.len()];
        x[..layout.elements].fill(1.0);
        let mut set = |which, value| x[layout.shared(which)] = value;
        (0..3).for_each(|axis| set(Shared::Shift(axis), pose.shift_m[axis]));
        (0..2).for_each(|axis| set(Shared::Step(axis), pose.step_ratio));
        set(Shared::Turn, pose.turn_rad);
        // The lobe of a receiver's face: 2 J₁(z)/z = 1 - z²/8 + ...
        set(Shared::Lobe(1), -(self.wavenumber * face_m).powi(2) / 8.0);
        let levels = self.levels(layout, &x);
        let values = self.values();
        let product: f64 = levels.iter().zip(&values).map(|(level, value)| level * value).sum();
        let square: f64 = levels.iter().map(|level| level * level).sum();
        x[layout.shared(Shared::Level)] = (product / square.max(f64::MIN_POSITIVE)).ln();
        // What the darkest twentieth of the readings still shows.
        let mut sorted = values;
        sorted.sort_by(f64::total_cmp);
        x[layout.shared(Shared::Floor)] = sorted[sorted.len() / 20].max(1e-3);
        x
    }

    /// The levels at the readings, in units of their rms.
    pub fn levels(&self, layout: &Layout, x: &[f64]) -> Vec<f64> {
        let floor = x[layout.shared(Shared::Floor)];
        let of = |keep: &[usize]| {
            let fields = self.totals(layout, x, keep);
            fields.into_iter().map(|field| field.norm().hypot(floor)).collect::<Vec<f64>>()
        };
        self.keep.chunks(CHUNK).flat_map(of).collect()
    }

    /// The normal equations about some parameters, with each residual in units of its `sd`.
    pub fn normal(&self, layout: &Layout, x: &[f64], sd: &[f64]) -> Normal {
        let n = layout.len();
        let mut normal = Normal { curvature: DMatrix::zeros(n, n), downhill: DVector::zeros(n) };
        for (keep, sd) in self.keep.chunks(CHUNK).zip(sd.chunks(CHUNK)) {
            let (columns, downwards) = self.columns(layout, x, keep, sd);
            add_gram(&mut normal.curvature, &columns);
            add_down(&mut normal.downhill, &columns, &downwards);
        }
        normal
    }

    /// Derivatives at some readings, and minus their residuals, both in units of `sd`.
    fn columns(
        &self,
        layout: &Layout,
        x: &[f64],
        keep: &[usize],
        sd: &[f64],
    ) -> (DMatrix<f32>, Vec<f64>) {
        let places = self.places(layout, x, keep);
        let seen = self.seen(layout, x, keep, &places);
        let weights = layout.weights(x);
        let rows = keep.len();
        let floor = x[layout.shared(Shared::Floor)];
        let mut total = vec![Complex64::ZERO; rows];
        let mut by_sine = [1, 2, 3].map(|_| vec![Complex64::ZERO; rows]);
        let mut by_direction = [0, 1, 2].map(|_| vec![Complex64::ZERO; rows]);
        for (seen, weight) in seen.iter().zip(&weights) {
            for row in 0..rows {
                let unit = Complex64::new(seen.unit[row].re.into(), seen.unit[row].im.into());
                let mut term = unit * weight;
                total[row] += term;
                for (sums, &part) in by_direction.iter_mut().zip(&seen.directions[row]) {
                    sums[row] += term * f64::from(part);
                }
                for sums in &mut by_sine {
                    term *= f64::from(seen.directions[row][3]);
                    sums[row] += term;
                }
            }
        }
        let mut downwards = Vec::with_capacity(rows);
        let mut along = Vec::with_capacity(rows);
        let mut levels = Vec::with_capacity(rows);
        for row in 0..rows {
            let level = total[row].norm().hypot(floor).max(f64::MIN_POSITIVE);
            let value = self.readings.readings[keep[row]].value / self.rms;
            downwards.push((value - level) / sd[row]);
            along.push(total[row].conj() / (level * sd[row]));
            levels.push(level);
        }
        let mut columns = DMatrix::<f32>::zeros(rows, layout.len());
        let (own, shared) = columns.as_mut_slice().split_at_mut(layout.shared_at() * rows);
        let starts: Vec<(Group, usize)> =
            layout.groups.iter().flat_map(|&g| (0..g.size()).map(move |axis| (g, axis))).collect();
        let k = self.wavenumber as f32;
        own.par_chunks_mut(rows).enumerate().for_each(|(column, out)| {
            let (group, axis) = starts[column / layout.elements];
            let element = column % layout.elements;
            let Seen { unit, directions } = &seen[element];
            let weight = Complex32::new(weights[element].re as f32, weights[element].im as f32);
            for row in 0..rows {
                let along = Complex32::new(along[row].re as f32, along[row].im as f32);
                let part = along * unit[row];
                out[row] = match group {
                    Group::Gain => part.re,
                    Group::Phase => -part.im,
                    Group::Place => k * directions[row][axis] * (part * weight).im,
                    Group::Lean => directions[row][axis] * (part * weight).re,
                };
            }
        });
        // With the place of a reading the phases turn. Distances and lobes change by a fiftieth of that, which is left to the next round.
        let by_place = Complex64::i() * self.wavenumber;
        for (which, out) in Shared::ALL.iter().zip(shared.chunks_mut(rows)) {
            for row in 0..rows {
                let by_field = |field: Complex64| (along[row] * field).re;
                out[row] = match *which {
                    Shared::Lobe(power) => by_field(by_sine[power - 1][row]),
                    Shared::LobePhase(power) => by_field(Complex64::i() * by_sine[power - 1][row]),
                    Shared::Lean(axis) => by_field(by_direction[axis][row]),
                    Shared::Level => by_field(total[row]),
                    Shared::Floor => floor / (levels[row] * sd[row]),
                    _ => {
                        let by = self.place_by(layout, x, keep[row], *which);
                        by_field(
                            (0..3).map(|axis| by_place * by_direction[axis][row] * by[axis]).sum(),
                        )
                    }
                } as f32;
            }
        }
        (columns, downwards)
    }

    /// A reading in the robot's frame, mirrored: before step and turn.
    fn recorded(&self, layout: &Layout, x: &[f64], n: usize) -> Vec3 {
        let [along, across] = [0, 1].map(|axis| x[layout.shared(Shared::Travel(axis))]);
        let [tx, ty] = self.grid.travel[n];
        let at = self.readings.places_m[self.readings.readings[n].place];
        let at = at + Vec3::new(along * tx - across * ty, along * ty + across * tx, 0.0);
        self.mirrored(at)
    }

    fn mirrored(&self, at: Vec3) -> Vec3 {
        match self.mirror {
            Mirror::None => at,
            Mirror::X => Vec3::new(-at.x, at.y, at.z),
            Mirror::Y => Vec3::new(at.x, -at.y, at.z),
        }
    }

    /// The places of some readings, array frame, m.
    fn places(&self, layout: &Layout, x: &[f64], keep: &[usize]) -> Vec<Vec3> {
        let get = |which| x[layout.shared(which)];
        let (sin, cos) = get(Shared::Turn).sin_cos();
        let [step_x, step_y] = [0, 1].map(|axis| get(Shared::Step(axis)));
        let [slope_x, slope_y] = [0, 1].map(|axis| get(Shared::Slope(axis)));
        let shift = Vec3::from_fn(|axis, _| get(Shared::Shift(axis)));
        let of = |&n: &usize| {
            let at = self.recorded(layout, x, n);
            let (sx, sy) = (step_x * at.x, step_y * at.y);
            let z = at.z + slope_x * at.x + slope_y * at.y;
            Vec3::new(cos * sx - sin * sy, sin * sx + cos * sy, z) + shift
        };
        keep.iter().map(of).collect()
    }

    /// How the place of a reading moves with a parameter of the pose.
    fn place_by(&self, layout: &Layout, x: &[f64], n: usize, which: Shared) -> Vec3 {
        let get = |which| x[layout.shared(which)];
        let (sin, cos) = get(Shared::Turn).sin_cos();
        let [step_x, step_y] = [0, 1].map(|axis| get(Shared::Step(axis)));
        let at = self.recorded(layout, x, n);
        let turned = |sx: f64, sy: f64| Vec3::new(cos * sx - sin * sy, sin * sx + cos * sy, 0.0);
        match which {
            Shared::Shift(axis) => Vec3::from_fn(|other, _| if other == axis { 1.0 } else { 0.0 }),
            Shared::Turn => turned(-step_y * at.y, step_x * at.x),
            Shared::Step(0) => turned(at.x, 0.0),
            Shared::Step(_) => turned(0.0, at.y),
            Shared::Slope(axis) => Vec3::new(0.0, 0.0, at[axis]),
            Shared::Travel(axis) => {
                let [tx, ty] = self.grid.travel[n];
                let by = if axis == 0 { Vec3::new(tx, ty, 0.0) } else { Vec3::new(-ty, tx, 0.0) };
                let by = self.mirrored(by);
                turned(step_x * by.x, step_y * by.y)
            }
            _ => Vec3::zeros(),
        }
    }

    /// The complex field at some readings.
    fn totals(&self, layout: &Layout, x: &[f64], keep: &[usize]) -> Vec<Complex64> {
        let places = self.places(layout, x, keep);
        let weights = layout.weights(x);
        // The sum of each part of the rows is taken by one thread.
        keep.par_chunks(CHUNK / 8)
            .zip(places.par_chunks(CHUNK / 8))
            .flat_map_iter(|(keep, places)| {
                let mut total = vec![Complex64::ZERO; keep.len()];
                for (element, weight) in weights.iter().enumerate() {
                    let field = self.of_element(layout, x, element, places);
                    for (row, (field, _)) in field.enumerate() {
                        let drive = self.drive(keep[row], element);
                        total[row] += weight * drive * field;
                    }
                }
                total
            })
            .collect()
    }

    fn seen(&self, layout: &Layout, x: &[f64], keep: &[usize], places: &[Vec3]) -> Vec<Seen> {
        let of = |element: usize| {
            let field = self.of_element(layout, x, element, places).enumerate();
            let (unit, directions) = field
                .map(|(row, (field, direction))| {
                    let field = self.drive(keep[row], element) * field;
                    let unit = Complex32::new(field.re as f32, field.im as f32);
                    (unit, direction.map(|part| part as f32))
                })
                .unzip();
            Seen { unit, directions }
        };
        (0..layout.elements).into_par_iter().map(of).collect()
    }

    fn drive(&self, n: usize, element: usize) -> Complex64 {
        self.readings.drives[self.readings.readings[n].drive][element]
    }

    /// The field of one element at some places, with its direction cosines and sin² of the angle from its axis.
    fn of_element<'b>(
        &'b self,
        layout: &Layout,
        x: &[f64],
        element: usize,
        places: &'b [Vec3],
    ) -> impl Iterator<Item = (Complex64, [f64; 4])> + 'b {
        let get = |which| x[layout.shared(which)];
        let lobe = [1, 2, 3].map(|power| get(Shared::Lobe(power)));
        let phase = [1, 2].map(|power| get(Shared::LobePhase(power)));
        let level = get(Shared::Level);
        let beside = layout.pair(x, Group::Place, element);
        let own = layout.pair(x, Group::Lean, element);
        let lean = [0, 1].map(|axis| own[axis] + get(Shared::Lean(axis)));
        let Element { centre_m, normal, .. } = self.simulation.array.elements()[element];
        let k = self.wavenumber;
        let fields = self.kernels[element].at(places);
        fields.into_iter().zip(places).map(move |(field, place)| {
            let u = (place - centre_m).normalize();
            let s = 1.0 - u.dot(&normal).powi(2);
            let modulus =
                level + s * (lobe[0] + s * (lobe[1] + s * lobe[2])) + lean[0] * u.x + lean[1] * u.y;
            let phase = s * (phase[0] + s * phase[1]) - k * (beside[0] * u.x + beside[1] * u.y);
            (field * Complex64::from_polar(modulus.exp(), phase), [u.x, u.y, u.z, s])
        })
    }
}
