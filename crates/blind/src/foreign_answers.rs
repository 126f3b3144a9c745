//! Answers to scans that another program made.

use std::path::{Component, Path};

use super::answer::{Answer, Answers};
use super::assignment::Category;
use super::catalogue;
use super::error::BlindError;
use super::run::Run;
use fieldgap_input::{MOST_TABLE, read_bytes};

/// Reads answers, as `blind open` prints them, to the scans in a folder: one for each scan, with as many effects of the catalogue as its category has.
///
/// # Errors
/// [`BlindError`] if the file cannot be read, or its answers are not those of these scans.
pub fn foreign_answers(path: &Path, set: &Path) -> Result<Answers, BlindError> {
    let help = "name a file with one answer for each scan, as `fieldgap blind open` prints them";
    let bytes = read_bytes(path, MOST_TABLE).map_err(BlindError::reading(path, help))?;
    let answers: Answers = serde_json::from_slice(&bytes).map_err(|source| BlindError::Json {
        path: path.to_owned(),
        source,
        help,
    })?;
    let wrong = |why: String| BlindError::WrongAnswers { path: path.to_owned(), why };
    if answers.format != 1 {
        return Err(wrong(format!("its format is {}, and 1 is expected", answers.format)));
    }
    let run = Run { folder: set.to_owned(), diagnoses: set.to_owned(), only: Vec::new() };
    let mut without = run.names()?;
    for answer in &answers.answers {
        fault_of(answer).map_or(Ok(()), |fault| Err(wrong(format!("{}: {fault}", answer.name))))?;
        let number = without.iter().position(|name| *name == answer.name).ok_or_else(|| {
            wrong(format!("{}: there is no such scan, or it has two answers", answer.name))
        })?;
        without.remove(number);
    }
    match without.first() {
        Some(name) => Err(wrong(format!("{name} has no answer"))),
        None => Ok(answers),
    }
}

/// What is wrong with an answer, if anything.
fn fault_of(answer: &Answer) -> Option<String> {
    // A name that led out of the folder would put other files under the seal.
    if !matches!(
        Path::new(&answer.name).components().collect::<Vec<_>>()[..],
        [Component::Normal(_)]
    ) {
        return Some("that is no name of a folder".to_owned());
    }
    let count = answer.effects.len();
    let fits = match answer.category {
        Category::None => count == 0,
        Category::One | Category::Unmodelled => count == 1,
        Category::Two => count == 2,
        Category::Three => count == 3,
        Category::WholeBench => count > 3,
    };
    if !fits {
        return Some(format!("{count} effects do not fit its category"));
    }
    let dominates = |dominant: &String| answer.effects.contains(dominant);
    if answer.category == Category::WholeBench && !answer.dominant.as_ref().is_some_and(dominates) {
        return Some("`dominant` names none of its effects".to_owned());
    }
    if answer.gaps_alone_sigma.len() != count {
        return Some(format!(
            "`gaps_alone_sigma` has {} numbers for {count} effects",
            answer.gaps_alone_sigma.len()
        ));
    }
    let unknown = answer.effects.iter().find(|effect| !catalogue::IDS.contains(&effect.as_str()));
    match (answer.category, unknown) {
        (Category::Unmodelled, _) | (_, None) => None,
        (_, Some(effect)) => Some(format!("`{effect}` is no effect that sets can have")),
    }
}
