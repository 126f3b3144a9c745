//! Many scans against many simulations, by a schedule, on several rigs.
