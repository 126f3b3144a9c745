//! `fieldgap simulate --display`: pressure and force of a tactile display on skin, with pictures, without a rig.

use std::path::Path;
use std::process::ExitCode;

use miette::IntoDiagnostic;

use super::focus::{radiating, summary};
use super::output::{print, print_json, say};
use fieldgap_acoustics::Simulator;
use fieldgap_acoustics::radiation::SkinInAir;
use fieldgap_acquisition::RigSetup;
use fieldgap_display::{ComposedDisplay, DisplayFile, Playback, Stimulus, compose, stimulus};
use fieldgap_level::{Budget, COVERAGE_FACTOR, usual};
use fieldgap_report::{PlayedDisplay, write_display};
use fieldgap_rig::ArrayIdentity;

/// Arguments of `simulate` for a display.
pub(super) struct SimulateDisplay<'a> {
    pub display: &'a Path,
    pub rig: Option<&'a Path>,
    pub simulator: Option<Simulator>,
    pub out: Option<&'a Path>,
    pub json: bool,
}

impl SimulateDisplay<'_> {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let mut display = DisplayFile::read(self.display)?;
        if let Some(simulator) = self.simulator {
            display.output.simulator = simulator;
        }
        let rig_setup =
            RigSetup::read(&self.rig.map_or_else(|| display.rig_path(), Path::to_owned))?;
        let radiating = radiating(&rig_setup, &display);
        let controller = ArrayIdentity::of_thesis(radiating.array.len(), radiating.frequency_hz);
        let composed = compose(&display, &radiating, &controller)?;
        let element_db = display.output.element_db_at_300_mm.get();
        let playback = Playback::new(&composed.program, radiating, &controller, element_db);
        let skin = SkinInAir::new(radiating.medium, display.output.air_density_kg_m3.get());
        let felt = stimulus(&composed, &playback, skin, controller.carrier_hz());
        if let Some(folder) = self.out {
            let shown = PlayedDisplay {
                display: &display,
                composed: &composed,
                playback: &playback,
                skin,
                carrier_hz: controller.carrier_hz(),
            };
            let files = write_display(folder, &shown).into_diagnostic()?;
            for file in [files.animation, files.still, files.frames] {
                say(file.display());
            }
        }
        if self.json {
            print_json(&serde_json::json!({
                "display": display.name,
                "frames": composed.program.frames().len(),
                "loop_s": composed.program.loop_periods() as f64 / controller.carrier_hz(),
                "modulation_hz": composed.modulation_hz,
                "quality": composed.quality,
                "felt": felt,
                "level_budget": display.output.level_budget(),
            }))?;
        } else {
            print(&text(&composed, &controller, &felt, display.output.level_budget()))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn text(
    composed: &ComposedDisplay,
    controller: &ArrayIdentity,
    felt: &Stimulus,
    budget: Option<Budget>,
) -> String {
    let mut text = summary(composed, controller) + "\n";
    if let Some(quality) = composed.quality {
        text += &format!(
            "simultaneous foci: uniformity {:.3}, efficiency {:.3}\n",
            quality.uniformity, quality.efficiency
        );
    }
    text += &format!(
        "\n{:>5} {:>6} {:>7} {:>12} {:>6} {:>9} {:>8} {:>9} {:>9} {:>9} {:>9}\n",
        "focus",
        "frames",
        "Pa rms",
        "(min-max)",
        "dB",
        "peak off",
        "of 8 kPa",
        "force",
        "pressure",
        "steady",
        "varying"
    );
    for focus in &felt.foci {
        let off = focus.peak_off_mm.map_or("-".to_owned(), |off_mm| format!("{off_mm:.2} mm"));
        let swings = focus.swinging_pa.map_or("-".to_owned(), |pa| format!("{pa:.2} Pa"));
        text += &format!(
            "{:>5} {:>6} {:>7.0} {:>12} {:>6.1} {:>9} {:>8} {:>9} {:>9} {:>9} {:>9}\n",
            focus.focus,
            focus.frames,
            focus.rms_pa,
            format!("({:.0}-{:.0})", focus.least_pa, focus.most_pa),
            focus.level_db,
            off,
            format!("{:.0} %", focus.of_threshold * 100.0),
            format!("{:.2} mN", focus.force_mn),
            format!("{:.2} Pa", focus.radiation_pa),
            format!("{:.2} Pa", focus.steady_pa),
            swings,
        );
    }
    text += "\ndB: mean level of the focus re 20 µPa rms; ";
    text += &match budget {
        Some(budget) => format!(
            "expanded uncertainty (k = 2) {:.1} dB, of this {:.1} dB for the simulation by the program's own value",
            budget.expanded_db(),
            COVERAGE_FACTOR * usual::SIMULATION_DB
        ),
        None => "its uncertainty is unknown without `element_u_db` in [output]".to_owned(),
    };
    text += "\nforce: radiation force on a disc of 10 mm radius at full envelope\npressure: radiation pressure at the focus at full envelope\n\
             steady, varying: mean radiation pressure over time and its amplitude at the modulation frequency, at the place of the \
             largest variation\n8 kPa: threshold of skin as given by the thesis\n";
    text
}
