//! Moving pictures as animated PNG. Programs that do not know the format show the first picture.

use super::{Picture, PictureError, pixels};

/// Pixels in a CSS pixel. One is enough, and keeps the file of many pictures small.
const DENSITY: u32 = 1;

/// Encodes pictures of one size as an endless loop, each shown for `each_ms`.
pub(crate) fn animated(pictures: &[impl Picture], each_ms: u16) -> Result<Vec<u8>, PictureError> {
    let mut file = Vec::new();
    let Some(first) = pictures.first() else { return Ok(file) };
    let (width, height) = first.size();
    let mut encoder = png::Encoder::new(&mut file, width * DENSITY, height * DENSITY);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Cells of one colour compress best as they are.
    encoder.set_filter(png::FilterType::NoFilter);
    encoder.set_compression(png::Compression::Best);
    encoder.set_animated(u32::try_from(pictures.len()).unwrap_or(u32::MAX), 0)?;
    encoder.set_frame_delay(each_ms, 1000)?;
    let mut writer = encoder.write_header()?;
    for picture in pictures {
        writer.write_image_data(pixels(picture, DENSITY)?.as_raw())?;
    }
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {

    use super::*;
    use fieldgap_canvas::{BLACK, Canvas, CanvasError, Rgb};

    /// A sheet of one colour.
    struct Sheet(Rgb);

    impl Picture for Sheet {
        fn size(&self) -> (u32, u32) {
            (30, 20)
        }
        fn description(&self) -> String {
            "a sheet".to_owned()
        }
        fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
            canvas.fill(&[(0.0, 0.0), (30.0, 0.0), (30.0, 20.0), (0.0, 20.0)], self.0)
        }
    }

    #[test]
    fn every_picture_is_in_the_file_in_its_order_and_for_its_time() {
        let colours = [(200, 10, 10), BLACK, (10, 10, 200)];
        let file = animated(&colours.map(Sheet), 40).expect("drawn");
        let decoder = png::Decoder::new(std::io::Cursor::new(file));
        let mut reader = decoder.read_info().expect("a PNG");
        assert_eq!(
            reader.info().animation_control().map(|all| (all.num_frames, all.num_plays)),
            Some((3, 0))
        );
        for (red, green, blue) in colours {
            let mut pixels = vec![0; reader.output_buffer_size()];
            reader.next_frame(&mut pixels).expect("a picture");
            let middle = 3 * (10 * 30 + 15);
            assert_eq!(pixels[middle..middle + 3], [red, green, blue]);
            let shown = reader.info().frame_control().expect("its time");
            assert_eq!((shown.delay_num, shown.delay_den), (40, 1000));
        }
    }
}
