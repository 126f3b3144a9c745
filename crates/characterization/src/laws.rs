//! The laws that are held against the readings.

use std::f64::consts::FRAC_PI_2;

use serde::Serialize;

use super::axis_pose::Place;
use fieldgap_acoustics::transducer::{
    DescribedTransducer, Directivity, MeasuredTable, MultiGaussian, OnAxis, Piston, Transducer,
};

/// Decibels of a neper.
const DB_PER_NP: f64 = 20.0 / std::f64::consts::LN_10;
/// Steps of the lattice on which a lobe is taken for many angles.
const LATTICE: usize = 360;
/// Between the angles of a table, degrees.
const TABLE_STEP_DEG: f64 = 5.0;
/// Fewest readings about an angle of a table.
const LEAST_ABOUT_AN_ANGLE: usize = 8;

/// How the pressure falls along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisLaw {
    /// `exp(-b h)`, as the thesis has it.
    Exponential,
    /// `1/d`.
    Spherical,
    /// `exp(-α d)/d`.
    Absorbed,
    /// `d^-n`.
    Power,
}

/// How it falls about the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LobeLaw {
    /// `exp(-((θ - centre)/width)²)`, as the thesis has it; its centre lies off the axis.
    OffsetGaussian,
    /// The same centred on the axis.
    Gaussian,
    /// Ten Gaussians for a piston of free radius.
    MultiGaussian,
    /// A piston of free radius.
    Piston,
    /// Angle by angle.
    Table,
}

/// A constant of a law, as it was fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Constant {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its value in that unit.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// A parameter of a law, SI inside, and how people want to see it.
#[derive(Debug, Clone)]
pub(super) struct Free {
    pub name: String,
    pub unit: &'static str,
    /// From SI to that unit.
    pub factor: f64,
    pub start: f64,
    pub scale: f64,
}

impl Free {
    fn new(name: &str, unit: &'static str, factor: f64, start: f64, scale: f64) -> Self {
        Self { name: name.to_owned(), unit, factor, start, scale }
    }
}

impl AxisLaw {
    /// Every law.
    pub const ALL: [Self; 4] = [Self::Exponential, Self::Spherical, Self::Absorbed, Self::Power];

    pub(super) fn free(self) -> Vec<Free> {
        match self {
            Self::Exponential => vec![Free::new("decay", "1/cm", 0.01, 8.0, 0.1)],
            Self::Spherical => Vec::new(),
            Self::Absorbed => vec![Free::new("attenuation", "dB/m", DB_PER_NP, 0.15, 0.05)],
            Self::Power => vec![Free::new("exponent", "", 1.0, 1.0, 0.02)],
        }
    }

    /// Pressure at a place, relative.
    pub(super) fn at(self, free: &[f64], place: &Place) -> f64 {
        let Place { distance_m, height_m, .. } = *place;
        match self {
            Self::Exponential => (-free[0] * height_m).exp(),
            Self::Spherical => 1.0 / distance_m,
            Self::Absorbed => (-free[0] * distance_m).exp() / distance_m,
            Self::Power => distance_m.powf(-free[0]),
        }
    }

    fn on_axis(self, free: &[f64]) -> OnAxis {
        match self {
            Self::Exponential => {
                OnAxis::Exponential { amplitude: 1.0, decay_per_m: rounded(free[0]) }
            }
            // Air adds nothing to a wave: less than no absorption is none.
            Self::Absorbed if free[0] > 0.0 => {
                let attenuation_np_m = rounded(free[0] * DB_PER_NP) / DB_PER_NP;
                OnAxis::Absorbed { amplitude: 1.0, attenuation_np_m }
            }
            Self::Spherical | Self::Absorbed => OnAxis::Spherical,
            Self::Power => OnAxis::Power { exponent: rounded(free[0]) },
        }
    }
}

impl std::fmt::Display for AxisLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Exponential => "exponential",
            Self::Spherical => "1/r",
            Self::Absorbed => "1/r, absorbed",
            Self::Power => "r^-n",
        })
    }
}

impl LobeLaw {
    /// Every law.
    pub const ALL: [Self; 5] =
        [Self::OffsetGaussian, Self::Gaussian, Self::MultiGaussian, Self::Piston, Self::Table];
}

impl std::fmt::Display for LobeLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::OffsetGaussian => "Gaussian off the axis",
            Self::Gaussian => "Gaussian",
            Self::MultiGaussian => "multi-Gaussian",
            Self::Piston => "piston",
            Self::Table => "table",
        })
    }
}

/// A lobe whose constants are free; a table's angles are chosen for the readings.
#[derive(Debug, Clone)]
pub(super) struct Lobe {
    pub law: LobeLaw,
    wavenumber_rad_m: f64,
    /// Of a table, degrees, from 0.
    angles_deg: Vec<f64>,
}

impl Lobe {
    /// A law for readings at some angles from the axis, rad.
    pub fn new(law: LobeLaw, thetas_rad: &[f64], wavenumber_rad_m: f64) -> Self {
        let about = |angle_deg: f64| {
            let near =
                |theta: &&f64| (theta.to_degrees() - angle_deg).abs() <= TABLE_STEP_DEG / 2.0;
            thetas_rad.iter().filter(near).count()
        };
        let angles_deg = (0..=18)
            .map(|step| TABLE_STEP_DEG * f64::from(step))
            .filter(|&angle| angle == 0.0 || about(angle) >= LEAST_ABOUT_AN_ANGLE)
            .collect();
        Self { law, wavenumber_rad_m, angles_deg }
    }

    pub fn free(&self) -> Vec<Free> {
        let degrees = 180.0 / std::f64::consts::PI;
        let radius = || vec![Free::new("radius", "mm", 1e3, 4.5e-3, 2e-4)];
        match self.law {
            LobeLaw::OffsetGaussian => vec![
                Free::new("centre", "°", degrees, -0.03, 0.01),
                Free::new("width", "°", degrees, 0.6, 0.01),
            ],
            LobeLaw::Gaussian => vec![Free::new("width", "°", degrees, 0.55, 0.01)],
            LobeLaw::MultiGaussian | LobeLaw::Piston => radius(),
            // On the axis the pressure is 1; the amplitude stands beside it.
            LobeLaw::Table => self.angles_deg[1..]
                .iter()
                .map(|&angle| {
                    let start = (-(angle / 31.5).powi(2)).exp();
                    Free::new(&format!("at {angle}°"), "", 1.0, start, 0.02)
                })
                .collect(),
        }
    }

    /// Relative pressures at some angles, 0 to pi/2 rad; `None` where the constants make no lobe.
    ///
    /// Of many angles they are interpolated by cubics between quarters of a degree, which is right to a few parts in a
    /// hundred million.
    pub fn at(&self, free: &[f64], thetas_rad: &[f64]) -> Option<Vec<f64>> {
        if thetas_rad.len() <= 4 * LATTICE {
            return self.exactly_at(free, thetas_rad);
        }
        let step_rad = FRAC_PI_2 / LATTICE as f64;
        let lattice: Vec<f64> = (0..=LATTICE).map(|index| step_rad * index as f64).collect();
        let known = self.exactly_at(free, &lattice)?;
        Some(thetas_rad.iter().map(|theta| cubic(&known, theta / step_rad)).collect())
    }

    fn exactly_at(&self, free: &[f64], thetas_rad: &[f64]) -> Option<Vec<f64>> {
        let k = self.wavenumber_rad_m;
        let each = |pressure: &dyn Fn(f64) -> f64| {
            thetas_rad.iter().map(|&theta| pressure(theta)).collect()
        };
        let gaussian =
            |centre: f64, width: f64| each(&|theta| (-((theta - centre) / width).powi(2)).exp());
        Some(match self.law {
            LobeLaw::OffsetGaussian if free[1] > 0.0 => gaussian(free[0], free[1]),
            LobeLaw::Gaussian if free[0] > 0.0 => gaussian(0.0, free[0]),
            LobeLaw::MultiGaussian if free[0] > 0.0 => {
                each(&|theta| MultiGaussian.directivity(theta, free[0], k))
            }
            LobeLaw::Piston if free[0] > 0.0 => {
                each(&|theta| Piston.directivity(theta, free[0], k))
            }
            LobeLaw::Table => {
                let table = self.table(free)?;
                each(&|theta| table.at(theta))
            }
            _ => return None,
        })
    }

    fn table(&self, free: &[f64]) -> Option<MeasuredTable> {
        let pressures: Vec<f64> = std::iter::once(1.0).chain(free.iter().copied()).collect();
        MeasuredTable::new(&self.angles_deg, &pressures).ok()
    }

    fn directivity(&self, free: &[f64]) -> Directivity {
        match self.law {
            LobeLaw::OffsetGaussian | LobeLaw::Gaussian => {
                let (centre, width) = match *free {
                    [centre, width] => (centre, width),
                    _ => (0.0, free[0]),
                };
                let degrees = |rad: f64| rounded(rad.to_degrees()).to_radians();
                Directivity::Gaussian { centre_rad: degrees(centre), width_rad: degrees(width) }
            }
            LobeLaw::MultiGaussian => Directivity::MultiGaussian,
            LobeLaw::Piston => Directivity::Piston,
            LobeLaw::Table => {
                let pressures: Vec<f64> = free.iter().map(|&pressure| rounded(pressure)).collect();
                Directivity::Table(
                    self.table(&pressures).expect("its angles rise and its numbers are finite"),
                )
            }
        }
    }
}

/// The cubic through the four values about a place, counted in steps from the first value.
fn cubic(values: &[f64], at: f64) -> f64 {
    let first = (at as usize).saturating_sub(1).min(values.len() - 4);
    let [a, b, c, d] = [0, 1, 2, 3].map(|index| values[first + index]);
    let t = at - first as f64;
    // Newton's form: differences of rising order.
    let (ab, bc, cd) = (b - a, c - b, d - c);
    let (abc, bcd) = ((bc - ab) / 2.0, (cd - bc) / 2.0);
    a + t * (ab + (t - 1.0) * (abc + (t - 2.0) * (bcd - abc) / 3.0))
}

/// The transducer that two laws make with their constants, and the radius of its face where the lobe has one, metres.
pub(super) fn described(
    (axis, axis_free): (AxisLaw, &[f64]),
    (lobe, lobe_free): (&Lobe, &[f64]),
) -> (DescribedTransducer, Option<f64>) {
    let radius_m = match lobe.law {
        LobeLaw::MultiGaussian | LobeLaw::Piston => Some(rounded(lobe_free[0] * 1e3) / 1e3),
        _ => None,
    };
    let directivity = lobe.directivity(lobe_free);
    (DescribedTransducer { on_axis: axis.on_axis(axis_free), directivity }, radius_m)
}

/// A number to six digits: more than any scan knows.
fn rounded(number: f64) -> f64 {
    format!("{number:.5e}").parse().expect("a number as it was written")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_angles_are_as_right_as_few() {
        let thetas: Vec<f64> =
            (0..=5000).map(|step| FRAC_PI_2 * f64::from(step) / 5000.0).collect();
        for law in LobeLaw::ALL {
            let lobe = Lobe::new(law, &thetas, 732.7);
            let free: Vec<f64> = lobe.free().iter().map(|free| free.start).collect();
            let many = lobe.at(&free, &thetas).expect("a lobe");
            let exact = lobe.exactly_at(&free, &thetas).expect("a lobe");
            // A table's cubics meet with a kink in their curvature.
            let slack = if law == LobeLaw::Table { 2e-5 } else { 5e-8 };
            for ((theta, many), exact) in thetas.iter().zip(many).zip(exact) {
                assert!((many - exact).abs() < slack, "{law} at {theta}: {many} {exact}");
            }
        }
    }
}
