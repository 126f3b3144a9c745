//! Pictures as a journal wants them: a width in millimetres, letters of a size in points, a resolution.

use super::axes::LABEL_TEXT;
use super::{Picture, PictureError, bitmap};

/// Units of one inch.
const MM: f64 = 25.4;
const PT: f64 = 72.0;
const CSS_PX: f64 = 96.0;
/// A label's size is given to the drawing library as this many ems.
const SIZE_OF_EM: f64 = 1.24;
/// PNG resolution where none is asked for: two pixels in a CSS pixel.
const USUAL_DPI: f64 = 2.0 * CSS_PX;
/// Most pixels of a picture: drawing takes twelve bytes for each.
const MOST_PIXELS: f64 = 4e7;

/// How static pictures are printed. What is not given stays as on a page.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PrintStyle {
    width_mm: Option<f64>,
    font_pt: Option<f64>,
    dpi: Option<f64>,
}

/// Why a picture cannot be printed so.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{name} is {value}: between {least} and {most} is possible")]
pub struct PrintStyleError {
    name: &'static str,
    value: f64,
    least: f64,
    most: f64,
}

impl PrintStyle {
    /// A width of 20 to 1000 mm, labels of 4 to 36 pt, and 50 to 2400 pixels an inch for PNG.
    ///
    /// # Errors
    /// [`PrintStyleError`] at the first value outside its range.
    pub fn new(
        width_mm: Option<f64>,
        font_pt: Option<f64>,
        dpi: Option<f64>,
    ) -> Result<Self, PrintStyleError> {
        for (name, value, least, most) in [
            ("the width in mm", width_mm, 20.0, 1000.0),
            ("the size of letters in pt", font_pt, 4.0, 36.0),
            ("the resolution in dpi", dpi, 50.0, 2400.0),
        ] {
            if let Some(value) = value.filter(|value| !(least..=most).contains(value)) {
                return Err(PrintStyleError { name, value, least, most });
            }
        }
        Ok(Self { width_mm, font_pt, dpi })
    }

    /// Size of the labels on paper over that on a page.
    fn enlarged(self) -> f64 {
        self.font_pt.map_or(1.0, |font_pt| font_pt / usual_font_pt())
    }

    /// Millimetres of a length in the layout's CSS pixels.
    fn mm(self, length: f64) -> f64 {
        length * self.enlarged() * MM / CSS_PX
    }

    /// Width of the layout, CSS pixels, so that width and letters come out as asked for; `None` where any width will do.
    pub(super) fn layout_width(self) -> Option<f64> {
        self.width_mm.map(|width_mm| width_mm / self.mm(1.0))
    }

    /// The error of a layout that takes at least so much, CSS pixels.
    pub(super) fn too_narrow(self, least: f64) -> PictureError {
        PictureError::TooNarrow {
            width_mm: self.width_mm.unwrap_or(0.0),
            font_pt: usual_font_pt() * self.enlarged(),
            least_mm: self.mm(least).ceil(),
        }
    }

    /// Size on a page, CSS pixels, of a layout of this size.
    pub(super) fn size(self, (width, height): (u32, u32)) -> (u32, u32) {
        let on_page = |length: u32| (f64::from(length) * self.enlarged()).round() as u32;
        (on_page(width), on_page(height))
    }

    /// Size on paper of a layout of this size: the width as it was asked for.
    pub(super) fn size_mm(self, (width, height): (u32, u32)) -> [f64; 2] {
        let width_mm = self.width_mm.unwrap_or(self.mm(f64::from(width)));
        let tidy = |mm: f64| (mm * 100.0).round() / 100.0;
        [width_mm, width_mm * f64::from(height) / f64::from(width)].map(tidy)
    }
}

/// Size of the labels on a page, pt.
fn usual_font_pt() -> f64 {
    LABEL_TEXT / SIZE_OF_EM * PT / CSS_PX
}

/// The PNG file, with its resolution in it.
pub(super) fn png(picture: &impl Picture, style: PrintStyle) -> Result<Vec<u8>, PictureError> {
    let dpi = style.dpi.unwrap_or(USUAL_DPI);
    let layout = picture.size();
    let [width, height] = style.size_mm(layout).map(|mm| (mm / MM * dpi).round().max(1.0));
    if width * height > MOST_PIXELS {
        return Err(PictureError::TooLarge { pixels: width * height, most: MOST_PIXELS });
    }
    let scale = width / f64::from(layout.0);
    let image = bitmap((width as u32, height as u32), scale, 2, |canvas| picture.draw(canvas))?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Cells of one colour compress best as they are.
    encoder.set_filter(png::FilterType::NoFilter);
    let per_metre = (dpi / MM * 1e3).round() as u32;
    let unit = png::Unit::Meter;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }));
    encoder.write_header()?.write_image_data(image.as_raw())?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::super::{Drawn, SimulatedPanels};
    use super::*;
    use crate::simulated_map::SimulatedMap;
    use crate::simulated_section::SimulatedSection;
    use fieldgap_acoustics::{PlaneGrid, Simulator};

    fn map() -> SimulatedSection {
        let grid = PlaneGrid::square(0.03, 0.002, 0.1);
        let points = grid.points();
        SimulatedSection::from(&SimulatedMap {
            drive: 0,
            amplitude: points.iter().map(|at| 1.0 - 10.0 * at.x.hypot(at.y)).collect(),
            phase_rad: points.iter().map(|at| 100.0 * at.x).collect(),
            grid,
            focus_m: None,
        })
    }

    /// The number after some words of an SVG file.
    fn number(svg: &str, before: &str) -> f64 {
        let rest = svg.split_once(before).unwrap_or_else(|| panic!("no {before} in {svg}")).1;
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').expect("an end");
        rest[..end].parse().expect("a number")
    }

    #[test]
    fn width_letters_and_resolution_are_those_asked_for() {
        let map = map();
        // One column and two of a journal, where the panels stand below one another, and beside.
        for (width_mm, font_pt, dpi) in
            [(85.0, 8.0, 300.0), (180.0, 7.0, 600.0), (180.0, 9.0, 150.0)]
        {
            let style = PrintStyle::new(Some(width_mm), Some(font_pt), Some(dpi)).expect("usual");
            let panels = SimulatedPanels::new(&map, Simulator::Piston).expect("points");
            let drawn = Drawn::printed(panels, style).expect("drawn");
            assert_eq!(number(&drawn.svg, "<svg width=\""), width_mm);
            assert!(drawn.svg.contains(&format!("width=\"{width_mm}mm\"")), "millimetres");
            // The label of an axis, in units of the view box, which is as wide as the picture.
            let label =
                drawn.svg.split("<text").find(|text| text.contains("x (mm)")).expect("a label");
            let em_mm =
                number(label, "font-size=\"") * width_mm / number(&drawn.svg, "viewBox=\"0 0 ");
            assert!(
                (em_mm / MM * PT - font_pt).abs() < 0.03 * font_pt,
                "{em_mm} mm for {font_pt} pt"
            );
            let decoder = png::Decoder::new(std::io::Cursor::new(&drawn.png));
            let reader = decoder.read_info().expect("a PNG");
            let info = reader.info();
            assert_eq!(info.width, (width_mm / MM * dpi).round() as u32);
            let declared = info.pixel_dims.expect("a resolution").xppu;
            assert_eq!(declared, (dpi / MM * 1e3).round() as u32);
        }
    }

    #[test]
    fn letters_alone_change_the_width_and_nothing_changes_nothing() {
        let map = map();
        let panels = || SimulatedPanels::new(&map, Simulator::Piston).expect("points");
        let usual = Drawn::printed(panels(), PrintStyle::default()).expect("drawn");
        assert_eq!(usual.svg, Drawn::new(&panels()).expect("drawn").svg);
        let style = PrintStyle::new(None, Some(2.0 * usual_font_pt()), None).expect("usual");
        let large = Drawn::printed(panels(), style).expect("drawn");
        assert_eq!(large.size, (2 * usual.size.0, 2 * usual.size.1));
    }

    #[test]
    fn what_has_no_room_is_refused_with_what_is_possible() {
        let map = map();
        let panels = || SimulatedPanels::new(&map, Simulator::Piston).expect("points");
        let style = PrintStyle::new(Some(40.0), Some(12.0), None).expect("usual");
        let refused = Drawn::printed(panels(), style).err().expect("too narrow");
        let PictureError::TooNarrow { least_mm, .. } = refused else { panic!("{refused}") };
        let style = PrintStyle::new(Some(least_mm), Some(12.0), None).expect("usual");
        assert!(Drawn::printed(panels(), style).is_ok());
        let style = PrintStyle::new(Some(1000.0), None, Some(2400.0)).expect("usual");
        assert!(matches!(Drawn::printed(panels(), style), Err(PictureError::TooLarge { .. })));
        for (width_mm, font_pt, dpi) in
            [(Some(0.0), None, None), (None, Some(f64::NAN), None), (None, None, Some(1e6))]
        {
            assert!(PrintStyle::new(width_mm, font_pt, dpi).is_err());
        }
    }
}
