//! Color: CIE sums and differences, correlated color temperature, pictures and their marks, and how people see that two differ.

mod chromaticity;
mod cie;
mod flip;
mod picture;
