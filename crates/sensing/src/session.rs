//! Listening on a rig.

use std::time::Duration;

use tokio::time::Instant;

use super::detector::{Swipe, SwipeDetector};
use super::section::SensingSection;
use fieldgap_rig::{ElementDelay, FocusArray, RigError};

/// How long the controller may say nothing while it listens.
const SILENT_WITHIN: Duration = Duration::from_secs(5);

/// An array that sounds and listens.
pub struct SensingSession<'a> {
    array: &'a mut dyn FocusArray,
    section: SensingSection,
    detector: SwipeDetector,
    next: u32,
    lost: u64,
    samples: u64,
}

/// What a sample brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// When it was taken, s since the controller's power-up.
    pub time_s: f64,
    /// The swipe that it completed, if it did.
    pub swipe: Option<Swipe>,
}

impl<'a> SensingSession<'a> {
    /// Lets the array sound without modulation and without a focus, and listens with the elements of a section.
    ///
    /// # Errors
    /// That the array does not answer, or cannot listen.
    pub async fn begin(
        array: &'a mut dyn FocusArray,
        section: SensingSection,
    ) -> Result<Self, RigError> {
        array.silence().await?;
        array.continuous_wave().await?;
        let elements = array.identity().elements;
        array.set_delays(&vec![ElementDelay::Seconds(0.0); elements]).await?;
        array.listen(&section.elements(), section.rate_hz()).await?;
        array.emit().await?;
        let detector = SwipeDetector::new(section.rate_hz());
        Ok(Self { array, section, detector, next: 0, lost: 0, samples: 0 })
    }

    /// Waits for the next sample.
    ///
    /// After samples that were lost the detector begins anew: it would take a gap for a movement.
    ///
    /// # Errors
    /// That the array is gone or has fallen silent.
    pub async fn next(&mut self) -> Result<Heard, RigError> {
        loop {
            let until = Instant::now() + SILENT_WITHIN;
            let Some(sample) = self.array.next_sample(until).await? else {
                return Err(RigError::new(
                    self.array.device().clone(),
                    "listening",
                    fieldgap_rig::Cause::Silent { waited: SILENT_WITHIN },
                    None,
                ));
            };
            let Ok(volts) = <[f64; 4]>::try_from(sample.volts) else { continue };
            let gap = sample.number.wrapping_sub(self.next);
            if self.samples > 0 && gap > 0 {
                self.lost += u64::from(gap);
                self.detector = SwipeDetector::new(self.section.rate_hz());
            }
            self.next = sample.number.wrapping_add(1);
            self.samples += 1;
            let time_s = sample.t_us as f64 * 1e-6;
            return Ok(Heard { time_s, swipe: self.detector.take(time_s, volts) });
        }
    }

    /// Samples that came, and those that were lost.
    pub fn tally(&self) -> (u64, u64) {
        (self.samples, self.lost)
    }

    /// Ends all emission.
    ///
    /// # Errors
    /// That the array does not confirm it.
    pub async fn end(self) -> Result<(), RigError> {
        self.array.silence().await
    }
}
