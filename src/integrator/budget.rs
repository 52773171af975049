//! How many light paths go with the camera paths of a pass: as many as make the error least for the work.
//!
//! The variances of both add up, and so does the work: with N light paths for each camera path Vc + Vl / N over Cc + N Cl is least at
//! N = sqrt(Vl Cc / (Vc Cl)). Variances are measured by a probe, work is counted in rays, so that the clock has no say.

use std::fmt;

/// Fewest and most light paths for a camera path. Few: the probe may have missed what they find. Many: passes become few, each with wavelengths of its own.
const RANGE: (f64, f64) = (0.125, 8.0);
/// Work of a light path's ray, in rays of camera paths: splats, and the search for visible points (lavapipe; measured on the comparison scenes).
const RAY: f64 = 2.0;
const MERGING_RAY: f64 = 2.5;

/// Light paths for each camera path, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Light paths for each camera path.
    pub light_paths: f64,
    /// What was measured, unless the number was given.
    pub probe: Option<Probe>,
}

/// What a probe measured, for one camera path and one light path per pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Variance of a pixel's radiance, relative as in [`crate::film::Film::relative_error`], mean over pixels: by camera paths.
    pub camera_variance: f64,
    /// Likewise by light paths.
    pub light_variance: f64,
    /// Rays of a camera path.
    pub camera_rays: f64,
    /// Rays of a light path.
    pub light_rays: f64,
}

impl Budget {
    /// The best split.
    pub fn from_probe(probe: Probe, merges: bool) -> Self {
        let cost = if merges { MERGING_RAY } else { RAY } * probe.light_rays / probe.camera_rays.max(1e-9);
        let ratio = probe.light_variance / probe.camera_variance.max(1e-30) / cost.max(1e-9);
        Self { light_paths: ratio.sqrt().clamp(RANGE.0, RANGE.1), probe: Some(probe) }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} light paths for each camera path", self.light_paths)?;
        match self.probe {
            None => write!(f, ", as told"),
            Some(p) => write!(
                f,
                " (a probe found relative variances of {:.2e} and {:.2e} with one of each, and {:.1} and {:.1} rays)",
                p.light_variance, p.camera_variance, p.light_rays, p.camera_rays
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_split_makes_the_error_least_for_the_work() {
        let probe = Probe { camera_variance: 0.3, light_variance: 2.0, camera_rays: 6.0, light_rays: 4.0 };
        let best = Budget::from_probe(probe, false).light_paths;
        let error = |n: f64| (0.3 + 2.0 / n) * (6.0 + n * RAY * 4.0);
        for n in [0.5 * best, 0.9 * best, 1.1 * best, 2.0 * best] {
            assert!(error(best) < error(n), "{best} {n}");
        }
        let useless = Probe { light_variance: 0.0, ..probe };
        assert_eq!(Budget::from_probe(useless, true).light_paths, RANGE.0);
        let needed = Probe { camera_variance: 0.0, ..probe };
        assert_eq!(Budget::from_probe(needed, true).light_paths, RANGE.1);
    }
}
