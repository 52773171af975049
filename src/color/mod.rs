//! From spectra to colours: CIE XYZ ([`cie`]), XYZ from bin averages ([`bins`]), RGB ([`convert`]), colour differences ([`lab`]), what
//! chromaticities say ([`chromaticity`]) and the 8-bit picture ([`picture`]).

pub mod bins;
pub mod chromaticity;
pub mod cie;
pub mod convert;
pub mod lab;
pub mod picture;
