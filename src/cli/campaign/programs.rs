//! Programs that set and confirm conditions.

use std::process::Stdio;
use std::time::Duration;

use tokio::io::AsyncReadExt;
use tokio::process::Command;
use tokio::time::timeout;

use fieldgap_input::visible_line;
use fieldgap_records::HookCommand;

/// Longest run time of a program that sets a condition: a climate chamber may take a night.
pub(super) const SETTING_LIMIT: Duration = Duration::from_secs(12 * 3600);

/// Longest run time of a program that reads a value.
pub(super) const READING_LIMIT: Duration = Duration::from_secs(60);

/// Bytes of each output that are kept.
const KEPT: u64 = 4096;

/// Runs a program to its end, for at most `time_limit`, and gives what it prints. It ends with this process.
///
/// # Errors
/// It does not start, takes too long, or ends without success; with the beginning of its standard error.
pub(super) async fn run(command: &HookCommand, time_limit: Duration) -> Result<String, String> {
    let program = command.program();
    let mut child = Command::new(program)
        .args(command.arguments())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        // Ctrl-C at the campaign's terminal must not end the program.
        .process_group(0)
        .kill_on_drop(true)
        .spawn()
        .map_err(|error| format!("{program} cannot be started: {error}"))?;
    let (mut out, mut err) = (child.stdout.take(), child.stderr.take());
    let work = async {
        let (out, err) = tokio::join!(kept(out.as_mut()), kept(err.as_mut()));
        (child.wait().await, out, err)
    };
    let Ok((status, out, err)) = timeout(time_limit, work).await else {
        return Err(format!("{program} did not end within {} s", time_limit.as_secs()));
    };
    match status {
        Ok(status) if status.success() => Ok(out.trim().to_owned()),
        Ok(status) => Err(format!("{program} failed ({status}): {}", visible_line(err.trim()))),
        Err(error) => Err(format!("how {program} ended is unknown: {error}")),
    }
}

/// The beginning of an output. The rest is read and dropped, so that the program never blocks on it.
async fn kept(output: Option<&mut (impl tokio::io::AsyncRead + Unpin)>) -> String {
    let Some(output) = output else { return String::new() };
    let mut bytes = Vec::new();
    let _ = (&mut *output).take(KEPT).read_to_end(&mut bytes).await;
    let _ = tokio::io::copy(output, &mut tokio::io::sink()).await;
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sh(script: &str) -> HookCommand {
        let words = toml::Value::try_from(["sh", "-c", script]).expect("words");
        words.try_into().expect("a command")
    }

    #[tokio::test]
    async fn what_it_prints_is_given_and_what_it_complains_about_is_told() {
        assert_eq!(run(&sh("echo 21.5"), READING_LIMIT).await, Ok("21.5".to_owned()));
        let fault = run(&sh("echo broken >&2; exit 2"), READING_LIMIT).await.expect_err("it fails");
        assert!(fault.contains("exit status: 2") && fault.ends_with("broken"), "{fault}");
        let long = run(&sh("yes | head -c 1000000"), READING_LIMIT).await.expect("it ends");
        assert!(long.len() <= KEPT as usize);
    }

    #[tokio::test]
    async fn a_program_that_hangs_is_given_up() {
        let fault = run(&sh("sleep 600"), Duration::from_millis(50)).await.expect_err("it hangs");
        assert!(fault.contains("did not end"), "{fault}");
    }
}
