//! A calibration on a rig: a scan of coded drives, the fit, and a second scan that checks it.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use miette::{IntoDiagnostic, miette};
use toml_edit::DocumentMut;

use super::text::in_words;
use super::{Calibrate, CalibrationReport, FILE, FocusGain, RESULT, file_of, write};
use crate::cli::exposure::Foreseen;
use crate::cli::output::{fresh_folder, print, print_json, say};
use crate::cli::permission::Act;
use crate::cli::scan::{report_ending, run_scan};
use crate::rig_file::{RigFile, simulated_devices};
use fieldgap_acoustics::{Excitation, Simulation, Vec3};
use fieldgap_acquisition::{Ending, PlannedScan, RigSetup, ScanRun};
use fieldgap_calibration::compensation::{Steps, compensated};
use fieldgap_calibration::design::{Design, candidates};
use fieldgap_calibration::verification::{FocusFigures, focus_figures, gap};
use fieldgap_calibration::{Calibration, CodedReadings, Options, calibrate};
use fieldgap_input::TomlSource;
use fieldgap_records::{FocusSection, RecordedScan};

/// Most readings for each channel: beyond it the errors are far below those that a changed temperature makes.
const MOST_PER_CHANNEL: usize = 10;

/// Fewest: twice the unknown numbers, so that a wrong wiring shows.
const LEAST_PER_CHANNEL: usize = 4;

/// Coded drives of the check.
const CHECKED: usize = 60;

/// Places of the check.
const CHECKED_PLACES: usize = 3;

/// Points of a line across the focus.
const LINE_STEPS: usize = 40;

/// Half length of such a line, in widths of the focus: the first two side lobes are on it.
const LINE_WIDTHS: f64 = 3.0;

impl Calibrate {
    /// Measures, fits and checks.
    pub(super) fn measure(&self, rig: &Path) -> miette::Result<ExitCode> {
        let raw = TomlSource::read(rig)?;
        let rig_source = without_calibration(&raw)?;
        let rig_file = RigFile::parse(rig_source.clone())?;
        rig_file.check_truth()?;
        let setup = &rig_file.setup;
        let simulation = Simulation {
            simulator: self.simulator(setup.array.transducer_file().is_some()),
            array: setup.array.array().clone(),
            medium: setup.nominal_medium(),
            frequency_hz: setup.array.frequency_hz(),
            excitation: Excitation::Uniform,
        };
        let name = format!("{}-calibration", setup.name);
        let folder = self.out.clone().unwrap_or_else(|| fresh_folder(&name));
        let reachable = reachable(&simulation, setup);
        let given: Vec<Vec3> = self.at_mm.iter().map(|at_mm| at_mm / 1e3).collect();
        let plan_of = |design: &Design| design.plan("coded", &simulation.simulator.to_string());
        let planned = |text: String| {
            PlannedScan::parse(TomlSource::new(&folder.join("plan.toml"), text), rig_source.clone())
        };
        let (design, scan) = self.within_minutes(&simulation, &reachable, &given, |design| {
            let scan = planned(plan_of(design))?;
            let about_s = scan.dry_run()?.about_s;
            Ok((scan, about_s))
        })?;
        say(super::text::of_design(&design, scan.dry_run()?.about_s));
        let foreseen = Foreseen::of_scan(&scan)?;
        let limits = self.permission.within_limits(foreseen.as_ref(), setup)?;
        self.permission.to(Act::Scan, setup)?;
        let coded = folder.join("coded");
        if let Some(code) = self.scan(scan, &coded)? {
            return Ok(code);
        }
        let recorded = RecordedScan::open(&coded)?;
        // The medium may have been measured at the start of the scan.
        let simulation = Simulation { medium: recorded.setup.medium.medium(), ..simulation };
        let readings = CodedReadings::of(&recorded);
        let options = Options { seed: self.seed, ..Options::default() };
        let found = calibrate(&simulation, &readings, options).into_diagnostic()?;
        let mut named = recorded.setup.clone();
        named.name = setup.name.clone();
        let file = file_of(&found, &named, raw.text());
        let path = folder.join(FILE);
        write(&path, file.text())?;
        let mut report = CalibrationReport::of(&found, &readings, &named, path);
        report.since_earlier = self.since_earlier(&file)?;

        let focus_m = focus_of(&simulation, setup);
        let check = self.check(&simulation, &found, &design, &reachable, focus_m)?;
        let checked = folder.join("check");
        let scan = planned(check.plan)?;
        // Its foci may be louder for people than the codes.
        let foreseen = Foreseen::of_scan(&scan)?;
        limits.within_limits(foreseen.as_ref(), setup)?;
        if let Some(code) = self.scan(scan, &checked)? {
            return Ok(code);
        }
        let recorded = RecordedScan::open(&checked)?;
        let codes = of_foci(&recorded, 0..check.codes);
        report.gap = Some(gap(&found, &simulation, &CodedReadings::of(&codes)));
        let lines = [0, 1].map(|axis| {
            [0, 1].map(|which| figures_on(&recorded, check.codes + which, axis, focus_m))
        });
        let lines: Vec<[FocusFigures; 2]> =
            lines.into_iter().filter_map(|[before, after]| Some([before?, after?])).collect();
        report.focus = Some(FocusGain { at_mm: (focus_m * 1e3).into(), lines });
        self.show(&report, &folder)?;
        if !self.showing.prints_json() {
            say(format!(
                "to use it, write into [array] of {}: calibration = \"{}\"",
                rig.display(),
                beside(rig, &report.file)
            ));
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Prints a result and writes it as JSON.
    pub(super) fn show(&self, report: &CalibrationReport, folder: &Path) -> miette::Result<()> {
        write(&folder.join(RESULT), &serde_json::to_string_pretty(report).into_diagnostic()?)?;
        match self.showing.prints_json() {
            true => print_json(report),
            false => print(&in_words(report)),
        }
    }

    /// Runs a scan; the exit code if it ended early.
    fn scan(&self, scan: PlannedScan, folder: &Path) -> miette::Result<Option<ExitCode>> {
        let hooks = self.trust.in_hooks_of(&scan)?;
        let run = ScanRun::begin(scan, folder, simulated_devices);
        let ending = run_scan(run, &hooks, &self.showing)?;
        Ok(match ending {
            Ending::Complete => None,
            Ending::Partial { .. } => Some(report_ending(folder, &ending)),
        })
    }

    /// The design with the most readings that fit into the time.
    fn within_minutes(
        &self,
        simulation: &Simulation,
        reachable: &[Vec3],
        given: &[Vec3],
        planned: impl Fn(&Design) -> miette::Result<(PlannedScan, f64)>,
    ) -> miette::Result<(Design, PlannedScan)> {
        let (elements, time_s) = (simulation.array.len(), self.minutes.get() * 60.0);
        let of = |readings: usize| {
            Design::choose(simulation, reachable, given, readings, self.seed).ok_or_else(|| {
                miette!(
                    help =
                        "give places with --at-mm, or correct travel_mm and keep_out in [motion]",
                    "the robot reaches none of the places from which the array could be calibrated"
                )
            })
        };
        let mut readings = MOST_PER_CHANNEL * elements;
        // The time is a constant plus a share for each reading: two trials are enough.
        for _ in 0..3 {
            let design = of(readings)?;
            let (scan, about_s) = planned(&design)?;
            if about_s <= time_s {
                return Ok((design, scan));
            }
            readings = (readings as f64 * time_s / about_s * 0.98) as usize;
            if readings < LEAST_PER_CHANNEL * elements {
                break;
            }
        }
        Err(miette!(
            help = "allow more with --minutes, or shorten settle_ms or samples in [receiver]",
            "{:.1} minutes are too few for {elements} elements: at least {} readings are needed",
            self.minutes.get(),
            LEAST_PER_CHANNEL * elements
        ))
    }

    /// The plan of the second scan: other codes at other places, and lines through a focus with the drive as it was and compensated.
    fn check(
        &self,
        simulation: &Simulation,
        found: &Calibration,
        design: &Design,
        reachable: &[Vec3],
        focus_m: Vec3,
    ) -> miette::Result<Check> {
        let others = reachable.iter().filter(|place| !design.places_m.contains(place));
        let mut places: Vec<Vec3> = others.copied().collect();
        // From one end of the array to the other.
        let every = (places.len() / CHECKED_PLACES).max(1);
        places = places.into_iter().step_by(every).take(CHECKED_PLACES).collect();
        if places.is_empty() {
            places = design.places_m.clone();
        }
        let codes = Design::for_check(simulation, &places, CHECKED, self.seed.wrapping_add(1));
        let codes = codes.ok_or_else(|| miette!("there is no place for the check"))?;
        let mut plan = codes.plan("check", &simulation.simulator.to_string());
        let phases = |excitation: &Excitation| {
            excitation.phases_rad(&simulation.array, &simulation.medium, simulation.frequency_hz)
        };
        let focused = phases(&Excitation::Focus(focus_m));
        let at_true_places: Vec<f64> =
            found.channels.iter().map(|channel| focused[channel.drives]).collect();
        // The driver rounds delays to the controller's steps itself.
        let unrounded = Steps { phase: 1 << 20, level: 1 };
        let drives = compensated(&found.channels, &at_true_places, unrounded);
        for phases in [focused, drives.iter().map(|drive| drive.phase_rad).collect()] {
            let phases: Vec<String> =
                phases.iter().map(|phase| format!("{:.6}", phase.rem_euclid(TAU))).collect();
            let _ = write!(plan, "\n[[focus]]\nphases_rad = [{}]\n", phases.join(","));
        }
        let count = codes.drives.len();
        let half_mm = LINE_WIDTHS * focus_width_m(simulation, focus_m) * 1e3;
        for axis in [Vec3::x(), Vec3::y()] {
            let [from, to] = [-1.0, 1.0].map(|side| focus_m * 1e3 + axis * side * half_mm);
            let _ = write!(
                plan,
                "\n[[line]]\nfrom_mm = [{:?}, {:?}, {:?}]\nto_mm = [{:?}, {:?}, {:?}]\nstep_mm = {:?}\nfoci = [{count}, {}]\n",
                from.x,
                from.y,
                from.z,
                to.x,
                to.y,
                to.z,
                2.0 * half_mm / LINE_STEPS as f64,
                count + 1,
            );
        }
        Ok(Check { plan, codes: count })
    }
}

/// The second scan.
struct Check {
    plan: String,
    /// How many of its drives are codes; two foci follow.
    codes: usize,
}

/// The rig file without a calibration of an earlier day.
fn without_calibration(rig: &TomlSource) -> miette::Result<TomlSource> {
    let mut document: DocumentMut = rig.text().parse().into_diagnostic()?;
    if let Some(array) = document.get_mut("array").and_then(|array| array.as_table_like_mut()) {
        let named = array.remove("calibration").is_some();
        let compensates = array.remove("compensate").is_some();
        if named || compensates {
            return Ok(TomlSource::new(rig.path(), document.to_string()));
        }
    }
    // Unchanged, so that a fault names the line of the file.
    Ok(rig.clone())
}

/// The places that the robot can reach.
fn reachable(simulation: &Simulation, setup: &RigSetup) -> Vec<Vec3> {
    let (envelope, frame) = (setup.rig.motion.envelope(), setup.rig.motion.frame());
    let mut places = candidates(&simulation.array);
    places.retain(|&at_m| envelope.check_target(frame.to_robot(at_m)).is_ok());
    places
}

/// A focus above the middle of the array, as high as the array is wide or as high as the robot reaches.
fn focus_of(simulation: &Simulation, setup: &RigSetup) -> Vec3 {
    let (envelope, frame) = (setup.rig.motion.envelope(), setup.rig.motion.frame());
    let wide_m = width_m(simulation);
    let tried =
        [1.0, 0.8, 0.6, 0.5].map(|share| Vec3::new(0.0, 0.0, (share * wide_m * 1e3).round() / 1e3));
    let reached = |at_m: &Vec3| envelope.check_target(frame.to_robot(*at_m)).is_ok();
    tried.into_iter().find(reached).unwrap_or(tried[0])
}

fn width_m(simulation: &Simulation) -> f64 {
    let elements = simulation.array.elements().iter();
    2.0 * elements.map(|element| element.centre_m.xy().amax()).fold(0.02, f64::max)
}

/// The wavelength times the distance over the width of the array, m.
fn focus_width_m(simulation: &Simulation, focus_m: Vec3) -> f64 {
    simulation.medium.wavelength_m(simulation.frequency_hz) * focus_m.z / width_m(simulation)
}

/// The part of a scan with some of its drives.
fn of_foci(scan: &RecordedScan, foci: std::ops::Range<usize>) -> RecordedScan {
    let mut part = scan.clone();
    part.samples.retain(|sample| sample.focus.is_none_or(|focus| foci.contains(&focus)));
    part.setup.foci.truncate(foci.end);
    part
}

/// The figures of the line through the focus along an axis, with one drive.
fn figures_on(
    scan: &RecordedScan,
    focus: usize,
    axis: usize,
    focus_m: Vec3,
) -> Option<FocusFigures> {
    debug_assert!(matches!(scan.setup.foci.get(focus), Some(FocusSection::Phases(_))));
    let across = 1 - axis;
    let on_line = |at_m: &Vec3| (at_m[across] - focus_m[across]).abs() < 1e-4;
    let mut points: Vec<(f64, f64)> = scan
        .samples
        .iter()
        .filter(|sample| sample.focus == Some(focus) && on_line(&sample.position_m()))
        .map(|sample| (sample.position_m()[axis], sample.reading))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-5);
    let (along_m, levels): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    focus_figures(&along_m, &levels)
}

/// The path of a file from the folder of another, if it lies below it, or as it is.
fn beside(rig: &Path, file: &Path) -> String {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let file = absolute(file);
    let folder: PathBuf = absolute(rig).parent().map(Path::to_owned).unwrap_or_default();
    file.strip_prefix(&folder).unwrap_or(&file).display().to_string()
}
