use super::*;
use crate::dataset::Dataset;
use crate::export::bytes_of;

fn opened(path: &Path, bytes: Vec<u8>) -> ArrayFile {
    match ArrayFile::of_bytes(path, bytes) {
        Ok(Opened::Arrays(file)) => file,
        Ok(Opened::Text(_)) => panic!("{} holds no arrays", path.display()),
        Err(fault) => panic!("{fault}"),
    }
}

/// A stack of two planes with three rows and four columns: value 100 z + 10 y + x.
fn stack() -> (Dataset, Vec<f64>) {
    let values: Vec<f64> = (0..2)
        .flat_map(|z| {
            (0..3).flat_map(move |y| (0..4).map(move |x| f64::from(100 * z + 10 * y + x)))
        })
        .collect();
    let mut dataset = Dataset::default();
    let [z, y, x] =
        [("z", 2), ("y", 3), ("x", 4)].map(|(name, length)| dataset.dimension(name, length));
    dataset.text("title", "a test");
    dataset.floats("x", &[x], vec![0.0, 1.0, 2.0, 3.0], "mm", "columns");
    dataset.floats("p", &[z, y, x], values.clone(), "V", "values");
    dataset.integers("n", &[], vec![7], "a number");
    (dataset, values)
}

#[test]
fn what_is_written_in_each_format_is_listed_and_read() {
    let (dataset, values) = stack();
    for ending in ["nc", "h5", "mat", "npz"] {
        let name = format!("stack.{ending}");
        let path = Path::new(&name);
        let bytes = bytes_of(&dataset, path).expect("written");
        let file = opened(path, bytes);
        let find =
            |name: &str| file.listed.iter().position(|array| array.name == name).expect(name);
        let p = &file.listed[find("p")];
        let read = file.read(find("p")).expect("read").real;
        if ending == "mat" {
            // MATLAB has rows, columns and pages.
            assert_eq!(p.shape, [3, 4, 2]);
            let again: Vec<f64> = (0..2)
                .flat_map(|z| (0..12).map(move |yx| (z, yx)))
                .map(|(z, yx)| read[yx * 2 + z])
                .collect();
            assert_eq!(again, values, "{ending}");
        } else {
            assert_eq!((&p.shape[..], &read), (&[2, 3, 4][..], &values), "{ending}");
        }
        assert_eq!(file.read(find("x")).expect("read").real, [0.0, 1.0, 2.0, 3.0], "{ending}");
        assert_eq!(file.read(find("n")).expect("read").real, [7.0], "{ending}");
        if ["nc", "h5"].contains(&ending) {
            assert_eq!(p.unit.as_deref(), Some("V"), "{ending}");
            assert_eq!(p.dimensions, Some(["z", "y", "x"].map(str::to_owned).to_vec()), "{ending}");
        }
    }
}

#[test]
fn damaged_files_are_refused_at_any_length() {
    let (dataset, _) = stack();
    for ending in ["nc", "h5", "mat", "npz"] {
        let name = format!("stack.{ending}");
        let path = Path::new(&name);
        let whole = bytes_of(&dataset, path).expect("written");
        for length in (0..whole.len()).step_by(1 + whole.len() / 200) {
            let Ok(Opened::Arrays(file)) = ArrayFile::of_bytes(path, whole[..length].to_vec())
            else {
                continue;
            };
            for index in 0..file.listed.len() {
                let _ = file.read(index);
            }
        }
    }
}

#[test]
fn a_file_is_what_its_name_says() {
    for name in ["a.mat", "a.npy", "a.h5", "a.nc", "a.npz"] {
        let refused = ArrayFile::of_bytes(Path::new(name), b"1,2,3,4\n".to_vec());
        assert!(refused.is_err_and(|fault| fault.problem().contains("as its name says")), "{name}");
    }
    let text = ArrayFile::of_bytes(Path::new("a.txt"), b"1,2,3,4\n".to_vec());
    assert!(matches!(text, Ok(Opened::Text(_))));
}

#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    let file = opened(Path::new("a.npy"), bytes);
    let fault = file.read(0).expect_err("too large");
    assert!(fault.problem().contains("1000000000000 values; at most 10000000"), "{fault}");
}

#[test]
fn arrays_with_the_first_dimension_fastest_are_reordered() {
    // Columns of a matrix of two rows and three columns.
    assert_eq!(
        row_major(vec![1.0, 4.0, 2.0, 5.0, 3.0, 6.0], &[2, 3]),
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    );
}
