//! The sound field of an array of ultrasonic transducers in air.
//!
//! An [`Array`] is driven by an [`Excitation`] in a [`Medium`]. A [`Simulator`] names the model of its transducers. The four
//! together are a [`Simulation`], which gives the field at any points. Figures of a focus (peak, radius, side maxima) are read from
//! a map of the field by [`metrics`].
//!
//! ```
//! use fieldgap_acoustics::metrics::{PlaneMap, peak};
//! use fieldgap_acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
//!
//! let simulation = Simulation {
//!     simulator: Simulator::Piston,
//!     array: Array::square(6, 6, 10.5e-3)?,
//!     medium: Medium::air(20.0, 50.0, 101.325),
//!     frequency_hz: 40e3,
//!     excitation: Excitation::Focus(Vec3::new(0.0, 0.0, 0.1)),
//! };
//! let grid = PlaneGrid::square(20e-3, 1e-3, 0.1);
//! let magnitudes = simulation.magnitudes_on(&grid);
//! let peak = peak(&PlaneMap::new(grid.x_m, grid.y_m, magnitudes)?).expect("values at every point");
//! assert!(peak.refined_x_m.abs() < 1e-6 && peak.refined_y_m.abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | to | begin with |
//! |---|---|
//! | compute a field | [`Simulation`]; for more control [`FieldKernel`], [`PlaneSum`] and [`Transfer`] |
//! | differentiate a field | [`DifferentiableKernel`] |
//! | describe a transducer | [`transducer`] |
//! | drive several foci at once | [`foci`] |
//! | bring a measured field back to its sources | [`angular_spectrum`] |
//! | have a reference for the simulators | [`rayleigh`] |
//! | know the air | [`Air`], [`Propagation`] |
//! | fit a model | [`least_squares`], [`golden_section`] |
//!
//! Lengths are in metres. The array's frame is right-handed: its origin is the centre of the array on the plane of the faces, and z
//! points into the field. Waves that travel along +x have the phase k x; the time convention is exp(-iωt).

mod air;
pub mod angular_spectrum;
mod array;
mod element;
mod excitation;
mod field;
pub mod foci;
pub mod golden_section;
mod grid;
pub mod least_squares;
pub mod limits;
mod lobe;
mod medium;
pub mod metrics;
mod propagation;
pub mod radiation;
pub mod rayleigh;
mod simd;
mod simulator;
pub mod transducer;

pub use air::Air;
pub use array::{Array, LayoutError};
pub use element::Element;
pub use excitation::{Excitation, delays_s};
pub use field::{
    DifferentiableKernel, FieldDerivatives, FieldKernel, FieldSum, InstructionSet, PLANE_TOLERANCE,
    Parameter, PathLengths, PlaneMethod, PlaneSum, Precision, Transfer,
};
pub use grid::PlaneGrid;
pub use medium::Medium;
pub use propagation::Propagation;
pub use simulator::{Simulation, Simulator, UnknownSimulator};

/// A point or direction in space, metres where it is a point.
pub type Vec3 = nalgebra::Vector3<f64>;
