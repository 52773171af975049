//! Faces of lenses: surfaces of revolution, flat rings around them, and the edge. Where two of them meet, both ask on which side of the common circle a ray
//! crosses the cylinder through it, and get one answer: a ray crosses one of the two, whatever rounding does.

use super::{Bounds, Profile, disc_half_extent};
use glam::DVec3;
use std::f64::consts::PI;

/// Steps of a search for a crossing of an asphere; each at least halves what is left.
const STEPS: u32 = 60;
/// Sums over a face are taken at so many radii.
const RADII: u32 = 256;

/// A face of a lens.
#[derive(Debug, Clone, PartialEq)]
pub struct LensFace {
    /// A point of the axis from which heights are measured: one for all faces that meet.
    pub base: DVec3,
    /// Unit axis.
    pub axis: DVec3,
    /// What the face is.
    pub form: LensForm,
}

/// What faces there are. Heights are along the axis over the base, m.
#[derive(Debug, Clone, PartialEq)]
pub enum LensForm {
    /// A surface of revolution, out to a circle around the axis.
    Surface {
        /// How high it is over its vertex.
        profile: Profile,
        /// Height of the vertex.
        vertex: f64,
        /// Height of the circle at which it ends.
        edge: f64,
        /// Radius of that circle.
        radius: f64,
        /// The outward normal is along the axis rather than against it.
        is_upper: bool,
    },
    /// A flat ring.
    Annulus {
        /// Height.
        height: f64,
        /// Radius of the hole.
        inner: f64,
        /// Radius of the whole.
        outer: f64,
        /// As for surfaces.
        is_upper: bool,
    },
    /// The lateral surface of a cylinder around the axis, its normal away from that.
    Edge {
        /// Height of the lower end.
        from: f64,
        /// Height of the upper end.
        to: f64,
        /// Radius.
        radius: f64,
    },
}

/// A ray as a face sees it.
struct Seen {
    /// Along and across the axis: origin and direction.
    oz: f64,
    dz: f64,
    o: DVec3,
    d: DVec3,
}

impl Seen {
    fn height(&self, t: f64) -> f64 {
        self.oz + t * self.dz
    }

    /// Squared distance from the axis.
    fn r2(&self, t: f64) -> f64 {
        (self.o + self.d * t).length_squared()
    }

    /// Where the ray enters and leaves the endless cylinder.
    fn tube(&self, radius: f64) -> Option<[f64; 2]> {
        let a = self.d.length_squared();
        let distance = self.o.length();
        if a == 0.0 {
            return (distance <= radius).then_some([f64::NEG_INFINITY, f64::INFINITY]);
        }
        // As for spheres (`roots`): without cancellation.
        let b = -self.o.dot(self.d) / a;
        let discriminant = (radius * radius - (self.o + self.d * b).length_squared()) / a;
        let q = b + discriminant.max(0.0).sqrt().copysign(b);
        if discriminant <= 0.0 || q == 0.0 {
            return None;
        }
        let other = (distance - radius) * (distance + radius) / a / q;
        Some([q.min(other), q.max(other)])
    }
}

impl LensFace {
    /// Distances along the ray from `origin` along unit `dir` at which it crosses, in order; infinite where it does not. `on`: the origin lies on this face.
    /// Of the crossings of an asphere with inflections two are found at most.
    pub(super) fn crossings(&self, origin: DVec3, dir: DVec3, on: bool) -> [f64; 2] {
        const NONE: [f64; 2] = [f64::INFINITY; 2];
        let f = origin - self.base;
        let (oz, dz) = (f.dot(self.axis), dir.dot(self.axis));
        let seen = Seen { oz, dz, o: f - self.axis * oz, d: dir - self.axis * dz };
        match &self.form {
            LensForm::Edge { from, to, radius } => {
                let a = seen.d.length_squared();
                let ends = if on && a > 0.0 { Some([-2.0 * seen.o.dot(seen.d) / a, f64::INFINITY]) } else { seen.tube(*radius) };
                let is_met = |t: &f64| *t > 0.0 && t.is_finite() && (*from..*to).contains(&seen.height(*t));
                let met = ends.map_or(NONE, |ends| ends.map(|t| if is_met(&t) { t } else { f64::INFINITY }));
                [met[0].min(met[1]), met[0].max(met[1])]
            }
            LensForm::Annulus { height, inner, outer, .. } => {
                let Some([enter, leave]) = seen.tube(*outer).filter(|_| !on && dz != 0.0) else { return NONE };
                let is_below = |t: f64| seen.height(t) < *height;
                let crosses = |from: f64, to: f64| to > from.max(0.0) && is_below(from.max(0.0)) != is_below(to);
                let is_met = match seen.tube(*inner) {
                    Some([first, last]) => crosses(enter, first) || crosses(last, leave),
                    None => crosses(enter, leave),
                };
                if is_met { [((height - oz) / dz).clamp(enter.max(f64::MIN_POSITIVE), leave), f64::INFINITY] } else { NONE }
            }
            LensForm::Surface { profile, vertex, edge, radius, .. } => {
                let Some([enter, leave]) = seen.tube(*radius).filter(|ends| ends[1] > 0.0) else { return NONE };
                let gap = |t: f64| seen.height(t) - vertex - profile.sag(seen.r2(t));
                let rate = |t: f64| {
                    let across = seen.o + seen.d * t;
                    dz - profile.slope_over_r(across.length_squared()) * across.dot(seen.d)
                };
                let start = enter.max(f64::MIN_POSITIVE);
                let starts_below = if on {
                    rate(0.0) < 0.0
                } else if enter > 0.0 {
                    seen.height(enter) < *edge
                } else {
                    gap(0.0) < 0.0
                };
                let crosses_once = starts_below != (seen.height(leave) < *edge);
                if on && !crosses_once {
                    return NONE;
                }
                let (conic, is_crossed) = conic_roots(profile, &seen, *vertex, on);
                if profile.aspheric.is_empty() {
                    if crosses_once {
                        return [conic[usize::from(!starts_below)].max(start).min(leave), f64::INFINITY];
                    }
                    let is_met = |t: f64| {
                        t > start && t < leave && (1.0 + profile.conic) * profile.curvature * (seen.height(t) - vertex) < 1.0
                    };
                    let roots = [conic[0].min(conic[1]), conic[0].max(conic[1])];
                    return if is_crossed && roots.into_iter().all(is_met) { roots } else { NONE };
                }
                // Within the heights that the surface has.
                let (low, high) = profile.range(*radius);
                let slab = [low, high].map(|h| (vertex + h - oz) / dz);
                let margin = 1e-3 * (slab[1] - slab[0]).abs() + f64::MIN_POSITIVE;
                let (mut near, mut far) = (start, leave);
                if dz != 0.0 {
                    near = near.max(slab[0].min(slab[1]) - margin);
                    far = far.min(slab[0].max(slab[1]) + margin);
                }
                let search = |from: f64, to: f64, below: bool, first: f64| {
                    let (mut lo, mut hi, mut t) = (from, to, first);
                    for _ in 0..STEPS {
                        if !(t > lo && t < hi) {
                            t = 0.5 * (lo + hi);
                        }
                        let off = gap(t);
                        if (off < 0.0) == below {
                            lo = t
                        } else {
                            hi = t
                        }
                        t -= off / rate(t);
                    }
                    t.max(from).min(to)
                };
                if crosses_once {
                    return [search(near, far, starts_below, conic[usize::from(!starts_below)]), f64::INFINITY];
                }
                // Twice or not at all: the farthest off on the other side is between both.
                let grows = rate(near) > 0.0;
                if near >= far || grows != starts_below || (rate(far) > 0.0) == grows {
                    return NONE;
                }
                let (mut lo, mut hi) = (near, far);
                for _ in 0..STEPS {
                    let middle = 0.5 * (lo + hi);
                    if (rate(middle) > 0.0) == grows { lo = middle } else { hi = middle }
                }
                if (gap(lo) < 0.0) == starts_below {
                    return NONE;
                }
                let middle = |a: f64, b: f64| 0.5 * (a + b);
                [search(near, lo, starts_below, middle(near, lo)), search(lo, far, !starts_below, middle(lo, far))]
            }
        }
    }

    /// The point of the face next to `p`, and the outward normal there.
    pub(super) fn at(&self, p: DVec3) -> (DVec3, DVec3) {
        let f = p - self.base;
        let height = f.dot(self.axis);
        let across = f - self.axis * height;
        match &self.form {
            LensForm::Edge { radius, .. } => {
                let n = across.normalize();
                (self.base + self.axis * height + n * *radius, n)
            }
            LensForm::Annulus { height, is_upper, .. } => {
                (self.base + across + self.axis * *height, if *is_upper { self.axis } else { -self.axis })
            }
            LensForm::Surface { profile, vertex, is_upper, .. } => {
                let r2 = across.length_squared();
                let n = (self.axis - across * profile.slope_over_r(r2)).normalize();
                (self.base + across + self.axis * (vertex + profile.sag(r2)), if *is_upper { n } else { -n })
            }
        }
    }

    /// Whether it is a surface with aspheric terms.
    pub fn is_asphere(&self) -> bool {
        matches!(&self.form, LensForm::Surface { profile, .. } if !profile.aspheric.is_empty())
    }

    /// Radius of the circle around all of it.
    pub fn radius(&self) -> f64 {
        match &self.form {
            LensForm::Surface { radius, .. } | LensForm::Edge { radius, .. } => *radius,
            LensForm::Annulus { outer, .. } => *outer,
        }
    }

    /// Least and greatest height.
    pub fn heights(&self) -> (f64, f64) {
        match &self.form {
            LensForm::Edge { from, to, .. } => (*from, *to),
            LensForm::Annulus { height, .. } => (*height, *height),
            LensForm::Surface { profile, vertex, radius, .. } => {
                let (lo, hi) = profile.range(*radius);
                (vertex + lo, vertex + hi)
            }
        }
    }

    /// Box around it.
    pub(super) fn bounds(&self) -> Bounds {
        let half = disc_half_extent(self.axis, self.radius());
        let (low, high) = self.heights();
        let [a, b] = [low, high].map(|h| self.base + self.axis * h);
        Bounds { min: a.min(b) - half, max: a.max(b) + half }
    }

    /// Middles of the circles at which it ends: where other faces meet it.
    pub fn ends(&self) -> Vec<DVec3> {
        let at = |height: f64| self.base + self.axis * height;
        match &self.form {
            LensForm::Edge { from, to, .. } => vec![at(*from), at(*to)],
            LensForm::Annulus { height, .. } => vec![at(*height)],
            LensForm::Surface { edge, .. } => vec![at(*edge)],
        }
    }

    /// Area, m^2; the vector of the area, m^2; and the face's share in the volume of the body that it bounds, m^3 (a third of the flux of the position).
    pub fn sums(&self) -> (f64, DVec3, f64) {
        // Rings by the midpoint rule.
        let over = |inner: f64, outer: f64, is_upper: bool, profile: &Profile, vertex: f64| {
            let side = if is_upper { 1.0 } else { -1.0 };
            let vector = self.axis * (side * PI * (outer * outer - inner * inner));
            let (mut area, mut volume) = (0.0, self.base.dot(vector) / 3.0);
            let step = (outer - inner) / f64::from(RADII);
            for i in 0..RADII {
                let r = inner + (f64::from(i) + 0.5) * step;
                let (ring, slope) = (2.0 * PI * r * step, r * profile.slope_over_r(r * r));
                area += ring * (1.0 + slope * slope).sqrt();
                volume += side * ring * (vertex + profile.sag(r * r) - r * slope) / 3.0;
            }
            (area, vector, volume)
        };
        match &self.form {
            LensForm::Edge { from, to, radius } => {
                (2.0 * PI * radius * (to - from), DVec3::ZERO, PI * radius * radius * (to - from) * 2.0 / 3.0)
            }
            LensForm::Annulus { height, inner, outer, is_upper } => over(*inner, *outer, *is_upper, &Profile::FLAT, *height),
            LensForm::Surface { profile, vertex, radius, is_upper, .. } => over(0.0, *radius, *is_upper, profile, *vertex),
        }
    }

    /// Points of the face, most of them near where it ends, and outward normals there.
    pub fn points(&self) -> Vec<(DVec3, DVec3)> {
        let (x, y) = self.axis.any_orthonormal_pair();
        let around = |radius: f64, height: f64| {
            (0..8).map(move |i| {
                let (sin, cos) = (f64::from(i) * PI / 4.0).sin_cos();
                self.at(self.base + (x * cos + y * sin) * radius + self.axis * height)
            })
        };
        match &self.form {
            LensForm::Edge { from, to, radius } => {
                [0.001, 0.5, 0.999].into_iter().flat_map(|share| around(*radius, from + share * (to - from))).collect()
            }
            LensForm::Annulus { height, inner, outer, .. } => around(0.5 * (inner + outer), *height).collect(),
            LensForm::Surface { radius, .. } => {
                [0.001, 0.5, 0.999].into_iter().flat_map(|share| around(share * radius, 0.0)).collect()
            }
        }
    }

    /// Under a similarity: `point` carries points, `direction` unit vectors.
    pub fn placed(&self, point: impl Fn(DVec3) -> DVec3, direction: impl Fn(DVec3) -> DVec3, scale: f64) -> Self {
        let form = match self.form.clone() {
            LensForm::Surface { profile, vertex, edge, radius, is_upper } => LensForm::Surface {
                profile: profile.scaled(scale),
                vertex: vertex * scale,
                edge: edge * scale,
                radius: radius * scale,
                is_upper,
            },
            LensForm::Annulus { height, inner, outer, is_upper } => {
                LensForm::Annulus { height: height * scale, inner: inner * scale, outer: outer * scale, is_upper }
            }
            LensForm::Edge { from, to, radius } => LensForm::Edge { from: from * scale, to: to * scale, radius: radius * scale },
        };
        LensFace { base: point(self.base), axis: direction(self.axis), form }
    }
}

/// Where the ray crosses the conic, upwards and downwards through the sheet that has the vertex, and whether it does: else both are where it is nearest. From
/// a point `on` the conic both are the other crossing.
fn conic_roots(profile: &Profile, seen: &Seen, vertex: f64, on: bool) -> ([f64; 2], bool) {
    let (c, k, dz) = (profile.curvature, profile.conic, seen.dz);
    let a = c * (1.0 + k * dz * dz);
    // F = c (x^2 + y^2 + (1 + k) z^2) - 2 z grows downwards near the vertex. Half of dF/dt at a point, and F there:
    let half_b = |z: f64, along: f64| c * (along + k * z * dz) - dz;
    let z = seen.oz - vertex;
    let along = seen.o.dot(seen.d) + z * dz;
    if on {
        return ([-2.0 * half_b(z, along) / a; 2], true);
    }
    // From the ray's nearest point to the vertex, so that far origins do not cost digits.
    let (o, z) = (seen.o - seen.d * along, z - along * dz);
    let b = half_b(z, o.dot(seen.d) + z * dz);
    let f = c * (o.length_squared() + (1.0 + k) * z * z) - 2.0 * z;
    let discriminant = b * b - a * f;
    let root = discriminant.max(0.0).sqrt();
    // At + b = -root upwards, root downwards; of both forms the one that does not cancel.
    let roots = [-root, root].map(|root| if b * root >= 0.0 { f / (-b - root) - along } else { (root - b) / a - along });
    (roots, discriminant > 0.0)
}
