//! The marks of a series, one shape and one dash each, so that no reader depends on the colours.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use fieldgap_acoustics::Simulator;

use fieldgap_canvas::{BLACK, Canvas, CanvasError, Pen, Point, Rgb, WHITE};

/// The source of the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Series {
    Scan,
    Simulated(Simulator),
    /// Of any number of series, counted from 0; five look different.
    Numbered(usize),
}

/// How a series is drawn.
struct Look {
    /// Corners of its mark; many make a circle.
    corners: u32,
    /// Direction of the first corner, radians.
    turn: f64,
    /// Distance of the corners, so that all marks look equally large.
    reach: f64,
    /// From the palette of Okabe and Ito, which colour-blind readers can distinguish.
    colour: Rgb,
    /// Lengths of dash and gap, CSS pixels; none for a solid line.
    dash: &'static [f64],
}

/// Circle, solid.
const SCAN: Look = Look { corners: 32, turn: 0.0, reach: 1.0, colour: BLACK, dash: &[] };

/// Of the simulators, in the order of [`Simulator::ALL`]: square, diamond, triangle, hexagon, triangle on its
/// corner, pentagon, octagon.
const SIMULATED: [Look; 7] = [
    Look { corners: 4, turn: FRAC_PI_4, reach: 1.25, colour: (213, 94, 0), dash: &[8.0, 4.0] },
    Look { corners: 4, turn: 0.0, reach: 1.35, colour: (0, 114, 178), dash: &[2.0, 3.0] },
    Look {
        corners: 3,
        turn: -FRAC_PI_2,
        reach: 1.45,
        colour: (0, 130, 96),
        dash: &[9.0, 3.0, 2.0, 3.0],
    },
    Look { corners: 6, turn: 0.0, reach: 1.1, colour: (204, 121, 167), dash: &[4.0, 2.0] },
    Look { corners: 3, turn: FRAC_PI_2, reach: 1.45, colour: (150, 105, 0), dash: &[12.0, 3.0] },
    Look { corners: 5, turn: -FRAC_PI_2, reach: 1.15, colour: (86, 180, 233), dash: &[6.0, 6.0] },
    Look { corners: 8, turn: 0.0, reach: 1.05, colour: (110, 110, 110), dash: &[2.0, 6.0] },
];

impl Series {
    /// Its name in a legend.
    pub fn name(self) -> String {
        match self {
            Self::Scan => "scan".to_owned(),
            Self::Simulated(simulator) => format!("simulation ({simulator})"),
            Self::Numbered(number) => format!("{}", number + 1),
        }
    }

    fn look(self) -> &'static Look {
        match self {
            Self::Scan => &SCAN,
            Self::Simulated(simulator) => {
                let place = Simulator::ALL.iter().position(|&other| other == simulator);
                &SIMULATED[place.unwrap_or(0) % SIMULATED.len()]
            }
            Self::Numbered(number) => match number % (SIMULATED.len() + 1) {
                0 => &SCAN,
                more => &SIMULATED[more - 1],
            },
        }
    }

    /// Its colour.
    pub fn colour(self) -> Rgb {
        self.look().colour
    }

    /// Lengths of dash and gap of its line, CSS pixels; none for a solid line.
    pub fn dash(self) -> &'static [f64] {
        self.look().dash
    }

    /// Corners of its mark about a point.
    fn corners(self, (x, y): Point, radius: f64) -> Vec<Point> {
        let look = self.look();
        (0..look.corners)
            .map(|corner| {
                let angle = look.turn + TAU * f64::from(corner) / f64::from(look.corners);
                let reach = look.reach * radius;
                (x + reach * angle.cos(), y + reach * angle.sin())
            })
            .collect()
    }

    /// The mark on a map: an open shape, white in black, visible on every colour; what it marks shows through.
    pub fn mark_on_map(self, canvas: &mut Canvas, at: Point) -> Result<(), CanvasError> {
        let corners = self.corners(at, 8.0);
        canvas.outline(&corners, Pen { colour: BLACK, width: 4.5 })?;
        canvas.outline(&corners, Pen { colour: WHITE, width: 2.0 })
    }

    /// The mark on a curve: filled, or open for a value with a caveat.
    pub fn mark_on_curve(
        self,
        canvas: &mut Canvas,
        at: Point,
        filled: bool,
    ) -> Result<(), CanvasError> {
        let corners = self.corners(at, 5.0);
        canvas.fill(&corners, if filled { self.colour() } else { WHITE })?;
        canvas.outline(&corners, Pen { colour: self.colour(), width: 1.5 })
    }
}

/// An error bar with a stroke at each end.
pub(super) fn error_bar(
    canvas: &mut Canvas,
    [low, high]: [Point; 2],
    pen: Pen,
) -> Result<(), CanvasError> {
    const HALF_A_STROKE: f64 = 3.5;
    canvas.line(low, high, pen)?;
    for (x, y) in [low, high] {
        canvas.line((x - HALF_A_STROKE, y), (x + HALF_A_STROKE, y), pen)?;
    }
    Ok(())
}

/// A dot.
pub(super) fn dot(
    canvas: &mut Canvas,
    at: Point,
    radius: f64,
    colour: Rgb,
) -> Result<(), CanvasError> {
    regular(canvas, at, radius, colour, 12)
}

/// A triangle, its corner up.
pub(super) fn triangle(
    canvas: &mut Canvas,
    at: Point,
    radius: f64,
    colour: Rgb,
) -> Result<(), CanvasError> {
    regular(canvas, at, radius, colour, 3)
}

/// A square on its corner.
pub(super) fn diamond(
    canvas: &mut Canvas,
    at: Point,
    radius: f64,
    colour: Rgb,
) -> Result<(), CanvasError> {
    regular(canvas, at, radius, colour, 4)
}

/// A filled shape of so many equal sides, the first corner at the top.
fn regular(
    canvas: &mut Canvas,
    (x, y): Point,
    radius: f64,
    colour: Rgb,
    corners: u32,
) -> Result<(), CanvasError> {
    let corner = |number: u32| {
        let angle = TAU * f64::from(number) / f64::from(corners) - FRAC_PI_2;
        (x + radius * angle.cos(), y + radius * angle.sin())
    };
    let corners: Vec<Point> = (0..corners).map(corner).collect();
    canvas.fill(&corners, colour)
}

/// The mark of the focus on a map: a diagonal cross, white in black.
pub(super) fn focus_on_map(canvas: &mut Canvas, (x, y): Point) -> Result<(), CanvasError> {
    let strokes = |reach: f64| {
        [
            [(x - reach, y - reach), (x + reach, y + reach)],
            [(x - reach, y + reach), (x + reach, y - reach)],
        ]
    };
    for (reach, pen) in
        [(7.0, Pen { colour: BLACK, width: 4.5 }), (6.0, Pen { colour: WHITE, width: 2.0 })]
    {
        for [from, to] in strokes(reach) {
            canvas.line(from, to, pen)?;
        }
    }
    Ok(())
}
