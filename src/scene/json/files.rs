//! Files that a scene names: found beside it, kept inside its folder, and read whole within limits.

use crate::error::{Error, Result, quoted};
use crate::scene::json::Node;
use crate::scene::texture::decode::Pictures;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// No file larger than this is read.
const LARGEST_FILE: u64 = 2 << 30;

/// Where the scene's own files may lie.
#[derive(Debug, Clone)]
pub struct Files {
    /// Folder that relative paths start from.
    pub base: PathBuf,
    /// Canonical folder that must not be left, if any.
    pub fence: Option<PathBuf>,
    /// Hash of all that was read so far, shared with the copies.
    hash: Arc<AtomicU64>,
    /// The files that were read so far, without links, shared likewise.
    sources: Arc<Mutex<Vec<PathBuf>>>,
    /// The pictures in them that were decoded, shared likewise.
    pub(in crate::scene) pictures: Pictures,
}

impl Files {
    /// Files beside a scene in `base`; outside it only where `allow_outside`.
    pub fn new(base: &Path, allow_outside: bool) -> Self {
        let base = if base.as_os_str().is_empty() { Path::new(".") } else { base };
        // A folder that cannot be resolved stays as it is: then no file in it will be found inside the fence.
        let fence = (!allow_outside).then(|| base.canonicalize().unwrap_or_else(|_| base.to_path_buf()));
        let hash = Arc::new(AtomicU64::new(0xcbf2_9ce4_8422_2325));
        Files { base: base.to_path_buf(), fence, hash, sources: Arc::default(), pictures: Pictures::default() }
    }

    /// The same fence, but relative paths start from `folder`.
    pub fn within(&self, folder: &Path) -> Self {
        Files { base: folder.to_path_buf(), ..self.clone() }
    }

    /// Finds and reads the file that `node` names. Errors: leaves the folder, missing, not a plain file, too large, unreadable.
    pub fn read(&self, node: &Node) -> Result<(PathBuf, Vec<u8>)> {
        let name = node.string()?;
        self.read_name(node, name)
    }

    /// As [`Files::read`], for a name that `node` only caused.
    pub fn read_name(&self, node: &Node, name: &str) -> Result<(PathBuf, Vec<u8>)> {
        let outside = || {
            node.fail(
                format!("{} lies outside the scene's folder", quoted(name)),
                "move it beside the scene, or allow it with --allow-outside",
            )
        };
        let relative = Path::new(name);
        if self.fence.is_some() && relative.has_root() {
            return Err(outside());
        }
        let path = self.base.join(relative);
        let canonical = path.canonicalize().map_err(|e| match self.fence {
            // What is outside is not even said to exist.
            Some(_) if climbs(relative) => outside(),
            _ => node.fail(
                format!("cannot read {}: {e}", quoted(name)),
                "check the path, which is relative to the file that names it",
            ),
        })?;
        if self.fence.as_ref().is_some_and(|fence| !canonical.starts_with(fence)) {
            return Err(outside());
        }
        let bytes = read_plain(&canonical).map_err(|problem| {
            node.fail(format!("cannot read {}: {problem}", quoted(name)), "name a plain file of less than 2 GiB")
        })?;
        self.add_source(canonical, &bytes);
        Ok((path, bytes))
    }

    /// Counts the file at `path` (without links), which holds `bytes`, among what the scene was read from.
    pub fn add_source(&self, path: PathBuf, bytes: &[u8]) {
        self.add_to_hash(bytes);
        self.sources.lock().unwrap_or_else(PoisonError::into_inner).push(path);
    }

    /// The files that were read.
    pub fn sources(&self) -> Vec<PathBuf> {
        self.sources.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Counts `bytes` among what the scene was read from.
    pub fn add_to_hash(&self, bytes: &[u8]) {
        let length = (bytes.len() as u64).to_le_bytes();
        let fnv1a = |h: u64, b: &u8| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3);
        let hash = bytes.iter().chain(&length).fold(self.hash(), fnv1a);
        self.hash.store(hash, Ordering::Relaxed);
    }

    /// A 64-bit FNV-1a hash of everything that was read, file after file, each with its length.
    pub fn hash(&self) -> u64 {
        self.hash.load(Ordering::Relaxed)
    }
}

/// Does a relative path climb above where it starts, judged by its letters alone?
fn climbs(path: &Path) -> bool {
    let mut depth = 0i32;
    path.components().any(|component| {
        depth += match component {
            Component::Normal(_) => 1,
            Component::ParentDir => -1,
            _ => 0,
        };
        depth < 0
    })
}

fn read_plain(path: &Path) -> std::result::Result<Vec<u8>, String> {
    let about = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !about.is_file() {
        return Err("not a plain file".into()); // a pipe or device could block for ever
    }
    if about.len() > LARGEST_FILE {
        return Err(format!("{} bytes are too many", about.len()));
    }
    std::fs::read(path).map_err(|e| e.to_string())
}

/// Reads the scene file itself; its path without links, and its contents.
pub fn read_scene_file(path: &Path) -> Result<(PathBuf, Vec<u8>)> {
    let unreadable = |problem: String| Error::file(path, format!("cannot read the scene: {problem}"), "check the path");
    let canonical = path.canonicalize().map_err(|e| unreadable(e.to_string()))?;
    let bytes = read_plain(&canonical).map_err(unreadable)?;
    Ok((canonical, bytes))
}
