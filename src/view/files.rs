//! One or two spectral files, which are read anew when they change.

use super::engine::file_name;
use super::live::Published;
use super::picture::Picture;
use super::summary;
use crate::error::Result;
use crate::output::{Bands, SpectralImage};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// Files that are shown.
#[derive(Debug)]
pub struct Files {
    bands: Option<Bands>,
    files: Vec<(PathBuf, Option<SystemTime>)>,
    /// Number of the first picture that they are.
    first: usize,
    published: Arc<Published>,
}

impl Files {
    /// Reads one or two files and shows them from picture `first` on.
    ///
    /// # Errors
    /// Those of [`SpectralImage::read_with`].
    pub fn open(paths: &[PathBuf], bands: Option<Bands>, first: usize, published: Arc<Published>) -> Result<Self> {
        let files = paths.iter().map(|path| (path.clone(), modified(path))).collect();
        let files = Files { bands, files, first, published };
        files.read()?;
        Ok(files)
    }

    fn read(&self) -> Result<()> {
        let read = |(path, _): &(PathBuf, _)| {
            SpectralImage::read_with(path, self.bands.as_ref()).map(|image| Picture::of_file(file_name(path), image))
        };
        let pictures: Vec<Picture> = self.files.iter().map(read).collect::<Result<_>>()?;
        if self.first == 0 {
            let document = summary::of_files(&pictures);
            self.published.document.send_replace(Arc::new(document));
            self.published.status.send_replace(Arc::new(json!({"phase": "file"})));
        }
        for (picture, place) in pictures.into_iter().zip(&self.published.pictures[self.first..]) {
            place.send_replace(Some(Arc::new(picture)));
        }
        Ok(())
    }

    /// Reads them anew if one has changed. A file that is half written is read when it is whole.
    pub fn reload_if_outdated(&mut self) {
        let is_outdated = self.files.iter().any(|(path, time)| modified(path) != *time);
        if is_outdated {
            self.files.iter_mut().for_each(|(path, time)| *time = modified(path));
            if self.read().is_err() {
                // Looked at again.
                self.files.iter_mut().for_each(|(_, time)| *time = None);
            }
        }
    }
}

/// When a file was changed last.
pub(super) fn modified(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}
