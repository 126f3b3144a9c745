//! From sound pressure to touch: radiation pressure on skin, force, and the threshold of perception.

use super::Medium;

/// Density of dry air at 20 °C and 101.325 kPa, kg/m³: p M/(R T) with 28.965 g/mol (ISO 2533).
pub const AIR_DENSITY_KG_M3: f64 = 1.204;

/// Characteristic impedance of skin, Pa s/m: 1150 kg/m³ times 1540 m/s, the mean of soft tissues (F. A. Duck, *Physical
/// Properties of Tissue*, 1990). Only its being much larger than that of air matters here.
pub const SKIN_IMPEDANCE_PA_S_M: f64 = 1150.0 * 1540.0;

/// Smallest sound pressure at the focus that skin perceives, Pa rms: “about 8 kPa” (H. W. Park's thesis, chapter 4, after its
/// reference 21 on micro-machined arrays). The thesis does not say which pressure is meant. It is taken as the rms value at the
/// carrier frequency, like all pressures of its simulator: no array of 36 elements reaches 8 kPa of radiation pressure.
pub const SKIN_THRESHOLD_PA: f64 = 8000.0;

/// The interface between air and skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinInAir {
    density_kg_m3: f64,
    speed_of_sound_m_s: f64,
}

impl SkinInAir {
    /// Skin in a medium of a density, kg/m³.
    pub fn new(medium: Medium, density_kg_m3: f64) -> Self {
        Self { density_kg_m3, speed_of_sound_m_s: medium.speed_of_sound_m_s }
    }

    /// Reflection coefficient of the amplitude at normal incidence: (Z - ρc)/(Z + ρc).
    pub fn reflection(&self) -> f64 {
        let air = self.density_kg_m3 * self.speed_of_sound_m_s;
        (SKIN_IMPEDANCE_PA_S_M - air) / (SKIN_IMPEDANCE_PA_S_M + air)
    }

    /// Steady pressure on skin under incident sound of `rms_pa`, Pa: (1 + R²) p²/(ρ c²).
    ///
    /// Source: J. Awatani, J. Acoust. Soc. Am. 27, 278 (1955), as Iwamoto, Tatezono and Shinoda (EuroHaptics 2008) and Hoshi et al.
    /// (IEEE Trans. Haptics 3, 155, 2010) use it: p² α/(ρ c²), α between 1 (all absorbed) and 2 (all reflected), plane waves at
    /// normal incidence. At a focus, waves arrive from the whole array; there the true value is smaller, by the mean of cos² of their
    /// angles.
    pub fn radiation_pressure_pa(&self, rms_pa: f64) -> f64 {
        let energy_density =
            rms_pa * rms_pa / (self.density_kg_m3 * self.speed_of_sound_m_s.powi(2));
        (1.0 + self.reflection().powi(2)) * energy_density
    }

    /// Force on skin, N, from the sound pressure, Pa rms, in cells of `cell_m2` each.
    pub fn force_n(&self, rms_pa: impl IntoIterator<Item = f64>, cell_m2: f64) -> f64 {
        rms_pa.into_iter().map(|rms_pa| self.radiation_pressure_pa(rms_pa)).sum::<f64>() * cell_m2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: SkinInAir =
        SkinInAir { density_kg_m3: AIR_DENSITY_KG_M3, speed_of_sound_m_s: 343.2 };

    #[test]
    fn skin_reflects_nearly_all_sound() {
        // Iwamoto et al. state 99.9 % of the energy.
        assert!(SKIN.reflection().powi(2) > 0.999 && SKIN.reflection() < 1.0);
    }

    #[test]
    fn the_radiation_pressure_is_twice_the_energy_density() {
        // A plane wave of intensity I carries the energy I/c per volume; total reflection gives 2 I/c.
        let rms_pa = 2000.0;
        let intensity = rms_pa * rms_pa / (AIR_DENSITY_KG_M3 * 343.2);
        let all_reflected = 2.0 * intensity / 343.2;
        let ours = SKIN.radiation_pressure_pa(rms_pa);
        assert!(ours < all_reflected && ours > 0.998 * all_reflected, "{ours} {all_reflected}");
    }

    #[test]
    fn the_force_of_a_gaussian_spot_is_its_closed_form() {
        // p = p0 exp(-r²/w²): the radiation pressure is P0 exp(-2 r²/w²), whose integral is P0 π w²/2.
        let (top_pa, waist_m, cell_m) = (2500.0, 6e-3, 0.25e-3);
        let along = || (-200..=200).map(|step| f64::from(step) * cell_m);
        let field = along().flat_map(|y| {
            along().map(move |x| top_pa * (-(x * x + y * y) / (waist_m * waist_m)).exp())
        });
        let closed =
            SKIN.radiation_pressure_pa(top_pa) * std::f64::consts::PI * waist_m.powi(2) / 2.0;
        let ours = SKIN.force_n(field, cell_m * cell_m);
        assert!((ours / closed - 1.0).abs() < 1e-9, "{ours} {closed}");
    }
}
