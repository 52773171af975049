//! Answers of geometrical optics in double precision, by formulas that share nothing with the renderer.

use std::f64::consts::PI;

/// Unpolarised Fresnel reflectance at an angle of incidence, rad, onto an interface of relative index `n` (Born & Wolf, 1.5.2):
/// `(sin^2(i - t) / sin^2(i + t) + tan^2(i - t) / tan^2(i + t)) / 2`.
pub fn fresnel(incidence: f64, n: f64) -> f64 {
    if incidence == 0.0 {
        return ((n - 1.0) / (n + 1.0)).powi(2);
    }
    if incidence.sin() >= n {
        return 1.0;
    }
    let t = (incidence.sin() / n).asin();
    let (minus, plus) = (incidence - t, incidence + t);
    0.5 * ((minus.sin() / plus.sin()).powi(2) + (minus.tan() / plus.tan()).powi(2))
}

/// Tilt of a ray that passes an equilateral prism of index `n` at minimum deviation, against the base, on either side, rad; the
/// deviation is twice that.
pub fn prism_tilt(n: f64) -> f64 {
    (0.5 * n).asin() - PI / 6.0
}

/// Angle of incidence at which a ray that is reflected `k` times within a sphere of index `n` is deviated least, rad (Descartes):
/// `cos i = sqrt((n^2 - 1) / (k (k + 2)))`.
pub fn rainbow_incidence(n: f64, k: f64) -> f64 {
    ((n * n - 1.0) / (k * (k + 2.0))).sqrt().acos()
}

/// A ray in the plane: a point and a unit direction.
#[derive(Debug, Clone, Copy)]
pub struct Ray2 {
    /// Where it starts.
    pub at: [f64; 2],
    /// Where it goes.
    pub along: [f64; 2],
}

impl Ray2 {
    /// Refracted by the straight interface through `point` with unit normal `normal` (towards the ray's origin), into a relative
    /// index of `n`. The ray must arrive there and get through.
    pub fn refracted_at(self, point: [f64; 2], normal: [f64; 2], n: f64) -> Ray2 {
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let cos = -dot(self.along, normal);
        let distance = dot([point[0] - self.at[0], point[1] - self.at[1]], normal) / -cos;
        let at = [self.at[0] + distance * self.along[0], self.at[1] + distance * self.along[1]];
        let cos_t = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
        let along = [0, 1].map(|i| self.along[i] / n + (cos / n - cos_t) * normal[i]);
        Ray2 { at, along }
    }

    /// Height at which it crosses the vertical line at `x`.
    pub fn height_at(self, x: f64) -> f64 {
        self.at[1] + (x - self.at[0]) * self.along[1] / self.along[0]
    }
}

/// Height at which a ray that arrives along +x at polar angle `theta` of a mirrored cylinder of radius 1 around the origin crosses the
/// line at `x` after its reflection.
pub fn mirrored_height(theta: f64, x: f64) -> f64 {
    theta.sin() - (theta.cos() - x) * (2.0 * theta).tan()
}

/// Where an eye at `distance` radii from the centre of a mirroring ball sees, in it, what lies infinitely far at the angle `turn` from the way
/// that it looks at the centre: the angle of incidence there, and tangent-plane area (at distance 1) in the picture over solid angle.
pub fn mirrored_in_ball(distance: f64, turn: f64) -> (f64, f64) {
    // Of a ray at the angle a from the centre's the incidence is i, sin(i) = distance sin(a); the ball turns it by pi - 2 i, away from the axis.
    let incidence = |a: f64| (distance * a.sin()).asin();
    let turned = |a: f64| a + PI - 2.0 * incidence(a);
    let (mut near, mut rim) = (0.0, (1.0 / distance).asin());
    for _ in 0..200 {
        let middle = 0.5 * (near + rim);
        if turned(middle) > turn { near = middle } else { rim = middle }
    }
    let (a, i) = (near, incidence(near));
    let slope = 2.0 * distance * a.cos() / i.cos() - 1.0;
    (i, a.tan() / (a.cos() * a.cos()) / (turn.sin() * slope))
}

/// The first angle between `lo` and `hi` at which `f` has an extremum, by bisection of its slope, to 1e-9.
pub fn extremum(f: impl Fn(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    let slope = |x: f64| f(x + 1e-6) - f(x - 1e-6);
    let rises = slope(lo) > 0.0;
    while hi - lo > 1e-9 {
        let middle = 0.5 * (lo + hi);
        if (slope(middle) > 0.0) == rises { lo = middle } else { hi = middle }
    }
    0.5 * (lo + hi)
}

/// Share of a disc's diffuse light that arrives on a coaxial disc of the same radius, `ratio` radii away (Siegel & Howell, configuration 40):
/// `(X - sqrt(X^2 - 4)) / 2`, `X = 2 + ratio^2`.
pub fn disc_to_disc(ratio: f64) -> f64 {
    let x = 2.0 + ratio * ratio;
    0.5 * (x - (x * x - 4.0).sqrt())
}

/// Solid angle of a square of half side `a`, seen from `height` above its middle.
pub fn square_solid_angle(a: f64, height: f64) -> f64 {
    4.0 * (a * a / (height * (2.0 * a * a + height * height).sqrt())).atan()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_give_the_published_numbers() {
        let close = |a: f64, b: f64, digits: f64| assert!((a - b).abs() < 0.5001 * 0.1f64.powf(digits), "{a} is not {b}");
        close(fresnel(0.0, 1.5168), 0.04216, 5.0);
        let brewster = 1.5168f64.atan();
        close(brewster.to_degrees(), 56.604, 3.0);
        close(fresnel(brewster - 1e-12, 1.5168), 0.5 * ((1.5168f64.powi(2) - 1.0) / (1.5168f64.powi(2) + 1.0)).powi(2), 6.0);
        close((1.0f64 / 1.5168).asin().to_degrees(), 41.245, 3.0);
        close(2.0 * prism_tilt(1.5168).to_degrees(), 38.647, 3.0);
        close(disc_to_disc(2.0), 0.171573, 6.0);
        close(disc_to_disc(10.0), 0.009805, 6.0);
        // Twice through a prism's faces at minimum deviation.
        let (n, tilt) = (1.5168, prism_tilt(1.5168));
        let (sin, cos) = (PI / 6.0).sin_cos();
        let ray = Ray2 { at: [-0.25 - tilt.cos(), -tilt.sin()], along: [tilt.cos(), tilt.sin()] };
        let inside = ray.refracted_at([-0.25, 0.0], [-cos, sin], n);
        let out = inside.refracted_at([0.25, 0.0], [-cos, -sin], 1.0 / n);
        close(inside.along[1], 0.0, 12.0);
        close(out.along[1], -tilt.sin(), 12.0);
    }
}
