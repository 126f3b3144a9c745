//! The times with a real array driven, in a log of the user, so that minutes add up over a day.

use std::path::Path;
use std::time::Instant;

use jiff::{Timestamp, Zoned};

use super::output::say;
use super::settings::settings_folder;
use fieldgap_acquisition::RigSetup;
use fieldgap_exposure::{Sounding, SoundingLog, driven_s};
use fieldgap_input::{Label, NonNegative};
use fieldgap_records::RecordedScan;
use fieldgap_rig::Role;

/// Whether the array of a rig makes sound.
pub(super) fn is_heard(rig_setup: &RigSetup) -> bool {
    rig_setup.real_devices().contains(&Role::FocusArray)
}

/// The log; `None` where there are no settings.
fn log() -> Option<SoundingLog> {
    Some(SoundingLog::at(settings_folder()?.join("sounding.jsonl")))
}

/// Minutes with the array of a rig driven today, by this computer's time zone.
///
/// # Errors
/// The log cannot be read.
pub(super) fn minutes_today(rig: &str) -> miette::Result<f64> {
    let Some(log) = log() else { return Ok(0.0) };
    let now = Zoned::now();
    Ok(log.minutes_on(now.date(), now.time_zone(), rig)?)
}

/// Keeps what a scan in `folder` added. A failure is said and does not spoil the scan.
pub(super) fn keep_scan(rig_setup: &RigSetup, folder: &Path) {
    if !is_heard(rig_setup) {
        return;
    }
    let kept = || -> miette::Result<()> {
        let all_s = driven_s(&RecordedScan::open(folder)?.samples);
        let what = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let what = what.display().to_string();
        let Some(log) = log() else { return Ok(()) };
        // A resumed scan was counted in part.
        let before_s = log.seconds_of(&rig_setup.name, label(&what).as_str())?;
        keep(&rig_setup.name, &what, all_s - before_s)
    };
    if let Err(error) = kept() {
        say(format!("the time with the array driven is not kept: {error}"));
    }
}

/// An array that sounds without a plan: the time until this is dropped is kept.
#[derive(Debug)]
pub(super) struct Sounds(Option<Begun>);

#[derive(Debug)]
struct Begun {
    at: Instant,
    rig: String,
    what: &'static str,
}

impl Sounds {
    /// Begins to sound. The time of a virtual array is not kept.
    pub(super) fn begin(rig_setup: &RigSetup, what: &'static str) -> Self {
        let begun = || Begun { at: Instant::now(), rig: rig_setup.name.clone(), what };
        Self(is_heard(rig_setup).then(begun))
    }
}

impl Drop for Sounds {
    /// A failure is said.
    fn drop(&mut self) {
        if let Some(Begun { at, rig, what }) = &self.0
            && let Err(error) = keep(rig, what, at.elapsed().as_secs_f64())
        {
            say(format!("the time with the array driven is not kept: {error}"));
        }
    }
}

fn keep(rig: &str, what: &str, seconds: f64) -> miette::Result<()> {
    let Some(log) = log() else { return Ok(()) };
    let Ok(seconds) = NonNegative::new(seconds) else { return Ok(()) };
    if seconds.get() == 0.0 {
        return Ok(());
    }
    let sounding =
        Sounding { ended: Timestamp::now(), seconds, rig: label(rig), what: label(what) };
    log.add(&sounding).map_err(|error| miette::miette!("{error}"))
}

/// The end of a text that a label can hold.
fn label(text: &str) -> Label {
    const MOST: usize = 200;
    let characters: Vec<char> =
        text.chars().filter(|character| !fieldgap_input::is_hidden(*character)).collect();
    let end = characters[characters.len().saturating_sub(MOST)..].iter().collect::<String>();
    Label::try_from(end).expect("short, without hidden characters")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_gives_a_label() {
        assert_eq!(label("out/scan\n\u{1b}").as_str(), "out/scan");
        assert_eq!(label(&"a/".repeat(300)).as_str().chars().count(), 200);
    }
}
