//! The studies of the thesis, compared with figures from its own listings.

use std::path::Path;

use fieldgap::input::{Fault, TomlSource};
use fieldgap::study::{
    Figure, MapFigures, Observation, Row, Study, StudyResult, csv, draws_csv, onsets, run, text,
};

/// Focal radius (mm, four decimals), peak (six decimals), sub-peaks.
type Figures = (f64, f64, usize);

/// A study's rows in its order, as written and corrected.
struct Known {
    study: &'static str,
    as_written: &'static [Figures],
    corrected: &'static [Figures],
}

fn study(name: &str) -> Study {
    Study::read(Study::of_thesis(name).expect("a study of the thesis")).expect("a good file")
}

/// Checks the figures; gives the values at which the peak is outside the map: study, convention, number of the value.
fn check(
    known: &Known,
    convention: &str,
    expected: &[Figures],
) -> Vec<(&'static str, String, usize)> {
    let mut outside = Vec::new();
    let by = convention.parse().expect("a simulator");
    let study = study(known.study).with_simulator(by).expect("not swept");
    // The thesis's random array differs from run to run; only the others are known.
    let study = study.with("draws", "1").expect("a count");
    let rows = run(&study, false).expect("a set-up at every value").rows;
    let known_rows: Vec<&Row> = rows.iter().filter(|row| row.draws[0].0.is_none()).collect();
    assert_eq!(known_rows.len(), expected.len(), "{}", known.study);
    for (row, &(radius_mm, peak, sub_peaks)) in known_rows.iter().zip(expected) {
        let Some(found) = row.first().figures() else {
            // Its figures are those of a map's corner, not of a focus.
            outside.push((known.study, convention.to_owned(), row.values[0]));
            continue;
        };
        let said = format!("{} {convention} {:?}: {found:?}", known.study, row.values);
        assert!(
            (found.focal_radius_mm.expect("inside the map") - radius_mm).abs() < 0.6e-4,
            "{said}"
        );
        assert!((found.peak - peak).abs() < 0.6e-6, "{said}");
        assert_eq!(found.sub_peaks, sub_peaks, "{said}");
    }
    outside
}

/// The figures of a row's map.
fn figures(row: &Row) -> &MapFigures {
    row.first().figures().expect("a peak on the map")
}

#[test]
fn a_focus_that_leaves_the_map_is_named_and_has_no_figures() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = steering(folder.path(), |study| {
        study.replace("step_mm = 2.0", "step_mm = 2.0\nsize_mm = 40.0").replace("20.5", "45")
    });
    let rows = rows.expect("good");
    assert_eq!(rows[5].first(), &Observation::OutsideMap);
    assert_eq!((rows[5].figure(Figure::Peak), rows[5].outside()), (None, 1));
    let json = serde_json::to_value(rows[5].first()).expect("JSON");
    assert_eq!(json, serde_json::json!({ "peak_position": "outside-map" }));
    let json = serde_json::to_value(rows[2].first()).expect("JSON");
    assert!(json["peak_position"] == "on-map" && json["peak"].is_number(), "{json}");

    let study = Study::read(TomlSource::read(&folder.path().join("written.toml")).expect("there"));
    let study = study.expect("good");
    let result = StudyResult { rows };
    let table = csv(&study, &result);
    let (header, last) =
        (table.lines().next().expect("a header"), table.lines().last().expect("a row"));
    let cell = |name: &str| {
        let place = header.split(',').position(|column| column == name).expect(name);
        last.split(',').nth(place).expect("a cell")
    };
    assert_eq!(cell("peak_position"), "outside the map");
    for figure in ["peak", "focal_radius_mm", "peak_x_mm", "peak_y_mm", "sub_peaks"] {
        assert_eq!(cell(figure), "", "{table}");
    }
    let said = text(&study, &result, &[]);
    let line = said.lines().find(|line| line.contains("outside the map")).expect("a row");
    assert!(!line.contains('.'), "no figure: {line}");
}

#[test]
fn every_study_gives_the_figures_of_the_listings_as_written() {
    let outside: Vec<_> =
        KNOWN.iter().flat_map(|known| check(known, "as-written", known.as_written)).collect();
    assert_eq!(outside, []);
}

#[test]
fn every_study_gives_the_corrected_figures() {
    let outside: Vec<_> =
        KNOWN.iter().flat_map(|known| check(known, "corrected", known.corrected)).collect();
    assert_eq!(outside, [("comparison", "corrected".to_owned(), 5)]);
}

#[test]
fn sub_peaks_appear_at_another_gap_than_the_formula_predicts() {
    let study = study("spacing");
    let result = run(&study, false).expect("a set-up at every value");
    let found = onsets(&study, &result);
    assert_eq!(found.len(), 1);
    assert!(found[0].appear && found[0].from >= 7.0 && found[0].to <= 8.0, "{found:?}");
    assert!(found[0].to - found[0].from <= 1e-3, "{found:?}");
    // No sub-peaks just below, some from there on.
    for (gap, there) in [(found[0].from, false), (found[0].to, true)] {
        let text = study.source().text().replace("from = 0\n", &format!("from = {gap:?}\n"));
        let text = text.replace("to = 20\n", &format!("to = {gap:?}\n"));
        let narrow = Study::read(TomlSource::new(Path::new("s.toml"), text)).expect("good");
        let rows = run(&narrow, false).expect("a set-up").rows;
        assert_eq!((rows.len(), figures(&rows[0]).sub_peaks > 0), (1, there), "at {gap}");
    }
    let said = text(&study, &result, &found);
    assert!(said.contains("as in the thesis: 6.03 mm"), "{said}");
    assert!(said.contains("(pitch "), "{said}");
    assert!(said.contains("2.4 mm from its face"), "{said}");
}

#[test]
fn random_arrays_give_distributions_and_are_reproducible() {
    let study = study("shape").with("draws", "30").expect("a count");
    let result = run(&study, false).expect("a set-up at every value");
    let random = &result.rows[0];
    assert_eq!(random.draws.len(), 30);
    let seeds: Vec<Option<u32>> = random.draws.iter().map(|(seed, _)| *seed).collect();
    assert_eq!(seeds, (1..=30).map(Some).collect::<Vec<_>>());
    let peak = random.figure(Figure::Peak).expect("every map has a peak");
    assert!(peak.p05 < peak.median && peak.median < peak.p95 && peak.standard_deviation > 0.0);
    let again = run(&study, false).expect("a set-up at every value");
    assert_eq!(draws_csv(&study, &result), draws_csv(&study, &again));
    assert_eq!(draws_csv(&study, &result).lines().count(), 1 + 3 * 30);
    assert_eq!(csv(&study, &result).lines().count(), 1 + 4 * 3);
}

/// A study of two sweeps over the array of a rig file.
fn steering(folder: &Path, change: impl Fn(&str) -> String) -> Result<Vec<Row>, Fault> {
    let rig = "name = \"r\"\n[array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 4\nrows = 4\n\
               element_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\nspeed_of_sound_m_s = 343.0\n";
    std::fs::write(folder.join("r.toml"), rig).expect("written");
    let study = "name = \"steering\"\nrig = \"r.toml\"\n[simulator]\nmodel = \"piston\"\n\
                 [focus]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 80.0\n[map]\nstep_mm = 2.0\n\
                 [[sweep]]\nparameter = \"focus.x_mm\"\nvalues = [0, 20.5]\n\
                 [[sweep]]\nparameter = [\"array.columns\", \"array.rows\"]\nfrom = 2\nto = 4\nstep = 1\n";
    std::fs::write(folder.join("written.toml"), change(study)).expect("written");
    let source = TomlSource::new(&folder.join("s.toml"), change(study));
    Ok(run(&Study::read(source)?, false)?.rows)
}

#[test]
fn two_parameters_of_a_rig_are_swept() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = steering(folder.path(), str::to_owned).expect("good");
    let seen: Vec<(Vec<usize>, usize)> =
        rows.iter().map(|row| (row.values.clone(), row.elements)).collect();
    let expected = [
        (vec![0, 0], 4),
        (vec![0, 1], 9),
        (vec![0, 2], 16),
        (vec![1, 0], 4),
        (vec![1, 1], 9),
        (vec![1, 2], 16),
    ];
    assert_eq!(seen, expected);
    // The peak of a large array follows its focus as far as the directivity permits; that of a small one lags behind.
    assert!(figures(&rows[2]).peak_x_mm.abs() < 1.0 && figures(&rows[5]).peak_x_mm > 14.0);
    assert!(rows.iter().all(|row| row.z_mm == 80.0));
}

#[test]
fn faults_of_a_study_have_the_right_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let cases = [
        (
            "\"focus.x_mm\"",
            "\"focus.radius_mm\"",
            "s.toml (focus.radius_mm = 0, array",
            "radius_mm",
        ),
        (
            "from = 2",
            "from = 0",
            "r.toml (focus.x_mm = 0, array.columns = array.rows = 0)",
            "nonzero",
        ),
        ("\"focus.x_mm\"", "\"name.x\"", "s.toml:", "`name.x` is not a key"),
        ("\"piston\"", "\"cylinder\"", "s.toml (focus.x_mm = 0", "cylinder"),
        ("r.toml", "q.toml", "s.toml:2:", "q.toml: cannot be read"),
        ("step_mm = 2.0", "step_mm = 200.0", "s.toml (", "too few or too many points"),
        ("rig = \"r.toml\"", "rig = \"r.toml\"\ndrawn = 3", "s.toml:3:", "drawn"),
        (
            "[map]",
            "[medium]\nspeed_of_sound_m_s = 3.0\n[map]",
            "s.toml:9:",
            "[medium] is given by `rig`",
        ),
    ];
    for (from, to, place, message) in cases {
        let fault = steering(folder.path(), |text| text.replacen(from, to, 1)).expect_err(to);
        assert!(fault.to_string().contains(place), "{to}: {fault}");
        assert!(fault.problem().contains(message), "{to}: {fault}");
    }
    let three = "\n[[sweep]]\nparameter = \"focus.y_mm\"\nvalues = [0]\n";
    let fault = steering(folder.path(), |text| format!("{text}{three}")).expect_err("three");
    assert!(fault.problem().contains("3 sweeps"), "{fault}");
}

const KNOWN: [Known; 5] = [
    Known {
        study: "shape",
        as_written: &[
            (22.5000, 9.299776, 0),
            (3.5509, 8.432597, 0),
            (24.7364, 9.005121, 0),
            (9.0000, 24.238941, 0),
            (9.7637, 13.113605, 1),
            (9.0417, 20.704764, 0),
            (8.0000, 23.687785, 0),
            (10.1446, 12.628975, 1),
            (9.0450, 19.924847, 0),
        ],
        corrected: &[
            (22.7873, 5.506962, 0),
            (4.4491, 4.993452, 0),
            (25.1496, 5.332478, 0),
            (9.3104, 14.353347, 0),
            (10.7872, 7.765361, 1),
            (9.7226, 12.260547, 0),
            (8.9479, 14.026974, 0),
            (10.3819, 7.478382, 1),
            (9.3722, 11.798710, 0),
        ],
    },
    Known {
        study: "height",
        as_written: &[
            (13.0000, 4.939622, 0),
            (11.0000, 8.916520, 0),
            (10.0000, 12.615677, 0),
            (9.0000, 15.701630, 0),
            (9.0000, 18.154007, 0),
            (9.0000, 20.071197, 0),
            (9.0000, 21.569558, 0),
            (9.0000, 22.749195, 0),
            (8.0000, 23.687785, 0),
            (8.0000, 24.443320, 0),
            (8.0000, 25.058591, 0),
            (8.0000, 25.565188, 0),
            (8.0000, 25.986594, 0),
            (8.0000, 26.340432, 0),
            (8.0000, 26.640071, 0),
            (8.0000, 26.895772, 0),
            (8.0000, 27.115490, 0),
            (8.0000, 27.305469, 0),
            (8.0000, 27.470651, 0),
        ],
        corrected: &[
            (24.3701, 1.406888, 44),
            (22.0362, 2.252013, 11),
            (18.1143, 3.812896, 3),
            (13.5498, 6.058169, 0),
            (8.9410, 9.654856, 0),
            (7.6232, 12.117411, 0),
            (7.8223, 13.329881, 0),
            (8.3200, 13.856925, 0),
            (8.9479, 14.026974, 0),
            (9.6049, 13.622758, 0),
            (10.3680, 12.843855, 0),
            (11.2041, 12.247211, 0),
            (11.9300, 11.650953, 0),
            (12.7538, 10.763678, 0),
            (13.7664, 10.013374, 0),
            (14.5393, 9.484685, 0),
            (15.3590, 8.769555, 0),
            (16.5508, 8.075984, 0),
            (17.3734, 7.635278, 0),
        ],
    },
    Known {
        study: "count",
        as_written: &[
            (48.0000, 0.825641, 0),
            (24.0000, 3.156540, 0),
            (16.0000, 6.835274, 0),
            (12.0000, 11.778464, 0),
            (10.0000, 17.248663, 0),
            (8.0000, 23.687785, 0),
            (7.0000, 29.768587, 0),
            (7.0000, 36.620241, 0),
            (6.0000, 43.617787, 0),
            (6.0000, 50.229208, 0),
            (5.0000, 56.509893, 0),
            (5.0000, 62.349274, 0),
            (5.0000, 67.536647, 0),
            (4.0000, 72.102759, 0),
            (4.0000, 77.153258, 0),
            (4.0000, 82.877360, 0),
            (4.0000, 86.644847, 0),
            (4.0000, 89.596095, 0),
            (4.0000, 94.962964, 0),
            (4.0000, 97.097345, 0),
            (4.0000, 100.811785, 0),
            (4.0000, 104.067202, 0),
            (3.0000, 106.074989, 0),
            (3.0000, 109.796760, 0),
            (3.0000, 111.076485, 0),
            (3.0000, 114.494313, 0),
            (3.0000, 115.881636, 0),
            (3.0000, 118.248309, 0),
            (3.0000, 120.619686, 0),
            (3.0000, 121.241678, 0),
        ],
        corrected: &[
            (48.7169, 0.488912, 0),
            (24.7236, 1.869179, 0),
            (16.8234, 4.047580, 0),
            (12.8032, 6.974743, 0),
            (10.4449, 10.213980, 0),
            (8.9479, 14.026974, 0),
            (7.8679, 17.627786, 0),
            (7.0771, 21.685066, 0),
            (6.4804, 25.828738, 0),
            (6.0194, 29.743761, 0),
            (5.6455, 33.462935, 0),
            (5.3475, 36.920787, 0),
            (5.1015, 39.992546, 0),
            (4.8927, 42.696417, 0),
            (4.7146, 45.687124, 0),
            (4.5669, 49.076712, 0),
            (4.4421, 51.307670, 0),
            (4.3302, 53.055282, 0),
            (4.2333, 56.233331, 0),
            (4.1504, 57.497228, 0),
            (4.0708, 59.696773, 0),
            (4.0058, 61.624502, 0),
            (3.9400, 62.813435, 0),
            (3.8870, 65.017321, 0),
            (3.8337, 65.775125, 0),
            (3.7910, 67.799027, 0),
            (3.7463, 68.620546, 0),
            (3.7116, 70.021996, 0),
            (3.6735, 71.426232, 0),
            (3.6441, 71.794552, 0),
        ],
    },
    Known {
        study: "spacing",
        as_written: &[
            (8.0000, 23.687785, 0),
            (8.0000, 22.810073, 0),
            (7.0000, 21.685396, 0),
            (7.0000, 21.208050, 0),
            (6.0000, 20.343155, 0),
            (6.0000, 19.349313, 0),
            (6.0000, 18.920682, 0),
            (6.0000, 17.829537, 0),
            (5.0000, 17.376203, 4),
            (5.0000, 16.479782, 4),
            (5.0000, 15.932591, 4),
            (5.0000, 15.183751, 8),
            (5.0000, 14.648382, 8),
            (5.0000, 13.940678, 8),
            (4.0000, 13.510489, 8),
            (4.0000, 12.777306, 8),
            (4.0000, 12.476116, 8),
            (4.0000, 11.746680, 8),
            (4.0000, 11.472827, 8),
            (4.0000, 10.903629, 8),
            (4.0000, 10.474545, 8),
        ],
        corrected: &[
            (8.9479, 14.026974, 0),
            (8.2798, 13.507228, 0),
            (7.7489, 12.841239, 0),
            (7.2967, 12.558573, 0),
            (6.8999, 12.046416, 0),
            (6.5681, 11.457902, 0),
            (6.2775, 11.204083, 0),
            (6.0245, 10.557951, 0),
            (5.7986, 10.289504, 4),
            (5.6012, 9.758679, 4),
            (5.4253, 9.434654, 4),
            (5.2714, 8.991220, 8),
            (5.1295, 8.674195, 8),
            (5.0051, 8.255121, 8),
            (4.8857, 8.000380, 8),
            (4.7826, 7.566218, 8),
            (4.6861, 7.387865, 8),
            (4.5999, 6.955922, 8),
            (4.5224, 6.793757, 8),
            (4.4475, 6.456700, 8),
            (4.3842, 6.202614, 8),
        ],
    },
    Known {
        study: "comparison",
        as_written: &[
            (13.2478, 2.589546, 0),
            (11.7984, 3.897506, 0),
            (9.6904, 11.541938, 0),
            (9.0450, 19.924847, 0),
            (8.5162, 23.792219, 0),
            (8.5024, 25.669596, 0),
        ],
        corrected: &[
            (11.7459, 1.460638, 35),
            (11.9667, 1.797156, 35),
            (13.3141, 5.927436, 3),
            (9.3722, 11.798710, 0),
            (14.0177, 8.878550, 0),
            (15.2888, 5.829558, 0),
        ],
    },
];
