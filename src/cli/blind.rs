//! `fieldgap blind`: sets of scans with sealed causes, to check diagnoses.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, Subcommand, ValueEnum};

use super::blind_rigs::{BlindRigs, rigs_in};
use super::blind_scans::BlindScans;
use super::blind_vary::Vary;
use super::on::{OnArgs, batch_beside};
use super::output::{print, print_json, report_error, say};
use super::progress::counting_bar;
use fieldgap_acoustics::Simulator;
use fieldgap_blind::{
    LOOP_PLAN, Run, Score, Seal, SetToMake, Shares, Worlds, foreign_answers, fresh_seed, seal_truth,
};
use fieldgap_diagnosis::diagnose;
use fieldgap_input::Fraction;

/// Where diagnoses are kept in a set's folder.
const DIAGNOSES: &str = "diagnoses";

/// The `blind` command.
#[derive(Debug, Args)]
pub(super) struct Blind {
    #[command(subcommand)]
    step: Step,
}

#[derive(Debug, Subcommand)]
enum Step {
    /// Make a set of scans, and seal their causes
    Make(Make),
    /// Seal the answers to scans that another program made
    Seal(SealAnswers),
    /// Diagnose every scan of a folder, without opening the seal
    Run(RunSet),
    /// Open the seal and compare the diagnoses with the true causes
    Score(ScoreSet),
    /// Open the seal, and show how the rates move as limits of the diagnosis are halved and doubled
    Vary(Vary),
    /// Open the seal and print the true causes as JSON
    Open(Open),
    /// Seal a truth file, so that the cause behind a virtual rig is withheld
    SealTruth(SealTruth),
}

#[derive(Debug, Args)]
struct Make {
    /// The folder for the set
    out: PathBuf,
    /// Number of scans
    #[arg(long, value_name = "N")]
    count: usize,
    /// Seed of all random numbers, from which the answers can be computed; by default a random one, sealed with the answers
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Where the scans are made: one bench, or laboratories that differ in radiators, arrays, drives, paths, receivers and noise
    #[arg(long, value_enum, default_value_t = WorldName::Bench)]
    world: WorldName,
    /// Of laboratories: leave out what is a little wrong in every careful set-up
    #[arg(long)]
    ideal: bool,
    /// Share of scans without any effect [default: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    none: Option<f64>,
    /// Share of scans with two effects [default: 0.2; laboratories: 0.15]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pairs: Option<f64>,
    /// Share of scans with three effects [default: 0; laboratories: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    triples: Option<f64>,
    /// Share of scans with six to ten small effects, one of which dominates [default: 0; laboratories: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    whole_bench: Option<f64>,
    /// Share of scans with a cause that is not in the catalogue [default: 0.2]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    outside: Option<f64>,
    /// Make sealed virtual rigs in place of scans: `run` measures each by its plan, which leaves the readings to the rig
    #[arg(long)]
    rigs: bool,
    /// Let the closed loops of sealed rigs read in motion too: a lag may then be a cause
    #[arg(long, requires = "rigs")]
    flights: bool,
    /// Where the key is written [default: answers.key in the set's folder]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
}

/// Where the scans of a set are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WorldName {
    /// An array of 36 or 37 pistons, four planes, amplitudes with Gaussian noise
    Bench,
    /// Each scan in another laboratory
    Laboratories,
}

#[derive(Debug, Args)]
struct SealAnswers {
    /// The folder that contains the folders of recorded scans
    folder: PathBuf,
    /// Their true causes as JSON, as `blind open` prints them; delete the file, or keep it elsewhere
    answers: PathBuf,
    /// Where the key is written [default: answers.key in the folder]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct RunSet {
    /// The folder that contains the folders of recorded scans
    folder: PathBuf,
    /// Only these scans
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    only: Vec<String>,
    /// Of sealed rigs: the plan in the folder of each by which it is measured [default: find-out.toml, a closed loop; full-scan.toml is a scan of planes]
    #[arg(long, value_name = "NAME")]
    plan: Option<String>,
    /// Where the diagnoses go [default: diagnoses in the folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The simulator whose gap is diagnosed [default: that of each scan]
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    #[command(flatten)]
    on: OnArgs,
}

#[derive(Debug, Args)]
struct ScoreSet {
    #[command(flatten)]
    sealed: Sealed,
    /// Where the diagnoses are [default: diagnoses in the set's folder]
    #[arg(long, value_name = "DIR")]
    diagnoses: Option<PathBuf>,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct Open {
    #[command(flatten)]
    sealed: Sealed,
}

/// A set whose seal is to be opened.
#[derive(Debug, Args)]
pub(super) struct Sealed {
    /// The folder of the set
    pub(super) set: PathBuf,
    /// The key [default: answers.key in the set's folder]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// The commitment that was printed when the set was made [default: the one in the set's folder]
    #[arg(long, value_name = "DIGEST")]
    commitment: Option<String>,
}

/// The key lies beside the sealed file, because the virtual rig has to open it. This hides a cause from a reader and from the
/// diagnosis, not from somebody who uses the key.
#[derive(Debug, Args)]
struct SealTruth {
    /// The truth file
    plain: PathBuf,
    /// The sealed file, FILE.sealed, for `truth` of a rig file; its key becomes FILE.key
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Blind {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.step {
            Step::Make(make) => make.run(),
            Step::Seal(seal) => seal.run(),
            Step::Run(run) => run.run(),
            Step::Score(score) => score.run(),
            Step::Vary(vary) => vary.run(),
            Step::Open(open) => open.run(),
            Step::SealTruth(seal) => seal.run(),
        }
    }
}

impl Make {
    fn run(self) -> miette::Result<ExitCode> {
        let shares = self.shares();
        if shares.sum() > 1.0 + 1e-9 {
            miette::bail!(
                help = "the rest of the scans has one effect",
                "--none, --pairs, --triples, --whole-bench and --outside add up to more than 1"
            );
        }
        let worlds = match self.world {
            WorldName::Bench if self.ideal => miette::bail!(
                help = "the bench has no imperfections to leave out",
                "--ideal goes with --world laboratories"
            ),
            WorldName::Laboratories if self.rigs => miette::bail!(
                help = "virtual rigs are made of the bench; leave out --world or --rigs",
                "--world laboratories makes scans, not rigs"
            ),
            WorldName::Bench => Worlds::Bench,
            WorldName::Laboratories => Worlds::Laboratories { ideal: self.ideal },
        };
        let seal = Seal::of(&self.out, self.key.as_deref());
        seal.is_free()?;
        let seed = self.seed.map_or_else(fresh_seed, Ok)?;
        let (count, rigs) = (self.count, self.rigs);
        let bar = counting_bar(count, if rigs { "rigs made" } else { "scans made" });
        let set = SetToMake { count, seed, shares, worlds };
        let answers = match rigs {
            true => set.make_rigs(&self.out, self.flights, || bar.inc(1))?,
            false => set.make(&self.out, || bar.inc(1))?,
        };
        let commitment = seal.close(&answers)?;
        bar.finish_and_clear();
        print(&format!("commitment {commitment}\n"))?;
        Ok(ExitCode::SUCCESS)
    }

    fn shares(&self) -> Shares {
        let usual = match self.world {
            WorldName::Bench => Shares::default(),
            WorldName::Laboratories => Shares::of_laboratories(),
        };
        Shares {
            none: self.none.unwrap_or(usual.none),
            pairs: self.pairs.unwrap_or(usual.pairs),
            triples: self.triples.unwrap_or(usual.triples),
            whole_bench: self.whole_bench.unwrap_or(usual.whole_bench),
            unmodelled: self.outside.unwrap_or(usual.unmodelled),
        }
    }
}

impl SealAnswers {
    fn run(self) -> miette::Result<ExitCode> {
        let seal = Seal::of(&self.folder, self.key.as_deref());
        seal.is_open()?;
        let commitment = seal.close(&foreign_answers(&self.answers, &self.folder)?)?;
        print(&format!("commitment {commitment}\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

impl RunSet {
    fn run(self) -> miette::Result<ExitCode> {
        let diagnoses = self.out.unwrap_or_else(|| self.folder.join(DIAGNOSES));
        let run = Run { folder: self.folder, diagnoses, only: self.only };
        let rigs = rigs_in(&run.folder);
        if !rigs.is_empty() {
            return measure_rigs(&run, rigs, self.plan);
        }
        let names = run.names()?;
        if self.on.is_given() {
            let scans = BlindScans::of(&run.folder, names, self.simulator)?;
            let batch = self.on.run(&scans, &batch_beside(&run.diagnoses), "scans diagnosed")?;
            return match batch {
                Some(batch) => scans.keep(&batch, &run),
                None => Ok(ExitCode::SUCCESS),
            };
        }
        let bar = counting_bar(names.len(), "scans diagnosed");
        let failures = AtomicUsize::new(0);
        run.each(
            &names,
            |scans| diagnose(scans, self.simulator),
            |done| {
                bar.suspend(|| match done {
                    // Standard output may be closed; the diagnoses are written all the same.
                    Ok(diagnosed) => drop(print(&format!("{diagnosed}\n"))),
                    Err(error) => {
                        failures.fetch_add(1, Ordering::Relaxed);
                        report_error(&miette::Report::new(error));
                    }
                });
                bar.inc(1);
            },
        );
        bar.finish_and_clear();
        let failed = failures.into_inner() > 0;
        Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }
}

/// Measures and diagnoses sealed rigs.
fn measure_rigs(
    run: &Run,
    mut names: Vec<String>,
    plan: Option<String>,
) -> miette::Result<ExitCode> {
    if let Some(missing) = run.only.iter().find(|name| !names.contains(name)) {
        miette::bail!("{} has no rig {missing}", run.folder.display());
    }
    names.retain(|name| run.only.is_empty() || run.only.contains(name));
    let plan = plan.unwrap_or_else(|| LOOP_PLAN.to_owned());
    let rigs = BlindRigs { run, plan };
    let bar = counting_bar(names.len(), "rigs diagnosed");
    let failures = AtomicUsize::new(0);
    rigs.each(&names, |done| {
        bar.suspend(|| match done {
            Ok(diagnosed) => drop(print(&format!("{diagnosed}\n"))),
            Err(error) => {
                failures.fetch_add(1, Ordering::Relaxed);
                report_error(&error);
            }
        });
        bar.inc(1);
    });
    bar.finish_and_clear();
    Ok(if failures.into_inner() > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

impl ScoreSet {
    fn run(self) -> miette::Result<ExitCode> {
        let answers = self.sealed.answers()?;
        let diagnoses = self.diagnoses.unwrap_or_else(|| self.sealed.set.join(DIAGNOSES));
        let score = Score::of_folder(&answers, &diagnoses)?;
        if self.json {
            print_json(&score)?
        } else {
            print(&score.to_text())?
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl Open {
    fn run(self) -> miette::Result<ExitCode> {
        print_json(&self.sealed.answers()?)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl SealTruth {
    fn run(self) -> miette::Result<ExitCode> {
        let key = seal_truth(&self.plain, &self.out)?;
        say(format!("sealed: {}\nits key: {}", self.out.display(), key.display()));
        Ok(ExitCode::SUCCESS)
    }
}

impl Sealed {
    pub(super) fn answers(&self) -> miette::Result<fieldgap_blind::Answers> {
        let seal = Seal::of(&self.set, self.key.as_deref());
        Ok(seal.open(self.commitment.as_deref())?)
    }
}

fn share(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    Fraction::new(number).map(Fraction::get).map_err(|refused| refused.to_string())
}
