//! `fieldgap exposure`: the sound level where people are, against limits; and what a scan must say of it before it starts.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::output::{print, print_json};
use super::sounding::{is_heard, minutes_today};
use fieldgap_acoustics::{Excitation, Simulator, Vec3};
use fieldgap_acquisition::{PlannedScan, RigSetup, rig_of};
use fieldgap_comparison::{Registering, compare};
use fieldgap_exposure::{
    Assessment, Drives, Exposure, Radiating, SourceLevel, SourceStatement, assess,
};
use fieldgap_input::TomlSource;
use fieldgap_level::{Kind, Line, Standing};
use fieldgap_records::{FocusSection, Plan, RecordedScan};
use fieldgap_text::paragraph;

/// The `exposure` command.
#[derive(Debug, Args)]
pub(super) struct ExposureCommand {
    /// Plan file: each of its drives; or rig file: the array focused at each place, the most that it can give there
    #[arg(value_name = "PLAN|RIG")]
    file: PathBuf,
    /// Rig file of a plan [default: the one named in the plan]
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Take the level of the elements from this record, whose receiver has a known sensitivity [default: [exposure.source] of the rig file]
    #[arg(long, value_name = "RECORD")]
    record: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// What is foreseen of the exposure by a scan.
#[derive(Debug, Serialize)]
pub(super) struct Foreseen {
    #[serde(flatten)]
    assessment: Assessment,
    /// Minutes with the array driven in what is begun; `None` if they are not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    minutes: Option<f64>,
    /// Minutes with the array driven today; `None` of a virtual array.
    #[serde(skip_serializing_if = "Option::is_none")]
    minutes_today: Option<f64>,
    /// The shortest of the limits of a day, and whose it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    most_minutes: Option<(f64, String)>,
}

impl ExposureCommand {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let source = TomlSource::read(&self.file)?;
        // A rig file has a robot, and a plan has none.
        let is_rig =
            source.text().parse::<toml::Table>().is_ok_and(|table| table.contains_key("motion"));
        let (rig_setup, scan) = if is_rig {
            (RigSetup::parse(source)?, None)
        } else {
            let plan = Plan::parse(source)?;
            let rig = rig_of(&plan, self.rig.as_deref())?;
            let scan = PlannedScan::read(&self.file, Some(&rig))?;
            (scan.rig_setup().clone(), Some(scan))
        };
        let exposure = rig_setup.exposure.clone().ok_or_else(|| {
            miette!(
                help = "add [exposure] with places and limits; docs/levels.md describes it",
                "{} has no [exposure], nor has a plan for it",
                rig_setup.source().path().display()
            )
        })?;
        let foreseen = Foreseen::of(&exposure, &rig_setup, scan.as_ref(), self.record.as_deref())?;
        match self.json {
            true => print_json(&foreseen)?,
            false => print(&foreseen.to_text())?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl Foreseen {
    /// What is foreseen of a scan; `None` if its rig file states no places.
    pub(super) fn of_scan(scan: &PlannedScan) -> miette::Result<Option<Self>> {
        let rig_setup = scan.rig_setup();
        let exposure = rig_setup.exposure.as_ref();
        exposure.map(|exposure| Self::of(exposure, rig_setup, Some(scan), None)).transpose()
    }

    /// The same of an array that is driven without a plan, one drive after another, for a time if it is known.
    pub(super) fn of_drives(
        rig_setup: &RigSetup,
        drives: &[Excitation],
        seconds: Option<f64>,
    ) -> miette::Result<Option<Self>> {
        let Some(exposure) = &rig_setup.exposure else { return Ok(None) };
        let minutes = seconds.map(|seconds| seconds / 60.0);
        Self::found(exposure, rig_setup, Drives::These(drives), None, minutes).map(Some)
    }

    fn of(
        exposure: &Exposure,
        rig_setup: &RigSetup,
        scan: Option<&PlannedScan>,
        record: Option<&Path>,
    ) -> miette::Result<Self> {
        let minutes = match scan {
            // The readings of a loop are not planned yet.
            Some(scan) if !scan.visits().is_empty() => Some(scan.dry_run()?.driven_s / 60.0),
            _ => None,
        };
        let excitations: Option<Vec<Excitation>> =
            scan.map(|scan| scan.plan().foci.iter().map(FocusSection::excitation).collect());
        let drives = excitations.as_ref().map_or(Drives::AtEachPlace, |all| Drives::These(all));
        Self::found(exposure, rig_setup, drives, record, minutes)
    }

    fn found(
        exposure: &Exposure,
        rig_setup: &RigSetup,
        drives: Drives<'_>,
        record: Option<&Path>,
        minutes: Option<f64>,
    ) -> miette::Result<Self> {
        let radiating = radiating(rig_setup);
        let source = match (record, &exposure.source) {
            (Some(record), _) => Some(of_record(record, rig_setup)?),
            (None, Some(SourceStatement::Record(record))) => Some(of_record(record, rig_setup)?),
            (None, Some(SourceStatement::Sheet(sheet))) => {
                let air = rig_setup.medium.changed(0.0, 0.0, radiating.frequency_hz);
                Some(sheet.source_level(air.attenuation_np_m))
            }
            (None, None) => None,
        };
        let heard = is_heard(rig_setup);
        Ok(Self {
            assessment: assess(exposure, radiating, source.as_ref(), drives),
            minutes,
            minutes_today: heard.then(|| minutes_today(&rig_setup.name)).transpose()?,
            most_minutes: exposure.minutes_a_day().map(|(most, limit)| (most, limit.name.clone())),
        })
    }

    /// The table, and the time.
    pub(super) fn to_text(&self) -> String {
        let mut text = self.assessment.to_text();
        let mut times = Vec::new();
        times.extend(self.minutes.map(|minutes| format!("this {minutes:.1} min")));
        times.extend(self.minutes_today.map(|minutes| format!("today {minutes:.1} min before it")));
        let most = self.most_minutes.as_ref();
        times.extend(most.map(|(most, name)| format!("at most {most} min a day ({name})")));
        if !times.is_empty() {
            let times = format!("time with the array driven: {}", times.join(", "));
            text += "\n";
            text += &paragraph(&times, 0, 2);
        }
        if self.minutes_today.is_none() {
            text += "the array is virtual: nobody hears it, and its time is not counted\n";
        }
        text
    }

    /// What speaks against a start, a sentence each.
    pub(super) fn concerns(&self) -> Vec<String> {
        let mut concerns = Vec::new();
        if self.assessment.source.is_none() {
            concerns.push(self.assessment.to_text().trim_end().replace("\n  ", " "));
        }
        for place in &self.assessment.places {
            for against in
                place.against.iter().filter(|against| against.standing != Standing::Within)
            {
                let what = match against.standing {
                    Standing::Above => "is above",
                    _ => "is not shown to be below",
                };
                concerns.push(format!(
                    "{}: {:.1} dB ± {:.1} dB (k = 2) {what} the limit of {:.1} dB ({})",
                    place.name,
                    place.level_db,
                    place.budget.expanded_db(),
                    against.limit_db,
                    against.limit
                ));
            }
        }
        if let Some((most, name)) = &self.most_minutes {
            let all = self.minutes_today.unwrap_or(0.0) + self.minutes.unwrap_or(0.0);
            if all > *most {
                concerns.push(format!(
                    "{all:.1} minutes with the array driven today, with this, are more than {most} ({name})"
                ));
            }
        }
        concerns
    }
}

/// Pistons, or the transducer that the rig file names.
fn simulator(rig_setup: &RigSetup) -> Simulator {
    match rig_setup.array.transducer_file() {
        Some(_) => Simulator::Transducer,
        None => Simulator::Piston,
    }
}

fn radiating(rig_setup: &RigSetup) -> Radiating<'_> {
    Radiating {
        array: rig_setup.nominal_array(),
        medium: &rig_setup.medium,
        frequency_hz: rig_setup.array.frequency_hz(),
        simulator: simulator(rig_setup),
    }
}

/// The level of the elements from a record of the same array: the simulation is scaled to the scan, and the level of its loudest peak is known.
fn of_record(folder: &Path, rig_setup: &RigSetup) -> miette::Result<SourceLevel> {
    let scan = RecordedScan::open(folder)?;
    let setup = &scan.setup;
    if setup.array.array().len() != rig_setup.nominal_array().len()
        || setup.array.frequency_hz() != rig_setup.array.frequency_hz()
    {
        return Err(miette!(
            help = "give a record of the array of the rig file, at its frequency",
            "{} is of an array of {} elements at {} Hz",
            folder.display(),
            setup.array.array().len(),
            setup.array.frequency_hz()
        ));
    }
    let comparison = compare(&scan, simulator(rig_setup), Registering::Auto).into_diagnostic()?;
    let loudest = comparison.levels.as_ref().and_then(|levels| levels.loudest());
    let loudest = loudest.ok_or_else(|| {
        miette!(
            help = "state `sensitivity_v_pa` in [receiver] of its scan.toml; `fieldgap calibrate level` finds it",
            "the sensitivity of the receiver of {} is not known, so that its readings are no levels",
            folder.display()
        )
    })?;
    let same = |plane: &&fieldgap_comparison::PlaneComparison| {
        plane.focus == loudest.focus && plane.z_m == loudest.z_m
    };
    let plane = comparison.planes.iter().find(same).expect("each level is of a plane");
    let [x_m, y_m] = plane.simulation.peak_position_m.map(|along| along.value);
    let at_m = comparison.registration.pose().to_array(&Vec3::new(x_m, y_m, plane.z_m));
    let radiated =
        Radiating { array: setup.array.array(), medium: &setup.medium, ..radiating(rig_setup) };
    let unit = radiated.of_unit_elements(&setup.foci[loudest.focus].excitation(), at_m);
    if !(unit.is_finite() && unit > 0.0) {
        return Err(miette!("no sound is simulated at the peak of {}", folder.display()));
    }
    let misfit = comparison.overall.residual_rms_ratio;
    Ok(SourceLevel {
        pa_m: loudest.simulation.rms_pa / unit,
        origin: format!(
            "record {} of {}, {:.1} dB at its loudest peak; it holds for that drive voltage",
            comparison.scan_name, setup.recorded, loudest.scan.level_db
        ),
        lines: vec![
            Line::decibels("measured level", Kind::B, loudest.budget.combined_db),
            Line::relative("misfit of scan and simulation", Kind::B, misfit),
        ],
    })
}
