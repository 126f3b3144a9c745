//! The readings of a diagnosis, each with position, motion and time.

use fieldgap_acoustics::{Simulation, Simulator, Vec3, golden_section};
use fieldgap_comparison::{Pose, averaged};
use fieldgap_records::RecordedScan;

use crate::statistics::noise_scale::NoiseScale;
use crate::statistics::scatter::Scatter;

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
    /// The dark readings.
    pub dark: Vec<f64>,
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
    /// Other possible arrivals at visits that were not reached in even steps along x: the first of a row, one after a jump. There play may or
    /// may not have been taken up, and the speed is not the mean speed.
    pub otherwise: Vec<(usize, Visit)>,
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
    /// Its mean velocity since the reading before, m/s.
    pub velocity_m_s: Vec3,
    /// Its last direction of travel along x: 1, -1, or 0 before it moved.
    pub x_direction: f64,
    /// Whether it arrived in even steps along x.
    pub even: bool,
    /// How far through the scan, 0 at the first driven reading to 1 at the last.
    pub progress: f64,
}

impl Observations {
    /// The driven readings of scans, simulated by `simulator`, their coordinates laid on the array's by a pose each.
    pub fn of(scans: &[RecordedScan], simulator: Simulator, poses: &[Pose]) -> Self {
        let mut numbers = 0..;
        let scans = scans
            .iter()
            .zip(poses)
            .map(|(scan, pose)| {
                let visits = visits(scan, pose);
                let drives = (0..scan.setup.foci.len())
                    .filter_map(|focus| {
                        let believed = scan.setup.simulation(simulator, focus)?;
                        let (visits, readings): (Vec<Visit>, Vec<f64>) = visits
                            .iter()
                            .filter(|(of, _, _)| *of == focus)
                            .map(|(_, visit, reading)| (*visit, *reading))
                            .unzip();
                        let (stabilised, otherwise) = (Vec::new(), otherwise(&visits));
                        let drive = ObservedDrive {
                            focus,
                            number: numbers.next().unwrap_or(0),
                            believed,
                            visits,
                            readings,
                            stabilised,
                            otherwise,
                        };
                        (!drive.readings.is_empty()).then_some(drive)
                    })
                    .collect();
                let dark = scan.silent().map(|sample| sample.reading).collect();
                ObservedScan {
                    drives,
                    scatter: Scatter::default(),
                    averaged: averaged(scan),
                    scale: NoiseScale::new(0.0, 1.0, 1.0),
                    dark,
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

    /// Elements of the array; of the first scan, as all are of one rig.
    pub fn elements(&self) -> usize {
        self.first().believed.array.len()
    }

    /// Whether the repeats of a scan show a fluctuating field.
    pub fn are_fluctuating(&self) -> bool {
        self.scans.iter().any(|scan| scan.scatter.fluctuation > 0.0)
    }

    /// The first drive.
    pub fn first(&self) -> &ObservedDrive {
        &self.scans[0].drives[0]
    }

    /// Only the readings for which `kept` holds, given scan and number.
    pub fn only(&self, kept: impl Fn(usize, &Visit) -> bool) -> Self {
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
                drive.otherwise = otherwise(&drive.visits);
            }
            scan.drives.retain(|drive| !drive.readings.is_empty());
        }
        scans.retain(|scan| !scan.drives.is_empty());
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

impl ObservedScan {
    /// Sets the scatter of the readings.
    pub fn set_scatter(&mut self, scatter: Scatter) {
        self.scale = NoiseScale::new(scatter.share, scatter.additive, self.averaged);
        for drive in &mut self.drives {
            drive.stabilised =
                drive.readings.iter().map(|reading| self.scale.of(*reading)).collect();
        }
        self.scatter = scatter;
    }

    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.drives.iter().map(|drive| drive.readings.len()).sum()
    }
}

/// For each visit not reached in even steps, the same visit with an even arrival from either side.
fn otherwise(visits: &[Visit]) -> Vec<(usize, Visit)> {
    let mut speeds: Vec<f64> =
        visits.iter().filter(|visit| visit.even).map(|visit| visit.velocity_m_s.x.abs()).collect();
    speeds.sort_by(f64::total_cmp);
    let Some(&speed_m_s) = speeds.get(speeds.len() / 2) else { return Vec::new() };
    let uneven = visits.iter().enumerate().filter(|(_, visit)| !visit.even);
    uneven
        .flat_map(|(index, visit)| {
            [1.0, -1.0].map(|x_direction| {
                let velocity_m_s = Vec3::x() * x_direction * speed_m_s;
                (index, Visit { x_direction, velocity_m_s, ..*visit })
            })
        })
        .collect()
}

/// Drive, visit and reading of each driven sample.
fn visits(scan: &RecordedScan, pose: &Pose) -> Vec<(usize, Visit, f64)> {
    let driven: Vec<_> = scan.samples.iter().filter(|sample| sample.focus.is_some()).collect();
    let (first_s, last_s) = match (driven.first(), driven.last()) {
        (Some(first), Some(last)) => (first.time_s, last.time_s),
        _ => return Vec::new(),
    };
    let length_s = (last_s - first_s).max(f64::MIN_POSITIVE);
    let mut x_direction = 0.0;
    let steps_m = driven.windows(2).map(|pair| (pair[1].position_mm - pair[0].position_mm) / 1e3);
    let mut along_x: Vec<f64> = steps_m
        .filter(|step| step.x != 0.0 && step.yz().norm() < 0.05 * step.x.abs())
        .map(|step| step.x.abs())
        .collect();
    along_x.sort_by(f64::total_cmp);
    let usual_m = along_x.get(along_x.len() / 2).copied().unwrap_or(f64::NAN);
    (0..driven.len())
        .map(|number| {
            let sample = driven[number];
            let at_m = pose.to_array(&sample.position_m());
            let mut velocity_m_s = Vec3::zeros();
            let mut even = false;
            if let Some(before) = number.checked_sub(1).map(|before| driven[before]) {
                let moved_m = at_m - pose.to_array(&before.position_m());
                let took_s = sample.time_s - before.time_s;
                if took_s > 0.0 {
                    velocity_m_s = moved_m / took_s;
                }
                even = (moved_m.x.abs() - usual_m).abs() < 0.2 * usual_m
                    && moved_m.yz().norm() < 0.05 * usual_m;
                if moved_m.x != 0.0 {
                    x_direction = moved_m.x.signum();
                }
            }
            let progress = (sample.time_s - first_s) / length_s;
            let visit = Visit { number, at_m, velocity_m_s, x_direction, even, progress };
            (sample.focus.expect("driven"), visit, sample.reading)
        })
        .collect()
}
