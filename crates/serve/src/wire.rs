//! The last minute of what passed over the wires of a scan.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use jiff::Timestamp;
use serde::Serialize;

use fieldgap_input::visible_line;

/// How far back the lines go, s.
const LAST_S: f64 = 60.0;

/// Most of a log that is read, from its end, bytes.
const MOST_READ: u64 = 256 << 10;

/// Most lines of a device.
const MOST_LINES: usize = 300;

/// The lines of one device.
#[derive(Debug, Serialize)]
pub(crate) struct Wire {
    device: String,
    lines: Vec<String>,
}

/// The wires of the scan in `folder`: of each, the lines of the last minute before `now`, and at least the last line.
pub(crate) fn last_minute(folder: &Path, now: Timestamp) -> Vec<Wire> {
    let files = fs::read_dir(folder.join("wire")).into_iter().flatten().filter_map(Result::ok);
    let mut logs: Vec<_> = files
        .map(|file| file.path())
        .filter(|path| path.extension().is_some_and(|end| end == "log"))
        .collect();
    logs.sort();
    let wire = |path: &std::path::PathBuf| {
        let device = path.file_stem()?.to_string_lossy().into_owned();
        Some(Wire { device, lines: lines(path, now).unwrap_or_default() })
    };
    logs.iter().filter_map(wire).filter(|wire| !wire.lines.is_empty()).collect()
}

/// Lines begin with the seconds since the log's first line, which has the time: `0.000054 @ /dev/pts/2 2026-11-24T12:43:09Z`.
fn lines(path: &Path, now: Timestamp) -> io::Result<Vec<String>> {
    let mut file = File::open(path)?;
    let mut head = [0; 256];
    let read = file.read(&mut head)?;
    let head = String::from_utf8_lossy(&head[..read]).into_owned();
    let mut words = head.lines().next().unwrap_or_default().split(' ');
    let began_s = words.next().and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
    let began = words.nth(2).and_then(|at| at.parse::<Timestamp>().ok()).unwrap_or(now);
    let now_s = began_s + now.duration_since(began).as_secs_f64();
    let from = file.metadata()?.len().saturating_sub(MOST_READ);
    file.seek(SeekFrom::Start(from))?;
    let mut bytes = Vec::new();
    file.take(MOST_READ).read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    // The first line may be cut.
    let whole = text.lines().skip(usize::from(from > 0));
    let all: Vec<(f64, &str)> =
        whole.filter_map(|line| Some((line.split_once(' ')?.0.parse().ok()?, line))).collect();
    let first = all
        .iter()
        .position(|(at_s, _)| now_s - at_s <= LAST_S)
        .unwrap_or(all.len().saturating_sub(1));
    let first = first.max(all.len().saturating_sub(MOST_LINES));
    Ok(all[first..].iter().map(|(_, line)| visible_line(line).into_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_minute_is_shown_and_at_least_the_last_line() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("wire")).expect("made");
        let log = "0.5 @ /dev/ttyUSB0 2026-11-24T12:00:00Z 1\n10.0 > M114\n30.0 < ok\n95.0 > \u{1b}M400\n";
        fs::write(folder.path().join("wire/robot.log"), log).expect("written");
        let at = |time: &str| last_minute(folder.path(), time.parse().expect("a time"));
        let [robot] = &at("2026-11-24T12:01:20Z")[..] else { panic!("one device") };
        assert_eq!(robot.device, "robot");
        assert_eq!(robot.lines.len(), 2);
        assert!(
            robot.lines[0].starts_with("30.0 < ok") && !robot.lines[1].contains('\u{1b}'),
            "{:?}",
            robot.lines
        );
        assert_eq!(at("2026-11-24T14:00:00Z")[0].lines.len(), 1);
        assert!(last_minute(Path::new("/no/such/folder"), Timestamp::now()).is_empty());
    }
}
