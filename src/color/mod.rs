//! From spectra to colours: CIE XYZ ([`cie`]), XYZ from bin averages ([`bins`]), colour spaces ([`space`], [`convert`]), colour differences
//! ([`lab`]), what chromaticities say ([`chromaticity`]), and pictures ([`picture`]) by way of white balance ([`adapt`]), tone curve
//! ([`tone`]) and gamut ([`gamut`], in [`oklab`]). Large pictures are made on a GPU ([`gpu`]).

pub mod adapt;
pub mod bins;
pub mod chromaticity;
pub mod cie;
pub mod convert;
pub mod flip;
pub mod gamut;
pub mod gpu;
pub mod lab;
pub mod oklab;
pub mod picture;
pub mod space;
pub mod tone;
