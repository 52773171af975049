//! The one error type a user meets: what is wrong, where, and what to do about it.

use std::path::{Path, PathBuf};

/// Everything that can go wrong with what a user hands to Abbe. Each displays as one line that names the place and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene description that does not say what it must: `file: $.json.path: problem; remedy`.
    #[error("{}: {path}: {problem}; {remedy}", .file.display())]
    Scene {
        /// The scene file.
        file: PathBuf,
        /// JSON path of the culprit, `$` being the root.
        path: String,
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// A file (mesh, image, spectrum, EXR) that cannot be read or written.
    #[error("{}: {problem}; {remedy}", .file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// A command-line request that makes no sense.
    #[error("{problem}; {remedy}")]
    Usage {
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// A device that failed at its work: what it had done before stands.
    #[error("{problem}; {remedy}")]
    Fault {
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// A device whose memory ran out: what it had done before stands, and with less to hold it may go on.
    #[error("{problem}; {remedy}")]
    OutOfMemory {
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The work was asked to stop ([`crate::render::Halt`]).
    #[error("interrupted")]
    Interrupted,
    /// No usable GPU adapter, or the adapter refused.
    #[error("{problem}; {remedy}")]
    Device {
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
}

impl Error {
    /// An error about a file as a whole.
    pub fn file(file: impl AsRef<Path>, problem: impl ToString, remedy: impl ToString) -> Self {
        Error::File { file: file.as_ref().to_path_buf(), problem: problem.to_string(), remedy: remedy.to_string() }
    }

    /// An error about the command line or an option's value.
    pub fn usage(problem: impl ToString, remedy: impl ToString) -> Self {
        Error::Usage { problem: problem.to_string(), remedy: remedy.to_string() }
    }

    /// An error of a device that failed at its work.
    pub fn fault(problem: impl ToString, remedy: impl ToString) -> Self {
        Error::Fault { problem: problem.to_string(), remedy: remedy.to_string() }
    }

    /// An error about the GPU.
    pub fn device(problem: impl ToString, remedy: impl ToString) -> Self {
        Error::Device { problem: problem.to_string(), remedy: remedy.to_string() }
    }
}

/// `Result` with Abbe's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// A user's string as it may stand in a one-line message: escaped and not too long.
pub(crate) fn quoted(text: &str) -> String {
    if text.chars().count() <= 60 { format!("{text:?}") } else { format!("{:?}...", text.chars().take(60).collect::<String>()) }
}

/// `did you mean "x"` for the nearest of `known`, or the list of them (or its size where it is long).
pub(crate) fn suggest<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let lower = word.chars().take(80).collect::<String>().to_lowercase();
    let nearest = known.iter().map(|k| (strsim::osa_distance(&lower, &k.to_lowercase()), *k)).min_by_key(|(d, _)| *d);
    match nearest {
        Some((distance, k)) if distance <= 2.max(k.len() / 3) => format!("did you mean {k:?}?"),
        _ if known.is_empty() => "there is none to choose from".into(),
        _ if known.len() <= 24 => format!("use one of {}", known.join(", ")),
        _ => format!("{} names are known, among them {}", known.len(), known[..8].join(", ")),
    }
}
