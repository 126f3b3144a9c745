//! A robot that refuses what it must not do.
