//! The planes of a volume as items of a batch.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, miette};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::shard::not_understood;
use super::simulate::simulation;
use super::simulate_volume::{Heights, VolumePlanes};
use fieldgap_acoustics::{Excitation, PlaneGrid, Simulator, Vec3};
use fieldgap_jobs::{Batch, Failure, Product, Threads, Work};
use fieldgap_records::FieldSetup;

/// The kind of work.
pub(super) const KIND: &str = "volume";

/// A volume, a plane an item.
pub(super) struct PlanesWork {
    description: Description,
    planes: VolumePlanes,
}

#[derive(Serialize, Deserialize)]
struct Description {
    /// The rig file, an absolute path.
    rig: PathBuf,
    simulator: Simulator,
    focus_m: [f64; 3],
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    heights: Heights,
    step_mm: f64,
    /// The text of `volume.toml`, so that a rig file that was changed meanwhile is noticed.
    volume: String,
}

impl PlanesWork {
    /// The planes of a volume above the array of a rig file.
    pub(super) fn of(rig: &Path, planes: VolumePlanes) -> miette::Result<Self> {
        let rig = rig.canonicalize().into_diagnostic()?;
        let simulation = planes.simulation();
        let focus_m = simulation.excitation.focus_m();
        let focus_m = focus_m.ok_or_else(|| miette!("a volume has a focus"))?;
        let description = Description {
            rig,
            simulator: simulation.simulator,
            focus_m: focus_m.into(),
            x_m: planes.grid().x_m.clone(),
            y_m: planes.grid().y_m.clone(),
            heights: planes.heights(),
            step_mm: planes.step_mm(),
            volume: planes.description().to_owned(),
        };
        Ok(Self { description, planes })
    }

    /// The planes of a batch.
    pub(super) fn of_batch(batch: &Batch) -> miette::Result<Self> {
        let description = Description::deserialize(batch.description()).map_err(not_understood)?;
        let setup = FieldSetup::read(&description.rig)?;
        let excitation = Excitation::Focus(Vec3::from(description.focus_m));
        let simulation = simulation(&setup, description.simulator, excitation);
        let (x_m, y_m) = (description.x_m.clone(), description.y_m.clone());
        let grid = PlaneGrid { x_m, y_m, z_m: 0.0 };
        let Description { heights, step_mm, .. } = description;
        let planes = VolumePlanes::of(&setup.array, simulation, grid, heights, step_mm)?;
        if planes.description() != description.volume {
            return Err(miette!(
                help = "remove the folder of the batch, and run the command again",
                "{} has changed since the batch was made",
                description.rig.display()
            ));
        }
        Ok(Self { description, planes })
    }

    /// The planes.
    pub(super) fn planes(&self) -> &VolumePlanes {
        &self.planes
    }
}

impl Work for PlanesWork {
    fn kind(&self) -> &str {
        KIND
    }

    fn description(&self) -> Value {
        serde_json::to_value(&self.description).expect("paths of text and numbers have JSON")
    }

    fn items(&self) -> Vec<Value> {
        (0..self.planes.planes()).map(Value::from).collect()
    }

    /// A plane is summed on all threads.
    fn threads(&self) -> Threads {
        Threads::All
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        let number = usize::deserialize(item).map_err(Failure::new)?;
        if number >= self.planes.planes() {
            return Err(Failure::new(format!("the volume has no plane {number}")));
        }
        let values = self.planes.plane(number);
        Ok(Product::Bytes(values.into_iter().flat_map(f32::to_le_bytes).collect()))
    }
}
