//! A field measured in a plane, propagated to another plane: holography by the angular spectrum (E. G. Williams, *Fourier Acoustics*, 1999,
//! sections 2.9 and 3.4).
//!
//! The spectrum of the plane is taken at wavenumbers as fine as a plane several times as wide and zero outside of the measured one (zero
//! padding), so that the periodic images that a sum makes stay away. Each plane wave then turns by kz times the distance. Evanescent waves are left
//! out: back towards the source they would grow, and noise with them. What is left resolves half a wavelength at best, and less where the
//! measured plane is seen under a small angle.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

/// How many times as wide as all that is asked for the padded plane is.
const PADDED: f64 = 3.0;

/// Share of each side over which the measured plane is faded out, as an abrupt edge radiates (a Tukey window; Williams, section 3.8).
const FADED: f64 = 0.1;

/// Share of the wavenumber: waves whose part along z is less are faded out towards the evanescent ones (a filter in the wavenumber; Williams,
/// section 3.8). An abrupt end would itself radiate: of a monopole its share is as large as the field on the axis. Set by judgement.
const GRAZING: f64 = 0.5;

/// A complex field on a rectangular grid of even steps; the time convention is exp(-iωt).
#[derive(Debug, Clone, Copy)]
pub struct PlaneField<'f> {
    /// Columns, ascending, m.
    pub x_m: &'f [f64],
    /// Rows, ascending, m.
    pub y_m: &'f [f64],
    /// The field, row by row (y outer, x inner).
    pub values: &'f [Complex64],
}

impl PlaneField<'_> {
    /// The field on another grid of a parallel plane, so far along z; negative towards the source. `None` if the grids have fewer than two
    /// lines along an axis, or the values are not as many as its points.
    pub fn propagated(
        &self,
        wavenumber_rad_m: f64,
        along_z_m: f64,
        (to_x_m, to_y_m): (&[f64], &[f64]),
    ) -> Option<Vec<Complex64>> {
        let enough = |along: &[f64]| along.len() >= 2;
        if !(enough(self.x_m) && enough(self.y_m))
            || to_x_m.is_empty()
            || to_y_m.is_empty()
            || self.values.len() != self.x_m.len() * self.y_m.len()
        {
            return None;
        }
        let [kx, ky] = [(self.x_m, to_x_m), (self.y_m, to_y_m)]
            .map(|(from, to)| wavenumbers(from, to, along_z_m, wavenumber_rad_m));
        let [step_x, step_y] = [self.x_m, self.y_m].map(step);
        let [fade_x, fade_y] = [self.x_m, self.y_m].map(|along| window(along.len()));
        // Sums over x, then over y.
        let by_x = waves(&kx, self.x_m, -1.0);
        let rows = self.values.chunks(self.x_m.len()).zip(&fade_y);
        let rows: Vec<Vec<Complex64>> = rows
            .map(|(row, fade)| {
                let faded: Vec<Complex64> =
                    row.iter().zip(&fade_x).map(|(value, along)| value * (fade * along)).collect();
                by_x.iter().map(|waves| dot(waves, &faded)).collect()
            })
            .collect();
        let by_y = waves(&ky, self.y_m, -1.0);
        let spacing = |k: &[f64]| k[1] - k[0];
        let measure = step_x * step_y * spacing(&kx) * spacing(&ky) / (TAU * TAU);
        let spectrum = |(m, waves): (usize, &Vec<Complex64>)| -> Vec<Complex64> {
            let of_row = |n: usize| -> Complex64 {
                let across = wavenumber_rad_m.powi(2) - kx[n].powi(2) - ky[m].powi(2);
                if across <= 0.0 {
                    return Complex64::ZERO;
                }
                let along_z = across.sqrt();
                let fade = (along_z / (GRAZING * wavenumber_rad_m)).min(1.0);
                let weight = measure * (0.5 * PI * fade).sin().powi(2);
                let sum: Complex64 = waves.iter().zip(&rows).map(|(wave, row)| wave * row[n]).sum();
                sum * Complex64::from_polar(weight, along_z * along_z_m)
            };
            (0..kx.len()).map(of_row).collect()
        };
        let spectrum: Vec<Vec<Complex64>> = by_y.iter().enumerate().map(spectrum).collect();
        // Back to the other grid.
        let to_x = waves_at(&kx, to_x_m);
        let rows: Vec<Vec<Complex64>> =
            spectrum.iter().map(|row| to_x.iter().map(|waves| dot(waves, row)).collect()).collect();
        let to_y = waves_at(&ky, to_y_m);
        let field = to_y.iter().flat_map(|waves| {
            let rows = &rows;
            (0..to_x_m.len()).map(move |column| {
                waves.iter().zip(rows).map(|(wave, row)| wave * row[column]).sum::<Complex64>()
            })
        });
        Some(field.collect())
    }
}

fn dot(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Mean step of a grid, m.
fn step(along_m: &[f64]) -> f64 {
    (along_m[along_m.len() - 1] - along_m[0]) / (along_m.len() - 1) as f64
}

/// Wavenumbers of waves that propagate, as close as the padded plane asks for.
fn wavenumbers(from_m: &[f64], to_m: &[f64], along_z_m: f64, wavenumber_rad_m: f64) -> Vec<f64> {
    let ends = |along: &[f64]| (along[0], along[along.len() - 1]);
    let ((a, b), (c, d)) = (ends(from_m), ends(to_m));
    let width_m = b.max(d) - a.min(c) + along_z_m.abs();
    let count = (wavenumber_rad_m * PADDED * width_m / PI).ceil().max(2.0);
    let spacing = 2.0 * wavenumber_rad_m / count;
    (0..count as usize).map(|n| (n as f64 + 0.5) * spacing - wavenumber_rad_m).collect()
}

/// exp(± i k x): for each wavenumber, over the places.
fn waves(k: &[f64], along_m: &[f64], sign: f64) -> Vec<Vec<Complex64>> {
    k.iter().map(|k| along_m.iter().map(|m| Complex64::cis(sign * k * m)).collect()).collect()
}

/// exp(i k x): for each place, over the wavenumbers.
fn waves_at(k: &[f64], along_m: &[f64]) -> Vec<Vec<Complex64>> {
    along_m.iter().map(|m| k.iter().map(|k| Complex64::cis(k * m)).collect()).collect()
}

fn window(count: usize) -> Vec<f64> {
    let faded = FADED * count as f64;
    (0..count)
        .map(|n| {
            let from_edge = (n.min(count - 1 - n) as f64 + 0.5) / faded;
            if from_edge >= 1.0 { 1.0 } else { (0.5 * PI * from_edge).sin().powi(2) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: f64 = TAU * 40e3 / 343.0;

    fn grid(half_m: f64, count: usize) -> Vec<f64> {
        (0..count).map(|n| half_m * (2.0 * n as f64 / (count - 1) as f64 - 1.0)).collect()
    }

    /// The field of a Gaussian beam of waist w in the plane of its waist and behind it, in closed form (A. E. Siegman, *Lasers*, 1986, section 16.3),
    /// paraxial: w is five wavelengths.
    #[test]
    fn a_gaussian_beam_is_brought_back_to_its_waist() {
        let waist_m = 0.043;
        let along_m = 0.15;
        let rayleigh_m = 0.5 * K * waist_m * waist_m;
        let beam = |x: f64, y: f64, z: f64| {
            let q = Complex64::new(1.0, z / rayleigh_m);
            let r2 = x * x + y * y;
            (-(r2 / (waist_m * waist_m)) / q).exp() / q * Complex64::cis(K * z)
        };
        let (from, to) = (grid(0.15, 91), grid(0.05, 11));
        let values: Vec<Complex64> = from
            .iter()
            .flat_map(|&y| from.iter().map(move |&x| (x, y)))
            .map(|(x, y)| beam(x, y, along_m))
            .collect();
        let plane = PlaneField { x_m: &from, y_m: &from, values: &values };
        let back = plane.propagated(K, -along_m, (&to, &to)).expect("a grid");
        let places = to.iter().flat_map(|&y| to.iter().map(move |&x| (x, y)));
        for ((x, y), seen) in places.zip(&back) {
            let wanted = beam(x, y, 0.0);
            assert!((seen - wanted).norm() < 0.02, "({x}, {y}): {seen} {wanted}");
        }
    }

    /// Two monopoles 12 mm apart, exp(ikr)/r each, one reversed: at a height of 30 mm the field brought back from 60 mm is theirs, but for waves
    /// at grazing angles.
    #[test]
    fn two_monopoles_are_parted_nearer_to_them() {
        let sources = [(-0.006, 1.0), (0.006, -1.0)];
        let field = |x: f64, y: f64, z: f64| -> Complex64 {
            let wave = |&(at, sign): &(f64, f64)| {
                let r = ((x - at).powi(2) + y * y + z * z).sqrt();
                Complex64::from_polar(sign / r, K * r)
            };
            sources.iter().map(wave).sum()
        };
        let (from, to) = (grid(0.25, 161), grid(0.02, 21));
        let values: Vec<Complex64> = from
            .iter()
            .flat_map(|&y| from.iter().map(move |&x| (x, y)))
            .map(|(x, y)| field(x, y, 0.06))
            .collect();
        let plane = PlaneField { x_m: &from, y_m: &from, values: &values };
        let back = plane.propagated(K, -0.03, (&to, &to)).expect("a grid");
        let wanted: Vec<Complex64> = to
            .iter()
            .flat_map(|&y| to.iter().map(move |&x| (x, y)))
            .map(|(x, y)| field(x, y, 0.03))
            .collect();
        let norm = |values: &[Complex64]| values.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
        let missed: Vec<Complex64> = back.iter().zip(&wanted).map(|(a, b)| a - b).collect();
        assert!(norm(&missed) < 0.1 * norm(&wanted), "{}", norm(&missed) / norm(&wanted));
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let values = [Complex64::ONE; 4];
        let plane = PlaneField { x_m: &[0.0, 0.01], y_m: &[0.0, 0.01], values: &values };
        assert!(plane.propagated(K, -0.1, (&[0.0], &[0.0])).is_some());
        assert!(plane.propagated(K, -0.1, (&[], &[0.0])).is_none());
        let line = PlaneField { x_m: &[0.0], ..plane };
        assert!(line.propagated(K, -0.1, (&[0.0], &[0.0])).is_none());
        let short = PlaneField { values: &values[..3], ..plane };
        assert!(short.propagated(K, -0.1, (&[0.0], &[0.0])).is_none());
    }
}
