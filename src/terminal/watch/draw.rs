//! Drawing the view of a running scan.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

use super::map::Map;
use super::palette::Palette;
use super::view::{ScanView, Stage};
use crate::terminal::level::bar;

/// Width of the figures next to the map, columns.
const FIGURES: u16 = 30;

/// Height of the notes with their frame, rows.
const NOTES: u16 = 7;

/// Draws the view at an instant on a whole frame.
pub fn draw(view: &ScanView, now: Duration, palette: Palette, frame: &mut Frame<'_>) {
    let rows = Layout::vertical([
        Constraint::Length(1),
        Constraint::Min(4),
        Constraint::Length(NOTES),
        Constraint::Length(1),
    ]);
    let [head, body, notes, keys] = rows.areas(frame.area());
    let columns = Layout::horizontal([Constraint::Min(10), Constraint::Length(FIGURES)]);
    let [map, figures] = columns.areas(body);
    frame.render_widget(Paragraph::new(heading(view, now)), head);
    match &view.in_rounds {
        Some(in_rounds) => in_rounds.draw(map, frame),
        None => draw_map(view, palette, map, frame),
    }
    let beside = Paragraph::new(figure_lines(view, now)).block(Block::bordered());
    frame.render_widget(beside, figures);
    draw_notes(view, notes, frame);
    frame.render_widget(Paragraph::new(key_line(view)), keys);
    if view.asks_abort {
        draw_question(frame);
    }
}

fn heading(view: &ScanView, now: Duration) -> Line<'static> {
    let (word, colour) = match view.stage {
        Stage::Homing => ("homing", Color::Cyan),
        Stage::Scanning => ("scanning", Color::Green),
        Stage::Pausing => ("pausing", Color::Yellow),
        Stage::Paused => ("PAUSED, array silent", Color::Yellow),
        Stage::Ending => ("ending", Color::Yellow),
        Stage::Ended(None) => ("complete", Color::Green),
        Stage::Ended(Some(_)) => ("ENDED EARLY", Color::Red),
    };
    Line::from(vec![
        Span::from(" fieldgap ").reversed(),
        Span::from(format!(" {}  ", view.name)).bold(),
        Span::styled(word, Style::new().fg(colour).bold()),
        Span::from(format!("  for {}", clock(now))).dim(),
    ])
}

fn draw_map(view: &ScanView, palette: Palette, area: Rect, frame: &mut Frame<'_>) {
    let sheets = view.sheets.all();
    let Some(sheet) = sheets.get(view.shown()) else {
        frame.render_widget(Block::bordered().title(" no points "), area);
        return;
    };
    let title = format!(" {} ({} of {}) ", sheet.label, view.shown() + 1, sheets.len());
    let largest = sheet.largest();
    let top = largest.filter(|&top| top > 0.0).unwrap_or(1.0);
    let scale = largest.map_or_else(String::new, |top| format!(" up to {top:.4} {} ", view.unit));
    let block = Block::bordered().title(title).title_bottom(scale);
    let inside = block.inner(area);
    frame.render_widget(block, area);
    frame.render_widget(Map { sheet, top, palette }, inside);
}

fn figure_lines(view: &ScanView, now: Duration) -> Vec<Line<'static>> {
    let width = usize::from(FIGURES) - 2;
    let share = view.done as f64 / view.of.max(1) as f64;
    let named = |name: &'static str, value: String| {
        Line::from(vec![Span::from(format!("{name:<10}")).dim(), Span::from(value)])
    };
    let mut lines = vec![
        Line::from(bar(share, width)).fg(Color::Green),
        named("points", format!("{} of {} ({:.0} %)", view.done, view.of, share * 100.0)),
        named("time left", view.time_left(now).map_or("…".to_owned(), clock)),
        Line::default(),
    ];
    let reading = match view.reading {
        Some(reading) => format!("{reading:.5} {}", view.unit),
        None => "…".to_owned(),
    };
    lines.push(named("level", reading));
    lines.push(Line::from(bar(view.reading.unwrap_or(0.0) / view.full_scale, width)));
    let emitting = match (view.at_mm, view.focus) {
        (None, _) => "…".to_owned(),
        (Some(_), None) => "array silent".to_owned(),
        (Some(_), Some(focus)) => format!("focus {focus}"),
    };
    lines.push(named("drive", emitting));
    let axes = view.at_mm.map(|at_mm| at_mm.map(|mm| format!("{mm:.2} mm")));
    let [x, y, z] = axes.unwrap_or_else(|| ["…", "…", "…"].map(str::to_owned));
    lines.extend([named("x", x), named("y", y), named("z", z), Line::default()]);
    let (drift, ago) = match view.drift {
        None => ("no reference yet".to_owned(), String::new()),
        Some(drift) => (
            format!("{:+.2} %", drift.percent()),
            format!("{} ago", clock(now.saturating_sub(drift.at))),
        ),
    };
    lines.extend([named("drift", drift), named("", ago)]);
    let faults = named("faults", view.faults.to_string());
    lines.push(if view.faults > 0 { faults.fg(Color::Red) } else { faults });
    lines
}

fn draw_notes(view: &ScanView, area: Rect, frame: &mut Frame<'_>) {
    let room = usize::from(area.height.saturating_sub(2));
    let latest = view.notes.len().saturating_sub(room);
    let lines: Vec<Line<'_>> = view
        .notes
        .iter()
        .skip(latest)
        .map(|note| {
            let line = Line::from(format!("{:>9}  {}", clock(note.at), note.text));
            if note.alarming { line.fg(Color::Red).add_modifier(Modifier::BOLD) } else { line }
        })
        .collect();
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" events ")), area);
}

fn key_line(view: &ScanView) -> Line<'static> {
    let waiting = match view.stage {
        Stage::Scanning => vec![("p", "pause")],
        Stage::Pausing | Stage::Paused => vec![("r", "resume")],
        _ => vec![],
    };
    let ending = match view.stage {
        Stage::Ending | Stage::Ended(_) => vec![],
        _ => vec![("a", "abort")],
    };
    let looking = match view.sheets.all().len() {
        0 | 1 => vec![],
        _ => vec![("←→", "other planes"), ("f", "follow the scan")],
    };
    let spans = waiting.into_iter().chain(ending).chain(looking).flat_map(|(key, what)| {
        [Span::from(format!(" {key} ")).reversed(), Span::from(format!(" {what}  "))]
    });
    Line::from(spans.collect::<Vec<_>>())
}

fn draw_question(frame: &mut Frame<'_>) {
    let area = frame.area();
    let (width, height) = (area.width.min(50), area.height.min(5));
    let middle = Rect {
        x: area.x + (area.width - width) / 2,
        y: area.y + (area.height - height) / 2,
        width,
        height,
    };
    let question =
        "End the scan? All readings are kept, and `fieldgap resume` can complete it.  y / n";
    let words = Paragraph::new(question)
        .wrap(Wrap { trim: true })
        .alignment(Alignment::Center)
        .block(Block::bordered().title(" abort ").fg(Color::Yellow));
    frame.render_widget(Clear, middle);
    frame.render_widget(words, middle);
}

/// Hours, minutes and seconds.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    let (hours, minutes) = (seconds / 3600, seconds / 60 % 60);
    format!("{hours}:{minutes:02}:{:02}", seconds % 60)
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

    use super::super::view::tests::{measured, view};
    use super::*;
    use fieldgap_acquisition::Event;

    fn terminal(
        view: &ScanView,
        palette: Palette,
        (width, height): (u16, u16),
    ) -> Terminal<TestBackend> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("memory");
        let now = Duration::from_secs(70);
        terminal.draw(|frame| draw(view, now, palette, frame)).expect("memory takes it");
        terminal
    }

    fn picture(view: &ScanView, palette: Palette) -> String {
        terminal(view, palette, (80, 24)).backend().to_string()
    }

    /// Half of the first plane, measured as a round hill.
    fn half_done() -> ScanView {
        let mut view = view();
        view.take(&Event::Homed, Duration::from_secs(10));
        measured(&mut view, 0, 2.0, 11);
        for row in 1..61 {
            let (x, y) = ((row - 1) % 11, (row - 1) / 11);
            let x = if y % 2 == 1 { 10 - x } else { x };
            let away = (x as f64 - 5.0).powi(2) + (y as f64 - 5.0).powi(2);
            measured(&mut view, row, 2.2 * (-away / 12.0).exp(), 11 + row as u64);
        }
        let text = "row 40, 3 samples were lost on their way".to_owned();
        view.take(&Event::ImpairedReading { row: 40, text }, Duration::from_secs(52));
        view
    }

    #[test]
    fn before_it_begins() {
        insta::assert_snapshot!(picture(&view(), Palette::Plain));
    }

    #[test]
    fn half_a_plane_measured() {
        insta::assert_snapshot!(picture(&half_done(), Palette::Plain));
    }

    #[test]
    fn the_rounds_of_a_closed_loop() {
        let mut view = half_done();
        view.in_rounds = Some(super::super::rounds::tests::loop_view());
        insta::assert_snapshot!(picture(&view, Palette::Plain));
        terminal(&view, Palette::Plain, (1, 1));
    }

    #[test]
    fn it_asks_before_it_ends() {
        let mut view = half_done();
        view.take(&Event::Paused, Duration::from_secs(69));
        view.key(KeyEvent::new(KeyCode::Char('a'), KeyModifiers::NONE));
        insta::assert_snapshot!(picture(&view, Palette::Plain));
    }

    #[test]
    fn the_map_has_the_colours_of_its_readings() {
        let view = half_done();
        let terminal = terminal(&view, Palette::True, (80, 24));
        let cells = terminal.backend().buffer();
        let pixels: Vec<(Color, Color)> = cells
            .content()
            .iter()
            .filter(|cell| cell.symbol() == "▀")
            .map(|cell| (cell.fg, cell.bg))
            .collect();
        let top = Palette::True.colour(1.0);
        assert!(pixels.iter().any(|&(upper, lower)| upper == top || lower == top));
        let unmeasured = Palette::True.unmeasured();
        assert!(pixels.iter().any(|&(upper, _)| upper == unmeasured));
        // 11 x 11 cells of two pixels each: 22 columns, 11 lines.
        assert_eq!(pixels.len(), 22 * 11);
    }

    #[test]
    fn any_size_of_terminal_works() {
        for size in [(1, 1), (12, 4), (31, 9), (300, 90)] {
            let mut view = half_done();
            view.key(KeyEvent::new(KeyCode::Char('a'), KeyModifiers::NONE));
            terminal(&view, Palette::Indexed, size);
        }
    }

    #[test]
    fn hours_do_not_wrap() {
        assert_eq!(clock(Duration::from_secs(100 * 3600 + 61)), "100:01:01");
    }
}
