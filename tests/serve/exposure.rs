//! A real array above a limit of exposure, asked for by pages and programs.

use serde_json::{Value, json};

use crate::served::Served;

/// The lines of the log of times with the array driven.
fn sounded(served: &Served) -> Vec<Value> {
    let log = std::fs::read_to_string(served.home.path().join("settings/fieldgap/sounding.jsonl"));
    let lines = log.unwrap_or_default();
    lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn a_real_array_above_a_limit_sounds_only_if_each_concern_was_accepted() {
    let served = Served::heard();
    let desk = served.log_in();
    desk.post("/api/controls/take", "");

    // A scan: its levels are shown with its plan.
    let shown = desk.get("/api/plans/look");
    let concerns = &shown["exposure"]["concerns"];
    assert!(concerns[0].as_str().is_some_and(|text| text.contains("limit of 110.0 dB")), "{shown}");
    assert!(shown["exposure"]["text"].as_str().is_some_and(|text| text.contains("ABOVE")));
    let start = |accepts: &Value| {
        let body = json!({"plan": "look", "digest": shown["digest"], "accepts": accepts});
        desk.ask("POST", "/api/scans", &body.to_string())
    };
    for too_little in [json!([]), json!(["operator's head: 90 dB"])] {
        let (status, refusal) = start(&too_little);
        assert_eq!((status, &refusal["concerns"]), (409, concerns), "{refusal}");
        let remedy = refusal["remedy"].as_str().expect("a text");
        assert!(remedy.contains("`accepts`"), "{remedy}");
    }
    assert!(
        desk.get("/api/state")["queue"]["running"].is_null()
            && !served.records().join("look").exists()
    );
    assert_eq!(start(concerns).0, 200);
    let state = desk.until("done", |state| {
        state["queue"]["running"].is_null() && state["scan"]["has_report"] == true
    });
    assert_eq!(state["scan"]["done"], state["scan"]["of"], "{state}");
    let scan = sounded(&served);
    assert!(scan.len() == 1 && scan[0]["what"].as_str().is_some_and(|what| what.ends_with("look")));

    // By hand.
    desk.post("/api/hand/open", "");
    assert_eq!(desk.ask("POST", "/api/hand/order", "{\"order\":\"home\"}").0, 200);
    let order = |body: &Value| desk.ask("POST", "/api/hand/order", &body.to_string());
    let mut focus =
        json!({"order": "focus", "at_mm": [0.0, 0.0, 100.0], "seconds": 60, "continuous": false});
    let mut search = json!({"order": "find-axis", "heights_mm": [80.0, 140.0], "reach_mm": 15.0});
    for asked in [&mut focus, &mut search] {
        let (status, refusal) = order(asked);
        assert_eq!(status, 409, "{refusal}");
        asked["accepts"] = refusal["concerns"].clone();
        assert!(refusal["error"].as_str().is_some_and(|text| text.contains("limit of 110.0 dB")));
    }
    assert!(desk.get("/api/state")["hand"]["focus_mm"].is_null(), "it sounds");
    let (status, answer) = order(&focus);
    assert_eq!(status, 200, "{answer}");
    assert!(
        answer["exposure"]["text"].as_str().is_some_and(|text| text.contains("operator's head"))
    );
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert_eq!(sounded(&served).len(), 1, "it still sounds");
    assert_eq!(order(&json!({"order": "silence"})).0, 200);
    assert_eq!(order(&search).0, 200);
    // A focus that is sounding when the rig is closed.
    assert_eq!(order(&focus).0, 200);
    desk.post("/api/hand/close", "");
    let all = sounded(&served);
    let by_hand = &all[1..];
    assert_eq!(by_hand.len(), 3, "{all:?}");
    for line in by_hand {
        assert_eq!(line["what"], "serve");
        assert!(line["seconds"].as_f64().is_some_and(|s| s > 0.0 && s < 60.0), "{line}");
    }
    assert!(by_hand[0]["seconds"].as_f64() >= Some(0.2), "{by_hand:?}");
}

#[test]
fn a_virtual_array_above_a_limit_starts_with_the_levels_shown() {
    let rig = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/levels.toml"));
    let plan =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scans/quick-look.toml"));
    let served = Served::with(&rig.expect("there"), &plan.expect("there"));
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    let shown = desk.get("/api/plans/look");
    assert_eq!(shown["exposure"]["heard"], false);
    assert!(!shown["exposure"]["concerns"].as_array().expect("a list").is_empty(), "{shown}");
    desk.start_look();
    desk.until("done", |state| state["scan"]["has_report"] == true);
    assert!(sounded(&served).is_empty());
}
