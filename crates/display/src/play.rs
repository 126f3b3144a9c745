//! A display on a rig: loaded, played, ended safe.

use std::future::Future;
use std::time::Duration;

use tokio::time::{Instant, sleep, sleep_until};

use fieldgap_rig::focus_array::DriveProgram;
use fieldgap_rig::{FocusArray, RigError};

/// How long the controller plays without a word from here. A program that is killed outright leaves it sounding no longer.
const LEASE: Duration = Duration::from_secs(2);

/// How often it is asked whether it still plays, which renews the lease.
const ASK_EVERY: Duration = Duration::from_millis(500);

/// How a display came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// Its time was over.
    Played,
    /// It was asked to stop.
    Stopped(&'static str),
}

/// Plays a display for some seconds, or until `stop` says who stops it, and leaves the array silent.
///
/// The controller is told how many loops there are at most, so that it falls silent by itself should nobody be there to tell it.
///
/// # Errors
/// That the array cannot play it, or is lost; it was told to be silent as far as it could be.
pub async fn play(
    array: &mut dyn FocusArray,
    display: &DriveProgram,
    seconds: Option<f64>,
    stop: impl Future<Output = &'static str>,
) -> Result<Ended, RigError> {
    tokio::pin!(stop);
    let outcome = tokio::select! {
        who = &mut stop => Ok(Ended::Stopped(who)),
        outcome = play_through(array, display, seconds) => outcome.map(|()| Ended::Played),
    };
    // Whatever happened, and first of all.
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
            () = sleep(ASK_EVERY) => {
                if !array.is_playing().await? {
                    return Ok(());
                }
            }
        }
    }
}
