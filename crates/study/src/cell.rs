//! One combination of a study's values by itself, so that a study can be divided among processes.

use serde::{Deserialize, Serialize};

use super::point::Point;
use super::run::{observe, row, values_at};
use super::{Limits, Observation, Row, Study};
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_input::Fault;
use rayon::prelude::*;

/// What one combination of values gave, as data: a [`Row`] without its map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// The simulator.
    pub simulator: Simulator,
    /// Elements of the array.
    pub elements: usize,
    /// The focus, metres, if any.
    pub focus_m: Option<[f64; 3]>,
    /// Height at which the field was observed, millimetres.
    pub z_mm: f64,
    /// The limits from theory.
    pub limits: Limits,
    /// The figures: once, or for each random array, with its seed; at least one.
    pub draws: Vec<(Option<u32>, Observation)>,
}

/// Runs the combination of this number; the values of the last sweep change fastest.
///
/// The sums are not shared with other combinations. [`run`](super::run()) shares those of growing arrays, so that its figures differ in the
/// last digits (by less than 1e-12 of the peak).
///
/// # Errors
/// A [`Fault`] if the combination is not a valid set-up.
pub fn run_cell(study: &Study, number: usize) -> Result<Cell, Fault> {
    let values = combination(study, number);
    let point = Point::read(study, &values_at(study, &values))?;
    let (draws, _) = observe(std::slice::from_ref(&point), false).swap_remove(0);
    let Row { simulator, elements, focus_m, z_mm, limits, draws, .. } =
        row(values, &point, draws, None);
    let focus_m = focus_m.map(Into::into);
    Ok(Cell { simulator, elements, focus_m, z_mm, limits, draws })
}

impl Cell {
    /// The row of the combination of this number; `None` without a draw.
    pub fn into_row(self, study: &Study, number: usize) -> Option<Row> {
        let Self { simulator, elements, focus_m, z_mm, limits, draws } = self;
        let focus_m = focus_m.map(Vec3::from);
        let values = combination(study, number);
        let row = Row { values, simulator, elements, focus_m, z_mm, limits, draws, map: None };
        (!row.draws.is_empty()).then_some(row)
    }
}

impl Study {
    /// Checks that every combination of values is a valid set-up.
    ///
    /// # Errors
    /// A [`Fault`] at the first that is not.
    pub fn check(&self) -> Result<(), Fault> {
        let fault = |number| Point::read(self, &values_at(self, &combination(self, number))).err();
        let first = (0..self.points()).into_par_iter().find_map_first(fault);
        first.map_or(Ok(()), Err)
    }
}

/// The values of the combination of this number.
fn combination(study: &Study, number: usize) -> Vec<usize> {
    let mut rest = number;
    let mut values: Vec<usize> = study
        .sweeps
        .iter()
        .rev()
        .map(|sweep| {
            let value = rest % sweep.values.len();
            rest /= sweep.values.len();
            value
        })
        .collect();
    values.reverse();
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run;
    use fieldgap_input::TomlSource;
    use std::path::Path;

    #[test]
    fn cells_of_the_files_of_a_study_are_its_rows() {
        let text = "name = \"s\"\n[array]\nfrequency_hz = 40000.0\nlayout = \"random\"\ncount = 5\nseed = 3\n\
                    element_diameter_mm = 10.0\nspacing_mm = 0.0\n[medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\n\
                    model = \"piston\"\n[focus]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 80.0\n[map]\nstep_mm = 5.0\n\
                    [[sweep]]\nparameter = \"focus.z_mm\"\nvalues = [60.0, 80.0]\n[[sweep]]\nparameter = \"map.size_mm\"\nvalues = [40.0, 60.0, 80.0]\n";
        let study = Study::read(TomlSource::new(Path::new("s.toml"), text)).expect("good");
        let study = study
            .with("draws", "3")
            .and_then(|study| study.with("medium.speed_of_sound_m_s", "345.0"))
            .expect("good");
        let again = Study::of_files(&study.files()).expect("the same");
        assert_eq!(again.points(), 6);
        again.check().expect("every value is good");
        for (number, row) in run(&study, false).expect("good").rows.into_iter().enumerate() {
            let cell = run_cell(&again, number).expect("good");
            assert_eq!(cell.draws.len(), 3);
            let own = cell.into_row(&again, number).expect("draws");
            assert_eq!(format!("{own:?}"), format!("{row:?}"));
        }
    }
}
