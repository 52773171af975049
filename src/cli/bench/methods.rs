//! The ways to render that are compared.

use crate::cli::device::Technique;
use std::fmt;

/// What a scene is rendered by.
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// All techniques
    All,
    /// Plain backward path tracing: chance hits and light samples
    Backward,
    /// Light paths unguided
    Unguided,
    /// Light paths not gathered
    Ungathered,
    /// Light paths gathered, but not joined to the sensor
    Unjoined,
}

impl Method {
    /// The techniques that it does without.
    pub fn leaves_out(self) -> &'static [Technique] {
        match self {
            Method::All => &[],
            Method::Backward => &[Technique::LightPaths, Technique::Gathering, Technique::Guiding],
            Method::Unguided => &[Technique::Guiding],
            Method::Ungathered => &[Technique::Gathering],
            Method::Unjoined => &[Technique::LightPaths],
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Method::All => "all",
            Method::Backward => "backward",
            Method::Unguided => "unguided",
            Method::Ungathered => "ungathered",
            Method::Unjoined => "unjoined",
        })
    }
}
