//! Pictures as PNG and SVG, and moving pictures.

mod animation;
mod axes;
mod bar_chart;
mod change_maps;
mod colour_scale;
mod control_chart;
mod cyclic_scale;
mod display_map;
mod diverging_scale;
mod gap_over_time;
mod height_curves;
mod hologram_maps;
mod map_layout;
mod marker;
mod measured_maps;
mod model_against_integral;
mod noise_scale;
mod over_rounds;
mod panel_row;
mod phase_map;
mod plane_maps;
mod polar_lobe;
mod print;
mod raster;
mod residual_maps;
mod residual_planes;
mod round_places;
mod set_shares;
mod simulated_panels;
mod small_map;
mod study_curves;
mod study_field;
mod study_surfaces;
mod time_axis;
mod transducer_curves;
mod trend_curves;

pub(super) use self::animation::animated;
pub(super) use self::bar_chart::{Bar, BarChart, Weight};
pub(super) use self::change_maps::ChangeMaps;
pub(super) use self::colour_scale::ColourScale;
pub(super) use self::control_chart::ControlChart;
pub(super) use self::display_map::{DisplayMap, DisplayPanel};
pub(super) use self::diverging_scale::DivergingScale;
pub(super) use self::gap_over_time::{GapLine, GapOverTime};
pub(super) use self::height_curves::HeightCurves;
pub(super) use self::hologram_maps::HologramMaps;
pub(super) use self::measured_maps::MeasuredMaps;
pub(super) use self::model_against_integral::ModelCurves;
pub(super) use self::noise_scale::REACH_SIGMA;
pub(super) use self::over_rounds::{OverRounds, RoundFigure};
pub(super) use self::phase_map::PhaseMap;
pub(super) use self::plane_maps::{LEAST_SIGNED_SHARE, PlaneMaps};
pub(super) use self::polar_lobe::PolarLobe;
pub(super) use self::residual_maps::{LEAST_SIGNED_SIGMA, ResidualMaps, rms};
pub(super) use self::residual_planes::ResidualPlanes;
pub(super) use self::round_places::{PlacesOfRound, RoundPlaces};
pub(super) use self::set_shares::{SetShares, Share};
pub(super) use self::simulated_panels::SimulatedPanels;
pub(super) use self::small_map::small_map;
pub(super) use self::study_curves::StudyCurves;
pub(super) use self::study_field::StudyField;
pub(super) use self::study_surfaces::StudySurfaces;
pub(super) use self::transducer_curves::TransducerCurves;
pub(super) use self::trend_curves::{TrendCurves, TrendPoint};
pub(super) use fieldgap_canvas::Rgb;

pub use self::print::{PrintStyle, PrintStyleError};

use fieldgap_canvas::{Canvas, CanvasError, OVERSAMPLING, bitmap};

/// PNG pixels in a CSS pixel: sharp on a screen of double density and on paper.
const PNG_DENSITY: u32 = 2;

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// It could not be drawn, or its pixels could not be encoded.
    #[error(transparent)]
    Canvas(#[from] CanvasError),
    /// The pictures of an animation could not be encoded.
    #[error("encoding a picture as PNG failed")]
    Png(#[from] png::EncodingError),
    /// The width has no room for the picture with letters of this size.
    #[error(
        "a picture {width_mm} mm wide has no room for letters of {font_pt:.1} pt: it takes at least {least_mm:.0} mm. Choose a \
         larger --width-mm or a smaller --font-pt"
    )]
    TooNarrow {
        /// What was asked for.
        width_mm: f64,
        /// Size of the letters.
        font_pt: f64,
        /// What is possible with these letters.
        least_mm: f64,
    },
    /// The picture has more pixels than are drawn.
    #[error(
        "a picture of {pixels:.1e} pixels is too large: choose a smaller --dpi or --width-mm, for at most {most:.0e}"
    )]
    TooLarge {
        /// What was asked for.
        pixels: f64,
        /// What is possible.
        most: f64,
    },
}

/// Something to draw.
pub(super) trait Picture {
    /// Width and height, CSS pixels.
    fn size(&self) -> (u32, u32);

    /// A description for readers who cannot see it.
    fn description(&self) -> String;

    /// Lays it out anew for another width, CSS pixels.
    ///
    /// # Errors
    /// The least width that it takes.
    fn fit(&mut self, _width: f64) -> Result<(), f64> {
        Err(f64::from(self.size().0))
    }

    /// Draws it.
    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError>;
}

/// A drawn picture.
pub(super) struct Drawn {
    /// Width and height on a page, CSS pixels.
    pub size: (u32, u32),
    /// What it shows.
    pub description: String,
    /// The PNG file, twice as wide and high as `size` unless a resolution was asked for.
    pub png: Vec<u8>,
    /// The SVG file.
    pub svg: String,
}

impl Drawn {
    /// Draws a picture in both formats.
    pub fn new(picture: &impl Picture) -> Result<Self, PictureError> {
        Ok(Self {
            size: picture.size(),
            description: picture.description(),
            png: png(picture)?,
            svg: svg(picture, None)?,
        })
    }

    /// Draws a picture in both formats, as it is to be printed.
    pub fn printed(mut picture: impl Picture, style: PrintStyle) -> Result<Self, PictureError> {
        if style == PrintStyle::default() {
            return Self::new(&picture);
        }
        if let Some(width) = style.layout_width() {
            picture.fit(width).map_err(|least| style.too_narrow(least))?;
        }
        Ok(Self {
            size: style.size(picture.size()),
            description: picture.description(),
            png: print::png(&picture, style)?,
            svg: svg(&picture, Some(style))?,
        })
    }
}

/// A picture as an SVG file alone: much sooner drawn than its pixels.
pub(super) fn svg_file(picture: &impl Picture) -> Result<String, PictureError> {
    svg(picture, None)
}

fn png(picture: &impl Picture) -> Result<Vec<u8>, PictureError> {
    let small = pixels(picture, PNG_DENSITY)?;
    Ok(fieldgap_canvas::png(small.as_raw(), small.dimensions())?)
}

/// A picture in so many pixels to a CSS pixel, drawn large and made smaller, so that its edges are smooth.
fn pixels(picture: &impl Picture, density: u32) -> Result<image::RgbImage, PictureError> {
    let (width, height) = picture.size();
    let size_px = (width * density, height * density);
    Ok(bitmap(size_px, f64::from(density), OVERSAMPLING / density, |canvas| picture.draw(canvas))?)
}

fn svg(picture: &impl Picture, style: Option<PrintStyle>) -> Result<String, PictureError> {
    let (width, height) = picture.size();
    let (file, (large_width, large_height)) =
        fieldgap_canvas::svg((width, height), |canvas| picture.draw(canvas))?;
    // The `viewBox` keeps the fine coordinates; the size goes back to CSS pixels, or to millimetres.
    let large = format!("width=\"{large_width}\" height=\"{large_height}\"");
    let true_size = match style {
        None => format!("width=\"{width}\" height=\"{height}\""),
        Some(style) => {
            let [width_mm, height_mm] = style.size_mm((width, height));
            format!("width=\"{width_mm}mm\" height=\"{height_mm}mm\"")
        }
    };
    Ok(file.replacen(&large, &true_size, 1))
}
