//! Running a hook: a program that notifies a person of an event of a scan.

use std::io;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use tokio::io::AsyncReadExt;
use tokio::process::{ChildStderr, Command};
use tokio::time::timeout;

use fieldgap_records::{HookCommand, HookKind};

/// Longest run time of a hook.
pub const TIME_LIMIT: Duration = Duration::from_secs(30);

/// Bytes of its standard error that are kept.
const KEPT: u64 = 400;

/// How long to wait for its standard error after it has ended: a child process may hold it open.
const STDERR_TIME_LIMIT: Duration = Duration::from_millis(200);

/// How a hook failed.
#[derive(Debug, thiserror::Error)]
pub enum HookFault {
    /// The program is missing or may not be run.
    #[error("it cannot be started: {0}")]
    NotStarted(#[source] io::Error),
    /// It hangs.
    #[error("it did not end within {} s and was killed", .0.as_secs())]
    TooLong(Duration),
    /// It ended without success.
    #[error("it failed ({status}){said}")]
    Failed {
        /// Its exit status.
        status: ExitStatus,
        /// The beginning of its standard error.
        said: String,
    },
    /// The system does not tell how it ended.
    #[error("its exit status is unknown: {0}")]
    Lost(#[source] io::Error),
}

/// Runs the hook of a scan to its end, for at most `time_limit`. The environment variables `FIELDGAP_EVENT`, `FIELDGAP_SCAN` and
/// `FIELDGAP_MESSAGE` hold the kind of event, the scan's folder and a message.
///
/// # Errors
/// As [`run_hook`].
pub(super) async fn run(
    command: &HookCommand,
    kind: HookKind,
    scan: &Path,
    message: &str,
    time_limit: Duration,
) -> Result<(), HookFault> {
    let variables = [
        ("FIELDGAP_EVENT", kind.name().to_owned()),
        ("FIELDGAP_SCAN", scan.to_string_lossy().into_owned()),
        ("FIELDGAP_MESSAGE", message.to_owned()),
    ];
    run_hook(command, &variables, time_limit).await
}

/// Runs a hook to its end, for at most `time_limit`, with these environment variables. Only its standard error is read.
///
/// # Errors
/// [`HookFault`]. A hook that takes too long is killed, with all processes that it started.
pub async fn run_hook(
    command: &HookCommand,
    variables: &[(&str, String)],
    time_limit: Duration,
) -> Result<(), HookFault> {
    // No variable can hold a zero byte.
    let variables = variables.iter().map(|(name, value)| (name, value.replace('\0', " ")));
    let mut child = Command::new(command.program())
        .args(command.arguments())
        .envs(variables)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        // Ctrl-C at the scan's terminal must not end the hook.
        .process_group(0)
        .kill_on_drop(true)
        .spawn()
        .map_err(HookFault::NotStarted)?;
    let group = child.id().and_then(|id| Pid::from_raw(i32::try_from(id).ok()?));
    let stderr_text = child.stderr.take().map(|stderr| tokio::spawn(read_some(stderr)));
    let Ok(ended) = timeout(time_limit, child.wait()).await else {
        if let Some(group) = group {
            let _ = kill_process_group(group, Signal::KILL);
        }
        return Err(HookFault::TooLong(time_limit));
    };
    let status = ended.map_err(HookFault::Lost)?;
    if status.success() {
        return Ok(());
    }
    let said = match stderr_text {
        Some(stderr_text) => timeout(STDERR_TIME_LIMIT, stderr_text)
            .await
            .ok()
            .and_then(Result::ok)
            .unwrap_or_default(),
        None => String::new(),
    };
    let said = if said.is_empty() { said } else { format!(": {said}") };
    Err(HookFault::Failed { status, said })
}

/// The beginning of its standard error, on one line. The rest is read and dropped, so that the hook never blocks on it.
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

    async fn run_for(script: &str, time_limit: Duration) -> (Result<(), HookFault>, String) {
        let home = tempfile::tempdir().expect("a folder");
        let file = home.path().join("told");
        let command = sh(script, &file);
        let scan = Path::new("out/overnight");
        let result = run(&command, HookKind::Question, scan, "two\0words", time_limit).await;
        (result, std::fs::read_to_string(&file).unwrap_or_default())
    }

    #[tokio::test]
    async fn it_receives_event_folder_and_message() {
        let script =
            r#"printf "%s|%s|%s" "$FIELDGAP_EVENT" "$FIELDGAP_SCAN" "$FIELDGAP_MESSAGE" > "$1""#;
        let (result, told) = run_for(script, TIME_LIMIT).await;
        result.expect("it does");
        assert_eq!(told, "question|out/overnight|two words");
    }

    #[tokio::test]
    async fn its_standard_error_is_kept_and_truncated() {
        let (result, _) = run_for("echo no network >&2; exit 3", TIME_LIMIT).await;
        let fault = result.expect_err("it fails").to_string();
        assert!(fault.contains('3') && fault.ends_with(": no network"), "{fault}");
        let (result, _) = run_for("yes | head -c 1000000 >&2; exit 1", TIME_LIMIT).await;
        assert!(result.expect_err("it fails").to_string().len() < 600);
    }

    #[tokio::test]
    async fn a_hanging_hook_is_killed_with_its_children() {
        let (result, told) =
            run_for("(sleep 600; echo late) & wait", Duration::from_millis(100)).await;
        assert!(matches!(result, Err(HookFault::TooLong(_))), "{result:?}");
        assert_eq!(told, "");
    }

    #[tokio::test]
    async fn a_missing_program_is_reported() {
        let words = "hook = \"/no/such/program at all\"\n";
        let hook = toml_text::<File>(Path::new("plan.toml"), words).expect("a command").hook;
        let result = run(&hook, HookKind::Finish, Path::new("out"), "", TIME_LIMIT).await;
        assert!(matches!(result, Err(HookFault::NotStarted(_))));
    }
}
