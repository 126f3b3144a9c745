use proptest::prelude::*;

use super::*;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Speed;

const HEAD: &str = "name = \"p\"\n[simulator]\nmodel = \"as-written\"\nalso = [\"corrected\"]\n\
                    [[focus]]\nx_mm = 17.5\ny_mm = -22.5\nz_mm = 100.0\n";
const PLANE: &str =
    "[[plane]]\nz_mm = [100, 50.0]\ncentre_mm = [0.0, 0.0]\nsize_mm = [5.0, 4.0]\nstep_mm = 2.0\n";

fn parse(text: &str) -> Result<Plan, Fault> {
    Plan::parse(TomlSource::new(Path::new("scans/p.toml"), text))
}

fn positions_mm(plan: &Plan) -> Vec<[f64; 3]> {
    let round = |along: f64| (along * 1e6).round() / 1e3;
    plan.visits().iter().map(|visit| visit.position_m.map(round).into()).collect()
}

#[test]
fn a_serpentine_goes_there_and_back_and_up() {
    let plan = parse(&format!("{HEAD}{PLANE}")).expect("good");
    assert_eq!(plan.also, [Simulator::Corrected]);
    // Two steps of 2 mm fit in 5 mm and in 4 mm; both planes by height.
    let low = |x, y| [x, y, 50.0];
    let high = |x, y| [x, y, 100.0];
    let expected = [
        [low(-2.0, -2.0), low(0.0, -2.0), low(2.0, -2.0)],
        [low(2.0, 0.0), low(0.0, 0.0), low(-2.0, 0.0)],
        [low(-2.0, 2.0), low(0.0, 2.0), low(2.0, 2.0)],
        [high(2.0, 2.0), high(0.0, 2.0), high(-2.0, 2.0)],
        [high(-2.0, 0.0), high(0.0, 0.0), high(2.0, 0.0)],
        [high(2.0, -2.0), high(0.0, -2.0), high(-2.0, -2.0)],
    ];
    assert_eq!(positions_mm(&plan), expected.concat());
}

#[test]
fn how_far_a_rig_may_be_off_on_resuming_is_the_plans_to_say() {
    let plain = parse(&format!("{HEAD}{PLANE}")).expect("good");
    assert_eq!((plain.resume.place_mm.get(), plain.resume.level_percent.get()), (0.05, 3.0));
    let wide = parse(&format!("{HEAD}{PLANE}[resume]\nlevel_percent = 10.0\n")).expect("good");
    assert_eq!((wide.resume.place_mm.get(), wide.resume.level_percent.get()), (0.05, 10.0));
    for wrong in ["place_mm = 0.0", "place_mm = -1.0", "level = 3.0"] {
        let fault = parse(&format!("{HEAD}{PLANE}[resume]\n{wrong}\n")).expect_err(wrong);
        assert_eq!(fault.line_column().map(|(line, _)| line), Some(15), "{fault}");
    }
}

#[test]
fn a_diagnosis_is_asked_for_or_not() {
    assert!(!parse(&format!("{HEAD}{PLANE}")).expect("good").diagnose);
    assert!(parse(&format!("diagnose = true\n{HEAD}{PLANE}")).expect("good").diagnose);
    let fault = parse(&format!("diagnose = \"yes\"\n{HEAD}{PLANE}")).expect_err("no truth value");
    assert_eq!(fault.line_column(), Some((1, 12)));
}

#[test]
fn a_raster_runs_every_row_alike() {
    let plan = parse(&format!("order = \"raster\"\n{HEAD}{PLANE}")).expect("good");
    let visits = positions_mm(&plan);
    for row in visits.chunks(3) {
        assert_eq!(row.iter().map(|at| at[0]).collect::<Vec<_>>(), [-2.0, 0.0, 2.0]);
    }
    assert_eq!(visits[9], [-2.0, -2.0, 100.0]);
}

#[test]
fn volumes_lines_and_points_follow_the_planes() {
    let text = format!(
        "{HEAD}\
         [[points]]\nat_mm = [[1, 2, 3], [4.0, 5.0, 6.0]]\n\
         [[line]]\nfrom_mm = [0, 0, 10]\nto_mm = [0, 0, 15]\nstep_mm = 2.5\n\
         [[volume]]\nmin_mm = [0, 0, 20]\nmax_mm = [1, 0, 31]\nstep_mm = [1.0, 1.0, 10.0]\n\
         [[plane]]\nz_mm = 90\ncentre_mm = [0, 0]\nsize_mm = [1, 1]\nstep_mm = 1.0\n"
    );
    let expected = [
        [-0.5, -0.5, 90.0],
        [0.5, -0.5, 90.0],
        [0.5, 0.5, 90.0],
        [-0.5, 0.5, 90.0],
        // The volume is one row thick; its first is the third row and second plane of the way.
        [0.0, 0.0, 20.0],
        [1.0, 0.0, 20.0],
        [1.0, 0.0, 30.0],
        [0.0, 0.0, 30.0],
        [0.0, 0.0, 10.0],
        [0.0, 0.0, 12.5],
        [0.0, 0.0, 15.0],
        [1.0, 2.0, 3.0],
        [4.0, 5.0, 6.0],
    ];
    assert_eq!(positions_mm(&parse(&text).expect("good")), expected);
}

#[test]
fn the_rig_is_looked_for_from_the_plans_folder() {
    let plan = parse(&format!("rig = \"../rigs/virtual.toml\"\n{HEAD}{PLANE}")).expect("good");
    assert_eq!(plan.rig, Some(PathBuf::from("scans/../rigs/virtual.toml")));
    let fault = plan.fault(PlanPart::Rig, "is not there", "name another");
    assert_eq!(fault.line_column(), Some((1, 7)));
}

#[test]
fn regions_and_reference_may_name_their_foci() {
    let text = format!(
        "{HEAD}[[focus]]\nphases = \"all-zero\"\n[reference]\nat_mm = [0, 0, 9]\nevery_points = 2\n\
         focus = 1\n[[points]]\nat_mm = [[1, 1, 1]]\nfoci = [1]\n[[points]]\nat_mm = [[2, 2, 2]]\n"
    );
    let plan = parse(&text).expect("good");
    let seen: Vec<(VisitKind, Option<usize>, PlanPart)> =
        plan.visits().iter().map(|visit| (visit.kind, visit.focus, visit.part)).collect();
    let reference = (VisitKind::Reference, Some(1), PlanPart::Reference);
    let point = |focus, region| (VisitKind::Point, Some(focus), PlanPart::Region(region));
    assert_eq!(seen, [reference, point(0, 1), point(1, 0), reference, point(1, 1), reference]);
}

#[test]
fn silence_is_measured_where_the_robot_stands_first_and_last() {
    let text = format!("{HEAD}[dark]\nbefore = 2\nafter = 1\n{PLANE}");
    let visits = parse(&text).expect("good").visits();
    let kinds: Vec<bool> = visits.iter().map(|visit| visit.kind == VisitKind::Dark).collect();
    let expected: Vec<bool> = (0..21).map(|n| n < 2 || n == 20).collect();
    assert_eq!(kinds, expected);
    assert!(visits[..2].iter().all(|dark| dark.focus.is_none()));
    assert_eq!(visits[1].position_m, visits[2].position_m);
    assert_eq!(visits[20].position_m, visits[19].position_m);
}

#[test]
fn faults_are_placed_at_their_key() {
    let with_plane = |from: &str, to: &str| format!("{HEAD}{}", PLANE.replace(from, to));
    let cases = [
        (with_plane("step_mm = 2.0", "step_mm = -2.0"), 13, "above zero"),
        (with_plane("step_mm = 2.0", "step_mm = 5.0"), 12, "smaller than its step"),
        (with_plane("step_mm = 2.0", "step_mm = 1e-9"), 13, "from 1e-6 mm"),
        (with_plane("step_mm = 2.0", "step_mm = 1e-5"), 9, "points"),
        (with_plane("step_mm", "stepp_mm"), 13, "stepp_mm"),
        (with_plane("[100, 50.0]", "[]"), 10, "no height"),
        (with_plane("[100, 50.0]", "[100, nan]"), 10, "within 10 m"),
        (with_plane("[100, 50.0]", "\"low\""), 10, "a number or a list of numbers"),
        (with_plane("step_mm = 2.0", "step_mm = 2.0\nfoci = [0, 1]"), 14, "no focus 1"),
        (with_plane("step_mm = 2.0", "step_mm = 2.0\nfoci = []"), 14, "empty"),
        (format!("{HEAD}[[points]]\nat_mm = []\n"), 10, "empty"),
        (format!("{HEAD}[[points]]\nat_mm = [[1, 2]]\n"), 10, "length 2"),
        (
            format!("{HEAD}[[line]]\nfrom_mm = [0, 0, 1]\nto_mm = [0, 0, 2]\nstep_mm = 3\n"),
            11,
            "shorter than its step",
        ),
        (
            format!("{HEAD}[[volume]]\nmin_mm = [0, 5, 1]\nmax_mm = [1, 4, 2]\nstep_mm = 1\n"),
            11,
            "along y",
        ),
        (
            format!("{HEAD}[[volume]]\nmin_mm = [0, 0, 1]\nmax_mm = [1, 4, 2]\nstep_mm = [1, 2]\n"),
            12,
            "one step, or three",
        ),
        (format!("{HEAD}[reference]\nat_mm = [0, 0, 1]\nevery_points = 0\n{PLANE}"), 11, "nonzero"),
        (
            format!("{HEAD}[reference]\nat_mm = [0, 0, 1]\nevery_points = 9\nfocus = 4\n{PLANE}"),
            12,
            "no focus 4",
        ),
        (format!("order = \"spiral\"\n{HEAD}{PLANE}"), 1, "spiral"),
        (format!("{HEAD}{PLANE}").replace("\"p\"", "\"a/b\""), 1, "a/b"),
        (format!("{HEAD}{PLANE}").replace("x_mm = 17.5\n", ""), 5, "`x_mm`"),
    ];
    for (text, line, said) in cases {
        let fault = parse(&text).expect_err(&text);
        assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{text}\n{fault}");
        assert!(fault.problem().contains(said), "{text}\n{fault}");
    }
    let empty = parse(HEAD).expect_err("nothing to measure");
    assert!(empty.problem().contains("nothing to measure"), "{empty}");
}

#[test]
fn phases_are_counted_once_the_array_is_known() {
    let text = HEAD.replace("x_mm = 17.5\ny_mm = -22.5\nz_mm = 100.0", "phases_rad = [0.0, 1.0]");
    let plan = parse(&format!("{text}{PLANE}")).expect("good");
    assert!(plan.fits_array(2).is_ok());
    let fault = plan.fits_array(36).expect_err("two phases");
    assert_eq!(fault.line_column().map(|place| place.0), Some(5));
}

prop_compose! {
    /// A plan of planes under one or two foci, with dark readings and a reference point.
    fn any_plan()(
        size_mm in [2.0..9.0f64, 2.0..9.0f64],
        step_mm in 0.7..2.0f64,
        heights_mm in prop::collection::btree_set(20i32..200, 1..4),
        foci in 1usize..3,
        dark in (0u32..4, 0u32..4),
        every in 1u32..30,
        order in prop::sample::select(vec!["serpentine", "raster"]),
    ) -> String {
        let foci = "[[focus]]\nphases = \"all-zero\"\n".repeat(foci);
        format!(
            "name = \"p\"\norder = \"{order}\"\n[simulator]\nmodel = \"piston\"\n{foci}\
             [dark]\nbefore = {}\nafter = {}\n\
             [reference]\nat_mm = [0, 0, 300]\nevery_points = {every}\n\
             [[plane]]\nz_mm = {heights_mm:?}\ncentre_mm = [1.0, -1.0]\n\
             size_mm = {size_mm:?}\nstep_mm = {step_mm:?}\n",
            dark.0, dark.1,
        ).replace('{', "[").replace('}', "]")
    }
}

proptest! {
    #[test]
    fn every_point_is_visited_once_under_each_focus(text in any_plan()) {
        let plan = parse(&text).expect("good");
        let mut seen: Vec<String> = plan.visits().iter()
            .filter(|visit| visit.kind == VisitKind::Point)
            .map(|visit| format!("{:?} {:?}", visit.focus, visit.position_m))
            .collect();
        let visited = seen.len();
        seen.sort();
        seen.dedup();
        let wanted: usize = plan.regions.iter().map(|r| r.shape.points() * r.foci.len()).sum();
        prop_assert_eq!((visited, seen.len()), (wanted, wanted));
    }

    #[test]
    fn a_grid_is_centred_and_fills_its_size(text in any_plan()) {
        let plan = parse(&text).expect("good");
        let Shape::Planes(Layers { x, .. }) = plan.regions[0].shape else { panic!("a plane") };
        let (first_mm, last_mm) = (x.at_mm(0), x.at_mm(x.count - 1));
        prop_assert!((first_mm + last_mm - 2.0).abs() < 1e-9);
        let size_mm: f64 = text.split("size_mm = [").nth(1).and_then(|t| t.split(',').next())
            .and_then(|number| number.parse().ok()).expect("written above");
        let left_mm = size_mm - (last_mm - first_mm);
        prop_assert!(left_mm > -1e-6 && left_mm < x.step_mm);
    }

    #[test]
    fn in_a_serpentine_neighbours_are_one_step_apart(text in any_plan()) {
        let plan = parse(&text.replace("raster", "serpentine")).expect("good");
        let Shape::Planes(Layers { x, .. }) = plan.regions[0].shape else { panic!("a plane") };
        let points: Vec<Visit> =
            plan.visits().into_iter().filter(|visit| visit.kind == VisitKind::Point).collect();
        for pair in points.windows(2).filter(|pair| pair[0].focus == pair[1].focus) {
            let way_m = pair[1].position_m - pair[0].position_m;
            if way_m.z == 0.0 {
                prop_assert!((way_m.norm() - x.step_mm / 1e3).abs() < 1e-9, "{way_m:?}");
            } else {
                prop_assert!(way_m.xy().norm() < 1e-12 && way_m.z > 0.0, "{way_m:?}");
            }
        }
    }

    #[test]
    fn silence_stands_at_both_ends_and_references_are_spaced(text in any_plan()) {
        let plan = parse(&text).expect("good");
        let visits = plan.visits();
        let dark = |visit: &Visit| visit.kind == VisitKind::Dark;
        let before = visits.iter().take_while(|visit| dark(visit)).count();
        let after = visits.iter().rev().take_while(|visit| dark(visit)).count();
        prop_assert_eq!((before, after), (plan.dark.before as usize, plan.dark.after as usize));
        let driven = &visits[before..visits.len() - after];
        prop_assert!(!driven.iter().any(dark));

        let every = plan.reference.every_points.expect("given").get() as usize;
        let runs: Vec<usize> = driven
            .split(|visit| visit.kind == VisitKind::Reference)
            .map(<[Visit]>::len)
            .collect();
        // Split at the first and last reference leaves nothing outside them.
        prop_assert_eq!((runs[0], runs[runs.len() - 1]), (0, 0));
        let between = &runs[1..runs.len() - 1];
        prop_assert!(between[..between.len() - 1].iter().all(|&run| run == every));
        prop_assert!((1..=every).contains(&between[between.len() - 1]));
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "\\PC{0,80}") {
        let _ = parse(&text);
        let _ = parse(&format!("{HEAD}{text}"));
    }
}

#[test]
fn listed_readings_follow_the_regions_in_their_order() {
    let readings = "[[readings]]\nat_mm = [[9.0, 0.0, 90.0], [1.0, 0.0, 90.0], [1.0, 0.0, 90.0]]\nfocus = [0, -1, 0]\n";
    let plan = parse(&format!("{HEAD}{PLANE}{readings}")).expect("good");
    let visits = plan.visits();
    let (regions, listed) = visits.split_at(visits.len() - 3);
    assert_eq!(regions.len(), 18);
    let kinds: Vec<(Option<usize>, VisitKind)> =
        listed.iter().map(|visit| (visit.focus, visit.kind)).collect();
    let driven = (Some(0), VisitKind::Point);
    assert_eq!(kinds, [driven, (None, VisitKind::Dark), driven]);
    assert_eq!(listed[0].position_m.x, 9e-3);
    assert_eq!(listed[2].part, PlanPart::Readings(0));
}

/// Three readings with equal steps, and two more that go on with another.
fn flown(focus: &str, speed_mm_s: &str) -> String {
    format!(
        "at_mm = [[0, 0, 90], [2, 0, 90], [4, 0, 90], [7, 0, 90], [10, 0, 90]]\nfocus = [{focus}]\n\
         speed_mm_s = [{speed_mm_s}]\n"
    )
}

#[test]
fn readings_with_a_speed_form_rows_and_others_are_at_rest() {
    let keys = "at_mm = [[9, 0, 80], [0, 0, 90], [2, 0, 90], [4, 0, 90], [6, 0, 90], [6, 0, 92], [6, 0, 94], [6, 0, 96], [6, 0, 98]]\n\
                focus = [-1, 0, 0, 0, 0, 0, 0, 0, 0]\n";
    let paces = |speeds: &str| -> Vec<VisitPace> {
        let plan = parse(&format!("{HEAD}[[readings]]\n{keys}{speeds}")).expect("good");
        plan.visits().iter().map(|visit| visit.pace).collect()
    };
    let speed = |mm_s| VisitPace::Flown(Speed::new(mm_s).expect("a speed"));
    let mut expected = vec![VisitPace::AtRest];
    expected.extend([speed(60.0); 4]);
    expected.extend([speed(20.5); 4]);
    let speeds = "speed_mm_s = [0, 60, 60, 60, 60, 20.5, 20.5, 20.5, 20.5]\n";
    assert_eq!(paces(speeds), expected);
    // Without the key the plan leaves it to `[fly]`, as ever.
    assert_eq!(paces(""), [VisitPace::OfPlan; 9]);
}

#[test]
fn a_list_of_readings_that_does_not_fit_is_refused_at_its_line() {
    let cases = [
        ("at_mm = []\nfocus = []\n", "empty"),
        ("at_mm = [[0, 0, 90]]\nfocus = [0, 0]\n", "`focus` has 2 numbers, and `at_mm` has 1"),
        ("at_mm = [[0, 0, 90]]\nfocus = [1]\n", "there is no focus 1"),
        ("at_mm = [[0, 0, 90]]\nfocus = [-2]\n", "-2 is no number of a focus"),
        ("at_mm = [[0, 0, 90]]\nfocus = [0]\nspeed_mm_s = [0, 0]\n", "`speed_mm_s` has 2 numbers"),
        ("at_mm = [[0, 0, 90]]\nfocus = [0]\nspeed_mm_s = [-5]\n", "-5 is not a speed above zero"),
        ("at_mm = [[0, 0, 90]]\nfocus = [0]\nspeed_mm_s = [nan]\n", "not a speed above zero"),
        (&flown("0, 0, 0, 0, 0", "9, 9, 9, 0, 0"), "from reading 0 on, 3 of one speed"),
        (&flown("0, 0, 0, 0, 0", "9, 9, 9, 9, 0"), "from reading 0 on, 3 of one speed"),
        (&flown("0, 0, -1, 0, 0", "0, 9, 9, 9, 9"), "from reading 1 on, 1 of one speed"),
        (&flown("-1, -1, -1, -1, -1", "9, 9, 9, 0, 0"), "reading 0 is silent and in motion"),
    ];
    for (keys, what) in cases {
        let fault = parse(&format!("{HEAD}[[readings]]\n{keys}")).expect_err(keys);
        assert!(fault.to_string().contains(what), "{fault}");
        assert!(fault.line_column().is_some_and(|(line, _)| line >= 10), "{fault}");
    }
}

const LOOP: &str = "[closed_loop]\nmin_mm = [-10, -10, 60]\nmax_mm = [10, 10, 100]\n";

#[test]
fn a_closed_loop_has_defaults_and_verifies_where_it_measures() {
    let plan = parse(&format!("{HEAD}{LOOP}")).expect("good");
    let settings = plan.closed_loop.as_ref().expect("given");
    assert!(plan.visits().is_empty());
    assert_eq!((settings.first_readings, settings.verify_readings), (240, 64));
    assert_eq!(settings.verify_within, settings.within);
    let more = "minutes = 2\n[closed_loop.verify]\nreadings = 0\n";
    let plan = parse(&format!("{HEAD}{LOOP}{more}")).expect("good");
    let settings = plan.closed_loop.expect("given");
    assert_eq!((settings.longest_s, settings.verify_readings), (Some(120.0), 0));
}

#[test]
fn nothing_else_comes_last_in_a_closed_loop() {
    for (more, what) in [
        ("[dark]\nafter = 2\n", "silent readings after all others"),
        ("[reference]\nevery_points = 9\n", "a reference point"),
        (PLANE, "regions"),
        ("[closed_loop.verify]\nmin_mm = [0, 0, 60]\n", "two corners"),
    ] {
        let fault = parse(&format!("{HEAD}{LOOP}{more}")).expect_err(what);
        assert!(fault.to_string().contains(what), "{fault}");
    }
}

const MAP: &str = "[adaptive]\nz_mm = [100, 80]\nsize_mm = [20, 10]\nstep_mm = 2\n";

#[test]
fn an_adaptive_map_is_of_planes_or_of_a_box() {
    let plan = parse(&format!("{HEAD}{MAP}")).expect("good");
    assert!(plan.visits().is_empty() && plan.chooses_readings());
    let map = plan.adaptive.expect("given");
    assert_eq!((map.grid.points(), map.error, map.confidence), (11 * 6 * 2, 0.01, 0.95));
    assert_eq!(
        (map.first_readings, map.most_readings, map.prior),
        (192, 192, MapPrior::Simulation)
    );
    let places: Vec<_> = map.grid.places_mm().collect();
    assert_eq!(places[0], Vec3::new(-10.0, -5.0, 80.0));
    assert_eq!(places[12], Vec3::new(-8.0, -3.0, 80.0));
    assert_eq!(places[131], Vec3::new(10.0, 5.0, 100.0));
    let of_box = "[adaptive]\nmin_mm = [0, 0, 60]\nmax_mm = [10, 10, 100]\nstep_mm = [1, 2, 20]\n\
                  error = 0.02\nminutes = 2\nprior = \"process\"\n";
    let map = parse(&format!("{HEAD}{of_box}")).expect("good").adaptive.expect("given");
    assert_eq!((map.grid.points(), map.error), (11 * 6 * 3, 0.02));
    assert_eq!((map.longest_s, map.prior), (Some(120.0), MapPrior::Process));
}

#[test]
fn an_adaptive_map_that_cannot_be_is_refused_at_its_line() {
    for (more, what) in [
        ("[dark]\nafter = 2\n", "an adaptive map chooses its readings itself"),
        (PLANE, "regions"),
        (LOOP, "seeks a cause and not a map"),
    ] {
        let fault = parse(&format!("{HEAD}{MAP}{more}")).expect_err(what);
        assert!(fault.to_string().contains(what), "{fault}");
        assert!(fault.line_column().is_some(), "{fault}");
    }
    for (keys, what) in [
        ("min_mm = [0, 0, 60]\n", "planes or of a box"),
        ("colour = 1\n", "colour"),
        ("error = 0\n", "`error` is a share between 0 and 1"),
        ("confidence = 1.0\n", "`confidence` is a share"),
        ("error = 2\n", "2"),
        ("readings = 100\n", "first round alone"),
        ("first_readings = 3\n", "too few"),
        ("prior = \"luck\"\n", "luck"),
    ] {
        let fault = parse(&format!("{HEAD}{MAP}{keys}")).expect_err(what);
        assert!(fault.to_string().contains(what), "{fault}");
        assert!(fault.line_column().is_some_and(|(line, _)| line >= 8), "{fault}");
    }
    let fine = MAP.replace("step_mm = 2", "step_mm = 0.02");
    let fault = parse(&format!("{HEAD}{fine}")).expect_err("too fine");
    assert!(fault.to_string().contains("at most 200000 are allowed"), "{fault}");
    let steps = MAP.replace("step_mm = 2", "step_mm = [2, 2, 2]");
    let fault = parse(&format!("{HEAD}{steps}")).expect_err("three steps");
    assert!(fault.to_string().contains("planes have one step"), "{fault}");
}

proptest! {
    #[test]
    fn every_place_of_an_adaptive_map_is_within_its_box(
        low in prop::array::uniform3(-50.0..50.0f64),
        size in prop::array::uniform3(0.0..40.0f64),
        step in 0.5..20.0f64,
    ) {
        let high: Vec<f64> = low.iter().zip(size).map(|(low, size)| low + size).collect();
        let text = format!("{HEAD}[adaptive]\nmin_mm = {low:?}\nmax_mm = {high:?}\nstep_mm = {step:?}\n");
        let map = parse(&text).expect("a box").adaptive.expect("given");
        prop_assert_eq!(map.grid.places_mm().count(), map.grid.points());
        for at_mm in map.grid.places_mm() {
            for axis in 0..3 {
                prop_assert!(at_mm[axis] >= low[axis] - 1e-9 && at_mm[axis] <= high[axis] + 1e-6);
            }
        }
    }
}
