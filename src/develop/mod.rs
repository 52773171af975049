//! What makes pictures of XYZ ([`picture`]): tone curve ([`tone`]) and gamut ([`gamut`], in [`oklab`]), for large pictures on a GPU ([`gpu`]).

pub mod gamut;
pub mod gpu;
pub mod oklab;
pub mod picture;
pub mod tone;
mod wgsl;
