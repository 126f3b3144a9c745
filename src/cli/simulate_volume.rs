//! Simulation of a volume, plane by plane to disk: it may be larger than memory. Pictures show sections through it.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic, miette};
use serde::{Deserialize, Serialize};

use crate::cli::output::say;
use fieldgap_acoustics::{Excitation, PlaneGrid, Simulation};
use fieldgap_input::Place;
use fieldgap_jobs::{Batch, ItemResult, Product};
use fieldgap_records::{ArraySection, ArrayTable, VolumeFile};
use fieldgap_report::{PrintStyle, write_sections};

use super::simulate_sections::sections;

/// Most planes of a volume: several a wavelength over the largest heights.
const MOST_PLANES: f64 = 100_000.0;

/// Heights of a volume, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Heights {
    from_mm: f64,
    to_mm: f64,
}

impl std::str::FromStr for Heights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|part| part.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[from_mm, to_mm]) if 0.0 < from_mm && from_mm <= to_mm => {
                Place::new(to_mm).map_err(|refused| refused.to_string())?;
                Ok(Self { from_mm, to_mm })
            }
            _ => Err("expected two heights above zero, the lower one first, as from,to".into()),
        }
    }
}

/// Contents of `volume.toml`.
#[derive(Serialize)]
struct Description {
    values: &'static str,
    simulator: String,
    speed_of_sound_m_s: f64,
    focus_mm: Option<[f64; 3]>,
    /// Checksum of all elements and the transducer: a volume is only continued with the same array.
    array_crc32: u32,
    first_mm: [f64; 3],
    step_mm: f64,
    shape: [usize; 3],
    array: ArrayTable,
}

/// The planes of a volume, each of which is simulated by itself.
pub(super) struct VolumePlanes {
    simulation: Simulation,
    grid: PlaneGrid,
    heights: Heights,
    step_mm: f64,
    heights_m: Vec<f64>,
    description: String,
}

impl VolumePlanes {
    /// Planes of the points of `grid` between two heights.
    pub(super) fn of(
        array: &ArraySection,
        simulation: Simulation,
        grid: PlaneGrid,
        heights: Heights,
        step_mm: f64,
    ) -> miette::Result<Self> {
        let (columns, rows) = (grid.x_m.len(), grid.y_m.len());
        let planes = ((heights.to_mm - heights.from_mm) / step_mm + 1e-9).floor() + 1.0;
        if planes > MOST_PLANES {
            return Err(miette!(
                help = "take a larger --step-mm or a smaller --volume-mm",
                "a volume of {planes:.0} planes is too large: at most {MOST_PLANES:.0} planes are possible"
            ));
        }
        let planes = planes as usize;
        let focus_m = match simulation.excitation {
            Excitation::Focus(focus_m) => Some(focus_m),
            _ => None,
        };
        let whole = format!("{:?} {:?}", simulation.array, simulation.frequency_hz);
        let description = Description {
            values: "root mean square pressure in the simulator's unit, float32; planes (z), rows (y), columns (x)",
            simulator: simulation.simulator.to_string(),
            speed_of_sound_m_s: simulation.medium.speed_of_sound_m_s,
            focus_mm: focus_m.map(|focus_m| (focus_m * 1e3).into()),
            array_crc32: crc32fast::hash(whole.as_bytes()),
            first_mm: [grid.x_m[0] * 1e3, grid.y_m[0] * 1e3, heights.from_mm],
            step_mm,
            shape: [planes, rows, columns],
            array: array.table(),
        };
        let description = toml::to_string(&description).into_diagnostic()?;
        let heights_m =
            (0..planes).map(|plane| (heights.from_mm + plane as f64 * step_mm) * 1e-3).collect();
        Ok(Self { simulation, grid, heights, step_mm, heights_m, description })
    }

    /// What describes the volume: the text of `volume.toml`.
    pub(super) fn description(&self) -> &str {
        &self.description
    }

    /// The simulation.
    pub(super) fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The points of a plane; its height is not that of a plane of the volume.
    pub(super) fn grid(&self) -> &PlaneGrid {
        &self.grid
    }

    /// The lowest and the highest plane.
    pub(super) fn heights(&self) -> Heights {
        self.heights
    }

    /// Distance between planes, mm.
    pub(super) fn step_mm(&self) -> f64 {
        self.step_mm
    }

    /// Number of planes.
    pub(super) fn planes(&self) -> usize {
        self.heights_m.len()
    }

    fn shape(&self) -> [usize; 3] {
        [self.planes(), self.grid.y_m.len(), self.grid.x_m.len()]
    }

    /// The values of a plane, row by row.
    pub(super) fn plane(&self, number: usize) -> Vec<f32> {
        let (z_m, rms) = (self.heights_m[number], self.simulation.rms());
        let plane = PlaneGrid { z_m, ..self.grid.clone() };
        let field = self.simulation.kernel().on_plane(&plane).field;
        field.into_iter().map(|value| rms(value) as f32).collect()
    }

    /// Simulates the planes into a folder, or continues an interrupted simulation.
    pub(super) fn write_here(&self, folder: &Path, style: PrintStyle) -> miette::Result<()> {
        self.write(folder, style, |volume, bar| {
            for number in volume.done()..self.planes() {
                volume.append(&self.plane(number))?;
                bar.inc(1);
            }
            Ok(())
        })
    }

    /// Writes planes that were simulated elsewhere into a folder.
    pub(super) fn write_results(
        &self,
        batch: &Batch,
        folder: &Path,
        style: PrintStyle,
    ) -> miette::Result<()> {
        let [_, rows, columns] = self.shape();
        self.write(folder, style, |volume, bar| {
            let done = volume.done();
            for result in batch.results()?.skip(done) {
                let ItemResult { item, product } = result?;
                let bytes = match product {
                    Ok(Product::Bytes(bytes)) if bytes.len() == 4 * rows * columns => bytes,
                    Ok(_) => return Err(miette!("plane {item} of the batch has another size")),
                    Err(failure) => return Err(miette!("plane {item} failed: {failure}")),
                };
                let (values, _) = bytes.as_chunks();
                let values: Vec<f32> =
                    values.iter().map(|value| f32::from_le_bytes(*value)).collect();
                volume.append(&values)?;
                bar.inc(1);
            }
            Ok(())
        })
    }

    /// Writes the volume, as `append` does, and pictures of it.
    fn write(
        &self,
        folder: &Path,
        style: PrintStyle,
        append: impl FnOnce(&mut VolumeFile, &ProgressBar) -> miette::Result<()>,
    ) -> miette::Result<()> {
        let [planes, rows, columns] = self.shape();
        let mut volume = VolumeFile::open(folder, &self.description, self.shape())?;
        let bar = ProgressBar::new(planes as u64).with_position(volume.done() as u64);
        let bar_style = ProgressStyle::with_template(
            "{elapsed_precise} [{bar:30}] {pos}/{len} planes, {eta} left",
        )
        .expect("the template is well formed");
        bar.set_style(bar_style.progress_chars("=> "));
        bar.reset_eta();
        append(&mut volume, &bar)?;
        bar.finish_and_clear();
        say(format!(
            "volume: {} ({planes} planes of {rows} rows of {columns} values, float32)",
            volume.path().display()
        ));
        let sections = sections(&self.simulation, &self.grid, &self.heights_m);
        let simulator = self.simulation.simulator;
        let pictures = write_sections(folder, simulator, &sections, style).into_diagnostic()?;
        say(format!(
            "{} pictures of sections through the focus: {}",
            pictures.len(),
            folder.display()
        ));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_rise_from_above_zero() {
        let heights = |text: &str| text.parse::<Heights>();
        assert_eq!(heights("20, 30.5"), Ok(Heights { from_mm: 20.0, to_mm: 30.5 }));
        for wrong in ["20", "30,20", "0,10", "a,b", "1,2,3", "10,inf"] {
            assert!(heights(wrong).is_err(), "{wrong}");
        }
    }
}
