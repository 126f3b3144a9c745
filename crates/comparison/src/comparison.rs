//! The result of a comparison of a scan with its simulation, as data.
//!
//! Everything here serialises to JSON with the unit in the name of each field; readings are in the
//! scan's own unit, named once by [`Comparison::reading_unit`]. A number that does not exist (a
//! radius cut off by the map's edge, a point that was not measured) is `null` there.

use serde::Serialize;

use super::phase_figures::PlanePhase;
use super::registration::Registration;
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_level::Budget;
pub use fieldgap_text::Uncertain;

/// A scan and its simulation, registered and compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scan, as its record gives it.
    pub scan_name: String,
    /// Unit of the readings, as the record gives it.
    pub reading_unit: String,
    /// The simulator.
    pub simulator: Simulator,
    /// Number of readings compared (array driven, not silent).
    pub points: usize,
    /// Standard deviation of the noise of one reading, in the reading's unit, and where it is from.
    pub noise: Noise,
    /// The registration of the two.
    pub registration: Registration,
    /// One entry for each drive and height, by drive, then by height.
    pub planes: Vec<PlaneComparison>,
    /// All readings together, at one gain.
    pub overall: Agreement,
    /// Absolute levels; `None` if the sensitivity of the receiver is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<Levels>,
}

/// The noise of one reading: standard deviation as `additive + multiplicative · reading`, added in
/// power.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    /// Part that does not depend on the level, in the reading's unit.
    pub additive: f64,
    /// Part in proportion to the level, relative.
    pub multiplicative: f64,
    /// The data that it was estimated from.
    pub source: NoiseSource,
}

/// The data of a noise estimate, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// Points that were measured several times.
    Repeats,
    /// Readings with the array silent; no repeats.
    SilentReadings,
    /// What the maps of dense planes hold beyond the wavenumber; no repeats.
    Maps,
    /// The finest structure of the residual: an upper bound, as it contains some of the gap.
    Residual,
}

/// How well simulation and scan agree over a set of points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// Pearson's correlation of scan and simulation, -1 to 1.
    pub correlation: f64,
    /// Rms of the residual over the rms of the scan's readings, at the gain of the registration; 0
    /// to about 1.
    pub residual_rms_ratio: f64,
    /// The same, at the best gain for these points.
    pub residual_rms_ratio_own_gain: f64,
    /// This gain over that of the registration: the relative level of the scan here.
    pub gain_ratio: f64,
    /// Rms of the residual, in the reading's unit, at the gain of the registration.
    pub residual_rms: f64,
    /// Rms of the readings, in the reading's unit.
    pub scan_rms: f64,
    /// Number of readings.
    pub points: usize,
}

/// Scan and simulation at one height, for one drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneComparison {
    /// Number of the drive, as in the record.
    pub focus: usize,
    /// Height in the scan's coordinates, metres.
    pub z_m: f64,
    /// Intended focus of the drive, in the array's coordinates, metres.
    #[serde(serialize_with = "vector")]
    pub target_m: Option<Vec3>,
    /// The same in the coordinates of the scan, metres.
    #[serde(serialize_with = "vector")]
    pub target_in_scan_m: Option<Vec3>,
    /// The two maps on one grid, where the points lie on one.
    pub map: Option<ComparedMap>,
    /// Why there is no map, where there is none.
    pub why_no_map: Option<String>,
    /// Figures of the scanned field.
    pub scan: FieldFigures,
    /// Figures of the simulated field, by the same rules from the same points.
    pub simulation: FieldFigures,
    /// How the two sets of figures differ.
    pub discrepancy: Discrepancy,
    /// Agreement over this plane's readings.
    pub agreement: Agreement,
    /// Number of readings.
    pub points: usize,
    /// How the phases differ; `None` where the readings have none, or lie on no grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase: Option<PlanePhase>,
}

/// Scan and simulation on one grid, in the coordinates and the unit of the scan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedMap {
    /// Columns, ascending, metres.
    pub x_m: Vec<f64>,
    /// Rows, ascending, metres.
    pub y_m: Vec<f64>,
    /// Readings, row by row (y outer, x inner), mean where a point was measured several times, NaN
    /// where it was not.
    pub scan: Vec<f64>,
    /// The simulation at the same points times the gain, at every point of the grid.
    pub simulation: Vec<f64>,
    /// The phase of the simulated pressure at every point of the grid, radians; `None` where it was not computed. Not in JSON.
    #[serde(skip)]
    pub phase_rad: Option<Vec<f64>>,
}

/// The thesis's figures of a map: peak, focal radius, sub-peaks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldFigures {
    /// Value of the peak, refined below the step, in the reading's unit.
    pub peak: Uncertain,
    /// Its position (x, y), refined below the step, in the scan's coordinates, metres.
    pub peak_position_m: [Uncertain; 2],
    /// Whether the largest point is on the map's edge, so that the true peak may be outside.
    pub peak_at_edge: bool,
    /// Mean half-width at half the peak, by the thesis's definition; `None` without a map.
    pub focal_radius: Option<FocalRadiusFigure>,
    /// Local maxima above half the peak besides the peak itself; `None` without a map.
    pub sub_peaks: Option<usize>,
}

/// A focal radius and the sides it was taken from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FocalRadiusFigure {
    /// Mean of the sides that fall below the threshold inside the map, metres; `None` when none does.
    pub radius_m: Option<Uncertain>,
    /// Half-width towards +x, -x, +y, -y, metres; `None` where the map's edge cuts it off.
    pub sides_m: [Option<f64>; 4],
}

/// Simulation against scan at one height.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Discrepancy {
    /// Peak of the scan over peak of the simulation.
    pub peak_ratio: Uncertain,
    /// From the simulated peak to the scanned one (x, y), metres.
    pub peak_shift_m: [Uncertain; 2],
    /// Length of that shift, metres.
    pub peak_distance_m: Uncertain,
    /// Focal radius of the scan less that of the simulation, metres, over the sides that both have.
    pub focal_radius_m: Option<Uncertain>,
    /// Number of sub-peaks of the scan less that of the simulation.
    pub sub_peaks: Option<i64>,
}

/// The levels of a comparison.
///
/// All are levels of the carrier, from root mean squares, re 20 µPa.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Levels {
    /// Sound pressure per unit of a reading, Pa rms, of a plane wave along the receiver's axis.
    pub rms_pa_per_reading: f64,
    /// One entry for each plane of the comparison whose peak has a level, in its order.
    pub planes: Vec<PlaneLevels>,
    /// What is taken for granted, in sentences.
    pub notes: Vec<String>,
}

/// The levels of a plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneLevels {
    /// Number of the drive.
    pub focus: usize,
    /// Height in the scan's coordinates, metres.
    pub z_m: f64,
    /// Peak of the scan.
    pub scan: PeakLevel,
    /// Peak of the simulation at the gain of the registration.
    pub simulation: PeakLevel,
    /// Level of the scan's peak over that of the simulation, dB. It does not depend on the sensitivity.
    pub gap_db: Uncertain,
    /// Rms of the residual, Pa rms.
    pub residual_rms_pa: f64,
    /// Correction for the angles of incidence and the receiver's face at the peak, dB; it is contained in the levels.
    pub reception_db: f64,
    /// Expanded uncertainty of the level of the scan's peak, k = 2, dB.
    pub expanded_db: f64,
    /// Its budget.
    pub budget: Budget,
}

/// The level of a peak.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PeakLevel {
    /// Sound pressure, Pa rms.
    pub rms_pa: f64,
    /// Level, dB re 20 µPa.
    pub level_db: f64,
}

impl Levels {
    /// The plane with the largest peak of the scan.
    pub fn loudest(&self) -> Option<&PlaneLevels> {
        self.planes.iter().max_by(|a, b| a.scan.rms_pa.total_cmp(&b.scan.rms_pa))
    }

    /// The levels of a plane.
    pub fn of_plane(&self, plane: &PlaneComparison) -> Option<&PlaneLevels> {
        self.planes.iter().find(|levels| levels.focus == plane.focus && levels.z_m == plane.z_m)
    }

    /// Sound pressure per unit of a reading in a plane, Pa rms, with the correction at its peak.
    pub fn rms_pa_in(&self, plane: &PlaneLevels) -> f64 {
        self.rms_pa_per_reading * 10f64.powf(plane.reception_db / 20.0)
    }
}

/// A vector as `[x, y, z]`.
fn vector<S: serde::Serializer>(value: &Option<Vec3>, serializer: S) -> Result<S::Ok, S::Error> {
    value.map(|v| [v.x, v.y, v.z]).serialize(serializer)
}
