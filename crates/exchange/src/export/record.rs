//! A record, and its comparison with the simulation, as named arrays.

use std::path::Path;

use fieldgap_comparison::{ComparedMap, Comparison, PlaneComparison, simulated_readings};
use fieldgap_input::{MOST_TABLE, MOST_TEXT, read_bytes, read_text};
use fieldgap_records::{
    FocusSection, OFF_LINE_MM, RecordedSample, RecordedScan, SAME_HEIGHT_MM, plane_map,
};
use sha2::{Digest, Sha256};

use super::grids::{Layer, Map, add_maps};
use super::levels;
use crate::dataset::{Attribute, Dataset};

/// Files of a record whose text is exported.
const TEXTS: [&str; 4] = ["scan.toml", "plan.toml", "rig.toml", "state.toml"];

/// Longest text of a file that is exported, bytes.
const LONGEST_TEXT: usize = 1 << 20;

/// Who exports, and when.
#[derive(Debug, Clone)]
pub struct Provenance {
    /// The program and its version.
    pub program: String,
    /// The time of the export.
    pub exported: jiff::Timestamp,
}

/// A record as named arrays; with a comparison also the simulation, the difference and the noise.
pub fn dataset_of_record(
    scan: &RecordedScan,
    folder: &Path,
    comparison: Result<&Comparison, &str>,
    provenance: &Provenance,
) -> Dataset {
    let mut dataset = Dataset::default();
    describe(&mut dataset, scan, provenance);
    describe_files(&mut dataset, folder);
    add_readings(&mut dataset, scan, comparison.ok());
    match comparison {
        Ok(comparison) => describe_comparison(&mut dataset, comparison),
        Err(why) => dataset.text("no_simulation", why),
    }
    let maps = match comparison {
        Ok(comparison) => {
            let map = |plane| map_of_comparison(plane, comparison);
            comparison.planes.iter().filter_map(map).collect()
        }
        Err(_) => maps_of_scan(scan),
    };
    add_maps(&mut dataset, maps);
    add_drives(&mut dataset, scan);
    dataset
}

/// States the conventions, the title, and the program that exports.
pub(super) fn describe_program(dataset: &mut Dataset, title: &str, provenance: &Provenance) {
    dataset.text("Conventions", "CF-1.11");
    dataset.text("title", title);
    dataset.text("source", provenance.program.clone());
    dataset.text("history", format!("{} exported by {}", provenance.exported, provenance.program));
}

fn describe(dataset: &mut Dataset, scan: &RecordedScan, provenance: &Provenance) {
    let setup = &scan.setup;
    describe_program(dataset, &format!("Ultrasonic field {}", setup.name), provenance);
    dataset.text("scan_name", setup.name.clone());
    dataset.text("recorded", setup.recorded.to_string());
    dataset.text("reading_unit", setup.unit.clone());
    dataset.text("axes", "right-handed, origin at the centre of the array on the plane of its faces, z away from the array");
    dataset.text("array", setup.array.layout().to_string());
    dataset.attribute("frequency_hz", Attribute::Number(setup.array.frequency_hz()));
    dataset.attribute(
        "speed_of_sound_m_s",
        Attribute::Number(setup.medium.medium().speed_of_sound_m_s),
    );
}

fn describe_files(dataset: &mut Dataset, folder: &Path) {
    for name in TEXTS {
        if let Ok(text) = read_text(&folder.join(name), MOST_TEXT)
            && text.len() <= LONGEST_TEXT
        {
            dataset.text(&name.replace('.', "_"), text);
        }
    }
    for name in ["scan.toml", "samples.csv"] {
        if let Ok(bytes) = read_bytes(&folder.join(name), MOST_TABLE) {
            let digest: String =
                Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            dataset.text(&format!("{}_sha256", name.replace('.', "_")), digest);
        }
    }
}

fn describe_comparison(dataset: &mut Dataset, comparison: &Comparison) {
    let registration = &comparison.registration;
    let number = |value: f64| Attribute::Number(value);
    dataset.text("simulator", comparison.simulator.to_string());
    dataset.text("registration", registration.why.clone());
    dataset.attribute("gain", number(registration.gain.value));
    dataset.attribute("gain_standard_error", number(registration.gain.standard_error));
    let shift_mm = registration.shift_m.map(|along| along.value * 1e3);
    dataset.attribute("shift_mm", Attribute::Numbers(shift_mm.to_vec()));
    dataset.attribute("turn_rad", number(registration.turn_rad.value));
    dataset.attribute("step_ratio", number(registration.step_ratio.value));
    dataset.text("mirror", format!("{:?}", registration.mirror).to_lowercase());
    if let Some(face) = registration.receiver_face_m {
        dataset.attribute("receiver_face_mm", number(face.value * 1e3));
    }
    dataset.attribute("noise_additive", number(comparison.noise.additive));
    dataset.attribute("noise_multiplicative", number(comparison.noise.multiplicative));
    dataset.attribute("residual_rms_ratio", number(comparison.overall.residual_rms_ratio));
    dataset.attribute("correlation", number(comparison.overall.correlation));
}

fn add_readings(dataset: &mut Dataset, scan: &RecordedScan, comparison: Option<&Comparison>) {
    let unit = scan.setup.unit.as_str();
    let point = dataset.dimension("point", scan.samples.len());
    let on = [point];
    let of = |value: fn(&RecordedSample) -> f64| -> Vec<f64> {
        scan.samples.iter().map(value).collect()
    };
    let first = dataset.variables.len();
    dataset.floats("time", &on, of(|s| s.time_s), "s", "time on the recorder's clock");
    let drive = |sample: &RecordedSample| {
        sample.focus.map_or(-1, |focus| i32::try_from(focus).unwrap_or(i32::MAX))
    };
    dataset.integers(
        "drive",
        &on,
        scan.samples.iter().map(drive).collect(),
        "number of the drive, -1 if the array was silent",
    );
    dataset.floats("x", &on, of(|s| s.position_mm.x), "mm", "position along x");
    dataset.floats("y", &on, of(|s| s.position_mm.y), "mm", "position along y");
    dataset.floats("z", &on, of(|s| s.position_mm.z), "mm", "height above the array");
    let coordinates = dataset.variables.len();
    dataset.floats("reading", &on, of(|s| s.reading), unit, "magnitude of the reading");
    if let Some(phase) = scan.setup.phase {
        let phases = of(|s| s.phase_rad.unwrap_or(f64::NAN));
        dataset.floats("reading_phase", &on, phases, "rad", "phase of the reading");
        let (reference, convention) = phase.named();
        dataset.text("phase_reference", reference);
        dataset.text("phase_convention", convention);
    }
    if scan.samples.iter().any(|sample| sample.spread.is_some()) {
        let std = of(|s| s.spread.map_or(f64::NAN, |spread| spread.std));
        dataset.floats(
            "std",
            &on,
            std,
            unit,
            "standard deviation of the single readings that were averaged",
        );
        let count = of(|s| s.spread.map_or(f64::NAN, |spread| f64::from(spread.count)));
        dataset.floats("count", &on, count, "", "number of the single readings that were averaged");
    }
    if let Some(comparison) = comparison {
        let noise =
            of(|s| s.reading).into_iter().map(|reading| comparison.noise.at(reading)).collect();
        dataset.floats(
            "noise",
            &on,
            noise,
            unit,
            "estimated standard deviation of the noise of the reading",
        );
        let simulated = simulated_readings(scan, comparison);
        let differences = scan
            .samples
            .iter()
            .zip(&simulated)
            .map(|(sample, value)| sample.reading - value)
            .collect();
        if let Some(levels) = &comparison.levels {
            levels::add_to_readings(dataset, point, scan, comparison, levels, &simulated);
        }
        dataset.floats(
            "simulation",
            &on,
            simulated,
            unit,
            "simulation at the same point, registered and scaled to the readings",
        );
        dataset.floats("difference", &on, differences, unit, "reading less simulation");
    }
    debug_assert_eq!(coordinates - first, 5);
    for variable in &mut dataset.variables[coordinates..] {
        variable.coordinates = Some("time drive x y z".to_owned());
    }
}

fn map_of_comparison(plane: &PlaneComparison, comparison: &Comparison) -> Option<Map> {
    let ComparedMap { x_m, y_m, scan, simulation, .. } = plane.map.clone()?;
    let difference = scan.iter().zip(&simulation).map(|(a, b)| a - b).collect();
    let unit = &comparison.reading_unit;
    let (mut layers, mut of_plane) = (Vec::new(), Vec::new());
    if let Some(levels) = &comparison.levels {
        levels::add_to_map(&mut layers, &mut of_plane, levels, plane, [&scan, &simulation]);
    }
    let layer = |name, long_name, values| Layer { name, unit: unit.clone(), long_name, values };
    let in_unit = [
        layer("reading", READINGS, scan),
        layer(
            "simulation",
            "simulation on the grid, registered and scaled to the readings",
            simulation,
        ),
        layer("difference", "reading less simulation on the grid", difference),
    ];
    layers.splice(0..0, in_unit);
    Some(Map { drive: plane.focus, z_mm: plane.z_m * 1e3, x_m, y_m, layers, of_plane })
}

const READINGS: &str = "readings on the grid, repeats averaged";

fn maps_of_scan(scan: &RecordedScan) -> Vec<Map> {
    let planes = scan.planes(SAME_HEIGHT_MM);
    let maps = planes.iter().filter_map(|plane| {
        let map = plane_map(plane, OFF_LINE_MM).ok()?.map;
        Some(Map {
            drive: plane.focus,
            z_mm: plane.z_mm,
            x_m: map.x_m().to_vec(),
            y_m: map.y_m().to_vec(),
            layers: vec![Layer {
                name: "reading",
                unit: scan.setup.unit.clone(),
                long_name: READINGS,
                values: map.values().to_vec(),
            }],
            of_plane: Vec::new(),
        })
    });
    maps.collect()
}

fn add_drives(dataset: &mut Dataset, scan: &RecordedScan) {
    let setup = &scan.setup;
    let (array, medium) = (setup.array.array(), setup.medium.medium());
    let (drives, elements) = (setup.foci.len(), array.len());
    if drives > 0 {
        let on_drive = dataset.dimension("drive_number", drives);
        for (axis, name) in ["focus_x", "focus_y", "focus_z"].iter().enumerate() {
            let along = setup.foci.iter().map(|focus| match focus {
                FocusSection::Point(at_mm) => at_mm[axis],
                _ => f64::NAN,
            });
            let long_name = "intended focus of the drive; not a number if it has none";
            dataset.floats(name, &[on_drive], along.collect(), "mm", long_name);
        }
        let on_element = dataset.dimension("element", elements);
        let phases = setup.foci.iter().flat_map(|focus| {
            focus.excitation().phases_rad(array, &medium, setup.array.frequency_hz())
        });
        dataset.floats(
            "phase",
            &[on_drive, on_element],
            phases.collect(),
            "rad",
            "phase of each element",
        );
        let of = |value: fn(&fieldgap_acoustics::Element) -> f64| {
            array.elements().iter().map(value).collect()
        };
        dataset.floats(
            "element_x",
            &[on_element],
            of(|e| e.centre_m.x * 1e3),
            "mm",
            "centre of the element along x",
        );
        dataset.floats(
            "element_y",
            &[on_element],
            of(|e| e.centre_m.y * 1e3),
            "mm",
            "centre of the element along y",
        );
        dataset.floats(
            "element_z",
            &[on_element],
            of(|e| e.centre_m.z * 1e3),
            "mm",
            "centre of the element along z",
        );
    }
}
