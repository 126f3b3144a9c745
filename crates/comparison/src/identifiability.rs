//! Parameters that the readings do not determine.
//!
//! Each parameter is changed by a typical error of the set-up. The resulting changes of the simulated map, without the part of the gain,
//! give a small matrix, the Fisher information in these units. Its eigenvectors are combinations of errors; its eigenvalues are the
//! squared changes of the map. A combination that changes the map by less than the residual cannot be detected: it is reported with
//! numbers and not decided. The pitch of the array is included, although it is not estimated here: an error of the pitch looks like an
//! error of step and height.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::agreement::rms;
use super::phase_fit::{PhaseResiduals, Scatter};
use super::readings::{Readings, Slope};
use super::refine::{Fit, PoseParameter, derivatives, matrix, project_out, residual};
use super::registration::UndeterminedCombination;
use super::standard_errors::Blocks;

/// Name of the hypothetical parameter: how far the array's elements stand apart, relative.
const ARRAY_PITCH: &str = "array_pitch";

/// Typical relative error of the array's pitch and of the scan's step.
const TYPICAL_STRETCH: f64 = 0.02;

/// Relative error of the array's pitch that the standard errors include.
const PITCH_TOLERANCE: f64 = 0.01;

/// A parameter belongs to a combination from this share of its largest member.
const MEMBER: f64 = 0.3;

/// The readings determine a combination if it changes the map by at least this share of the residual.
const DETECTABLE: f64 = 0.25;

/// The standard errors of a fit's parameters, and the combinations that the readings do not determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Standard error of the gain, in its own unit.
    pub gain_error: f64,
    /// Standard error of each free parameter, in the order given, in its own unit. If the step is free, they include an error of the
    /// array's pitch of one percent.
    pub errors: Vec<f64>,
    /// Combinations that the readings do not determine.
    pub undetermined: Vec<UndeterminedCombination>,
}

/// A typical error of a parameter, in its own unit.
fn typical_error(parameter: PoseParameter) -> f64 {
    match parameter {
        PoseParameter::ShiftX | PoseParameter::ShiftY => 2e-3,
        PoseParameter::ShiftZ => 5e-3,
        PoseParameter::Turn => 0.035,
        PoseParameter::Step => TYPICAL_STRETCH,
    }
}

/// A change of a parameter in words.
fn in_words(name: &str, change: f64) -> String {
    match name {
        "shift_x" | "shift_y" => format!("{name} by {:+.1} mm", change * 1e3),
        "shift_z" => format!("height by {:+.1} mm", change * 1e3),
        "turn" => format!("turn by {:+.1} degrees", change.to_degrees()),
        "step_ratio" => format!("step by {:+.1} %", change * 1e2),
        _ => format!("array pitch by {:+.1} %", change * 1e2),
    }
}

/// How well the readings determine the free parameters of a fit.
pub fn identifiability(readings: &Readings, fit: &Fit, free: &[PoseParameter]) -> Identifiability {
    let values = readings.values();
    let gradient = readings.simulate_gradient(&fit.pose);
    let mut slopes = derivatives(readings, &fit.pose, &gradient, free);
    let mut names: Vec<&str> = free.iter().map(|parameter| parameter.name()).collect();
    let mut typical: Vec<f64> = free.iter().map(|parameter| typical_error(*parameter)).collect();
    let sigma = fit.sigma(&values);
    let phases = fit.phases.as_ref().and_then(|phases| {
        let scatter = Scatter { sigma, noise_rad: phases.noise_rad, factor: 1.0 };
        PhaseResiduals::of(readings, &gradient.at, scatter)
    });
    let priors = phases.as_ref().map_or(0, |phases| phases.scaled.len() - values.len());

    // Rows of the readings in their unit, then of the phases and the reference's drift in that of the same residual.
    let of_phases = |slope: &Slope| -> Vec<f64> {
        let rows = phases.iter().flat_map(|phases| phases.derivatives(&slope.phases));
        rows.map(|row| -row * sigma).collect()
    };
    let of_slope = |slope: &Slope| -> Vec<f64> {
        slope.magnitudes.iter().map(|d| d * fit.gain).chain(of_phases(slope)).collect()
    };
    let of_phase_residuals = phases.iter().flat_map(|phases| {
        let of_reference = std::iter::repeat_n(sigma, priors);
        phases.scaled[..values.len()].iter().map(|r| r * sigma).chain(of_reference)
    });
    let residual: Vec<f64> =
        residual(&fit.simulated, &values, fit.gain).into_iter().chain(of_phase_residuals).collect();
    let mut blocks = Blocks::of(readings);
    if phases.is_some() {
        blocks = blocks.and_of_phases(priors);
    }

    // Standard errors, the gain being one of the coefficients.
    let mut of_gain = fit.simulated.clone();
    of_gain.resize(residual.len(), 0.0);
    let mut of_readings: Vec<Vec<f64>> = vec![of_gain];
    of_readings.extend(slopes.iter().map(of_slope));
    let covariance = blocks.covariance(&matrix(&of_readings), &residual);
    let mut variances: Vec<f64> = (0..covariance.nrows()).map(|i| covariance[(i, i)]).collect();

    if free.contains(&PoseParameter::Step) {
        let pitch = readings.simulate_pitch(&fit.pose);
        if let Some(followed) = pitch_variances(&of_readings, &of_slope(&pitch)) {
            variances.iter_mut().zip(followed).for_each(|(variance, more)| *variance += more);
        }
        slopes.push(pitch);
        names.push(ARRAY_PITCH);
        typical.push(TYPICAL_STRETCH);
    }
    let gain_error = variances.remove(0).sqrt();
    let errors = variances.into_iter().map(f64::sqrt).collect();

    let per_scan = 1.0 / (rms(values.iter().copied()) * (values.len() as f64).sqrt());
    let columns: Vec<Vec<f64>> = slopes
        .into_iter()
        .zip(&typical)
        .map(|(mut slope, scale)| {
            project_out(&fit.simulated, &mut slope.magnitudes);
            of_slope(&slope).into_iter().map(|entry| entry * scale * per_scan).collect()
        })
        .collect();
    let undetermined = if columns.is_empty() {
        Vec::new()
    } else {
        hidden_combinations(&names, &typical, &columns, fit.residual_ratio)
    };
    Identifiability { gain_error, errors, undetermined }
}

/// The combinations of columns (relative change of the map by a typical error) that change it too little.
fn hidden_combinations(
    names: &[&str],
    typical: &[f64],
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
        .filter(|(change, _)| *change < DETECTABLE * residual_ratio)
        .collect();
    hidden.sort_by(|a, b| a.0.total_cmp(&b.0));
    hidden
        .into_iter()
        .map(|(change, vector)| {
            let largest = vector.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            let members: Vec<usize> =
                (0..names.len()).filter(|&i| vector[i].abs() >= MEMBER * largest.abs()).collect();
            let described = |i: usize| in_words(names[i], vector[i] * typical[i] * largest.signum());
            let moved = members.iter().map(|&i| described(i)).collect::<Vec<_>>().join(", ");
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

/// The variance of each free coefficient that an error of the pitch by its tolerance causes.
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
    fn parameters_with_the_same_effect_are_named_and_others_are_not() {
        let wave = |f: f64| (0..100).map(|i| 0.01 * (f * i as f64).sin()).collect::<Vec<f64>>();
        let columns = [wave(0.1), wave(0.1), wave(0.37)];
        let names = ["shift_z", "step_ratio", "turn"];
        let hidden = hidden_combinations(&names, &[5e-3, 0.02, 0.035], &columns, 0.1);
        assert_eq!(hidden.len(), 1);
        assert_eq!(hidden[0].parameters, ["shift_z", "step_ratio"]);
        assert!(hidden[0].explanation.contains("these apart"), "{}", hidden[0].explanation);
    }

    #[test]
    fn a_parameter_without_effect_is_named_alone() {
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
