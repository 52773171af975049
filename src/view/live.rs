//! The engine from outside: what pages ask it for, and what it publishes.

use super::document::{Document, Edit};
use super::picture::Picture;
use crate::render::Halt;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Answers a page that asked.
pub type Reply = Box<dyn FnOnce(Value) + Send>;

/// What pages ask for. All pages share one scene.
pub enum Command {
    /// Look from another camera (`None`: the file's), more of which are to come or not.
    Camera(Option<Value>, bool),
    /// Change a value.
    Edit {
        /// The change.
        edit: Edit,
        /// It takes the place of the one before, if that was of the same value.
        goes_on: bool,
        /// No more of them are to come.
        is_final: bool,
    },
    /// Take the last change back, or make it again.
    Undo(bool),
    /// Render no more for now, or go on.
    Pause(bool),
    /// Find depth, normals and albedos of the picture at hand.
    Aovs,
    /// Say what lies at this place of the picture, from 0 to 1 across and down.
    Pick([f64; 2], Reply),
    /// Write the scene by this name.
    Save(String, Reply),
    /// Say the whole scene file.
    Json(Reply),
    /// Somebody looks.
    Show,
    /// End.
    End,
}

/// What pages see.
#[derive(Debug)]
pub struct Published {
    /// What there is to look at and to change.
    pub document: watch::Sender<Arc<Value>>,
    /// How far it is.
    pub status: watch::Sender<Arc<Value>>,
    /// The picture, and that of a second file.
    pub pictures: [watch::Sender<Option<Arc<Picture>>>; 2],
    /// The last picture that was denoised, for pages that want it.
    pub denoised: watch::Sender<Option<Arc<Picture>>>,
    /// Nanoseconds that were spent on showing it.
    pub spent: AtomicU64,
}

impl Default for Published {
    /// Nothing yet.
    fn default() -> Self {
        Published {
            document: watch::Sender::new(Arc::new(json!({}))),
            status: watch::Sender::new(Arc::new(json!({"phase": "loading"}))),
            pictures: [watch::Sender::new(None), watch::Sender::new(None)],
            denoised: watch::Sender::new(None),
            spent: AtomicU64::new(0),
        }
    }
}

impl Published {
    /// The picture to be seen: where it is wanted denoised, the last one that is, if it is of the same render.
    pub fn seen(&self, source: usize, denoised: bool) -> Option<Arc<Picture>> {
        let picture = self.pictures[source].borrow().clone()?;
        let is_wanted = denoised && source == 0 && !picture.is_preview;
        let without_noise =
            self.denoised.borrow().clone().filter(|without_noise| is_wanted && without_noise.render == picture.render);
        Some(without_noise.unwrap_or(picture))
    }
}

/// The engine, from outside.
#[derive(Clone)]
pub struct Live {
    pub(super) commands: Sender<Command>,
    pub(super) waiting: Arc<AtomicUsize>,
    pub(super) halt: Arc<Mutex<Option<Halt>>>,
    pub(super) document: Arc<Mutex<Document>>,
}

/// Whether a change of the document comes to something.
type Trial = Box<dyn FnOnce(&mut Document) -> bool + Send>;

impl Command {
    /// What finds out whether there is something else to render after it, for those that may change that.
    fn trial(&self) -> Option<Trial> {
        match self {
            Command::Camera(Some(_), _) | Command::End => Some(Box::new(|_| true)),
            Command::Camera(None, _) => Some(Box::new(|document| !document.is_seen_from(&None))),
            Command::Edit { edit, goes_on, .. } => {
                let (edit, goes_on) = (edit.clone(), *goes_on);
                Some(Box::new(move |document| document.edit(edit, goes_on).is_ok()))
            }
            Command::Undo(again) => {
                let again = *again;
                Some(Box::new(move |document| document.undo(again).is_some_and(|scene| scene.is_ok())))
            }
            _ => None,
        }
    }
}

impl Live {
    /// Hands a command over. One that changes what is to be rendered ends the batch under way, as soon as it is known to come to something.
    pub fn send(&self, command: Command) {
        let trial = command.trial();
        let halt = lock(&self.halt).clone();
        self.waiting.fetch_add(1, SeqCst);
        // An engine that has ended takes none.
        let _ = self.commands.send(command);
        if let (Some(halt), Some(trial)) = (halt, trial) {
            self.halt_if(halt, trial);
        }
    }

    /// Ends the batch under way if a file of the scene has changed and can be read.
    pub fn heed_files(&self) {
        if lock(&self.document).is_outdated()
            && let Some(halt) = lock(&self.halt).clone()
        {
            self.halt_if(halt, Box::new(|document| document.reload().is_ok()));
        }
    }

    /// Ends the batch of this `halt` if a trial on a copy of the document says so. Nobody waits for that.
    fn halt_if(&self, halt: Halt, trial: Trial) {
        let document = self.document.clone();
        // Without a thread the batch is waited for.
        let _ = std::thread::Builder::new().name("trial".into()).spawn(move || {
            let mut copy = lock(&document).clone();
            if trial(&mut copy) {
                halt.request();
            }
        });
    }
}

/// What nobody leaves half changed.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LoadOptions;
    use std::path::Path;

    #[test]
    fn only_what_comes_to_something_ends_a_batch() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/starter.json");
        let (mut document, _) = Document::open(&path, LoadOptions::default()).unwrap();
        let glass = |name: &str| {
            let path = ["materials", "flint", "dielectric", "ior"].map(str::to_string).to_vec();
            Command::Edit { edit: Edit { path, value: json!(name) }, goes_on: false, is_final: true }
        };
        let mut ends = |command: Command| command.trial().is_some_and(|trial| trial(&mut document));
        assert!(!ends(glass("no glass")) && !ends(Command::Undo(false)) && !ends(Command::Camera(None, true)));
        assert!(!ends(Command::Show) && !ends(Command::Undo(true)));
        assert!(ends(glass("N-BK7")) && ends(Command::Undo(false)) && ends(Command::Undo(true)) && ends(Command::End));
    }
}
