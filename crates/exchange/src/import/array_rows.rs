//! Points of named arrays: vectors of one length, the columns of a matrix, or a grid with its axes.

use fieldgap_input::Fault;

use super::request::{PointsRequest, Source, Units};
use super::rows::{Origin, Role, Rows};
use crate::arrays::{ArrayFile, Listed, MOST_POINTS, Numbers};

/// Arrays that an error lists.
const SHOWN: usize = 30;

/// An array as it was requested.
struct Taken {
    role: Role,
    listed: Listed,
    numbers: Numbers,
}

impl Taken {
    /// Lengths of the dimensions that have more than one value.
    fn lengths(&self) -> Vec<usize> {
        self.listed.shape.iter().copied().filter(|&length| length != 1).collect()
    }
}

/// The requested arrays of a file as rows, their units, and a description of the file.
pub(crate) fn rows_of_arrays(
    file: &ArrayFile,
    request: &PointsRequest,
) -> Result<(Rows, String, Units), Fault> {
    let Some(columns) = &request.columns else {
        return Err(Fault::of_file(
            &file.path,
            format!("has these arrays: {}", listed(file)),
            "say which are x, y, z and the reading, as --columns x,y,z,reading; columns of a matrix are data:1,data:2; a coordinate \
             that all points have in common is written as =100",
        ));
    };
    let mut taken = Vec::new();
    for (axis, source) in columns.place.iter().enumerate() {
        taken.push(match source {
            Source::Column(name) => take(file, Role::Place(axis), name)?,
            Source::Constant(value) => Taken {
                role: Role::Place(axis),
                listed: Listed { name: format!("={value}"), ..Listed::default() },
                numbers: Numbers { real: vec![*value], imaginary: None },
            },
        });
    }
    let mut wanted: Vec<(Role, &String)> = Vec::new();
    wanted.extend(columns.reading.first().map(|name| (Role::Reading, name)));
    wanted.extend(columns.reading.get(1).map(|name| (Role::Second, name)));
    wanted.extend(request.time.as_ref().map(|name| (Role::Time, name)));
    wanted.extend(request.drive.as_ref().map(|name| (Role::Drive, name)));
    if let Some([std, count]) = &request.spread {
        wanted.extend([(Role::Spread(0), std), (Role::Spread(1), count)]);
    }
    for (role, name) in wanted {
        taken.push(take(file, role, name)?);
    }
    let stated = |role: Role| {
        let array = taken.iter().find(|array| array.role == role);
        array.and_then(|array| array.listed.unit.clone())
    };
    let units_in_file: Vec<(Role, Option<String>)> =
        taken.iter().map(|array| (array.role, stated(array.role))).collect();
    let complex = columns.reading.len() == 2;
    let of_role = |role: Role| {
        let known = units_in_file.iter().find(|(known, _)| *known == role);
        known.and_then(|(_, unit)| unit.as_deref())
    };
    let units = super::units::units(&file.path, request, complex, &of_role)?;
    let variables = taken.iter().map(|array| (array.role, array.listed.name.clone())).collect();
    let origin = Origin::Arrays(file.path.clone(), variables);
    Ok((arranged(file, taken, request, origin)?, file.format.to_owned(), units))
}

/// The arrays of a file with their shapes: `x 41, p 3 x 41 x 41`.
fn listed(file: &ArrayFile) -> String {
    let shown: Vec<String> = file.listed.iter().take(SHOWN).map(described).collect();
    match (file.listed.len() - shown.len(), shown.is_empty()) {
        (_, true) => "none of numbers".to_owned(),
        (0, _) => shown.join(", "),
        (more, _) => format!("{} and {more} more", shown.join(", ")),
    }
}

fn described(array: &Listed) -> String {
    let lengths: Vec<String> = array.shape.iter().map(usize::to_string).collect();
    let shape = if lengths.is_empty() { "single value".to_owned() } else { lengths.join(" x ") };
    let names = match &array.dimensions {
        Some(names) if names.len() > 1 => format!(", {}", names.join(" x ")),
        _ => String::new(),
    };
    let unit = array.unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
    let complex = if array.complex { ", complex" } else { "" };
    format!("`{}` ({shape}{names}{unit}{complex})", array.name)
}

fn take(file: &ArrayFile, role: Role, name: &str) -> Result<Taken, Fault> {
    let position = |name: &str| {
        let exact = file.listed.iter().position(|array| array.name == name);
        exact.or_else(|| file.listed.iter().position(|array| array.name.eq_ignore_ascii_case(name)))
    };
    if let Some(index) = position(name) {
        let numbers = file.read(index)?;
        return Ok(Taken { role, listed: file.listed[index].clone(), numbers });
    }
    let of_matrix = match (name.rsplit_once(':'), &file.listed[..]) {
        (Some((matrix, number)), _) => position(matrix).zip(number.parse().ok()),
        // The only array of a file needs no name.
        (None, [_]) => name.parse().ok().map(|number| (0, number)),
        (None, _) => None,
    };
    let unknown = || {
        let problem = format!("has no array `{name}`; it has {}", listed(file));
        Fault::of_file(
            &file.path,
            problem,
            "name arrays as they are listed; columns of a matrix are data:1,data:2",
        )
    };
    let (index, number): (usize, usize) = of_matrix.ok_or_else(unknown)?;
    let matrix = &file.listed[index];
    let [rows, width] = matrix.shape[..] else { return Err(unknown()) };
    if !(1..=width).contains(&number) {
        let problem = format!(
            "`{}` has {rows} rows and {width} columns, but column {number} is requested",
            matrix.name
        );
        return Err(Fault::of_file(&file.path, problem, "columns are numbered from 1"));
    }
    let Numbers { real, imaginary } = file.read(index)?;
    let column = |values: Vec<f64>| values.into_iter().skip(number - 1).step_by(width).collect();
    let listed =
        Listed { name: name.to_owned(), shape: vec![rows], dimensions: None, ..matrix.clone() };
    Ok(Taken {
        role,
        listed,
        numbers: Numbers { real: column(real), imaginary: imaginary.map(column) },
    })
}

/// The arrays as rows: each array has a value for each reading, one value for all, or is an axis of the readings.
fn arranged(
    file: &ArrayFile,
    taken: Vec<Taken>,
    request: &PointsRequest,
    origin: Origin,
) -> Result<Rows, Fault> {
    let reading = |taken: &[Taken]| taken.iter().position(|array| array.role == Role::Reading);
    let Some(reading) = reading(&taken).map(|index| &taken[index]) else {
        return Err(Fault::of_file(
            &file.path,
            "has no reading",
            "name it, as --columns x,y,z,reading",
        ));
    };
    let lengths = reading.lengths();
    let count = reading.numbers.real.len();
    let is_axis = |array: &Taken| {
        matches!(array.role, Role::Place(_))
            && array.numbers.real.len() > 1
            && array.lengths() != lengths
    };
    let of_grid = taken.iter().any(is_axis);
    let axes =
        if of_grid { axes_of_dimensions(file, &taken, reading, request)? } else { Vec::new() };
    let mut rows = Rows {
        place: [Vec::new(), Vec::new(), Vec::new()],
        reading: Vec::new(),
        second: None,
        time: None,
        drive: None,
        spread: None,
        origin,
    };
    let mut spread = [None, None];
    for array in &taken {
        let values = &array.numbers.real;
        let spread_out: Vec<f64> = match array.role {
            Role::Place(axis) if of_grid && values.len() > 1 => {
                let dimension = axes.iter().position(|of| *of == axis).unwrap_or_default();
                let step: usize = lengths[dimension + 1..].iter().product();
                (0..count).map(|index| values[index / step % lengths[dimension]]).collect()
            }
            _ if values.len() == count => values.clone(),
            _ if values.len() == 1 => vec![values[0]; count],
            _ => return Err(mismatch(file, &taken)),
        };
        match array.role {
            Role::Place(axis) => rows.place[axis] = spread_out,
            Role::Reading => {
                rows.reading = spread_out;
                rows.second = rows.second.or_else(|| array.numbers.imaginary.clone());
            }
            Role::Second => rows.second = Some(spread_out),
            Role::Time => rows.time = Some(spread_out),
            Role::Drive => rows.drive = Some(spread_out),
            Role::Spread(index) => spread[index] = Some(spread_out),
        }
    }
    if let [Some(std), Some(count)] = spread {
        rows.spread = Some([std, count]);
    }
    if rows.len() > MOST_POINTS || rows.len() == 0 {
        let problem = format!("has {} readings; from 1 to {MOST_POINTS} are imported", rows.len());
        return Err(Fault::of_file(&file.path, problem, "check the choice of arrays"));
    }
    Ok(rows)
}

/// The axis (0 is x) of each dimension of the readings that has more than one value: by the request, by the names of the dimensions, or by
/// their lengths.
fn axes_of_dimensions(
    file: &ArrayFile,
    taken: &[Taken],
    reading: &Taken,
    request: &PointsRequest,
) -> Result<Vec<usize>, Fault> {
    let lengths = reading.lengths();
    let along: Vec<(usize, &Taken)> = taken
        .iter()
        .filter_map(|array| match array.role {
            Role::Place(axis) if array.numbers.real.len() > 1 => Some((axis, array)),
            _ => None,
        })
        .collect();
    let fits = |axes: &[usize]| {
        axes.len() == lengths.len()
            && axes.iter().zip(&lengths).all(|(axis, length)| {
                along.iter().any(|(known, array)| known == axis && array.lengths() == [*length])
            })
    };
    let wide = |index: &usize| reading.listed.shape[*index] != 1;
    if let Some(order) = &request.order {
        // The order may name the dimensions of one value too.
        let axes = match order.0.len() == reading.listed.shape.len() {
            true => (0..order.0.len()).filter(wide).map(|index| order.0[index]).collect(),
            false => order.0.clone(),
        };
        return if fits(&axes) { Ok(axes) } else { Err(mismatch(file, taken)) };
    }
    if let Some(names) = &reading.listed.dimensions {
        let axis_of = |name: &String| {
            let own = |array: &Taken| match &array.listed.dimensions {
                Some(own) => own.first() == Some(name) && own.len() == 1,
                None => array.listed.name == *name,
            };
            along.iter().find(|(_, array)| own(array)).map(|(axis, _)| *axis)
        };
        let axes: Option<Vec<usize>> =
            (0..names.len()).filter(wide).map(|index| axis_of(&names[index])).collect();
        if let Some(axes) = axes
            && fits(&axes)
        {
            return Ok(axes);
        }
    }
    let by_length: Option<Vec<usize>> = lengths
        .iter()
        .map(|length| {
            let mut same = along.iter().filter(|(_, array)| array.lengths() == [*length]);
            match (same.next(), same.next()) {
                (Some((axis, _)), None) => Some(*axis),
                _ => None,
            }
        })
        .collect();
    let sorted = |mut lengths: Vec<usize>| {
        lengths.sort_unstable();
        lengths
    };
    let of_axes = along.iter().map(|(_, array)| array.numbers.real.len()).collect();
    let same_lengths = sorted(of_axes) == sorted(lengths.clone());
    match by_length {
        Some(axes) if fits(&axes) => Ok(axes),
        _ if same_lengths => {
            let problem = format!(
                "has axes of equal length, so that the order of the dimensions of the readings is open: {}",
                taken_list(taken)
            );
            let remedy =
                "give the order of the dimensions as they are listed here, as --order z,y,x";
            Err(Fault::of_file(&file.path, problem, remedy))
        }
        _ => Err(mismatch(file, taken)),
    }
}

fn taken_list(taken: &[Taken]) -> String {
    taken.iter().map(|array| described(&array.listed)).collect::<Vec<_>>().join(", ")
}

fn mismatch(file: &ArrayFile, taken: &[Taken]) -> Fault {
    Fault::of_file(
        &file.path,
        format!("the arrays do not fit each other: {}", taken_list(taken)),
        "x, y, z and the reading have one shape; or x, y and z are the axes of the reading, one for each dimension; or a single value holds \
         for all points",
    )
}
