//! The findings of a comparison, in sentences.

use super::judgement::{Judgement, drives, focal_height_m, judge};
use super::peak_distance::peak_distance_m;
use super::words::{listed, parameter, sentence};
use fieldgap_comparison::{
    Agreement, Comparison, FieldFigures, PlaneComparison, Registering, Registration,
};
use fieldgap_text::{fixed, height_mm, millimetres, percent, significant};

/// A range of levels below this is not reported.
const LEVEL_TOLERANCE: f64 = 0.1;
/// More heights than this are given as a range.
const MOST_HEIGHTS_LISTED: usize = 8;

/// The findings of a comparison, one sentence each.
pub(super) fn sentences(comparison: &Comparison) -> Vec<String> {
    let drives = drives(comparison);
    let mut sentences = Vec::from_iter(registration(&comparison.registration));
    for &number in &drives {
        let prefix = if drives.len() > 1 { format!("Drive {number}: ") } else { String::new() };
        let drive = Drive::new(comparison, number);
        sentences.extend(drive.sentences().map(|sentence| format!("{prefix}{sentence}")));
    }
    sentences.push(overall(&comparison.overall));
    sentences.extend(undetermined(&comparison.registration));
    sentences
}

/// Which of several simulators agrees best with the scan; `None` for a single one.
pub(super) fn best_simulator(comparisons: &[Comparison]) -> Option<String> {
    let mut ranked: Vec<&Comparison> =
        comparisons.iter().filter(|c| c.overall.residual_rms_ratio.is_finite()).collect();
    ranked.sort_by(|a, b| a.overall.residual_rms_ratio.total_cmp(&b.overall.residual_rms_ratio));
    let (best, others) = ranked.split_first()?;
    let residual = |c: &Comparison| percent(c.overall.residual_rms_ratio);
    let others: Vec<String> =
        others.iter().map(|other| format!("{} for {}", residual(other), other.simulator)).collect();
    (!others.is_empty()).then(|| {
        format!(
            "The {} simulator agrees best with the scan: its residual is {} of the scan's rms, against {}.",
            best.simulator,
            residual(best),
            listed(&others)
        )
    })
}

/// The heights of one drive.
struct Drive<'a> {
    planes: Vec<&'a PlaneComparison>,
    focal_height_m: Option<f64>,
}

impl<'a> Drive<'a> {
    fn new(comparison: &'a Comparison, number: usize) -> Self {
        let planes = comparison.planes.iter().filter(|plane| plane.focus == number).collect();
        Self { planes, focal_height_m: focal_height_m(comparison, number) }
    }

    fn sentences(&self) -> impl Iterator<Item = String> {
        [
            self.agreement(),
            self.other_level(),
            self.distances(),
            self.other_maximum(),
            self.shapes(),
            self.too_few_readings(),
            self.distances_from_axis(),
            self.focal_radius(),
            self.levels(),
        ]
        .into_iter()
        .flatten()
    }

    fn judged(&self, judgement: Judgement) -> Vec<&'a PlaneComparison> {
        self.planes.iter().copied().filter(|plane| judge(plane) == judgement).collect()
    }

    fn is_focal(&self, plane: &PlaneComparison) -> bool {
        self.focal_height_m == Some(plane.z_m)
    }

    /// The heights of some planes: `the focal height of 100 mm`, `50, 100 (focal height) and 150 mm`.
    fn heights(&self, planes: &[&PlaneComparison]) -> String {
        let focal = planes.iter().find(|plane| self.is_focal(plane));
        let focal_height =
            focal.map(|plane| format!("focal height of {} mm", height_mm(plane.z_m)));
        match (planes, focal_height) {
            ([_], Some(focal_height)) => format!("the {focal_height}"),
            ([first, .., last], focal_height) if planes.len() > MOST_HEIGHTS_LISTED => {
                let (from, to) = (height_mm(first.z_m), height_mm(last.z_m));
                let including = focal_height.map(|height| format!(", including the {height}"));
                format!(
                    "{} heights from {from} to {to} mm{}",
                    planes.len(),
                    including.unwrap_or_default()
                )
            }
            _ => {
                let height = |plane: &&PlaneComparison| {
                    let focal = if self.is_focal(plane) { " (focal height)" } else { "" };
                    format!("{}{focal}", height_mm(plane.z_m))
                };
                format!("{} mm", listed(&planes.iter().map(height).collect::<Vec<_>>()))
            }
        }
    }

    fn agreement(&self) -> Option<String> {
        let planes = self.judged(Judgement::Agrees);
        let residuals = planes.iter().map(|plane| plane.agreement.residual_rms_ratio);
        let residual = percent(residuals.reduce(f64::max)?);
        let figures = match planes.as_slice() {
            [plane] => format!(
                "their peaks are {} mm apart and the residual is {residual}",
                millimetres(plane.discrepancy.peak_distance_m)
            ),
            _ => format!(
                "their peaks are at most {} mm apart and the residual is at most {residual}",
                significant(farthest_mm(&planes)?, 2)
            ),
        };
        Some(format!("At {}, scan and simulation agree: {figures}.", self.heights(&planes)))
    }

    fn other_level(&self) -> Option<String> {
        let planes = self.judged(Judgement::LevelDiffers);
        Some(format!(
            "At {}, peaks and shapes agree ({}), but the level differs.",
            self.heights(&planes),
            correlation(&planes)?
        ))
    }

    fn distances(&self) -> Option<String> {
        let planes = self.judged(Judgement::PeakApart);
        let distances = match planes.as_slice() {
            [] => return None,
            many if many.len() > MOST_HEIGHTS_LISTED => format!(
                "up to {} mm apart at {}",
                significant(farthest_mm(many)?, 3),
                self.heights(many)
            ),
            few => {
                let distance = |plane: &&PlaneComparison| {
                    let distance_mm = millimetres(plane.discrepancy.peak_distance_m);
                    format!("{distance_mm} mm apart at {}", self.heights(&[*plane]))
                };
                listed(&few.iter().map(distance).collect::<Vec<_>>())
            }
        };
        Some(format!("The peaks of scan and simulation are {distances}."))
    }

    fn other_maximum(&self) -> Option<String> {
        let planes = self.judged(Judgement::OtherMaximum);
        Some(format!(
            "At {}, the maps agree in shape ({}), but they have several maxima of similar height, and the largest is not \
             the same one in scan and simulation.",
            self.heights(&planes),
            correlation(&planes)?
        ))
    }

    fn shapes(&self) -> Option<String> {
        let planes = self.judged(Judgement::ShapeDiffers);
        Some(format!(
            "At {}, the peaks coincide, but the fields differ in shape ({}).",
            self.heights(&planes),
            correlation(&planes)?
        ))
    }

    fn too_few_readings(&self) -> Option<String> {
        let planes = self.judged(Judgement::Unknown);
        (!planes.is_empty()).then(|| {
            format!(
                "At {}, there are too few readings to compare the fields.",
                self.heights(&planes)
            )
        })
    }

    /// How far the peaks lie from the axis through the focus, over all heights.
    fn distances_from_axis(&self) -> Option<String> {
        let distances = |figures: fn(&PlaneComparison) -> &FieldFigures| {
            let distance_mm = |plane: &&PlaneComparison| {
                let target_m = plane.target_in_scan_m?;
                let peak_m = figures(plane).peak_position_m;
                let distance_mm = peak_distance_m(peak_m, (target_m.x, target_m.y)).value * 1e3;
                distance_mm.is_finite().then_some(distance_mm)
            };
            let all: Vec<f64> = self.planes.iter().filter_map(distance_mm).collect();
            let least = all.iter().copied().reduce(f64::min).filter(|_| all.len() > 1)?;
            let most = all.iter().copied().reduce(f64::max)?;
            Some(format!("{} to {} mm", fixed(least, 1), fixed(most, 1)))
        };
        Some(format!(
            "Over all heights, the peak lies {} from the vertical axis through the focus in the scan, and {} in the simulation.",
            distances(|plane| &plane.scan)?,
            distances(|plane| &plane.simulation)?
        ))
    }

    fn focal_radius(&self) -> Option<String> {
        let plane = self.planes.iter().find(|plane| self.is_focal(plane))?;
        let radius =
            |figures: &FieldFigures| Some(millimetres(figures.focal_radius.as_ref()?.radius_m?));
        Some(format!(
            "At the focal height, the focal radius is {} mm in the scan and {} mm in the simulation.",
            radius(&plane.scan)?,
            radius(&plane.simulation)?
        ))
    }

    /// The range of the scan's level relative to the simulation, with the one gain of the registration.
    fn levels(&self) -> Option<String> {
        let ratio = |plane: &PlaneComparison| plane.agreement.gain_ratio;
        let known = || self.planes.iter().filter(|plane| ratio(plane).is_finite());
        let loudest = known().max_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
        let quietest = known().min_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
        if ratio(loudest) - ratio(quietest) < LEVEL_TOLERANCE {
            return None;
        }
        let level = |plane: &PlaneComparison| {
            let height = height_mm(plane.z_m);
            format!("{} times that of the simulation at {height} mm", fixed(ratio(plane), 2))
        };
        Some(format!(
            "With one gain for all heights, the level of the scan is {} and {}.",
            level(quietest),
            level(loudest)
        ))
    }
}

/// How the scan was registered, where a gain and a small shift did not suffice.
fn registration(registration: &Registration) -> Option<String> {
    let full_pose = registration.chosen == Registering::Pose;
    full_pose.then(|| format!("Registration: {}", sentence(&registration.why)))
}

/// Combinations of parameters that the registration does not determine.
fn undetermined(registration: &Registration) -> impl Iterator<Item = String> {
    registration.undetermined.iter().map(|combination| {
        let parameters: Vec<String> =
            combination.parameters.iter().map(|name| parameter(name)).collect();
        format!("These readings do not determine {} separately.", listed(&parameters))
    })
}

/// `correlation 0.912`, of several planes the least.
fn correlation(planes: &[&PlaneComparison]) -> Option<String> {
    let least = if planes.len() > 1 { "at least " } else { "" };
    Some(format!("correlation {least}{}", fixed(least_correlation(planes)?, 3)))
}

fn least_correlation(planes: &[&PlaneComparison]) -> Option<f64> {
    planes.iter().map(|plane| plane.agreement.correlation).reduce(f64::min)
}

/// The largest distance between the peaks, millimetres.
fn farthest_mm(planes: &[&PlaneComparison]) -> Option<f64> {
    let apart_mm = planes.iter().map(|plane| plane.discrepancy.peak_distance_m.value * 1e3);
    apart_mm.filter(|apart| apart.is_finite()).reduce(f64::max)
}

fn overall(agreement: &Agreement) -> String {
    format!(
        "Over all {} readings, the correlation is {} and the residual is {} of the scan's rms.",
        agreement.points,
        fixed(agreement.correlation, 3),
        percent(agreement.residual_rms_ratio)
    )
}
