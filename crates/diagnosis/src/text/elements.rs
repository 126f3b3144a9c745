//! The account of the elements in words.

use fieldgap_text::{fixed, paragraph, percent, significant, table};

use crate::result::ElementsAccount;

impl ElementsAccount {
    /// In one sentence, to follow the verdict's.
    pub(crate) fn in_short(&self) -> String {
        let blocks = format!(
            "of blocks of {} mm that a fit did not see {} is left in place of {}",
            fixed(self.block_mm, 0),
            percent(self.gap_after_held_out),
            percent(self.gap_before_held_out)
        );
        match self.is_borne_out {
            true => format!(
                " What each of the {} elements emits explains {} of its square beyond noise: {blocks}.",
                self.elements,
                percent(self.explained_fraction)
            ),
            false => {
                format!(" Held-out blocks do not bear out departures of single elements: {blocks}.")
            }
        }
    }

    /// What the elements explain and what they do not, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let spread = &self.spread;
        let mut of_each = vec![
            format!("gains by {}", percent(spread.gain)),
            format!("phases by {}°", fixed(spread.phase_rad.to_degrees(), 1)),
        ];
        if spread.place_mm > 0.0 {
            of_each.push(format!("places by {} mm", significant(spread.place_mm, 2)));
        }
        if spread.lean > 0.0 {
            of_each.push(format!("the lean of their lobes by {}", significant(spread.lean, 2)));
        }
        let backlash = self.backlash_mm.map_or(String::new(), |mm| {
            format!("; rows scanned to and fro lie {} mm beside each other", significant(mm, 2))
        });
        let borne_out = match self.is_borne_out {
            true => format!(
                "The blocks bear the elements out: these explain {} of what pose and lobe leave of its square beyond noise.",
                percent(self.explained_by_elements)
            ),
            false => format!(
                "The blocks do not bear the elements out: these explain {} of what pose and lobe leave of its square beyond noise. Their departures may imitate \
                 another cause, or the readings are too few to tell them.",
                percent(self.explained_by_elements)
            ),
        };
        let faults = match &self.faults[..] {
            [] => "No element is dead, weak or reversed.".to_owned(),
            faults => {
                let of = |fault: &crate::result::ElementFault| {
                    format!("{} is {} (gain {})", fault.element, fault.state, fixed(fault.gain, 2))
                };
                format!("Element {}.", faults.iter().map(of).collect::<Vec<_>>().join(", element "))
            }
        };
        vec![
            format!(
                "{} elements with gain, phase, place and lean of their own, fitted to all {} readings, leave {} of these.",
                self.elements,
                self.readings,
                percent(self.gap_after)
            ),
            format!("Standard deviations among elements: {}{backlash}.", of_each.join(", ")),
            borne_out,
            faults,
        ]
    }

    /// What is left of blocks that a fit did not see: each step with the gap.
    pub fn steps(&self) -> [(&'static str, f64); 4] {
        [
            ("registered simulation", self.gap_before_held_out),
            ("with pose, backlash, lobe and floor fitted", self.gap_alike_held_out),
            ("with the elements' departures", self.gap_after_held_out),
            ("expected of these by their errors and noise", self.expected_held_out),
        ]
    }

    /// How wide the blocks are.
    pub fn of_what(&self) -> String {
        format!(
            "every fifth block of {} mm, {} wavelengths, held out",
            fixed(self.block_mm, 0),
            fixed(self.block_wavelengths, 1)
        )
    }

    pub(crate) fn to_text(&self) -> String {
        let rows: Vec<[String; 2]> =
            self.steps().map(|(name, gap)| [name.to_owned(), percent(gap)]).into();
        let sentences = self.sentences().into_iter().map(|words| paragraph(&words, 2, 2));
        format!("What the elements explain; {}\n", self.of_what())
            + &table(&rows)
            + &sentences.collect::<String>()
    }
}
