//! Mean of the magnitude of a noisy level: Rice's distribution.

/// Mean magnitude of a level with noise of standard deviation `quadrature` in each quadrature: between Rayleigh's mean at no
/// level and m + q²/2m far above the noise (a rational fit to Rice's mean, right to 1.1 % of q).
pub fn rice_mean(level: f64, quadrature: f64) -> f64 {
    let q2 = quadrature * quadrature;
    match q2 == 0.0 {
        true => level,
        false => (level * level + q2 * (1.0 + lost_in_noise(level, q2))).sqrt(),
    }
}

/// The share of a quadrature's variance `q2` that enters the mean instead of the scatter: π/2 - 1 at level zero, zero far above the noise.
pub fn lost_in_noise(level: f64, q2: f64) -> f64 {
    0.5708 / (1.0 + 0.434 * level * level / q2)
}
