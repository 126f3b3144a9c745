//! A rig that chooses its own readings: to the end, killed on the way, and replayed.

use std::path::Path;

use crate::dead_element_rig::{bench, copy, said};
use crate::program::fieldgap;
use fieldgap::acquisition::RigSetup;
use fieldgap::closed_loop::{End, Inquiry, Purpose, Round, Verification, read_rounds};
use fieldgap::diagnosis::{EffectId, Findings, Options, Verdict};
use fieldgap::input::TomlSource;
use fieldgap::records::{Plan, RecordedScan};

const PLAN: &str = "name = \"loop\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n\
                    [closed_loop]\nmin_mm = [-30.0, -30.0, 80.0]\nmax_mm = [30.0, 30.0, 140.0]\n\
                    first_readings = 160\nround_readings = 64\nsmallest_gap_sigma = 0.25\n[closed_loop.verify]\nreadings = 32\n";

#[test]
fn a_loop_finds_a_dead_element_and_proves_it_and_goes_on_alike_when_it_was_killed() {
    let folder = bench(PLAN);
    let run = fieldgap(folder.path(), &["run", "plan.toml", "--out", "whole"]);
    assert!(run.status.success(), "{}", said(&run));
    let whole = folder.path().join("whole");
    let rounds = read_rounds(&whole).expect("rounds");
    let last = rounds.last().expect("several");
    assert_eq!(last.end, Some(End::Verified), "{}", last.reason);
    let named: Vec<&str> = last.named[0].iter().map(|id| id.as_str()).collect();
    assert_eq!(named, ["dead-elements"]);
    let verification = last.verification.expect("it was tested");
    assert!(verification.holds && verification.gap_after < 0.6 * verification.gap_before);
    let tested = &rounds[rounds.len() - 2];
    assert_eq!(tested.purpose, Purpose::Verify);
    // A cause is tested after a search among all sets, not only those that were in question.
    let plan = Plan::read(&whole.join("plan.toml")).expect("a plan");
    let mut before = RecordedScan::open(&whole).expect("a record");
    before.samples.truncate(tested.before);
    let options = Options { simulator: Some(plan.simulator), ..Options::default() };
    let searched = Findings::of(std::slice::from_ref(&before), &options).expect("comparable");
    assert_eq!(tested.probabilities[0].probability, searched.probabilities()[0].1);

    // The set-up was corrected in files of the record, these were simulated, and they are what is left of it all.
    let cure = tested.cure.as_ref().expect("it was corrected");
    let file = verification.corrected.expect("it was simulated");
    assert!(file.chi_square < Verification::MOST_CHI_SQUARE && file.departure < 0.05, "{file:?}");
    assert!(file.gap + 3.0 * file.gap_error < verification.gap_before, "{verification:?}");
    assert!(last.reason.contains("simulated with the corrected set-up"), "{}", last.reason);
    let corrected = whole.join(cure.folder.as_ref().expect("a folder"));
    for name in ["scan.toml", "elements.csv"] {
        let read = |folder: &Path| std::fs::read_to_string(folder.join(name)).expect("there");
        assert_eq!(read(&corrected), read(&whole.join("corrected")), "{name}");
    }
    let rig = std::fs::read_to_string(corrected.join("rig.toml")).expect("for future scans");
    assert!(rig.contains("rig-elements.csv"), "{rig}");
    let own = |name| std::fs::read_to_string(folder.path().join(name)).expect("there");
    assert!(own("rig.toml") == own("whole/rig.toml") && own("plan.toml") == PLAN);

    // The page of the rounds is linked, and made again from the record alone.
    let first_page = std::fs::read_to_string(whole.join("report/index.html")).expect("a page");
    assert!(first_page.contains("href=\"rounds/index.html\""));
    let again = fieldgap(folder.path(), &["replay", "whole", "--out", "again"]);
    assert!(again.status.success(), "{}", said(&again));
    let page = |report: &str| {
        std::fs::read_to_string(folder.path().join(report).join("rounds/index.html"))
            .expect("there")
    };
    assert!(page("whole/report").contains("verified on fresh readings"));
    assert!(page("whole/report") == page("again"));

    // The plan of the record names every reading, in the order in which it was taken.
    let record = RecordedScan::open(&whole).expect("a record");
    let visits = plan.visits();
    assert_eq!(visits.len(), record.samples.len());
    for (visit, sample) in visits.iter().zip(&record.samples) {
        assert_eq!(visit.focus, sample.focus);
        assert!((visit.position_m - sample.position_m()).norm() < 1e-4);
    }

    let replayed = fieldgap(folder.path(), &["replay", "whole", "--rounds"]);
    assert!(replayed.status.success(), "{}", said(&replayed));
    assert_eq!(said(&replayed).matches("the same").count(), rounds.len());

    a_wrong_file_is_taken_back_and_the_loop_goes_on(folder.path(), &rounds);

    // As if it had been killed after the decision of a round, before the first of its readings: the decision is made again.
    let killed = folder.path().join("killed");
    copy(&whole, &killed);
    let kept = rounds[1].before;
    cut(&killed, kept);
    let longer = std::fs::read_to_string(killed.join("plan.toml")).expect("there");
    let second = longer.match_indices("[[readings]]").nth(1).expect("several rounds").0;
    let comment = longer[..second].rfind("\n#").expect("its reason") + 1;
    std::fs::write(killed.join("plan.toml"), &longer[..comment]).expect("written");
    let resumed = fieldgap(folder.path(), &["resume", "killed"]);
    assert!(resumed.status.success(), "{}", said(&resumed));
    let after = read_rounds(&killed).expect("rounds");
    assert_eq!(after[..2], rounds[..2]);
    let plan = Plan::read(&killed.join("plan.toml")).expect("a plan");
    assert_eq!(plan.visits()[..kept + rounds[1].readings], visits[..kept + rounds[1].readings]);
    assert_eq!(after.last().and_then(|round| round.end), Some(End::Verified));
}

/// As if the corrected set-up had come out wrong: another element is silent in its file, while the cause as it was fitted holds.
fn a_wrong_file_is_taken_back_and_the_loop_goes_on(folder: &Path, rounds: &[Round]) {
    let whole = folder.join("whole");
    let wrong = folder.join("wrong");
    copy(&whole, &wrong);
    let tested = &rounds[rounds.len() - 2];
    let name = tested.cure.as_ref().and_then(|cure| cure.folder.as_ref()).expect("a folder");
    copy(&whole.join(name), &wrong.join(name));
    let elements = wrong.join(name).join("elements.csv");
    let text = std::fs::read_to_string(&elements).expect("there");
    let mut rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let (header, elements_rows) = rows.split_first_mut().expect("a header");
    let amplitude = header.iter().position(|name| *name == "amplitude").expect("a column");
    assert_eq!(elements_rows[14][amplitude].parse(), Ok(0.0), "{text}");
    (elements_rows[14][amplitude], elements_rows[21][amplitude]) = ("1", "0");
    let lines: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    std::fs::write(&elements, lines.join("\n") + "\n").expect("written");

    let replayed = fieldgap(folder, &["replay", "wrong", "--rounds"]);
    assert_eq!(replayed.status.code(), Some(1), "{}", said(&replayed));
    let words = said(&replayed);
    assert_eq!(words.matches("the same").count(), rounds.len() - 1, "{words}");
    assert!(words.contains("The corrected set-up did not hold on fresh readings"), "{words}");

    // Killed among the fresh readings.
    cut(&wrong, tested.before + 5);
    let resumed = fieldgap(folder, &["resume", "wrong"]);
    assert!(resumed.status.success(), "{}", said(&resumed));
    let after = read_rounds(&wrong).expect("rounds");
    assert_eq!(after[..rounds.len() - 1], rounds[..rounds.len() - 1]);
    let back = &after[rounds.len() - 1];
    let failed = back.verification.expect("it was tested");
    assert!(!failed.holds && failed.chi_square < Verification::MOST_CHI_SQUARE, "{failed:?}");
    assert_eq!((back.end, back.purpose), (None, Purpose::Explore), "{}", back.reason);
    // Its next verification is of files that were corrected anew.
    let end = after.last().expect("several");
    assert_eq!(end.end, Some(End::Verified), "{}", end.reason);
}

/// The readings of a round have a cause that no earlier reading had: none of the sets that were in question explains it, and the decision is that
/// of a search.
#[test]
fn what_the_sets_in_question_leave_unexplained_is_searched_for() {
    let plan = PLAN.replace(
        "first_readings = 160\nround_readings = 64",
        "first_readings = 64\nround_readings = 200\nreadings = 266",
    );
    let [well, dead] = [true, false].map(|is_well| {
        let folder = bench(&plan);
        if is_well {
            let truth = folder.path().join("truth.toml");
            let text = std::fs::read_to_string(&truth).expect("there");
            let (without, _) = text.split_once("[effects").expect("the cause");
            std::fs::write(&truth, without).expect("written");
        }
        let run = fieldgap(folder.path(), &["scan", "plan.toml", "--out", "record"]);
        assert!(run.status.success(), "{}", said(&run));
        folder
    });
    let record = |folder: &Path| RecordedScan::open(&folder.join("record")).expect("a record");
    let (well, mut both) = (record(well.path()), record(dead.path()));
    let folder = dead.path().join("record");
    let rounds = read_rounds(&folder).expect("rounds");
    let (first, second) = (rounds[1].before, rounds[2].before);
    both.samples[..first].copy_from_slice(&well.samples[..first]);
    both.samples.truncate(second);
    // Another round is decided upon, not the end of the readings, which a search would precede in any case.
    let path = folder.join("plan.toml");
    let text = std::fs::read_to_string(&path).expect("there");
    let text = text.replace("readings = 266", "readings = 2000");
    let mut plan = Plan::parse(TomlSource::new(&path, text)).expect("a plan");
    plan.readings.truncate(2);
    let rig = RigSetup::read(&dead.path().join("rig.toml")).expect("the rig");
    let inquiry = Inquiry::new(&plan, &rig, &folder).expect("a loop");
    let decision = inquiry.decide(&plan, &both, &rounds[..2]).expect("a decision");
    let scans = [both];
    // A loop does not look for walls and objects, nor for many causes.
    let effects = EffectId::ALL.iter().copied();
    let effects = effects.filter(|id| ![EffectId::Wall, EffectId::Scatterer].contains(id));
    let options = Options {
        simulator: Some(plan.simulator),
        effects: Some(effects.collect()),
        few_causes: true,
        ..Options::default()
    };
    let before = RecordedScan { samples: scans[0].samples[..first].to_vec(), ..scans[0].clone() };
    let live = Findings::of(std::slice::from_ref(&before), &options).expect("comparable");
    let updated = Findings::of_live(&scans, &options, &live.live_sets()).expect("comparable");
    assert_eq!(updated.verdict(), Verdict::Unexplained);
    let searched = Findings::of(&scans, &options).expect("comparable");
    let likeliest = |findings: &Findings<'_>| findings.probabilities().swap_remove(0);
    assert_ne!(likeliest(&searched), likeliest(&updated));
    assert_eq!(decision.round.purpose, Purpose::Explore, "{}", decision.round.reason);
    let decided = &decision.round.probabilities[0];
    assert_eq!((decided.effects.clone(), decided.probability), likeliest(&searched));
}

/// Leaves so many readings of a record, as if it had been killed.
fn cut(record: &Path, kept: usize) {
    for file in ["samples.csv", "journal.csv"] {
        let text = std::fs::read_to_string(record.join(file)).expect("there");
        let lines: String = text.split_inclusive('\n').take(1 + kept).collect();
        std::fs::write(record.join(file), lines).expect("written");
    }
    std::fs::write(record.join("state.toml"), "state = \"scanning\"\n").expect("written");
}

#[test]
fn a_plan_that_cannot_go_on_in_rounds_is_refused_at_its_line() {
    let folder = bench(PLAN);
    let refused = |more: &str, what: &str| {
        let plan = PLAN.replace("first_readings = 160\n", more);
        std::fs::write(folder.path().join("wrong.toml"), plan).expect("written");
        let output = fieldgap(folder.path(), &["run", "wrong.toml", "--dry-run"]);
        assert!(!output.status.success() && said(&output).contains(what), "{}", said(&output));
    };
    refused("first_readings = 3\n", "too few");
    refused("criterion = \"luck\"\n", "luck");
    refused("readings = 100\n", "first round alone");
    refused("minutes = 0\n", "above zero");
    let plan = PLAN.replace("max_mm = [30.0, 30.0, 140.0]", "max_mm = [30.0, 30.0, 80.0]");
    std::fs::write(folder.path().join("flat.toml"), plan).expect("written");
    let flat = fieldgap(folder.path(), &["run", "flat.toml", "--dry-run"]);
    assert!(said(&flat).contains("along z"), "{}", said(&flat));
    // Nothing of the box is within the travel of the robot.
    let plan =
        PLAN.replace("80.0]\nmax_mm = [30.0, 30.0, 140.0]", "800.0]\nmax_mm = [30.0, 30.0, 940.0]");
    std::fs::write(folder.path().join("far.toml"), plan).expect("written");
    let far = fieldgap(folder.path(), &["run", "far.toml", "--dry-run"]);
    assert!(said(&far).contains("reaches too little"), "{}", said(&far));
    // Minutes are for a loop.
    let minutes = fieldgap(folder.path(), &["run", "plan.toml", "--minutes", "3", "--dry-run"]);
    assert!(minutes.status.success(), "{}", said(&minutes));
}
