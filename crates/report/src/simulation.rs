//! The pictures and the interactive page of simulated planes.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::{PictureError, ReportError};
use super::explore;
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{Drawn, PrintStyle, SimulatedPanels};
use super::simulated_map::SimulatedMap;
use super::simulated_section::SimulatedSection;
use fieldgap_acoustics::Simulator;
use fieldgap_text::height_mm;

/// The files of a simulation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimulationFiles {
    /// Amplitude and phase of each plane, PNG and SVG.
    pub pictures: Vec<PathBuf>,
    /// The interactive page; `None` without planes.
    pub page: Option<PathBuf>,
}

/// Draws simulated planes into a folder, which is created if it is missing: a picture of each, and one interactive page of all.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_simulation(
    dir: &Path,
    title: &str,
    simulator: Simulator,
    planes: &[SimulatedMap],
    style: PrintStyle,
) -> Result<SimulationFiles, ReportError> {
    let several_drives = planes.iter().any(|plane| plane.drive != planes[0].drive);
    let figures: Vec<Option<Figure>> = planes
        .par_iter()
        .map(|plane| {
            let drive =
                if several_drives { format!("-drive{}", plane.drive) } else { String::new() };
            let height = height_mm(plane.grid.z_m);
            let name = format!("field{drive}-z{}mm", height.replace('\u{2212}', "-"));
            figure(name, &plane.into(), simulator, style)
        })
        .collect::<Result<_, PictureError>>()?;
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.iter().flatten())?;
    let page = explore::page_of_simulation(title, simulator, planes)?;
    let page = page.map(|page| folder.put(explore::EXPLORE_NAME, page.as_bytes())).transpose()?;
    Ok(SimulationFiles { pictures, page })
}

/// Draws sections through a volume into a folder, which is created if it is missing: amplitude and phase of each, PNG and SVG. Returns the
/// files.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_sections(
    dir: &Path,
    simulator: Simulator,
    sections: &[SimulatedSection],
    style: PrintStyle,
) -> Result<Vec<PathBuf>, ReportError> {
    let figures: Vec<Option<Figure>> = sections
        .par_iter()
        .map(|section| {
            figure(format!("section-{}", section.plane.name()), section, simulator, style)
        })
        .collect::<Result<_, PictureError>>()?;
    Folder::make(dir)?.put_figures(figures.iter().flatten())
}

fn figure(
    name: String,
    section: &SimulatedSection,
    simulator: Simulator,
    style: PrintStyle,
) -> Result<Option<Figure>, PictureError> {
    let panels = SimulatedPanels::new(section, simulator);
    let drawn = panels.map(|panels| Drawn::printed(panels, style)).transpose()?;
    Ok(drawn.map(|drawn| Figure::new(name, drawn)))
}
