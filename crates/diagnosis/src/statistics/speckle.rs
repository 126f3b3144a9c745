//! How the random parts of many paths add up.

/// How what fluctuating air scatters adds up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Speckle {
    /// Each path's phase changes a little, by itself: each part moves across its own direction.
    OfPaths,
    /// Scattered many times: alike in both quadratures.
    Circular,
}

impl Speckle {
    /// Both.
    pub const ALL: [Self; 2] = [Self::OfPaths, Self::Circular];
}
