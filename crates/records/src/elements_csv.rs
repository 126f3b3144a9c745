//! `elements.csv`: the elements of an array, one by one.
//!
//! `x_mm,y_mm,z_mm,nx,ny,nz,radius_mm,amplitude,phase_rad`; the normal may have any length but zero.

use std::io::{self, Write};
use std::path::Path;

use super::sample::millimetres;
use super::table::{Row, Table};
use fieldgap_acoustics::{Element, Vec3};
use fieldgap_input::Fault;

const NAMES: [&str; 9] =
    ["x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "radius_mm", "amplitude", "phase_rad"];

/// Reads an `elements.csv`.
///
/// # Errors
/// A [`Fault`] at the first invalid row: wrong number of columns, unreadable or non-finite number, normal of zero length, radius not
/// above zero, negative amplitude; or of the file, if it has no element.
pub fn read_elements(path: &Path) -> Result<Vec<Element>, Fault> {
    elements_of(&Table::read(path)?)
}

fn elements_of(table: &Table) -> Result<Vec<Element>, Fault> {
    let mut rows = table.rows(b',');
    match rows.next() {
        Some(header) if header.cells().eq(NAMES) => {}
        Some(header) => {
            let wrong =
                (0..header.len()).find(|&index| Some(&header.cell(index)) != NAMES.get(index));
            return Err(header.fault(
                wrong.unwrap_or(header.len()),
                "the header is not that of a file of elements",
                format!("the first line is `{}`", NAMES.join(",")),
            ));
        }
        None => return Err(no_element(table)),
    }
    let elements = rows.map(|row| element_of(&row)).collect::<Result<Vec<_>, _>>()?;
    if elements.is_empty() { Err(no_element(table)) } else { Ok(elements) }
}

fn no_element(table: &Table) -> Fault {
    Fault::of_file(
        table.path(),
        "has no element",
        format!("write a line for each element below the header `{}`", NAMES.join(",")),
    )
}

fn element_of(row: &Row<'_>) -> Result<Element, Fault> {
    if row.len() != NAMES.len() {
        return Err(row.fault(
            row.len().min(NAMES.len()),
            format!("the row has {} cells where an element has {}", row.len(), NAMES.len()),
            format!("write `{}`", NAMES.join(",")),
        ));
    }
    let number = |index: usize| row.number(index, NAMES[index]);
    let direction = Vec3::new(number(3)?, number(4)?, number(5)?);
    let normal = unit(direction).ok_or_else(|| {
        row.fault(
            3,
            "the normal (nx, ny, nz) has zero length",
            "write the direction in which the element radiates; 0,0,1 is straight into the field",
        )
    })?;
    let radius_mm = number(6)?;
    if radius_mm <= 0.0 {
        return Err(row.wrong(6, NAMES[6], "a number above zero"));
    }
    let amplitude = number(7)?;
    if amplitude < 0.0 {
        return Err(row.wrong(
            7,
            NAMES[7],
            "zero or a number above zero (π in phase_rad reverses)",
        ));
    }
    Ok(Element {
        centre_m: Vec3::new(number(0)?, number(1)?, number(2)?) / 1e3,
        normal,
        radius_m: radius_mm / 1e3,
        amplitude,
        phase_rad: number(8)?,
    })
}

/// The unit vector of a direction; `None` if it has zero length.
fn unit(direction: Vec3) -> Option<Vec3> {
    // A unit vector is not changed, so that a file does not change when it is read and written.
    let rounding = 4.0 * f64::EPSILON;
    if (direction.norm_squared() - 1.0).abs() <= rounding {
        return Some(direction);
    }
    direction.try_normalize(f64::MIN_POSITIVE)
}

/// Writes an `elements.csv`; lengths are rounded to the nanometre.
///
/// # Errors
/// What `out` reports.
pub fn write_elements(out: &mut impl Write, elements: &[Element]) -> io::Result<()> {
    writeln!(out, "{}", NAMES.join(","))?;
    for element in elements {
        let at = element.centre_m.map(millimetres);
        let normal = element.normal;
        writeln!(
            out,
            "{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            at.x,
            at.y,
            at.z,
            normal.x,
            normal.y,
            normal.z,
            millimetres(element.radius_m),
            element.amplitude,
            element.phase_rad
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(rows: &str) -> Result<Vec<Element>, Fault> {
        let text = format!("{}\n{rows}", NAMES.join(","));
        elements_of(&Table::new(Path::new("elements.csv"), text))
    }

    #[test]
    fn an_element_is_read_in_metres_with_a_normal_of_unit_length() {
        let elements = read("-80,10.5,6.6612,0,0,2,4.50,0.9,-0.1\n").expect("good");
        let expected = Element {
            centre_m: Vec3::new(-0.08, 0.0105, 0.0066612),
            normal: Vec3::z(),
            radius_m: 0.0045,
            amplitude: 0.9,
            phase_rad: -0.1,
        };
        assert_eq!(elements, [expected]);
    }

    #[test]
    fn bad_rows_are_placed() {
        let cases = [
            ("0,0,0,0,0,0,4.5,1,0\n", Some((2, 7)), "normal"),
            ("0,0,0,0,0,1,0,1,0\n", Some((2, 13)), "radius_mm"),
            ("0,0,0,0,0,1,4.5,-1,0\n", Some((2, 17)), "amplitude"),
            ("0,0,x,0,0,1,4.5,1,0\n", Some((2, 5)), "z_mm"),
            ("0,0,0,0,0,1,4.5,1\n", Some((2, 18)), "8 cells"),
            ("", None, "no element"),
        ];
        for (rows, place, said) in cases {
            let fault = read(rows).expect_err(rows);
            assert_eq!(fault.line_column(), place, "{fault}");
            assert!(fault.problem().contains(said), "{fault}");
        }
    }

    proptest! {
        #[test]
        fn elements_read_back_as_they_were_written(
            at_um in [-90_000i32..90_000, -90_000i32..90_000, 0i32..30_000],
            direction in [-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64],
            radius_um in 1u32..9000, amplitude in 0.0..2.0f64, phase_rad in -4.0..4.0f64,
        ) {
            let element = Element {
                centre_m: Vec3::from(at_um.map(|um| f64::from(um) / 1e3)) / 1e3,
                normal: Vec3::from(direction).normalize(),
                radius_m: f64::from(radius_um) / 1e3 / 1e3,
                amplitude,
                phase_rad,
            };
            let mut bytes = Vec::new();
            write_elements(&mut bytes, &[element]).expect("written to memory");
            let table = Table::from_bytes(Path::new("elements.csv"), bytes).expect("text");
            prop_assert_eq!(elements_of(&table).expect("good"), [element]);
        }
    }
}
