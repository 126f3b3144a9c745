//! Where the search begins for waves that come from elsewhere than the elements: planes above the field and objects in it; [`walls`](super::walls) beside it have
//! a file of their own. Every place is tried with few readings, the strength of the wave solved for.

use fieldgap_acoustics::Vec3;
use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::effects::reflection::Reflection;
use crate::effects::scatterer::Scatterer;
use crate::limits::{
    BEYOND_CHANCE, FEWEST_OF_STRAY_WAVES, HIGHEST_PLANE_M, OBJECTS, PAIRS_OF_STRAY_WAVES, PLANES,
    START_SHORT_BY, TOUCHED_M,
};
use crate::model::effect::Context;
use crate::model::mirror::Mirror;
use crate::model::observations::Driven;
use crate::selection::cost_by_gain::Slope;
use crate::selection::quick_scores::{QuickScores, ScoredDrive, best_of};

/// Step between the heights tried for a plane, in wavelengths. The coefficient takes up the turn of the phase on the axis; 60 mm beside it and
/// 200 mm from the images the rest is a quarter of a radian in half a wavelength.
const HEIGHT_STEP: f64 = 0.25;

/// How far apart the heights are that a fit is started with, in wavelengths: it finds its way from one to the next.
const HEIGHTS_APART: f64 = 2.0;

/// Steps of a coefficient: a plane that returns a third of the sound is not small.
const STEPS: usize = 3;

/// Steps between places of an object, across and up, m: half the resolution of a scan there.
const OBJECT_STEPS_M: [f64; 3] = [4e-3, 4e-3, 5e-3];

/// Most places of an object: of a larger field the steps are wider.
const MOST_PLACES: f64 = 8e3;

impl QuickScores<'_> {
    /// Height, mm, and coefficient of the planes that explain most, as a fit works on them.
    pub fn heights(&self, context: &Context) -> Vec<Vec<f64>> {
        let wavelength_m = wavelength_m(context);
        let step_m = HEIGHT_STEP * wavelength_m;
        let still = self.slopes(self.stride, &[], Complex64::ZERO);
        let mut quick: Vec<(f64, f64)> = Vec::new();
        let mut height_m = context.highest_m + step_m;
        while height_m < context.highest_m + HIGHEST_PLANE_M {
            let images = self.images(self.stride, &Mirror::at_height(height_m));
            let expected_fall = Descent::of(&still, &images).expected_fall();
            quick.push((-expected_fall, height_m));
            height_m += step_m;
        }
        let ways = quick.len() as f64;
        let apart_m = HEIGHTS_APART * wavelength_m;
        let few = apart(quick, apart_m, 2 * PLANES).into_iter().map(|height_m| {
            let images = self.images(self.stride, &Mirror::at_height(height_m));
            (-self.solved(self.stride, &images).0, height_m)
        });
        let all = best_of(few.collect(), PLANES).into_iter().map(|height_m| {
            let images = self.images(1, &Mirror::at_height(height_m));
            let (fall, coefficient) = self.solved(1, &images);
            (-fall, Reflection::at_height(height_m, coefficient, context))
        });
        worth_a_fit(all.collect(), ways.ln() - START_SHORT_BY, PLANES)
    }

    /// The places of objects that explain most, as a fit works on them.
    pub fn objects(&self, context: &Context) -> Vec<Vec<f64>> {
        let stride = self.stride_of_waves(context);
        let still = self.slopes(stride, &[], Complex64::ZERO);
        let places_m = self.places_of_objects();
        let ways = places_m.len() as f64;
        let drives = self.each_drive(stride);
        let incident = self.fields(self.drives.iter().map(|drive| (drive, places_m.as_slice())));
        let wavenumber = self.model.wavenumber_rad_m(&context.believed);
        let waves = |place: usize, drives: &[(&ScoredDrive, Vec<Vec3>)], incident: &[Complex64]| {
            let mut waves = Vec::new();
            for (number, (_, points_m)) in drives.iter().enumerate() {
                let arrives = incident[number * places_m.len() + place];
                waves.extend(points_m.iter().map(|at_m| {
                    let distance_m = (at_m - places_m[place]).norm().max(TOUCHED_M);
                    arrives * Complex64::from_polar(1.0 / distance_m, wavenumber * distance_m)
                }));
            }
            waves
        };
        let quick = (0..places_m.len()).into_par_iter().map(|place| {
            (-Descent::of(&still, &waves(place, &drives, &incident)).expected_fall(), place)
        });
        let more = self.each_drive(self.stride);
        let best = best_of(quick.collect(), 4 * OBJECTS).into_iter().map(|place| {
            let (fall, strength) = self.solved(self.stride, &waves(place, &more, &incident));
            let ball = Scatterer::of_strength(places_m[place], strength.norm(), wavenumber);
            (-(self.stride as f64) * fall, ball)
        });
        worth_a_fit(best.collect(), ways.ln() + BEYOND_CHANCE, OBJECTS)
    }

    /// Places within the field and below it where the robot would not have touched an object.
    fn places_of_objects(&self) -> Vec<Vec3> {
        let readings_m: Vec<Vec3> =
            self.each_drive(1).into_iter().flat_map(|(_, at_m)| at_m).collect();
        let (mut least, mut most) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for at_m in &readings_m {
            (least, most) = (least.inf(at_m), most.sup(at_m));
        }
        least.z = least.z.min(OBJECT_STEPS_M[2]);
        let size = most - least;
        let count: f64 = (0..3).map(|axis| (size[axis] / OBJECT_STEPS_M[axis]).max(1.0)).product();
        let wider = (count / MOST_PLACES).cbrt().max(1.0);
        let steps = OBJECT_STEPS_M.map(|step_m| step_m * wider);
        let along = |axis: usize| {
            let count = (size[axis] / steps[axis]).floor().max(0.0) as usize;
            (0..=count).map(move |n| least[axis] + steps[axis] * n as f64).collect::<Vec<f64>>()
        };
        // (Readings lie in cells of the size of what was touched, so that only those nearby are looked at.)
        let cell = |at_m: &Vec3| (at_m / TOUCHED_M).map(|m| m.floor() as i64);
        let mut touched = std::collections::HashMap::<_, Vec<Vec3>>::new();
        for at_m in readings_m {
            touched.entry(cell(&at_m)).or_default().push(at_m);
        }
        let is_free = |at_m: &Vec3| {
            let own = cell(at_m);
            let near =
                (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| [x, y, z])));
            near.map(|[x, y, z]| own + nalgebra::Vector3::new(x, y, z))
                .filter_map(|cell| touched.get(&cell))
                .flatten()
                .all(|reading_m| (reading_m - at_m).norm() > TOUCHED_M)
        };
        let (x, y, z) = (along(0), along(1), along(2));
        let all = z.iter().flat_map(|z| y.iter().map(move |y| (y, z)));
        let all = all.flat_map(|(y, z)| x.iter().map(move |x| Vec3::new(*x, *y, *z)));
        all.filter(is_free).collect()
    }

    /// One reading in this many for the first comparison.
    pub(super) fn stride_of_waves(&self, context: &Context) -> usize {
        let readings = PAIRS_OF_STRAY_WAVES / self.model.waves_of_all(context).max(1);
        (self.observations.len() / readings.max(FEWEST_OF_STRAY_WAVES)).max(1)
    }

    /// Decrease of the cost, and strength, of a wave, by Gauss-Newton steps from zero, together with the gain.
    pub(super) fn solved(&self, stride: usize, waves: &[Complex64]) -> (f64, Complex64) {
        let at = |strength| Descent::of(&self.slopes(stride, waves, strength), waves);
        let none = at(Complex64::ZERO);
        let (mut step, none) = (none.step(), none.cost_by_gain());
        let (mut fall, mut strength) = (0.0, Complex64::ZERO);
        for _ in 0..STEPS {
            let next = strength + step;
            let there = at(next);
            // A step that increases the cost is halved.
            if none - there.cost_by_gain() <= fall {
                step *= 0.5;
                continue;
            }
            (fall, strength, step) = (none - there.cost_by_gain(), next, there.step());
        }
        (fall, strength)
    }

    /// Residuals and slopes of one visit in `stride`, drive by drive, with this multiple of a wave's pressures.
    pub(super) fn slopes(
        &self,
        stride: usize,
        waves: &[Complex64],
        strength: Complex64,
    ) -> Vec<Slope> {
        let mut slopes = Vec::with_capacity(waves.len());
        let mut waves = waves.iter();
        let next = |_: &ScoredDrive, _| waves.next().map_or(Complex64::ZERO, |p| strength * p);
        self.evaluate(stride, next, |slope| slopes.push(slope));
        slopes
    }

    /// Every drive with the places of one visit in `stride`.
    pub(super) fn each_drive(&self, stride: usize) -> Vec<(&ScoredDrive, Vec<Vec3>)> {
        let places_m = |drive: &ScoredDrive| -> Vec<Vec3> {
            let observed = &self.observations.scans[drive.scan].drives[drive.drive];
            let visits = observed.visits.iter().step_by(stride);
            let shift_m = self.fit.nuisance[drive.scan].shift_m;
            visits.map(|visit| self.model.place(visit) + shift_m).collect()
        };
        self.drives.iter().map(|drive| (drive, places_m(drive))).collect()
    }

    /// The field of drives at these places, drive by drive.
    pub(super) fn fields<'p>(
        &'p self,
        drives: impl Iterator<Item = (&'p ScoredDrive, &'p [Vec3])>,
    ) -> Vec<Complex64> {
        let drives: Vec<_> = drives.collect();
        let of_scans = drives.chunk_by(|one, other| one.0.scan == other.0.scan);
        let of_scan = |of_scan: &[(&'p ScoredDrive, &'p [Vec3])]| {
            let nuisance = &self.fit.nuisance[of_scan[0].0.scan];
            let driven = of_scan.iter().map(|(drive, places_m)| (self.driven(drive), *places_m));
            self.model.fields(driven, nuisance)
        };
        of_scans.flat_map(of_scan).collect()
    }

    fn driven(&self, drive: &ScoredDrive) -> Driven<'_> {
        self.observations.scans[drive.scan].drives[drive.drive].driven()
    }

    /// The images of the elements in a plane, at one visit in `stride`, drive by drive.
    pub(super) fn images(&self, stride: usize, mirror: &Mirror) -> Vec<Complex64> {
        let mut images = Vec::new();
        let drives = self.each_drive(stride);
        for of_scan in drives.chunk_by(|one, other| one.0.scan == other.0.scan) {
            let nuisance = &self.fit.nuisance[of_scan[0].0.scan];
            let of_drives =
                of_scan.iter().map(|(drive, places_m)| (self.driven(drive), places_m.clone()));
            images.extend(self.model.images(of_drives, mirror, nuisance));
        }
        images
    }
}

pub(super) fn wavelength_m(context: &Context) -> f64 {
    context.believed.medium.wavelength_m(context.believed.frequency_hz)
}

/// The best of some starts, of those that gain so many nats at least.
pub(super) fn worth_a_fit(starts: Vec<(f64, Vec<f64>)>, nats: f64, most: usize) -> Vec<Vec<f64>> {
    let worth = starts.into_iter().filter(|(cost, _)| -0.5 * cost > nats);
    best_of(worth.collect(), most)
}

/// The best of some scored heights, m, each so far from those that are better.
fn apart(mut scored: Vec<(f64, f64)>, apart_m: f64, most: usize) -> Vec<f64> {
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<f64> = Vec::new();
    for (_, height_m) in scored {
        if chosen.len() < most && chosen.iter().all(|other| (other - height_m).abs() >= apart_m) {
            chosen.push(height_m);
        }
    }
    chosen
}

/// The normal equations for a gain and the strength of a wave.
pub(super) struct Descent {
    curvature: Matrix3<f64>,
    downhill: Vector3<f64>,
    cost: f64,
}

impl Descent {
    pub(super) fn of(slopes: &[Slope], waves: &[Complex64]) -> Self {
        let (mut curvature, mut downhill, mut cost) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (slope, wave) in slopes.iter().zip(waves) {
            let by_wave = slope.by_pressure() * wave;
            let columns = Vector3::new(slope.by_gain, by_wave.re, -by_wave.im);
            curvature += columns * columns.transpose();
            downhill += columns * slope.residual;
            cost += slope.residual * slope.residual;
        }
        Self { curvature, downhill, cost }
    }

    /// The decrease of the cost by the gain alone.
    fn by_gain(&self) -> f64 {
        self.downhill[0] * self.downhill[0] / self.curvature[(0, 0)].max(f64::MIN_POSITIVE)
    }

    fn cost_by_gain(&self) -> f64 {
        self.cost - self.by_gain()
    }

    fn whole_step(&self) -> Option<Vector3<f64>> {
        Some(self.curvature.cholesky()?.solve(&self.downhill))
    }

    /// The step of the strength.
    fn step(&self) -> Complex64 {
        self.whole_step().map_or(Complex64::ZERO, |step| Complex64::new(step[1], step[2]))
    }

    /// The expected decrease of the cost beyond that by the gain alone, to first order.
    pub(super) fn expected_fall(&self) -> f64 {
        self.whole_step().map_or(0.0, |step| self.downhill.dot(&step) - self.by_gain())
    }
}
