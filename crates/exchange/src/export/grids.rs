//! Maps of planes as arrays with the dimensions z, y and x.

use fieldgap_records::OFF_LINE_MM;

use crate::dataset::Dataset;

/// Values on the grid of one plane.
pub(super) struct Map {
    pub drive: usize,
    pub z_mm: f64,
    /// Columns, ascending.
    pub x_m: Vec<f64>,
    /// Rows, ascending.
    pub y_m: Vec<f64>,
    /// Values row by row.
    pub layers: Vec<Layer>,
    /// One value each for the whole plane.
    pub of_plane: Vec<Layer>,
}

/// Values with what they are.
pub(super) struct Layer {
    pub name: &'static str,
    pub unit: String,
    pub long_name: &'static str,
    pub values: Vec<f64>,
}

/// Positions of grids are equal within the tolerance of a map's own lines.
fn same_grid(a: &Map, b: &Map) -> bool {
    let alike = |a: &[f64], b: &[f64]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() * 1e3 <= OFF_LINE_MM)
    };
    a.drive == b.drive && alike(&a.x_m, &b.x_m) && alike(&a.y_m, &b.y_m)
}

/// Adds maps that have the same layers. Those of one drive on one grid become a stack of planes; each stack has dimensions of its own.
pub(super) fn add_maps(dataset: &mut Dataset, maps: Vec<Map>) {
    let mut stacks: Vec<Vec<Map>> = Vec::new();
    for map in maps {
        match stacks.iter_mut().find(|stack| same_grid(&stack[0], &map)) {
            Some(stack) => stack.push(map),
            None => stacks.push(vec![map]),
        }
    }
    for (number, stack) in stacks.iter().enumerate() {
        let prefix = if number == 0 { "grid".to_owned() } else { format!("grid{}", number + 1) };
        let name = |what: &str| format!("{prefix}_{what}");
        let first = &stack[0];
        let mm = |along_m: &[f64]| along_m.iter().map(|m| m * 1e3).collect::<Vec<f64>>();
        let mut axis = |what: &str, values: Vec<f64>, long_name: &str| {
            let index = dataset.dimension(&name(what), values.len());
            dataset.floats(&name(what), &[index], values, "mm", long_name);
            index
        };
        let z = axis("z", stack.iter().map(|map| map.z_mm).collect(), "height of the plane");
        let y = axis("y", mm(&first.y_m), "rows of the grid");
        let x = axis("x", mm(&first.x_m), "columns of the grid");
        let drive = vec![i32::try_from(first.drive).unwrap_or(i32::MAX)];
        dataset.integers(&name("drive"), &[], drive, "number of the drive of this grid");
        let mut add = |dimensions: &[usize], layers: for<'m> fn(&'m Map) -> &'m [Layer]| {
            for (number, layer) in layers(first).iter().enumerate() {
                let of_map = |map: &'_ Map| layers(map)[number].values.clone();
                let values = stack.iter().flat_map(of_map).collect();
                dataset.floats(&name(layer.name), dimensions, values, &layer.unit, layer.long_name);
            }
        };
        add(&[z, y, x], |map| &map.layers);
        add(&[z], |map| &map.of_plane);
    }
}
