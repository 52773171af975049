//! The picture: 8-bit sRGB PNG, marked as such.

use super::replace_file;
use crate::color::picture::develop;
use crate::error::Result;
use crate::film::Film;
use std::path::Path;

/// Writes `film` as an 8-bit sRGB picture through [`develop`] with the given exposure in stops (`None` chooses one). By a
/// temporary file and a rename.
///
/// # Errors
/// [`crate::Error::File`] where the file cannot be written; what was there before stays.
pub fn write_png(path: &Path, film: &Film, exposure: Option<f64>) -> Result<()> {
    let pixels = develop(&film.xyz_image(), exposure);
    let settings = film.settings();
    replace_file(path, |file| -> std::result::Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(file, settings.width, settings.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&pixels)?;
        writer.finish()
    })
}
