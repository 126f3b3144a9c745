//! Why a row cannot be scanned in motion.

/// Passes over a row before the scan gives up.
pub(crate) const FLIGHTS: usize = 3;

/// Why a row cannot be scanned in motion as the plan says.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum FlightFault {
    /// Too few samples per point.
    #[error(
        "at {speed_mm_s} mm/s a receiver of {rate_hz} Hz gives {:.1} samples per point; at least {least} are needed",
        (samples * 10.0 + 1e-9).floor() / 10.0
    )]
    #[diagnostic(help("lower `speed_mm_s` in [fly] of the plan to {:.1} at most", (most_mm_s * 10.0 + 1e-9).floor() / 10.0))]
    TooFast {
        /// Speed in the plan, mm/s.
        speed_mm_s: f64,
        /// Rate of the receiver, Hz.
        rate_hz: f64,
        /// Samples per point.
        samples: f64,
        /// Samples per point that are needed.
        least: usize,
        /// The largest possible speed, mm/s.
        most_mm_s: f64,
    },
    /// The robot was slower than planned.
    #[error(
        "the robot took {took_s:.3} s for a row of {way_mm:.1} mm; at {speed_mm_s} mm/s with leads of {lead_mm:.1} mm it should take \
         {most_s:.3} s at most, of which {handling_ms:.0} ms are for the firmware's handling of a move, as measured by short moves"
    )]
    #[diagnostic(help(
        "raise `lead_mm` in [fly] of the plan, so that the robot reaches full speed before the first point; or lower `speed_mm_s`, \
         if the firmware limits the speed"
    ))]
    Slow {
        /// Duration of the pass, s.
        took_s: f64,
        /// Longest allowed duration, s.
        most_s: f64,
        /// Its length with leads, mm.
        way_mm: f64,
        /// Speed in the plan, mm/s.
        speed_mm_s: f64,
        /// Length of a lead, mm.
        lead_mm: f64,
        /// Time that the firmware takes to handle a move, ms.
        handling_ms: f64,
    },
    /// Samples were missing in every pass over a row.
    #[error(
        "too few samples at ({x_mm:.1}, {y_mm:.1}, {z_mm:.1}) mm in each of {FLIGHTS} passes over the row"
    )]
    #[diagnostic(help(
        "check the receiver's cable and rate with `fieldgap rig check`; if only the ends of rows lack samples, raise `lead_mm`"
    ))]
    Thin {
        /// Position, mm.
        x_mm: f64,
        /// Position, mm.
        y_mm: f64,
        /// Position, mm.
        z_mm: f64,
    },
    /// The passes over a row took longer than those over others.
    #[error(
        "each of {FLIGHTS} passes over the row through ({x_mm:.1}, {y_mm:.1}, {z_mm:.1}) mm took at least {late_ms:.0} ms longer than the \
         shortest pass, so that its readings may be {off_mm:.1} mm from their places"
    )]
    #[diagnostic(help(
        "something delays the robot or its answers: stop other programs that keep the computer busy, check the robot's cable with \
         `fieldgap rig check`, or lower `speed_mm_s`; without [fly] nothing depends on such delays"
    ))]
    Uneven {
        /// Centre of the row, mm.
        x_mm: f64,
        /// Centre of the row, mm.
        y_mm: f64,
        /// Centre of the row, mm.
        z_mm: f64,
        /// Duration beyond that of the shortest pass, ms.
        late_ms: f64,
        /// Possible error of the positions, mm.
        off_mm: f64,
    },
    /// The lag of the readings cannot be found from a row.
    #[error("the lag of the readings behind the robot cannot be found from the row through ({x_mm:.1}, {y_mm:.1}, {z_mm:.1}) mm, scanned in both directions{}",
        found.map_or_else(String::new, |(ms, error)| format!(": {ms:.2} ± {error:.2} ms")))]
    #[diagnostic(help(
        "add a row through the focus to the plan, where the level varies along the row; or give the lag as `lag_ms` in [fly]"
    ))]
    NoLag {
        /// Centre of the row, mm.
        x_mm: f64,
        /// Centre of the row, mm.
        y_mm: f64,
        /// Centre of the row, mm.
        z_mm: f64,
        /// The estimate with its standard error, ms, if there is one.
        found: Option<(f64, f64)>,
    },
}
