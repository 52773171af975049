//! The spectral channels of EXR files: which they are (`bands`), and what is in them (`pixels`).

mod bands;
mod pixels;

pub(crate) use bands::Selection;
pub use bands::{Band, Bands};
pub(crate) use pixels::{read_lines, read_pixels};

use exr::compression::Compression;
use exr::meta::header::Header;
use exr::prelude::Vec2;
use std::fs::File;
use std::io;
use std::path::Path;

/// What the spectral channels of an image are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `S0`: light, W m^-2 sr^-1 nm^-1.
    Emissive,
    /// `T`: reflectance or transmittance.
    Reflective,
}

/// Opens a file for reading, with its length. Pipes and devices, which could block for ever, are refused.
pub fn open_plain(path: &Path) -> io::Result<(File, u64)> {
    let about = std::fs::metadata(path)?;
    if about.is_file() { Ok((File::open(path)?, about.len())) } else { Err(io::Error::other("this is not a plain file")) }
}

/// Refuses a header that promises more pixels than the file can hold, before anyone allocates for them.
pub(crate) fn check_size(headers: &[Header], length: u64) -> std::result::Result<(), String> {
    for header in headers {
        let (width, height) = (header.layer_size.width() as u128, header.layer_size.height() as u128);
        let per_pixel: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
        // Deflate packs at most 1032:1; the wavelet and lossy schemes have no such bound, so they get a flat allowance.
        let packing: u128 = if header.compression == Compression::Uncompressed { 1 } else { 1032 };
        let most = packing * u128::from(length) + (64 << 20);
        if width * height * per_pixel > most {
            return Err(format!("the header promises {width}x{height} pixels, more than {length} bytes can hold"));
        }
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err("subsampled channels are not supported".to_string());
        }
    }
    Ok(())
}
