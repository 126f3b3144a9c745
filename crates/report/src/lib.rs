//! Pictures, tables and pages of results: one function for each kind of result, which writes a folder.
//!
//! | result | function |
//! |---|---|
//! | comparison of a scan with simulations | [`write()`], and [`csv()`] for the table alone |
//! | diagnosis | [`write_diagnosis`] |
//! | map made of readings | [`write_measured_map`] |
//! | simulated planes | [`write_simulation`] |
//! | study over parameters | [`write_study`] |
//! | characterized transducer | [`write_transducer`] |
//! | transducer models | [`write_transducer_models`] |
//! | campaign of many scans | [`write_campaign`] |
//! | rounds of a closed loop | [`write_rounds`] |
//! | tactile display | [`write_display`] |
//! | many records over time | [`write_trend`] |
//!
//! A page is one HTML file that needs nothing beside it and no network. Its pictures are also written as PNG and SVG, its
//! figures as text, CSV and JSON. The same result gives the same files, byte for byte.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acoustics::{Simulator, Vec3};
//! use fieldgap_comparison::{Registering, compare};
//! use fieldgap_input::TomlSource;
//! use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
//! use fieldgap_report::{ReportContext, csv, write};
//!
//! let source = r#"
//! format = 1
//! name = "example"
//! recorded = 2026-11-20T17:00:00Z
//! reading = "V"
//!
//! [array]
//! frequency_hz = 40000.0
//! layout = "square"
//! columns = 4
//! rows = 4
//! element_diameter_mm = 10.5
//! spacing_mm = 0.0
//!
//! [medium]
//! speed_of_sound_m_s = 343.0
//!
//! [simulator]
//! model = "piston"
//!
//! [[focus]]
//! x_mm = 0.0
//! y_mm = 0.0
//! z_mm = 100.0
//! "#;
//! let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), source))?;
//!
//! // The readings are those of a piston model. They are compared with the thesis's simulator.
//! let points: Vec<Vec3> = (-5..=5)
//!     .flat_map(|y| (-5..=5).map(move |x| Vec3::new(0.004 * x as f64, 0.004 * y as f64, 0.1)))
//!     .collect();
//! let readings = setup.simulation(Simulator::Piston, 0).expect("one focus").magnitudes(&points);
//! let samples = points
//!     .iter()
//!     .zip(readings)
//!     .map(|(at_m, reading)| RecordedSample::measured(0.0, Some(0), *at_m, reading, None))
//!     .collect();
//! let scan = RecordedScan { setup, samples };
//! let comparison = compare(&scan, Simulator::Corrected, Registering::GainOnly)?;
//!
//! let folder = tempfile::tempdir()?;
//! let context = ReportContext { title: "Example".to_owned(), ..ReportContext::default() };
//! let files = write(folder.path(), &context, &[comparison.clone()], None)?;
//! assert!(files.index.ends_with("index.html"));
//! assert_eq!(std::fs::read_to_string(&files.csv)?, csv(&[comparison]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answer;
mod campaign;
mod change;
mod context;
mod control_charts;
mod diagnosis;
mod display;
mod error;
mod explore;
mod figure;
mod figures;
mod folder;
mod html;
mod judgement;
mod map_pictures;
mod measured_map;
mod page;
mod peak_distance;
mod picture;
mod plane_table;
mod provenance;
mod rounds;
mod simulated_map;
mod simulated_section;
mod simulation;
mod study;
mod tables;
mod transducer;
mod transducer_models;
mod trend;
mod verdict;
mod words;
mod worst_plane;

use std::path::{Path, PathBuf};

pub use self::answer::{
    Cause, ProposedChange, ProposedCorrection, headline, headline_of_diagnosis,
};
pub use self::campaign::write_campaign;
pub use self::change::{ChangeFiles, write_change};
pub use self::context::{InputFile, ReportContext};
pub use self::control_charts::write_control_charts;
pub use self::diagnosis::{DiagnosisFiles, write_diagnosis};
pub use self::display::{DisplayFiles, PlayedDisplay, write_display};
pub use self::error::{PictureError, ReportError};
pub use self::map_pictures::write_measured_map;
pub use self::measured_map::MeasuredMap;
pub use self::picture::{PrintStyle, PrintStyleError};
pub use self::rounds::{LoopOfRounds, RoundsFiles, write_rounds};
pub use self::simulated_map::SimulatedMap;
pub use self::simulated_section::{SectionPlane, SimulatedSection};
pub use self::simulation::{SimulationFiles, write_sections, write_simulation};
pub use self::study::{StudyFiles, write_study};
pub use self::tables::csv;
pub use self::transducer::{TransducerFiles, write_transducer};
pub use self::transducer_models::write_transducer_models;
pub use self::trend::{Trend, TrendFiles, write_trend};

use self::figures::Figures;
use self::folder::Folder;
use fieldgap_comparison::Comparison;

/// The files of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportFiles {
    /// The page.
    pub index: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
    /// The figures as a text table.
    pub text: PathBuf,
    /// The figures as CSV, one row for each simulator, drive and height.
    pub csv: PathBuf,
    /// The complete comparisons with their maps, as a JSON list.
    pub json: PathBuf,
}

/// Writes the report of a scan into a folder, which is created if it is missing: one comparison for each
/// simulator (each simulator once), all of the same scan. The first comparison and its `cause`, where one was sought, are the answer
/// at the head of the page.
///
/// # Errors
/// [`ReportError`] if there is no comparison, or if a file cannot be written.
pub fn write(
    dir: &Path,
    context: &ReportContext,
    comparisons: &[Comparison],
    cause: Option<Cause<'_>>,
) -> Result<ReportFiles, ReportError> {
    if comparisons.is_empty() {
        return Err(ReportError::NothingCompared);
    }
    let figures = Figures::draw(comparisons, context.pictures)?;
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.all())?;
    let text = folder.put(tables::TEXT_NAME, tables::text(comparisons).as_bytes())?;
    let csv = folder.put(tables::CSV_NAME, tables::csv(comparisons).as_bytes())?;
    if let Some(levels) = tables::levels_csv(comparisons) {
        folder.put(tables::LEVELS_NAME, levels.as_bytes())?;
    }
    let json = folder.put(tables::JSON_NAME, &serde_json::to_vec(comparisons)?)?;
    let mut context = context.clone();
    if let Some(explore) = explore::page(&context, comparisons)? {
        folder.put(explore::EXPLORE_NAME, explore.as_bytes())?;
        context.pages.insert(0, ("Interactive maps".to_owned(), explore::EXPLORE_NAME.to_owned()));
    }
    // The page comes last: where it exists, the report is complete.
    let page = page::page(&context, comparisons, cause, &figures);
    let index = folder.put("index.html", page.as_bytes())?;
    Ok(ReportFiles { index, pictures, text, csv, json })
}
