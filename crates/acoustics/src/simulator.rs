//! The named simulators: that of the thesis as written, the same with its errors corrected, and those with other transducer models.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::transducer::{
    MultiGaussian, MurataFit, Piston, RayleighPiston, SymmetricGaussian, Transducer,
};
use super::{Array, Excitation, FieldKernel, Medium, PathLengths, PlaneGrid, Vec3};

/// Samples over which the thesis takes the root mean square: five periods at ten points each, both ends included.
const SAMPLES_OF_THESIS: f64 = 51.0;

/// A simulator that scans can be compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Simulator {
    /// The thesis's as written, including its errors: phases frozen at the focal height, the on-axis decay evaluated in metres, the
    /// root mean square over 51 samples.
    AsWritten,
    /// The thesis's with these errors corrected: path lengths at the observed height, the decay in centimetres. It keeps the root mean
    /// square over 51 samples, which varies by up to 1 % with the phase; [`Simulation::field`] does not.
    Corrected,
    /// The far field of pistons: (1/d) 2 J1(ka sin θ)/(ka sin θ).
    Piston,
    /// The thesis's lobe made symmetric, (1/d) exp(-(θ/30.9°)²).
    Gaussian,
    /// Pistons as sums of ten Gaussians.
    MultiGaussian,
    /// Pistons by the integral over their faces, to 1e-4 at distances above two radii; about fifty times slower than the others.
    Rayleigh,
    /// The transducer that the array's file names; pistons if it names none.
    Transducer,
}

impl std::fmt::Display for Simulator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::AsWritten => "as-written",
            Self::Corrected => "corrected",
            Self::Piston => "piston",
            Self::Gaussian => "gaussian",
            Self::MultiGaussian => "multi-gaussian",
            Self::Rayleigh => "rayleigh",
            Self::Transducer => "transducer",
        })
    }
}

/// A name that no simulator has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no simulator `{0}`; choose as-written, corrected, piston, gaussian, multi-gaussian, rayleigh or transducer"
)]
pub struct UnknownSimulator(String);

impl std::str::FromStr for Simulator {
    type Err = UnknownSimulator;

    fn from_str(name: &str) -> Result<Self, UnknownSimulator> {
        Self::ALL
            .into_iter()
            .find(|simulator| simulator.to_string() == name)
            .ok_or_else(|| UnknownSimulator(name.to_owned()))
    }
}

impl Simulator {
    /// Every simulator.
    pub const ALL: [Self; 7] = [
        Self::AsWritten,
        Self::Corrected,
        Self::Piston,
        Self::Gaussian,
        Self::MultiGaussian,
        Self::Rayleigh,
        Self::Transducer,
    ];

    /// The transducer model that it uses for every element of an array.
    pub fn transducer(self, array: &Array) -> &dyn Transducer {
        match self {
            Self::AsWritten => &MurataFit::FED_METRES,
            Self::Corrected => &MurataFit::CENTIMETRES,
            Self::Piston => &Piston,
            Self::Gaussian => &SymmetricGaussian::MURATA,
            Self::MultiGaussian => &MultiGaussian,
            Self::Rayleigh => &RayleighPiston::FINE,
            Self::Transducer => match array.transducer() {
                Some(transducer) => transducer,
                None => &Piston,
            },
        }
    }
}

/// A set-up to be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The simulator.
    pub simulator: Simulator,
    /// The array.
    pub array: Array,
    /// The medium.
    pub medium: Medium,
    /// Drive frequency, Hz, above zero.
    pub frequency_hz: f64,
    /// How the array is driven.
    pub excitation: Excitation,
}

impl Simulation {
    /// The field kernel of the driven array.
    ///
    /// `as-written` has no frozen height without a focus; path lengths are then taken at the observed point.
    pub fn kernel(&self) -> FieldKernel {
        let phases_rad = self.excitation.phases_rad(&self.array, &self.medium, self.frequency_hz);
        let paths = match (self.simulator, self.excitation.focus_m()) {
            (Simulator::AsWritten, Some(focus_m)) => PathLengths::FrozenAt(focus_m.z),
            _ => PathLengths::Observed,
        };
        let wavenumber = self.medium.wavenumber_rad_m(self.frequency_hz);
        FieldKernel::new(&self.array, &phases_rad, self.transducer(), wavenumber, paths)
    }

    /// The transducer model of every element.
    pub fn transducer(&self) -> &dyn Transducer {
        self.simulator.transducer(&self.array)
    }

    /// The complex field at each point, in the simulator's arbitrary unit.
    pub fn field(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        self.kernel().at(points_m)
    }

    /// The root mean square pressure at each point, zero or above, in the simulator's arbitrary unit.
    pub fn magnitudes(&self, points_m: &[Vec3]) -> Vec<f64> {
        self.field(points_m).into_iter().map(self.rms()).collect()
    }

    /// The same at every point of a plane's grid, row by row, by the fastest method ([`FieldKernel::on_plane`]).
    pub fn magnitudes_on(&self, grid: &PlaneGrid) -> Vec<f64> {
        self.kernel().on_plane(grid).field.into_iter().map(self.rms()).collect()
    }

    /// How the simulator computes the root mean square from a complex field.
    pub fn rms(&self) -> fn(Complex64) -> f64 {
        match self.simulator {
            Simulator::AsWritten | Simulator::Corrected => rms_of_thesis,
            _ => rms_of_sine,
        }
    }
}

fn rms_of_sine(phasor: Complex64) -> f64 {
    phasor.norm() * std::f64::consts::FRAC_1_SQRT_2
}

/// Over ten equal steps of a period cos² sums to 5; the 51st sample repeats the first.
fn rms_of_thesis(phasor: Complex64) -> f64 {
    let magnitude = phasor.norm();
    if magnitude == 0.0 {
        return 0.0;
    }
    let first = phasor.re / magnitude;
    magnitude * ((25.0 + first * first) / SAMPLES_OF_THESIS).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_rms_is_the_sum_over_its_51_samples() {
        for angle in [0.0, 0.7, 2.0, -1.3] {
            let phasor = Complex64::from_polar(3.0, angle);
            let squares: f64 = (0..51)
                .map(|n| 3.0 * (angle - std::f64::consts::TAU * n as f64 / 10.0).cos())
                .map(|p| p * p)
                .sum();
            assert!((rms_of_thesis(phasor) - (squares / 51.0).sqrt()).abs() < 1e-12);
        }
    }
}
