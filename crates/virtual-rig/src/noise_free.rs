//! Readings without noise at given places, with known effects: the reference that a forward model is compared with.

use num_complex::Complex64;

use fieldgap_acoustics::{Element, Simulation, Vec3, delays_s};
use fieldgap_input::Fault;

use super::counter_rng::CounterRng;
use super::drive::Drive;
use super::effects::JITTER_CELL_MM;
use super::trajectory::Kinematics;
use super::true_field::{AirStep, Contributions, TrueField};
use super::truth::{TrueSource, Truth};

/// Where and when one reading is taken, as the robot reports it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Position, array's frame, m.
    pub position_m: Vec3,
    /// Velocity, m/s; zero at rest.
    pub velocity_m_s: Vec3,
    /// Time since the rig's power-up, s.
    pub time_s: f64,
}

/// The reading at each visit, V, without noise.
///
/// Array, medium, carrier and excitation are those of `setup`. Its simulator has no part in this: the elements are vibrating
/// pistons of the array's radii, summed by their Rayleigh integrals. `effects` holds the parameters of each effect under its
/// id, as `[effects]` of a truth file does; an empty table gives the undisturbed field. `gain_v_m` is the reading for a field of
/// 1/m, which is a lossless element at 1 m on its axis. `seed` sets what the effects draw at random.
///
/// The visits are in the order of time, and each is an approach of its own for effects that depend on travel. Backlash is taken
/// up in the direction of the velocity along x. Where that is zero, the direction of the visit before holds.
///
/// # Errors
/// A [`Fault`] that names an unknown effect or parameter, a value out of range, or an effect that does not fit the array.
pub fn noise_free_readings(
    setup: &Simulation,
    effects: &toml::Table,
    gain_v_m: f64,
    visits: &[Visit],
    seed: u64,
) -> Result<Vec<f64>, Fault> {
    let (array, medium, frequency_hz) = (&setup.array, setup.medium, setup.frequency_hz);
    let delays_s = delays_s(&setup.excitation, array, &medium, frequency_hz);
    let visits: Vec<(usize, Visit)> = visits.iter().map(|&visit| (0, visit)).collect();
    noise_free_coded_readings(setup, effects, gain_v_m, &[delays_s], &visits, seed)
}

/// The same with many drives: each visit has the number of its drive, the delay of every element in seconds. The setup's excitation
/// has no part in this.
///
/// # Errors
/// As [`noise_free_readings`].
pub fn noise_free_coded_readings(
    setup: &Simulation,
    effects: &toml::Table,
    gain_v_m: f64,
    drives_s: &[Vec<f64>],
    visits: &[(usize, Visit)],
    seed: u64,
) -> Result<Vec<f64>, Fault> {
    let phasors = noise_free_coded_phasors(setup, effects, gain_v_m, drives_s, visits, seed)?;
    Ok(phasors.into_iter().map(|(reading_v, _)| reading_v).collect())
}

/// The reading at each visit, V, and the phase of the field against the clock of the drives, rad, in the convention exp(-iωt); otherwise as
/// [`noise_free_coded_readings`].
///
/// # Errors
/// As [`noise_free_readings`].
pub fn noise_free_coded_phasors(
    setup: &Simulation,
    effects: &toml::Table,
    gain_v_m: f64,
    drives_s: &[Vec<f64>],
    visits: &[(usize, Visit)],
    seed: u64,
) -> Result<Vec<(f64, f64)>, Fault> {
    let truth = Truth::of_effects(effects)?;
    truth.check(setup.array.len())?;
    let (array, medium, frequency_hz) = (&setup.array, setup.medium, setup.frequency_hz);
    let source = TrueSource::default();
    let rng = CounterRng::new(seed);
    let field = TrueField::new(array, medium, frequency_hz, &source, truth.effects, rng);
    let weights: Vec<Vec<Complex64>> = drives_s
        .iter()
        .map(|delays_s| {
            let delays_s = delays_s.iter().copied().map(Some).collect();
            let drive = Drive { emitting: true, delays_s, ..Drive::silent(array.len()) };
            field.weights(&drive.outputs())
        })
        .collect();
    let places: Vec<Visit> = visits.iter().map(|(_, visit)| *visit).collect();
    let motions = kinematics(&places, field.lag_s());
    // Many drives of one place need the elements' contributions once.
    let mut last: Option<((AirStep, Vec3), Contributions)> = None;
    let mut read = |((drive, visit), kinematics): (&(usize, Visit), Kinematics)| {
        let at_m = field.place(kinematics.position_mm * 1e-3, &kinematics);
        let air = field.air_at(visit.time_s);
        if last.as_ref().is_none_or(|(known, _)| *known != (air, at_m)) {
            last = Some(((air, at_m), field.contributions_in(air, at_m)));
        }
        let (_, contributions) = last.as_ref().expect("it was just set");
        let phasor = field.phasor(contributions, &weights[*drive], visit.time_s);
        let level_v = field.level_v(phasor.norm() * gain_v_m, visit.time_s);
        (level_v.min(field.full_scale_v(f64::INFINITY)), phasor.arg())
    };
    Ok(visits.iter().zip(motions).map(&mut read).collect())
}

/// The elements as they are with these effects: where they stand, and what chance gave each.
///
/// Arguments as for [`noise_free_readings`].
///
/// # Errors
/// As [`noise_free_readings`].
pub fn elements_with(
    setup: &Simulation,
    effects: &toml::Table,
    seed: u64,
) -> Result<Vec<Element>, Fault> {
    let truth = Truth::of_effects(effects)?;
    truth.check(setup.array.len())?;
    let (array, source) = (&setup.array, TrueSource::default());
    let rng = CounterRng::new(seed);
    let field =
        TrueField::new(array, setup.medium, setup.frequency_hz, &source, truth.effects, rng);
    Ok(field.array().elements.clone())
}

/// The motion at each visit, `lag_s` before it.
fn kinematics(visits: &[Visit], lag_s: f64) -> Vec<Kinematics> {
    let mut x_direction = 0.0;
    let mut travelled_mm = 0.0;
    let mut before: Option<&Visit> = None;
    visits
        .iter()
        .map(|visit| {
            if visit.velocity_m_s.x != 0.0 {
                x_direction = visit.velocity_m_s.x.signum();
            }
            if let Some(before) = before {
                let way_mm = (visit.position_m - before.position_m).norm() * 1e3;
                // Whoever comes back to the same place has been away from it.
                travelled_mm += way_mm.max(2.0 * JITTER_CELL_MM);
            }
            before = Some(visit);
            Kinematics {
                position_mm: (visit.position_m - visit.velocity_m_s * lag_s) * 1e3,
                x_direction,
                x_since_reversal_mm: f64::INFINITY,
                travelled_mm,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::{Array, Excitation, Medium, Simulator};

    const FOCUS_M: Vec3 = Vec3::new(0.0175, -0.0225, 0.1);

    fn setup() -> Simulation {
        Simulation {
            simulator: Simulator::Rayleigh,
            array: Array::square(6, 6, 10.5e-3).expect("not empty"),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Focus(FOCUS_M),
        }
    }

    fn readings(effects: &toml::Table, visits: &[Visit]) -> Vec<f64> {
        noise_free_readings(&setup(), effects, 1.0, visits, 1).expect("the effects fit")
    }

    fn at(x_mm: f64, vx_mm_s: f64, time_s: f64) -> Visit {
        let position_m = FOCUS_M + Vec3::x() * x_mm * 1e-3;
        Visit { position_m, velocity_m_s: Vec3::x() * vx_mm_s * 1e-3, time_s }
    }

    #[test]
    fn without_effects_the_readings_are_those_of_the_rayleigh_simulator() {
        let visits = [at(0.0, 0.0, 0.0), at(3.0, 0.0, 1.0), at(-5.0, 0.0, 2.0)];
        let read = readings(&toml::Table::new(), &visits);
        let simulated = setup().magnitudes(&visits.map(|visit| visit.position_m));
        for n in 1..3 {
            let ratio = read[n] / read[0] * simulated[0] / simulated[n];
            assert!((ratio - 1.0).abs() < 2e-3, "{n}: {ratio}");
        }
    }

    #[test]
    fn time_velocity_and_place_act_as_the_effects_say() {
        let none = toml::Table::new();
        let drift = toml::toml! { gain-drift = { relative = -0.1, over_s = 10.0 } };
        let late = at(0.0, 0.0, 10.0);
        let (drifted, plain) = (readings(&drift, &[late])[0], readings(&none, &[late])[0]);
        assert!((drifted / plain - 0.9).abs() < 1e-12);
        let lag = toml::toml! { lag = { s = 0.1 } };
        let trailing = readings(&lag, &[at(3.0, 20.0, 0.0)])[0];
        let there = readings(&none, &[at(1.0, 0.0, 0.0)])[0];
        assert!((trailing / there - 1.0).abs() < 1e-12);
        let play = toml::toml! { backlash = { mm = 0.4 } };
        let forth = readings(&play, &[at(1.0, 20.0, 0.0), at(1.0, 0.0, 1.0)]);
        let there = readings(&none, &[at(0.8, 0.0, 0.0)])[0];
        assert!(forth.iter().all(|reading| (reading / there - 1.0).abs() < 1e-12));
        let clipped = toml::toml! { clipping = { level = 0.5 } };
        assert_eq!(readings(&clipped, &[at(0.0, 0.0, 0.0)])[0], 0.5);
    }

    #[test]
    fn a_repeat_at_the_same_place_has_a_new_displacement() {
        let jitter = toml::toml! { position-jitter = { x_mm = 0.2, y_mm = 0.2, z_mm = 0.1 } };
        let visits = [at(3.0, 0.0, 0.0), at(3.0, 0.0, 1.0), at(3.0, 0.0, 2.0)];
        let read = readings(&jitter, &visits);
        assert!(read[0] != read[1] && read[1] != read[2] && read[0] != read[2], "{read:?}");
        assert_eq!(read, readings(&jitter, &visits), "the seed gives the same again");
    }

    #[test]
    fn an_effect_that_is_not_known_or_does_not_fit_is_refused() {
        let array = Array::square(2, 2, 10.5e-3).expect("not empty");
        let setup = Simulation { array, ..setup() };
        for (effects, named) in [
            (toml::toml! { jitter = { x_mm = 0.2 } }, "jitter"),
            (toml::toml! { dead-elements = { elements = [4] } }, "dead-elements"),
        ] {
            let fault = noise_free_readings(&setup, &effects, 1.0, &[], 1).expect_err("refused");
            assert!(fault.to_string().contains(named), "{fault}");
        }
    }
}
