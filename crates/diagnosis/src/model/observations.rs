//! The readings of a diagnosis, each with position, motion and time.

use fieldgap_acoustics::{Simulation, Simulator, Vec3, golden_section};
use fieldgap_comparison::{
    DarkReadings, PlaneNoise, Pose, WithinReadings, averaged, averaged_magnitudes, has_phases,
    within_readings,
};
use fieldgap_records::{PhaseReference, RecordedSample, RecordedScan};
use std::sync::Arc;

use crate::limits::{DRIVES_FOR_EACH_ELEMENT, MOST_ELEMENTS};
use crate::model::motion::{Approach, Motion, approaches};
use crate::model::phases::{PhaseMeaning, noise_and_moves_rad};
use crate::statistics::noise_scale::NoiseScale;
use crate::statistics::phase_noise::PhaseNoise;
use crate::statistics::scatter::Scatter;
use crate::statistics::slow_level::{Followed, SlowLevel};

/// The readings of one or several scans of one rig.
#[derive(Debug, Clone)]
pub(crate) struct Observations {
    /// Scan by scan.
    pub scans: Vec<ObservedScan>,
}

/// The readings of one scan.
#[derive(Debug, Clone)]
pub(crate) struct ObservedScan {
    /// Drive by drive.
    pub drives: Vec<ObservedDrive>,
    /// How readings scatter.
    pub scatter: Scatter,
    /// How many magnitudes each reading is the mean of.
    pub averaged: f64,
    /// The scale on which they scatter by one.
    pub scale: NoiseScale,
    /// The slow noise of their level; `None` where none is seen.
    pub slow_level: Option<Arc<SlowLevel>>,
    /// The dark readings.
    pub dark: Vec<f64>,
    /// What the scatter of the magnitudes within its readings tells.
    pub within: Option<WithinReadings>,
    /// The noise that its planes show without a model, from all of its readings; `None` where none is dense enough.
    pub map_noise: Option<PlaneNoise>,
    /// What the phases of the readings mean; `None` where there are none, or they are left out.
    pub phase: Option<PhaseMeaning>,
    /// Readings that were left out because they stand out from those beside them.
    pub outliers: usize,
}

/// The readings of one drive.
#[derive(Debug, Clone)]
pub(crate) struct ObservedDrive {
    /// Its number in the record.
    pub focus: usize,
    /// Its number among the drives of all scans.
    pub number: usize,
    /// The set-up as believed.
    pub believed: Simulation,
    /// Where and when.
    pub visits: Vec<Visit>,
    /// What was read.
    pub readings: Vec<f64>,
    /// The same on the scale on which it scatters by one.
    pub stabilised: Vec<f64>,
    /// What was expected by the fit that told the slow noise of the level: a reading itself has its own noise. Empty where none was told.
    pub expected: Vec<f64>,
    /// Phases of the readings in the convention exp(-iωt), rad, not a number where one was lost; empty where the scan has none.
    pub phases_rad: Vec<f64>,
    /// Phases of the set-up as believed at the same visits, rad.
    pub believed_rad: Vec<f64>,
}

/// The number of a drive that no record has.
pub(crate) const NOT_RECORDED: usize = usize::MAX;

/// The set-up of a drive as believed, and which drive it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Driven<'b> {
    pub believed: &'b Simulation,
    /// Its number among the drives of all scans.
    pub number: usize,
}

impl ObservedDrive {
    /// The set-up, and which drive it is.
    pub fn driven(&self) -> Driven<'_> {
        Driven { believed: &self.believed, number: self.number }
    }
}

/// A set-up with one drive.
impl<'b> From<&'b Simulation> for Driven<'b> {
    fn from(believed: &'b Simulation) -> Self {
        Self { believed, number: 0 }
    }
}

/// The robot at the moment of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Visit {
    /// Number of the reading among all driven readings of its scan, in the order they were taken.
    pub number: usize,
    /// Reported position, array's frame, m.
    pub at_m: Vec3,
    /// How the robot moved before it; outside of a row after a run-up or at rest.
    pub motion: Motion,
    /// Outside of a row: the motion if it came straight from the reading before, or from the other side where the record begins.
    pub otherwise: Option<Motion>,
    /// Whether it is of the first place of the record along x.
    pub begins: bool,
    /// Time since the first driven reading of its scan, s.
    pub time_s: f64,
    /// How far through the scan, 0 at the first driven reading to 1 at the last.
    pub progress: f64,
    /// Variance of the noise of the reading over that of a usual reading of its scan, one or more: it may average fewer samples.
    pub variance: f64,
}

impl Observations {
    /// The driven readings of scans, simulated by `simulator`, their coordinates laid on the array's by a pose each.
    pub fn of(
        scans: &[RecordedScan],
        simulator: Simulator,
        poses: &[Pose],
        with_phases: bool,
    ) -> Self {
        let mut numbers = 0..;
        let scans = scans
            .iter()
            .zip(poses)
            .map(|(scan, pose)| {
                let visits = visits(scan, pose);
                let phase = scan.setup.phase.filter(|_| with_phases && has_phases(scan));
                let drives = (0..scan.setup.foci.len())
                    .filter_map(|focus| {
                        let believed = scan.setup.simulation(simulator, focus)?;
                        let of_focus =
                            visits.iter().filter(|(sample, _)| sample.focus == Some(focus));
                        let (samples, visits): (Vec<&RecordedSample>, Vec<Visit>) =
                            of_focus.map(|(sample, visit)| (*sample, *visit)).unzip();
                        let (phases_rad, believed_rad) =
                            phase.map_or_else(Default::default, |phase| {
                                let places: Vec<Vec3> =
                                    visits.iter().map(|visit| visit.at_m).collect();
                                let field = believed.field(&places);
                                let measured = samples.iter().map(|sample| {
                                    sample.phase_rad.map_or(f64::NAN, |phase_rad| {
                                        phase.convention.turned(phase_rad)
                                    })
                                });
                                (
                                    measured.collect(),
                                    field.iter().map(|pressure| pressure.arg()).collect(),
                                )
                            });
                        let drive = ObservedDrive {
                            focus,
                            number: numbers.next().unwrap_or(0),
                            believed,
                            visits,
                            readings: samples.iter().map(|sample| sample.reading).collect(),
                            stabilised: Vec::new(),
                            expected: Vec::new(),
                            phases_rad,
                            believed_rad,
                        };
                        (!drive.readings.is_empty()).then_some(drive)
                    })
                    .collect();
                let dark = scan.silent().map(|sample| sample.reading).collect();
                ObservedScan {
                    drives,
                    scatter: Scatter::default(),
                    averaged: averaged_magnitudes(scan),
                    scale: NoiseScale::new(0.0, 1.0, 1.0),
                    slow_level: None,
                    dark,
                    within: within_readings(scan),
                    map_noise: PlaneNoise::of_scan(scan),
                    outliers: 0,
                    phase: phase.map(|phase| PhaseMeaning {
                        noise: PhaseNoise::default(),
                        drift_u_rad: phase.drift_u_rad(),
                        moves_rad: phase.drift_u_rad(),
                        each_drive: phase.reference == PhaseReference::EachDrive,
                    }),
                }
            })
            .collect();
        Self { scans }
    }

    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.scans.iter().map(ObservedScan::len).sum()
    }

    /// Every reading.
    pub fn readings(&self) -> Vec<f64> {
        let drives = self.scans.iter().flat_map(|scan| &scan.drives);
        drives.flat_map(|drive| drive.readings.iter().copied()).collect()
    }

    /// Whether a scan has phases.
    pub fn have_phases(&self) -> bool {
        self.scans.iter().any(|scan| scan.phase.is_some())
    }

    /// Readings that were left out because they stand out from those beside them.
    pub fn outliers(&self) -> usize {
        self.scans.iter().map(|scan| scan.outliers).sum()
    }

    /// The same without phases.
    pub fn without_phases(&self) -> Self {
        let mut amplitudes = self.clone();
        amplitudes.scans.iter_mut().for_each(|scan| scan.phase = None);
        amplitudes
    }

    /// Elements of the array; of the first scan, as all are of one rig.
    pub fn elements(&self) -> usize {
        self.first().believed.array.len()
    }

    /// Whether the readings may tell each element from all others: those of a scan with few elements, and those of many drives.
    pub fn tell_each_element(&self) -> bool {
        let drives: usize = self.scans.iter().map(|scan| scan.drives.len()).sum();
        let elements = self.elements();
        elements <= MOST_ELEMENTS || drives as f64 >= DRIVES_FOR_EACH_ELEMENT * elements as f64
    }

    /// Whether the repeats, or the maps, of every scan tell its noise without a model.
    pub fn is_noise_told(&self) -> bool {
        let is_told = |scatter: &Scatter| scatter.is_told_by_repeats() || scatter.told_by_map;
        self.scans.iter().all(|scan| is_told(&scan.scatter))
    }

    /// Whether the repeats of a scan show a fluctuating field.
    pub fn are_fluctuating(&self) -> bool {
        self.scans.iter().any(|scan| scan.scatter.fluctuation > 0.0)
    }

    /// Whether the receiver was at enough places to tell how the robot's axes are turned and scaled: at one or two, an offset does the same.
    pub fn tell_axes(&self) -> bool {
        /// Places: three tell a turn from a shift.
        const FEWEST_PLACES: usize = 3;
        let visits = self.scans.iter().flat_map(|scan| &scan.drives).flat_map(|d| &d.visits);
        let mut places: Vec<Vec3> = Vec::new();
        for visit in visits {
            if places.iter().all(|place_m| (place_m - visit.at_m).norm() > SAME_PLACE_M) {
                places.push(visit.at_m);
            }
            if places.len() == FEWEST_PLACES {
                return true;
            }
        }
        false
    }

    /// The first drive.
    pub fn first(&self) -> &ObservedDrive {
        &self.scans[0].drives[0]
    }

    /// Only the readings for which `kept` holds, given scan and number.
    pub fn only(&self, kept: impl Fn(usize, &Visit) -> bool) -> Self {
        let mut some = self.part(kept);
        some.scans.retain(|scan| !scan.drives.is_empty());
        some
    }

    /// The same, with the scans of which nothing is left: each has its own gain and shift.
    pub fn part(&self, kept: impl Fn(usize, &Visit) -> bool) -> Self {
        let mut scans = self.scans.clone();
        for (scan_number, scan) in scans.iter_mut().enumerate() {
            for drive in &mut scan.drives {
                let indices: Vec<usize> = (0..drive.visits.len())
                    .filter(|&index| kept(scan_number, &drive.visits[index]))
                    .collect();
                drive.visits = indices.iter().map(|&index| drive.visits[index]).collect();
                // (Empty until the scatter is judged.)
                let take = |values: &[f64]| {
                    indices.iter().filter_map(|&i| values.get(i).copied()).collect()
                };
                drive.readings = take(&drive.readings);
                drive.stabilised = take(&drive.stabilised);
                drive.expected = take(&drive.expected);
                drive.phases_rad = take(&drive.phases_rad);
                drive.believed_rad = take(&drive.believed_rad);
            }
            scan.drives.retain(|drive| !drive.readings.is_empty());
            scan.slow_level = scan.followed();
        }
        Self { scans }
    }

    /// About `count` of them, spread evenly.
    pub fn thinned(&self, count: usize) -> Self {
        if count >= self.len() {
            return self.clone();
        }
        let place = |visit: &Visit| golden_section::even_fraction(visit.number);
        let drives = self.scans.iter().flat_map(|scan| &scan.drives);
        let mut places: Vec<f64> = drives.flat_map(|d| &d.visits).map(place).collect();
        let (_, last, _) = places.select_nth_unstable_by(count, f64::total_cmp);
        let last = *last;
        self.only(|_, visit| place(visit) < last)
    }
}

impl Visit {
    /// Whether the robot's way to it is known.
    pub fn is_in_row(&self) -> bool {
        self.otherwise.is_none()
    }
}

impl ObservedScan {
    /// Its dark readings; `None` if they are too few.
    pub fn dark_readings(&self) -> Option<DarkReadings> {
        Some(DarkReadings::of(&self.dark, self.averaged)?.with_scatter(self.within))
    }

    /// Sets the scatter of the readings.
    pub fn set_scatter(&mut self, scatter: Scatter) {
        self.scale = NoiseScale::new(scatter.share, scatter.additive, self.averaged);
        for drive in &mut self.drives {
            drive.stabilised =
                drive.readings.iter().map(|reading| self.scale.of(*reading)).collect();
        }
        self.scatter = scatter;
        self.slow_level = self.followed();
        self.phase = self.phase.map(|meaning| {
            let (noise, moves_rad) = noise_and_moves_rad(self, meaning);
            PhaseMeaning { noise, moves_rad, ..meaning }
        });
    }

    /// Variance of the noise of a reading of usual variance, the slow noise of its level with it.
    pub fn noise_variance(&self, reading: f64) -> f64 {
        self.scale.slope(reading).powi(-2) + (self.scatter.slow_share() * reading).powi(2)
    }

    /// The slow noise of its level along its readings.
    fn followed(&self) -> Option<Arc<SlowLevel>> {
        let noise = self.scatter.slow?;
        let drives = self.drives.iter();
        let expected = drives.flat_map(|drive| drive.visits.iter().zip(&drive.expected));
        let followed = |(number, (visit, level)): (usize, (&Visit, &f64))| Followed {
            reading: number,
            progress: visit.progress,
            slope: level * self.scale.slope(*level) / visit.variance.sqrt(),
            variance: 1.0,
        };
        let followed = expected.enumerate().map(followed).collect();
        Some(Arc::new(SlowLevel::along(noise, followed)))
    }

    /// Time from its first driven reading to the last of these, s.
    pub fn lasts_s(&self) -> f64 {
        let visits = self.drives.iter().flat_map(|drive| &drive.visits);
        visits.map(|visit| visit.time_s).fold(0.0, f64::max)
    }

    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.drives.iter().map(|drive| drive.readings.len()).sum()
    }
}

/// Places nearer to each other than this are one, m: a robot repeats so well.
pub(crate) const SAME_PLACE_M: f64 = 1e-4;

/// Variance of the noise of a reading over that of a mean of so many samples. Some more or fewer are as usual, and more than usual make no
/// reading surer: slow noise does not average out.
fn variance(sample: &RecordedSample, usual: f64) -> f64 {
    /// Ratio up to which counts are alike: samples that are lost or just outside of a window.
    const ALIKE: f64 = 1.5;
    let ratio = sample.spread.map_or(1.0, |spread| usual / f64::from(spread.count.max(1)));
    if ratio > ALIKE { ratio } else { 1.0 }
}

/// Each driven sample with its visit.
fn visits<'s>(scan: &'s RecordedScan, pose: &Pose) -> Vec<(&'s RecordedSample, Visit)> {
    let driven: Vec<_> = scan.samples.iter().filter(|sample| sample.focus.is_some()).collect();
    let (first_s, last_s) = match (driven.first(), driven.last()) {
        (Some(first), Some(last)) => (first.time_s, last.time_s),
        _ => return Vec::new(),
    };
    let usual = averaged(scan);
    let length_s = (last_s - first_s).max(f64::MIN_POSITIVE);
    let places: Vec<(f64, Vec3)> =
        driven.iter().map(|sample| (sample.time_s, pose.to_array(&sample.position_m()))).collect();
    let visit = |(number, Approach { motion, otherwise, begins }): (usize, Approach)| {
        let (time_s, at_m) = places[number];
        let progress = (time_s - first_s) / length_s;
        let variance = variance(driven[number], usual);
        let time_s = time_s - first_s;
        let visit = Visit { number, at_m, motion, otherwise, begins, time_s, progress, variance };
        (driven[number], visit)
    };
    approaches(&places).into_iter().enumerate().map(visit).collect()
}

#[cfg(test)]
mod tests {
    use fieldgap_records::Spread;

    use super::*;
    use crate::effects::testing::{Bench, nuisance};
    use crate::model::forward_model::ForwardModel;
    use fieldgap_acoustics::Excitation;

    #[test]
    fn a_reading_of_fewer_samples_has_more_noise_and_one_of_more_no_less() {
        let of = |count: Option<u32>| {
            let spread = count.map(|count| Spread { std: 0.1, count });
            variance(&RecordedSample::measured(0.0, Some(0), Vec3::zeros(), 1.0, spread), 16.0)
        };
        assert_eq!(
            [Some(16), Some(12), Some(4), Some(200), None].map(of),
            [1.0, 1.0, 4.0, 1.0, 1.0]
        );
    }

    #[test]
    fn a_residual_of_twice_the_noise_counts_half() {
        let bench = Bench::new();
        let places = vec![Vec3::new(0.0, 0.0, 0.1), Vec3::new(0.004, 0.0, 0.1)];
        let mut observations = bench.observations(&[(Excitation::Uniform, places)]);
        let drive = &mut observations.scans[0].drives[0];
        drive.stabilised.iter_mut().for_each(|reading| *reading += 3.0);
        drive.visits[1].variance = 4.0;
        let (model, nuisance) = (ForwardModel::believed(), [nuisance()]);
        let pressures = model.pressures(&observations, &nuisance);
        let scaled = model.residuals(&observations, &pressures, &nuisance).scaled;
        assert!((scaled[0] - 3.0).abs() < 1e-3 && (scaled[1] - 1.5).abs() < 1e-3, "{scaled:?}");
    }
}
