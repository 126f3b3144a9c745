//! What `simulate --out` writes, as named arrays: planes (`simulation.csv`) or a volume (`volume.npy` and `volume.toml`).

use std::path::Path;

use fieldgap_input::{Fault, MOST_TABLE, read_bytes, toml_file};
use serde::Deserialize;

use super::grids::{Layer, Map, add_maps};
use super::record::{Provenance, describe_program};
use crate::arrays::single_precision;
use crate::dataset::{Attribute, Dataset, Values, Variable};

/// The unit of simulated pressures: that of the simulator.
const UNIT: &str = "1";

/// A row of `simulation.csv`.
#[derive(Deserialize)]
struct Row {
    simulator: String,
    focus: usize,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    pressure: f64,
}

/// `volume.toml`, as far as it is exported by name.
#[derive(Deserialize)]
struct VolumeDescription {
    values: String,
    simulator: String,
    speed_of_sound_m_s: f64,
    focus_mm: Option<[f64; 3]>,
    first_mm: [f64; 3],
    step_mm: f64,
    shape: [usize; 3],
}

/// Whether a folder holds a simulated field, and no record.
pub fn is_simulation(folder: &Path) -> bool {
    !folder.join("scan.toml").exists()
        && (folder.join("volume.toml").exists() || folder.join("simulation.csv").exists())
}

/// A simulated field as named arrays.
///
/// # Errors
/// A [`Fault`] of the file that cannot be read.
pub fn dataset_of_simulation(folder: &Path, provenance: &Provenance) -> Result<Dataset, Fault> {
    let volume = folder.join("volume.toml");
    match volume.exists() {
        true => of_volume(&volume, &folder.join("volume.npy"), provenance),
        false => of_planes(&folder.join("simulation.csv"), provenance),
    }
}

fn unreadable(path: &Path, why: impl std::fmt::Display) -> Fault {
    Fault::of_file(
        path,
        format!("cannot be read: {why}"),
        "write it again with `fieldgap simulate --out`",
    )
}

fn of_planes(path: &Path, provenance: &Provenance) -> Result<Dataset, Fault> {
    let bytes = read_bytes(path, MOST_TABLE).map_err(|error| unreadable(path, error))?;
    let mut rows: Vec<Row> = Vec::new();
    for row in csv::Reader::from_reader(&bytes[..]).deserialize() {
        rows.push(row.map_err(|error| unreadable(path, error))?);
    }
    let Some(first) = rows.first() else { return Err(unreadable(path, "it has no row")) };
    let mut dataset = Dataset::default();
    describe_program(&mut dataset, "Simulated ultrasonic field", provenance);
    dataset.text("simulator", first.simulator.clone());
    let point = dataset.dimension("point", rows.len());
    let of = |value: fn(&Row) -> f64| -> Vec<f64> { rows.iter().map(value).collect() };
    let drives = rows.iter().map(|row| i32::try_from(row.focus).unwrap_or(i32::MAX)).collect();
    dataset.integers("drive", &[point], drives, "number of the drive");
    dataset.floats("x", &[point], of(|row| row.x_mm), "mm", "position along x");
    dataset.floats("y", &[point], of(|row| row.y_mm), "mm", "position along y");
    dataset.floats("z", &[point], of(|row| row.z_mm), "mm", "height above the array");
    dataset.floats(
        "pressure",
        &[point],
        of(|row| row.pressure),
        UNIT,
        "root mean square pressure in the unit of the simulator",
    );
    add_maps(
        &mut dataset,
        rows.chunk_by(|a, b| (a.focus, a.z_mm) == (b.focus, b.z_mm)).filter_map(map).collect(),
    );
    Ok(dataset)
}

/// The rows of one plane, which `simulate` writes row by row of its grid.
fn map(rows: &[Row]) -> Option<Map> {
    let columns = rows.iter().take_while(|row| row.y_mm == rows[0].y_mm).count();
    let x_m: Vec<f64> = rows[..columns].iter().map(|row| row.x_mm / 1e3).collect();
    let y_m: Vec<f64> = rows.iter().step_by(columns).map(|row| row.y_mm / 1e3).collect();
    let is_grid = rows.len() == columns * y_m.len()
        && rows.iter().enumerate().all(|(index, row)| {
            row.x_mm == rows[index % columns].x_mm && row.y_mm == rows[index - index % columns].y_mm
        });
    let pressures = rows.iter().map(|row| row.pressure).collect();
    is_grid.then(|| Map {
        drive: rows[0].focus,
        z_mm: rows[0].z_mm,
        x_m,
        y_m,
        layers: vec![Layer {
            name: "pressure",
            unit: UNIT.to_owned(),
            long_name: "root mean square pressure on the grid",
            values: pressures,
        }],
        of_plane: Vec::new(),
    })
}

fn of_volume(toml: &Path, npy: &Path, provenance: &Provenance) -> Result<Dataset, Fault> {
    let about: VolumeDescription = toml_file(toml)?;
    let bytes = read_bytes(npy, MOST_TABLE).map_err(|error| unreadable(npy, error))?;
    let (shape, values) = single_precision(&bytes).map_err(|error| unreadable(npy, error))?;
    if shape != about.shape {
        return Err(unreadable(
            npy,
            "it is not complete, or not the volume that volume.toml describes",
        ));
    }
    let mut dataset = Dataset::default();
    describe_program(&mut dataset, "Simulated ultrasonic field", provenance);
    dataset.text("simulator", about.simulator.clone());
    dataset.attribute("speed_of_sound_m_s", Attribute::Number(about.speed_of_sound_m_s));
    if let Some(focus_mm) = about.focus_mm {
        dataset.attribute("focus_mm", Attribute::Numbers(focus_mm.to_vec()));
    }
    let mut dimensions = Vec::new();
    // The shape is z, y, x, and the first place is x, y, z.
    for (index, (name, long_name)) in
        [("z", "height above the array"), ("y", "position along y"), ("x", "position along x")]
            .into_iter()
            .enumerate()
    {
        let along =
            (0..shape[index]).map(|step| about.first_mm[2 - index] + step as f64 * about.step_mm);
        let dimension = dataset.dimension(name, shape[index]);
        dataset.floats(name, &[dimension], along.collect(), "mm", long_name);
        dimensions.push(dimension);
    }
    dataset.variables.push(Variable {
        name: "pressure".to_owned(),
        dimensions,
        values: Values::Single(values),
        unit: Some(UNIT.to_owned()),
        long_name: about.values,
        coordinates: None,
    });
    Ok(dataset)
}
