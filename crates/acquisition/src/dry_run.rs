//! The check of a plan before anything moves: can the robot reach every point, how long does it take, is there disk space.

use std::path::Path;
use std::time::Duration;

use serde::Serialize;

use super::fly::{Flight, USUAL_ACCELERATION_M_S2};
use super::itinerary::{Itinerary, Purpose, Station};
use super::rig_setup::RigSetup;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Fault;
use fieldgap_records::{Plan, PlanPart, RecordedSample, Visit, VisitKind};
use fieldgap_rig::{Feed, RobotPosition};

/// Disk space per point in `samples.csv`, the journal and the events, bytes.
const BYTES_A_ROW: u64 = 320;

/// Disk space per point in the wire logs, and the largest size of the logs, bytes.
const WIRE_BYTES_A_ROW: u64 = 4096;
const MOST_WIRE_BYTES: u64 = 512 << 20;

/// Disk space left free for other programs, bytes.
const ROOM_LEFT_FREE: u64 = 64 << 20;

/// Assumed communication time per reading, s.
const TALK_S: f64 = 0.03;

/// Assumed sampling rate of a receiver, Hz. The true rate is known when the device is open.
const USUAL_RATE_HZ: f64 = 1000.0;

/// Size and duration of a planned scan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DryRun {
    /// Readings in all.
    pub visits: usize,
    /// Of these, with the array silent.
    pub dark: usize,
    /// Of these, at the reference point.
    pub references: usize,
    /// Path length of the robot, m.
    pub way_m: f64,
    /// Estimated duration on the robot's clock, s.
    pub about_s: f64,
    /// Of this, with the array driven, s.
    pub driven_s: f64,
    /// Estimated duration of the slowest point or row, s.
    pub slowest_s: f64,
    /// Disk space of the record, bytes.
    pub bytes: u64,
}

impl DryRun {
    /// Estimated duration on the robot's clock.
    pub fn about(&self) -> Duration {
        Duration::try_from_secs_f64(self.about_s).unwrap_or(Duration::MAX)
    }
}

/// Checks a plan against a rig set-up, by the very moves that the scan will make after those in `kept`.
///
/// The robot is assumed to start where it homes, at the lower end of each axis.
///
/// # Errors
/// A [`Fault`] at the part of the plan that is not possible: a focus or point outside the robot's travel, a path through a
/// keep-out box, or a number of phases other than the number of elements.
pub(super) fn dry_run(
    plan: &Plan,
    rig_setup: &RigSetup,
    visits: &[Visit],
    kept: &[RecordedSample],
) -> Result<DryRun, Fault> {
    plan.fits_array(rig_setup.nominal_array().len())?;
    foci_within_travel(plan, rig_setup)?;
    let (envelope, frame) = (rig_setup.rig.motion.envelope(), rig_setup.rig.motion.frame());
    let reading_s = reading_s(rig_setup);
    if visits.is_empty() {
        return Err(Fault::of_file(
            plan.path(),
            "the plan names no readings: it leaves them to the rig",
            "run it with `fieldgap run`, which chooses them",
        ));
    }
    let mut from = RobotPosition::from_axes_m(envelope.travel.least_m);
    reference_within_travel(plan, rig_setup)?;
    let (mut way_m, mut about_s, mut driven_s, mut slowest_s) = (0.0, 0.0, 0.0, 0.0_f64);
    let mut go = |to_m: Vec3, part: PlanPart, feed: Feed| {
        let to = frame.to_robot(to_m);
        envelope.check_path(from, to).map_err(|path_fault| {
            let at_mm = to_m * 1e3;
            plan.fault(
                part,
                format!(
                    "the robot cannot move to ({:.2}, {:.2}, {:.2}) mm: {path_fault}",
                    at_mm.x, at_mm.y, at_mm.z
                ),
                "change the points or their order; or correct [motion] of the rig file, if it does not describe the robot",
            )
        })?;
        let distance_m = from.distance_m(to);
        way_m += distance_m;
        from = to;
        Ok(move_s(distance_m, feed.m_s()))
    };
    let feed = rig_setup.rig.motion.feed();
    let itinerary = Itinerary::of(plan, rig_setup, visits, kept);
    // A row takes its run-up and its pass.
    let mut run_up_s = 0.0;
    for Station { to_m, visit, purpose } in itinerary.stations(visits) {
        let part = visits[visit].part;
        let took_s = match purpose {
            Purpose::Approach => {
                run_up_s = go(to_m, part, feed)?;
                continue;
            }
            Purpose::Pass => {
                let flight = itinerary.flight(visits[visit].pace);
                let flight_feed = flight.map_or(feed, Flight::feed);
                std::mem::take(&mut run_up_s) + go(to_m, part, flight_feed)? + TALK_S
            }
            Purpose::Point => go(to_m, part, feed)? + reading_s,
        };
        about_s += took_s;
        if visits[visit].kind != VisitKind::Dark {
            driven_s += took_s;
        }
        slowest_s = slowest_s.max(took_s);
    }
    let checks = itinerary.checks.iter().map(|&row| &visits[row]);
    let readings: Vec<&Visit> = checks.chain(&visits[kept.len()..]).collect();
    let of_kind = |kind| readings.iter().filter(|visit| visit.kind == kind).count();
    Ok(DryRun {
        visits: readings.len(),
        dark: of_kind(VisitKind::Dark),
        references: of_kind(VisitKind::Reference),
        way_m,
        about_s,
        driven_s,
        slowest_s,
        bytes: BYTES_A_ROW * readings.len() as u64
            + (WIRE_BYTES_A_ROW * readings.len() as u64).min(MOST_WIRE_BYTES),
    })
}

fn foci_within_travel(plan: &Plan, rig_setup: &RigSetup) -> Result<(), Fault> {
    let (envelope, frame) = (rig_setup.rig.motion.envelope(), rig_setup.rig.motion.frame());
    for (number, focus) in plan.foci.iter().enumerate() {
        let Some(focus_m) = focus.excitation().focus_m() else { continue };
        let inside =
            frame.to_robot(focus_m).axes_m().into_iter().enumerate().all(|(axis, at_m)| {
                (envelope.travel.least_m[axis]..=envelope.travel.largest_m[axis]).contains(&at_m)
            });
        if !inside {
            let [least, largest] = [envelope.travel.least_m, envelope.travel.largest_m]
                .map(|corner| frame.to_array(RobotPosition::from_axes_m(corner)) * 1e3);
            return Err(plan.fault(
                PlanPart::Focus(number),
                "the focus lies outside the robot's travel, so the scan cannot reach it",
                format!(
                    "in the array's frame the robot reaches x {:.1} to {:.1}, y {:.1} to {:.1}, z {:.1} to {:.1} mm",
                    least.x, largest.x, least.y, largest.y, least.z, largest.z
                ),
            ));
        }
    }
    Ok(())
}

/// Checks a reference point that is visited at intervals only: it is not among the visits of the plan.
fn reference_within_travel(plan: &Plan, rig_setup: &RigSetup) -> Result<(), Fault> {
    let reference = &plan.reference;
    let (Some(at_mm), true) = (reference.at_mm, reference.is_given()) else { return Ok(()) };
    let (envelope, frame) = (rig_setup.rig.motion.envelope(), rig_setup.rig.motion.frame());
    envelope.check_target(frame.to_robot(at_mm / 1e3)).map_err(|fault| {
        plan.fault(
            PlanPart::Reference,
            format!("the robot cannot reach the reference point: {fault}"),
            "choose another point, or leave `at_mm` out to use the position of the focus",
        )
    })
}

/// Estimated time of a reading with its settling, s.
pub fn reading_s(rig_setup: &RigSetup) -> f64 {
    let receiver = &rig_setup.rig.receiver;
    receiver.settle().as_secs_f64() + receiver.count() as f64 / USUAL_RATE_HZ + TALK_S
}

/// Estimated time of a pass over a row with its leads, s.
pub fn pass_s(way_m: f64, speed_m_s: f64) -> f64 {
    move_s(way_m, speed_m_s) + TALK_S
}

/// Duration of a move from standstill to standstill, s: a trapezoidal speed profile, or a triangular one for a short move.
pub fn move_s(distance_m: f64, feed_m_s: f64) -> f64 {
    let ramps_m = feed_m_s * feed_m_s / USUAL_ACCELERATION_M_S2;
    if distance_m < ramps_m {
        2.0 * (distance_m / USUAL_ACCELERATION_M_S2).sqrt()
    } else {
        distance_m / feed_m_s + feed_m_s / USUAL_ACCELERATION_M_S2
    }
}

/// Checks that the disk of `folder` has space for `bytes`.
///
/// # Errors
/// A [`Fault`] of the folder, with the free and the required space.
pub fn room_for(bytes: u64, folder: &Path) -> Result<(), Fault> {
    let existing = folder.ancestors().find(|part| part.is_dir()).unwrap_or(Path::new("."));
    let Ok(disk) = rustix::fs::statvfs(existing) else { return Ok(()) };
    let free = disk.f_bavail.saturating_mul(disk.f_frsize);
    if free >= bytes + ROOM_LEFT_FREE {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    Err(Fault::of_file(
        folder,
        format!(
            "the disk has {} MiB free; the scan needs {} MiB",
            mib(free),
            mib(bytes + ROOM_LEFT_FREE)
        ),
        "free some space, or give a folder on another disk with --out",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_move_never_reaches_full_speed() {
        // 1 mm at 1 m/s²: half of it accelerating, half decelerating.
        assert!((move_s(1e-3, 0.1) - 2.0 * (1e-3f64).sqrt()).abs() < 1e-12);
        // 1 m at 0.1 m/s: ten seconds, and a tenth lost on the ramps.
        assert!((move_s(1.0, 0.1) - 10.1).abs() < 1e-12);
    }

    #[test]
    fn more_than_any_disk_holds_is_refused() {
        let fault =
            room_for(u64::MAX / 2, &std::env::temp_dir()).expect_err("no disk is that large");
        assert!(fault.to_string().contains("MiB free"), "{fault}");
        assert!(room_for(1, &std::env::temp_dir().join("not/there/yet")).is_ok());
    }
}
