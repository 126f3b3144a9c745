//! The beam axis as text: its position, and the origin to enter in the rig file.

use std::fmt::Write;

use serde::Serialize;

use super::line::{BeamAxis, Estimate};
use fieldgap_rig::Frame;

/// Smallest significant deviation, in standard errors.
const SIGNIFICANT: f64 = 3.0;

/// Smallest deviation of the origin worth a correction, m: 0.1 mm changes no level by a thousandth.
const GOOD_ORIGIN_M: f64 = 0.05e-3;

/// The beam axis, and the origin that follows for the rig file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisReport {
    /// The axis.
    #[serde(flatten)]
    pub axis: BeamAxis,
    /// `origin_mm` of `[motion]` in the rig file, mm.
    pub origin_mm: [f64; 3],
    /// Corrected `origin_mm`, mm; z is unchanged.
    pub new_origin_mm: [f64; 3],
    /// Whether to change it: the deviation is significant and large enough to matter.
    pub change: bool,
}

impl AxisReport {
    /// For a rig file whose array lies at `frame`.
    pub fn new(axis: BeamAxis, frame: Frame) -> Self {
        let origin_mm: [f64; 3] = (frame.origin_m * 1e3).into();
        let [x, y, z] = origin_mm;
        let hundredths = |mm: f64| (mm * 100.0).round() / 100.0;
        let new_origin_mm =
            [hundredths(x + axis.x_m.value * 1e3), hundredths(y + axis.y_m.value * 1e3), z];
        let off = |estimate: &Estimate| {
            estimate.value.abs() > (SIGNIFICANT * estimate.error).max(GOOD_ORIGIN_M)
        };
        let change = off(&axis.x_m) || off(&axis.y_m);
        Self { axis, origin_mm, new_origin_mm, change }
    }
}

/// The report for people; `unit` is the receiver's.
pub fn in_words(report: &AxisReport, unit: &str) -> String {
    let axis = &report.axis;
    let mut text = String::new();
    let mut line = |words: std::fmt::Arguments<'_>| {
        writeln!(text, "{words}").expect("writing to a string does not fail");
    };
    line(format_args!("{:>8}  {:>18}  {:>18}  {:>10}", "z (mm)", "x (mm)", "y (mm)", "level"));
    for cross in &axis.crosses {
        line(format_args!(
            "{:>8.1}  {:>18}  {:>18}  {:>10}",
            cross.z_m * 1e3,
            mm(cross.x_m),
            mm(cross.y_m),
            format!("{:.4} {unit}", cross.level)
        ));
    }
    if axis.crosses.iter().any(|cross| cross.clipped) {
        line(format_args!(
            "  some readings were clipped and not used: lower the gain of the receiver, or choose greater heights"
        ));
    }
    line(format_args!(
        "the axis meets the array face at x {} mm, y {} mm",
        mm(axis.x_m),
        mm(axis.y_m)
    ));
    match axis.slope {
        None => line(format_args!(
            "its inclination cannot be found from one height: it is assumed parallel to z"
        )),
        Some(slope) => {
            let mrad =
                |slope: Estimate| format!("{:+.2} ± {:.2}", slope.value * 1e3, slope.error * 1e3);
            line(format_args!(
                "it is inclined by {} mrad towards x, {} mrad towards y",
                mrad(slope.x),
                mrad(slope.y)
            ));
            let leans = |slope: Estimate| slope.value.abs() > SIGNIFICANT * slope.error;
            if leans(slope.x) || leans(slope.y) {
                line(format_args!(
                    "  it is not parallel to the robot's z axis: {:.2} mm over 100 mm. Level the array",
                    slope.x.value.hypot(slope.y.value) * 100.0
                ));
            }
        }
    }
    let ([x, y, z], [new_x, new_y, _]) = (report.origin_mm, report.new_origin_mm);
    if report.change {
        line(format_args!(
            "the origin in the rig file, ({x:.2}, {y:.2}) mm, is off by ({:+.2}, {:+.2}) mm; enter in [motion]:",
            axis.x_m.value * 1e3,
            axis.y_m.value * 1e3
        ));
        line(format_args!("origin_mm = [{new_x:.2}, {new_y:.2}, {z:.2}]"));
    } else {
        line(format_args!(
            "the origin in the rig file, ({x:.2}, {y:.2}) mm, agrees with it: nothing to change"
        ));
    }
    line(format_args!("(this does not measure z of the origin: use a gauge)"));
    text
}

fn mm(estimate: Estimate) -> String {
    format!("{:+.3} ± {:.3}", estimate.value * 1e3, estimate.error * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam_axis::Cross;
    use fieldgap_acoustics::Vec3;

    fn axis(x_mm: f64, error_mm: f64) -> BeamAxis {
        let estimate = |mm: f64| Estimate { value: mm * 1e-3, error: error_mm * 1e-3 };
        let cross = |z_mm: f64| Cross {
            z_m: z_mm * 1e-3,
            x_m: estimate(x_mm),
            y_m: estimate(-0.01),
            level: 2.5,
            clipped: z_mm < 80.0,
        };
        BeamAxis::through(vec![cross(60.0), cross(100.0), cross(140.0)])
    }

    fn frame() -> Frame {
        Frame { origin_m: Vec3::new(0.15, 0.15, -0.02) }
    }

    #[test]
    fn the_line_for_the_rig_file_is_said() {
        let report = AxisReport::new(axis(1.234, 0.02), frame());
        assert!(report.change);
        insta::assert_snapshot!(in_words(&report, "V"));
    }

    #[test]
    fn an_insignificant_deviation_changes_no_origin() {
        assert!(!AxisReport::new(axis(0.04, 0.001), frame()).change);
        let report = AxisReport::new(axis(0.5, 0.2), frame());
        assert!(!report.change);
        assert!(in_words(&report, "V").contains("nothing to change"));
    }
}
