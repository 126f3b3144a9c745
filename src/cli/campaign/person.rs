//! Questions to a person during a campaign: at the terminal, or by `fieldgap campaign answer` where there is none.

use std::io::IsTerminal;
use std::path::Path;
use std::time::Duration;

use jiff::Timestamp;
use miette::{IntoDiagnostic, miette};
use serde::{Deserialize, Serialize};

use crate::cli::output::{ask, say};
use fieldgap_input::{MOST_TEXT, read_text};
use fieldgap_records::write_whole;

/// The open question, in the campaign's folder.
const QUESTION: &str = "question.json";

/// Its answer.
const ANSWER: &str = "answer.json";

/// Time between two looks at the answer.
const EVERY: Duration = Duration::from_millis(500);

/// A question that waits for an answer.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Question {
    /// When it was asked: the answer names it.
    asked: Timestamp,
    /// The question.
    pub(super) text: String,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    asked: Timestamp,
    yes: bool,
}

/// Whether somebody sits at a terminal.
pub(super) fn is_there() -> bool {
    std::io::stdin().is_terminal() && std::io::stderr().is_terminal()
}

/// Asks a question in a campaign's folder, and waits for yes or no. The question also appears at the terminal, where there is one; either may answer.
///
/// # Errors
/// The folder cannot be written.
pub(super) async fn asked(folder: &Path, text: &str) -> Result<bool, String> {
    let question = Question { asked: Timestamp::now(), text: text.to_owned() };
    write(&folder.join(QUESTION), &question).map_err(|error| error.to_string())?;
    let by_file = by_file(folder, question.asked);
    let yes = if is_there() {
        ask(format!("{text} [y/N] "));
        tokio::select! {
            yes = by_file => yes,
            yes = at_the_terminal() => yes,
        }
    } else {
        say(format!("{text}\n  answer with `fieldgap campaign answer {} yes`", folder.display()));
        by_file.await
    };
    let _ = std::fs::remove_file(folder.join(QUESTION));
    Ok(yes)
}

async fn by_file(folder: &Path, asked: Timestamp) -> bool {
    loop {
        let answer: Option<Answer> = read(&folder.join(ANSWER));
        if let Some(answer) = answer.filter(|answer| answer.asked == asked) {
            return answer.yes;
        }
        tokio::time::sleep(EVERY).await;
    }
}

async fn at_the_terminal() -> bool {
    let read = tokio::task::spawn_blocking(|| {
        let mut line = String::new();
        std::io::stdin().read_line(&mut line).is_ok_and(|bytes| bytes > 0).then_some(line)
    });
    match read.await {
        Ok(Some(line)) => matches!(line.trim().to_ascii_lowercase().as_str(), "y" | "yes"),
        // A closed terminal answers nothing.
        _ => std::future::pending().await,
    }
}

/// The open question of a campaign.
pub(super) fn open_question(folder: &Path) -> Option<Question> {
    read(&folder.join(QUESTION))
}

/// Answers the open question of a campaign.
///
/// # Errors
/// There is none, or the folder cannot be written.
pub(super) fn answer(folder: &Path, yes: bool) -> miette::Result<()> {
    let question = open_question(folder).ok_or_else(|| {
        miette!(
            help = "`fieldgap campaign status` shows what a campaign waits for",
            "no question is open in {}",
            folder.display()
        )
    })?;
    write(&folder.join(ANSWER), &Answer { asked: question.asked, yes }).into_diagnostic()?;
    say(format!("{}: {}", question.text, if yes { "yes" } else { "no" }));
    Ok(())
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_str(&read_text(path, MOST_TEXT).ok()?).ok()
}

fn write(path: &Path, value: &impl Serialize) -> std::io::Result<()> {
    let json = serde_json::to_vec(value)?;
    write_whole(path, |file| std::io::Write::write_all(file, &json))
}
