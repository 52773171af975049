//! What leaves the program: spectral EXR, pictures, plots, and the files' safe replacement; and spectral EXRs read back.

mod checkpoint;
pub mod exr;
mod exr_image;
mod exr_merge;
mod exr_read;
mod exr_xyz;
mod icc;
pub mod picture;

pub use crate::channels::{Band, Bands, Quantity, open_plain};
pub use checkpoint::{Checkpoint, write_checkpoint};
pub use exr::{Provenance, Window, scene_hash, write_exr};
pub use exr_image::write_image;
pub use exr_merge::{Merged, merge_exrs};
pub use exr_read::{SpectralImage, read_attributes};
pub use picture::{picture_exposure, write_picture, write_rgb};

use crate::error::{Error, Result};
use std::ffi::OsStr;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Temporary files that exist now, for [`remove_temporaries`].
static TEMPORARIES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn temporaries() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARIES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files of every write under way: for a process about to end without finishing them.
pub fn remove_temporaries() {
    for path in temporaries().drain(..) {
        // The file may be gone or renamed already; nothing is left to do about it then.
        let _ = std::fs::remove_file(path);
    }
}

/// A file that nobody has written to for so long is nobody's any more.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Removes what processes that were killed have left of writes to `destination`. If it cannot be, it is in nobody's way.
fn sweep(destination: &Path, name: &OsStr) {
    let folder = destination.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let begin = format!(".{}.", name.to_string_lossy());
    for file in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let found = file.file_name().to_string_lossy().into_owned();
        let number = found.strip_prefix(&begin).and_then(|rest| rest.strip_suffix(".tmp"));
        let is_ours = number.is_some_and(|n| n.chars().all(|c| c.is_ascii_digit() || c == '.'));
        let age = file.metadata().and_then(|m| m.modified()).ok().and_then(|at| at.elapsed().ok());
        if is_ours && age.is_some_and(|age| age > ABANDONED) {
            let _ = std::fs::remove_file(file.path());
        }
    }
}

/// A file beside its destination that takes the destination's name only when complete, and vanishes otherwise.
struct Temporary {
    path: PathBuf,
    destination: PathBuf,
    file: File,
}

impl Temporary {
    fn create(destination: &Path) -> io::Result<Self> {
        // A link stays a link: its target is what is replaced.
        let destination = std::fs::canonicalize(destination).unwrap_or_else(|_| destination.to_path_buf());
        if std::fs::metadata(&destination).is_ok_and(|m| !m.is_file()) {
            return Err(io::Error::other("this is not a plain file"));
        }
        let name = destination.file_name().ok_or_else(|| io::Error::other("this names no file"))?;
        sweep(&destination, name);
        for attempt in 0..100 {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}.{attempt}.tmp", std::process::id()));
            let path = destination.with_file_name(hidden);
            let mut list = temporaries();
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    list.push(path.clone());
                    return Ok(Temporary { path, destination, file });
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(io::Error::other("too many temporary files beside it"))
    }

    /// Flushes to the disk and takes the destination's place.
    fn finish(self) -> io::Result<()> {
        self.file.sync_all()?;
        std::fs::rename(&self.path, &self.destination)?;
        // The rename itself lasts only when the folder is on the disk too; not every system lets a folder be opened for that.
        let folder = self.destination.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if let Ok(folder) = File::open(folder) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        temporaries().retain(|path| *path != self.path);
        // After `finish` there is nothing under this name any more.
        let _ = std::fs::remove_file(&self.path);
    }
}

const REMEDY: &str = "choose another place with -o, or make room and permission there";

/// Writes `path` by way of a temporary file in the same folder, flushed to the disk and then renamed: readers see the old file or
/// the whole new one, and a failure at any point leaves the old one as it was.
///
/// # Errors
/// [`Error::File`] with what `write` or the file system says.
pub fn replace_file<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> std::result::Result<(), E>,
) -> Result<()> {
    let temporary = Temporary::create(path).map_err(|e| Error::file(path, format!("cannot write here: {e}"), REMEDY))?;
    let mut buffered = BufWriter::with_capacity(1 << 16, &temporary.file);
    let written = write(&mut buffered).map_err(|e| e.to_string());
    // Flushed even after a failure, so that dropping the buffer has nothing left to do.
    let flushed = buffered.flush().map_err(|e| e.to_string());
    drop(buffered);
    written.and(flushed).map_err(|e| Error::file(path, format!("cannot be written: {e}"), REMEDY))?;
    temporary.finish().map_err(|e| Error::file(path, format!("cannot be put in place: {e}"), REMEDY))
}

/// Writes a text file through [`replace_file`].
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    replace_file(path, |file| file.write_all(text.as_bytes()))
}

/// Finds out whether [`replace_file`] would succeed, without touching what is there, and that it would not replace one of `inputs`.
pub fn check_writable<P: AsRef<Path>>(path: &Path, inputs: impl IntoIterator<Item = P>) -> Result<()> {
    let canonical = path.canonicalize().ok();
    if canonical.is_some_and(|output| inputs.into_iter().any(|input| input.as_ref().canonicalize().is_ok_and(|i| i == output))) {
        return Err(Error::file(
            path,
            "this is one of the files to be read, which would be replaced",
            "choose another name with -o",
        ));
    }
    Temporary::create(path).map(drop).map_err(|e| Error::file(path, format!("cannot write here: {e}"), REMEDY))
}
