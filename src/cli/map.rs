//! `fieldgap map`: the map of a record with its standard errors, offline; and the map that an adaptive scan ends with.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use miette::{IntoDiagnostic, miette};

use super::output::{print_json, say};
use fieldgap_acoustics::{PlaneGrid, Vec3};
use fieldgap_adaptive_map::{
    FieldMap, MapEnd, MapRound, checks_of, in_words, map, places_of, to_csv,
};
use fieldgap_closed_loop::read_log;
use fieldgap_input::Length;
use fieldgap_records::{
    AdaptiveMap, Axis, Layers, MapPrior, Plan, RecordedScan, SAME_HEIGHT_MM, write_whole,
};
use fieldgap_report::{MeasuredMap, PrintStyle, write_measured_map};

/// The table of the map, in the folder of the record.
const TABLE: &str = "map.csv";
/// Its pictures, in the report's folder.
const PICTURES: &str = "report/map";

/// Step of a map of a record whose plan has none, mm: a quarter of a wavelength in air at 40 kHz.
const STEP_MM: f64 = 2.0;
/// Heights of such a map at most; of more, so many spread evenly.
const MOST_HEIGHTS: usize = 8;
/// Places of such a map along an axis at most.
const MOST_ALONG: usize = 400;

/// The `map` command.
#[derive(Debug, Args)]
pub(super) struct Map {
    /// Folder of the record
    folder: PathBuf,
    /// Step of the map, mm [default: as in [adaptive] of its plan, or 2]
    #[arg(long, value_name = "MM")]
    step_mm: Option<f64>,
    /// Heights of the map, mm [default: as in [adaptive] of its plan, or those of the record]
    #[arg(long, value_name = "Z,Z", value_delimiter = ',', allow_negative_numbers = true)]
    z_mm: Vec<f64>,
    /// What is believed of the field before the readings
    #[arg(long, value_enum)]
    prior: Option<PriorArg>,
    /// Folder for the table and the pictures [default: map.csv in the record's folder, pictures in its report/map]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the errors as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PriorArg {
    /// The simulation, corrected by what the readings say, and a process of what it misses
    Simulation,
    /// A process of the amplitude alone
    Process,
}

/// What a map is of, and how.
#[derive(Default)]
pub(super) struct MapRequest {
    grid: Option<Layers>,
    prior: Option<MapPrior>,
    out: Option<PathBuf>,
}

impl Map {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let record = RecordedScan::open(&self.folder)?;
        let planned = plan_of(&self.folder)?.and_then(|plan| plan.adaptive);
        let grid = match (planned, self.step_mm, &self.z_mm[..]) {
            (Some(_), None, []) => None,
            (planned, step_mm, z_mm) => {
                let grid = planned.map(|settings| settings.grid);
                Some(self::grid(&record, grid, step_mm, z_mm)?)
            }
        };
        let prior = self.prior.map(|prior| match prior {
            PriorArg::Simulation => MapPrior::Simulation,
            PriorArg::Process => MapPrior::Process,
        });
        let made = write_map(&self.folder, MapRequest { grid, prior, out: self.out })?;
        if self.json {
            print_json(&made.errors())?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Makes the map of a record, writes its table and its pictures, and says how certain it is.
pub(super) fn write_map(folder: &Path, request: MapRequest) -> miette::Result<FieldMap> {
    let record = RecordedScan::open(folder)?;
    let settings = plan_of(folder)?.and_then(|plan| plan.adaptive);
    let foci: Vec<usize> = (0..record.setup.foci.len())
        .filter(|focus| record.samples.iter().any(|sample| sample.focus == Some(*focus)))
        .collect();
    if foci.is_empty() {
        return Err(miette!(
            help = "a map needs readings with the array driven",
            "the record holds none"
        ));
    }
    let grid = match (request.grid, &settings) {
        (Some(grid), _) => grid,
        (None, Some(settings)) => settings.grid.clone(),
        (None, None) => grid(&record, None, None, &[])?,
    };
    let of_grid = AdaptiveMap::on(grid, foci.len());
    let mut places = places_of(&of_grid, foci.len());
    places.iter_mut().for_each(|(_, focus)| *focus = foci[*focus]);
    let planned = settings.as_ref().map_or(MapPrior::Simulation, |settings| settings.prior);
    let prior = request.prior.unwrap_or(planned);
    let rounds: Vec<MapRound> = read_log(folder).into_diagnostic()?;
    let checks = checks_of(&record, &rounds).filter(|_| prior == planned);
    let made = map(&record, &places, prior, checks).into_diagnostic()?;

    let table = request.out.as_deref().unwrap_or(folder).join(TABLE);
    if let Some(out) = &request.out {
        std::fs::create_dir_all(out).into_diagnostic()?;
    }
    let csv = to_csv(&made);
    write_whole(&table, |file| std::io::Write::write_all(file, csv.as_bytes()))
        .into_diagnostic()?;
    let pictures = request.out.unwrap_or_else(|| folder.join(PICTURES));
    let planes = planes(&made, &of_grid.grid, &foci, &record);
    write_measured_map(&pictures, &record.setup.unit, &planes, PrintStyle::default())
        .into_diagnostic()?;
    let end: Option<MapEnd> = rounds.last().and_then(|round| round.end);
    let stated = settings.filter(|_| !rounds.is_empty());
    say(in_words(&made, record.samples.len(), &record.setup.unit, stated.as_ref(), end));
    say(format!("map: {}\npictures: {}", table.display(), pictures.display()));
    Ok(made)
}

/// The plan of a record, if it has one.
fn plan_of(folder: &Path) -> miette::Result<Option<Plan>> {
    let path = folder.join("plan.toml");
    Ok(if path.exists() { Some(Plan::read(&path)?) } else { None })
}

/// The grid that was asked for: over what `grid` or else the readings span.
fn grid(
    record: &RecordedScan,
    grid: Option<Layers>,
    step_mm: Option<f64>,
    z_mm: &[f64],
) -> miette::Result<Layers> {
    let step_mm = Length::new(step_mm.unwrap_or(STEP_MM)).into_diagnostic()?.get();
    let driven = || record.samples.iter().filter(|sample| sample.focus.is_some());
    let along = |axis: usize| {
        let ends = match &grid {
            Some(Layers { x, y, .. }) => {
                let along = if axis == 0 { x } else { y };
                (along.first_mm, along.at_mm(along.count - 1))
            }
            None => driven()
                .map(|sample| sample.position_mm[axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mm| {
                    (low.min(mm), high.max(mm))
                }),
        };
        let steps = ((ends.1 - ends.0) / step_mm + 1e-9).floor();
        if steps >= MOST_ALONG as f64 {
            return Err(miette!(
                help = "make --step-mm larger",
                "a step of {step_mm} mm makes {steps:.0} places along {}; at most {MOST_ALONG} are allowed",
                ["x", "y"][axis]
            ));
        }
        Ok(Axis { first_mm: ends.0, step_mm, count: steps.max(0.0) as usize + 1 })
    };
    let mut heights: Vec<f64> = match (z_mm, &grid) {
        ([], Some(grid)) => grid.z_mm.clone(),
        ([], None) => record.planes(SAME_HEIGHT_MM).iter().map(|plane| plane.z_mm).collect(),
        (given, _) => given.to_vec(),
    };
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    if z_mm.is_empty() && heights.len() > MOST_HEIGHTS {
        let (low, high) = (heights[0], heights[heights.len() - 1]);
        let at = |n: usize| low + (high - low) * n as f64 / (MOST_HEIGHTS - 1) as f64;
        heights = (0..MOST_HEIGHTS).map(at).collect();
    }
    if heights.iter().any(|z_mm| !z_mm.is_finite()) {
        return Err(miette!(help = "give heights in millimetres", "--z-mm has no finite number"));
    }
    Ok(Layers { x: along(0)?, y: along(1)?, z_mm: heights })
}

/// The planes of a map, with the readings that were taken in each.
fn planes(
    made: &FieldMap,
    grid: &Layers,
    foci: &[usize],
    record: &RecordedScan,
) -> Vec<MeasuredMap> {
    let metres = |axis: &Axis| (0..axis.count).map(|n| axis.at_mm(n) / 1e3).collect::<Vec<_>>();
    let (x_m, y_m) = (metres(&grid.x), metres(&grid.y));
    let cells = x_m.len() * y_m.len();
    let heights = foci.iter().flat_map(|focus| grid.z_mm.iter().map(move |z_mm| (*focus, *z_mm)));
    heights
        .zip(made.estimates.chunks(cells))
        .map(|((focus, z_mm), estimates)| {
            let here = record.samples.iter().filter(|sample| {
                sample.focus == Some(focus) && (sample.position_mm.z - z_mm).abs() < SAME_HEIGHT_MM
            });
            let readings_m: Vec<Vec3> = here.map(|sample| sample.position_m()).collect();
            MeasuredMap {
                drive: focus,
                grid: PlaneGrid { x_m: x_m.clone(), y_m: y_m.clone(), z_m: z_mm / 1e3 },
                amplitude: estimates.iter().map(|estimate| estimate.amplitude).collect(),
                standard_error: estimates.iter().map(|e| e.standard_error).collect(),
                readings_m,
            }
        })
        .collect()
}
