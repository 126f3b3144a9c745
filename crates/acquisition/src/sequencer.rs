//! The measurement of one point: set the focus, move the robot, wait until it stands still, read the receiver.

use std::time::Duration;

use super::clock::ScanClock;
use super::rig_setup::RigSetup;
use fieldgap_acoustics::{Excitation, Vec3, delays_s};
use fieldgap_records::{FocusSection, RecordedSample, Spread, Visit};
use fieldgap_rig::{ElementDelay, Feed, Frame, RigError, SafeRig};

/// Measures one point after another, and remembers how the array is driven.
#[derive(Debug)]
pub(super) struct PointSequencer {
    frame: Frame,
    feed: Feed,
    settle: Duration,
    readings: usize,
    delays: Vec<Vec<ElementDelay>>,
    emitting: Emission,
    clock: ScanClock,
}

/// What the array was last commanded to do.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Emission {
    Silent,
    Drive(usize),
}

/// One measurement.
#[derive(Debug)]
pub(super) struct Measurement {
    pub(super) sample: RecordedSample,
    /// Whether the converter was at its limit.
    pub(super) clipped: bool,
    /// Samples lost on the way from the receiver.
    pub(super) lost: u32,
}

impl PointSequencer {
    /// Computes the delays of every focus. The rig has just been opened: the array is silent.
    pub(super) fn new(rig_setup: &RigSetup, foci: &[FocusSection], clock: ScanClock) -> Self {
        let delays =
            foci.iter().map(|focus| element_delays(rig_setup, &focus.excitation())).collect();
        Self {
            frame: rig_setup.rig.motion.frame(),
            feed: rig_setup.rig.motion.feed(),
            settle: rig_setup.rig.receiver.settle(),
            readings: rig_setup.rig.receiver.count(),
            delays,
            emitting: Emission::Silent,
            clock,
        }
    }

    /// Measures one visit of the plan: moves there with its focus set, and reads.
    pub(super) async fn measure(
        &mut self,
        rig: &mut SafeRig,
        visit: &Visit,
    ) -> Result<Measurement, RigError> {
        self.excite(rig, visit.focus).await?;
        let target = self.frame.to_robot(visit.position_m);
        let reported = rig.move_to(target, self.feed).await?;
        let reading = rig.read_point(self.settle, self.readings).await?;
        rig.confirm(visit.focus.is_some()).await?;
        let sample = RecordedSample::measured(
            // Time of the last sample: the mean time would be hours off if the receiver's clock wraps within the reading.
            self.clock.at(reading.last_t_s),
            visit.focus,
            self.frame.to_array(reported),
            // A magnitude is not negative, but a converter may read slightly below zero in noise.
            reading.mean.max(0.0),
            Some(Spread { std: reading.std, count: reading.count as u32 }),
        )
        .with_phase(reading.phase_rad);
        Ok(Measurement { sample, clipped: reading.clipped, lost: reading.gaps })
    }

    /// Position of the array in the robot's axes.
    pub(super) fn frame(&self) -> Frame {
        self.frame
    }

    /// Speed of moves between points.
    pub(super) fn feed(&self) -> Feed {
        self.feed
    }

    /// Scan time of an instant on the receiver's clock, s.
    pub(super) fn time_s(&mut self, receiver_s: f64) -> f64 {
        self.clock.at(receiver_s)
    }

    /// Silences the array. The next measurement sets its focus again.
    pub(super) async fn silence(&mut self, rig: &mut SafeRig) -> Result<(), RigError> {
        self.excite(rig, None).await
    }

    /// The delays of a focus.
    #[cfg(test)]
    pub(super) fn delays_of(&self, drive: usize) -> &[ElementDelay] {
        &self.delays[drive]
    }

    /// Drives the array to a focus, or silences it for `None`.
    pub(super) async fn excite(
        &mut self,
        rig: &mut SafeRig,
        focus: Option<usize>,
    ) -> Result<(), RigError> {
        let wanted = focus.map_or(Emission::Silent, Emission::Drive);
        if wanted == self.emitting {
            return rig.refresh().await;
        }
        match wanted {
            Emission::Silent => rig.silence().await?,
            Emission::Drive(number) => {
                rig.set_delays(&self.delays[number]).await?;
                rig.emit().await?
            }
        };
        self.emitting = wanted;
        Ok(())
    }
}

/// The delay of each element of the array for an excitation, with that which compensates it by its calibration; elements of zero amplitude
/// stay silent.
pub fn element_delays(rig_setup: &RigSetup, excitation: &Excitation) -> Vec<ElementDelay> {
    let (array, frequency_hz) = (rig_setup.nominal_array(), rig_setup.array.frequency_hz());
    delays_s(excitation, array, &rig_setup.nominal_medium(), frequency_hz)
        .into_iter()
        .zip(array.elements())
        .zip(rig_setup.array.compensation_rad())
        .map(|((delay_s, element), added_rad)| {
            if element.amplitude == 0.0 {
                return ElementDelay::Silent;
            }
            let added_s = (added_rad / std::f64::consts::TAU).rem_euclid(1.0) / frequency_hz;
            ElementDelay::Seconds(delay_s + added_s)
        })
        .collect()
}

/// Distance between two points given in metres, mm.
pub(super) fn distance_mm(a: Vec3, b: Vec3) -> f64 {
    (a - b).norm() * 1e3
}
