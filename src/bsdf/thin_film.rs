//! Thin films: what interferes in a layer of less than some wavelengths between two media, in double precision (Born & Wolf, Principles of Optics, 7th ed.,
//! sec. 1.6.4; the sum over all bounces is Airy's).

use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Sub};

/// A film between two media at one wavelength. Indices are relative to what the wavelength is measured in.
#[derive(Debug, Clone, Copy)]
pub struct Stack {
    /// Index of the medium that light comes from.
    pub near: f64,
    /// Index of the film.
    pub film: f64,
    /// Thickness of the film over the wavelength.
    pub waves: f64,
    /// Index `n + i k` of the medium beyond.
    pub far: (f64, f64),
}

impl Stack {
    /// Reflectance for unpolarised light at this cosine of incidence. What is not reflected enters the far medium, as films do not absorb.
    pub fn reflectance(&self, cos_i: f64) -> f64 {
        let (near, film, far) = (Complex(self.near, 0.0), Complex(self.film, 0.0), Complex(self.far.0, self.far.1));
        let c = cos_i.clamp(0.0, 1.0);
        // The tangential wave number, the same in all layers, over that of the wavelength; squared.
        let s2 = Complex(self.near * self.near * (1.0 - c) * (1.0 + c), 0.0);
        let normal = |n: Complex| (n * n - s2).sqrt();
        let q = [Complex(self.near * c, 0.0), normal(film), normal(far)];
        let delay = (q[1] * Complex(0.0, 4.0 * PI * self.waves)).exp();
        let airy = |a: Complex, b: Complex| ((a + b * delay) / (Complex(1.0, 0.0) + a * b * delay)).norm();
        let s = |a: usize, b: usize| (q[a] - q[b]) / (q[a] + q[b]);
        let n2 = [near * near, film * film, far * far];
        let p = |a: usize, b: usize| (n2[b] * q[a] - n2[a] * q[b]) / (n2[b] * q[a] + n2[a] * q[b]);
        if c == 0.0 { 1.0 } else { 0.5 * (airy(s(0, 1), s(1, 2)) + airy(p(0, 1), p(1, 2))) }
    }
}

#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn norm(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }

    /// The root that decays, or travels away from where the light came from; for an imaginary part of 0 or more.
    fn sqrt(self) -> Self {
        let size = self.norm().sqrt();
        Complex((0.5 * (size + self.0)).max(0.0).sqrt(), (0.5 * (size - self.0)).max(0.0).sqrt())
    }

    fn exp(self) -> Self {
        let (sin, cos) = self.1.sin_cos();
        Complex(self.0.exp() * cos, self.0.exp() * sin)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Complex(self.0 + b.0, self.1 + b.1)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Complex(self.0 - b.0, self.1 - b.1)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Complex(self.0 * b.0 - self.1 * b.1, self.0 * b.1 + self.1 * b.0)
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let size = b.norm();
        Complex((self.0 * b.0 + self.1 * b.1) / size, (self.1 * b.0 - self.0 * b.1) / size)
    }
}
