//! `fieldgap transducers`: errors of each transducer model against the integral over a vibrating piston.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::output::{print, print_json, say};
use super::simulate::length;
use fieldgap_acoustics::Medium;
use fieldgap_input::{Frequency, Positive, SoundSpeed};
use fieldgap_report::write_transducer_models;
use fieldgap_study::{LOBE_DISTANCES_M, ModelAgainstIntegral, models_against_integral};

/// The `transducers` command.
#[derive(Debug, Args)]
pub(super) struct Transducers {
    /// Radius of the piston, mm
    #[arg(long, value_name = "MM", default_value = "4.5", value_parser = length)]
    radius_mm: Positive,
    /// Frequency, Hz
    #[arg(long, value_name = "HZ", default_value = "40000", value_parser = frequency)]
    frequency_hz: Frequency,
    /// Speed of sound, m/s
    #[arg(long, value_name = "M/S", default_value = "343", value_parser = speed)]
    speed_of_sound_m_s: SoundSpeed,
    /// Write a picture of each model to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the curves as JSON
    #[arg(long)]
    json: bool,
}

/// Largest radius of a piston, in wavelengths: a hundred times that of the thesis's transducer.
const MOST_WAVELENGTHS: f64 = 50.0;

fn frequency(text: &str) -> Result<Frequency, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    Frequency::new(number).map_err(|refused| refused.to_string())
}

fn speed(text: &str) -> Result<SoundSpeed, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    SoundSpeed::new(number).map_err(|refused| refused.to_string())
}

impl Transducers {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let medium = Medium { speed_of_sound_m_s: self.speed_of_sound_m_s.get() };
        let radius_m = self.radius_mm.get() * 1e-3;
        let wavelengths = radius_m / medium.wavelength_m(self.frequency_hz.get());
        if wavelengths > MOST_WAVELENGTHS {
            return Err(miette!(
                help = "choose a smaller radius or a lower frequency",
                "a piston of {wavelengths:.0} wavelengths in radius is too large: at most {MOST_WAVELENGTHS} are integrated"
            ));
        }
        let models = models_against_integral(radius_m, medium, self.frequency_hz.get());
        if self.json {
            print_json(&models)?;
        } else {
            print(&table(&models))?;
        }
        if let Some(folder) = &self.out {
            let pictures = write_transducer_models(folder, &models).into_diagnostic()?;
            say(format!("{} pictures: {}", pictures.len(), folder.display()));
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Largest errors, percent.
fn table(models: &[ModelAgainstIntegral]) -> String {
    let mut text = format!(
        "largest error against the integral over the piston, in percent; equal on the axis at 100 mm\n{:>15} {:>16} {:>16}",
        "model", "axis 30-300 mm", "axis 10-30 mm"
    );
    for distance_m in LOBE_DISTANCES_M {
        let _ = write!(text, " {:>16}", format!("{:.0} mm, 30/60°", distance_m * 1e3));
    }
    text.push('\n');
    for model in models {
        let percent = |error: f64| format!("{:.2}", 100.0 * error);
        let _ = write!(
            text,
            "{:>15} {:>16} {:>16}",
            model.simulator.to_string(),
            percent(model.on_axis_error(0.03, 0.3)),
            percent(model.on_axis_error(0.01, 0.03))
        );
        for distance in 0..LOBE_DISTANCES_M.len() {
            let [near, wide] = [30f64, 60f64]
                .map(|within| percent(model.lobe_error(distance, within.to_radians())));
            let _ = write!(text, " {:>16}", format!("{near} / {wide}"));
        }
        text.push('\n');
    }
    text
}
