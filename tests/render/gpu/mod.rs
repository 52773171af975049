//! The GPU's side: what host and shaders share, what is compiled, the sampler and the intersectors on the adapter, and that the same
//! request gives the same bits.

mod adaptive;
mod boundary;
mod counters;
mod counts;
mod crop;
mod determinism;
mod develop;
mod directions;
mod emission;
mod errors;
mod intersect;
mod lens;
mod limits;
mod plan;
mod precision;
mod resume;
mod sampler;
mod sequence;
mod starts;
mod support;
mod translation;
mod wavelength_sharing;
