//! Pure physics: arrays of elements, the medium, what the array is told, the simulators, the field they
//! give at any points, and the figures read off a field map.
//!
//! Lengths are metres in the array's frame: right-handed, origin at the array's centre on the plane of
//! its faces, z into the field.

mod air;
mod array;
mod element;
mod excitation;
mod field;
mod float;
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
