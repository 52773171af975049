//! From spectra to colours and back: CIE XYZ ([`cie`]), XYZ from bin averages ([`bins`]), colour spaces ([`space`], [`convert`]), white balance
//! ([`adapt`]), what chromaticities say ([`chromaticity`]), and spectra that have a colour ([`upsample`], [`lamp`]).

pub mod adapt;
pub mod bins;
pub mod chromaticity;
pub mod cie;
pub mod convert;
pub mod lamp;
pub mod space;
pub mod upsample;
