//! Which cell of a campaign goes where in the table of cells.

use std::collections::{BTreeMap, BTreeSet};

use fieldgap_campaign::{CellOverview, Dimension, Overview};

/// The most values of an only dimension that stand beside each other; more stand below each other, because a screen is taller than wide for
/// cells of this size.
const MOST_BESIDE: usize = 12;

/// The cells in rows and columns. With several rounds, a row for each setting and a column for each round and repeat; in a single round, the
/// last dimension makes the columns.
pub(super) struct Matrix<'a> {
    /// What a row is.
    pub row_names: String,
    /// What a column is.
    pub column_names: String,
    /// The names of the rows.
    pub rows: Vec<String>,
    /// The names of the columns.
    pub columns: Vec<String>,
    /// Row by row.
    cells: Vec<Option<&'a CellOverview>>,
}

/// How rows and columns are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// Settings by rounds.
    Rounds,
    /// The other dimensions by the last.
    LastDimension,
    /// All dimensions below each other.
    Below,
}

/// A row: the places of values; the name of the setting where these do not belong to the dimensions.
type RowKey<'a> = (Vec<usize>, Option<&'a str>);

/// A column: round or place of the last value, and repeat.
type ColumnKey = (usize, u32);

impl<'a> Matrix<'a> {
    pub fn of(overview: &'a Overview) -> Self {
        let dimensions = &overview.dimensions;
        let layout = match dimensions.as_slice() {
            _ if overview.cells.iter().any(|cell| cell.round > 1) => Layout::Rounds,
            [] => Layout::Below,
            [only] if only.values.len() > MOST_BESIDE => Layout::Below,
            _ => Layout::LastDimension,
        };
        let keys: Vec<(RowKey<'a>, ColumnKey)> =
            overview.cells.iter().map(|cell| keys(layout, cell, dimensions.len())).collect();
        let rows = numbered(keys.iter().map(|(row, _)| row.clone()));
        let columns = numbered(keys.iter().map(|(_, column)| *column));
        let mut cells = vec![None; rows.len() * columns.len()];
        for (cell, (row, column)) in overview.cells.iter().zip(&keys) {
            cells[rows[row] * columns.len() + columns[column]] = Some(cell);
        }
        let repeats = overview.cells.iter().any(|cell| cell.repeat > 1);
        let of_rows = if layout == Layout::LastDimension {
            &dimensions[..dimensions.len() - 1]
        } else {
            dimensions
        };
        Self {
            row_names: match of_rows {
                [] => "cells".to_owned(),
                some => some.iter().map(|one| one.name.as_str()).collect::<Vec<_>>().join(" · "),
            },
            column_names: match layout {
                Layout::Rounds => "round".to_owned(),
                Layout::LastDimension => {
                    dimensions.last().map_or(String::new(), |last| last.name.clone())
                }
                Layout::Below => "repeat".to_owned(),
            },
            rows: rows.keys().map(|row| row_name(row, of_rows)).collect(),
            columns: columns
                .keys()
                .map(|column| column_name(layout, *column, repeats, overview))
                .collect(),
            cells,
        }
    }

    /// Each row: its name and its cells, one for each column.
    pub fn each_row(&self) -> impl Iterator<Item = (&str, &[Option<&'a CellOverview>])> {
        let width = self.columns.len().max(1);
        self.rows.iter().map(String::as_str).zip(self.cells.chunks(width))
    }
}

fn keys(layout: Layout, cell: &CellOverview, dimensions: usize) -> (RowKey<'_>, ColumnKey) {
    let known = cell.values.len() == dimensions;
    let setting = (!known).then_some(cell.setting.as_str());
    let values = if known { cell.values.clone() } else { Vec::new() };
    match (layout, values.split_last()) {
        (Layout::Rounds, _) => ((values, setting), (cell.round as usize, cell.repeat)),
        (Layout::LastDimension, Some((last, before))) => {
            ((before.to_vec(), setting), (*last, cell.repeat))
        }
        (Layout::LastDimension | Layout::Below, _) => ((values, setting), (0, cell.repeat)),
    }
}

/// Each key once, in order, with its number.
fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> BTreeMap<K, usize> {
    let each: BTreeSet<K> = keys.collect();
    each.into_iter().enumerate().map(|(number, key)| (key, number)).collect()
}

fn row_name((values, setting): &RowKey<'_>, dimensions: &[Dimension]) -> String {
    if let Some(setting) = setting {
        return (*setting).to_owned();
    }
    if values.is_empty() {
        return "all".to_owned();
    }
    let labels = values.iter().zip(dimensions).map(|(value, dimension)| label(dimension, *value));
    labels.collect::<Vec<_>>().join(" · ")
}

fn column_name(
    layout: Layout,
    (place, repeat): ColumnKey,
    repeats: bool,
    overview: &Overview,
) -> String {
    let name = match layout {
        Layout::Rounds => {
            let begun = overview.rounds_begun.get(place.saturating_sub(1));
            // Rounds of one day are told apart by the hour.
            let day = |at: &jiff::Timestamp| at.strftime("%Y-%m-%d").to_string();
            let days = &overview.rounds_begun;
            let one_day = days.len() > 1 && days.iter().all(|at| day(at) == day(&days[0]));
            let form = if one_day { " (%H:%M)" } else { " (%m-%d)" };
            let day = begun.map_or(String::new(), |at| at.strftime(form).to_string());
            format!("{place}{day}")
        }
        Layout::LastDimension => {
            overview.dimensions.last().map_or_else(|| place.to_string(), |last| label(last, place))
        }
        Layout::Below => return repeat.to_string(),
    };
    if repeats { format!("{name} #{repeat}") } else { name }
}

fn label(dimension: &Dimension, value: usize) -> String {
    dimension.values.get(value).cloned().unwrap_or_else(|| format!("value {}", value + 1))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::example::{cell, overview};
    use super::*;

    fn dimensions(sizes: &[usize]) -> Vec<Dimension> {
        let names = ["focus", "temperature", "screen"];
        sizes
            .iter()
            .zip(names)
            .map(|(size, name)| Dimension {
                name: name.to_owned(),
                values: (0..*size).map(|value| format!("{name}{value}")).collect(),
            })
            .collect()
    }

    /// All combinations of values, in all rounds and repeats.
    fn all_cells(sizes: &[usize], rounds: u32, repeats: u32) -> Overview {
        let mut all = overview();
        all.dimensions = dimensions(sizes);
        all.cells.clear();
        let combinations: usize = sizes.iter().product();
        for round in 1..=rounds {
            for number in 0..combinations {
                let mut rest = number;
                let mut values: Vec<usize> = sizes
                    .iter()
                    .rev()
                    .map(|size| {
                        let value = rest % size;
                        rest /= size;
                        value
                    })
                    .collect();
                values.reverse();
                for repeat in 1..=repeats {
                    let mut one = cell(round, &format!("s{number}"));
                    one.id = format!("r{round} s{number} #{repeat}");
                    (one.values, one.repeat) = (values.clone(), repeat);
                    all.cells.push(one);
                }
            }
        }
        all
    }

    #[test]
    fn rounds_make_columns_where_there_are_several() {
        let all = all_cells(&[2, 2], 3, 1);
        let matrix = Matrix::of(&all);
        assert_eq!((matrix.rows.len(), matrix.columns.len()), (4, 3));
        assert_eq!(matrix.rows[1], "focus0 · temperature1");
        assert_eq!(
            (matrix.row_names.as_str(), matrix.column_names.as_str()),
            ("focus · temperature", "round")
        );
    }

    #[test]
    fn the_last_dimension_makes_columns_in_a_single_round() {
        let all = all_cells(&[2, 3], 1, 2);
        let matrix = Matrix::of(&all);
        assert_eq!(matrix.rows, ["focus0", "focus1"]);
        assert_eq!(matrix.columns[..3], ["temperature0 #1", "temperature0 #2", "temperature1 #1"]);
        let place = matrix.each_row().nth(1).expect("two rows").1[3].expect("a cell");
        assert_eq!((place.values.as_slice(), place.repeat), ([1, 1].as_slice(), 2));
    }

    #[test]
    fn without_dimensions_or_cells_there_is_still_a_table() {
        let alone = all_cells(&[], 1, 1);
        let matrix = Matrix::of(&alone);
        assert_eq!(
            (matrix.rows.as_slice(), matrix.columns.as_slice()),
            (["all".to_owned()].as_slice(), ["1".to_owned()].as_slice())
        );
        let mut empty = alone.clone();
        empty.cells.clear();
        assert_eq!(Matrix::of(&empty).each_row().count(), 0);
    }

    #[test]
    fn many_values_of_an_only_dimension_stand_below_each_other() {
        let all = all_cells(&[40], 1, 1);
        assert_eq!((Matrix::of(&all).rows.len(), Matrix::of(&all).columns.len()), (40, 1));
    }

    proptest! {
        #[test]
        fn every_cell_has_one_place(sizes in prop::collection::vec(1..5usize, 0..4), rounds in 1..4u32, repeats in 1..3u32) {
            let all = all_cells(&sizes, rounds, repeats);
            let matrix = Matrix::of(&all);
            let mut shown: Vec<&str> =
                matrix.each_row().flat_map(|(_, cells)| cells.iter().flatten().map(|cell| cell.id.as_str())).collect();
            shown.sort_unstable();
            let mut expected: Vec<&str> = all.cells.iter().map(|cell| cell.id.as_str()).collect();
            expected.sort_unstable();
            prop_assert_eq!(shown, expected);
            // Each combination was made, so that no place is empty.
            prop_assert!(matrix.each_row().all(|(_, cells)| cells.iter().all(Option::is_some)));
        }

        #[test]
        fn values_that_belong_to_no_dimension_are_no_trouble(values in prop::collection::vec(0..9usize, 0..5), round in 0..3u32) {
            let mut all = all_cells(&[2, 2], 1, 1);
            let mut odd = cell(round, "odd");
            odd.values = values;
            all.cells = vec![odd];
            prop_assert_eq!(Matrix::of(&all).each_row().flat_map(|(_, cells)| cells.iter().flatten()).count(), 1);
        }
    }
}
