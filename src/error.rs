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
