//! Wind starts during the scan: a fan is switched on, or a window is opened.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "wind-onset";

#[derive(Debug, Clone, Copy)]
struct WindOnset {
    at_s: f64,
    vx_m_s: f64,
    vy_m_s: f64,
}

pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.2, 0.8) * laboratory.survey.lasts_s();
    let (sin, cos) = random.angle_rad().sin_cos();
    Draw::new(12.0, move |size| WindOnset { at_s, vx_m_s: size * cos, vy_m_s: size * sin })
}

impl Unmodelled for WindOnset {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            at_s = (self.at_s)
            vx_m_s = (self.vx_m_s)
            vy_m_s = (self.vy_m_s)
        }
    }

    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        let (vx_m_s, vy_m_s) = (self.vx_m_s, self.vy_m_s);
        let wind = toml::toml! {
            vx_m_s = (vx_m_s)
            vy_m_s = (vy_m_s)
        };
        vec![(self.at_s, vec![("flow", wind)])]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::super::causes::Causes;
    use super::super::super::world::World;
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    #[test]
    fn before_it_the_air_is_still_and_after_it_there_is_the_wind() {
        let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(2)));
        let onset = WindOnset { at_s: 200.0, vx_m_s: 4.0, vy_m_s: -2.0 };
        let flow = toml::toml! { vx_m_s = 4.0 vy_m_s = (-2.0) };
        let chosen: Vec<usize> = (64..5000).step_by(301).collect();
        let levels_v = |causes: &Causes| {
            World::new(&laboratory, causes, 1.0, CounterRng::new(1)).phasors_v(&chosen)
        };
        let still = levels_v(&Causes::none());
        let windy = levels_v(&Causes::of_catalogue(vec![("flow", flow)]));
        let onset = levels_v(&Causes::of_unmodelled(Arc::new(onset)));
        for (place, &n) in chosen.iter().enumerate() {
            let expected = if laboratory.survey.stops[n].time_s < 200.0 { &still } else { &windy };
            assert_eq!(onset[place], expected[place]);
        }
        assert!(still != windy);
    }
}
