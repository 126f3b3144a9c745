//! Arrays with known elements, read by the virtual rig's physics: vibrating faces, summed by their integrals.

use fieldgap_acoustics::{Array, Excitation, Medium, Simulation, Simulator, Vec3};
use fieldgap_calibration::design::Design;
use fieldgap_calibration::{Calibration, CodedReadings, Reading};
use fieldgap_records::ChannelState;
use fieldgap_virtual_rig::{Visit, elements_with, noise_free_coded_readings};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub const FREQUENCY_HZ: f64 = 40e3;

/// Seconds from one reading to the next.
const PERIOD_S: f64 = 0.15;

/// A square array as it is thought to be.
pub fn simulation(side: usize) -> Simulation {
    Simulation {
        simulator: Simulator::Piston,
        array: Array::square(side, side, 10.5e-3).expect("not empty"),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: FREQUENCY_HZ,
        excitation: Excitation::Uniform,
    }
}

/// An array as it is, with a bench's ordinary imperfection.
pub struct Bench {
    pub seed: u64,
    pub effects: toml::Table,
    pub weights: Vec<Complex64>,
    pub dead: Vec<usize>,
    pub reversed: Vec<usize>,
    pub swapped: Vec<[usize; 2]>,
}

impl Bench {
    /// Gains spread by 5 to 10 %, phases by 5 to 10°, an offset of some tenths of a millimetre, a degree of temperature, a weak
    /// reflection and a slow drift; and `faults` each of dead, reversed and swapped channels at random.
    pub fn draw(simulation: &Simulation, faults: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = simulation.array.len();
        let mut free: Vec<usize> = (0..count).collect();
        let mut take = |many: usize, random: &mut ChaCha8Rng| -> Vec<usize> {
            (0..many).map(|_| free.swap_remove(random.random_range(0..free.len()))).collect()
        };
        let dead = take(faults, &mut random);
        let reversed = take(faults, &mut random);
        let swapped: Vec<[usize; 2]> =
            (0..faults).map(|_| take(2, &mut random).try_into().expect("two")).collect();
        let mut uniform = |from: f64, to: f64| random.random_range(from..to);
        let mut text = format!(
            "[element-gain]\nspread = {}\n[element-phase]\nspread_rad = {}\n[offset]\nx_mm = {}\ny_mm = {}\nz_mm = {}\n\
             [sound-speed]\nc_m_s = {}\n[gain-drift]\nrelative = {}\nover_s = 600.0\n\
             [reflection]\nheight_mm = 400.0\ncoefficient = [{}, 0.0]\n",
            uniform(0.05, 0.1),
            uniform(0.087, 0.175),
            uniform(-0.3, 0.3),
            uniform(-0.3, 0.3),
            uniform(-0.3, 0.3),
            343.0 * uniform(0.998, 1.002),
            uniform(-0.05, 0.05),
            uniform(-0.01, 0.01),
        );
        if faults > 0 {
            text += &format!(
                "[dead-elements]\nelements = {dead:?}\n[polarity]\nelements = {reversed:?}\n"
            );
        }
        let effects: toml::Table = text.parse().expect("TOML");
        let elements = elements_with(simulation, &effects, seed).expect("valid effects");
        let weight =
            |e: &fieldgap_acoustics::Element| e.amplitude * Complex64::from_polar(1.0, e.phase_rad);
        let by_element: Vec<Complex64> = elements.iter().map(weight).collect();
        let mut weights = by_element.clone();
        for &[a, b] in &swapped {
            weights.swap(a, b);
        }
        Self { seed, effects, weights, dead, reversed, swapped }
    }

    /// Readings of a design with noise of `noise`, relative to each; those of drives that repeat are repeated.
    pub fn read(&self, simulation: &Simulation, design: &Design, noise: f64) -> CodedReadings {
        let visits: Vec<(usize, Visit)> = (0..design.drives.len())
            .map(|drive| {
                let position_m = design.places_m[design.place_of[drive]];
                let time_s = PERIOD_S * drive as f64;
                (drive, Visit { position_m, velocity_m_s: Vec3::zeros(), time_s })
            })
            .collect();
        self.read_visits(simulation, design, &visits, noise)
    }

    fn read_visits(
        &self,
        simulation: &Simulation,
        design: &Design,
        visits: &[(usize, Visit)],
        noise: f64,
    ) -> CodedReadings {
        let drives_s: Vec<Vec<f64>> = (0..design.drives.len())
            .map(|drive| {
                let mut delays_s = design.delays_s(drive, FREQUENCY_HZ);
                self.swapped.iter().for_each(|&[a, b]| delays_s.swap(a, b));
                delays_s
            })
            .collect();
        let levels =
            noise_free_coded_readings(simulation, &self.effects, 1.0, &drives_s, visits, self.seed)
                .expect("valid effects");
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x5eed);
        let mut distinct: Vec<&Vec<u8>> = Vec::new();
        let readings = visits
            .iter()
            .zip(levels)
            .map(|((drive, visit), level)| {
                let normal: f64 = StandardNormal.sample(&mut random);
                let code = &design.drives[*drive];
                let known = distinct.iter().rposition(|known| *known == code);
                let drive = known.unwrap_or_else(|| {
                    distinct.push(code);
                    distinct.len() - 1
                });
                let place = design
                    .places_m
                    .iter()
                    .position(|place| *place == visit.position_m)
                    .expect("a place of the design");
                Reading {
                    place,
                    drive,
                    time_s: visit.time_s,
                    value: level * (1.0 + noise * normal),
                }
            })
            .collect();
        let phasor = |&turns: &u8| Complex64::i().powu(u32::from(turns));
        CodedReadings {
            places_m: design.places_m.clone(),
            drives: distinct.iter().map(|code| code.iter().map(phasor).collect()).collect(),
            readings,
            silent: None,
        }
    }

    /// Rms errors of phase (degrees) and gain over the channels that emit, after the best common factor.
    pub fn errors(&self, found: &Calibration) -> [f64; 2] {
        let pairs: Vec<(Complex64, Complex64)> = self
            .weights
            .iter()
            .zip(&found.channels)
            .filter(|(truth, _)| truth.norm() > 0.0)
            .map(|(truth, c)| (*truth, Complex64::from_polar(c.gain, c.phase_rad)))
            .collect();
        let product: Complex64 = pairs.iter().map(|(truth, found)| truth * found.conj()).sum();
        let square: f64 = pairs.iter().map(|(_, found)| found.norm_sqr()).sum();
        let factor = product / square;
        let (mut phase, mut gain) = (0.0, 0.0);
        for (truth, found) in &pairs {
            let ratio = found * factor / truth;
            phase += ratio.arg().to_degrees().powi(2);
            gain += (ratio.norm() - 1.0).powi(2);
        }
        [phase, gain].map(|sum| (sum / pairs.len() as f64).sqrt())
    }

    /// Faults that were missed, and faults that do not exist.
    pub fn misjudged(&self, found: &Calibration) -> [usize; 2] {
        let of = |state: ChannelState| -> Vec<usize> {
            found.faults().filter(|(_, c)| c.state == state).map(|(n, _)| n).collect()
        };
        let partner = |n: usize| {
            let pair = self.swapped.iter().find(|pair| pair.contains(&n))?;
            Some(if pair[0] == n { pair[1] } else { pair[0] })
        };
        let swapped: Vec<usize> = self.swapped.iter().flatten().copied().collect();
        let mut missed = 0;
        let mut invented = of(ChannelState::Weak).len();
        for (truth, found) in [
            (&self.dead, of(ChannelState::Dead)),
            (&self.reversed, of(ChannelState::Reversed)),
            (&swapped, of(ChannelState::Swapped)),
        ] {
            missed += truth.iter().filter(|n| !found.contains(n)).count();
            invented += found.iter().filter(|n| !truth.contains(n)).count();
        }
        for (n, channel) in found.faults().filter(|(_, c)| c.state == ChannelState::Swapped) {
            missed += usize::from(partner(n).is_some_and(|partner| partner != channel.drives));
        }
        [missed, invented]
    }
}
