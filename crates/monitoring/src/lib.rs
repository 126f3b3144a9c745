//! Figures followed over time: baselines, control charts and alarms.
