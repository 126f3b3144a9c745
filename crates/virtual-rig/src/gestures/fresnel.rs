//! The Fresnel integral.

use std::sync::LazyLock;

use num_complex::Complex64;

/// Steps of the table in one.
const STEPS: usize = 512;

/// Where the table ends and the asymptotic form begins.
const END: usize = 16;

/// ∫₀ʷ exp(iπt²/2) dt, to 2e-5; C(w) + i S(w) of the tables.
///
/// Up to 16 from a table, made once by Simpson's rule and read by straight lines; beyond, (1 + i)/2 - i exp(iπw²/2)/(πw)
/// (Abramowitz and Stegun, 7.3.9 and 7.3.27 to the first order).
pub(super) fn fresnel(w: f64) -> Complex64 {
    static TABLE: LazyLock<Vec<Complex64>> = LazyLock::new(table);
    let size = w.abs();
    let value = if size < END as f64 {
        let along = size * STEPS as f64;
        let before = along as usize;
        let (from, to) = (TABLE[before], TABLE[before + 1]);
        from + (to - from) * (along - before as f64)
    } else {
        Complex64::new(0.5, 0.5)
            + integrand(size) / Complex64::new(0.0, std::f64::consts::PI * size)
    };
    if w < 0.0 { -value } else { value }
}

fn integrand(t: f64) -> Complex64 {
    Complex64::from_polar(1.0, std::f64::consts::FRAC_PI_2 * t * t)
}

fn table() -> Vec<Complex64> {
    let step = 1.0 / STEPS as f64;
    let mut values = vec![Complex64::ZERO];
    for n in 0..END * STEPS + 1 {
        let from = n as f64 * step;
        let simpson = integrand(from) + 4.0 * integrand(from + 0.5 * step) + integrand(from + step);
        values.push(values[n] + simpson * (step / 6.0));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_tabled_function() {
        // Abramowitz and Stegun, table 7.7.
        for (w, c, s) in [
            (0.5, 0.492_344_2, 0.064_732_4),
            (1.0, 0.779_893_4, 0.438_259_1),
            (2.0, 0.488_253_4, 0.343_415_7),
            (5.0, 0.563_631_2, 0.499_191_4),
        ] {
            assert!((fresnel(w) - Complex64::new(c, s)).norm() < 2e-5, "{w}: {}", fresnel(w));
            assert!((fresnel(-w) + Complex64::new(c, s)).norm() < 2e-5);
        }
    }

    #[test]
    fn the_table_joins_the_asymptotic_form() {
        let end = END as f64;
        assert!((fresnel(end - 1e-9) - fresnel(end)).norm() < 5e-5);
        assert!((fresnel(1e6) - Complex64::new(0.5, 0.5)).norm() < 1e-5);
    }
}
