use serde::Deserialize;

use super::*;

#[derive(Deserialize)]
struct File {
    array: Spanned<ArrayTable>,
}

fn read(text: &str) -> Result<ArraySection, Fault> {
    read_in(Path::new("nowhere"), text)
}

fn read_in(folder: &Path, text: &str) -> Result<ArraySection, Fault> {
    let text = format!("[array]\nfrequency_hz = 40000.0\n{text}");
    let source = TomlSource::new(&folder.join("scan.toml"), text);
    let file: File = source.parse()?;
    ArraySection::read(&file.array, &source)
}

const RIMS: &str = "element_diameter_mm = 10.5\nspacing_mm = 0.5\n";

#[test]
fn every_layout_is_built() {
    let cases = [
        ("layout = \"square\"\ncolumns = 6\nrows = 5\n", 30),
        ("layout = \"linear\"\ncount = 7\n", 7),
        ("layout = \"hexagonal\"\nrings = 3\n", 37),
        ("layout = \"hexagonal\"\nrings = 0\n", 1),
        ("layout = \"hexagonal-thesis\"\nrings = 3\n", 37),
        ("layout = \"random\"\ncount = 36\nseed = 7\n", 36),
    ];
    for (text, elements) in cases {
        let section = read(&format!("{text}{RIMS}")).expect(text);
        assert_eq!(section.array().len(), elements, "{text}");
        assert_eq!(section.layout().elements(), elements as u64, "{text}");
        assert_eq!(section.frequency_hz(), 40e3);
    }
}

#[test]
fn the_pitch_is_diameter_and_gap() {
    let section =
        read(&format!("layout = \"square\"\ncolumns = 2\nrows = 1\n{RIMS}")).expect("good");
    let elements = section.array().elements();
    assert!(((elements[1].centre_m - elements[0].centre_m).norm() - 0.011).abs() < 1e-15);
}

#[test]
fn a_pitch_stands_for_the_spacing() {
    let square = "layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\n";
    let by_spacing = read(&format!("{square}spacing_mm = 0.5\n")).expect("good");
    let by_pitch = read(&format!("{square}pitch_mm = 11.0\n")).expect("good");
    assert_eq!(by_pitch, by_spacing);
    let without_gap = read(&format!("{square}pitch_mm = 10.5\n")).expect("good");
    assert_eq!(without_gap, read(&format!("{square}spacing_mm = 0.0\n")).expect("good"));
}

#[test]
fn a_pitch_that_contradicts_other_keys_is_refused() {
    let square = "layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\n";
    let cases = [
        ("spacing_mm = 0.5\npitch_mm = 11.0\n", "both given"),
        ("pitch_mm = 10.0\n", "smaller than the elements' diameter of 10.5 mm"),
    ];
    for (keys, said) in cases {
        let fault = read(&format!("{square}{keys}")).expect_err(keys);
        assert!(fault.problem().contains(said), "{fault}");
    }
    let fault =
        read("layout = \"elements\"\nfile = \"a.csv\"\npitch_mm = 10.0\n").expect_err("no lattice");
    assert!(fault.problem().contains("`pitch_mm` does not belong"), "{fault}");
}

#[test]
fn all_keys_that_a_layout_lacks_are_told_at_once() {
    let fault = read("layout = \"random\"\nelement_diameter_mm = 10.0\n").expect_err("three keys");
    assert_eq!(
        fault.problem(),
        "3 keys are missing: `count` in [array], `seed` in [array], `spacing_mm` (mm) in [array]"
    );
}

#[test]
fn elements_are_looked_for_beside_the_file_that_names_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "layout = \"elements\"\nfile = \"mine.csv\"\n";
    let missing = read_in(folder.path(), text).expect_err("not there yet");
    assert_eq!(missing.path(), folder.path().join("mine.csv"));

    let csv = "x_mm,y_mm,z_mm,nx,ny,nz,radius_mm,amplitude,phase_rad\n1,2,3,0,0,1,4.5,1,0\n";
    std::fs::write(folder.path().join("mine.csv"), csv).expect("written");
    let section = read_in(folder.path(), text).expect("good");
    assert_eq!(section.array().len(), 1);
}

#[test]
fn keys_that_do_not_belong_or_are_missing_are_named() {
    let cases = [
        ("layout = \"square\"\ncolumns = 6\nrows = 6\nrings = 3\n", 6, "`rings`"),
        ("layout = \"square\"\ncolumns = 6\n", 1, "`rows`"),
        ("layout = \"square\"\ncolumns = 0\nrows = 6\n", 4, "nonzero"),
        ("layout = \"linear\"\ncount = 3\nseed = 1\n", 5, "`seed`"),
        ("layout = \"random\"\ncount = 3\n", 1, "`seed`"),
        ("layout = \"hexagonal\"\nrings = 2\nfile = \"a.csv\"\n", 5, "`file`"),
        ("layout = \"hexagonal-thesis\"\nrings = 4\n", 3, "0 to 3 rings"),
        ("layout = \"hexagonal\"\nrings = 4000000000\n", 3, "at most 10000 elements"),
        ("layout = \"elements\"\nfile = \"a.csv\"\n", 5, "`element_diameter_mm`"),
        ("layout = \"spiral\"\n", 3, "spiral"),
        ("layout = \"square\"\ncolums = 6\n", 4, "colums"),
    ];
    for (text, line, said) in cases {
        let fault = read(&format!("{text}{RIMS}")).expect_err(text);
        assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{text}: {fault}");
        assert!(fault.problem().contains(said), "{text}: {fault}");
    }
    let fault =
        read("layout = \"linear\"\ncount = 3\nspacing_mm = 0.0\n").expect_err("no diameter");
    assert!(fault.problem().contains("`element_diameter_mm`"), "{fault}");
}

#[test]
fn a_transducer_is_found_by_its_name_or_by_its_path_and_lends_its_face() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "name = \"t\"\nradius_mm = 3.0\n[directivity]\nlaw = \"even\"\n";
    std::fs::create_dir(folder.path().join("transducers")).expect("made");
    std::fs::write(folder.path().join("transducers/t.toml"), text).expect("written");
    let array = format!("layout = \"linear\"\ncount = 2\n{RIMS}");
    for name in ["t", "transducers/t.toml"] {
        let section =
            read_in(folder.path(), &format!("{array}transducer = \"{name}\"\n")).expect("good");
        assert_eq!(section.transducer_file().expect("named").name(), "t");
        assert!(section.array().transducer().is_some());
        assert!(section.array().elements().iter().all(|element| element.radius_m == 3e-3));
    }
    let fault = read_in(folder.path(), &format!("{array}transducer = \"u\"\n")).expect_err("none");
    assert_eq!(fault.line_column(), Some((7, 14)));
    assert!(fault.problem().contains("u.toml"), "{fault}");
}
