//! The page of two records: one HTML file that needs nothing beside it.

use maud::{Markup, html};

use super::super::context::ReportContext;
use super::super::figure::Figure;
use super::super::html::{self, navigation, section};
use super::super::page::{STYLE, pages, warnings};
use super::super::provenance;
use super::super::words::sentence;
use fieldgap_comparison::{Alignment, Change, FieldFigures, HeightChange, Noise};
use fieldgap_diagnosis::{ChangeCandidate, ChangeDiagnosis, joined};
use fieldgap_text::{
    ABSENT, Uncertain, fixed, height_mm, millimetres, percent, significant, uncertain,
};

/// Candidates of the diagnosis that are listed: those with less probability say nothing.
const LEAST_PROBABILITY: f64 = 1e-3;

/// The page, with the pictures of each height in their order.
pub(super) fn page(
    context: &ReportContext,
    change: &Change,
    cause: Option<&ChangeDiagnosis>,
    figures: &[Option<Figure>],
    files: &[&str],
) -> String {
    let sections = [
        cause.map(|_| ("cause", "Cause")),
        Some(("difference", "Difference")),
        change.alignment.as_ref().map(|_| ("alignment", "Alignment")),
        Some(("maps", "Maps at each height")),
        Some(("tables", "Tables")),
        Some(("conditions", "Conditions")),
        Some(("guide", "How to read this page")),
        Some(("set-up", "Set-up")),
        Some(("provenance", "Provenance")),
    ];
    let body = html! {
        header {
            h1 { (cause.map_or_else(|| change.sentence(), |cause| cause.sentence.clone())) }
            p class="subtitle" {
                "Record B (" (change.b) ") against record A (" (change.a) "), " (change.overall.points) " common places"
            }
        }
        (pages(context))
        (warnings(context))
        main {
            (navigation(sections.into_iter().flatten()))
            @if let Some(cause) = cause { (the_cause(cause)) }
            (difference(change))
            @if let Some(alignment) = &change.alignment { (the_alignment(alignment)) }
            (maps(change, figures))
            (tables(change))
            (conditions(change))
            (guide())
            (provenance::set_up(context, Some(change.overall.points)))
            (provenance::provenance(context, files))
        }
    };
    html::document(&context.title, &[STYLE], &body)
}

fn the_cause(cause: &ChangeDiagnosis) -> Markup {
    let listed = |(n, candidate): &(usize, &ChangeCandidate)| {
        *n == 0 || candidate.probability >= LEAST_PROBABILITY
    };
    let candidates: Vec<&ChangeCandidate> =
        cause.ranked.iter().enumerate().filter(listed).map(|(_, candidate)| candidate).collect();
    let rows = candidates.iter().map(|candidate| {
        vec![
            name(candidate),
            fixed(candidate.probability, 3),
            percent(candidate.explained_fraction),
            significant(candidate.chi_square, 3),
            uncertain(candidate.level),
            candidate.readings.join("; "),
        ]
    });
    let content = html! {
        p {
            "Both records were held against the " (cause.simulator.to_string()) " simulation, in " (cause.pairs)
            " pairs of readings. What the simulation leaves of A at a place is taken for common to both."
        }
        (html::table(
            "What may have changed, the most probable first. Explained: share of the squared change on readings kept out of the fit. χ²: mean \
             squared remainder in units of its variance, 1 for noise alone.",
            &["Effect", "Probability", "Explained", "χ²", "Level B/A", "Change"],
            rows,
        ))
        p {
            "χ² is " (significant(cause.chi_square_unchanged, 3)) " if nothing changed and "
            (significant(cause.chi_square_with_level, 3)) " if the level alone changed."
        }
    };
    section("cause", "Cause", &content)
}

fn name(candidate: &ChangeCandidate) -> String {
    match candidate.effects.is_empty() {
        true => "the level alone".to_owned(),
        false => joined(&candidate.effects, " + "),
    }
}

fn difference(change: &Change) -> Markup {
    let overall = &change.overall;
    let (chi_square, left) = change.beside_the_level();
    let scaled = match change.scale == 1.0 {
        true => "B is compared as read.".to_owned(),
        false => format!("B was divided by {}.", significant(change.scale, 4)),
    };
    let row = |label: &'static str, value: String| (label, html! { (value) });
    let facts = [
        row("Level, B over A", uncertain(overall.gain)),
        row("Difference, of the rms of A", percent(overall.gap)),
        row("Difference with the level taken out", percent(left)),
        row("χ² of a place", significant(overall.chi_square_per_point, 3)),
        row("χ² of a place with the level taken out", significant(chi_square, 3)),
        row("Places beyond 3 standard errors", percent(overall.beyond_three)),
        row("Correlation", fixed(overall.correlation, 4)),
        row("Places interpolated", overall.interpolated.to_string()),
        row("Places left out", change.left_out.to_string()),
        row("Noise of a reading of A", noise(&change.noise_a, &change.unit)),
        row("Noise of a reading of B", noise(&change.noise_b, "")),
    ];
    let content = html! {
        div class="verdict" { p { (change.sentence()) } }
        p { (scaled) }
        (html::facts(facts))
    };
    section("difference", "Difference", &content)
}

fn noise(noise: &Noise, unit: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    format!(
        "{}{unit} and {} of the level",
        significant(noise.additive, 2),
        percent(noise.multiplicative)
    )
}

fn the_alignment(alignment: &Alignment) -> Markup {
    let length = |value: f64, error: f64| match error.is_finite() {
        true => format!("{} mm", millimetres(Uncertain { value, standard_error: error })),
        false => "not determined".to_owned(),
    };
    let [x, y] = alignment.shift_m.map(|of| match of.estimated {
        true => length(of.value, of.standard_error),
        false => "held at 0".to_owned(),
    });
    let turn = match alignment.turn_rad {
        of if of.estimated => format!(
            "{}°",
            uncertain(Uncertain {
                value: of.value.to_degrees(),
                standard_error: of.standard_error.to_degrees(),
            })
        ),
        _ => "held at 0".to_owned(),
    };
    let gap = |gap: Option<f64>| gap.map_or(ABSENT.to_owned(), percent);
    let row = |label: &'static str, value: String| (label, html! { (value) });
    let facts = [
        row("Shift of B along x", x),
        row("Shift of B along y", y),
        row("Turn of B about z", turn),
        row("Places of B within A", percent(alignment.overlap)),
        row("Difference as read", gap(alignment.gap_as_read)),
        row("after the gain", gap(alignment.gap_after_gain)),
        row("after gain and alignment", percent(alignment.gap_after_alignment)),
    ];
    let content = html! {
        p { (sentence(&alignment.why)) }
        (html::facts(facts))
        @for words in &alignment.undetermined { p { "Not determined: " (words) "." } }
    };
    section("alignment", "Alignment", &content)
}

fn maps(change: &Change, figures: &[Option<Figure>]) -> Markup {
    let is_turned = change.alignment.as_ref().is_some_and(|of| of.turn_rad.estimated);
    let content = html! {
        @if is_turned {
            p { "The places of B were turned and lie on no grid along x and y: each cell shows the place nearest to it." }
        }
        @for (height, figure) in change.heights.iter().zip(figures) {
            h3 { (heading(height)) }
            @match figure {
                Some(figure) => { (figure.markup(&html! { p { (caption(height)) } })) }
                None => { p { "No map: the common places lie on no grid. " (caption(height)) } }
            }
        }
    };
    section("maps", "Maps at each height", &content)
}

fn heading(height: &HeightChange) -> String {
    format!("Drive {}, z = {} mm", height.focus, height_mm(height.z_m))
}

fn caption(height: &HeightChange) -> String {
    let of = &height.figures;
    let mut words = format!(
        "{} common places. The difference is {} of the rms of A; χ² {} a place; {} of the places differ by more than 3 standard errors.",
        of.points,
        percent(of.gap),
        significant(of.chi_square_per_point, 3),
        percent(of.beyond_three)
    );
    if let Some(error) = height.interpolation_error {
        words += &format!(" Standard error of the interpolation: {}.", significant(error, 2));
    }
    words
}

fn tables(change: &Change) -> Markup {
    let peak = |of: Option<&FieldFigures>| of.map_or(ABSENT.to_owned(), |of| uncertain(of.peak));
    let radius = |of: Option<&FieldFigures>| {
        let radius = of.and_then(|of| of.focal_radius.as_ref()?.radius_m);
        radius.map_or(ABSENT.to_owned(), millimetres)
    };
    let rows = change.heights.iter().map(|height| {
        let [a, b] = [height.a_figures.as_ref(), height.b_figures.as_ref()];
        vec![
            heading(height),
            uncertain(height.figures.gain),
            peak(a),
            peak(b),
            moved(a, b),
            radius(a),
            radius(b),
        ]
    });
    let caption = format!(
        "Peaks in {}, each record as read; lengths in mm; \u{b1} one standard error.",
        if change.unit.is_empty() { "the receiver's unit" } else { &change.unit }
    );
    let columns = [
        "Drive and height",
        "Level B/A",
        "Peak of A",
        "Peak of B",
        "Peak moved (x, y)",
        "Focal radius of A",
        "Focal radius of B",
    ];
    section("tables", "Tables", &html::table(&caption, &columns, rows))
}

/// How the peak moved along x and y, mm.
fn moved(a: Option<&FieldFigures>, b: Option<&FieldFigures>) -> String {
    let (Some(a), Some(b)) = (a, b) else { return ABSENT.to_owned() };
    let [x, y] = [0, 1].map(|axis| {
        let [from, to] = [a, b].map(|of| of.peak_position_m[axis]);
        millimetres(Uncertain {
            value: to.value - from.value,
            standard_error: to.standard_error.hypot(from.standard_error),
        })
    });
    let at_edge = if a.peak_at_edge || b.peak_at_edge { " (at the edge)" } else { "" };
    format!("{x}, {y}{at_edge}")
}

fn conditions(change: &Change) -> Markup {
    let rows = change
        .conditions
        .iter()
        .map(|condition| vec![condition.what.to_owned(), condition.a.clone(), condition.b.clone()]);
    let explained = match change.explained_by_set_up {
        Some(share) if share > 0.0 => format!(
            "The simulations of the two set-ups predict {} of the squared difference.",
            percent(share)
        ),
        Some(_) => {
            "The simulations of the two set-ups predict another change than the readings show."
                .to_owned()
        }
        None => {
            "Array and air are the same in both set-ups, so that they predict no change.".to_owned()
        }
    };
    let content = html! {
        @if change.conditions.is_empty() { p { "The set-ups are the same." } }
        @else { (html::table("What differs between the set-ups.", &["What", "A", "B"], rows)) }
        p { (explained) }
    };
    section("conditions", "Conditions", &content)
}

fn guide() -> Markup {
    let terms = [
        ("Difference", "Reading of B minus reading of A at one place under one drive."),
        (
            "Standard error",
            "Of a difference: the noise of both readings, and the error of the interpolation where one was interpolated.",
        ),
        (
            "χ²",
            "Mean squared difference in units of its variance: 1 if noise alone makes it. Errors of an interpolation are upper bounds, so that it \
             may be below 1.",
        ),
        (
            "Conditions",
            "What the set-ups say of air, array and drive. What they predict is computed with the simulator of A.",
        ),
    ];
    section("guide", "How to read this page", &html::glossary(terms))
}
