//! The input of a diagnosis: the readings of all scans in the array's coordinates, and the set-up as believed.

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{
    Incomparable, Pose, Registering, Registration, USUAL_PROPORTIONAL_NOISE, register_scan,
    register_scan_by_amplitudes,
};
use fieldgap_records::RecordedScan;

use crate::effects::crosstalk::neighbours;
use crate::effects::stated::stated_uncertainty;
use crate::limits::{ALIKE, UNLIKE};
use crate::model::effect::Context;
use crate::model::observations::{Observations, ObservedScan};

/// The input of a diagnosis.
pub(crate) struct Prepared {
    pub simulator: Simulator,
    pub observations: Observations,
    pub context: Context,
    pub registrations: Vec<Registration>,
}

impl Prepared {
    /// Of scans of one rig; `simulator` as for [`diagnose`].
    pub fn of(
        scans: &[RecordedScan],
        simulator: Option<Simulator>,
        with_phases: bool,
    ) -> Result<Self, Incomparable> {
        let stated = |scan: &RecordedScan| scan.setup.uncertainty;
        if let Some(other) = scans.iter().find(|scan| stated(scan) != stated(&scans[0])) {
            let [one, other] = [&scans[0], other].map(|scan| scan.setup.name.clone());
            return Err(Incomparable::OtherUncertainty { one, other });
        }
        Self::registered(scans, simulator, with_phases, |scan, simulator| {
            let registration = register_as(with_phases)(scan, simulator, Registering::Auto)?;
            let pose = match is_in_other_coordinates(&registration) {
                true => registration.pose(),
                false => Pose::default(),
            };
            Ok((registration, pose))
        })
    }

    /// Of scans that lie in the coordinates of the first: another pose of a later one would be a change to be found.
    pub fn of_one_pose(
        scans: &[RecordedScan],
        simulator: Option<Simulator>,
        with_phases: bool,
    ) -> Result<Self, Incomparable> {
        let mut pose = None;
        Self::registered(scans, simulator, with_phases, |scan, simulator| {
            let requested = if pose.is_none() { Registering::Auto } else { Registering::None };
            let registration = register_as(with_phases)(scan, simulator, requested)?;
            let pose = *pose.get_or_insert_with(|| match is_in_other_coordinates(&registration) {
                true => registration.pose(),
                false => Pose::default(),
            });
            Ok((registration, pose))
        })
    }

    fn registered(
        scans: &[RecordedScan],
        simulator: Option<Simulator>,
        with_phases: bool,
        mut register: impl FnMut(&RecordedScan, Simulator) -> Result<(Registration, Pose), Incomparable>,
    ) -> Result<Self, Incomparable> {
        let first = scans.first().ok_or(Incomparable::NoScan)?;
        if let Some(other) =
            scans.iter().find(|s| s.setup.array.array() != first.setup.array.array())
        {
            let [one, other] = [first, other].map(|scan| scan.setup.name.clone());
            return Err(Incomparable::OtherArray { one, other });
        }
        let simulator = simulator.unwrap_or(first.setup.simulator);
        let mut registrations = Vec::new();
        let mut poses = Vec::new();
        for scan in scans {
            let (registration, pose) = register(scan, simulator)?;
            registrations.push(registration);
            poses.push(pose);
        }
        let observations = Observations::of(scans, simulator, &poses, with_phases);
        let context = context(&observations, scans);
        Ok(Self { simulator, observations, context, registrations })
    }
}

type Register = fn(&RecordedScan, Simulator, Registering) -> Result<Registration, Incomparable>;

fn register_as(with_phases: bool) -> Register {
    if with_phases { register_scan } else { register_scan_by_amplitudes }
}

/// Whether a scan has coordinates of its own; only then a pose is applied first. A scan that resembles the believed field is in the lab's
/// coordinates, and a pose would absorb the effects to be found.
fn is_in_other_coordinates(registration: &Registration) -> bool {
    let correlation = |of: &[Registering]| {
        let tried = registration.tried.iter().filter(|one| of.contains(&one.registering));
        tried.map(|one| one.correlation).fold(f64::NEG_INFINITY, f64::max)
    };
    registration.chosen == Registering::Pose
        && correlation(&[Registering::GainOnly, Registering::GainAndShift]) < UNLIKE
        && correlation(&[Registering::Pose]) > ALIKE
}

fn context(observations: &Observations, scans: &[RecordedScan]) -> Context {
    let drives = || observations.scans.iter().flat_map(|scan| &scan.drives);
    let highest = drives().flat_map(|drive| &drive.visits).map(|visit| visit.at_m.z);
    let dark = observations.scans.iter().filter_map(ObservedScan::dark_readings);
    let floors = dark.map(|dark| dark.noise(USUAL_PROPORTIONAL_NOISE).floor);
    Context {
        believed: observations.first().believed.clone(),
        neighbours: neighbours(observations.first().believed.array.elements()).into(),
        largest_reading: observations.readings().into_iter().fold(0.0, f64::max),
        unit: scans[0].setup.unit.clone(),
        highest_m: highest.fold(0.0, f64::max),
        lasts_s: observations.scans[0].lasts_s(),
        dark_floor: floors.fold(0.0, f64::max),
        common: None,
        stated: stated_uncertainty(&scans[0].setup, observations.elements()),
        tried: None,
    }
}
