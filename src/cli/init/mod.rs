//! `fieldgap init`: a rig file and a first plan from a dozen questions.

mod answers;
mod files;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, WrapErr, miette};

use self::answers::Given;
use crate::cli::output::say;
use crate::rig_file::RigFile;
use fieldgap_input::TomlSource;
use fieldgap_records::Plan;
use fieldgap_rig::link::serial_ports;

/// The `init` command.
#[derive(Debug, Args)]
pub(super) struct Init {
    /// Folder for the files
    #[arg(default_value = ".")]
    folder: PathBuf,
    #[command(flatten)]
    given: Given,
}

impl Init {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let answers = self.given.answers(&serial_ports())?;
        let rig_name = format!("{}.toml", file_name(&answers.name));
        let truth_name = "virtual-laboratory.toml";
        let plan = files::plan(&answers, &rig_name).ok_or_else(|| {
            miette!(
                help = "check --travel-mm and --centre-mm: both are in the robot's own axes",
                "the travel has no room for a plane above the array: nothing was written"
            )
        })?;
        let mut texts = Vec::new();
        if files::has_virtual_devices(&answers) {
            texts.push((self.folder.join(truth_name), files::truth(&answers)));
        }
        let rig = self.folder.join(&rig_name);
        texts.push((rig.clone(), files::rig(&answers, truth_name)));
        let plan_path = self.folder.join("first-scan.toml");
        texts.push((plan_path.clone(), plan));
        // What would be refused later is not written.
        RigFile::parse(TomlSource::new(&rig, &texts[texts.len() - 2].1))?;
        Plan::parse(TomlSource::new(&plan_path, &texts[texts.len() - 1].1))?;
        if let Some((taken, _)) = texts.iter().find(|(path, _)| path.exists()) {
            return Err(miette!(
                help = "choose another folder or another --name",
                "{} exists already and is not overwritten",
                taken.display()
            ));
        }
        std::fs::create_dir_all(&self.folder).into_diagnostic()?;
        for (path, text) in &texts {
            write_new(path, text)?;
        }
        say(next_steps(&rig, &plan_path));
        Ok(ExitCode::SUCCESS)
    }
}

/// A name as the name of a file.
fn file_name(name: &str) -> String {
    let kept = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_') { c } else { '-' };
    name.chars().map(kept).collect()
}

fn write_new(path: &Path, text: &str) -> miette::Result<()> {
    let file = std::fs::OpenOptions::new().write(true).create_new(true).open(path);
    file.and_then(|mut file| std::io::Write::write_all(&mut file, text.as_bytes()))
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be written", path.display()))?;
    say(format!("written: {}", path.display()));
    Ok(())
}

fn next_steps(rig: &Path, plan: &Path) -> String {
    let (rig, plan) = (rig.display(), plan.display());
    format!(
        "\nCheck the values in {rig}; then:\n\n  fieldgap rig check {rig}\n  fieldgap scan {plan} --dry-run\n  fieldgap run {plan}"
    )
}
