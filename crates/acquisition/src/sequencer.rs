//! One point after another: the focus set, the robot moved and standing still, the receiver read.

use std::time::Duration;

use super::clock::ScanClock;
use super::rig_setup::RigSetup;
use fieldgap_acoustics::{Excitation, Vec3, delays_s};
use fieldgap_records::{FocusSection, RecordedSample, Spread, Visit};
use fieldgap_rig::{ElementDelay, Feed, Frame, RigError, SafeRig};

/// How each drive is told to the array, and how a point is read.
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

/// What the array is doing, as far as it was told by us.
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
    /// Samples that were lost on their way from the receiver.
    pub(super) lost: u32,
}

impl PointSequencer {
    /// Works out the delays of every drive from the rig file. The rig has just been opened: it is silent.
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

    /// Goes to a visit's point with its drive set, and reads it.
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
            // Its end: the middle of a reading in which the receiver's clock wraps would be hours away.
            self.clock.at(reading.last_t_s),
            visit.focus,
            self.frame.to_array(reported),
            // A magnitude: where there is nothing but noise, a converter may give slightly less than nothing.
            reading.mean.max(0.0),
            Some(Spread { std: reading.std, count: reading.count as u32 }),
        );
        Ok(Measurement { sample, clipped: reading.clipped, lost: reading.gaps })
    }

    /// How the array lies in the robot's axes.
    pub(super) fn frame(&self) -> Frame {
        self.frame
    }

    /// The speed of moves between points.
    pub(super) fn feed(&self) -> Feed {
        self.feed
    }

    /// The scan's time of an instant on the receiver's clock, s.
    pub(super) fn time_s(&mut self, receiver_s: f64) -> f64 {
        self.clock.at(receiver_s)
    }

    /// Silences the array; the next measurement sets its drive again.
    pub(super) async fn silence(&mut self, rig: &mut SafeRig) -> Result<(), RigError> {
        self.excite(rig, None).await
    }

    /// What the array is told for a drive.
    #[cfg(test)]
    pub(super) fn delays_of(&self, drive: usize) -> &[ElementDelay] {
        &self.delays[drive]
    }

    /// Drives a focus, or none.
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

/// The delay of each element of a rig's array for a drive; an element without amplitude is left silent.
pub fn element_delays(rig_setup: &RigSetup, excitation: &Excitation) -> Vec<ElementDelay> {
    let (array, frequency_hz) = (rig_setup.nominal_array(), rig_setup.array.frequency_hz());
    delays_s(excitation, array, &rig_setup.nominal_medium(), frequency_hz)
        .into_iter()
        .zip(array.elements())
        .map(|(delay_s, element)| {
            if element.amplitude == 0.0 {
                ElementDelay::Silent
            } else {
                ElementDelay::Seconds(delay_s)
            }
        })
        .collect()
}

/// Distance between two points in millimetres.
pub(super) fn distance_mm(a: Vec3, b: Vec3) -> f64 {
    (a - b).norm() * 1e3
}
