//! What the readings cannot tell apart.
//!
//! Every parameter is moved by as much as a usual slip in setting up would move it. The changes of the simulated map
//! that follow, the gain's part taken out, span a small matrix (the Fisher information in these units); its
//! eigenvectors are combinations of slips, its eigenvalues the squared change of the map that each makes. A
//! combination that changes the map by less than what the simulation leaves unexplained anyway cannot be told from
//! none: it is named, with numbers, and not decided. The array's own pitch is moved along with the pose: nobody
//! estimates it here, but a pitch that is off would be taken for a step and a height.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::agreement::rms;
use super::readings::Readings;
use super::refine::{Fit, PoseParameter, derivatives, matrix, project_out, residual};
use super::registration::UndeterminedCombination;
use super::standard_errors::Blocks;

/// Name of the hypothetical parameter: how far the array's elements stand apart, relative.
const ARRAY_PITCH: &str = "array_pitch";

/// A usual slip of the array's pitch and of the scan's step, relative.
const USUAL_STRETCH: f64 = 0.02;

/// What the standard errors allow the array's pitch to be off by, relative.
const PITCH_TOLERANCE: f64 = 0.01;

/// A parameter takes part in a combination from this share of its largest member on.
const TAKES_PART: f64 = 0.3;

/// A combination counts as told by the readings if it changes the map by this share of the residual at least.
const TOLD_BY: f64 = 0.25;

/// What the readings say about each parameter of a fit, and what they leave open.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Standard error of the gain, in its own unit.
    pub gain_error: f64,
    /// Standard error of each free parameter, in the order given, in its own unit. Where the step is free, it counts in
    /// that the array's pitch may be off by a percent.
    pub errors: Vec<f64>,
    /// Combinations that the readings leave open.
    pub undetermined: Vec<UndeterminedCombination>,
}

/// The size of a usual slip in a parameter, in its own unit.
fn usual_slip(parameter: PoseParameter) -> f64 {
    match parameter {
        PoseParameter::ShiftX | PoseParameter::ShiftY => 2e-3,
        PoseParameter::ShiftZ => 5e-3,
        PoseParameter::Turn => 0.035,
        PoseParameter::Step => USUAL_STRETCH,
    }
}

/// A slip in words.
fn in_words(name: &str, slip: f64) -> String {
    match name {
        "shift_x" | "shift_y" => format!("{name} by {:+.1} mm", slip * 1e3),
        "shift_z" => format!("height by {:+.1} mm", slip * 1e3),
        "turn" => format!("turn by {:+.1} degrees", slip.to_degrees()),
        "step_ratio" => format!("step by {:+.1} %", slip * 1e2),
        _ => format!("array pitch by {:+.1} %", slip * 1e2),
    }
}

/// Judges the parameters that were free in a fit.
pub fn identifiability(readings: &Readings, fit: &Fit, free: &[PoseParameter]) -> Identifiability {
    let values = readings.values();
    let gradient = readings.simulate_gradient(&fit.pose);
    let mut columns = derivatives(readings, &fit.pose, &gradient, free);
    let mut names: Vec<&str> = free.iter().map(|parameter| parameter.name()).collect();
    let mut slips: Vec<f64> = free.iter().map(|parameter| usual_slip(*parameter)).collect();
    let residual = residual(&fit.simulated, &values, fit.gain);

    // Standard errors, the gain being one of the coefficients.
    let mut of_readings: Vec<Vec<f64>> = vec![fit.simulated.clone()];
    of_readings.extend(columns.iter().map(|c| c.iter().map(|d| d * fit.gain).collect()));
    let covariance = Blocks::of(readings).covariance(&matrix(&of_readings), &residual);
    let mut variances: Vec<f64> = (0..covariance.nrows()).map(|i| covariance[(i, i)]).collect();

    if free.contains(&PoseParameter::Step) {
        let pitch = readings.simulate_pitch(&fit.pose);
        let of_pitch: Vec<f64> = pitch.iter().map(|d| d * fit.gain).collect();
        if let Some(followed) = pitch_variances(&of_readings, &of_pitch) {
            variances.iter_mut().zip(followed).for_each(|(variance, more)| *variance += more);
        }
        columns.push(pitch);
        names.push(ARRAY_PITCH);
        slips.push(USUAL_STRETCH);
    }
    let gain_error = variances.remove(0).sqrt();
    let errors = variances.into_iter().map(f64::sqrt).collect();

    let per_scan = fit.gain / (rms(values.iter().copied()) * (values.len() as f64).sqrt());
    for (column, slip) in columns.iter_mut().zip(&slips) {
        project_out(&fit.simulated, column);
        column.iter_mut().for_each(|entry| *entry *= slip * per_scan);
    }
    let undetermined = if columns.is_empty() {
        Vec::new()
    } else {
        hidden_combinations(&names, &slips, &columns, fit.residual_ratio)
    };
    Identifiability { gain_error, errors, undetermined }
}

/// The combinations of columns (change of the map, over its rms, by a usual slip) that change it too little.
fn hidden_combinations(
    names: &[&str],
    slips: &[f64],
    columns: &[Vec<f64>],
    residual_ratio: f64,
) -> Vec<UndeterminedCombination> {
    let columns = matrix(columns);
    let information: DMatrix<f64> = columns.transpose() * &columns;
    let eigen = SymmetricEigen::new(information);
    let mut hidden: Vec<(f64, Vec<f64>)> = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .map(|(value, vector)| (value.max(0.0).sqrt(), vector.iter().copied().collect()))
        .filter(|(change, _)| *change < TOLD_BY * residual_ratio)
        .collect();
    hidden.sort_by(|a, b| a.0.total_cmp(&b.0));
    hidden
        .into_iter()
        .map(|(change, vector)| {
            let largest = vector.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            let members: Vec<usize> =
                (0..names.len()).filter(|&i| vector[i].abs() >= TAKES_PART * largest.abs()).collect();
            let slip = |i: usize| in_words(names[i], vector[i] * slips[i] * largest.signum());
            let moved = members.iter().map(|&i| slip(i)).collect::<Vec<_>>().join(", ");
            let together = if members.len() > 1 { " together" } else { "" };
            UndeterminedCombination {
                parameters: members.iter().map(|&i| names[i].to_owned()).collect(),
                explanation: format!(
                    "moving {moved}{together} changes the simulated map by {:.1} % of its rms, while the \
                     simulation leaves {:.1} % unexplained: these readings cannot tell {}",
                    100.0 * change,
                    100.0 * residual_ratio,
                    if members.len() > 1 { "these apart" } else { "it" },
                ),
            }
        })
        .collect()
}

/// How far each free coefficient follows when the pitch is off by its tolerance, as variances.
fn pitch_variances(columns: &[Vec<f64>], pitch: &[f64]) -> Option<Vec<f64>> {
    let columns = matrix(columns);
    let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
    let unit =
        DMatrix::from_fn(columns.nrows(), columns.ncols(), |i, j| columns[(i, j)] / lengths[j]);
    let follows = (unit.transpose() * &unit)
        .cholesky()?
        .solve(&(unit.transpose() * DVector::from_row_slice(pitch)));
    Some((0..lengths.len()).map(|j| (follows[j] / lengths[j] * PITCH_TOLERANCE).powi(2)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parameters with one and the same effect, and a third with its own.
    #[test]
    fn twins_are_named_and_the_loner_is_not() {
        let wave = |f: f64| (0..100).map(|i| 0.01 * (f * i as f64).sin()).collect::<Vec<f64>>();
        let columns = [wave(0.1), wave(0.1), wave(0.37)];
        let names = ["shift_z", "step_ratio", "turn"];
        let hidden = hidden_combinations(&names, &[5e-3, 0.02, 0.035], &columns, 0.1);
        assert_eq!(hidden.len(), 1);
        assert_eq!(hidden[0].parameters, ["shift_z", "step_ratio"]);
        assert!(hidden[0].explanation.contains("these apart"), "{}", hidden[0].explanation);
    }

    #[test]
    fn what_changes_nothing_is_named_alone() {
        let columns = [vec![0.0; 10], vec![0.1; 10]];
        let hidden = hidden_combinations(&["turn", "shift_x"], &[0.035, 2e-3], &columns, 0.1);
        assert_eq!(hidden.len(), 1);
        assert_eq!(hidden[0].parameters, ["turn"]);
    }

    #[test]
    fn a_coefficient_that_mimics_the_pitch_carries_its_tolerance() {
        let pitch: Vec<f64> = (0..50).map(f64::from).collect();
        let half: Vec<f64> = pitch.iter().map(|p| 0.5 * p).collect();
        let variances = pitch_variances(&[half], &pitch).expect("one column");
        assert!((variances[0].sqrt() - 2.0 * PITCH_TOLERANCE).abs() < 1e-12);
    }
}
