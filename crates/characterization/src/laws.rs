//! The laws that are fitted to the readings.

use std::f64::consts::FRAC_PI_2;

use serde::Serialize;

use super::axis_pose::AxisCoordinates;
use fieldgap_acoustics::transducer::{
    DescribedTransducer, Directivity, MeasuredTable, MultiGaussian, OnAxis, Piston, Transducer,
};

/// Decibels per neper.
const DB_PER_NP: f64 = 20.0 / std::f64::consts::LN_10;
/// Angular steps from 0 to 90 degrees between which a lobe is interpolated.
const ANGLE_STEPS: usize = 360;
/// Angular step of a table, degrees.
const TABLE_STEP_DEG: f64 = 5.0;
/// Fewest readings for an angle of a table.
const MIN_READINGS_PER_ANGLE: usize = 8;

/// Decay of the pressure along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisLaw {
    /// `exp(-b h)`, the law of the thesis.
    Exponential,
    /// `1/d`.
    Spherical,
    /// `exp(-α d)/d`.
    Absorbed,
    /// `d^-n`.
    Power,
}

/// Decay of the pressure with the angle from the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LobeLaw {
    /// `exp(-((θ - centre)/width)²)`, the law of the thesis, with its centre off the axis.
    OffsetGaussian,
    /// The same centred on the axis.
    Gaussian,
    /// Ten Gaussians that represent a piston of free radius.
    MultiGaussian,
    /// A piston of free radius.
    Piston,
    /// A table of angles and pressures.
    Table,
}

/// A fitted constant of a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Constant {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Value in that unit.
    pub value: f64,
    /// Standard error.
    pub standard_error: f64,
}

/// A free parameter of a law, in SI units, with its unit for output.
#[derive(Debug, Clone)]
pub(super) struct FreeParameter {
    pub name: String,
    pub unit: &'static str,
    /// Factor from SI to that unit.
    pub factor: f64,
    pub start: f64,
    pub scale: f64,
}

impl FreeParameter {
    fn new(name: &str, unit: &'static str, factor: f64, start: f64, scale: f64) -> Self {
        Self { name: name.to_owned(), unit, factor, start, scale }
    }
}

impl AxisLaw {
    /// Every law.
    pub const ALL: [Self; 4] = [Self::Exponential, Self::Spherical, Self::Absorbed, Self::Power];

    pub(super) fn free(self) -> Vec<FreeParameter> {
        match self {
            Self::Exponential => vec![FreeParameter::new("decay", "1/cm", 0.01, 8.0, 0.1)],
            Self::Spherical => Vec::new(),
            Self::Absorbed => {
                vec![FreeParameter::new("attenuation", "dB/m", DB_PER_NP, 0.15, 0.05)]
            }
            Self::Power => vec![FreeParameter::new("exponent", "", 1.0, 1.0, 0.02)],
        }
    }

    /// Relative pressure at a point.
    pub(super) fn at(self, free: &[f64], point: &AxisCoordinates) -> f64 {
        let AxisCoordinates { distance_m, height_m, .. } = *point;
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
            // A negative absorption is taken as none.
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
    /// Angles of a table, degrees, from 0.
    angles_deg: Vec<f64>,
}

impl Lobe {
    /// A lobe for readings at these angles from the axis, rad.
    pub fn new(law: LobeLaw, thetas_rad: &[f64], wavenumber_rad_m: f64) -> Self {
        let count_near = |angle_deg: f64| {
            let near =
                |theta: &&f64| (theta.to_degrees() - angle_deg).abs() <= TABLE_STEP_DEG / 2.0;
            thetas_rad.iter().filter(near).count()
        };
        let angles_deg = (0..=18)
            .map(|step| TABLE_STEP_DEG * f64::from(step))
            .filter(|&angle| angle == 0.0 || count_near(angle) >= MIN_READINGS_PER_ANGLE)
            .collect();
        Self { law, wavenumber_rad_m, angles_deg }
    }

    pub fn free(&self) -> Vec<FreeParameter> {
        let degrees = 180.0 / std::f64::consts::PI;
        let radius = || vec![FreeParameter::new("radius", "mm", 1e3, 4.5e-3, 2e-4)];
        match self.law {
            LobeLaw::OffsetGaussian => vec![
                FreeParameter::new("centre", "°", degrees, -0.03, 0.01),
                FreeParameter::new("width", "°", degrees, 0.6, 0.01),
            ],
            LobeLaw::Gaussian => vec![FreeParameter::new("width", "°", degrees, 0.55, 0.01)],
            LobeLaw::MultiGaussian | LobeLaw::Piston => radius(),
            // The pressure on the axis is 1; the amplitude is a parameter of its own.
            LobeLaw::Table => self.angles_deg[1..]
                .iter()
                .map(|&angle| {
                    let start = (-(angle / 31.5).powi(2)).exp();
                    FreeParameter::new(&format!("at {angle}°"), "", 1.0, start, 0.02)
                })
                .collect(),
        }
    }

    /// Relative pressures at some angles, 0 to pi/2 rad; `None` if the constants are invalid.
    ///
    /// For many angles they are interpolated by cubics in steps of a quarter of a degree, to a few parts in 10⁸.
    pub fn at(&self, free: &[f64], thetas_rad: &[f64]) -> Option<Vec<f64>> {
        if thetas_rad.len() <= 4 * ANGLE_STEPS {
            return self.exactly_at(free, thetas_rad);
        }
        let step_rad = FRAC_PI_2 / ANGLE_STEPS as f64;
        let angles_rad: Vec<f64> = (0..=ANGLE_STEPS).map(|index| step_rad * index as f64).collect();
        let sampled = self.exactly_at(free, &angles_rad)?;
        Some(thetas_rad.iter().map(|theta| cubic(&sampled, theta / step_rad)).collect())
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
                    self.table(&pressures).expect("ascending angles and finite pressures"),
                )
            }
        }
    }
}

/// Cubic interpolation of equidistant values at `at`, in steps from the first value.
fn cubic(values: &[f64], at: f64) -> f64 {
    let first = (at as usize).saturating_sub(1).min(values.len() - 4);
    let [a, b, c, d] = [0, 1, 2, 3].map(|index| values[first + index]);
    let t = at - first as f64;
    // Newton's form, with divided differences.
    let (ab, bc, cd) = (b - a, c - b, d - c);
    let (abc, bcd) = ((bc - ab) / 2.0, (cd - bc) / 2.0);
    a + t * (ab + (t - 1.0) * (abc + (t - 2.0) * (bcd - abc) / 3.0))
}

/// The transducer of two laws with their constants, and the radius of its face if the lobe has one, metres.
pub(super) fn described_transducer(
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

/// A number to six digits, more than any scan determines.
fn rounded(number: f64) -> f64 {
    format!("{number:.5e}").parse().expect("a formatted number")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolated_lobes_agree_with_exact_ones() {
        let thetas: Vec<f64> =
            (0..=5000).map(|step| FRAC_PI_2 * f64::from(step) / 5000.0).collect();
        for law in LobeLaw::ALL {
            let lobe = Lobe::new(law, &thetas, 732.7);
            let free: Vec<f64> = lobe.free().iter().map(|free| free.start).collect();
            let many = lobe.at(&free, &thetas).expect("a lobe");
            let exact = lobe.exactly_at(&free, &thetas).expect("a lobe");
            // The curvature of a table jumps from cubic to cubic.
            let tolerance = if law == LobeLaw::Table { 2e-5 } else { 5e-8 };
            for ((theta, many), exact) in thetas.iter().zip(many).zip(exact) {
                assert!((many - exact).abs() < tolerance, "{law} at {theta}: {many} {exact}");
            }
        }
    }
}
