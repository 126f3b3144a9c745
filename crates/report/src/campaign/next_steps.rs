//! What a person does next, as commands to copy, and why the campaign needs a person.

use std::path::Path;

use maud::{Markup, html};

use super::super::words::sentence;
use fieldgap_campaign::{CellStatus, Overview};

/// A reason and the command for it; empty where no command is of use.
struct Step {
    why: String,
    command: String,
}

/// The question that a campaign waits for, and how it is answered.
pub(super) fn question(overview: &Overview) -> Option<Markup> {
    let question = overview.question.as_ref()?;
    let command = format!("fieldgap campaign answer {} yes", quoted(&overview.folder));
    Some(html! {
        div class="question" role="status" {
            p { b { "The campaign waits for a person: " (question) } }
            pre { (command) }
        }
    })
}

/// The steps; `None` where nobody has to do anything.
pub(super) fn next_steps(overview: &Overview) -> Option<Markup> {
    let steps = steps(overview);
    let running = !overview.ended && !steps.is_empty();
    (!steps.is_empty()).then(|| {
        html! {
            @if running { p { "These commands work once the campaign does not run." } }
            ol class="steps" {
                @for step in steps { li { p { (step.why) } pre { (step.command) } } }
            }
        }
    })
}

fn steps(overview: &Overview) -> Vec<Step> {
    let folder = quoted(&overview.folder);
    let open = overview.alarms.iter().filter(|alarm| alarm.open).count();
    let has =
        |of: fn(&CellStatus) -> bool| overview.cells.iter().filter(|cell| of(&cell.status)).count();
    let failed = has(|status| matches!(status, CellStatus::Failed { .. }));
    let changed = has(|status| matches!(status, CellStatus::Done { changed: true, .. }));
    let resume = format!("fieldgap campaign resume {folder}");
    let mut steps = Vec::new();
    if open > 0 {
        steps.push(Step {
            why: format!("Alarms to be acknowledged: {open}. Say what was found or done; control charts then begin anew."),
            command: format!("fieldgap campaign acknowledge {folder} \"what was found\""),
        });
    }
    if let Some(reason) = &overview.ended_early {
        steps.push(Step {
            why: format!("The campaign ended early. {}", sentence(reason)),
            command: resume.clone(),
        });
    } else if overview.ended && (!overview.not_set.is_empty() || !overview.rigs_left.is_empty()) {
        let why = "Cells were left out, because a condition was not set or a rig failed. Correct that, and continue.";
        steps.push(Step { why: why.to_owned(), command: resume.clone() });
    }
    if failed > 0 {
        steps.push(Step {
            why: format!("Cells that failed: {failed}. Try them again."),
            command: format!("{resume} --failed"),
        });
    }
    if changed > 0 {
        let why = format!(
            "Cells whose plan, rig or campaign file changed after they were measured: {changed}. Measure them again."
        );
        steps.push(Step { why, command: format!("{resume} --changed") });
    }
    steps
}

/// A path as one word of a shell.
fn quoted(path: &Path) -> String {
    let path = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '+');
    match path.chars().all(plain) && !path.starts_with('-') && !path.is_empty() {
        true => path,
        false => format!("'{}'", path.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::overview;
    use super::*;

    #[test]
    fn each_reason_has_its_command() {
        let commands: Vec<String> =
            steps(&overview()).into_iter().map(|step| step.command).collect();
        let expected = [
            "fieldgap campaign acknowledge 'out/two foci' \"what was found\"",
            "fieldgap campaign resume 'out/two foci'",
            "fieldgap campaign resume 'out/two foci' --failed",
        ];
        assert_eq!(commands, expected);
    }

    #[test]
    fn a_campaign_without_trouble_needs_nobody() {
        let mut quiet = overview();
        quiet.alarms.clear();
        quiet.cells.truncate(2);
        quiet.ended_early = None;
        quiet.rigs_left.clear();
        quiet.not_set.clear();
        assert!(next_steps(&quiet).is_none());
        quiet.not_set.push("screen = in: the answer was no".to_owned());
        assert_eq!(steps(&quiet).len(), 1);
    }

    #[test]
    fn a_path_is_one_word() {
        assert_eq!(quoted(Path::new("out/a")), "out/a");
        assert_eq!(quoted(Path::new("it's")), "'it'\\''s'");
    }
}
