//! The exit pupil of a lens as places of the film see it: a search that finds it however small it is.

use super::{LensRay, Tracer};
use glam::{DVec2, dvec2};
use std::f64::consts::PI;

/// Places over a line through the pupil's plane at which the search for the pupil begins.
const PLACES: usize = 64;
/// Directions over half a turn in which the pupil's rim is sought.
const DIRECTIONS: usize = 25;
/// Halvings in a search: of a place by its size, of a rim by its distance.
const HALVINGS: usize = 12;
/// What directions between those and other wavelengths may need beyond them.
const MARGIN: f64 = 1.02;

/// Where light that reaches a place of the film, on the axis of x at some radius, comes through the plane of the exit pupil: an ellipse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PupilBound {
    /// x of its centre, m.
    pub center: f64,
    /// Half its extent along x and across, m; 0 where no light comes through.
    pub half: DVec2,
}

/// Points of the rim of the exit pupil, of which the half with y >= 0 is sought: it is its own mirror image.
pub(super) struct Rim {
    /// In the plane of the exit pupil, m.
    pub points: Vec<DVec2>,
    /// The rays before the lens that go through them, away from it.
    pub rays: Vec<LensRay>,
}

impl Rim {
    /// What light at any of `tracers` comes through to the place of the film that `ray` takes places of the pupil's plane to, at most `widest` from the axis.
    /// `None` if none does.
    pub fn find(tracers: &[Tracer], ray: impl Fn(DVec2) -> LensRay, widest: f64) -> Option<Rim> {
        let mut rim = Rim { points: Vec::new(), rays: Vec::new() };
        for tracer in tracers {
            let trace = |p: DVec2| tracer.trace(ray(p));
            let fill = |p: DVec2| trace(p).map_or(f64::INFINITY, |out| out.fill);
            let Some(center) = least(|x| fill(dvec2(x, 0.0)), widest).filter(|x| fill(dvec2(*x, 0.0)) <= 1.0) else { continue };
            let center = dvec2(center, 0.0);
            let mut reach = widest;
            for i in 0..DIRECTIONS {
                let along = DVec2::from_angle(PI * i as f64 / (DIRECTIONS - 1) as f64);
                let is_clear = |r: f64| fill(center + r * along) <= 1.0;
                // The rim is about as far as in the direction before; of the first nothing is known.
                let (mut inside, mut outside) = (0.0, 2.0 * reach);
                while is_clear(outside) && outside < 4.0 * widest {
                    (inside, outside) = (outside, 2.0 * outside);
                }
                let mut left = HALVINGS;
                while left > 0 {
                    let middle = 0.5 * (inside + outside);
                    if is_clear(middle) {
                        inside = middle
                    } else {
                        outside = middle
                    }
                    // Until it is met, halvings only tell its size.
                    left -= usize::from(inside > 0.0 || outside < 1e-12 * widest);
                }
                reach = outside;
                let p = center + inside * along;
                rim.points.push(p);
                rim.rays.extend(trace(p).map(|out| out.ray));
            }
        }
        (!rim.points.is_empty()).then_some(rim)
    }

    /// Middle of its extent along x, m.
    pub fn center(&self) -> f64 {
        let (lo, hi) = self.points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(p.x), hi.max(p.x)));
        0.5 * (lo + hi)
    }

    /// Half extents of the least ellipse about x = `center` of the proportions of its own box that has all of it.
    pub fn half(&self, center: f64) -> DVec2 {
        let from_center = || self.points.iter().map(|p| dvec2(p.x - center, p.y).abs());
        let half = from_center().fold(DVec2::ZERO, DVec2::max);
        let scale = from_center().map(|p| (p / half).length()).fold(1.0, f64::max);
        MARGIN * scale * half
    }
}

/// Where `f`, which falls towards one place and rises behind it, is least between -`widest` and `widest`; `None` where it is infinite throughout.
fn least(f: impl Fn(f64) -> f64, widest: f64) -> Option<f64> {
    let step = 2.0 * widest / (PLACES - 1) as f64;
    let places = (0..PLACES).map(|i| i as f64 * step - widest).map(|x| (x, f(x)));
    let (mut best, mut value) = places.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, value)| value.is_finite())?;
    let mut size = 0.5 * step;
    while value > 1.0 && size > 1e-12 * widest {
        let (x, v) =
            [best - size, best + size].map(|x| (x, f(x))).into_iter().fold((best, value), |a, b| if b.1 < a.1 { b } else { a });
        size *= if x == best { 0.5 } else { 1.0 };
        (best, value) = (x, v);
    }
    Some(best)
}
