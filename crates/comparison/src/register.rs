//! The choice of the registration: the recorded coordinates or another pose.
//!
//! A registration with enough free parameters explains any gap. The recorded coordinates are therefore trusted to a fraction of a
//! millimetre. Another pose replaces them only if the scan does not correlate with the simulation as recorded and does in that pose. A
//! difference that a small shift or a pose explains only in part stays in the gap. A large shift is searched for, reported, and left
//! in the gap.

use super::identifiability::identifiability;
use super::phase_fit::FittedPhases;
use super::pose::{Mirror, Pose};
use super::pose_search::{Found, determine_a_pose, find_pose};
use super::readings::Readings;
use super::receiver_face::{ReceiverFace, find_receiver_face, with_receiver_face};
use super::refine::{Fit, PoseParameter, Search, refine};
use super::registration::{
    Estimate, PhasesUsed, Registering, Registration, TriedRegistration, UndeterminedCombination,
};
use super::shift_search::{FoundShift, find_shift};
use fieldgap_text::percent;

/// Standard deviation of the position of the robot's origin after a careful set-up, along each axis, metres.
pub const SHIFT_SD_M: f64 = 0.2e-3;

/// A shift of more standard deviations than this is not taken as an error of the set-up, but reported as a gap.
const MAX_SHIFT_SD: f64 = 3.0;

/// A larger shift is reported if it leaves at most this share of the squared residual, beside whatever else the gap consists of.
const SHIFT_LEAVES: f64 = 0.8;

/// Standard errors by which a reported shift exceeds an error of the set-up.
const SHIFT_SIGMA: f64 = 3.0;

/// Correlation from which no other pose is searched: a scan that resembles its simulation is in its coordinates.
const RESEMBLES: f64 = 0.85;

/// Correlation from which a scan agrees with its simulation in another pose; it may have a gap besides.
const AGREES_IN_POSE: f64 = 0.6;

/// Correlation below which a scan is unrelated to its simulation as recorded: it has coordinates of its own.
const UNRELATED: f64 = 0.3;

/// A pose explains the gap if it leaves at most this share of the squared residual. (For an unrelated scan the share means little: even
/// two unrelated fields of speckle leave only a half.)
const EXPLAINS: f64 = 0.5;

/// A pose of the other handedness with at most this times the squared residual is equally good.
const AS_GOOD: f64 = 1.1;

/// Scatter of phases beside the simulation from which they agree with it hardly better than by chance, radians: phases that are anything have 1.8.
const UNRELATED_RAD: f64 = 0.8;

/// A registration and the simulation under it.
#[derive(Debug, Clone, PartialEq)]
pub struct Registered {
    /// What to report.
    pub registration: Registration,
    /// The pose, the gain, and the simulated magnitude at each reading.
    pub fit: Fit,
}

/// Registers readings to their simulation; `readings` must not be empty, and not all zero.
pub fn register(readings: &Readings, requested: Registering) -> Registered {
    let gain_only = Fit::at(readings, Pose::default());
    match requested {
        Registering::None => {
            let fit =
                Fit::with_gain(Pose::default(), 1.0, gain_only.simulated, &readings.values());
            let why = "nothing was estimated, as asked".to_owned();
            Choice { chosen: Registering::None, fit, why, found: None, heard: None, tried: vec![] }
        }
        Registering::GainOnly => {
            let why = "only the gain was estimated, as asked".to_owned();
            Choice { chosen: requested, fit: gain_only, why, found: None, heard: None, tried: vec![] }
        }
        Registering::GainAndShift => {
            let fit = with_small_shift(readings);
            let why = format!(
                "gain and shift were estimated, as asked; the shift is held near zero by a prior of {:.1} mm",
                SHIFT_SD_M * 1e3
            );
            let tried = vec![tried(Registering::GainOnly, &gain_only)];
            Choice { chosen: requested, fit, why, found: None, heard: None, tried }
        }
        Registering::Shift => shift_as_asked(readings, gain_only),
        Registering::Pose => pose_as_asked(readings, gain_only),
        Registering::Auto => choose(readings, gain_only),
    }
    .report(readings, requested)
}

fn shift_as_asked(readings: &Readings, gain_only: Fit) -> Choice {
    let all = vec![tried(Registering::GainOnly, &gain_only)];
    let (chosen, fit, why) = match find_shift(readings) {
        Ok(found) => {
            let why = format!("gain and shift were estimated, as asked: {found}");
            (Registering::Shift, found.fit, why)
        }
        Err(too_few) => {
            let why = format!("only the gain was estimated: {too_few}");
            (Registering::GainOnly, gain_only, why)
        }
    };
    Choice { chosen, fit, why, found: None, heard: None, tried: all }
}

fn pose_as_asked(readings: &Readings, gain_only: Fit) -> Choice {
    let tried = vec![tried(Registering::GainOnly, &gain_only)];
    if let Err(undetermined) = determine_a_pose(readings) {
        let why = format!("only the gain was estimated: {undetermined}");
        let chosen = Registering::GainOnly;
        return Choice { chosen, fit: gain_only, why, found: None, heard: None, tried };
    }
    match find_pose(readings) {
        Some(found) => {
            let why = format!("the whole pose was estimated, as asked: {}", in_words(&found.best));
            in_pose(readings, found, why, tried)
        }
        None => Choice {
            chosen: Registering::GainOnly,
            fit: gain_only,
            why: "no pose was found; only the gain was estimated".to_owned(),
            found: None,
            heard: None,
            tried,
        },
    }
}

/// The automatic choice.
fn choose(readings: &Readings, gain_only: Fit) -> Choice {
    let mut all = vec![tried(Registering::GainOnly, &gain_only)];
    let small_shift = with_small_shift(readings);
    all.push(tried(Registering::GainAndShift, &small_shift));
    let any_shift = find_shift(readings).ok();
    all.extend(any_shift.as_ref().map(|found| tried(Registering::Shift, &found.fit)));
    let large = any_shift.filter(|found| is_large(found, &gain_only));
    let displaced = large.as_ref().map_or(0.0, |found| found.fit.correlation);
    let (chosen, small, shift_words) = match large {
        Some(found) => {
            let words = format!(
                "only the gain was estimated: the best shift is {found}. It lowers the residual from {} to {} of the scan's rms. An error \
                 of the set-up is at most {:.1} mm, so this shift is left in the gap",
                percent(gain_only.residual_ratio),
                percent(found.fit.residual_ratio),
                MAX_SHIFT_SD * SHIFT_SD_M * 1e3,
            );
            (Registering::GainOnly, gain_only, words)
        }
        None if small_shift.pose.shift_m.amax() <= MAX_SHIFT_SD * SHIFT_SD_M => {
            let words = "gain and a small shift were estimated".to_owned();
            (Registering::GainAndShift, small_shift, words)
        }
        None => {
            let words = "only the gain was estimated: no shift explains the gap".to_owned();
            (Registering::GainOnly, gain_only, words)
        }
    };
    if small.correlation >= RESEMBLES {
        let why = format!(
            "{shift_words}; in the recorded coordinates the correlation with the simulation is {:.3}, so no other pose was searched",
            small.correlation
        );
        return Choice { chosen, fit: small, why, found: None, heard: None, tried: all };
    }
    if displaced >= RESEMBLES && small.correlation >= UNRELATED {
        let why = format!(
            "{shift_words}; with this shift the correlation with the simulation is {displaced:.3}, so no other pose was searched"
        );
        return Choice { chosen, fit: small, why, found: None, heard: None, tried: all };
    }
    if let Err(undetermined) = determine_a_pose(readings) {
        let why = format!("{shift_words}. No other pose was searched: {undetermined}");
        return Choice { chosen, fit: small, why, found: None, heard: None, tried: all };
    }
    let Some(found) = find_pose(readings) else {
        return Choice {
            chosen,
            fit: small,
            why: shift_words,
            found: None,
            heard: None,
            tried: all,
        };
    };
    all.push(tried(Registering::Pose, &found.best));
    let falls_to = (found.best.residual_ratio / small.residual_ratio).powi(2);
    let reached = format!(
        "leaves {:.0} % of the squared residual and brings the correlation from {:.3} to {:.3}",
        100.0 * falls_to,
        small.correlation,
        found.best.correlation
    );
    let pose = in_words(&found.best);
    let explains = falls_to <= EXPLAINS || small.correlation < UNRELATED;
    if explains && found.best.correlation >= AGREES_IN_POSE {
        let why = format!(
            "in the recorded coordinates the scan does not agree with the simulation; in another pose it does: {pose}. It {reached}"
        );
        in_pose(readings, found, why, all)
    } else {
        let why = format!(
            "{shift_words}. Another pose was tried and not adopted, as it does not explain the gap: the best ({pose}) {reached}"
        );
        Choice { chosen, fit: small, why, found: None, heard: None, tried: all }
    }
}

/// Whether a shift is larger than an error of the set-up, by more than its own error, and explains part of the gap.
fn is_large(found: &FoundShift, gain_only: &Fit) -> bool {
    let explains = (found.fit.residual_ratio / gain_only.residual_ratio).powi(2) <= SHIFT_LEAVES;
    explains && found.exceeds(MAX_SHIFT_SD * SHIFT_SD_M, SHIFT_SIGMA)
}

/// A pose that was found, and the receiver's own directivity where it explains what the pose cannot.
fn in_pose(
    readings: &Readings,
    found: Found,
    mut why: String,
    mut all: Vec<TriedRegistration>,
) -> Choice {
    if all.iter().all(|other| other.registering != Registering::Pose) {
        all.push(tried(Registering::Pose, &found.best));
    }
    let heard = find_receiver_face(readings, &found.best);
    if let Some(heard) = &heard {
        why += &format!(
            ". With one gain for all angles the residual is {:.3} at a correlation of {:.3}; with a gain that falls with the angle of \
             arrival, as for a receiver's face of {:.1} mm in radius, it is {:.3} at {:.3}",
            found.best.residual_ratio,
            found.best.correlation,
            heard.face_radius_m * 1e3,
            heard.fit.residual_ratio,
            heard.fit.correlation
        );
    }
    let fit = heard.as_ref().map_or(&found.best, |heard| &heard.fit).clone();
    Choice { chosen: Registering::Pose, fit, why, found: Some(found), heard, tried: all }
}

/// Gain and a shift held near zero; first on some readings, then on all.
fn with_small_shift(readings: &Readings) -> Fit {
    const SOME: usize = 2000;
    let free = PoseParameter::SHIFT.map(|parameter| (parameter, Some((0.0, SHIFT_SD_M)))).to_vec();
    let some = readings.thinned(SOME);
    let start = refine(&some, Pose::default(), &Search { free: free.clone(), iterations: 12 });
    refine(readings, start.pose, &Search { free, iterations: 3 })
}

fn tried(registering: Registering, fit: &Fit) -> TriedRegistration {
    TriedRegistration {
        registering,
        pose: fit.pose,
        correlation: fit.correlation,
        residual_rms_ratio: fit.residual_ratio,
    }
}

/// A choice, before its errors are known.
struct Choice {
    chosen: Registering,
    fit: Fit,
    why: String,
    found: Option<Found>,
    heard: Option<ReceiverFace>,
    tried: Vec<TriedRegistration>,
}

impl Choice {
    fn report(self, readings: &Readings, requested: Registering) -> Registered {
        let free: &[PoseParameter] = match self.chosen {
            Registering::Pose => &PoseParameter::ALL,
            Registering::GainAndShift | Registering::Shift => &PoseParameter::SHIFT,
            _ => &[],
        };
        let simulation_with_receiver_face =
            self.heard.as_ref().map(|heard| with_receiver_face(readings, heard.face_radius_m));
        let known = identifiability(
            simulation_with_receiver_face.as_ref().unwrap_or(readings),
            &self.fit,
            free,
        );
        let estimate = |parameter: PoseParameter| {
            let value = parameter.of(&self.fit.pose);
            match free.iter().position(|other| *other == parameter) {
                // A shift with a prior has at most the prior's standard deviation.
                Some(index) if self.chosen == Registering::GainAndShift => {
                    let precision = known.errors[index].powi(-2) + SHIFT_SD_M.powi(-2);
                    Estimate { value, standard_error: precision.powf(-0.5), estimated: true }
                }
                Some(index) => {
                    Estimate { value, standard_error: known.errors[index], estimated: true }
                }
                None => Estimate { value, standard_error: 0.0, estimated: false },
            }
        };
        let gain_estimated = self.chosen != Registering::None;
        let gain = Estimate {
            value: self.fit.gain,
            standard_error: if gain_estimated { known.gain_error } else { 0.0 },
            estimated: gain_estimated,
        };
        let mut undetermined = match self.chosen {
            Registering::Pose | Registering::Shift => known.undetermined,
            // Here the prior determines every combination; the standard errors show how well.
            _ => Vec::new(),
        };
        undetermined.extend(self.found.as_ref().and_then(either_hand));
        let mut tried_all = self.tried;
        if tried_all.iter().all(|other| other.registering != self.chosen) {
            tried_all.push(tried(self.chosen, &self.fit));
        }
        let phases = self.fit.phases.as_ref().filter(|_| !free.is_empty());
        let why = match phases {
            Some(phases) => self.why + &phases_in_words(phases),
            None => self.why,
        };
        let registration = Registration {
            requested,
            chosen: self.chosen,
            why,
            gain,
            mirror: self.fit.pose.mirror,
            turn_rad: estimate(PoseParameter::Turn),
            step_ratio: estimate(PoseParameter::Step),
            shift_m: PoseParameter::SHIFT.map(estimate),
            receiver_face_m: self.heard.map(|heard| Estimate {
                value: heard.face_radius_m,
                standard_error: heard.standard_error_m,
                estimated: true,
            }),
            tried: tried_all,
            undetermined,
            phases: phases.map(|phases| PhasesUsed {
                known: phases.known,
                noise_rad: phases.noise_rad,
                drift_rad: phases.drift_rad,
            }),
        };
        Registered { registration, fit: self.fit }
    }
}

/// Names the mirror as undetermined if the other handedness is equally good.
fn either_hand(found: &Found) -> Option<UndeterminedCombination> {
    let other = found.other_handedness.as_ref()?;
    let ratio = (other.misfit() / found.best_in_that_round).powi(2);
    (ratio <= AS_GOOD).then(|| UndeterminedCombination {
        parameters: vec!["mirror".to_owned()],
        explanation: format!(
            "a scan of the other handedness ({}) has {ratio:.2} times the squared residual: the field is too symmetric to determine from \
             these readings whether an axis is mirrored",
            in_words(other)
        ),
    })
}

/// What the phases told.
fn phases_in_words(phases: &FittedPhases) -> String {
    let noise_rad = phases.noise_rad;
    match noise_rad < UNRELATED_RAD {
        true => format!(
            ". The phases of {} readings were fitted too: they scatter by {noise_rad:.3} rad about the simulation, and their reference drifts by \
             {:.3} rad",
            phases.known, phases.drift_rad
        ),
        false => format!(
            ". The phases of {} readings hardly count, since they differ from the simulation by {noise_rad:.1} rad: is their convention right?",
            phases.known
        ),
    }
}

/// A pose in words.
fn in_words(fit: &Fit) -> String {
    let mirror = match fit.pose.mirror {
        Mirror::None => "not mirrored",
        Mirror::X => "mirrored in x",
        Mirror::Y => "mirrored in y",
    };
    format!(
        "{mirror}, shifted by {}, turned by {:.2} degrees, step times {:.4}",
        millimetres(&fit.pose),
        fit.pose.turn_rad.to_degrees(),
        fit.pose.step_ratio
    )
}

fn millimetres(pose: &Pose) -> String {
    let shift = pose.shift_m * 1e3;
    format!("({:.2}, {:.2}, {:.2}) mm", shift.x, shift.y, shift.z)
}
