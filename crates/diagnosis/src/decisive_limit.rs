//! A limit that can change a verdict, and how it is varied to see how much it decides.

use std::sync::atomic::{AtomicU64, Ordering};

/// A limit of the diagnosis that can change a verdict. [`decisive_limits`](crate::decisive_limits) lists them.
#[derive(Debug)]
pub struct DecisiveLimit {
    name: &'static str,
    usual: f64,
    varied: Varied,
    /// The bits of the factor by which it is multiplied now.
    factor: AtomicU64,
}

/// What is multiplied as a limit is varied.
#[derive(Debug, Clone, Copy)]
enum Varied {
    /// The limit.
    Itself,
    /// What it has beyond one: of a ratio that is one or more.
    BeyondOne,
    /// What it lacks to one: of a probability near one.
    ShortOfOne,
}

impl DecisiveLimit {
    /// A limit with its usual value.
    pub(crate) const fn new(name: &'static str, usual: f64) -> Self {
        let factor = AtomicU64::new(1.0f64.to_bits());
        Self { name, usual, varied: Varied::Itself, factor }
    }

    /// The same of a ratio that is one or more: what it has beyond one is varied.
    pub(crate) const fn beyond_one(self) -> Self {
        Self { varied: Varied::BeyondOne, ..self }
    }

    /// The same of a probability near one: what it lacks to one is varied.
    pub(crate) const fn short_of_one(self) -> Self {
        Self { varied: Varied::ShortOfOne, ..self }
    }

    /// Its name, in lower case with hyphens.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Its value now.
    pub fn get(&self) -> f64 {
        let factor = f64::from_bits(self.factor.load(Ordering::Relaxed));
        match self.varied {
            Varied::Itself => factor * self.usual,
            Varied::BeyondOne => 1.0 + factor * (self.usual - 1.0),
            Varied::ShortOfOne => 1.0 - factor * (1.0 - self.usual),
        }
    }

    /// Multiplies it by a factor above zero for all diagnoses of this process, until what is returned is dropped. Of a ratio what it has beyond one is
    /// multiplied, of a probability near one what it lacks to one.
    #[must_use = "the limit has its usual value again when this is dropped"]
    pub fn vary(&self, factor: f64) -> VariedLimit<'_> {
        self.factor.store(factor.to_bits(), Ordering::Relaxed);
        VariedLimit(self)
    }
}

/// A limit with another value. Dropped, it gives it its usual value again.
#[derive(Debug)]
pub struct VariedLimit<'l>(&'l DecisiveLimit);

impl Drop for VariedLimit<'_> {
    fn drop(&mut self) {
        self.0.factor.store(1.0f64.to_bits(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::decisive_limits;

    #[test]
    fn a_limit_is_varied_until_that_is_dropped() {
        let plain = DecisiveLimit::new("nats", 12.0);
        let ratio = DecisiveLimit::new("ratio", 1.5).beyond_one();
        let share = DecisiveLimit::new("probability", 0.9).short_of_one();
        {
            let _varied = [plain.vary(2.0), ratio.vary(2.0), share.vary(0.5)];
            assert_eq!((plain.get(), ratio.get()), (24.0, 2.0));
            assert!((share.get() - 0.95).abs() < 1e-12);
        }
        assert_eq!((plain.get(), ratio.get()), (12.0, 1.5));
        assert!((share.get() - 0.9).abs() < 1e-12);
    }

    #[test]
    fn decisive_limits_have_names_of_their_own() {
        let names: BTreeSet<&str> = decisive_limits().iter().map(|limit| limit.name()).collect();
        assert_eq!(names.len(), decisive_limits().len());
        let plain = |name: &&str| name.bytes().all(|b| b.is_ascii_lowercase() || b == b'-');
        assert!(names.iter().all(plain), "{names:?}");
    }
}
