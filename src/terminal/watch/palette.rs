//! Colours of a level, in the colours that the terminal has.

use plotters::style::colors::colormaps::ViridisRGB;
use ratatui::style::Color;

/// Steps of each channel of the 216 colours that terminals of 256 colours have (xterm).
const CUBE: [u8; 6] = [0, 95, 135, 175, 215, 255];

/// What a terminal can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// Any colour.
    True,
    /// 256 colours.
    Indexed,
    /// No colours.
    Plain,
}

impl Palette {
    /// From the environment variables `NO_COLOR`, `COLORTERM` and `TERM`.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Self {
        if variable("NO_COLOR").is_some_and(|value| !value.is_empty()) {
            return Self::Plain;
        }
        match variable("COLORTERM").as_deref() {
            Some("truecolor" | "24bit") => Self::True,
            _ if variable("TERM").is_some_and(|term| term == "dumb") => Self::Plain,
            _ => Self::Indexed,
        }
    }

    /// The viridis colour of a level from 0 to 1.
    pub(super) fn colour(self, share: f64) -> Color {
        let (red, green, blue) = viridis(share);
        match self {
            Self::True => Color::Rgb(red, green, blue),
            Self::Indexed => {
                let [red, green, blue] = [red, green, blue].map(nearest_step);
                Color::Indexed(16 + 36 * red + 6 * green + blue)
            }
            Self::Plain => Color::Reset,
        }
    }

    /// The colour of points not measured yet.
    pub(super) fn unmeasured(self) -> Color {
        match self {
            Self::True => Color::Rgb(44, 44, 44),
            Self::Indexed => Color::Indexed(236),
            Self::Plain => Color::Reset,
        }
    }
}

fn viridis(share: f64) -> (u8, u8, u8) {
    let colour = ViridisRGB::get_color(if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 });
    (colour.0, colour.1, colour.2)
}

fn nearest_step(channel: u8) -> u8 {
    let nearest = (0..CUBE.len()).min_by_key(|&step| CUBE[step].abs_diff(channel));
    nearest.unwrap_or(0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_decides() {
        let with = |set: &'static [(&str, &str)]| {
            Palette::of_environment(|name| {
                set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
            })
        };
        assert_eq!(with(&[("COLORTERM", "truecolor")]), Palette::True);
        assert_eq!(with(&[("TERM", "xterm-256color")]), Palette::Indexed);
        assert_eq!(with(&[("TERM", "dumb")]), Palette::Plain);
        assert_eq!(with(&[("COLORTERM", "truecolor"), ("NO_COLOR", "1")]), Palette::Plain);
    }

    #[test]
    fn the_ends_are_viridis_violet_and_yellow() {
        assert_eq!(Palette::True.colour(0.0), Color::Rgb(68, 1, 84));
        assert_eq!(Palette::True.colour(9.0), Color::Rgb(254, 232, 37));
        assert_eq!(Palette::True.colour(f64::NAN), Palette::True.colour(0.0));
        // (255, 215, 0) is the cube's nearest to that yellow.
        assert_eq!(Palette::Indexed.colour(1.0), Color::Indexed(16 + 36 * 5 + 6 * 4));
    }
}
