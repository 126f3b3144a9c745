//! A map of readings without axes, as small as a stamp, so that many can be compared on one colour scale.

use fieldgap_canvas::Cells;

use super::PictureError;
use super::colour_scale::ColourScale;
use super::raster::borders;
use fieldgap_acoustics::metrics::PlaneMap;

/// The longer side of the picture, pixels: twice as many as it has on a page, for screens of double density.
const LONGER_SIDE_PX: f64 = 288.0;

/// A map as a PNG file.
#[derive(Debug)]
pub(crate) struct SmallMap {
    pub png: Vec<u8>,
    /// Extent along x and y with half a step around it, millimetres.
    pub extent_mm: [f64; 2],
}

/// Draws a map, y upwards; a reading of `top` has the lightest colour.
pub(crate) fn small_map(
    map: &PlaneMap,
    step_mm: [f64; 2],
    top: f64,
) -> Result<SmallMap, PictureError> {
    let column_borders = borders(map.x_m(), step_mm[0] * 1e-3);
    let row_borders = borders(map.y_m(), step_mm[1] * 1e-3);
    let extent = |borders: &[f64]| match borders {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let extents = [extent(&column_borders), extent(&row_borders)];
    let longer = extents[0].max(extents[1]);
    let pixels = |extent: f64| (LONGER_SIDE_PX * extent / longer).round().max(1.0) as u32;
    let [width, height] = extents.map(pixels);
    let scale = ColourScale { top };
    let cells =
        Cells { column_borders: &column_borders, row_borders: &row_borders, values: map.values() };
    let rgb = cells.image((width, height), &|value| scale.colour(value));
    let png = fieldgap_canvas::png(&rgb, (width, height))?;
    Ok(SmallMap { png, extent_mm: extents.map(|extent| extent * 1e3) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_has_the_form_of_the_map_and_its_colours() {
        let values = vec![0.0, 1.0, 2.0, 0.0, 0.0, 4.0];
        let map = PlaneMap::new(vec![0.0, 0.002, 0.004], vec![0.0, 0.002], values).expect("a map");
        let drawn = small_map(&map, [2.0, 2.0], 4.0).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        assert_eq!(image.dimensions(), (288, 192));
        let top = ColourScale { top: 4.0 };
        // The last value is that of the largest x and y: right and above.
        let of = |x, y| {
            let image::Rgb([red, green, blue]) = *image.get_pixel(x, y);
            (red, green, blue)
        };
        assert_eq!(
            (of(287, 0), of(287, 191), of(0, 0)),
            (top.colour(4.0), top.colour(2.0), top.colour(0.0))
        );
        assert!(
            drawn.extent_mm.iter().zip([6.0, 4.0]).all(|(one, other)| (one - other).abs() < 1e-9)
        );
    }
}
