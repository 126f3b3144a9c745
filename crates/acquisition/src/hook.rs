//! A hook run: a program that tells somebody what happened to a scan.

use std::io;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use tokio::io::AsyncReadExt;
use tokio::process::{ChildStderr, Command};
use tokio::time::timeout;

use fieldgap_records::{HookCommand, HookKind};

/// How long a hook may take.
pub(super) const MOST: Duration = Duration::from_secs(30);

/// Bytes of its complaints that are kept.
const KEPT: u64 = 400;

/// How long its complaints are waited for when it has ended: a child that it left behind may hold them open.
const LAST_WORDS: Duration = Duration::from_millis(200);

/// What a hook did not do.
#[derive(Debug, thiserror::Error)]
pub(super) enum HookFault {
    #[error("it cannot be started: {0}")]
    NotStarted(#[source] io::Error),
    #[error("it was not done within {} s and was ended", .0.as_secs())]
    TooLong(Duration),
    #[error("it failed ({status}){said}")]
    Failed { status: ExitStatus, said: String },
    #[error("the system lost it: {0}")]
    Lost(#[source] io::Error),
}

/// Runs a hook to its end, within `most`. It gets the kind of event, the scan's folder and a message as `FIELDGAP_EVENT`,
/// `FIELDGAP_SCAN`, `FIELDGAP_MESSAGE`; nothing to read, and nobody to write to but by its complaints.
///
/// # Errors
/// [`HookFault`]. What it has started is ended with it where it takes too long.
pub(super) async fn run(
    command: &HookCommand,
    kind: HookKind,
    scan: &Path,
    message: &str,
    most: Duration,
) -> Result<(), HookFault> {
    let mut child = Command::new(command.program())
        .args(command.arguments())
        .env("FIELDGAP_EVENT", kind.name())
        .env("FIELDGAP_SCAN", scan)
        // No variable can hold a zero byte.
        .env("FIELDGAP_MESSAGE", message.replace('\0', " "))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        // A Ctrl-C at the scan's terminal is not meant for it.
        .process_group(0)
        .kill_on_drop(true)
        .spawn()
        .map_err(HookFault::NotStarted)?;
    let group = child.id().and_then(|id| Pid::from_raw(i32::try_from(id).ok()?));
    let complaints = child.stderr.take().map(|stderr| tokio::spawn(read_some(stderr)));
    let Ok(ended) = timeout(most, child.wait()).await else {
        if let Some(group) = group {
            let _ = kill_process_group(group, Signal::KILL);
        }
        return Err(HookFault::TooLong(most));
    };
    let status = ended.map_err(HookFault::Lost)?;
    if status.success() {
        return Ok(());
    }
    let said = match complaints {
        Some(complaints) => {
            timeout(LAST_WORDS, complaints).await.ok().and_then(Result::ok).unwrap_or_default()
        }
        None => String::new(),
    };
    let said = if said.is_empty() { said } else { format!(": {said}") };
    Err(HookFault::Failed { status, said })
}

/// The beginning of what it complains of, on one line. The rest is read and dropped, so that it never waits to be read.
async fn read_some(mut stderr: ChildStderr) -> String {
    let mut kept = Vec::new();
    let _ = (&mut stderr).take(KEPT).read_to_end(&mut kept).await;
    if kept.len() as u64 == KEPT {
        let _ = tokio::io::copy(&mut stderr, &mut tokio::io::sink()).await;
    }
    let text = String::from_utf8_lossy(&kept);
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;
    use fieldgap_input::toml_text;

    #[derive(Deserialize)]
    struct File {
        hook: HookCommand,
    }

    fn sh(script: &str, file: &Path) -> HookCommand {
        let file = file.to_string_lossy();
        let words = format!("hook = [\"sh\", \"-c\", '''{script}''', \"sh\", \"{file}\"]\n");
        toml_text::<File>(Path::new("plan.toml"), &words).expect("a command").hook
    }

    async fn run_for(script: &str, most: Duration) -> (Result<(), HookFault>, String) {
        let home = tempfile::tempdir().expect("a folder");
        let file = home.path().join("told");
        let command = sh(script, &file);
        let scan = Path::new("out/overnight");
        let result = run(&command, HookKind::Question, scan, "two\0words", most).await;
        (result, std::fs::read_to_string(&file).unwrap_or_default())
    }

    #[tokio::test]
    async fn it_is_told_what_happened_where() {
        let script =
            r#"printf "%s|%s|%s" "$FIELDGAP_EVENT" "$FIELDGAP_SCAN" "$FIELDGAP_MESSAGE" > "$1""#;
        let (result, told) = run_for(script, MOST).await;
        result.expect("it does");
        assert_eq!(told, "question|out/overnight|two words");
    }

    #[tokio::test]
    async fn what_it_complains_of_is_kept_and_cut_short() {
        let (result, _) = run_for("echo no network >&2; exit 3", MOST).await;
        let fault = result.expect_err("it fails").to_string();
        assert!(fault.contains('3') && fault.ends_with(": no network"), "{fault}");
        let (result, _) = run_for("yes | head -c 1000000 >&2; exit 1", MOST).await;
        assert!(result.expect_err("it fails").to_string().len() < 600);
    }

    #[tokio::test]
    async fn one_that_hangs_is_ended_with_what_it_started() {
        let (result, told) =
            run_for("(sleep 600; echo late) & wait", Duration::from_millis(100)).await;
        assert!(matches!(result, Err(HookFault::TooLong(_))), "{result:?}");
        assert_eq!(told, "");
    }

    #[tokio::test]
    async fn a_program_that_is_not_there_is_said() {
        let words = "hook = \"/no/such/program at all\"\n";
        let hook = toml_text::<File>(Path::new("plan.toml"), words).expect("a command").hook;
        let result = run(&hook, HookKind::Finish, Path::new("out"), "", MOST).await;
        assert!(matches!(result, Err(HookFault::NotStarted(_))));
    }
}
