//! Operation by hand.

use std::time::{Duration, Instant};

use serde_json::Value;

use crate::invited;
use crate::served::Served;

fn place(state: &Value) -> f64 {
    state["hand"]["at_mm"][0].as_f64().expect("a place")
}

#[test]
fn a_jog_ends_without_heartbeats_and_refusals_have_their_reason() {
    let served = Served::begin("{ times = 1.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.post("/api/hand/open", "");
    let order = |body: &str| desk.ask("POST", "/api/hand/order", body);
    let (status, refusal) = order("{\"order\":\"step\",\"axis\":\"x\",\"by_mm\":1.0}");
    assert_eq!(
        (status, refusal["error"].as_str()),
        (409, Some("the robot must home before its first move"))
    );
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    let (status, refusal) = order("{\"order\":\"go\",\"to_mm\":[0.0,0.0,900.0]}");
    assert!(
        status == 409
            && refusal["error"].as_str().is_some_and(|error| error.contains("outside its travel")),
        "{refusal}"
    );
    assert_eq!(order("{\"order\":\"go\",\"to_mm\":[0.0,0.0,120.0]}").0, 200);

    let beat = "{\"order\":\"jog\",\"hold\":7,\"axis\":\"x\",\"speed_mm_s\":20.0}";
    let held = Instant::now();
    while held.elapsed() < Duration::from_millis(600) {
        desk.post("/api/hand/jog", beat);
        std::thread::sleep(Duration::from_millis(60));
    }
    // The connection is cut: no release is sent.
    let cut = Instant::now();
    let stood = desk.until("standing", |state| state["hand"]["doing"] == "stands still");
    // Up to the end of the heartbeats and of one short move; a busy computer is later in asking, never in stopping.
    let most = 20.0 * (held.elapsed().as_secs_f64() + 0.1);
    assert!(
        place(&stood) > 3.0 && place(&stood) <= most,
        "{} mm, {:?} after the cut",
        place(&stood),
        cut.elapsed()
    );
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(place(&desk.get("/api/state")), place(&stood));
    desk.post("/api/hand/jog", beat);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(place(&desk.get("/api/state")), place(&stood), "a late heartbeat starts nothing");

    // A focus ends by its timer, and when the controls are released.
    assert_eq!(
        order("{\"order\":\"focus\",\"at_mm\":[0.0,0.0,100.0],\"seconds\":1,\"continuous\":true}")
            .0,
        200
    );
    let emits = desk.until("emitting", |state| state["hand"]["focus_mm"].is_array());
    assert_eq!(emits["hand"]["seconds_left"], 1);
    desk.until("silent", |state| state["hand"]["focus_mm"].is_null());
    desk.post("/api/controls/release", "");
    assert_eq!(desk.get("/api/state")["hand"]["open"], false);
}

#[test]
fn a_reading_and_the_beam_axis_are_found_by_hand_and_a_stop_ends_the_search() {
    let served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.post("/api/hand/open", "");
    let order = |body: &str| desk.ask("POST", "/api/hand/order", body);
    let search = "{\"order\":\"find-axis\",\"heights_mm\":[140.0,80.0],\"reach_mm\":15.0}";
    let (status, refusal) = order(search);
    assert_eq!(
        (status, refusal["error"].as_str()),
        (409, Some("the robot must home before its first move"))
    );
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    for wrong in ["[]", "[0.0]", "[-80.0]", "[1e9]"] {
        let (status, refusal) = order(&search.replace("[140.0,80.0]", wrong));
        assert_eq!(status, 409, "{wrong}: {refusal}");
    }
    assert_eq!(order("{\"order\":\"sample\",\"samples\":0}").0, 409);
    assert_eq!(order("{\"order\":\"sample\",\"samples\":500}").0, 200);
    let read = desk.until("read", |state| state["hand"]["sample"].is_object());
    assert_eq!(read["hand"]["sample"]["count"], 500);
    let (status, refusal) = order(search);
    assert_eq!(status, 200, "{refusal}");
    let state = desk.get("/api/state");
    let axis = state["hand"]["axis"].as_str().expect("an axis");
    assert!(axis.contains("80.0") && axis.contains("140.0"), "{axis}");
    assert!(
        state["hand"]["focus_mm"].is_null() && state["hand"]["doing"] == "stands still",
        "{state}"
    );
    assert!(state["lines"].to_string().contains("beam at z = 140.0 mm"), "{state}");

    // A second search is stopped by somebody else in its middle.
    let visitor = invited(&served, &desk, "viewer");
    let searching = std::thread::spawn({
        let (desk, search) = (desk.clone(), search.replace("15.0", "40.0"));
        move || desk.ask("POST", "/api/hand/order", &search)
    });
    desk.until("searching", |state| state["hand"]["doing"] == "searches for the beam");
    let left = visitor.post("/api/stop", "")["left"].to_string();
    assert!(left.contains("the array is silent, the robot stands still"), "{left}");
    let (status, refusal) = searching.join().expect("no panic");
    assert_eq!((status, refusal["error"].as_str()), (409, Some("stopped")));
    assert_eq!(desk.get("/api/state")["hand"]["doing"], "must home: it was stopped");

    // A stop does not wait for a long reading, nor the release of the controls for a search.
    let begin = |body: &str| {
        let (desk, body) = (desk.clone(), body.to_owned());
        std::thread::spawn(move || desk.ask("POST", "/api/hand/order", &body))
    };
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    let reading = begin("{\"order\":\"sample\",\"samples\":65536}");
    let stopped = loop {
        // The reading of 65 s at the rig's clock may not have begun yet.
        visitor.post("/api/stop", "");
        if reading.is_finished() {
            break reading.join().expect("no panic");
        }
    };
    assert_eq!((stopped.0, stopped.1["error"].as_str()), (409, Some("stopped")));
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    let searching = begin(&search.replace("15.0", "40.0"));
    desk.until("searching", |state| state["hand"]["doing"] == "searches for the beam");
    desk.post("/api/controls/release", "");
    assert_eq!(desk.get("/api/state")["hand"]["open"], false);
    assert_eq!(searching.join().expect("no panic").0, 409);
    let lines = desk.get("/api/state")["lines"].to_string();
    assert!(lines.contains("rig by hand closed: the array is silent"), "{lines}");
}
