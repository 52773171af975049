//! The ways to render that are compared.

use crate::cli::device::Technique;
use std::fmt;

/// What a scene is rendered by.
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// All techniques
    All,
    /// As many camera paths in every pixel
    Even,
    /// Backward path tracing with light samples, weighted with chance hits
    Backward,
    /// Plain backward path tracing: chance hits alone
    Plain,
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
            Method::Even => &[Technique::AdaptiveSampling],
            Method::Backward => &[Technique::LightPaths, Technique::Gathering, Technique::Guiding, Technique::AdaptiveSampling],
            Method::Plain => &[
                Technique::LightSamples,
                Technique::LightPaths,
                Technique::Gathering,
                Technique::Guiding,
                Technique::AdaptiveSampling,
            ],
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
            Method::Even => "even",
            Method::Backward => "backward",
            Method::Plain => "plain",
            Method::Unguided => "unguided",
            Method::Ungathered => "ungathered",
            Method::Unjoined => "unjoined",
        })
    }
}
