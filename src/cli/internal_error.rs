//! Faults of the program itself. A panic unwinds: the drivers that it leaves silence the array and stop the robot, and the watchdog does so
//! again. Then the program ends with an exit code of its own.

use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;

use super::output::say;

/// Exit code of a fault of the program itself; that of sysexits.h for internal errors.
pub(super) const INTERNAL_ERROR: u8 = 70;

/// Does some work; a panic in it is reported and becomes [`INTERNAL_ERROR`].
pub(super) fn guarded(work: impl FnOnce() -> ExitCode) -> ExitCode {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| ExitCode::from(INTERNAL_ERROR))
}

/// Has every panic of any thread reported as an internal error, with its place. `RUST_BACKTRACE=1` adds what led there.
pub(super) fn report_panics() {
    let with_backtrace = take_hook();
    set_hook(Box::new(move |panic| {
        say(message(panic));
        if std::env::var_os("RUST_BACKTRACE").is_some_and(|set| set != "0") {
            with_backtrace(panic);
        }
    }));
}

fn message(panic: &PanicHookInfo<'_>) -> String {
    let what = panic.payload_as_str().unwrap_or("no message");
    let place = panic.location().map_or(String::new(), |place| format!(" ({place})"));
    format!(
        "internal error of fieldgap {}: {what}{place}\n  this is a fault of the program: please report it with the command and its files",
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_exit_code() {
        let code = |code: ExitCode| format!("{code:?}");
        assert_eq!(code(guarded(|| ExitCode::SUCCESS)), code(ExitCode::SUCCESS));
        let panicked = guarded(|| panic!("an internal fault"));
        assert_eq!(code(panicked), code(ExitCode::from(INTERNAL_ERROR)));
        let in_a_worker = guarded(|| {
            rayon::scope(|scope| scope.spawn(|_| panic!("in a worker")));
            ExitCode::SUCCESS
        });
        assert_eq!(code(in_a_worker), code(ExitCode::from(INTERNAL_ERROR)));
    }
}
