//! `fieldgap export`: write a record for other programs.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::output::print;
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Registering, compare};
use fieldgap_exchange::Dataset;
use fieldgap_exchange::export::{
    Provenance, dataset_of_record, dataset_of_simulation, grid_rows, is_simulation, may_write,
    write_dataset,
};
use fieldgap_records::RecordedScan;

/// The `export` command.
#[derive(Debug, Args)]
pub(super) struct Export {
    /// Folder of the record, or of a field that `simulate --out` wrote
    record: PathBuf,
    /// File to write; its ending is the format: .nc (NetCDF), .h5 (HDF5), .mat (MATLAB), .npz (NumPy) or .csv (the readings
    /// alone)
    file: PathBuf,
    /// Simulator of the simulation beside the readings [default: as in the record]
    #[arg(long, value_name = "NAME", conflicts_with = "no_simulation")]
    simulator: Option<Simulator>,
    /// Export the readings without a simulation
    #[arg(long)]
    no_simulation: bool,
    /// Export the maps on grids in place of the readings, one row for each point of each height: for CSV
    #[arg(long)]
    grids: bool,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

impl Export {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        // Before the comparison, which may take long.
        may_write(&self.file, self.force).into_diagnostic()?;
        let provenance = Provenance {
            program: format!("fieldgap {}", env!("CARGO_PKG_VERSION")),
            exported: jiff::Timestamp::now().round(jiff::Unit::Second).into_diagnostic()?,
        };
        if is_simulation(&self.record) {
            let dataset = dataset_of_simulation(&self.record, &provenance)?;
            self.write(&dataset)?;
            print(&format!("simulated field: {}\n", self.file.display()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let scan = RecordedScan::open(&self.record)?;
        let comparison = if self.no_simulation {
            Err("not requested".to_owned())
        } else {
            let simulator = self.simulator.unwrap_or(scan.setup.simulator);
            compare(&scan, simulator, Registering::Auto).map_err(|why| why.to_string())
        };
        let comparison = comparison.as_ref().map_err(String::as_str);
        let dataset = dataset_of_record(&scan, &self.record, comparison, &provenance);
        self.write(&dataset)?;
        let simulation = match comparison {
            Ok(comparison) => format!("with the simulation ({})", comparison.simulator),
            Err(why) => format!("without a simulation: {why}"),
        };
        print(&format!(
            "{} readings, {simulation}: {}\n",
            scan.samples.len(),
            self.file.display()
        ))?;
        Ok(ExitCode::SUCCESS)
    }

    fn write(&self, dataset: &Dataset) -> miette::Result<()> {
        let rows = self.grids.then(|| grid_rows(dataset)).transpose().into_diagnostic()?;
        write_dataset(rows.as_ref().unwrap_or(dataset), &self.file, self.force).into_diagnostic()
    }
}
