//! When an array had warmed up, from a drive that was repeated among the others.

use crate::readings::{CodedReadings, Reading, median};

/// Steadiness of the level that counts as warm, relative: below it the slow change that the fit allows takes over.
const STEADY: f64 = 0.02;

/// The instant from which on the reference drive's level stayed within 2 % and three times its noise of its later median, s.
///
/// The reference is the drive that was read most often at one place. `None` where none was read eight times, or where the level has
/// not become steady in the first half of the time: then nothing is left out, and the slow change is fitted.
pub fn warm_since_s(readings: &CodedReadings, relative_noise: f64) -> Option<f64> {
    let groups = readings.repeated();
    let reference: &Vec<&Reading> = groups.iter().max_by_key(|group| group.len())?;
    if reference.len() < 8 {
        return None;
    }
    let later: Vec<f64> = reference[reference.len() / 2..].iter().map(|r| r.value).collect();
    let level = median(later);
    let within = STEADY + 3.0 * relative_noise;
    let last_off = reference.iter().rposition(|r| (r.value / level - 1.0).abs() > within);
    match last_off {
        None => Some(reference[0].time_s.min(readings.readings[0].time_s)),
        Some(index) if index < reference.len() / 2 => Some(reference[index + 1].time_s),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;
    use num_complex::Complex64;

    fn warming(over_s: f64) -> CodedReadings {
        let level = |time_s: f64| 1.0 - 0.2 * (-time_s / over_s).exp();
        let readings = (0..60)
            .map(|n| {
                let time_s = 5.0 * f64::from(n);
                let drive = if n % 3 == 0 { 0 } else { n as usize };
                Reading { place: 0, drive, time_s, value: level(time_s) }
            })
            .collect();
        CodedReadings {
            places_m: vec![Vec3::z()],
            drives: vec![vec![Complex64::ONE]; 60],
            readings,
            silent: None,
        }
    }

    #[test]
    fn what_was_read_while_the_level_rose_is_left_out() {
        let since_s = warm_since_s(&warming(20.0), 0.0).expect("it becomes warm");
        // 0.2 exp(-t/20) is 2 % at 46 s; the reference was read each 15 s.
        assert_eq!(since_s, 60.0);
    }

    #[test]
    fn a_steady_level_leaves_nothing_out_and_an_unsteady_one_is_no_warm_up() {
        assert_eq!(warm_since_s(&warming(0.01), 0.1), Some(0.0));
        assert_eq!(warm_since_s(&warming(400.0), 0.0), None);
    }
}
