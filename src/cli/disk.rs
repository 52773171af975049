//! Room on disks: looked at before the work, and what is done where there is none after it.

use super::checkpoint::Keeper;
use super::print::bytes;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::exr::Aovs;
use crate::output::{Provenance, write_exr};
use crate::render::Checkpointable;
use crate::scene::FilmSettings;
use std::path::{Path, PathBuf};

/// Bytes of a pixel in files: of a picture, and of RGB and XYZ in a spectral EXR.
const PICTURE_BYTES: u64 = 4;
const COLOR_BYTES: u64 = 6 * 4;
/// What each file has besides.
const HEADER_BYTES: u64 = 1 << 20;

/// Bytes of a render's files, at most.
pub struct Sizes {
    /// The spectral EXR and the picture.
    files: u64,
    /// A checkpoint, if any is to be written.
    checkpoint: u64,
}

impl Sizes {
    /// Of a film with so many channels besides its bins, and of the checkpoints of `keeper`.
    pub fn new(film: &FilmSettings, others: u64, keeper: &Keeper, state: &mut Checkpointable<'_>) -> Self {
        let pixels = film.pixel_bounds().pixels() as u64;
        let of_pixel = 4 * (u64::from(film.bins.count) + others) + COLOR_BYTES + PICTURE_BYTES;
        Sizes { files: pixels * of_pixel + HEADER_BYTES, checkpoint: keeper.bytes(state) }
    }

    /// Whether they have room beside `exr`, in words.
    ///
    /// # Errors
    /// [`Error::File`] where the result has none: before the work is done for nothing.
    pub fn check(&self, exr: &Path) -> Result<String> {
        let folder = exr.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let sizes = match self.checkpoint {
            0 => format!("files: up to {}", bytes(self.files)),
            checkpoint => format!("files: up to {}, and a checkpoint of {}", bytes(self.files), bytes(checkpoint)),
        };
        let Some(free) = free(folder) else { return Ok(sizes) };
        if free < self.files {
            let problem = format!("there is no room for it: it takes up to {}, and {} are free", bytes(self.files), bytes(free));
            return Err(Error::file(exr, problem, "make room, or choose another place with -o"));
        }
        // One beside the one before.
        let lack = if free < self.files + 2 * self.checkpoint { ", perhaps too little for checkpoints" } else { "" };
        Ok(format!("{sizes}; {} are free{lack}", bytes(free)))
    }
}

/// Bytes that are free on the disk of `folder`; `None` where it is not known.
#[cfg(unix)]
fn free(folder: &Path) -> Option<u64> {
    use std::os::unix::ffi::OsStrExt;
    let path = std::ffi::CString::new(folder.as_os_str().as_bytes()).ok()?;
    // SAFETY: all zeros is a valid statvfs, which the call fills in; the path ends with a zero.
    let found = unsafe {
        let mut found: libc::statvfs = std::mem::zeroed();
        (libc::statvfs(path.as_ptr(), &mut found) == 0).then_some(found)
    }?;
    // Some network file systems do not tell.
    (found.f_blocks > 0).then(|| (found.f_bavail as u64).saturating_mul(found.f_frsize as u64))
}

#[cfg(not(unix))]
fn free(_: &Path) -> Option<u64> {
    None
}

/// Keeps a film that cannot be written where it should among temporary files; returns where.
pub fn keep_elsewhere(exr: &Path, film: &Film, origin: &Provenance, aovs: Aovs<'_>) -> Option<PathBuf> {
    let name = exr.file_name()?.to_string_lossy();
    let other = std::env::temp_dir().join(format!("abbe-{}-{name}", std::process::id()));
    write_exr(&other, film, origin, aovs).ok().map(|()| other)
}

/// The same failure, and where the film is that could not be written.
pub fn kept(failure: Error, place: Option<&Path>) -> Error {
    match (failure, place) {
        (Error::File { file, problem, remedy }, Some(place)) => {
            Error::File { file, problem: format!("{problem}; what was rendered is in {}", place.display()), remedy }
        }
        (failure, _) => failure,
    }
}
