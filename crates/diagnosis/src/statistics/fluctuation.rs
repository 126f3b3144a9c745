//! What makes a reading of the field differ from its own repeat.

/// A random part of the field at a reading, by its cause. Its size is a standard deviation in the unit of the cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fluctuation {
    /// The phase of each path changes a little, by itself: each part moves across its own direction. Unit: rad over one metre of path.
    OfPaths,
    /// Sound is scattered many times: the random part is alike in both quadratures. Unit: rad over one metre of path.
    Circular,
    /// The place of the receiver changes, equally along each axis. Unit: mm.
    OfPosition,
}

impl Fluctuation {
    /// Every cause.
    pub const ALL: [Self; 3] = [Self::OfPaths, Self::Circular, Self::OfPosition];
    /// Causes in the air.
    pub const OF_AIR: [Self; 2] = [Self::OfPaths, Self::Circular];
}
