//! Sound pressures and levels beside the readings, where the sensitivity of the receiver is known.

use fieldgap_comparison::{Comparison, Levels, PlaneComparison, PlaneLevels};
use fieldgap_level::{COVERAGE_FACTOR, REFERENCE_PA, level_db};
use fieldgap_records::{RecordedSample, RecordedScan, SAME_HEIGHT_MM};

use super::grids::Layer;
use crate::dataset::{Attribute, Dataset};

/// Names, units and descriptions of what readings and simulation become.
const ARRAYS: [[(&str, &str, &str); 2]; 2] = [
    [
        ("pressure", "Pa", "sound pressure of the reading, root mean square"),
        ("level", "dB", "sound pressure level of the reading, re 20 uPa"),
    ],
    [
        ("simulation_pressure", "Pa", "sound pressure of the simulation, root mean square"),
        ("simulation_level", "dB", "sound pressure level of the simulation, re 20 uPa"),
    ],
];

/// What is known of the levels of a height.
const EXPANDED: (&str, &str, &str) = (
    "peak_level_expanded",
    "dB",
    "expanded uncertainty (k = 2) of the level of the largest reading at this height",
);

/// Level of a pressure, dB; NaN of no sound, and of none that is known.
fn level(rms_pa: f64) -> f64 {
    if rms_pa > 0.0 { level_db(rms_pa) } else { f64::NAN }
}

/// Adds pressures and levels of the readings and the simulation; NaN where the array was silent or the height has no level.
pub(super) fn add_to_readings(
    dataset: &mut Dataset,
    point: usize,
    scan: &RecordedScan,
    comparison: &Comparison,
    levels: &Levels,
    simulated: &[f64],
) {
    dataset.attribute("rms_pa_per_reading", Attribute::Number(levels.rms_pa_per_reading));
    dataset.attribute("level_reference_pa", Attribute::Number(REFERENCE_PA));
    dataset.attribute("level_coverage_factor", Attribute::Number(COVERAGE_FACTOR));
    dataset.text("level_notes", levels.notes.join(" "));
    let of: Vec<Option<&PlaneLevels>> =
        scan.samples.iter().map(|sample| plane_of(sample, comparison, levels)).collect();
    let pa_per_reading = of.iter().map(|of| of.map_or(f64::NAN, |plane| levels.rms_pa_in(plane)));
    let pa_per_reading: Vec<f64> = pa_per_reading.collect();
    let readings: Vec<f64> = scan.samples.iter().map(|sample| sample.reading).collect();
    for (names, values) in ARRAYS.iter().zip([&readings[..], simulated]) {
        let rms_pa: Vec<f64> = values.iter().zip(&pa_per_reading).map(|(v, pa)| v * pa).collect();
        let levels_db = rms_pa.iter().copied().map(level).collect();
        for ((name, unit, long_name), values) in names.iter().zip([rms_pa, levels_db]) {
            dataset.floats(name, &[point], values, unit, long_name);
        }
    }
    let expanded_db = of.iter().map(|of| of.map_or(f64::NAN, |plane| plane.expanded_db));
    let (name, unit, long_name) = EXPANDED;
    dataset.floats(name, &[point], expanded_db.collect(), unit, long_name);
}

/// The plane with a level that a reading belongs to.
fn plane_of<'l>(
    sample: &RecordedSample,
    comparison: &Comparison,
    levels: &'l Levels,
) -> Option<&'l PlaneLevels> {
    let away_mm = |plane: &PlaneComparison| (plane.z_m * 1e3 - sample.position_mm.z).abs();
    let planes = comparison.planes.iter().filter(|plane| Some(plane.focus) == sample.focus);
    let nearest = planes.min_by(|a, b| away_mm(a).total_cmp(&away_mm(b)))?;
    levels.of_plane(nearest).filter(|_| away_mm(nearest) <= SAME_HEIGHT_MM)
}

/// The same for the map of a plane, of its readings and its simulation. A plane without a level has NaN, so that all planes have the same layers.
pub(super) fn add_to_map(
    layers: &mut Vec<Layer>,
    of_plane: &mut Vec<Layer>,
    levels: &Levels,
    plane: &PlaneComparison,
    maps: [&[f64]; 2],
) {
    let of = levels.of_plane(plane);
    let pa_per_reading = of.map_or(f64::NAN, |of| levels.rms_pa_in(of));
    let layer = |(name, unit, long_name): (&'static str, &str, &'static str), values| Layer {
        name,
        unit: unit.to_owned(),
        long_name,
        values,
    };
    for ([pressure, in_db], values) in ARRAYS.into_iter().zip(maps) {
        let rms_pa: Vec<f64> = values.iter().map(|value| value * pa_per_reading).collect();
        let levels_db = rms_pa.iter().copied().map(level).collect();
        layers.extend([layer(pressure, rms_pa), layer(in_db, levels_db)]);
    }
    of_plane.push(layer(EXPANDED, vec![of.map_or(f64::NAN, |of| of.expanded_db)]));
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_acoustics::Vec3;
    use fieldgap_comparison::{Registering, compare};
    use fieldgap_input::TomlSource;
    use fieldgap_records::ScanSetup;

    use super::*;
    use crate::dataset::{Values, Variable};
    use crate::export::{Provenance, dataset_of_record, grid_rows};

    /// Two heights over one element, read in V by a receiver of 3 mV/Pa; a silent reading, and a point at no height of a map.
    fn record(receiver: &str) -> RecordedScan {
        let text = format!(
            "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
             [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 2\nrows = 2\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
             [medium]\ntemperature_c = 20.0\nhumidity_percent = 50.0\n{receiver}\
             [simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 90.0\n"
        );
        let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good");
        let simulation = setup.simulation(setup.simulator, 0).expect("a focus");
        let mut samples = vec![RecordedSample::measured(0.0, None, Vec3::zeros(), 1e-4, None)];
        for z in [80.0, 100.0] {
            for y in 0..7 {
                for x in 0..7 {
                    let at_m =
                        Vec3::new(3.0 * f64::from(x) - 9.0, 3.0 * f64::from(y) - 9.0, z) / 1e3;
                    let reading = 0.01 * simulation.magnitudes(&[at_m])[0];
                    let time_s = samples.len() as f64;
                    samples.push(RecordedSample::measured(time_s, Some(0), at_m, reading, None));
                }
            }
        }
        RecordedScan { setup, samples }
    }

    fn exported(scan: &RecordedScan) -> (Dataset, Comparison) {
        let comparison =
            compare(scan, scan.setup.simulator, Registering::GainOnly).expect("comparable");
        let provenance =
            Provenance { program: "p".to_owned(), exported: jiff::Timestamp::UNIX_EPOCH };
        let dataset = dataset_of_record(scan, Path::new("none"), Ok(&comparison), &provenance);
        (dataset, comparison)
    }

    fn found<'d>(dataset: &'d Dataset, name: &str) -> Option<&'d Variable> {
        dataset.variables.iter().find(|variable| variable.name == name)
    }

    fn values<'d>(dataset: &'d Dataset, name: &str) -> &'d [f64] {
        match found(dataset, name).map(|variable| &variable.values) {
            Some(Values::Float(values)) => values,
            _ => panic!("no floats {name}"),
        }
    }

    #[test]
    fn readings_become_pascals_and_decibels_with_the_uncertainty_of_their_height() {
        let scan = record(
            "[receiver]\nsensitivity_v_pa = 0.003\nsensitivity_u_percent = 3.0\nreads = \"rms\"\n",
        );
        let (dataset, comparison) = exported(&scan);
        let [pressure, level, expanded] =
            ["pressure", "level", "peak_level_expanded"].map(|name| values(&dataset, name));
        assert!(pressure[0].is_nan() && level[0].is_nan() && expanded[0].is_nan(), "it was silent");
        let planes = &comparison.levels.as_ref().expect("levels").planes;
        assert_eq!(planes.len(), 2);
        for (row, sample) in scan.samples.iter().enumerate().skip(1) {
            // 3 mV/Pa in all directions: volts over volts per pascal.
            let rms_pa = sample.reading / 0.003;
            assert!((pressure[row] / rms_pa - 1.0).abs() < 1e-12, "{row}");
            assert!((level[row] - 20.0 * (rms_pa / 20e-6).log10()).abs() < 1e-9, "{row}");
            let plane = &planes[usize::from(row > 49)];
            assert_eq!(expanded[row], plane.expanded_db);
        }
        let units = ["pressure", "level", "simulation_pressure", "simulation_level"]
            .map(|name| found(&dataset, name).and_then(|variable| variable.unit.clone()));
        assert_eq!(units.map(Option::unwrap_or_default), ["Pa", "dB", "Pa", "dB"]);

        // The maps, and their rows.
        assert_eq!(values(&dataset, "grid_pressure").len(), 98);
        assert_eq!(
            values(&dataset, "grid_peak_level_expanded"),
            [planes[0].expanded_db, planes[1].expanded_db]
        );
        let peak = values(&dataset, "grid_level")[..49].iter().copied().fold(f64::NAN, f64::max);
        // The peak of the comparison is refined below the step.
        assert!((peak - planes[0].scan.level_db).abs() < 0.2, "{peak}");
        let rows = grid_rows(&dataset).expect("grids");
        assert_eq!(
            values(&rows, "peak_level_expanded")[48..50],
            [planes[0].expanded_db, planes[1].expanded_db]
        );
        assert_eq!(values(&rows, "pressure"), values(&dataset, "grid_pressure"));
    }

    #[test]
    fn a_response_over_angle_is_in_the_pressures() {
        // 2 dB less at every angle but the axis: of four elements off the axis, each wave is heard 2 dB less.
        let scan = record(
            "[receiver]\nsensitivity_v_pa = 0.003\nsensitivity_u_percent = 3.0\nreads = \"rms\"\n\
             response_angle_deg = [0.0, 0.1, 90.0]\nresponse_db = [0.0, -2.0, -2.0]\nresponse_u_db = 0.3\n",
        );
        let (dataset, _) = exported(&scan);
        let added_db =
            values(&dataset, "level")[1] - 20.0 * (scan.samples[1].reading / 0.003 / 20e-6).log10();
        assert!((added_db - 2.0).abs() < 1e-6, "{added_db}");
    }

    #[test]
    fn without_a_sensitivity_there_are_no_levels() {
        let (dataset, _) = exported(&record(""));
        assert!(found(&dataset, "pressure").is_none() && found(&dataset, "grid_level").is_none());
    }
}
