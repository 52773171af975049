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
    /// Backward path tracing with next-event estimation, weighted with BSDF-sampled emitter hits
    Backward,
    /// Plain backward path tracing: BSDF-sampled emitter hits alone
    Plain,
    /// Light paths unguided
    Unguided,
    /// Light paths not merged
    #[value(alias = "ungathered")]
    Unmerged,
    /// Light paths merged, but not connected to the sensor
    #[value(alias = "unjoined")]
    Unconnected,
}

impl Method {
    /// The techniques that it does without.
    pub fn leaves_out(self) -> &'static [Technique] {
        match self {
            Method::All => &[],
            Method::Even => &[Technique::AdaptiveSampling],
            Method::Backward => &[Technique::LightPaths, Technique::Merging, Technique::Guiding, Technique::AdaptiveSampling],
            Method::Plain => &[
                Technique::NextEventEstimation,
                Technique::LightPaths,
                Technique::Merging,
                Technique::Guiding,
                Technique::AdaptiveSampling,
            ],
            Method::Unguided => &[Technique::Guiding],
            Method::Unmerged => &[Technique::Merging],
            Method::Unconnected => &[Technique::LightPaths],
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
            Method::Unmerged => "unmerged",
            Method::Unconnected => "unconnected",
        })
    }
}
