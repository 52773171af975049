//! Pixels as they go to a page: a head of JSON, then a PNG or JPEG.

use super::look::Drawn;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde_json::Value;

/// Quality of pictures in motion.
const QUALITY: u8 = 82;

/// A message: the length of the head in four bytes, the least first, the head, and the picture.
pub fn message(head: &Value, picture: &[u8]) -> Vec<u8> {
    let head = head.to_string();
    let length = u32::try_from(head.len()).unwrap_or(0);
    [&length.to_le_bytes(), head.as_bytes(), picture].concat()
}

/// Without loss; small, or soon.
///
/// # Errors
/// Says what the encoder says.
pub fn encode_png(drawn: &Drawn, is_small: bool) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let mut info = png::Info::with_size(drawn.size[0] as u32, drawn.size[1] as u32);
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = png::BitDepth::Eight;
    info.srgb = Some(png::SrgbRenderingIntent::RelativeColorimetric);
    let write = || -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::with_info(&mut out, info)?;
        encoder.set_compression(if is_small { png::Compression::Balanced } else { png::Compression::Fast });
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&drawn.rgb)?;
        writer.finish()
    };
    write().map_err(|e| e.to_string())?;
    Ok(out)
}

/// With losses that motion hides.
///
/// # Errors
/// Says what the encoder says.
pub fn encode_jpeg(drawn: &Drawn) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut out, QUALITY);
    let [width, height] = drawn.size.map(|n| n as u32);
    encoder.write_image(&drawn.rgb, width, height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())?;
    Ok(out)
}
