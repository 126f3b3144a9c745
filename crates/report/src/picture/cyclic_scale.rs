//! From a phase to a colour.

use std::f64::consts::TAU;

use fieldgap_canvas::Rgb;

/// Colours round the circle, from minus half a turn on: "phase" of cmocean, whose lightness is the same everywhere (K. M. Thyng et al.,
/// "True colors of oceanography", Oceanography 29(3), 9, 2016). The last is followed by the first.
const ROUND: [Rgb; 11] = [
    (168, 120, 13),
    (197, 96, 51),
    (217, 67, 96),
    (221, 38, 163),
    (196, 59, 224),
    (153, 97, 244),
    (95, 127, 228),
    (40, 144, 183),
    (15, 151, 136),
    (39, 153, 79),
    (119, 141, 17),
];

/// Amplitude, as a share of the largest, below which a phase fades to white: it says little where there is little sound.
pub(super) const FADES_BELOW: f64 = 0.1;

/// The colour of a phase in radians, where the amplitude is such a share of the largest.
pub(super) fn phase_colour(phase_rad: f64, share: f64) -> Rgb {
    let along = (phase_rad / TAU + 0.5).rem_euclid(1.0) * ROUND.len() as f64;
    let (before, part) = (along.floor() as usize, along.fract());
    let [one, other] = [before, before + 1].map(|index| ROUND[index % ROUND.len()]);
    let strength = (share / FADES_BELOW).clamp(0.0, 1.0);
    let channel = |one: u8, other: u8| {
        let colour = f64::from(one) + part * (f64::from(other) - f64::from(one));
        (255.0 + strength * (colour - 255.0)).round() as u8
    };
    (channel(one.0, other.0), channel(one.1, other.1), channel(one.2, other.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_comes_back_to_its_colour_without_a_step() {
        assert_eq!(phase_colour(-0.5 * TAU, 1.0), phase_colour(0.5 * TAU, 1.0));
        let colours: Vec<Rgb> =
            (0..=360).map(|d| phase_colour(f64::from(d).to_radians(), 1.0)).collect();
        let far = |a: u8, b: u8| a.abs_diff(b) > 4;
        assert!(!colours.windows(2).any(|pair| far(pair[0].0, pair[1].0)
            || far(pair[0].1, pair[1].1)
            || far(pair[0].2, pair[1].2)));
        assert_ne!(phase_colour(0.0, 1.0), phase_colour(1.5, 1.0));
    }

    #[test]
    fn a_phase_fades_where_there_is_no_sound() {
        assert_eq!(phase_colour(1.0, 0.0), (255, 255, 255));
        assert_eq!(phase_colour(1.0, FADES_BELOW), phase_colour(1.0, 1.0));
        assert!(phase_colour(1.0, 0.05).0 > phase_colour(1.0, 1.0).0);
    }
}
