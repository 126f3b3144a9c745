//! Noisy logs of a transducer with a known field.

use std::fmt::Write;
use std::path::Path;

use fieldgap::acoustics::Vec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A transducer's axis: foot (mm, from the centre of the box) and slope.
#[derive(Clone, Copy, Default)]
pub struct Axis {
    pub foot_mm: [f64; 2],
    pub lean: [f64; 2],
}

/// The text of a log over a box of 50 cm in steps of 3 cm sideways and 2.5 cm in height, 6,000 points. `noise` is the
/// standard deviation; readings are at least zero.
///
/// `field` gives the reading at a distance (m), a height along the axis (m) and an angle from it (degrees).
pub fn log(axis: Axis, noise: f64, seed: u64, field: impl Fn(f64, f64, f64) -> f64) -> String {
    let mut noise_rng = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, noise).expect("a standard deviation");
    let mut text = "x,y,z,mag,unused\n-24,-24,0\n48,48,50\n3,3,2.5\n".to_owned();
    let direction = Vec3::new(axis.lean[0], axis.lean[1], 1.0).normalize();
    for column in -8..=8 {
        for row in -8..=8 {
            for level in 0..=20 {
                let (x, y, z) =
                    (3.0 * f64::from(column), 3.0 * f64::from(row), 2.5 * f64::from(level));
                let foot = Vec3::new(axis.foot_mm[0], axis.foot_mm[1], 0.0) * 1e-3;
                let r = Vec3::new(x, y, z) * 1e-2 - foot;
                let height = r.dot(&direction);
                let angle = (r - height * direction).norm().atan2(height).to_degrees();
                let clean = if height > 0.0 { field(r.norm(), height, angle) } else { 1.0 };
                let reading = (clean + normal.sample(&mut noise_rng)).max(0.0);
                let _ = writeln!(text, "{x},{y},{z},{reading:.9},0");
            }
        }
    }
    text
}

/// Writes a log into a folder.
pub fn write(folder: &Path, text: &str) -> std::path::PathBuf {
    let path = folder.join("log_19v_murata.csv");
    std::fs::write(&path, text).expect("written");
    path
}
