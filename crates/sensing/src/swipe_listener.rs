//! Swipes from the array of a rig.

use std::time::Duration;

use tokio::time::Instant;

use super::detector::{Swipe, SwipeDetector};
use super::section::SensingSection;
use fieldgap_rig::{ElementDelay, FocusArray, RigError};

/// Longest time without a sample from the controller.
const SAMPLE_TIMEOUT: Duration = Duration::from_secs(5);

/// An array that emits and receives at the same time, with a swipe detector.
pub struct SwipeListener<'a> {
    array: &'a mut dyn FocusArray,
    section: SensingSection,
    detector: SwipeDetector,
    next: u32,
    lost: u64,
    samples: u64,
}

/// The result of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListenerSample {
    /// Time of the sample, s since the controller's power-up.
    pub time_s: f64,
    /// The swipe that it completed, if any.
    pub swipe: Option<Swipe>,
}

impl<'a> SwipeListener<'a> {
    /// Starts a continuous wave without a focus, received with the elements of a section.
    ///
    /// # Errors
    /// A [`RigError`] if the array does not answer or cannot receive.
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
    /// After lost samples the detector starts again, because it would take a gap for a movement.
    ///
    /// # Errors
    /// A [`RigError`] if the array is disconnected or sends no more samples.
    pub async fn next(&mut self) -> Result<ListenerSample, RigError> {
        loop {
            let until = Instant::now() + SAMPLE_TIMEOUT;
            let Some(sample) = self.array.next_sample(until).await? else {
                return Err(RigError::new(
                    self.array.device().clone(),
                    "listening",
                    fieldgap_rig::Cause::Silent { waited: SAMPLE_TIMEOUT },
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
            return Ok(ListenerSample { time_s, swipe: self.detector.take(time_s, volts) });
        }
    }

    /// Number of samples received, and of samples lost.
    pub fn tally(&self) -> (u64, u64) {
        (self.samples, self.lost)
    }

    /// Ends all emission.
    ///
    /// # Errors
    /// A [`RigError`] if the array does not confirm it.
    pub async fn end(self) -> Result<(), RigError> {
        self.array.silence().await
    }
}
