//! Some elements fall silent at one moment: a driver fails.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "failing-elements";

#[derive(Debug, Clone)]
struct FailingElements {
    at_s: f64,
    elements: Vec<i64>,
}

/// In the middle half of the scan, up to a third of the elements: drivers have 8 to 32 outputs.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.25, 0.75) * laboratory.survey.lasts_s();
    let count = laboratory.elements().len();
    let mut order: Vec<usize> = (0..count).collect();
    random.shuffle(&mut order);
    let most = (count as f64 / 3.0).max(1.0);
    Draw::new(most, move |size| {
        let failed = (size.round() as usize).clamp(1, count);
        let mut elements: Vec<i64> = order[..failed].iter().map(|&n| n as i64).collect();
        elements.sort_unstable();
        FailingElements { at_s, elements }
    })
}

impl Unmodelled for FailingElements {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let mut parameters = toml::toml! { at_s = (self.at_s) };
        parameters.insert("elements".to_owned(), self.elements.clone().into());
        parameters
    }

    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        let mut silent = Parameters::new();
        silent.insert("elements".to_owned(), self.elements.clone().into());
        vec![(self.at_s, vec![("dead-elements", silent)])]
    }
}
