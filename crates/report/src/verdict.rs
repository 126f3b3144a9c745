//! What a comparison comes to, in plain words.

use super::judgement::{Judgement, drives, focal_height_m, judge};
use super::peak_distance::peak_distance_m;
use super::words::{listed, parameter, sentence};
use fieldgap_comparison::{
    Agreement, Comparison, FieldFigures, PlaneComparison, Registering, Registration,
};
use fieldgap_text::{fixed, height_mm, millimetres, percent, significant};

/// Levels that differ from the simulation's by less than this are not worth a sentence.
const LEVEL_TOLERANCE: f64 = 0.1;
/// More heights than these are given as a range.
const MOST_HEIGHTS_LISTED: usize = 8;

/// What a comparison comes to, sentence by sentence.
pub(super) fn sentences(comparison: &Comparison) -> Vec<String> {
    let drives = drives(comparison);
    let mut sentences = Vec::from_iter(registration(&comparison.registration));
    for &number in &drives {
        let about = if drives.len() > 1 { format!("Drive {number}: ") } else { String::new() };
        let drive = Drive::new(comparison, number);
        sentences.extend(drive.sentences().map(|sentence| format!("{about}{sentence}")));
    }
    sentences.push(overall(&comparison.overall));
    sentences.extend(left_open(&comparison.registration));
    sentences
}

/// Which of several simulators comes closest; `None` for a single one.
pub(super) fn closest(comparisons: &[Comparison]) -> Option<String> {
    let mut ranked: Vec<&Comparison> =
        comparisons.iter().filter(|c| c.overall.residual_rms_ratio.is_finite()).collect();
    ranked.sort_by(|a, b| a.overall.residual_rms_ratio.total_cmp(&b.overall.residual_rms_ratio));
    let (best, others) = ranked.split_first()?;
    let left = |c: &Comparison| percent(c.overall.residual_rms_ratio);
    let others: Vec<String> =
        others.iter().map(|other| format!("{} for {}", left(other), other.simulator)).collect();
    (!others.is_empty()).then(|| {
        format!(
            "Of the simulators, {} comes closest: its residual is {} of the scan's rms, against {}.",
            best.simulator,
            left(best),
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
            self.agreeing(),
            self.apart(),
            self.other_maximum(),
            self.shapes(),
            self.unknown(),
            self.wandering(),
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

    /// `At the focal height, 100 mm,` or `At 50, 100 (the focal height) and 150 mm`.
    fn at(&self, planes: &[&PlaneComparison]) -> String {
        if let [plane] = planes
            && self.is_focal(plane)
        {
            return format!("At the focal height, {} mm,", height_mm(plane.z_m));
        }
        if let [first, .., last] = planes
            && planes.len() > MOST_HEIGHTS_LISTED
        {
            let (from, to) = (height_mm(first.z_m), height_mm(last.z_m));
            let focal = planes.iter().find(|plane| self.is_focal(plane));
            let focal = focal.map_or_else(String::new, |plane| {
                format!(", {} (the focal height) among them,", height_mm(plane.z_m))
            });
            return format!("At {} heights from {from} to {to} mm{focal}", planes.len());
        }
        let heights: Vec<String> = planes
            .iter()
            .map(|plane| {
                let height = height_mm(plane.z_m);
                if self.is_focal(plane) { format!("{height} (the focal height)") } else { height }
            })
            .collect();
        format!("At {} mm", listed(&heights))
    }

    fn agreeing(&self) -> Option<String> {
        let planes = self.judged(Judgement::Agrees);
        let correlation = least_correlation(&planes)?;
        let figures = match planes.as_slice() {
            [plane] => format!(
                "their peaks stand {} mm apart and their maps correlate at {}",
                millimetres(plane.discrepancy.peak_distance_m),
                fixed(correlation, 3)
            ),
            _ => format!(
                "their peaks stand at most {} mm apart and their maps correlate at {} or better",
                significant(farthest_mm(&planes)?, 2),
                fixed(correlation, 3)
            ),
        };
        Some(format!("{} scan and simulation agree: {figures}.", self.at(&planes)))
    }

    fn apart(&self) -> Option<String> {
        let planes = self.judged(Judgement::PeakApart);
        let (first, others) = planes.split_first()?;
        if planes.len() > MOST_HEIGHTS_LISTED {
            return Some(format!(
                "{} the scanned peak lies up to {} mm from the simulated one.",
                self.at(&planes),
                significant(farthest_mm(&planes)?, 3)
            ));
        }
        let distance = |plane: &PlaneComparison| millimetres(plane.discrepancy.peak_distance_m);
        let mut distances = vec![format!(
            "{} the scanned peak lies {} mm from the simulated one",
            self.at(&[*first]),
            distance(first)
        )];
        distances.extend(
            others
                .iter()
                .map(|p| format!("at {} mm it lies {} mm away", height_mm(p.z_m), distance(p))),
        );
        Some(format!("{}.", listed(&distances)))
    }

    fn other_maximum(&self) -> Option<String> {
        let planes = self.judged(Judgement::OtherMaximum);
        Some(format!(
            "{} the maps agree in shape (correlation {}{}), but of several maxima of similar height scan and simulation \
             have different ones as the largest.",
            self.at(&planes),
            fixed(least_correlation(&planes)?, 3),
            if planes.len() > 1 { " or better" } else { "" }
        ))
    }

    fn shapes(&self) -> Option<String> {
        let planes = self.judged(Judgement::ShapeDiffers);
        Some(format!(
            "{} the peaks stand at the same place, but the fields differ in shape: correlation {}{}.",
            self.at(&planes),
            fixed(least_correlation(&planes)?, 3),
            if planes.len() > 1 { " at worst" } else { "" }
        ))
    }

    fn unknown(&self) -> Option<String> {
        let planes = self.judged(Judgement::Unknown);
        (!planes.is_empty()).then(|| {
            format!("{} there are too few readings to compare the fields.", self.at(&planes))
        })
    }

    /// Where the peaks go with the height, against the axis through the focus.
    fn wandering(&self) -> Option<String> {
        let distances = |figures: fn(&PlaneComparison) -> &FieldFigures| {
            let far = |plane: &&PlaneComparison| {
                let target_m = plane.target_in_scan_m?;
                let peak_m = figures(plane).peak_position_m;
                let far_mm = peak_distance_m(peak_m, (target_m.x, target_m.y)).value * 1e3;
                far_mm.is_finite().then_some(far_mm)
            };
            let all: Vec<f64> = self.planes.iter().filter_map(far).collect();
            let least = all.iter().copied().reduce(f64::min).filter(|_| all.len() > 1)?;
            let most = all.iter().copied().reduce(f64::max)?;
            Some(format!("{} to {} mm", fixed(least, 1), fixed(most, 1)))
        };
        Some(format!(
            "From height to height the scanned peak stands {} from the axis through the focus, the simulated one {}.",
            distances(|plane| &plane.scan)?,
            distances(|plane| &plane.simulation)?
        ))
    }

    fn focal_radius(&self) -> Option<String> {
        let plane = self.planes.iter().find(|plane| self.is_focal(plane))?;
        let radius =
            |figures: &FieldFigures| Some(millimetres(figures.focal_radius.as_ref()?.radius_m?));
        Some(format!(
            "At the focal height the focal radius is {} mm in the scan and {} mm in the simulation.",
            radius(&plane.scan)?,
            radius(&plane.simulation)?
        ))
    }

    /// Where the scan is louder or quieter than the simulation, at the one gain of the registration.
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
            format!("{} times the simulation's at {height} mm", fixed(ratio(plane), 2))
        };
        Some(format!(
            "With one gain for all heights, the scan's level runs from {} to {}.",
            level(quietest),
            level(loudest)
        ))
    }
}

/// How scan and simulation were brought together, where it took more than a gain and a small shift.
fn registration(registration: &Registration) -> Option<String> {
    let moved = registration.chosen == Registering::Pose;
    moved.then(|| format!("Registration: {}", sentence(&registration.why)))
}

/// What the registration leaves open.
fn left_open(registration: &Registration) -> impl Iterator<Item = String> {
    registration.undetermined.iter().map(|combination| {
        let parameters: Vec<String> =
            combination.parameters.iter().map(|name| parameter(name)).collect();
        format!("These readings cannot tell {} apart.", listed(&parameters))
    })
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
        "Over all {} readings the correlation is {} and the residual {} of the scan's rms.",
        agreement.points,
        fixed(agreement.correlation, 3),
        percent(agreement.residual_rms_ratio)
    )
}
