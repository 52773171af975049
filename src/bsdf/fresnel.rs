//! Fresnel reflectance of unpolarised light at smooth interfaces.

use super::thin_film::Stack;
use glam::{DVec3, dvec3};

/// Reflectance of a dielectric interface for the cosine of incidence `cos_i` in [0, 1]; `eta` is the far index over the near one. Exactly 1
/// from the critical angle on (Born & Wolf, Principles of Optics, 7th ed., eq. 1.5.21).
pub fn dielectric(cos_i: f64, eta: f64) -> f64 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let Some(cos_t) = cos_transmitted(cos_i, eta) else { return 1.0 };
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Cosine of the refracted direction, or `None` under total internal reflection (grazing refraction, sine exactly 1, counts as total).
pub fn cos_transmitted(cos_i: f64, eta: f64) -> Option<f64> {
    let sin2_t = (1.0 - cos_i) * (1.0 + cos_i) / (eta * eta);
    if sin2_t < 1.0 { Some((1.0 - sin2_t).sqrt()) } else { None }
}

/// The refraction of `wo` (any direction with `wo . m > 0`) at a facet with unit normal `m`, pointing away on the far side.
pub fn refract(wo: DVec3, m: DVec3, eta: f64) -> Option<DVec3> {
    let cos_i = wo.dot(m).min(1.0);
    let cos_t = cos_transmitted(cos_i, eta)?;
    Some((m * (cos_i / eta - cos_t) - wo / eta).normalize())
}

/// The mirror image of `wo` about the unit normal `m`.
pub fn reflect(wo: DVec3, m: DVec3) -> DVec3 {
    m * (2.0 * wo.dot(m)) - wo
}

/// Reflectance of a metal of index `eta + i k` relative to the surroundings, for the cosine of incidence `cos_i` in [0, 1]
/// (Born & Wolf, sec. 14.2; in the form of Sébastien Lagarde, "Memo on Fresnel equations", 2013).
pub fn conductor(cos_i: f64, eta: f64, k: f64) -> f64 {
    let c = cos_i.clamp(0.0, 1.0);
    let (c2, s2) = (c * c, (1.0 - c) * (1.0 + c));
    let t0 = eta * eta - k * k - s2;
    let a2_b2 = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (a2_b2 + t0)).max(0.0).sqrt();
    let perpendicular = (a2_b2 + c2 - 2.0 * c * a) / (a2_b2 + c2 + 2.0 * c * a);
    let t3 = c2 * a2_b2 + s2 * s2;
    let t4 = 2.0 * c * a * s2;
    // At grazing incidence on a medium like vacuum both sums vanish together; the reflectance is then that of grazing incidence.
    if t3 + t4 == 0.0 {
        return 1.0;
    }
    0.5 * perpendicular * (1.0 + (t3 - t4) / (t3 + t4))
}

/// What is known of a metal at one wavelength.
#[derive(Debug, Clone, Copy)]
pub enum Metal {
    /// Its index relative to the surroundings, `eta + i k`.
    Index(f64, f64),
    /// Its reflectance at normal incidence alone.
    Reflectance(f64),
    /// It lies under a film.
    Filmed(Stack),
}

impl Metal {
    /// Reflectance at this cosine of incidence: [`conductor`], [`Stack::reflectance`], or `f0 + (1 - f0) (1 - cos)^5` (Schlick 1994, eq. 15).
    pub fn at(self, cos_i: f64) -> f64 {
        match self {
            Metal::Index(eta, k) => conductor(cos_i, eta, k),
            Metal::Filmed(stack) => stack.reflectance(cos_i),
            Metal::Reflectance(f0) => f0 + (1.0 - f0) * (1.0 - cos_i.clamp(0.0, 1.0)).powi(5),
        }
    }

    /// `2 int_0^1 F(mu) mu dmu`.
    pub fn average(self) -> f64 {
        average(|mu| self.at(mu))
    }
}

/// Reflectance of a pane with both its faces and all inner bounces: `2R / (1 + R)`.
pub fn thin_pane(cos_i: f64, eta: f64) -> f64 {
    let r = dielectric(cos_i, eta);
    2.0 * r / (1.0 + r)
}

/// Likewise of one with an ideal anti-reflection coating: what is not reflected totally gets through.
pub fn antireflective(cos_i: f64, eta: f64) -> f64 {
    f64::from(u8::from(cos_transmitted(cos_i, eta).is_none()))
}

/// `2 int_0^1 F(mu) mu dmu` for a dielectric interface: the reflectance under uniform light.
pub fn average_dielectric(eta: f64) -> f64 {
    if eta < 1.0 {
        // From the dense side the integrand has a square-root edge at the critical angle. Each transmitted ray is one of the other side
        // reversed, and solid angles scale with eta^2, so the smooth integral of that side gives this one.
        return 1.0 - eta * eta * (1.0 - average_dielectric(1.0 / eta));
    }
    average(|mu| dielectric(mu, eta))
}

/// `2 int_0^1 f(mu) mu dmu` by three-point Gauss-Legendre on 16 pieces, squeezed towards grazing incidence where Fresnel bends.
fn average(f: impl Fn(f64) -> f64) -> f64 {
    const PIECES: usize = 16;
    let h = 1.0 / PIECES as f64;
    let d = 0.5 * h * 0.6f64.sqrt();
    let mut sum = 0.0;
    for p in 0..PIECES {
        let mid = (p as f64 + 0.5) * h;
        for (x, w) in [(mid - d, 5.0), (mid, 8.0), (mid + d, 5.0)] {
            // mu = x^2, so that 2 mu dmu = 4 x^3 dx.
            sum += w / 18.0 * h * 4.0 * x * x * x * f(x * x);
        }
    }
    sum
}

/// Refraction at the plane `z = 0` of the local frame.
pub fn refract_flat(wo: DVec3, eta: f64) -> Option<DVec3> {
    let cos_t = cos_transmitted(wo.z, eta)?;
    Some(dvec3(-wo.x / eta, -wo.y / eta, -cos_t).normalize())
}
