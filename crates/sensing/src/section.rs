//! `[sensing]` in a rig file.

use serde::Deserialize;

use fieldgap_input::{Exact, Rate, literal};

/// `[sensing]`: the receiving elements and their sampling rate.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "SensingKeys")]
pub struct SensingSection {
    elements: [usize; 4],
    rate_hz: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensingKeys {
    left: Exact<usize, 2>,
    right: Exact<usize, 2>,
    #[serde(default = "default_rate")]
    rate_hz: Rate,
}

/// Enough for nine samples between the sides of a two-ring display at 1 m/s.
fn default_rate() -> Rate {
    literal(250.0)
}

impl TryFrom<SensingKeys> for SensingSection {
    type Error = String;
    fn try_from(keys: SensingKeys) -> Result<Self, String> {
        let elements = [keys.left[0], keys.left[1], keys.right[0], keys.right[1]];
        let twice = (1..4).find(|&n| elements[..n].contains(&elements[n]));
        match twice {
            Some(n) => Err(format!(
                "element {} is listed twice; four different elements are needed",
                elements[n]
            )),
            None => Ok(Self { elements, rate_hz: keys.rate_hz.get() }),
        }
    }
}

impl SensingSection {
    /// The elements: two on the left, two on the right.
    pub fn elements(&self) -> [usize; 4] {
        self.elements
    }

    /// Sampling rate, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::toml_text;

    #[test]
    fn four_different_elements_are_needed() {
        let read = |text: &str| toml_text::<SensingSection>(Path::new("rig.toml"), text);
        let section = read("left = [15, 17]\nright = [11, 9]\n").expect("valid");
        assert_eq!((section.elements(), section.rate_hz()), ([15, 17, 11, 9], 250.0));
        let fault = read("left = [15, 17]\nright = [11, 15]\n").expect_err("twice");
        assert!(fault.to_string().contains("element 15 is listed twice"), "{fault}");
        for wrong in [
            "left = [1]\nright = [2, 3]\n",
            "left = [1, 2]\nright = [3, 4]\nrate_hz = 0\n",
            "left = [1, 2]\n",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
