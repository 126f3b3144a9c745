//! Campaigns in a laboratory whose clock moves when somebody waits.

mod fake;

use std::collections::BTreeSet;

use self::fake::{FakeLaboratory, SCAN, Scan, campaign, folder, run};
use fieldgap_campaign::{
    CampaignEnd, CampaignFolder, CellState, CellStatus, Laboratory, Selection,
};

const TWO_FOCI: &str =
    "[[axis]]\nname = \"focus\"\nparameter = \"focus.0.x_mm\"\nvalues = [0.0, 10.0]\n";

#[test]
fn every_cell_of_every_round_is_measured_once_at_its_time() {
    let text = format!("{TWO_FOCI}[schedule]\nrounds = 3\nevery = \"6h\"\ntime_zone = \"UTC\"\n");
    let campaign = campaign(&text);
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let (_keep, folder) = folder();
    assert_eq!(run(&campaign, &laboratory, &folder, Selection::Open), CampaignEnd::Done);
    let measured = laboratory.measured_cells();
    assert_eq!(measured.iter().collect::<BTreeSet<_>>().len(), 6, "{measured:?}");
    let times: Vec<String> =
        laboratory.measured.borrow().iter().map(|(at, _)| (*at - SCAN).to_string()).collect();
    assert_eq!(times[0], "2026-11-23T08:00:00Z");
    assert_eq!(times[2], "2026-11-23T14:00:00Z");
    assert_eq!(times[4], "2026-11-23T20:00:00Z");
}

#[test]
fn a_killed_campaign_goes_on_where_it_was() {
    let campaign = campaign(&format!("repeats = 4\n{TWO_FOCI}[schedule]\nrounds = 2\n"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let mut count = 0;
    *laboratory.scans.borrow_mut() = Box::new(move |_| {
        count += 1;
        if count % 3 == 0 { Scan::Killed } else { Scan::Complete }
    });
    let (_keep, folder) = folder();
    let mut kills = 0;
    while let CampaignEnd::Early(_) = run(&campaign, &laboratory, &folder, Selection::Open) {
        laboratory.revive();
        kills += 1;
        // The last line may be incomplete after a kill.
        let log = folder.join("campaign.jsonl");
        let text = std::fs::read_to_string(&log).expect("there");
        std::fs::write(&log, text + "{\"at\":\"2026-").expect("written");
    }
    assert!(kills >= 7, "{kills}");
    let measured = laboratory.measured_cells();
    assert_eq!((measured.len(), measured.iter().collect::<BTreeSet<_>>().len()), (16, 16));
}

#[test]
fn a_rig_that_fails_three_cells_in_a_row_is_left_alone_and_others_go_on() {
    let rigs = "rigs = [\"../rigs/virtual.toml\", \"../rigs/virtual-grbl.toml\"]\nrepeats = 3\n";
    let campaign = campaign(&format!("{rigs}{TWO_FOCI}[retry]\nattempts = 0\n"));
    let [broken, good] = [0, 1].map(|bench| campaign.benches[bench].name.clone());
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    assert!(good.contains("grbl") && !broken.contains("grbl"));
    *laboratory.scans.borrow_mut() =
        Box::new(|cell| if cell.contains("grbl") { Scan::Complete } else { Scan::Fails });
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(laboratory.measured_cells().len(), 6, "{:?}", laboratory.measured_cells());
    assert!(laboratory.measured_cells().iter().all(|cell| cell.contains(&good)));
    let told = laboratory.told.borrow();
    assert_eq!(told.iter().filter(|line| line.starts_with("failed")).count(), 3, "{told:?}");
    assert!(
        told.iter()
            .any(|line| line.starts_with(&format!("left {broken}: 3 cells in a row failed")))
    );
}

#[test]
fn only_failed_cells_are_tried_again() {
    let campaign =
        campaign(&format!("repeats = 3\n{TWO_FOCI}[retry]\nattempts = 1\nwait_min = 5\n"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    *laboratory.scans.borrow_mut() = Box::new(|cell| {
        if cell.contains("x=10") || cell.contains("=10.0") { Scan::Fails } else { Scan::Complete }
    });
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    let failed = |folder: &std::path::Path| {
        let state = CampaignFolder::read(folder).expect("a state");
        let failed = |state: &CellState| matches!(state, CellState::Failed { .. });
        state.cells.values().filter(|log| failed(&log.state)).count()
    };
    assert_eq!((laboratory.measured_cells().len(), failed(&folder)), (3, 3));
    let before = laboratory.measured_cells();
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::Complete);
    assert_eq!(run(&campaign, &laboratory, &folder, Selection::Open), CampaignEnd::Done);
    assert_eq!(laboratory.measured_cells(), before, "failed cells wait until they are asked for");
    run(&campaign, &laboratory, &folder, Selection::Failed);
    assert_eq!((laboratory.measured_cells().len(), failed(&folder)), (6, 0));
}

#[test]
fn a_record_without_its_setup_is_moved_aside_and_its_cell_measured_anew() {
    let campaign = campaign(&format!("{TWO_FOCI}[retry]\nattempts = 0\n"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::KilledBeforeItsSetup);
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    laboratory.revive();
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::Complete);
    assert_eq!(run(&campaign, &laboratory, &folder, Selection::Open), CampaignEnd::Done);
    assert_eq!(laboratory.measured_cells().len(), 2);
    let aside = std::fs::read_dir(folder.join("cells")).expect("cells").filter(|entry| {
        let name = entry.as_ref().expect("an entry").file_name();
        name.to_string_lossy().contains(".interrupted-")
    });
    assert_eq!(aside.count(), 1, "what was there is kept");
}

#[test]
fn a_cell_whose_process_was_killed_between_two_attempts_has_those_that_are_left() {
    let campaign = campaign("[retry]\nattempts = 2\nwait_min = 5\n");
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::Fails);
    laboratory.killed_waiting.set(true);
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    let failures = || {
        let told = laboratory.told.borrow();
        told.iter().filter(|line| line.starts_with("failed")).count()
    };
    assert_eq!(failures(), 1);
    laboratory.revive();
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(failures(), 3);
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(failures(), 3, "none is left");
    run(&campaign, &laboratory, &folder, Selection::Failed);
    assert_eq!(failures(), 6, "asked for, it has all again");
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::Killed);
    run(&campaign, &laboratory, &folder, Selection::Failed);
    laboratory.revive();
    *laboratory.scans.borrow_mut() = Box::new(|_| Scan::Fails);
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(failures(), 7, "the interrupted attempt is made again, and no further one");
}

#[test]
fn a_cell_that_was_changed_in_the_file_is_known_and_measured_again_when_asked_for() {
    let first = campaign(TWO_FOCI);
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let (_keep, folder) = folder();
    run(&first, &laboratory, &folder, Selection::Open);
    // Another step of one value: its label is the same.
    let second = campaign(
        &TWO_FOCI
            .replace("values = [0.0, 10.0]", "values = [0.0, 11.0]\nlabels = [\"0.0\", \"10.0\"]"),
    );
    run(&second, &laboratory, &folder, Selection::Open);
    assert_eq!(laboratory.measured_cells().len(), 2);
    let overview = laboratory.last.borrow_mut().take().expect("drawn");
    let changed = |status: &CellStatus| matches!(status, CellStatus::Done { changed: true, .. });
    let changed: Vec<&str> = overview
        .cells
        .iter()
        .filter(|cell| changed(&cell.status))
        .map(|cell| cell.setting.as_str())
        .collect();
    assert_eq!(changed, ["focus=10.0"]);
    run(&second, &laboratory, &folder, Selection::Changed);
    assert_eq!(laboratory.measured_cells().len(), 3);
    let kept: Vec<String> = std::fs::read_dir(folder.join("cells"))
        .expect("cells")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name.contains("before-change"))
        .collect();
    assert_eq!(kept.len(), 1, "the old record is kept");
}

#[test]
fn a_condition_is_confirmed_before_its_cells_or_they_are_left_out() {
    let condition = "[[condition]]\nname = \"temperature\"\nvalues = [20.0, 30.0]\nset = [\"./chamber\", \"{value}\"]\n\
                     confirm = { sensor = \"temperature_c\", tolerance = 0.5, within_min = 10, every_s = 60 }\n";
    let campaign = campaign(condition);
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    // The chamber warms by a degree a minute, and never reaches 30.
    let mut read = 15.0_f64;
    *laboratory.readings.borrow_mut() = Box::new(move |_| {
        read = (read + 1.0).min(24.0);
        Some(read)
    });
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(laboratory.measured_cells(), ["r001-temperature=20.0"]);
    let began = laboratory.measured.borrow()[0].0 - SCAN;
    assert_eq!(began.to_string(), "2026-11-23T08:04:00Z");
    let told = laboratory.told.borrow();
    assert!(
        told.iter().any(|line| line
            .contains("not set temperature 30.0: not confirmed within 10.0 min: 24 was read")),
        "{told:?}"
    );
}

#[test]
fn the_page_shows_a_question_while_a_person_is_asked() {
    let condition = "[[condition]]\nname = \"screen\"\nvalues = [\"in\", \"out\"]\nask = \"Is the screen {value}?\"\n";
    let campaign = campaign(&format!("order = \"given\"\n{condition}"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    let shown = laboratory.shown_questions.borrow();
    assert_eq!(*shown, ["Is the screen in?", "Is the screen out?"]);
    let last = laboratory.last.borrow_mut().take().expect("drawn");
    assert_eq!((last.question, laboratory.measured_cells().len()), (None, 2));
    // Whatever the answer was, the question is gone from the page.
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    *laboratory.refused.borrow_mut() = "in".to_owned();
    let (_keep, folder) = self::folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(laboratory.measured_cells().len(), 1);
    assert_eq!(*laboratory.shown_questions.borrow(), ["Is the screen in?", "Is the screen out?"]);
}

#[test]
fn a_budget_ends_the_campaign_before_it_is_exceeded() {
    // Each scan is planned to take 29 s, and takes 25 s.
    let campaign = campaign(&format!("repeats = 10\n{TWO_FOCI}[budget]\nemitting_min = 2\n"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let (_keep, folder) = folder();
    let CampaignEnd::Early(reason) = run(&campaign, &laboratory, &folder, Selection::Open) else {
        panic!("the budget does not suffice");
    };
    assert!(reason.contains("2 min with the array driven"), "{reason}");
    let used = CampaignFolder::read(&folder).expect("a state").used.emitting_s;
    assert!((75.0..=120.0).contains(&used), "{used}");
}

#[test]
fn a_gap_that_grows_raises_one_alarm_with_its_cause() {
    let campaign = campaign(&format!(
        "{TWO_FOCI}[schedule]\nrounds = 12\nevery = \"1h\"\ntime_zone = \"UTC\"\n"
    ));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let mut number = 0_u32;
    *laboratory.gaps.borrow_mut() = Box::new(move |cell| {
        number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.001 * (f64::from(number) / f64::from(u32::MAX) - 0.5);
        let grown = if &cell[1..4] > "008" { 1.1 } else { 1.0 };
        0.18 * grown + noise
    });
    let (_keep, folder) = folder();
    run(&campaign, &laboratory, &folder, Selection::Open);
    let state = CampaignFolder::read(&folder).expect("a state");
    let first = state.alarms.first().expect("an alarm");
    assert_eq!(first.alarm.figure, "gap");
    assert!(first.cell.starts_with("r009"), "{}", first.cell);
    let cause = first.cause.as_deref().expect("a cause");
    assert!(cause.starts_with("r009") && cause.contains("against r008"), "{cause}");
}

#[test]
fn a_request_to_stop_ends_after_the_cell_and_is_no_failure() {
    let campaign = campaign(&format!("repeats = 4\n{TWO_FOCI}"));
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    laboratory.stop_after.set(3);
    let (_keep, folder) = folder();
    let end = run(&campaign, &laboratory, &folder, Selection::Open);
    assert_eq!(end, CampaignEnd::Early("asked to stop".to_owned()));
    assert_eq!(laboratory.measured_cells().len(), 3);
    assert!(laboratory.stop_asked().is_some());
    laboratory.stop_after.set(usize::MAX);
    assert_eq!(run(&campaign, &laboratory, &folder, Selection::Open), CampaignEnd::Done);
    assert_eq!(laboratory.measured_cells().len(), 8);
}

#[test]
fn two_processes_do_not_run_one_campaign() {
    let campaign = campaign(TWO_FOCI);
    let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
    let (_keep, folder) = folder();
    let first = CampaignFolder::begin(&campaign, &folder, 1, laboratory.now()).expect("begun");
    let busy = CampaignFolder::open(&folder).expect_err("another runs it").to_string();
    assert!(busy.contains("another process runs"), "{busy}");
    assert!(CampaignFolder::is_running(&folder));
    drop(first);
    assert!(!CampaignFolder::is_running(&folder));
}

#[test]
fn another_campaign_is_the_baseline_from_the_first_round_on() {
    let rounds = format!("{TWO_FOCI}[schedule]\nrounds = 6\nevery = \"1h\"\ntime_zone = \"UTC\"\n");
    let noisy = |grown: f64| {
        let mut number = 1_u32;
        move |_: &str| {
            number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.18 * grown + 0.001 * (f64::from(number) / f64::from(u32::MAX) - 0.5)
        }
    };
    let laboratory = FakeLaboratory::at("2026-10-23T08:00:00Z");
    *laboratory.gaps.borrow_mut() = Box::new(noisy(1.0));
    let (_keep, last_month) = folder();
    run(&campaign(&rounds), &laboratory, &last_month, Selection::Open);
    // The file of the first campaign is gone; its folder has a copy, whose paths hold.
    let baseline = format!("{rounds}[baseline]\ncampaign = \"{}\"\n", last_month.display());
    for (grown, alarms) in [(1.0, false), (1.1, true)] {
        let laboratory = FakeLaboratory::at("2026-11-23T08:00:00Z");
        let before = noisy(1.0);
        let now = noisy(grown);
        let (mut before, mut now) = (before, now);
        let old = last_month.clone();
        *laboratory.gaps_by_folder.borrow_mut() = Some(Box::new(
            move |folder: &std::path::Path| {
                if folder.starts_with(&old) { before("") } else { now("") }
            },
        ));
        let (_keep, folder) = folder();
        run(&campaign(&baseline), &laboratory, &folder, Selection::Open);
        let state = CampaignFolder::read(&folder).expect("a state");
        assert_eq!(!state.alarms.is_empty(), alarms, "{grown}: {:?}", state.alarms);
        if alarms {
            assert!(state.alarms[0].cell.starts_with("r001"), "{}", state.alarms[0].cell);
        }
    }
}
