//! The receiver's analogue-to-digital converter.

/// A converter from 0 to its full scale in equal steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    full_scale_v: f64,
    step_v: f64,
}

impl Converter {
    /// A converter of so many bits.
    pub fn new(full_scale_v: f64, bits: u32) -> Self {
        Self { full_scale_v, step_v: full_scale_v / f64::from((1u32 << bits.min(31)) - 1) }
    }

    /// The largest value it gives.
    pub fn full_scale_v(&self) -> f64 {
        self.full_scale_v
    }

    /// The value it gives, and whether the input was beyond its range.
    pub fn convert(&self, volts: f64) -> (f64, bool) {
        if volts >= self.full_scale_v {
            return (self.full_scale_v, true);
        }
        ((volts.max(0.0) / self.step_v).round() * self.step_v, false)
    }

    /// The same of a value with a sign: its range is as large on either side of zero.
    pub fn convert_signed(&self, volts: f64) -> (f64, bool) {
        let (value, clipped) = self.convert(volts.abs());
        (value.copysign(volts), clipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_whole_steps_and_what_is_beyond_is_clipped() {
        let converter = Converter::new(5.0, 8);
        assert_eq!(converter.convert(7.0), (5.0, true));
        assert_eq!(converter.convert(-1.0), (0.0, false));
        let (value, clipped) = converter.convert(1.234);
        assert!((value - 1.234).abs() <= 2.5 / 255.0 && !clipped);
        let steps = value * 255.0 / 5.0;
        assert!((steps - steps.round()).abs() < 1e-9);
    }
}
