//! Playing a display on a rig, up to its safe end.

use std::future::Future;
use std::time::Duration;

use tokio::time::{Instant, sleep, sleep_until};

use fieldgap_rig::focus_array::DriveProgram;
use fieldgap_rig::{FocusArray, RigError};

/// Time that the controller plays without contact, for example after the program was killed.
const LEASE: Duration = Duration::from_secs(2);

/// Interval of the status queries, which renew the lease.
const QUERY_INTERVAL: Duration = Duration::from_millis(500);

/// How a display ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaybackEnd {
    /// Its duration is over.
    Played,
    /// It was stopped, for this reason.
    Stopped(&'static str),
}

/// Plays a display for `seconds`, or until `stop` resolves with its reason, and silences the array.
///
/// The controller gets the largest number of loops, so that it falls silent by itself if contact is lost.
///
/// # Errors
/// The array cannot play the display or has failed. It was silenced as far as possible.
pub async fn play(
    array: &mut dyn FocusArray,
    display: &DriveProgram,
    seconds: Option<f64>,
    stop: impl Future<Output = &'static str>,
) -> Result<PlaybackEnd, RigError> {
    tokio::pin!(stop);
    let outcome = tokio::select! {
        reason = &mut stop => Ok(PlaybackEnd::Stopped(reason)),
        outcome = play_through(array, display, seconds) => outcome.map(|()| PlaybackEnd::Played),
    };
    // In every case, before errors are returned.
    let silenced = array.silence().await;
    let ended = outcome?;
    silenced.map(|()| ended)
}

async fn play_through(
    array: &mut dyn FocusArray,
    display: &DriveProgram,
    seconds: Option<f64>,
) -> Result<(), RigError> {
    array.load(display).await?;
    let loop_s = display.loop_periods() as f64 / array.identity().carrier_hz();
    let loops = seconds
        .map_or(0, |seconds| (seconds / loop_s).ceil().clamp(1.0, f64::from(u32::MAX)) as u32);
    array.play(display, loops, LEASE).await?;
    let until = seconds
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .and_then(|seconds| Instant::now().checked_add(seconds));
    let over = async {
        match until {
            Some(until) => sleep_until(until).await,
            None => std::future::pending().await,
        }
    };
    tokio::pin!(over);
    loop {
        tokio::select! {
            () = &mut over => return Ok(()),
            () = sleep(QUERY_INTERVAL) => {
                if !array.is_playing().await? {
                    return Ok(());
                }
            }
        }
    }
}
