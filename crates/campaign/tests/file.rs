//! The file of a campaign: what is refused, at which line, and what cells it gives.

mod fake;

use std::collections::BTreeSet;
use std::path::Path;

use proptest::prelude::*;

use self::fake::campaign;
use fieldgap_campaign::{Campaign, CampaignError, Cell};
use fieldgap_input::{Fault, TomlSource};

fn refused(text: &str) -> Fault {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scans");
    let whole = format!("name = \"test\"\nplan = \"quick-look.toml\"\n{text}");
    let parsed = Campaign::parse(TomlSource::new(&folder.join("test.toml"), whole));
    match parsed.expect_err(text) {
        CampaignError::File(fault) => fault,
        other => panic!("{text}: {other}"),
    }
}

#[test]
fn what_is_wrong_is_shown_at_its_line() {
    for (text, line, problem) in [
        ("rigs = [\"nowhere.toml\"]", 3, "there is no rig file"),
        ("rigs = []", 3, "the list is empty"),
        (
            "rigs = [\"../rigs/virtual.toml\", \"../rigs/virtual.toml\"]",
            3,
            "two rigs have the name `virtual`",
        ),
        ("repeats = 0", 3, "not a number of repeats"),
        ("order = \"shuffled\"", 3, "unknown variant"),
        ("[[axis]]\nparameter = \"focus.0.x_mm\"\nvalues = [1.0, 1.0]", 3, "value 1.0 twice"),
        ("[[axis]]\nparameter = \"focus.0.x_mm\"", 3, "needs values"),
        (
            "[[axis]]\nparameter = \"focus.0.x_mm\"\nvalues = [1.0]\n[[axis]]\nparameter = \"focus.1.x_mm\"\nvalues = [2.0]",
            3,
            "have the name `x_mm`",
        ),
        ("[[condition]]\nname = \"t\"\nvalues = [20.0]", 3, "either `set` or `ask`"),
        ("[[condition]]\nname = \"t\"\nvalues = []\nask = \"?\"", 5, "one value or several"),
        (
            "[[condition]]\nname = \"t\"\nvalues = [\"in\"]\nask = \"?\"\nconfirm = { sensor = \"temperature_c\", tolerance = 1.0 }",
            7,
            "is a word",
        ),
        (
            "[[condition]]\nname = \"t\"\nvalues = [1.0]\nask = \"?\"\nconfirm = { sensor = \"temperature_c\" }",
            7,
            "needs a sensor and a tolerance",
        ),
        ("[schedule]\nevery = \"now and then\"", 3, "`every`"),
        ("[baseline]\nrounds = 2", 3, "a baseline of 2 rounds in a campaign of 1"),
        ("[baseline]\nrecord = \"a\"\ncampaign = \"b\"", 3, "given twice"),
        ("[budget]\nhours = -1", 4, "not a number above zero"),
        ("[alarm]\narl_runs = 2", 3, "arl_runs"),
        ("colour = 1", 3, "colour"),
    ] {
        let fault = refused(text);
        assert!(fault.to_string().contains(problem), "{text}: {fault}");
        let shown = fault.line_column().map(|(line, _)| line);
        assert_eq!(shown, Some(line), "{text}: {fault}");
    }
    assert!(refused("[after]\napply = true").to_string().contains("needs a cause"));
    let swept = "[after]\napply = true\ndiagnose = true\n[[axis]]\nparameter = \"medium.speed_of_sound_m_s\"\nvalues = [343.0]";
    assert!(refused(swept).to_string().contains("is written into it for each cell"));
}

#[test]
fn a_value_that_no_plan_can_hold_is_shown_in_the_plan_with_its_cell() {
    let campaign =
        campaign("[[axis]]\nname = \"x\"\nparameter = \"focus.0.x_mm\"\nvalues = [1e9]\n");
    let cell = campaign.cells(1, 0).next().expect("a cell");
    let fault = campaign.scan_of(&cell).expect_err("1000 km away").to_string();
    assert!(fault.contains("quick-look.toml (x=1e9):"), "{fault}");
    let missing =
        self::campaign("[[axis]]\nname = \"x\"\nparameter = \"focus.3.x_mm\"\nvalues = [1.0]\n");
    let cell = missing.cells(1, 0).next().expect("a cell");
    let fault = missing.scan_of(&cell).expect_err("one focus").to_string();
    assert!(fault.contains("[[focus]] has 1 entries"), "{fault}");
}

#[test]
fn a_value_reaches_the_plan_or_the_rig_file() {
    let text = "[[axis]]\nname = \"f\"\nparameter = [\"focus.0.x_mm\", \"focus.0.y_mm\"]\nvalues = [[1.0, 2.0], [3.0, 4.0]]\n\
                [[axis]]\nparameter = \"medium.speed_of_sound_m_s\"\nvalues = [340.0]\n[[axis]]\nparameter = \"rig.name\"\nvalues = [\"other\"]\n";
    let campaign = campaign(text);
    let foci: BTreeSet<String> = campaign
        .cells(1, 0)
        .map(|cell| {
            let scan = campaign.scan_of(&cell).expect("a scan");
            assert_eq!(scan.rig_setup().nominal_medium().speed_of_sound_m_s, 340.0);
            assert_eq!(scan.rig_setup().name, "other");
            let focus_m = scan.plan().foci[0].excitation().focus_m().expect("a focus");
            format!("{:.3} {:.3}", focus_m.x, focus_m.y)
        })
        .collect();
    assert_eq!(foci.into_iter().collect::<Vec<_>>(), ["0.001 0.002", "0.003 0.004"]);
}

#[test]
fn the_order_is_random_within_a_condition_and_the_same_for_the_same_seed() {
    let text = |order: &str| {
        format!(
            "order = \"{order}\"\nrepeats = 2\n[[condition]]\nname = \"t\"\nvalues = [20.0, 30.0]\nask = \"{{value}}?\"\n\
             [[axis]]\nname = \"x\"\nparameter = \"focus.0.x_mm\"\nfrom = 0\nto = 9\nstep = 1\n"
        )
    };
    let order = |order: &str, round: u32, seed: u64| -> Vec<Vec<(usize, u32)>> {
        let campaign = campaign(&text(order));
        let blocks = campaign.round(round, seed);
        let places = |cell: &Cell| (cell.axes[0], cell.repeat);
        blocks.iter().map(|block| block.queues[0].iter().map(places).collect()).collect()
    };
    let given = order("given", 1, 5);
    assert_eq!(given.len(), 2);
    assert!(given[0].windows(2).all(|pair| (pair[0].1, pair[0].0) < (pair[1].1, pair[1].0)));
    let blocked = order("blocked", 1, 5);
    assert_eq!(blocked.len(), 2, "each condition is set once");
    assert_ne!(blocked[0], given[0]);
    assert_eq!(blocked, order("blocked", 1, 5));
    assert_ne!(blocked, order("blocked", 2, 5), "another round has another order");
    assert_ne!(blocked, order("blocked", 1, 6));
    assert!(order("random", 1, 5).len() > 2, "conditions are mixed");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_cell_has_a_folder_of_its_own_that_a_file_system_takes(
        labels in prop::collection::btree_set("\\PC{1,60}", 1..6),
        repeats in 1u32..3,
    ) {
        let quoted: Vec<String> = labels.iter().map(|label| toml_edit::Value::from(label.as_str()).to_string()).collect();
        let values: Vec<String> = (0..labels.len()).map(|n| format!("{n}.0")).collect();
        let text = format!(
            "repeats = {repeats}\n[[axis]]\nname = \"x\"\nparameter = \"focus.0.x_mm\"\nvalues = [{}]\nlabels = [{}]\n",
            values.join(", "), quoted.join(", ")
        );
        let campaign = campaign(&text);
        let names: Vec<String> = (1..3).flat_map(|round| {
            campaign.cells(round, 1).map(|cell| campaign.id_of(&cell)).collect::<Vec<_>>()
        }).collect();
        let different: BTreeSet<&String> = names.iter().collect();
        prop_assert_eq!(different.len(), names.len(), "{:?}", names);
        for name in &names {
            prop_assert!(name.len() <= 200 && !name.contains('/') && !name.starts_with('.'), "{}", name);
        }
    }
}
