//! How far two measurements are apart: by their errors ([`difference`]), as colours ([`lab`]) and as pictures ([`flip`]).

pub mod difference;
pub mod flip;
pub mod lab;
