//! The faces of a lens as a solid: its surfaces, and what closes its pieces of glass around them.

use super::{Prescription, Surface};
use crate::geometry::{LensFace, LensForm, Profile};
use glam::DVec3;

/// How a face is finished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finish {
    /// Polished, to let light through.
    Polished,
    /// As edges are.
    Edge,
    /// Black, as the stop is.
    Black,
}

/// A face, and what it bounds.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Its geometry; light goes along +z, and the vertex of the first surface is at the origin.
    pub face: LensFace,
    /// The surface in front of the glass that it bounds; none for a stop between lenses or within one glass.
    pub glass: Option<usize>,
    /// How it is finished.
    pub finish: Finish,
}

impl Surface {
    /// Its height over the vertex, as geometry.
    pub fn profile(&self) -> Profile {
        let terms = self.aspheric.iter().rposition(|a| *a != 0.0).map_or(0, |last| last + 1);
        Profile { curvature: self.curvature(), conic: self.conic, aspheric: self.aspheric[..terms].to_vec() }
    }
}

/// The faces of a lens in the order in which light meets them, those of one piece of glass one after the other. Its pieces of glass are of this `diameter`, or as wide as the widest of their surfaces. Cemented glass has one diameter; flat rings
/// lead from surfaces that are smaller to the edge. Surfaces of a piece of glass that cross before it end where they do, in a sharp edge.
pub fn faces(lens: &Prescription, diameter: Option<f64>) -> Vec<Piece> {
    let mut out = Vec::new();
    let surfaces = &lens.surfaces;
    let mut heights = vec![0.0];
    surfaces.iter().for_each(|s| heights.push(heights[heights.len() - 1] + s.thickness));
    let widest = surfaces.iter().map(|s| s.semi_diameter).fold(0.0, f64::max);
    let mut first = 0;
    while first < surfaces.len() {
        let Some(_) = surfaces[first].glass else {
            if surfaces[first].stop && (first == 0 || surfaces[first - 1].glass.is_none()) {
                let inner = surfaces[first].semi_diameter;
                let outer = diameter.map_or(widest, |d| 0.5 * d).max(1.25 * inner);
                let base = DVec3::Z * heights[first];
                let form = LensForm::Annulus { height: 0.0, inner, outer, is_upper: false };
                let face = LensFace { base, axis: DVec3::Z, form };
                out.push(Piece { face, glass: None, finish: Finish::Black });
            }
            first += 1;
            continue;
        };
        // A run of cemented glass; surfaces within one glass do nothing, but for the stop.
        let glass_at = |i: usize| surfaces[i].glass.as_ref();
        let end = (first..surfaces.len()).find(|&i| glass_at(i).is_none()).unwrap_or(surfaces.len() - 1);
        let (parts, within): (Vec<usize>, Vec<usize>) =
            (first..=end).partition(|&i| i == first || glass_at(i) != glass_at(i - 1));
        let group = Group { surfaces, heights: &heights, parts: &parts, stop: within.into_iter().find(|&i| surfaces[i].stop) };
        let wide = parts.iter().map(|&i| surfaces[i].semi_diameter).fold(0.0, f64::max);
        group.add(diameter.map_or(wide, |d| (0.5 * d).max(wide)), &mut out);
        // The last surface of the run has air behind it.
        first = end + 1;
    }
    out
}

/// The distance from the axis at which two surfaces one behind the other cross, if that is before `reach`.
fn crossing(before: &Surface, behind: &Surface, reach: f64) -> Option<f64> {
    let room = |r: f64| before.thickness + behind.profile().sag(r * r) - before.profile().sag(r * r);
    const STEPS: u32 = 256;
    let radius = |i: u32| reach * f64::from(i) / f64::from(STEPS);
    let last = (1..=STEPS).find(|&i| room(radius(i)) < 0.0)?;
    let (mut lo, mut hi) = (radius(last - 1), radius(last));
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if room(middle) < 0.0 { hi = middle } else { lo = middle }
    }
    Some(lo)
}

/// Cemented glass, or a single piece.
struct Group<'a> {
    surfaces: &'a [Surface],
    /// Of vertices.
    heights: &'a [f64],
    /// Its surfaces.
    parts: &'a [usize],
    /// A stop within one of its pieces.
    stop: Option<usize>,
}

impl Group<'_> {
    fn add(&self, mut radius: f64, out: &mut Vec<Piece>) {
        let base = DVec3::Z * self.heights[self.parts[0]];
        // Twice, as what one piece of glass allows its neighbours may not.
        for pair in self.parts.windows(2).chain(self.parts.windows(2)) {
            let (before, behind) = (&self.surfaces[pair[0]], &self.surfaces[pair[1]]);
            let before = Surface { thickness: self.heights[pair[1]] - self.heights[pair[0]], ..before.clone() };
            let reach = before.semi_diameter.min(behind.semi_diameter).min(radius);
            radius = crossing(&before, behind, reach).unwrap_or(radius);
            if self.ends(pair[0], radius).1 > self.ends(pair[1], radius).1 {
                // A flat ring would cross the other side.
                radius = reach;
            }
        }
        for pair in self.parts.windows(2) {
            let [front, back] = [pair[0], pair[1]].map(|i| self.ends(i, radius));
            let mut push = |form: LensForm, finish: Finish| {
                let face = LensFace { base, axis: DVec3::Z, form };
                out.push(Piece { face, glass: Some(pair[0]), finish });
            };
            self.surface(pair[0], front, radius, false, &mut push);
            push(LensForm::Edge { from: front.1, to: back.1, radius }, Finish::Edge);
            self.surface(pair[1], back, radius, true, &mut push);
        }
        if let Some((inner, height)) = self.stop.map(|i| self.ends(i, radius)).filter(|(inner, _)| *inner < radius) {
            let form = LensForm::Annulus { height, inner, outer: radius, is_upper: false };
            out.push(Piece { face: LensFace { base, axis: DVec3::Z, form }, glass: None, finish: Finish::Black });
        }
    }

    /// Radius of a surface, and the height at which it ends.
    fn ends(&self, i: usize, radius: f64) -> (f64, f64) {
        let own = self.surfaces[i].semi_diameter.min(radius);
        (own, self.heights[i] - self.heights[self.parts[0]] + self.surfaces[i].profile().sag(own * own))
    }

    fn surface(&self, i: usize, (own, edge): (f64, f64), radius: f64, is_upper: bool, push: &mut impl FnMut(LensForm, Finish)) {
        let vertex = self.heights[i] - self.heights[self.parts[0]];
        let surface = &self.surfaces[i];
        push(LensForm::Surface { profile: surface.profile(), vertex, edge, radius: own, is_upper }, Finish::Polished);
        if own < radius {
            let finish = if surface.stop { Finish::Black } else { Finish::Edge };
            push(LensForm::Annulus { height: edge, inner: own, outer: radius, is_upper }, finish);
        }
    }
}
