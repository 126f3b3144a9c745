//! The gap as a program asks for it: a line of JSON, and an exit code where it is too large.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use fieldgap_acoustics::Simulator;
use serde::Serialize;

use super::output::say;
use super::simulate::positive;
use fieldgap_comparison::{Comparison, Uncertain};
use fieldgap_input::Positive;

/// Exit code of a gap above the limit.
pub(super) const GAP_ABOVE: u8 = 4;

/// The largest gap that is no failure.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct GapLimit {
    /// End with exit code 4 if the gap is larger, in per cent of the scan's rms; with several simulators, that of the first
    #[arg(long, value_name = "PERCENT", value_parser = positive)]
    fail_above: Option<Positive>,
}

/// What `run --json` prints after the scan's events: the gap with the first simulator, and its parts for each height.
#[derive(Debug, Serialize)]
struct GapLine<'a> {
    event: &'static str,
    simulator: Simulator,
    /// Root mean square of scan minus simulation over that of the scan, %.
    gap_percent: f64,
    correlation: f64,
    /// Scale of the scan to the simulation.
    gain_ratio: f64,
    points: usize,
    heights: Vec<GapAtHeight>,
    report: &'a Path,
}

/// The gap at one height under one focus.
#[derive(Debug, Serialize)]
struct GapAtHeight {
    focus: usize,
    z_mm: f64,
    gap_percent: f64,
    correlation: f64,
    /// Peak of the scan over peak of the simulation.
    peak_ratio: Uncertain,
    /// From the simulated peak to the scanned one, mm.
    peak_distance_mm: f64,
    /// Focal radius of the scan less that of the simulation, mm; `None` if one of them has none.
    focal_radius_mm: Option<f64>,
}

impl<'a> GapLine<'a> {
    fn of(comparison: &Comparison, report: &'a Path) -> Self {
        let heights = comparison.planes.iter().map(|plane| GapAtHeight {
            focus: plane.focus,
            z_mm: plane.z_m * 1e3,
            gap_percent: plane.agreement.residual_rms_ratio * 100.0,
            correlation: plane.agreement.correlation,
            peak_ratio: plane.discrepancy.peak_ratio,
            peak_distance_mm: plane.discrepancy.peak_distance_m.value * 1e3,
            focal_radius_mm: plane.discrepancy.focal_radius_m.map(|radius| radius.value * 1e3),
        });
        Self {
            event: "compared",
            simulator: comparison.simulator,
            gap_percent: gap_percent(comparison),
            correlation: comparison.overall.correlation,
            gain_ratio: comparison.overall.gain_ratio,
            points: comparison.overall.points,
            heights: heights.collect(),
            report,
        }
    }
}

/// The line of JSON about the first comparison, for a report in this folder.
pub(super) fn gap_line(comparisons: &[Comparison], report: &Path) -> serde_json::Result<String> {
    let line = comparisons.first().map(|first| GapLine::of(first, report));
    line.map_or_else(|| Ok(String::new()), |line| super::output::json_line(&line))
}

impl GapLimit {
    /// Success, unless the gap with the first simulator is above the limit, which is said.
    pub(super) fn exit_code(self, comparisons: &[Comparison]) -> ExitCode {
        comparisons
            .first()
            .map_or(ExitCode::SUCCESS, |first| self.exit_code_of(gap_percent(first), "the gap"))
    }

    /// Success, unless a gap, %, is above the limit, which is said in these words.
    pub(super) fn exit_code_of(self, gap: f64, what: &str) -> ExitCode {
        match self.fail_above.map(Positive::get) {
            // A gap that is no number is not below the limit.
            Some(limit) if gap.is_nan() || gap > limit => {
                say(format!("{what} of {gap:.2} % is above the limit of {limit} %"));
                ExitCode::from(GAP_ABOVE)
            }
            _ => ExitCode::SUCCESS,
        }
    }
}

fn gap_percent(comparison: &Comparison) -> f64 {
    comparison.overall.residual_rms_ratio * 100.0
}
