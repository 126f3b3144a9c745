//! What a diagnosis says: the result, as data.
//!
//! It serialises to the JSON of format 1. Gaps are root mean square residuals over the readings at the best gain, relative
//! to the root mean square of the scan. Shares sum to one.

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Registration;
use fieldgap_comparison::{FieldFigures, Noise};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;

/// Why a scan and its simulation differ, as far as the readings tell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The format of the JSON: 1.
    pub format: u32,
    /// Name of the (first) scan.
    pub scan: String,
    /// Names of all scans that were taken together.
    pub scans: Vec<String>,
    /// The simulator whose gap this is.
    pub simulator: Simulator,
    /// Unit of the readings, as the record gives it.
    pub reading_unit: String,
    /// Readings taken with the array driven, without the outliers.
    pub points: usize,
    /// Readings that stand out from those beside them, and were left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub outliers: usize,
    /// The judgement.
    pub verdict: Verdict,
    /// The named cause, one id or several; empty unless the verdict is `explained` or `mostly-explained`.
    pub effects: Vec<EffectId>,
    /// What the best candidate leaves that is not noise; `None` where it leaves noise alone.
    pub remainder: Option<Remainder>,
    /// The rival sets of causes, best first, where the verdict is `ambiguous`.
    pub alternatives: Vec<Vec<EffectId>>,
    /// Every cause or set of causes worth a mention, the most probable first. An empty set is "no effect".
    pub ranked: Vec<Candidate>,
    /// Gap of the simulation as believed, relative to the scan's rms.
    pub gap_before: f64,
    /// The same over readings kept out of the fit.
    pub gap_before_held_out: f64,
    /// How these readings were chosen.
    pub held_out_by: HeldOutBy,
    /// Side of the blocks of places, mm, if they were chosen by place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_block_mm: Option<f64>,
    /// What noise alone leaves, relative to the scan's rms.
    pub noise_floor: f64,
    /// Share of the squared gap beyond noise, on readings kept out of the fit, that the best candidate explains; 0 to 1.
    pub explained_fraction: f64,
    /// How much of it the elements' own departures explain, where no set of effects does and planes are dense enough to tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elements: Option<ElementsAccount>,
    /// How far the set-up departs from what is stated, where its uncertainty is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<WithinUncertainty>,
    /// Where the gap lies.
    pub r#where: Where,
    /// The scan that would tell the rivals apart.
    pub next_measurement: Option<NextMeasurement>,
    /// Noise of one reading.
    pub noise: Noise,
    /// Standard deviation of the slow noise of the level beside it, relative, 0 to 0.015; `None` where none is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_noise: Option<f64>,
    /// What was left of the phases; `None` where the readings have none, or they were left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase: Option<PhaseFigures>,
    /// How the scan was brought to the simulation's coordinates before anything else.
    pub registration: Registration,
    /// Tests for structure in what the best candidate leaves, as z-scores.
    pub residual_tests: Vec<ResidualTest>,
    /// How the squared gap shrinks as the effects of the best candidate are added one after another: defects of the simulator first, then
    /// the largest first. It begins with
    /// [`gap_before`](Self::gap_before); the last step is what remains beyond noise. Shares sum to one.
    pub waterfall: Vec<WaterfallStep>,
    /// What these data cannot tell, with numbers, in sentences.
    pub undetermined: Vec<String>,
    /// The verdict in one sentence.
    pub sentence: String,
    /// Maps height by height.
    pub planes: Vec<DiagnosedPlane>,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Differences of the phases from the expected ones, the reference's phase and drift taken out. Each counts by the square of its reading over
/// its noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhaseFigures {
    /// Readings whose phase counts: those well above the quadratures' noise.
    pub readings: usize,
    /// Noise of a phase beyond that of the quadratures, rad (of the first scan).
    pub noise_rad: f64,
    /// Rms difference from the simulation as believed, rad.
    pub rms_before_rad: f64,
    /// Rms difference from what the best candidate expects, rad.
    pub rms_after_rad: f64,
}

/// The judgement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// One set of effects explains the gap and its rivals do not; what is left is noise.
    Explained,
    /// One set of effects explains nearly all of the gap and its rivals do not; a small share is left that is not noise.
    MostlyExplained,
    /// Two or three sets explain it equally well.
    Ambiguous,
    /// There is a gap, and nothing in the catalogue explains it.
    Unexplained,
    /// There is no gap beyond noise.
    None,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Self; 5] =
        [Self::Explained, Self::MostlyExplained, Self::Ambiguous, Self::Unexplained, Self::None];

    /// Its name in files and on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::MostlyExplained => "mostly-explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
            Self::None => "none",
        }
    }

    /// Its name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::MostlyExplained => "mostly-explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
            Self::None => "none",
        }
    }

    /// Whether one set of effects is named.
    pub fn names_a_cause(self) -> bool {
        matches!(self, Self::Explained | Self::MostlyExplained)
    }
}

/// How far the set-up departs from what is stated, within the uncertainty that is stated too. Every candidate departs so beside its effects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WithinUncertainty {
    /// Gap with these departures and no effect, relative to the scan's rms.
    pub gap: f64,
    /// The departures beside the best candidate. Where it names an effect of the same kind, there is none of that kind.
    pub departures: Vec<StatedFinding>,
}

/// One departure of the set-up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StatedFinding {
    /// The id of the effect that acts so; `origin` for the scan's coordinates.
    pub what: String,
    /// Its size in words.
    pub sentence: String,
    /// Root mean square of its numbers, each over its standard uncertainty.
    pub in_uncertainties: f64,
}

impl Diagnosis {
    /// What differs where no cause is found.
    pub fn nothing_but(&self) -> &'static str {
        match self.uncertainty {
            Some(_) => "noise and the stated uncertainty of the set-up",
            None => "noise",
        }
    }

    /// What a fifth was held out of, as a plural.
    pub fn held_out_of_what(&self) -> String {
        let of_what = match self.held_out_by {
            HeldOutBy::Place => "places",
            HeldOutBy::Drive => "drives",
            HeldOutBy::Time => "stretches of time",
        };
        let blocks = self.held_out_block_mm.map(|mm| format!(", in blocks of {mm:.0} mm"));
        of_what.to_owned() + &blocks.unwrap_or_default()
    }
}

/// What the readings kept out of a fit have in common: a fifth of the blocks of places, of the drives, or of the stretches of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeldOutBy {
    /// Blocks of neighbouring places.
    Place,
    /// Drives, of a scan with few places.
    Drive,
    /// Stretches of time, of a scan with few places and few drives.
    Time,
}

/// What each element emits, as an account of dense planes that no set of effects explains. Gaps are relative to the rms of the readings that they are of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementsAccount {
    /// Readings that it was fitted to: all of the scan.
    pub readings: usize,
    /// Elements, each with gain, phase, place and lean of its own.
    pub elements: usize,
    /// Side of the blocks that were held out, every fifth, mm.
    pub block_mm: f64,
    /// The same in wavelengths.
    pub block_wavelengths: f64,
    /// What the registered simulation leaves of them.
    pub gap_before_held_out: f64,
    /// What pose, backlash, lobe and floor leave of them, fitted with elements alike but for a few percent.
    pub gap_alike_held_out: f64,
    /// What the account leaves of them, fitted to the others.
    pub gap_after_held_out: f64,
    /// What it should leave by its errors and the noise.
    pub expected_held_out: f64,
    /// What it leaves of readings that it was fitted to.
    pub gap_after: f64,
    /// Share of the squared gap of the registered simulation beyond noise that it explains in the held-out blocks; 0 to 1.
    pub explained_fraction: f64,
    /// The same of what pose, backlash, lobe and floor leave: the part of the elements.
    pub explained_by_elements: f64,
    /// Whether the blocks bear the elements out: there is a gap beyond pose and lobe, and they explain most of it.
    pub is_borne_out: bool,
    /// How far elements depart from being alike.
    pub spread: ElementsSpread,
    /// How far rows scanned to and fro lie beside each other, mm; `None` where all run one way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backlash_mm: Option<f64>,
    /// Elements that are dead, weak or reversed.
    pub faults: Vec<ElementFault>,
    /// What the readings cannot tell of it, in sentences.
    pub undetermined: Vec<String>,
}

/// Standard deviations of what elements have of their own; zero where the evidence is against it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ElementsSpread {
    /// Gains, relative.
    pub gain: f64,
    /// Phases, rad.
    pub phase_rad: f64,
    /// Places along x and along y, mm.
    pub place_mm: f64,
    /// Lean of their lobes: of the logarithm of the pressure for each unit of the direction cosine.
    pub lean: f64,
}

/// An element that is not sound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementFault {
    /// Its number.
    pub element: usize,
    /// `dead`, `weak` or `reversed`.
    pub state: String,
    /// Its gain over the median.
    pub gain: f64,
}

/// What the best candidate leaves beyond noise, where it has structure, or where others explain it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remainder {
    /// Share of the squared gap beyond noise, over all readings.
    pub share: f64,
    /// Its rms relative to the scan's, noise subtracted.
    pub gap: f64,
    /// What it looks like: the tests that find structure in it, with their results, the clearest first.
    pub looks_like: Vec<String>,
    /// Where only a part of many effects is beyond doubt: sets of others, each of which explains the rest, and which these data cannot tell apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_to: Vec<Vec<EffectId>>,
}

/// A set of effects fitted to the readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The ids; empty for "no effect".
    pub effects: Vec<EffectId>,
    /// Probability among all that were tried, 0 to 1.
    pub probability: f64,
    /// Natural logarithm of the evidence, relative to the best.
    pub log_evidence: f64,
    /// Fitted parameters by `effect.parameter`.
    pub parameters: BTreeMap<String, FittedParameter>,
    /// What the parameters mean, one sentence an effect.
    pub readings: Vec<String>,
    /// Gap with the effects added.
    pub gap_after: f64,
    /// The same over readings kept out of the fit.
    pub gap_after_held_out: f64,
}

/// Where the gap lies: shares of the squared gap beyond noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// By drive and height.
    pub planes: Vec<PlaneShare>,
    /// By region of the believed field.
    pub regions: Vec<RegionShare>,
    /// By kind.
    pub kinds: KindShares,
}

/// One height's share.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneShare {
    /// Number of the scan, from 0.
    pub scan: usize,
    /// Number of the drive.
    pub focus: usize,
    /// Height, mm.
    pub z_mm: f64,
    /// Share of the squared gap beyond noise.
    pub share: f64,
    /// Gap over this plane, relative to its own rms.
    pub gap: f64,
    /// The same with the best candidate added.
    pub gap_after: f64,
    /// What noise alone leaves of it.
    pub noise: f64,
}

/// One region's share.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionShare {
    /// Which.
    pub region: Region,
    /// Share of the squared gap beyond noise.
    pub share: f64,
}

/// A region of the believed field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// Connected to the plane's peak and above half of it.
    MainLobe,
    /// Other places above a tenth of the plane's peak.
    SideLobes,
    /// The rest.
    Outside,
}

/// Shares by kind; they sum to one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KindShares {
    /// What a separate gain for each height would remove.
    pub gain: f64,
    /// What a free shift of each height would remove beyond that.
    pub registration: f64,
    /// What remains: the field has another shape.
    pub shape: f64,
    /// What noise alone would leave of the squared gap.
    pub noise: f64,
}

/// A test of what the best candidate leaves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualTest {
    /// What is looked for, in words.
    pub name: &'static str,
    /// Standard deviations from what noise alone gives; of a converter's steps their rounding error, in the noise's deviations.
    pub z: f64,
    /// Before anything was added; `None` for what is only asked of the residual.
    pub z_before: Option<f64>,
    /// From where on it is not noise's.
    pub limit: f64,
    /// What it is a sign of, as far as the readings say: where a wave comes from, which axis a screw drives.
    pub sign_of: Option<String>,
}

impl ResidualTest {
    /// Whether the residual is not noise.
    pub fn is_structure(&self) -> bool {
        self.z > self.limit
    }

    /// Whether what there was before was not.
    pub fn was_structure(&self) -> bool {
        self.z_before.is_some_and(|z| z > self.limit)
    }
}

/// What a step of the waterfall stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaterfallPart {
    /// A shift within the tolerance of the set-up and the near field of the elements, which every candidate leaves free.
    Alignment,
    /// The other departures of the set-up within its stated uncertainty, which every candidate leaves free too.
    StatedUncertainty,
    /// An effect.
    Effect,
    /// What remains beyond noise.
    Residual,
}

/// A step of the waterfall.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WaterfallStep {
    /// What it stands for.
    pub part: WaterfallPart,
    /// The effect that is added here; `None` for the other parts.
    pub effect: Option<EffectId>,
    /// Share of the squared gap beyond noise.
    pub share: f64,
}

impl WaterfallStep {
    /// Its name in a chart or a list.
    pub fn name(&self) -> &'static str {
        match (self.effect, self.part) {
            (Some(effect), _) => effect.as_str(),
            (None, WaterfallPart::Alignment) => "alignment",
            (None, WaterfallPart::StatedUncertainty) => "stated uncertainty",
            (None, _) => "residual",
        }
    }
}

/// The scan that tells rivals apart best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextMeasurement {
    /// What to do, in words, and what to expect of it.
    pub what: String,
    /// Expected difference between the two best rivals, in standard deviations of the whole scan's noise, after each has
    /// been fitted anew.
    pub expected_sigma: f64,
    /// The same for the scan that was diagnosed.
    pub present_sigma: f64,
    /// Driven readings of the plan.
    pub readings: usize,
    /// How long the plan takes at the pace of the scan that was diagnosed, s; `None` where its readings have no times.
    pub duration_s: Option<f64>,
    /// A plan that `fieldgap scan` runs, as TOML; `None` where no scan of this rig can do it.
    pub plan: Option<String>,
}

/// Scan and simulations at one height, for pictures. Values are NaN where nothing was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagnosedPlane {
    /// Number of the scan, from 0.
    pub scan: usize,
    /// Number of the drive.
    pub focus: usize,
    /// Height, mm.
    pub z_mm: f64,
    /// Columns, ascending, metres.
    #[serde(skip)]
    pub x_m: Vec<f64>,
    /// Rows, ascending, metres.
    #[serde(skip)]
    pub y_m: Vec<f64>,
    /// Readings, row by row (y outer, x inner).
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// The believed simulation, in the readings' unit.
    #[serde(skip)]
    pub before: Vec<f64>,
    /// The simulation with the best candidate added.
    #[serde(skip)]
    pub after: Vec<f64>,
    /// What the believed simulation leaves, in standard deviations of the noise.
    #[serde(skip)]
    pub residual_before: Vec<f64>,
    /// What the best candidate leaves, likewise.
    #[serde(skip)]
    pub residual_after: Vec<f64>,
    /// Figures of the scanned map, of the believed simulation, and with the best candidate added; `None` where the points
    /// lie on no grid.
    pub figures: Option<[FieldFigures; 3]>,
}
