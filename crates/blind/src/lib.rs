//! Blind sets: scans with sealed causes, which measure how well a diagnosis finds them.
//!
//! A set is made, sealed, diagnosed and scored:
//!
//! | step | what it does |
//! |---|---|
//! | [`SetToMake::make`] | draws a laboratory and causes for every scan, and writes the readings |
//! | [`Seal::close`] | encrypts the answers, and commits to them and to every scan |
//! | [`Run`] | diagnoses every scan, without opening the seal |
//! | [`Seal::open`], [`Score`] | compares the diagnoses with the answers: rates with 95 % intervals and targets |
//!
//! ```
//! use fieldgap_blind::{Score, Seal, SetToMake, Shares, Worlds};
//!
//! let folder = tempfile::tempdir()?;
//! let shares = Shares { none: 1.0, ..Shares::SINGLE };
//! let set = SetToMake { count: 1, seed: 3, shares, worlds: Worlds::Bench };
//! let answers = set.make(folder.path(), || ())?;
//! let seal = Seal::of(folder.path(), None);
//! let commitment = seal.close(&answers)?;
//!
//! // `Run` writes such a file for each scan.
//! let diagnoses = folder.path().join("diagnoses");
//! std::fs::create_dir(&diagnoses)?;
//! std::fs::write(diagnoses.join("0000.json"), r#"{ "verdict": "none" }"#)?;
//!
//! let score = Score::of_folder(&seal.open(Some(&commitment))?, &diagnoses)?;
//! assert_eq!((score.scored, score.confusion[0].exact), (1, 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The readings come from vibrating pistons by their Rayleigh integrals, with the virtual rig's effects. The model of the
//! diagnosis is thus not the one that made them. All effects are equally often. The logarithm of their gap is uniform. The
//! simulator's own defects (`phase-plane`, `on-axis-unit`) are in no set: they arise only with the simulator as it was written.
//!
//! Scans of another program are sealed with the answers that it gives: [`foreign_answers()`]. They tell what holds outside of the models here.
//!
//! Apart from sets, [`seal_truth()`] encrypts the truth file of a virtual rig, so that its cause is withheld.

mod answer;
mod assignment;
mod catalogue;
mod causes;
mod error;
mod foreign_answers;
mod kinematics;
mod laboratory;
mod make;
mod noise_units;
mod parameters;
mod parsed_diagnosis;
mod random_sequence;
mod reception;
mod rigs;
mod run;
mod score;
mod seal;
mod seal_truth;
mod sizing;
mod survey;
mod unmodelled;
mod varied;
mod whole_bench;
mod world;

pub use answer::{Answer, Answers, Imperfections};
pub use assignment::{Category, Shares};
pub use error::BlindError;
pub use foreign_answers::foreign_answers;
pub use make::{SetToMake, Worlds};
pub use parsed_diagnosis::{
    ParsedCandidate, ParsedDiagnosis, ParsedMeasurement, ParsedParameter, ParsedVerdict,
    ParsedVerification,
};
pub use rigs::{LOOP_PLAN, RIG};
pub use run::{Diagnosed, Run};
pub use score::{
    Calibration, CalibrationBin, ConfusionRow, Figure, Move, Moves, ParameterScore, Rate, Score,
    StratumScore, Target, VerdictRow,
};
pub use seal::{Seal, fresh_seed};
pub use seal_truth::seal_truth;
