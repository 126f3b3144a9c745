//! Readings of two records taken at the same place under the same drive, two by two.

use std::collections::HashMap;
use std::f64::consts::TAU;

use fieldgap_acoustics::{Excitation, Simulation, Simulator, Vec3, delays_s};
use fieldgap_comparison::Incomparable;
use fieldgap_records::{RecordedScan, SAME_POINT_MM};

use crate::change::NoChangeDiagnosis;
use crate::limits::FEWEST_PAIRS;
use crate::model::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use crate::preparation::Prepared;

/// Readings of A and of B: the same number for each drive, and in the same order.
pub(crate) struct Pairs {
    /// One scan: the readings of A.
    pub a: Observations,
    /// One scan: the readings of B, each as believed by the set-up of A and driven as B was.
    pub b: Observations,
    /// Readings of B without a partner in A.
    pub left_out: usize,
}

impl Pairs {
    /// Pairs each reading of B with a reading of A at its place that has no partner yet. Then each pair has noise of its own: where a
    /// place was read several times, the mean of A would be common to all its readings in B.
    pub fn of(
        a: &RecordedScan,
        b: &RecordedScan,
        simulator: Simulator,
        prepared: &Prepared,
    ) -> Result<Self, NoChangeDiagnosis> {
        let Observations { scans } = &prepared.observations;
        let [of_a, of_b] = &scans[..] else {
            let name = if scans.is_empty() { &a.setup.name } else { &b.setup.name };
            return Err(Incomparable::NothingDriven(name.clone()).into());
        };
        let same_emission = a.setup.medium == b.setup.medium && a.setup.array == b.setup.array;
        let (mut drives_a, mut drives_b, mut left_out) = (Vec::new(), Vec::new(), 0);
        for drive_b in &of_b.drives {
            let emitted = b.setup.foci.get(drive_b.focus);
            let same = |drive: &&ObservedDrive| a.setup.foci.get(drive.focus) == emitted;
            let Some(drive_a) = of_a.drives.iter().find(same) else {
                left_out += drive_b.readings.len();
                continue;
            };
            let mut free = FreePlaces::of(&drive_a.visits);
            let partners: Vec<Option<usize>> =
                drive_b.visits.iter().map(|visit| free.take(visit.at_m)).collect();
            let of_b: Vec<usize> = (0..partners.len()).filter(|&n| partners[n].is_some()).collect();
            let of_a: Vec<usize> = partners.iter().copied().flatten().collect();
            left_out += partners.len() - of_b.len();
            if of_b.is_empty() {
                continue;
            }
            let emitted = b.setup.simulation(simulator, drive_b.focus).filter(|_| !same_emission);
            let believed = match emitted {
                Some(emitted) => as_emitted(&drive_a.believed, &emitted),
                None => drive_a.believed.clone(),
            };
            drives_a.push(some_of(drive_a, &of_a));
            drives_b.push(ObservedDrive { believed, ..some_of(drive_b, &of_b) });
        }
        let pairs: usize = drives_b.iter().map(|drive| drive.readings.len()).sum();
        if pairs < FEWEST_PAIRS {
            return Err(NoChangeDiagnosis::TooFewCommon {
                a: a.setup.name.clone(),
                b: b.setup.name.clone(),
                pairs,
            });
        }
        let of = |scan: &ObservedScan, drives| Observations {
            scans: vec![ObservedScan { drives, ..scan.clone() }],
        };
        Ok(Self { a: of(of_a, drives_a), b: of(of_b, drives_b), left_out })
    }

    /// About `count` of the pairs, spread evenly.
    pub fn thinned(self, count: usize) -> Self {
        let thinned = self.b.thinned(count);
        let kept: Vec<Vec<usize>> = self.b.scans[0]
            .drives
            .iter()
            .map(|drive| {
                let of = thinned.scans[0].drives.iter().find(|kept| kept.focus == drive.focus);
                let numbers: Vec<usize> =
                    of.iter().flat_map(|kept| &kept.visits).map(|visit| visit.number).collect();
                (0..drive.visits.len())
                    .filter(|&n| numbers.binary_search(&drive.visits[n].number).is_ok())
                    .collect()
            })
            .collect();
        let mut a = self.a;
        for (drive, kept) in a.scans[0].drives.iter_mut().zip(&kept) {
            *drive = some_of(drive, kept);
        }
        a.scans[0].drives.retain(|drive| !drive.readings.is_empty());
        Self { a, b: thinned, left_out: self.left_out }
    }
}

/// The believed set-up of A, driven with the phases that B emitted: a set-up computes its delays for its own air.
fn as_emitted(believed: &Simulation, b: &Simulation) -> Simulation {
    let delays_s = delays_s(&b.excitation, &b.array, &b.medium, b.frequency_hz);
    let phases_rad = delays_s.into_iter().map(|delay_s| TAU * believed.frequency_hz * delay_s);
    Simulation { excitation: Excitation::Phases(phases_rad.collect()), ..believed.clone() }
}

/// Some readings of a drive, in this order.
fn some_of(drive: &ObservedDrive, numbers: &[usize]) -> ObservedDrive {
    let take = |values: &[f64]| numbers.iter().filter_map(|&n| values.get(n).copied()).collect();
    ObservedDrive {
        focus: drive.focus,
        number: drive.number,
        believed: drive.believed.clone(),
        visits: numbers.iter().map(|&n| drive.visits[n]).collect(),
        readings: take(&drive.readings),
        stabilised: take(&drive.stabilised),
        expected: take(&drive.expected),
        phases_rad: take(&drive.phases_rad),
        believed_rad: take(&drive.believed_rad),
    }
}

/// Readings of A by place, each to be taken once.
struct FreePlaces<'v> {
    visits: &'v [Visit],
    cells: HashMap<[i64; 3], Vec<usize>>,
}

fn cell(at_m: Vec3) -> [i64; 3] {
    at_m.map(|m| (m * 1e3 / SAME_POINT_MM).floor() as i64).into()
}

impl<'v> FreePlaces<'v> {
    fn of(visits: &'v [Visit]) -> Self {
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (n, visit) in visits.iter().enumerate() {
            cells.entry(cell(visit.at_m)).or_default().push(n);
        }
        Self { visits, cells }
    }

    /// The nearest free reading within the tolerance along each axis; of equally near ones the first.
    fn take(&mut self, at_m: Vec3) -> Option<usize> {
        let [x, y, z] = cell(at_m);
        let cells = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        let apart = |n: usize| (self.visits[n].at_m - at_m).amax() * 1e3;
        let nearest = cells
            .filter_map(|at| Some((at, self.cells.get(&at)?)))
            .flat_map(|(at, numbers)| numbers.iter().map(move |&n| (at, n)))
            .filter(|(_, n)| apart(*n) <= SAME_POINT_MM)
            .min_by(|(_, one), (_, other)| {
                apart(*one).total_cmp(&apart(*other)).then(one.cmp(other))
            });
        let (at, number) = nearest?;
        self.cells.get_mut(&at)?.retain(|&n| n != number);
        Some(number)
    }
}
