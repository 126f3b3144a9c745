//! Where the fit of an alignment starts: a grid of shifts, and of turns where asked, scored by the share of B that A leaves at the best gain.

use rayon::prelude::*;
use std::f64::consts::TAU;

use super::alignment::{LEAST_OVERLAP, Layers, PlaceOfB, Placement};

/// Places by which a start is scored at most, without turns and with them.
const PLACES: usize = 300;
const PLACES_WITH_TURNS: usize = 120;

/// Step of the shifts in wavelengths, without turns and with them: a lobe is half a wavelength wide.
const STEP: f64 = 0.125;
const STEP_WITH_TURNS: f64 = 0.25;

/// Turns that are tried: at the edge of a map of 60 mm the step is a quarter of a wavelength at 40 kHz.
const TURNS: usize = 90;

/// Starts that are fitted.
const STARTS: usize = 12;

/// The best placements, and that of the recorded coordinates first.
pub(super) fn starts(layers: &Layers<'_>, turns: bool) -> Vec<Placement> {
    let (most, step, turns) = match turns {
        true => (PLACES_WITH_TURNS, STEP_WITH_TURNS, TURNS),
        false => (PLACES, STEP, 1),
    };
    let stride = layers.places().div_ceil(most).max(1);
    let few: Vec<(usize, PlaceOfB)> = layers
        .layers
        .iter()
        .enumerate()
        .flat_map(|(n, layer)| layer.places.iter().map(move |place| (n, *place)))
        .step_by(stride)
        .collect();
    let step_m = step * layers.wavelength_m;
    let reach_m = layers.layers.iter().fold([0.0f64; 2], |[x, y], layer| {
        let [of_x, of_y] = layer.map.half_sides_m();
        [x.max(of_x), y.max(of_y)]
    });
    let [count_x, count_y] = reach_m.map(|reach| (reach / step_m).ceil() as i32);
    let mut scored: Vec<(f64, Placement)> = (0..turns)
        .into_par_iter()
        .flat_map_iter(|turn| {
            let turn_rad = TAU * (turn as f64 / turns as f64);
            let turn_rad = if turn_rad > 0.5 * TAU { turn_rad - TAU } else { turn_rad };
            (-count_x..=count_x).flat_map(move |x| (-count_y..=count_y).map(move |y| (x, y))).map(
                move |(x, y)| Placement {
                    shift_m: [x, y].map(|n| f64::from(n) * step_m),
                    turn_rad,
                },
            )
        })
        .filter_map(|placement| Some((score(layers, &few, placement)?, placement)))
        .collect();
    scored.sort_by(|one, other| one.0.total_cmp(&other.0));
    let near = |one: &Placement, other: &Placement| {
        let apart = (0..2).all(|n| (one.shift_m[n] - other.shift_m[n]).abs() < 2.5 * step_m);
        let turn = (one.turn_rad - other.turn_rad).abs();
        apart && turn.min(TAU - turn) < 2.5 * TAU / TURNS as f64
    };
    let mut kept = vec![Placement::AS_RECORDED];
    for (_, placement) in scored {
        if kept.len() > STARTS {
            break;
        }
        if kept.iter().skip(1).all(|other| !near(other, &placement)) {
            kept.push(placement);
        }
    }
    kept
}

/// Share of the squares of B that A leaves at the best gain; `None` where too few places are common.
fn score(layers: &Layers<'_>, few: &[(usize, PlaceOfB)], placement: Placement) -> Option<f64> {
    let (mut aa, mut bb, mut ab, mut count) = (0.0, 0.0, 0.0, 0usize);
    for (layer, place) in few {
        let [x, y] = placement.of(place.at_m);
        if let Some(a) = layers.layers[*layer].map.value_at(x, y) {
            aa += a * a;
            bb += place.reading * place.reading;
            ab += a * place.reading;
            count += 1;
        }
    }
    let enough = count as f64 >= LEAST_OVERLAP * few.len() as f64 && aa > 0.0 && bb > 0.0;
    enough.then(|| 1.0 - ab * ab / (aa * bb))
}
