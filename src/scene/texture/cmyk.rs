//! JPEGs of four inks, by the ICC profile that says what these look like on paper.

use moxcms::{ColorProfile, DataColorSpace, Layout, TransformOptions};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Pixels that are worked out together.
const PIXELS: usize = 4096;

/// The colours of a JPEG in sRGB, three bytes a pixel; `None` where it is not of four inks, or where it or its profile cannot be read so.
pub(super) fn srgb_of_inks(jpeg: &[u8], icc: &[u8]) -> Option<Vec<u8>> {
    let profile = ColorProfile::new_from_slice(icc).ok().filter(|profile| profile.color_space == DataColorSpace::Cmyk)?;
    let mut decoder = JpegDecoder::new(ZCursor::new(jpeg));
    decoder.decode_headers().ok()?;
    let stored = decoder.input_colorspace()?;
    // As they are stored: the decoder has no other way to four inks.
    decoder.set_options(DecoderOptions::default().jpeg_set_out_colorspace(stored));
    let mut inks = decoder.decode().ok()?;
    for ink in inks.chunks_exact_mut(4) {
        match stored {
            ColorSpace::CMYK => {}
            // JFIF's colour difference, of what is left white (Adobe Technical Note 5116).
            ColorSpace::YCCK => {
                let [y, cb, cr] = [f32::from(ink[0]), f32::from(ink[1]) - 128.0, f32::from(ink[2]) - 128.0];
                let rgb = [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb];
                rgb.iter().zip(&mut *ink).for_each(|(v, ink)| *ink = 255 - v.round().clamp(0.0, 255.0) as u8);
            }
            _ => return None,
        }
        // Files have 255 where there is no ink.
        ink.iter_mut().for_each(|ink| *ink = 255 - *ink);
    }
    let srgb = ColorProfile::new_srgb();
    // In floating point, which leaves no rounding but the last.
    let transform = profile.create_transform_f32(Layout::Rgba, &srgb, Layout::Rgb, TransformOptions::default()).ok()?;
    let mut colors = Vec::with_capacity(inks.len() / 4 * 3);
    for inks in inks.chunks(4 * PIXELS) {
        let mut encoded = vec![0.0; inks.len() / 4 * 3];
        transform.transform(&inks.iter().map(|ink| f32::from(*ink) / 255.0).collect::<Vec<_>>(), &mut encoded).ok()?;
        colors.extend(encoded.into_iter().map(|v| (255.0 * v).round() as u8));
    }
    Some(colors)
}
