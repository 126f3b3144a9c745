//! A receiver's level as a line of text with a bar.

use fieldgap_rig::{Reading, ReceiverIdentity};

/// Bar characters in steps of an eighth of a cell.
const EIGHTHS: [char; 8] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉'];

/// A bar of `width` cells, of which `share` (0 to 1) is filled, to an eighth of a cell.
pub fn bar(share: f64, width: usize) -> String {
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    let eighths = (share * width as f64 * 8.0).round() as usize;
    let mut bar = "█".repeat(eighths / 8);
    if !eighths.is_multiple_of(8) {
        bar.push(EIGHTHS[eighths % 8]);
    }
    let filled = eighths.div_ceil(8);
    bar + &" ".repeat(width - filled)
}

/// The level, its standard deviation, a bar up to full scale, and whether it was clipped or lost samples.
pub fn level_line(reading: &Reading, identity: &ReceiverIdentity, width: usize) -> String {
    let ReceiverIdentity { full_scale, unit, .. } = identity;
    let bar = bar(reading.mean / full_scale, width);
    let clipped = if reading.clipped { "  CLIPPED" } else { "" };
    let lost = match reading.gaps {
        0 => String::new(),
        gaps => format!("  {gaps} lost"),
    };
    format!(
        "{:>9.5} {unit} ± {:.5}  ▕{bar}▏ {full_scale} {unit}{clipped}{lost}",
        reading.mean, reading.std
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_grows_by_eighths_and_keeps_its_width() {
        assert_eq!(bar(0.0, 4), "    ");
        assert_eq!(bar(1.0, 4), "████");
        assert_eq!(bar(0.5, 4), "██  ");
        assert_eq!(bar(0.28125, 4), "█▏  ");
        assert_eq!(bar(f64::NAN, 2), "  ");
        for share in [-1.0, 0.1, 0.33, 0.77, 0.999, 3.0] {
            assert_eq!(bar(share, 7).chars().count(), 7, "{share}");
        }
    }

    #[test]
    fn the_line_shows_clipping_and_loss() {
        let identity = ReceiverIdentity {
            rate_hz: 1000.0,
            full_scale: 5.0,
            unit: "V".into(),
            own_clock: true,
            phase: false,
        };
        let reading = Reading {
            mean: 2.5,
            phase_rad: None,
            std: 0.0125,
            count: 16,
            clipped: true,
            gaps: 2,
            first_t_s: 0.0,
            last_t_s: 0.1,
        };
        assert_eq!(
            level_line(&reading, &identity, 8),
            "  2.50000 V ± 0.01250  ▕████    ▏ 5 V  CLIPPED  2 lost"
        );
    }
}
