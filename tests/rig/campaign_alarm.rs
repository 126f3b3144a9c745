//! A transducer dies during a campaign on the virtual rig: an alarm is raised, and names the element and the times between which it died.

use std::path::Path;
use std::process::{Command, Stdio};

use fieldgap::campaign::CampaignFolder;
use fieldgap::records::Note;

const PLAN: &str = r#"
name = "watched"
rig = "rig.toml"
[simulator]
model = "piston"
[[focus]]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
[dark]
before = 4
[[plane]]
z_mm = [80.0, 120.0]
size_mm = [40.0, 40.0]
step_mm = 4.0
"#;

/// The hook that breaks the array after the eighth cell, as a failing driver would. It waits for the next second: records that were begun in the
/// same one have no order in time.
const CAMPAIGN: &str = r#"
name = "watch"
plan = "plan.toml"
[schedule]
rounds = 14
[hooks]
on_cell = ["sh", "-c", "echo . >> cells; if [ $(wc -l < cells) = 8 ]; then cat dead.toml >> truth.toml; now=$(date +%s); while [ $(date +%s) = $now ]; do :; done; fi"]
"#;

#[test]
fn an_element_that_dies_between_two_cells_is_named_with_the_times() {
    let home = tempfile::tempdir().expect("a folder");
    let write =
        |name: &str, text: &str| std::fs::write(home.path().join(name), text).expect("written");
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    let read = |file: &str| std::fs::read_to_string(rigs.join(file)).expect("it is there");
    write("rig.toml", &read("virtual.toml").replace("truth/thesis-lab.toml", "truth.toml"));
    write("truth.toml", &read("truth/thesis-lab.toml"));
    write("dead.toml", "\n[effects.dead-elements]\nelements = [17]\n");
    write("plan.toml", PLAN);
    write("watch.toml", CAMPAIGN);
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(["campaign", "run", "watch.toml", "--out", "watch", "--trust", "--json"])
        .current_dir(home.path())
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    let state = CampaignFolder::read(&home.path().join("watch")).expect("a campaign");
    let alarm = state.alarms.first().unwrap_or_else(|| panic!("no alarm:\n{text}"));
    // The ninth cell is the first with the dead element.
    assert!(["r009-all", "r010-all", "r011-all"].contains(&alarm.cell.as_str()), "{alarm:?}");
    let cause = alarm.cause.as_deref().expect("a cause");
    // Scans of a second follow each other: often in the same minute.
    let named = ["Element 17 died between ", "Element 17 died at "];
    assert!(named.iter().any(|words| cause.starts_with(words)), "{cause}");
    assert!(cause.contains(" UTC"), "{cause}");
    assert!(text.contains("\"event\":\"alarm\""));
    // The record has it too, where the history of records finds it.
    let record = home.path().join("watch/cells").join(&alarm.cell);
    let notes = Note::all_of(&record).expect("notes");
    assert!(notes.iter().any(|note| note.text().contains("Element 17 died")), "{notes:?}");
}
