//! Checkpoints: a render as it is between two batches, or where it was interrupted, from which another process goes on bit by bit. A share of a render
//! ([`crate::render::Share`]) is one, too.
//!
//! A file is a line that says what it is, the length of a header and the header (JSON: which render it is of, and what was asked for), then the state
//! ([`crate::state`]) with a checksum of both. It is replaced as a whole, so that a process killed at any moment leaves the one before or the new one.

use super::exr::Provenance;
use super::{open_plain, picture_exposure, replace_file};
use crate::develop::picture::Exposure;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::render::Rendering;
use crate::scene::{Bins, FilmSettings, Tile};
use crate::state::{Persistent, State};
use serde_json::Value;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8] = b"abbe checkpoint 1\n";
/// A header is text that a person could read.
const LONGEST_HEADER: u64 = 1 << 20;
/// Members of a request that say where a render is, and not what.
const PLACE: [&str; 4] = ["scene", "device", "share", "exposure"];
/// State is written and read in pieces of this size.
const BUFFER: usize = 1 << 20;

/// Writes `state` under `path`; what was there before stays until it is complete and on the disk.
///
/// # Errors
/// [`Error::File`] where it cannot be written.
pub fn write_checkpoint(path: &Path, header: &Value, state: &mut dyn Persistent) -> Result<()> {
    replace_file(path, |file| -> io::Result<()> {
        let header = header.to_string();
        file.write_all(MAGIC)?;
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(header.as_bytes())?;
        let mut out = State::saving(file);
        out.cover(header.as_bytes());
        state.persist(&mut out)?;
        out.finish()
    })
}

/// A checkpoint whose header has been read.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    /// Which render it is of, and what was asked for.
    pub header: Value,
    /// The same as it is in the file.
    text: Vec<u8>,
    file: BufReader<File>,
    /// Bytes of the state and its checksum.
    length: u64,
}

impl Checkpoint {
    /// True if the file begins as one.
    pub fn is_one(path: &Path) -> bool {
        let mut begin = [0; MAGIC.len()];
        open_plain(path).and_then(|(mut file, _)| file.read_exact(&mut begin)).is_ok() && begin == MAGIC
    }

    /// Opens one.
    ///
    /// # Errors
    /// [`Error::File`] if there is none.
    pub fn open(path: &Path) -> Result<Self> {
        let failed = |why: String| Error::file(path, why, "begin anew without --resume");
        let read = || -> io::Result<(BufReader<File>, Vec<u8>, u64, Value)> {
            let (file, all) = open_plain(path)?;
            let mut file = BufReader::with_capacity(BUFFER, file);
            let (mut begin, mut length) = ([0; MAGIC.len()], [0; 8]);
            file.read_exact(&mut begin)?;
            if begin != MAGIC {
                return Err(io::Error::other("this is no checkpoint"));
            }
            file.read_exact(&mut length)?;
            let length = u64::from_le_bytes(length);
            if length > LONGEST_HEADER {
                return Err(io::Error::other("its header is damaged"));
            }
            let mut header = vec![0; length as usize];
            file.read_exact(&mut header)?;
            let text = header.clone();
            let header = serde_json::from_slice(&header).map_err(|_| io::Error::other("its header is damaged"))?;
            Ok((file, text, all.saturating_sub(MAGIC.len() as u64 + 8 + length), header))
        };
        let (file, text, length, header) = read().map_err(|e| match e.kind() {
            io::ErrorKind::NotFound => failed("there is no checkpoint to go on from".to_string()),
            io::ErrorKind::UnexpectedEof => failed("this checkpoint is cut short".to_string()),
            _ => failed(e.to_string()),
        })?;
        Ok(Self { path: path.to_path_buf(), header, text, file, length })
    }

    /// Puts `state` where it was.
    ///
    /// # Errors
    /// [`Error::File`] if the file is damaged or of another kind of render; `state` is then of no use.
    pub fn restore(self, state: &mut dyn Persistent) -> Result<()> {
        self.read(state, false)
    }

    /// What the render has come to, where its EXR comes from, and whether that has standard errors.
    ///
    /// # Errors
    /// As [`Checkpoint::restore`]; [`Error::Usage`] where there is no memory for its film.
    pub fn rendering(self) -> Result<(Rendering, Provenance, bool)> {
        let header = self.header.clone();
        let (identity, picture) = (&header["identity"], &header["picture"]);
        let mut rendering = Rendering::new(Film::try_new(&film_settings(picture))?);
        self.read(&mut rendering, true)?;
        let bins = rendering.film.settings().bins;
        let exposure = picture["exposure"].as_f64().map_or_else(Exposure::default, Exposure::Stops);
        let exposure = picture_exposure(&rendering.film.xyz_image(), (bins.min_nm, bins.max_nm), exposure);
        let text = |name: &str| identity[name].as_str().unwrap_or_default().to_string();
        let provenance = Provenance {
            scene: text("scene"),
            scene_hash: format!("fnv1a64:{}", text("content of the scene's files")),
            max_depth: identity["greatest depth"].as_u64().unwrap_or(0) as u32,
            device: text("device"),
            seed: identity["seed"].as_u64().unwrap_or(0),
            techniques: text("techniques"),
            merging: picture["merging"].as_bool().unwrap_or(false),
            seconds: rendering.elapsed.as_secs_f64(),
            stats: rendering.stats,
            exposure: Some(exposure),
            irradiance: picture["irradiance"].as_bool().unwrap_or(false),
            film_sr: picture["film_sr"].as_f64(),
            options: options(&header["request"]),
            interrupted: header["done"] != true,
            frame: identity["frame"].as_u64().and_then(|frame| u32::try_from(frame).ok()),
        };
        let aovs = header["request"]["aov"].as_array();
        // What is to be denoised has errors, too.
        let errors = rendering.film.keeps_half() || aovs.is_some_and(|all| all.iter().any(|aov| aov == "error"));
        Ok((rendering, provenance, errors))
    }

    fn read(mut self, state: &mut dyn Persistent, has_more: bool) -> Result<()> {
        let mut read = |file: &mut BufReader<File>| {
            let mut input = State::restoring(file);
            input.cover(&self.text);
            state.persist(&mut input)?;
            if has_more {
                // The checksum has four bytes.
                let left = self.length.saturating_sub(input.position() + 4);
                input.skip(left)?;
            }
            input.finish()
        };
        read(&mut self.file).map_err(|e| {
            let why = match e.kind() {
                io::ErrorKind::UnexpectedEof => "this checkpoint is cut short".to_string(),
                _ => format!("this checkpoint cannot be gone on from: {e}"),
            };
            Error::file(&self.path, why, "begin anew without --resume")
        })
    }
}

/// What a request asks for, wherever it is rendered.
fn options(request: &Value) -> Value {
    let mut options = request.clone();
    if let Some(members) = options.as_object_mut() {
        members.retain(|key, _| !PLACE.contains(&key.as_str()));
    }
    options
}

/// The part of the picture that a header describes, if it is not all.
fn crop(picture: &Value) -> Option<Tile> {
    let numbers = picture["crop"].as_array()?.iter().map(|n| u32::try_from(n.as_u64()?).ok());
    let [x, y, width, height] = numbers.collect::<Option<Vec<_>>>()?.try_into().ok()?;
    // A film of no pixels, or of more than there are numbers for, is none.
    let is_one = width > 0 && height > 0 && x.checked_add(width).is_some() && y.checked_add(height).is_some();
    is_one.then_some(Tile { x, y, width, height })
}

/// Those of the film that a header describes.
fn film_settings(picture: &Value) -> FilmSettings {
    let number = |name: &str| picture[name].as_u64().and_then(|n| u32::try_from(n).ok()).unwrap_or(1).max(1);
    let bins = Bins {
        count: number("bins"),
        min_nm: picture["min_nm"].as_f64().unwrap_or(380.0),
        max_nm: picture["max_nm"].as_f64().unwrap_or(780.0),
    };
    let whole = FilmSettings::new(number("width"), number("height"), bins);
    FilmSettings { crop: crop(picture), exposure: picture["exposure"].as_f64(), ..whole }
}
