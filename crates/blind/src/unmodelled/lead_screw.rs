//! The lead screw of x has a periodic error.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "lead-screw";

/// Leads of common screws, mm per turn. Leads of 4 mm and less would alias with points 2 mm apart.
const LEADS_MM: [f64; 3] = [5.0, 8.0, 12.0];

pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let lead_mm = LEADS_MM[random.index(LEADS_MM.len())];
    let phase_rad = random.angle_rad();
    Draw::of_truth(NAME, 1.5, move |amplitude_mm| {
        toml::toml! {
            lead_mm = (lead_mm)
            amplitude_mm = (amplitude_mm)
            phase_rad = (phase_rad)
        }
    })
}
