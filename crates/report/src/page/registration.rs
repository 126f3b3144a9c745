//! How the scan was registered to the simulation.

use maud::{Markup, html};

use super::super::words::{listed, parameter, sentence};
use super::html::facts;
use fieldgap_comparison::{
    Estimate, Mirror, Registering, Registration, TriedRegistration, Uncertain,
    UndeterminedCombination,
};
use fieldgap_text::{fixed, percent, uncertain};

/// What was estimated, with its errors, the alternatives, and what the data do not determine.
pub(crate) fn registration(registration: &Registration, unit: &str) -> Markup {
    html! {
        h3 { "Registration" }
        p { "Chosen: " (name(registration.chosen)) ". " (sentence(&registration.why)) }
        (estimates(registration, unit))
        @if registration.tried.len() > 1 { (alternatives(&registration.tried)) }
        @if !registration.undetermined.is_empty() {
            h3 { "What these data do not determine separately" }
            ul { @for combination in &registration.undetermined { (undetermined(combination)) } }
        }
    }
}

fn undetermined(combination: &UndeterminedCombination) -> Markup {
    let parameters: Vec<String> =
        combination.parameters.iter().map(|name| parameter(name)).collect();
    html! { li { strong { (listed(&parameters)) } ": " (sentence(&combination.explanation)) } }
}

fn estimates(registration: &Registration, unit: &str) -> Markup {
    let [x, y, z] = registration.shift_m;
    let per_unit = if unit.is_empty() { "reading" } else { unit };
    let row = |label: &'static str, estimate: Estimate, factor: f64, unit: &str| {
        (label, html! { (estimated(estimate, factor, unit)) })
    };
    let mirror = match registration.mirror {
        Mirror::None => "none: the scan has the array's handedness",
        Mirror::X => "the scan's x axis is opposite to the array's",
        Mirror::Y => "the scan's y axis is opposite to the array's",
    };
    let face = match registration.receiver_face_m {
        Some(face) => row("Receiver directivity, radius of the piston face", face, 1e3, "mm"),
        None => ("Receiver directivity", html! { "one gain for all angles" }),
    };
    facts([
        row("Gain", registration.gain, 1.0, &format!("{per_unit} per unit of the simulation")),
        face,
        ("Mirror", html! { (mirror) }),
        row("Rotation about z", registration.turn_rad, 180.0 / std::f64::consts::PI, "\u{b0}"),
        row("True step divided by recorded step", registration.step_ratio, 1.0, ""),
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
        format!("{number}{unit}, fixed")
    }
}

fn alternatives(tried: &[TriedRegistration]) -> Markup {
    let columns = [
        "Registration",
        "shift x, y, z (mm)",
        "rotation (\u{b0})",
        "step ratio",
        "mirror",
        "correlation",
        "residual",
    ];
    html! {
        div class="wide" {
            table {
                thead { tr { @for words in columns { th scope="col" { (words) } } } }
                tbody {
                    @for one in tried {
                        tr {
                            th scope="row" { (name(one.registering)) }
                            @for words in cells(one) { td { (words) } }
                        }
                    }
                }
            }
        }
    }
}

fn cells(one: &TriedRegistration) -> [String; 6] {
    let shift_mm = one.pose.shift_m * 1e3;
    let mirror = match one.pose.mirror {
        Mirror::None => "none",
        Mirror::X => "x",
        Mirror::Y => "y",
    };
    [
        format!("{}, {}, {}", fixed(shift_mm.x, 2), fixed(shift_mm.y, 2), fixed(shift_mm.z, 2)),
        fixed(one.pose.turn_rad.to_degrees(), 2),
        fixed(one.pose.step_ratio, 4),
        mirror.to_owned(),
        fixed(one.correlation, 3),
        percent(one.residual_rms_ratio),
    ]
}

fn name(registering: Registering) -> &'static str {
    match registering {
        Registering::None => "none",
        Registering::GainOnly => "gain only",
        Registering::GainAndShift => "gain and a small shift",
        Registering::Shift => "gain and any shift",
        Registering::Pose => "gain and full pose",
        Registering::Auto => "chosen by the data",
    }
}
