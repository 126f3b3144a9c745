//! Maps on grids as rows: a table with the place and the values of each point of each grid, for programs without grids.

use crate::dataset::{Dataset, Values, Variable};

/// The dataset has no arrays on a grid of three axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no grid: the points of this record lie on none, or it has lines and single points alone"
)]
pub struct NoGrids;

/// A dataset with one row for each point of each grid: `grid` (from 1), `drive` where the grid states it, `z`, `y`, `x` in the unit of the axes, and the
/// values, those of a height for each of its points, NaN where a grid lacks one. Attributes are kept.
///
/// # Errors
/// [`NoGrids`].
pub fn grid_rows(dataset: &Dataset) -> Result<Dataset, NoGrids> {
    let grids = grids(dataset);
    if grids.is_empty() {
        return Err(NoGrids);
    }
    let points =
        |grid: &Grid<'_>| grid.axes.iter().map(|axis| axis.values.len()).product::<usize>();
    let mut rows = Dataset { attributes: dataset.attributes.clone(), ..Dataset::default() };
    let point = rows.dimension("point", grids.iter().map(points).sum());
    let of_grids = |value: &dyn Fn(usize, &Grid<'_>) -> i32| -> Vec<i32> {
        let each = grids.iter().enumerate();
        each.flat_map(|(n, grid)| vec![value(n, grid); points(grid)]).collect()
    };
    let number = of_grids(&|n, _| i32::try_from(n + 1).unwrap_or(i32::MAX));
    rows.integers("grid", &[point], number, "number of the grid");
    if grids.iter().any(|grid| grid.drive.is_some()) {
        let drive = of_grids(&|_, grid| grid.drive.unwrap_or(-1));
        rows.integers("drive", &[point], drive, "number of the drive of the grid");
    }
    for (axis, name) in ["z", "y", "x"].into_iter().enumerate() {
        let values = grids.iter().flat_map(|grid| grid.places(axis)).collect();
        let first = grids[0].axes[axis];
        let unit = first.unit.as_deref().unwrap_or_default();
        rows.floats(name, &[point], values, unit, &first.long_name);
    }
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in grids.iter().flat_map(|grid| &grid.layers) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    let mut of_heights: Vec<(&str, &Variable)> = Vec::new();
    for (name, variable) in grids.iter().flat_map(|grid| &grid.of_heights) {
        if !of_heights.iter().any(|(other, _)| other == name) {
            of_heights.push((name, variable));
        }
    }
    for name in names {
        let of_grid = |grid: &Grid<'_>| match grid.layer(name) {
            Some(variable) => floats(&variable.values),
            None => vec![f64::NAN; points(grid)],
        };
        let values = grids.iter().flat_map(of_grid).collect();
        let Some(first) = grids.iter().find_map(|grid| grid.layer(name)) else { continue };
        let unit = first.unit.as_deref().unwrap_or_default();
        rows.floats(name, &[point], values, unit, &first.long_name);
    }
    for (name, first) in of_heights {
        let of_grid = |grid: &Grid<'_>| {
            let of_heights = grid.of_heights.iter().find(|(other, _)| *other == name);
            let in_plane = points(grid) / grid.axes[0].values.len().max(1);
            match of_heights {
                Some((_, variable)) => floats(&variable.values)
                    .into_iter()
                    .flat_map(|value| std::iter::repeat_n(value, in_plane))
                    .collect(),
                None => vec![f64::NAN; points(grid)],
            }
        };
        let values = grids.iter().flat_map(of_grid).collect();
        let unit = first.unit.as_deref().unwrap_or_default();
        rows.floats(name, &[point], values, unit, &first.long_name);
    }
    Ok(rows)
}

/// Arrays on the same three axes.
struct Grid<'d> {
    dimensions: Vec<usize>,
    /// The positions along z, y and x.
    axes: Vec<&'d Variable>,
    drive: Option<i32>,
    /// Names without that of the grid, and arrays.
    layers: Vec<(&'d str, &'d Variable)>,
    /// The same of what has one value for each height.
    of_heights: Vec<(&'d str, &'d Variable)>,
}

impl<'d> Grid<'d> {
    fn layer(&self, wanted: &str) -> Option<&'d Variable> {
        self.layers.iter().find(|(name, _)| *name == wanted).map(|(_, variable)| *variable)
    }

    /// The position along one axis for each point, the last axis varying fastest.
    fn places(&self, axis: usize) -> Vec<f64> {
        let lengths: Vec<usize> = self.axes.iter().map(|axis| axis.values.len()).collect();
        let inner: usize = lengths[axis + 1..].iter().product();
        let outer: usize = lengths[..axis].iter().product();
        let along = floats(&self.axes[axis].values);
        let once: Vec<f64> =
            along.into_iter().flat_map(|place| std::iter::repeat_n(place, inner)).collect();
        once.repeat(outer)
    }
}

fn grids(dataset: &Dataset) -> Vec<Grid<'_>> {
    let named = |name: &str| dataset.variables.iter().find(|variable| variable.name == name);
    let mut grids: Vec<Grid<'_>> = Vec::new();
    for variable in dataset.variables.iter().filter(|variable| variable.dimensions.len() == 3) {
        let axes: Option<Vec<&Variable>> =
            dataset.dimension_names(variable).into_iter().map(named).collect();
        let Some(axes) = axes else { continue };
        // `grid2_` of `grid2_z`; nothing of `z`.
        let prefix = axes[0].name.strip_suffix('z').unwrap_or_default();
        let layer = (variable.name.strip_prefix(prefix).unwrap_or(&variable.name), variable);
        match grids.iter_mut().find(|grid| grid.dimensions == variable.dimensions) {
            Some(grid) => grid.layers.push(layer),
            None => {
                let drive =
                    named(&format!("{prefix}drive")).filter(|drive| drive.dimensions.is_empty());
                let drive = drive.and_then(|drive| match &drive.values {
                    Values::Integer(values) => values.first().copied(),
                    _ => None,
                });
                let dimensions = variable.dimensions.clone();
                let heights = dataset.variables.iter().filter(|other| {
                    other.dimensions == dimensions[..1] && other.name != axes[0].name
                });
                let of_heights = heights
                    .filter_map(|other| Some((other.name.strip_prefix(prefix)?, other)))
                    .collect();
                grids.push(Grid { dimensions, axes, drive, layers: vec![layer], of_heights });
            }
        }
    }
    grids
}

fn floats(values: &Values) -> Vec<f64> {
    match values {
        Values::Float(values) => values.clone(),
        Values::Single(values) => values.iter().copied().map(f64::from).collect(),
        Values::Integer(values) => values.iter().copied().map(f64::from).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_of_each_grid_is_a_row() {
        let mut dataset = Dataset::default();
        for (prefix, z, readings) in [
            ("grid", vec![50.0], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            ("grid2", vec![90.0, 95.0], vec![7.0; 12]),
        ] {
            let mut axis = |what: &str, values: Vec<f64>| {
                let name = format!("{prefix}_{what}");
                let index = dataset.dimension(&name, values.len());
                dataset.floats(&name, &[index], values, "mm", what);
                index
            };
            let axes = [axis("z", z), axis("y", vec![-1.0, 1.0]), axis("x", vec![0.0, 2.0, 4.0])];
            dataset.integers(&format!("{prefix}_drive"), &[], vec![3], "drive");
            dataset.floats(&format!("{prefix}_reading"), &axes, readings, "V", "reading");
        }
        let rows = grid_rows(&dataset).expect("two grids");
        let column = |name: &str| {
            let variable = rows.variables.iter().find(|variable| variable.name == name);
            floats(&variable.expect(name).values)
        };
        assert_eq!(rows.dimensions, [("point".to_owned(), 18)]);
        assert_eq!(column("grid")[5..7], [1.0, 2.0]);
        assert_eq!(column("drive"), [3.0; 18]);
        assert_eq!(column("z")[5..13], [50.0, 90.0, 90.0, 90.0, 90.0, 90.0, 90.0, 95.0]);
        assert_eq!(column("y")[..6], [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]);
        assert_eq!(column("x")[..6], [0.0, 2.0, 4.0, 0.0, 2.0, 4.0]);
        assert_eq!(column("reading")[4..7], [5.0, 6.0, 7.0]);
    }

    #[test]
    fn a_dataset_without_grids_is_refused() {
        assert_eq!(grid_rows(&Dataset::default()), Err(NoGrids));
    }
}
