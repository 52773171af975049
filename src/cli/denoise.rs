//! `abbe denoise`: from a noisy spectral EXR to one without noise.

use super::picture::PictureArgs;
use super::print::{duration, out};
use super::render::png_beside;
use super::{Done, Outcome};
use crate::color::cie::is_visible;
use crate::denoise::denoise;
use crate::develop::picture::{Exposure, PictureSettings};
use crate::error::{Error, Result};
use crate::output::picture::Precision;
use crate::output::{SpectralImage, check_writable, picture_exposure, write_image, write_picture};
use crate::spectrum::library::{Observer, illuminant};
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "Examples:
  abbe render scenes/fog.json --time 30s --aov denoise
  abbe denoise fog.exr -o fog.denoised.exr
  abbe render scenes/fog.json --time 30s --denoise        both at once

All bins of a pixel are weighed alike, so that no colour comes out that did not go in. The errors in the file that is written (error.*) are estimates of the
root mean square error, bias included.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Spectral EXR that was rendered with --aov denoise
    #[arg(value_name = "IN.exr")]
    input: PathBuf,
    /// Spectral EXR to write; the picture goes beside it as .png
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    #[command(flatten)]
    picture: PictureArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let png = png_beside(&args.output)?;
    [&args.output, &png].into_iter().try_for_each(|path| check_writable(path, [&args.input]))?;
    let settings = args.picture.settings();
    settings.check_for_screens()?;
    let image = SpectralImage::read(&args.input)?;
    let begun = Instant::now();
    let files = write_denoised(&image, &args.input, &args.output, &settings)?;
    let files = files.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ");
    out(&format!("wrote {files} in {}", duration(begun.elapsed().as_secs_f64())));
    Ok(Done::Completely)
}

/// Writes `image`, which is that of `input`, without noise as a spectral EXR and, where it is visible, a picture beside it; returns what was written.
///
/// # Errors
/// [`Error::File`] where `image` has not what it takes, or a file cannot be written.
pub fn write_denoised(image: &SpectralImage, input: &Path, exr: &Path, settings: &PictureSettings) -> Result<Vec<PathBuf>> {
    let range = (image.edges_nm()[0], image.edges_nm()[image.bins()]);
    let xyz = |image: &SpectralImage| -> Result<Vec<[f32; 3]>> {
        // Of a file without X, Y, Z it is said below.
        let white = illuminant("E").unwrap_or_else(crate::color::upsample::white);
        Ok(if is_visible(range.0, range.1) {
            image
                .xyz(Observer::Cie1931, &white)
                .map_err(|problem| Error::file(input, problem, "give a file of visible light"))?
                .xyz
        } else {
            Vec::new()
        })
    };
    let exposure = settings.exposure.or_else(|| image.own_exposure().map(Exposure::Stops)).unwrap_or_default();
    let exposure = picture_exposure(&xyz(image)?, range, exposure);
    let remedy = match image.attribute("abbe.batches") {
        Some("1") => "render it for longer: one batch does not tell what is noise",
        _ => "render with --aov denoise, and give that file",
    };
    let denoised = denoise(image, exposure).map_err(|problem| Error::file(input, problem, remedy))?;
    write_image(exr, &denoised)?;
    let mut written = vec![exr.to_path_buf()];
    if is_visible(range.0, range.1) {
        let png = exr.with_extension("png");
        write_picture(&png, &xyz(&denoised)?, denoised.width, &settings.development(exposure), Precision::default(), None)?;
        written.push(png);
    }
    Ok(written)
}
