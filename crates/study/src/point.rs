//! The set-up at one combination of a study's values.

use serde::Deserialize;
use toml::Spanned;
use toml_edit::Value;

use super::{Limits, Study, SweptValue};
use fieldgap_acoustics::metrics::{Convention, THESIS_THRESHOLD};
use fieldgap_acoustics::{PlaneGrid, Simulation, Simulator};
use fieldgap_input::{Exact, Fault, Fraction, Length, Place, TomlSource};
use fieldgap_records::{
    ArraySection, ArrayTable, FocusSection, FocusTable, Layout, MediumSection, MediumTable,
};

/// Most points of a map, which takes about 400 bytes for each while it is computed: 2000 points per side, and some more.
const MOST_MAP_POINTS: f64 = 4.1e6;

/// The sections of a rig file that a study uses.
#[derive(Debug, Deserialize)]
struct RigPart {
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
}

/// The other sections of a study.
#[derive(Debug, Deserialize)]
struct StudyPart {
    simulator: Spanned<SimulatorTable>,
    focus: Spanned<FocusTable>,
    #[serde(default)]
    map: MapTable,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SimulatorTable {
    model: Simulator,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapTable {
    z_mm: Option<Length>,
    size_mm: Option<Spanned<Length>>,
    step_mm: Option<Spanned<Length>>,
    centre_mm: Option<Exact<Place, 2>>,
    threshold: Option<Fraction>,
}

/// The set-up that is simulated at one combination of values.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// The simulation; for a random layout one per seed.
    pub draws: Vec<Draw>,
    /// The observed plane.
    pub grid: PlaneGrid,
    /// Threshold for focal radius and sub-peaks, relative to the peak.
    pub threshold: f64,
    /// Convention of the figures.
    pub convention: Convention,
    /// Limits from theory, of the first draw.
    pub limits: Limits,
}

/// One array of a random layout, or the only one.
#[derive(Debug, Clone)]
pub(super) struct Draw {
    pub seed: Option<u32>,
    pub simulation: Simulation,
}

impl Point {
    /// The set-up of a study with one value of each sweep.
    ///
    /// # Errors
    /// A [`Fault`] in the file with those values.
    pub fn read(study: &Study, values: &[&SweptValue]) -> Result<Self, Fault> {
        let mut documents = study.documents.clone();
        let mut labels = Vec::new();
        for (sweep, value) in study.sweeps.iter().zip(values) {
            for (number, key) in sweep.parameters.iter().enumerate() {
                let value = value.for_key(number, sweep.parameters.len());
                documents.set(key, value).map_err(|error| {
                    study.source().fault(
                        sweep.place.clone(),
                        error.to_string(),
                        "name the section and the key",
                    )
                })?;
            }
            labels.push(format!("{} = {}", sweep.name(), value.label));
        }
        let label = labels.join(", ");
        let rig_source = documents.rig_source(&label);
        let study_source = documents.study_source(&label);
        let rig: RigPart = rig_source.parse()?;
        let part: StudyPart = study_source.parse()?;
        let array = ArraySection::read(&rig.array, &rig_source)?;
        let medium = MediumSection::read(&rig.medium, &rig_source)?.medium();
        let focus = FocusSection::read(&part.focus, &study_source)?;
        focus.fits(array.array().len()).map_err(|error| {
            study_source.fault(
                part.focus.span(),
                error.to_string(),
                "give one phase for each element",
            )
        })?;
        let excitation = focus.excitation();
        let grid = grid(&part.map, excitation.focus_m().map(|focus| focus.z), &study_source)?;
        let model = part.simulator.get_ref().model;
        let limits = Limits::of(&array, &medium, &excitation);
        let simulation = |array: &ArraySection| Simulation {
            simulator: model,
            array: array.array().clone(),
            medium,
            frequency_hz: array.frequency_hz(),
            excitation: excitation.clone(),
        };
        let mut draws = Vec::new();
        match *array.layout() {
            Layout::Random { seed: first, .. } => {
                for draw in 0..study.draws {
                    let seed = first.wrapping_add(draw);
                    documents.set("array.seed", Value::from(i64::from(seed))).map_err(|error| {
                        Fault::of_file(rig_source.path(), error.to_string(), "write [array]")
                    })?;
                    let source = documents.rig_source(&format!("{label}, seed {seed}"));
                    let rig: RigPart = source.parse()?;
                    let drawn = ArraySection::read(&rig.array, &source)?;
                    draws.push(Draw { seed: Some(seed), simulation: simulation(&drawn) });
                }
            }
            _ => draws.push(Draw { seed: None, simulation: simulation(&array) }),
        }
        Ok(Self {
            draws,
            grid,
            threshold: part.map.threshold.map_or(THESIS_THRESHOLD, Fraction::get),
            convention: match model {
                Simulator::AsWritten => Convention::AsWritten,
                _ => Convention::Corrected,
            },
            limits,
        })
    }
}

fn grid(table: &MapTable, focus_z_m: Option<f64>, source: &TomlSource) -> Result<PlaneGrid, Fault> {
    let z_m = table.z_mm.map(|z_mm| z_mm.get() * 1e-3).or(focus_z_m).ok_or_else(|| {
        Fault::of_file(
            source.path(),
            "gives neither a focus nor a height for the map",
            "give `z_mm` in [map]",
        )
    })?;
    let get = |key: &Option<Spanned<Length>>, default: f64| {
        key.as_ref().map_or(default, |value| value.get_ref().get())
    };
    let (size_mm, step_mm) = (get(&table.size_mm, 100.0), get(&table.step_mm, 1.0));
    let steps = (0.5 * size_mm / step_mm + 1e-9).floor();
    let place = table.step_mm.as_ref().or(table.size_mm.as_ref()).map(Spanned::span);
    if steps < 1.0 || (2.0 * steps + 1.0).powi(2) > MOST_MAP_POINTS {
        return Err(source.fault(
            place.unwrap_or(0..0),
            format!(
                "a map of {size_mm} mm in steps of {step_mm} mm has too few or too many points"
            ),
            "choose 3 to 2000 points per side",
        ));
    }
    let mut grid = PlaneGrid::square(steps * step_mm * 1e-3, step_mm * 1e-3, z_m);
    if let Some([x, y]) = table.centre_mm.as_deref() {
        grid.x_m.iter_mut().for_each(|along| *along += x.get() * 1e-3);
        grid.y_m.iter_mut().for_each(|along| *along += y.get() * 1e-3);
    }
    Ok(grid)
}
