//! What a receiver says of itself, and what is kept of a point.

/// What a receiver says of itself.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ReceiverIdentity {
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// The magnitude at which the converter clips, in `unit`.
    pub full_scale: f64,
    /// Unit of the readings, for instance `V`.
    pub unit: String,
}

/// The readings of one point.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Reading {
    /// Mean, in the receiver's unit.
    pub mean: f64,
    /// Sample standard deviation (divided by count - 1), in the receiver's unit; zero for one reading.
    pub std: f64,
    /// Readings averaged; fewer than asked for where some were lost.
    pub count: usize,
    /// Whether the converter clipped in any of them.
    pub clipped: bool,
    /// Samples lost on the way, those of the settling time included.
    pub gaps: u32,
    /// Instant of the first averaged reading, s, on the receiver's clock.
    pub first_t_s: f64,
    /// Instant of the last averaged reading, s, on the receiver's clock.
    pub last_t_s: f64,
}
