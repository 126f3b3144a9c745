//! Drawing the view of a jogged robot.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Wrap};

use super::state::{Doing, Jog};
use crate::terminal::level::level_line;

/// Width of the line that shows the position along an axis, in cells.
const TRACK: usize = 31;

/// Keys and their functions.
const KEYS: [(&str, &str); 8] = [
    ("←→", "x"),
    ("↓↑", "y"),
    ("PgDn PgUp", "z"),
    ("- +", "step"),
    ("h", "home"),
    ("f", "focus"),
    ("space", "stop"),
    ("q", "quit"),
];

/// Draws the view on a whole frame.
pub fn draw(jog: &Jog, frame: &mut Frame<'_>) {
    let rows = Layout::vertical([
        Constraint::Length(7),
        Constraint::Length(4),
        Constraint::Min(3),
        Constraint::Length(1),
    ]);
    let [axes, level, said, keys] = rows.areas(frame.area());
    let title = format!(" fieldgap rig jog: {} ", jog.title);
    frame
        .render_widget(Paragraph::new(axis_lines(jog)).block(Block::bordered().title(title)), axes);
    frame.render_widget(
        Paragraph::new(level_lines(jog)).block(Block::bordered().title(" level ")),
        level,
    );
    frame.render_widget(Paragraph::new(state_lines(jog)).wrap(Wrap { trim: true }), said);
    frame.render_widget(Paragraph::new(key_line()), keys);
}

fn axis_lines(jog: &Jog) -> Vec<Line<'static>> {
    let at = match jog.doing {
        Doing::Standing(at) => Some(at),
        Doing::Moving { to, .. } => Some(to),
        Doing::NotHomed | Doing::Homing => None,
    };
    let heading = format!("  {:>10} {:>10}   {}", "robot", "array", "travel, mm");
    let mut lines = vec![Line::from(heading).add_modifier(Modifier::DIM)];
    for (number, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let [least_mm, largest_mm] =
            [jog.envelope.travel.least_m, jog.envelope.travel.largest_m].map(|m| m[number] * 1e3);
        let (robot, array, share) = match at {
            None => ("?".to_owned(), "?".to_owned(), None),
            Some(at) => {
                let robot_mm = at.axes_mm()[number];
                let array_mm = jog.frame.to_array(at)[number] * 1e3;
                let share = (robot_mm - least_mm) / (largest_mm - least_mm);
                (format!("{robot_mm:.2}"), format!("{array_mm:.2}"), Some(share))
            }
        };
        lines.push(Line::from(vec![
            Span::from(format!("{axis} ")).bold(),
            Span::from(format!("{robot:>10} {array:>10}   ")),
            Span::from(format!("{least_mm:>7.1} {} {largest_mm:.1}", track(share))),
        ]));
    }
    lines.push(Line::from(vec![
        Span::from("step ").bold(),
        Span::from(format!("{} mm", jog.step_mm())),
    ]));
    lines
}

/// A line with a mark at the position of the robot.
fn track(share: Option<f64>) -> String {
    let mark = share.map(|share| (share.clamp(0.0, 1.0) * (TRACK - 1) as f64).round() as usize);
    (0..TRACK).map(|cell| if Some(cell) == mark { '●' } else { '─' }).collect()
}

fn level_lines(jog: &Jog) -> Vec<Line<'static>> {
    let Some(receiver) = &jog.receiver else {
        return vec![Line::from("no receiver").add_modifier(Modifier::DIM)];
    };
    let level = match &jog.level {
        None => "…".to_owned(),
        Some(reading) => level_line(reading, receiver, 24),
    };
    let array = match jog.emitting {
        None => Span::from("silent by this program").dim(),
        Some(false) => Span::from("array silent, f switches it on"),
        Some(true) => Span::styled("ARRAY EMITS", Style::new().fg(Color::Yellow).bold()),
    };
    let highest = format!("highest {:.5} {}   ", jog.highest, receiver.unit);
    vec![Line::from(level), Line::from(vec![Span::from(highest), array])]
}

fn state_lines(jog: &Jog) -> Vec<Line<'static>> {
    let doing = match jog.doing {
        Doing::NotHomed => Span::styled("not homed", Style::new().fg(Color::Yellow).bold()),
        Doing::Homing => Span::from("homing").bold(),
        Doing::Standing(_) => Span::from("standing still").fg(Color::Green).bold(),
        Doing::Moving { to, .. } => Span::from(format!("moving to {to}")).bold(),
    };
    vec![Line::from(doing), Line::from(jog.said.clone())]
}

fn key_line() -> Line<'static> {
    let spans = KEYS.iter().flat_map(|(key, what)| {
        [Span::from((*key).to_owned()).reversed(), Span::from(format!(" {what}  "))]
    });
    Line::from(spans.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::super::state::tests::jog;
    use super::*;
    use fieldgap_rig::{Reading, RobotPosition};

    fn picture(jog: &Jog, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("memory");
        terminal.draw(|frame| draw(jog, frame)).expect("memory takes it");
        terminal.backend().to_string()
    }

    #[test]
    fn before_homing_nothing_is_claimed() {
        insta::assert_snapshot!(picture(&jog(), 80, 16));
    }

    #[test]
    fn where_it_stands_and_what_it_hears() {
        let mut jog = jog();
        jog.arrived(RobotPosition::from_axes_mm([150.0, 75.0, 120.0]));
        jog.emits(true);
        jog.heard(Ok(Reading {
            mean: 1.25,
            phase_rad: None,
            std: 0.011,
            count: 16,
            clipped: false,
            gaps: 0,
            first_t_s: 0.0,
            last_t_s: 0.1,
        }));
        insta::assert_snapshot!(picture(&jog, 80, 16));
    }

    #[test]
    fn any_size_of_terminal_works() {
        for (width, height) in [(1, 1), (10, 3), (200, 60)] {
            picture(&jog(), width, height);
        }
    }
}
