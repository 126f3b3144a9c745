//! Simulates the field of a focused 10 x 10 array into an array of numbers, and prints the peak and its position.
//!
//! `cargo run --package fieldgap-acoustics --example field_into_array`

use std::error::Error;

use fieldgap_acoustics::metrics::{PlaneMap, peak};
use fieldgap_acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};

fn main() -> Result<(), Box<dyn Error>> {
    let focus_m = Vec3::new(15e-3, -10e-3, 0.12);
    let simulation = Simulation {
        simulator: Simulator::Piston,
        array: Array::square(10, 10, 10.5e-3)?,
        medium: Medium::air(22.0, 45.0, 101.325),
        frequency_hz: 40e3,
        excitation: Excitation::Focus(focus_m),
    };

    // A plane at the height of the focus: 101 x 101 points, 1 mm apart. The magnitudes are row by row, y outer and x inner.
    let grid = PlaneGrid::square(50e-3, 1e-3, focus_m.z);
    let magnitudes: Vec<f64> = simulation.magnitudes_on(&grid);
    println!("{} magnitudes on {} x {} points", magnitudes.len(), grid.x_m.len(), grid.y_m.len());

    let map = PlaneMap::new(grid.x_m, grid.y_m, magnitudes)?;
    let peak = peak(&map).ok_or("the map has no values")?;
    println!(
        "peak {:.1} (arbitrary unit) at x = {:.2} mm, y = {:.2} mm, z = {:.2} mm",
        peak.refined_value,
        peak.refined_x_m * 1e3,
        peak.refined_y_m * 1e3,
        grid.z_m * 1e3
    );
    Ok(())
}
