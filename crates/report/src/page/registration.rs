//! How scan and simulation were brought together.

use super::super::words::{listed, parameter, sentence};
use super::html::{Html, element, facts, paragraph, text};
use fieldgap_comparison::{
    Estimate, Mirror, Registering, Registration, TriedRegistration, Uncertain,
};
use fieldgap_text::{fixed, percent, uncertain};

/// What was estimated, with its errors, what was tried, and what the data cannot tell.
pub(crate) fn registration(registration: &Registration, unit: &str) -> Vec<Html> {
    let mut content = vec![
        element("h3", &[], [text("Registration")]),
        paragraph(&format!(
            "Chosen: {}. {}",
            name(registration.chosen),
            sentence(&registration.why)
        )),
        estimates(registration, unit),
    ];
    if registration.tried.len() > 1 {
        content.push(tried(&registration.tried));
    }
    if !registration.undetermined.is_empty() {
        content.push(element("h3", &[], [text("What these data cannot tell apart")]));
        let items = registration.undetermined.iter().map(|combination| {
            let parameters: Vec<String> =
                combination.parameters.iter().map(|name| parameter(name)).collect();
            element(
                "li",
                &[],
                [
                    element("strong", &[], [text(&listed(&parameters))]),
                    text(&format!(": {}", sentence(&combination.explanation))),
                ],
            )
        });
        content.push(element("ul", &[], items));
    }
    content
}

fn estimates(registration: &Registration, unit: &str) -> Html {
    let [x, y, z] = registration.shift_m;
    let per_unit = if unit.is_empty() { "reading" } else { unit };
    let row = |label: &str, estimate: Estimate, factor: f64, unit: &str| {
        (text(label), text(&estimated(estimate, factor, unit)))
    };
    let mirror = match registration.mirror {
        Mirror::None => "none: the scan has the array's handedness",
        Mirror::X => "the scan's x axis runs against the array's",
        Mirror::Y => "the scan's y axis runs against the array's",
    };
    let face = match registration.receiver_face_m {
        Some(face) => row("Gain falls off with the angle as of a face of radius", face, 1e3, "mm"),
        None => (text("Gain and angle of arrival"), text("one gain for all angles")),
    };
    facts([
        row("Gain", registration.gain, 1.0, &format!("{per_unit} per unit of the simulation")),
        face,
        (text("Mirror"), text(mirror)),
        row("Turn about z", registration.turn_rad, 180.0 / std::f64::consts::PI, "\u{b0}"),
        row("True step over recorded step", registration.step_ratio, 1.0, ""),
        row("Scan's origin in the array's frame, x", x, 1e3, "mm"),
        row("Scan's origin in the array's frame, y", y, 1e3, "mm"),
        row("Scan's origin in the array's frame, z", z, 1e3, "mm"),
    ])
}

fn estimated(estimate: Estimate, factor: f64, unit: &str) -> String {
    let number = uncertain(Uncertain {
        value: estimate.value * factor,
        standard_error: if estimate.estimated { estimate.standard_error * factor } else { 0.0 },
    });
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    if estimate.estimated {
        format!("{number}{unit}, estimated from the data")
    } else {
        format!("{number}{unit}, held")
    }
}

fn tried(tried: &[TriedRegistration]) -> Html {
    let header = [
        "Tried",
        "shift x, y, z (mm)",
        "turn (\u{b0})",
        "step ratio",
        "mirror",
        "correlation",
        "residual",
    ];
    let head = header.map(|words| element("th", &[("scope", "col")], [text(words)]));
    let rows = tried.iter().map(|one| {
        let shift_mm = one.pose.shift_m * 1e3;
        let mirror = match one.pose.mirror {
            Mirror::None => "none",
            Mirror::X => "x",
            Mirror::Y => "y",
        };
        let cells = [
            format!("{}, {}, {}", fixed(shift_mm.x, 2), fixed(shift_mm.y, 2), fixed(shift_mm.z, 2)),
            fixed(one.pose.turn_rad.to_degrees(), 2),
            fixed(one.pose.step_ratio, 4),
            mirror.to_owned(),
            fixed(one.correlation, 3),
            percent(one.residual_rms_ratio),
        ];
        let label = element("th", &[("scope", "row")], [text(name(one.registering))]);
        let cells = cells.iter().map(|cell| element("td", &[], [text(cell)]));
        element("tr", &[], std::iter::once(label).chain(cells))
    });
    let table = element(
        "table",
        &[],
        [element("thead", &[], [element("tr", &[], head)]), element("tbody", &[], rows)],
    );
    element("div", &[("class", "wide")], [table])
}

fn name(registering: Registering) -> &'static str {
    match registering {
        Registering::None => "nothing estimated",
        Registering::GainOnly => "gain only",
        Registering::GainAndShift => "gain and a small shift",
        Registering::Pose => "gain and the whole pose",
        Registering::Auto => "chosen by the data",
    }
}
