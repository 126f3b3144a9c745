//! What changed between two records, in one sentence.

use super::alignment::Alignment;
use super::{Change, HeightChange, PlaceChange};
use fieldgap_text::{Uncertain, percent, significant, uncertain, with_minus_signs};

/// Standard errors beyond which a change of level or a move of the peak is stated: of normal noise one in 16,000.
const SHOWN: f64 = 4.0;

impl Change {
    /// Level, place of the peak, and what else differs.
    pub fn sentence(&self) -> String {
        let gain = self.overall.gain;
        let level = Uncertain {
            value: 100.0 * (gain.value - 1.0).abs(),
            standard_error: 100.0 * gain.standard_error,
        };
        let relative = (gain.value - 1.0).abs();
        let has_level = relative > SHOWN * gain.standard_error;
        let mut parts = vec![match (has_level, gain.value < 1.0) {
            (true, true) => format!("The level fell by {}\u{a0}%", uncertain(level)),
            (true, false) => format!("The level rose by {}\u{a0}%", uncertain(level)),
            (false, _) => "The level did not change".to_owned(),
        }];
        if let Some(alignment) = self.alignment.as_ref().filter(|of| of.is_applied()) {
            parts.push(laid(alignment));
        }
        parts.extend(
            self.moved_peak().map(|moved| format!("the peak moved {}\u{a0}mm", uncertain(moved))),
        );
        let (chi_square, left) = self.beside_the_level();
        let count = self.overall.points as f64;
        // The mean of so many squares scatters by √(2/n).
        let is_noise = chi_square < 1.0 + SHOWN * (2.0 / count).sqrt();
        parts.push(match is_noise {
            true if parts.len() == 1 && !has_level => "all differences are noise".to_owned(),
            true => "the rest is noise".to_owned(),
            false => format!(
                "beside the level the field differs by {} of its rms (χ² {}, noise alone: 1)",
                percent(left),
                significant(chi_square, 3)
            ),
        });
        parts.join("; ") + "."
    }

    /// How far the highest peak moved, mm; `None` if it did not move beyond its error, or is at the edge of a map.
    pub fn moved_peak(&self) -> Option<Uncertain> {
        let figures = |height: &HeightChange| {
            let [a, b] = [height.a_figures.clone()?, height.b_figures.clone()?];
            (!a.peak_at_edge && !b.peak_at_edge).then_some([a, b])
        };
        let [a, b] = self
            .heights
            .iter()
            .filter_map(figures)
            .max_by(|one, other| one[0].peak.value.total_cmp(&other[0].peak.value))?;
        let along = [0, 1].map(|axis| {
            let [from, to] = [&a, &b].map(|of| of.peak_position_m[axis]);
            (to.value - from.value, to.standard_error.hypot(from.standard_error))
        });
        let value = along[0].0.hypot(along[1].0);
        let variance: f64 = along.iter().map(|(by, error)| (by * error).powi(2)).sum();
        let moved = Uncertain { value: 1e3 * value, standard_error: 1e3 * variance.sqrt() / value };
        (moved.value > SHOWN * moved.standard_error).then_some(moved)
    }

    /// Mean squared difference in its standard errors, and its rms over that of A, with the level taken out.
    pub fn beside_the_level(&self) -> (f64, f64) {
        // What was divided already is not divided again.
        let gain = self.overall.gain.value / self.scale;
        let places = || self.heights.iter().flat_map(|height| &height.places);
        let without = |place: &PlaceChange| PlaceChange {
            b: place.b / gain,
            b_error: place.b_error / gain,
            ..*place
        };
        let squares: f64 = places().map(|place| without(place).in_standard_errors().powi(2)).sum();
        let differences: f64 = places()
            .map(|place| {
                let place = without(place);
                (place.b - place.a).powi(2)
            })
            .sum();
        let of_a: f64 = places().map(|place| place.a * place.a).sum();
        (squares / self.overall.points as f64, (differences / of_a).sqrt())
    }
}

fn laid(alignment: &Alignment) -> String {
    let [x, y] = alignment.shift_m.map(|of| of.value * 1e3);
    let turn = match alignment.turn_rad.estimated {
        true => format!(" and turned by {:.2}°", alignment.turn_rad.value.to_degrees()),
        false => String::new(),
    };
    with_minus_signs(&format!(
        "B was shifted by {x:.2}\u{a0}mm along x and {y:.2}\u{a0}mm along y{turn} to lie on A"
    ))
}
