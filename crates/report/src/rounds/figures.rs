//! The pictures of a closed loop.

use super::super::figure::Figure;
use super::super::picture::{
    Drawn, OverRounds, Picture, PictureError, PlacesOfRound, RoundFigure, RoundPlaces, SetShares,
    Share,
};
use super::LoopOfRounds;
use super::set::{Part, moved, searched};
use fieldgap_closed_loop::{Purpose, Round, Verification, obtained_bits};

/// All pictures of a closed loop; `None` where there is nothing to draw yet.
pub(super) struct RoundsFigures {
    pub places: Figure,
    pub probabilities: Option<Figure>,
    pub information: Option<Figure>,
    pub verification: Option<Figure>,
}

/// Expected and obtained information of a round, bits.
pub(super) struct Information<'a> {
    pub round: &'a Round,
    pub expected: f64,
    /// `None` until the readings are searched.
    pub obtained: Option<f64>,
}

impl RoundsFigures {
    /// Draws them all.
    pub fn draw(of: &LoopOfRounds<'_>) -> Result<Self, PictureError> {
        Ok(Self {
            places: figure("places", &places(of), RoundPlaces::narrow)?,
            probabilities: optional("probabilities", probabilities(of), SetShares::narrow)?,
            information: optional("information", bits(of), OverRounds::narrow)?,
            verification: optional("verification", gaps(of), OverRounds::narrow)?,
        })
    }

    /// Every picture.
    pub fn all(&self) -> impl Iterator<Item = &Figure> {
        let later = [&self.probabilities, &self.information, &self.verification];
        std::iter::once(&self.places).chain(later.into_iter().flatten())
    }
}

fn figure<P: Picture>(
    name: &str,
    picture: &P,
    narrow: fn(&P) -> P,
) -> Result<Figure, PictureError> {
    let narrow = Drawn::new(&narrow(picture))?;
    Ok(Figure::new(name.to_owned(), Drawn::new(picture)?).with_narrow(narrow))
}

fn optional<P: Picture>(
    name: &str,
    picture: Option<P>,
    narrow: fn(&P) -> P,
) -> Result<Option<Figure>, PictureError> {
    picture.map(|picture| figure(name, &picture, narrow)).transpose()
}

/// A round by its number, and what it was for where that is not to tell sets apart.
pub(super) fn name(round: &Round) -> String {
    match round.purpose {
        Purpose::First => format!("round {}, first look", round.round),
        Purpose::Verify => format!("round {}, fresh readings", round.round),
        Purpose::Explore | Purpose::End => format!("round {}", round.round),
    }
}

fn places(of: &LoopOfRounds<'_>) -> RoundPlaces {
    let rounds = of.measured().map(|round| PlacesOfRound {
        name: name(round),
        is_fresh: round.purpose == Purpose::Verify,
        places: of
            .samples(round)
            .iter()
            .zip(of.flown(round))
            .map(|(sample, is_flown)| (sample.position_mm.into(), is_flown))
            .collect(),
    });
    RoundPlaces::new(rounds.collect())
}

fn probabilities(of: &LoopOfRounds<'_>) -> Option<SetShares> {
    let columns: Vec<String> = searched(of.rounds).map(|round| round.before.to_string()).collect();
    if columns.is_empty() {
        return None;
    }
    let shares = moved(of.rounds).into_iter().enumerate().map(|(number, moved)| {
        let (name, probabilities) = (moved.name, moved.probabilities);
        match moved.part {
            Part::Set => Share::of_set(name, number, probabilities),
            Part::NoGap => Share { name, colour: (205, 205, 205), probabilities },
            Part::Others => Share { name, colour: (160, 160, 160), probabilities },
            Part::Outside => Share { name, colour: (40, 40, 40), probabilities },
        }
    });
    Some(SetShares::new(columns, shares.collect()))
}

/// What was expected of each round and what it gave.
pub(super) fn information<'a>(of: &LoopOfRounds<'a>) -> Vec<Information<'a>> {
    let rounds = of.rounds.iter().enumerate();
    rounds
        .filter_map(|(number, round)| {
            let next = of.rounds.get(number + 1);
            Some(Information {
                round,
                expected: round.expected_bits?,
                obtained: next.and_then(|next| obtained_bits(round, next)),
            })
        })
        .collect()
}

fn bits(of: &LoopOfRounds<'_>) -> Option<OverRounds> {
    let information = information(of);
    if information.is_empty() {
        return None;
    }
    let figure = |name: &str, bits: &dyn Fn(&Information<'_>) -> Option<f64>| RoundFigure {
        name: name.to_owned(),
        values: information.iter().map(|one| bits(one).map(|bits| (bits, 0.0))).collect(),
    };
    let figures = vec![
        figure("expected", &|one| Some(one.expected)),
        figure("obtained", &|one| one.obtained),
    ];
    let rounds = information.iter().map(|one| one.round.round.to_string());
    Some(OverRounds::new(rounds.collect(), "information (bits)", figures))
}

/// The rounds whose readings tested a cause, with the result.
pub(super) fn verifications<'a>(of: &LoopOfRounds<'a>) -> Vec<(&'a Round, Verification)> {
    let pairs = of.rounds.windows(2);
    pairs.filter_map(|pair| Some((&pair[0], pair[1].verification?))).collect()
}

fn gaps(of: &LoopOfRounds<'_>) -> Option<OverRounds> {
    let tested = verifications(of);
    if tested.is_empty() {
        return None;
    }
    let figure = |name: &str, gap: &dyn Fn(&Verification) -> Option<(f64, f64)>| {
        let percent = |(gap, error): (f64, f64)| (100.0 * gap, 100.0 * error);
        let values = tested.iter().map(|(_, test)| gap(test).map(percent)).collect();
        RoundFigure { name: name.to_owned(), values }
    };
    let figures = vec![
        figure("as believed", &|test| Some((test.gap_before, test.gap_before_error))),
        figure("corrected set-up", &|test| test.corrected.map(|file| (file.gap, file.gap_error))),
        figure("cause as fitted", &|test| Some((test.gap_after, test.gap_after_error))),
        figure("noise alone", &|test| Some((test.noise, 0.0))),
    ];
    let rounds = tested.iter().map(|(round, _)| round.round.to_string());
    Some(OverRounds::new(rounds.collect(), "gap on fresh readings (%)", figures))
}
