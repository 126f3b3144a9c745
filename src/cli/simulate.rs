//! `fieldgap simulate`: the field of the planes of a plan, or of planes above an array, with the figures of each plane.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::on::{OnArgs, batch_beside};
use super::output::{print, print_json, say};
use super::picture_args::PictureArgs;
use super::simulate_display::SimulateDisplay;
use super::simulate_volume::{Heights, VolumePlanes};
use super::volume_planes::PlanesWork;
use fieldgap_acoustics::metrics::{
    Convention, PlaneMap, THESIS_THRESHOLD, focal_radius, peak, sub_peaks,
};
use fieldgap_acoustics::{Excitation, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap_acquisition::rig_of;
use fieldgap_input::{Coordinate, Length, Place, Positive};
use fieldgap_records::{Axis, FieldSetup, Plan, Region, Shape};
use fieldgap_report::{SimulatedMap, write_simulation};

/// Most points of all planes together, so that they fit in memory.
const MOST_POINTS: f64 = 3e7;

/// The focus where none is given, mm: above the centre, where small arrays still focus.
const USUAL_FOCUS_MM: [f64; 3] = [0.0, 0.0, 100.0];

/// The `simulate` command.
#[derive(Debug, Args)]
pub(super) struct Simulate {
    /// Plan whose planes are simulated; without a plan, give --rig
    plan: Option<PathBuf>,
    /// Simulate a display file, such as scans/display-circle.toml, instead; --out writes pictures of it
    #[arg(long, value_name = "FILE", conflicts_with_all = ["plan", "focus_mm", "z_mm", "size_mm", "step_mm", "volume_mm"])]
    display: Option<PathBuf>,
    /// Rig file, of which [array] and [medium] are read; a file with these two suffices [default: the one named in the plan]
    #[arg(long, value_name = "FILE", required_unless_present_any = ["plan", "display"])]
    rig: Option<PathBuf>,
    /// Simulator: as-written, corrected, piston, gaussian, multi-gaussian, rayleigh or transducer (the transducer file of
    /// the rig) [default: as in the plan, or corrected]
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// Focus, mm [default: as in the plan, or 0,0,100]
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    focus_mm: Option<Vec3>,
    /// Heights of the planes, mm [default: that of the focus]
    #[arg(long, value_name = "Z,...", value_delimiter = ',', value_parser = length, conflicts_with = "plan")]
    z_mm: Vec<Positive>,
    /// Side length of the planes, centred on the axis, mm
    #[arg(long, value_name = "MM", default_value = "100", value_parser = length, conflicts_with = "plan")]
    size_mm: Positive,
    /// Grid step of the planes, mm
    #[arg(long, value_name = "MM", default_value = "1", value_parser = length, conflicts_with = "plan")]
    step_mm: Positive,
    /// Simulate a volume between two heights, mm, with a plane every --step-mm. It is written to the folder --out plane by
    /// plane; if the command was interrupted, the same command continues it
    #[arg(long, value_name = "FROM,TO", conflicts_with_all = ["plan", "z_mm", "json"], requires = "out")]
    volume_mm: Option<Heights>,
    /// Write the field to this folder as simulation.csv, with a picture of amplitude and phase of each plane and interactive maps (a volume:
    /// volume.npy and volume.toml, with pictures of three sections through the focus)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    pictures: PictureArgs,
    #[command(flatten)]
    on: OnArgs,
}

/// One simulated plane of one focus.
#[derive(Debug, Serialize)]
struct SimulatedPlane {
    simulator: Simulator,
    focus: usize,
    z_mm: f64,
    peak: f64,
    peak_x_mm: f64,
    peak_y_mm: f64,
    refined_peak: f64,
    refined_peak_x_mm: f64,
    refined_peak_y_mm: f64,
    focal_radius_mm: Option<f64>,
    cut_off: Vec<String>,
    sub_peaks: usize,
    #[serde(skip)]
    map: SimulatedMap,
}

impl Simulate {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        if let Some(display) = &self.display {
            return SimulateDisplay {
                display,
                rig: self.rig.as_deref(),
                simulator: self.simulator,
                out: self.out.as_deref(),
                json: self.json,
            }
            .run();
        }
        if self.on.is_given() && self.volume_mm.is_none() {
            return Err(miette!(
                help = "give --volume-mm, or leave --on out",
                "only a volume is simulated with --on: planes take less time than their distribution"
            ));
        }
        if let (Some(heights), Some(folder)) = (self.volume_mm, &self.out) {
            self.volume(heights, folder)?;
            return Ok(ExitCode::SUCCESS);
        }
        let planes = self.planes()?;
        if let Some(folder) = &self.out {
            self.write(folder, &planes)?;
        }
        if self.json {
            print_json(&planes)?;
        } else {
            print(&table(&planes))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// The field as a table, its pictures and its page.
    fn write(&self, folder: &Path, planes: &[SimulatedPlane]) -> miette::Result<()> {
        write_field(folder, planes).into_diagnostic()?;
        say(format!("field: {}", folder.join("simulation.csv").display()));
        let Some(first) = planes.first() else { return Ok(()) };
        let from = self.plan.as_deref().or(self.rig.as_deref()).and_then(Path::file_stem);
        let from = from.map_or_else(String::new, |stem| format!(" of {}", stem.to_string_lossy()));
        let title = format!("{} simulation{from}", first.simulator);
        let maps: Vec<SimulatedMap> = planes.iter().map(|plane| plane.map.clone()).collect();
        let files =
            write_simulation(folder, &title, first.simulator, &maps, self.pictures.style()?)
                .into_diagnostic()?;
        say(format!("{} pictures: {}", files.pictures.len(), folder.display()));
        if let Some(page) = files.page {
            say(format!("interactive maps: {}", page.display()));
        }
        Ok(())
    }

    fn volume(&self, heights: Heights, folder: &Path) -> miette::Result<()> {
        let setup = self.setup()?;
        self.say_defaults(&setup);
        let simulation = self.simulation_of_flags(&setup);
        // Before the grid is made, which may be larger than memory.
        small_enough(self.points_of_a_plane())?;
        let grid = PlaneGrid::square(self.half_m(), self.step_mm.get() * 1e-3, 0.0);
        let (step_mm, style) = (self.step_mm.get(), self.pictures.style()?);
        let planes = VolumePlanes::of(&setup.array, simulation, grid, heights, step_mm)?;
        if !self.on.is_given() {
            return planes.write_here(folder, style);
        }
        let rig = self.rig.as_deref().expect("clap asks for a plan or a rig");
        let work = PlanesWork::of(rig, planes)?;
        match self.on.run(&work, &batch_beside(folder), "planes")? {
            Some(batch) => work.planes().write_results(&batch, folder, style),
            None => Ok(()),
        }
    }

    fn setup(&self) -> miette::Result<FieldSetup> {
        Ok(FieldSetup::read(self.rig.as_deref().expect("clap asks for a plan or a rig"))?)
    }

    /// Half the side of the planes, a whole number of steps, m.
    fn half_m(&self) -> f64 {
        let steps = (0.5 * self.size_mm.get() / self.step_mm.get()).floor();
        steps * self.step_mm.get() * 1e-3
    }

    /// Points of one of the planes.
    fn points_of_a_plane(&self) -> f64 {
        (2.0 * self.half_m() / (self.step_mm.get() * 1e-3) + 1.0).powi(2)
    }

    /// The focus without a plan, mm.
    fn focus_of_flags_mm(&self) -> Vec3 {
        self.focus_mm.unwrap_or_else(|| USUAL_FOCUS_MM.into())
    }

    fn simulation_of_flags(&self, setup: &FieldSetup) -> Simulation {
        let simulator = self.simulator.unwrap_or(Simulator::Corrected);
        simulation(setup, simulator, Excitation::Focus(self.focus_of_flags_mm() * 1e-3))
    }

    /// Says what was not given and what was taken in its place.
    fn say_defaults(&self, setup: &FieldSetup) {
        let mut taken = Vec::new();
        if self.focus_mm.is_none() {
            let [x, y, z] = USUAL_FOCUS_MM;
            taken.push(format!("focus {x},{y},{z} mm (--focus-mm)"));
        }
        if self.z_mm.is_empty() && self.volume_mm.is_none() {
            taken.push(format!("one plane at z = {} mm (--z-mm)", self.focus_of_flags_mm().z));
        }
        if self.simulator.is_none() {
            taken.push("simulator corrected (--simulator)".to_owned());
        }
        if setup.array.transducer_file().is_none() {
            taken.push("the simulator's own elements (`transducer` in [array])".to_owned());
        }
        if !taken.is_empty() {
            say(format!("taken by default: {}", taken.join("; ")));
        }
    }

    fn planes(&self) -> miette::Result<Vec<SimulatedPlane>> {
        let Some(plan) = &self.plan else { return self.planes_of_flags() };
        let plan = Plan::read(plan)?;
        let setup = FieldSetup::read(&rig_of(&plan, self.rig.as_deref())?)?;
        plan.fits_array(setup.array.array().len())?;
        let simulator = self.simulator.unwrap_or(plan.simulator);
        let excitations: Vec<Excitation> = match self.focus_mm {
            Some(focus_mm) => vec![Excitation::Focus(focus_mm * 1e-3)],
            None => plan.foci.iter().map(|focus| focus.excitation()).collect(),
        };
        for region in &plan.regions {
            if let Shape::Planes(layers) | Shape::Volume(layers) = &region.shape {
                small_enough(layers.x.count as f64 * layers.y.count as f64)?;
            }
        }
        let grids: Vec<PlaneGrid> = plan.regions.iter().flat_map(grids).collect();
        if grids.is_empty() {
            return Err(miette!(
                help = "without a plan, choose planes with --rig, --focus-mm and --z-mm",
                "{} has no planes or volumes to simulate",
                plan.path().display()
            ));
        }
        Ok(excitations
            .into_iter()
            .enumerate()
            .flat_map(|(number, excitation)| {
                let simulation = simulation(&setup, simulator, excitation);
                grids
                    .iter()
                    .map(move |grid| simulate(&simulation, number, grid))
                    .collect::<Vec<_>>()
            })
            .collect())
    }

    fn planes_of_flags(&self) -> miette::Result<Vec<SimulatedPlane>> {
        let setup = self.setup()?;
        let focus_z_mm = self.focus_of_flags_mm().z;
        let heights_mm = match &self.z_mm[..] {
            [] => vec![Length::new(focus_z_mm).map(Positive::from).map_err(|_| {
                miette!(
                    help = "give the heights of the planes, for example --z-mm 50,100,150",
                    "the focus is not above the array, so that its height, {focus_z_mm} mm, is none for a plane"
                )
            })?],
            given => given.to_vec(),
        };
        self.say_defaults(&setup);
        let simulation = self.simulation_of_flags(&setup);
        let half_m = self.half_m();
        small_enough(self.points_of_a_plane())?;
        if self.points_of_a_plane() * heights_mm.len() as f64 > MOST_POINTS {
            return Err(miette!(
                help = "choose a larger --step-mm or a smaller --size-mm; or use --volume-mm, which writes to disk",
                "the planes have more than {MOST_POINTS:e} points"
            ));
        }
        Ok(heights_mm
            .iter()
            .map(|z_mm| PlaneGrid::square(half_m, self.step_mm.get() * 1e-3, z_mm.get() * 1e-3))
            .map(|grid| simulate(&simulation, 0, &grid))
            .collect())
    }
}

/// Most points of a plane. A plane takes at most 400 bytes per point, so memory stays below 2 GiB.
const MOST_POINTS_OF_A_PLANE: f64 = 4e6;

/// Refuses a plane that is larger than memory.
fn small_enough(points: f64) -> miette::Result<()> {
    if points <= MOST_POINTS_OF_A_PLANE {
        return Ok(());
    }
    Err(miette!(
        help = "take a larger step or a smaller plane",
        "a plane of {points:.2e} points is too large: at most {MOST_POINTS_OF_A_PLANE:.0e} points are possible"
    ))
}

pub(super) fn simulation(
    setup: &FieldSetup,
    simulator: Simulator,
    excitation: Excitation,
) -> Simulation {
    Simulation {
        simulator,
        array: setup.array.array().clone(),
        medium: setup.medium.medium(),
        frequency_hz: setup.array.frequency_hz(),
        excitation,
    }
}

/// The planes of a region of a plan; lines and lists of points have none.
fn grids(region: &Region) -> Vec<PlaneGrid> {
    let (Shape::Planes(layers) | Shape::Volume(layers)) = &region.shape else { return Vec::new() };
    let along_m = |axis: &Axis| -> Vec<f64> {
        (0..axis.count).map(|index| axis.at_mm(index) * 1e-3).collect()
    };
    layers
        .z_mm
        .iter()
        .map(|z_mm| PlaneGrid {
            x_m: along_m(&layers.x),
            y_m: along_m(&layers.y),
            z_m: z_mm * 1e-3,
        })
        .collect()
}

fn simulate(simulation: &Simulation, focus: usize, grid: &PlaneGrid) -> SimulatedPlane {
    let field = simulation.kernel().on_plane(grid).field;
    let values = field.iter().copied().map(simulation.rms()).collect();
    let map = PlaneMap::new(grid.x_m.clone(), grid.y_m.clone(), values)
        .expect("a grid's axes rise and its points are all simulated");
    let convention = match simulation.simulator {
        Simulator::AsWritten => Convention::AsWritten,
        _ => Convention::Corrected,
    };
    let top = peak(&map).expect("every point is simulated");
    let radius =
        focal_radius(&map, THESIS_THRESHOLD, convention).expect("every point is simulated");
    SimulatedPlane {
        simulator: simulation.simulator,
        focus,
        z_mm: grid.z_m * 1e3,
        peak: top.value,
        peak_x_mm: top.x_m * 1e3,
        peak_y_mm: top.y_m * 1e3,
        refined_peak: top.refined_value,
        refined_peak_x_mm: top.refined_x_m * 1e3,
        refined_peak_y_mm: top.refined_y_m * 1e3,
        focal_radius_mm: radius.radius_m.map(|radius_m| radius_m * 1e3),
        cut_off: radius.cut_off().map(|side| side.to_string()).collect(),
        sub_peaks: sub_peaks(&map, THESIS_THRESHOLD).len(),
        map: SimulatedMap {
            drive: focus,
            grid: grid.clone(),
            amplitude: map.values().to_vec(),
            phase_rad: field.iter().map(|pressure| pressure.arg()).collect(),
            focus_m: simulation.excitation.focus_m(),
        },
    }
}

fn table(planes: &[SimulatedPlane]) -> String {
    let mut table = format!(
        "{:>10} {:>5} {:>8} {:>10} {:>8} {:>8} {:>13} {:>9}  cut off\n",
        "simulator", "focus", "z (mm)", "peak", "x (mm)", "y (mm)", "radius (mm)", "sub-peaks"
    );
    for plane in planes {
        let radius =
            plane.focal_radius_mm.map_or("-".to_owned(), |radius_mm| format!("{radius_mm:.4}"));
        table += &format!(
            "{:>10} {:>5} {:>8.1} {:>10.6} {:>8.2} {:>8.2} {:>13} {:>9}  {}\n",
            plane.simulator.to_string(),
            plane.focus,
            plane.z_mm,
            plane.peak,
            plane.peak_x_mm,
            plane.peak_y_mm,
            radius,
            plane.sub_peaks,
            plane.cut_off.join(" ")
        );
    }
    table
}

fn write_field(folder: &Path, planes: &[SimulatedPlane]) -> Result<(), csv::Error> {
    std::fs::create_dir_all(folder)?;
    let mut writer = csv::Writer::from_path(folder.join("simulation.csv"))?;
    writer.write_record(["simulator", "focus", "x_mm", "y_mm", "z_mm", "pressure"])?;
    for plane in planes {
        let values = plane.map.amplitude.iter();
        let SimulatedMap { grid: PlaneGrid { x_m, y_m, .. }, .. } = &plane.map;
        let places = y_m.iter().flat_map(|y| x_m.iter().map(move |x| (x, y)));
        for ((x_m, y_m), value) in places.zip(values) {
            writer.serialize((
                plane.simulator,
                plane.focus,
                x_m * 1e3,
                y_m * 1e3,
                plane.z_mm,
                value,
            ))?;
        }
    }
    Ok(writer.flush()?)
}

pub(super) fn millimetres(text: &str) -> Result<Vec3, String> {
    let numbers = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|_| format!("`{part}` is not a number")))
        .collect::<Result<Vec<f64>, String>>()?;
    match numbers[..] {
        [x, y, z] => {
            for number in numbers {
                Coordinate::new(number).map_err(|refused| refused.to_string())?;
            }
            Ok(Vec3::new(x, y, z))
        }
        _ => Err("expected three numbers, as x,y,z".to_owned()),
    }
}

/// A place along an axis, mm.
pub(super) fn place(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    Place::new(number).map(Place::get).map_err(|refused| refused.to_string())
}

/// A length above zero, mm.
pub(super) fn length(text: &str) -> Result<Positive, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    Length::new(number).map(Positive::from).map_err(|refused| refused.to_string())
}

pub(super) fn positive(text: &str) -> Result<Positive, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    Positive::new(number).map_err(|refusal| refusal.to_string())
}
