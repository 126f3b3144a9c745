//! How the array is driven, and the delays that follow from it.

use super::{Array, Medium, Vec3};

/// How the array is driven.
#[derive(Debug, Clone, PartialEq)]
pub enum Excitation {
    /// Focus on a point, metres, array frame.
    Focus(Vec3),
    /// All elements in phase.
    Uniform,
    /// A phase for each element of the array, radians.
    Phases(Vec<f64>),
}

impl Excitation {
    /// The focus, where there is one.
    pub fn focus_m(&self) -> Option<Vec3> {
        match self {
            Self::Focus(point) => Some(*point),
            Self::Uniform | Self::Phases(_) => None,
        }
    }

    /// The phase that each element is driven with, radians. A path of length d adds +k d to it.
    pub fn phases_rad(&self, array: &Array, medium: &Medium, frequency_hz: f64) -> Vec<f64> {
        match self {
            Self::Focus(_) => delays_s(self, array, medium, frequency_hz)
                .into_iter()
                .map(|delay_s| std::f64::consts::TAU * frequency_hz * delay_s)
                .collect(),
            Self::Uniform => vec![0.0; array.len()],
            Self::Phases(phases_rad) => phases_rad.clone(),
        }
    }
}

/// The delay of each element, seconds, zero or above, as it is sent to the array.
///
/// For a focus, the largest travel time minus that of each element (thesis, listing `gen_delays`): the farthest element has no delay.
/// For given phases, the phase as a fraction of a period, from 0 to less than 1/f.
pub fn delays_s(
    excitation: &Excitation,
    array: &Array,
    medium: &Medium,
    frequency_hz: f64,
) -> Vec<f64> {
    match excitation {
        Excitation::Focus(focus_m) => {
            let travel_s: Vec<f64> = array
                .elements()
                .iter()
                .map(|element| (focus_m - element.centre_m).norm() / medium.speed_of_sound_m_s)
                .collect();
            let longest_s = travel_s.iter().copied().fold(0.0, f64::max);
            travel_s.into_iter().map(|travel_s| longest_s - travel_s).collect()
        }
        Excitation::Uniform => vec![0.0; array.len()],
        Excitation::Phases(phases_rad) => phases_rad
            .iter()
            .map(|phase_rad| (phase_rad / std::f64::consts::TAU).rem_euclid(1.0) / frequency_hz)
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn all_waves_reach_the_focus_together(x in -0.05..0.05f64, y in -0.05..0.05f64, z in 0.02..0.3f64) {
            let array = Array::square(5, 4, 10.5e-3).expect("not empty");
            let medium = Medium { speed_of_sound_m_s: 343.0 };
            let focus = Vec3::new(x, y, z);
            let delays = delays_s(&Excitation::Focus(focus), &array, &medium, 40e3);
            let arrivals: Vec<f64> = array.elements().iter().zip(&delays)
                .map(|(e, delay)| delay + (focus - e.centre_m).norm() / 343.0).collect();
            prop_assert!(delays.iter().all(|&d| d >= 0.0) && delays.contains(&0.0));
            prop_assert!(arrivals.iter().all(|a| (a - arrivals[0]).abs() < 1e-15));
        }
    }

    #[test]
    fn a_phase_is_a_fraction_of_a_period() {
        let array = Array::linear(2, 0.01).expect("not empty");
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let excitation = Excitation::Phases(vec![-std::f64::consts::FRAC_PI_2, 0.0]);
        let delays = delays_s(&excitation, &array, &medium, 40e3);
        assert!((delays[0] - 0.75 * 25e-6).abs() < 1e-18 && delays[1] == 0.0);
    }
}
