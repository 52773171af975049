//! What a scene needs, worked out before a shader is compiled: only that is in the pipeline.

use super::features::{Feature, Features, Group, Needs, Pass, SCATTERING};
use crate::scene::{FilmSettings, Light, Scene, Tile};
use std::fmt;

/// The ways in which paths are found; all of them unless told otherwise. What one cannot find, or finds badly, the others do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Techniques {
    /// Camera paths that meet a light by themselves.
    pub bsdf_sampling: bool,
    /// Camera paths that are connected to a light wherever they scatter (next-event estimation).
    pub next_event_estimation: bool,
    /// Light paths that are connected to the sensor wherever they scatter.
    pub light_paths: bool,
    /// Light paths that are merged where camera paths arrive by way of metal or glass.
    pub merging: bool,
    /// Light paths are sent to where they are of use.
    pub guiding: bool,
    /// Camera paths are sent to where errors are large.
    pub adaptive_sampling: bool,
    /// Wavelengths that part in glass share a way where their own end within a part of a pixel of each other.
    pub wavelength_sharing: bool,
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            bsdf_sampling: true,
            next_event_estimation: true,
            light_paths: true,
            merging: true,
            guiding: true,
            adaptive_sampling: true,
            wavelength_sharing: true,
        }
    }
}

/// The features of a scene's kernels.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What the camera pass's kernels have.
    pub camera: Features,
    /// Likewise for the light pass, if the scene has one: something bends light (or a lamp lights fog), and something scatters it to the sensor.
    pub light: Option<Features>,
    /// Likewise for the pass of AOVs, which follows no paths.
    pub aovs: Features,
    /// Wavelengths that a path carries.
    pub wavelengths: u32,
    /// Wavelength bins of the film.
    pub bins: u32,
    /// Bytes of all pictures on surfaces.
    pub texture_bytes: u64,
    /// How paths are found.
    pub techniques: Techniques,
    /// Which part of the picture is rendered, if it is not all, and what light paths mean for it, in words.
    pub part: Option<String>,
    /// Light that no pass finds, and what to do, one line each.
    pub blind_spots: Vec<String>,
}

impl Plan {
    /// The plan for this scene, with these techniques.
    pub fn new(scene: &Scene, techniques: Techniques) -> Self {
        let mut needs = Needs::new(scene, techniques);
        let camera = needs.of(Pass::Camera);
        Plan {
            camera,
            light: camera.has(Feature::Caustics).then(|| needs.of(Pass::Light)),
            aovs: needs.of(Pass::Aov),
            wavelengths: super::Wavelengths::per_path(scene.film.bins.count),
            bins: scene.film.bins.count,
            texture_bytes: crate::scene::texture::bytes(scene),
            techniques,
            part: part(&scene.film, camera.has(Feature::Caustics)),
            blind_spots: blind_spots(scene, camera),
        }
    }

    /// The same, and the passes count what they do ([`crate::stats::Counts`]), which takes time of its own.
    pub fn counted(mut self) -> Self {
        self.change(|f| f.with(Feature::Counted));
        self
    }

    /// The same, and lights are chosen by power, however many there are.
    pub fn with_lights_by_power(mut self) -> Self {
        self.change(|f| f.without(Feature::LightGrid));
        self
    }

    fn change(&mut self, change: impl Fn(Features) -> Features) {
        std::iter::once(&mut self.camera).chain(&mut self.light).for_each(|f| *f = change(*f));
    }

    /// The axes of [`super::guide`] along which light paths from so many lights are guided, if they are, and those that aim (light/emit.wgsl).
    pub(super) fn guides(&self, lights: u32) -> Option<[[bool; super::guide::AXES]; 2]> {
        let distant = self.has(Feature::LightEnvironment);
        let on_light = distant || self.has(Feature::LightArea) || self.has(Feature::LightBeam);
        let direction = distant || self.has(Feature::LightArea) || self.has(Feature::LightPoint);
        let aims = [distant, false, self.has(Feature::LightArea) || self.has(Feature::LightPoint), false, false, false];
        self.has(Feature::Guided)
            .then_some([[on_light, on_light, direction, direction, lights > 1, self.has(Feature::Dispersion)], aims])
    }

    /// True if the camera pass has this feature.
    pub fn has(&self, feature: Feature) -> bool {
        self.camera.has(feature)
    }

    /// Whether blocks of pixels have samples by their errors. Where a pass has no wavelength in many bins, all of its passes are needed everywhere; a lens
    /// scatters the wavelengths of a sample over blocks.
    pub fn is_adaptive(&self) -> bool {
        self.techniques.adaptive_sampling && !self.has(Feature::ManyBins) && !self.has(Feature::SensorLens)
    }

    /// Whether wavelengths that part in glass share a way where it comes to nearly the same (shaders/path/hero.wgsl).
    pub fn shares_ways(&self) -> bool {
        self.techniques.wavelength_sharing && self.has(Feature::Dispersion)
    }

    /// Whether what is found is blurred within a pixel, the less the longer a render takes ([`super::mean_squared_radius`]): where light paths are merged, or
    /// wavelengths share a way.
    pub fn is_blurred(&self) -> bool {
        self.has(Feature::Merging) || self.shares_ways()
    }

    /// Bytes of a sum over camera paths: a float, or quanta where a lens brings a path to several pixels.
    pub(super) fn bytes_of_sum(&self) -> u64 {
        if self.has(Feature::SensorLens) { 8 } else { 4 }
    }

    /// WGSL constants of the plan.
    pub fn constants(&self) -> String {
        use super::brightness::BLOCKS;
        use super::guide::{AXES, ROOT};
        use crate::bsdf::energy::{ETA_MAX, ETA_NODES, GRAIN_NODES, MIN_MEAN, MU_NODES};
        use crate::bsdf::sheen::NODES as SHEEN_NODES;
        use crate::scene::inside::up;
        use crate::scene::roughness::STEPS;
        let up = up();
        format!(
            "const GUIDE_AXES = {AXES}u;\nconst GUIDE_BLOCKS = {BLOCKS}u;\nconst GUIDE_ROOT = {ROOT}u;\nconst WAVELENGTHS = {}u;\nconst WAVELENGTHS4 = {}u;\nconst BEYOND = {}u;\nconst POINT_LINKS = {}u;\nconst BINS = {}u;\nconst ENERGY_MU = {MU_NODES}u;\nconst ENERGY_ETA = {ETA_NODES}u;\nconst ENERGY_GRAIN = {GRAIN_NODES}u;\nconst ENERGY_SHEEN = {SHEEN_NODES}u;\n\
             const ENERGY_ETA_MAX = {ETA_MAX:?};\nconst ENERGY_MIN_MEAN = {MIN_MEAN:?};\nconst ROUGHNESS_STEPS = {STEPS}u;\n\
             const UP = vec3f({:?}, {:?}, {:?});\n",
            self.wavelengths,
            self.wavelengths.div_ceil(4),
            super::Wavelengths::beyond(self.wavelengths),
            super::merge::links(self),
            self.bins,
            up.x,
            up.y,
            up.z
        )
    }
}

/// In words, the part of a film's picture that is rendered.
fn part(film: &FilmSettings, has_light_paths: bool) -> Option<String> {
    let Tile { x, y, width, height } = film.crop?;
    let times = film.pixels() as f64 / f64::from(width) / f64::from(height);
    let part = format!("{width}x{height} pixels from {x},{y} of {}x{}, {:.2} %", film.width, film.height, 100.0 / times);
    Some(if has_light_paths {
        format!(
            "{part}; a probe finds how many light paths are best for it, while those of the whole picture (--light-paths N) are {times:.1} N for each of its \
             camera paths"
        )
    } else {
        part
    })
}

/// What the techniques at hand cannot see.
fn blind_spots(scene: &Scene, features: Features) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut missing = |when: bool, line: &str| {
        if when && !out.iter().any(|o| o == line) {
            out.push(line.to_string());
        }
    };
    let has = |feature| features.has(feature);
    let camera = has(Feature::SensorCamera);
    // Where nothing catches what is bent there are no caustics to be missed.
    let caustics = has(Feature::Fresnel) && (!camera || SCATTERING.into_iter().any(has));
    missing(
        has(Feature::LightsPresent) && !has(Feature::BsdfSampling),
        "lamps seen straight or through metal and glass: BSDF-sampled emitter hits are switched off",
    );
    for kind in scene.lights.iter().filter(|light| light.is_delta()).map(Light::name) {
        missing(
            !has(Feature::NextEventEstimation),
            &format!("{kind}s on what scatters them: next-event estimation is switched off"),
        );
        missing(
            caustics && !has(Feature::LightTracing),
            &format!(
                "caustics of {kind}s on what is seen directly: a path cannot hit a light of no size, and light paths are switched off"
            ),
        );
        missing(
            caustics && camera && !has(Feature::Merging),
            &format!(
                "caustics of {kind}s seen through glass or in mirrors: a path cannot hit a light of no size, and nothing is merged"
            ),
        );
    }
    out
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan: camera paths of {} wavelengths into {} bins", self.wavelengths, self.bins)?;
        if self.light.is_some() {
            let ways = [
                (Feature::LightTracing, "connected to the sensor"),
                (Feature::Merging, "merged where metal and glass are looked into"),
            ];
            let ways: Vec<_> = ways.iter().filter(|(feature, _)| self.has(*feature)).map(|(_, text)| *text).collect();
            writeln!(f, "  caustics: light paths, {}", ways.join(" and "))?;
        }
        if self.shares_ways() {
            writeln!(f, "  dispersion: wavelengths share a way where they end within a part of a pixel")?;
        }
        if let Some(part) = &self.part {
            writeln!(f, "  part: {part}")?;
        }
        if self.is_adaptive() {
            writeln!(f, "  samples: more of them where errors are large")?;
        }
        let groups =
            [("shapes", Group::Shapes), ("materials", Group::Materials), ("media", Group::Media), ("lights", Group::Lights)];
        for (title, group) in groups {
            let words = |f: &Feature| f.words().filter(|(g, _)| *g == group && self.has(*f)).map(|(_, words)| words);
            let have: Vec<_> = Feature::ALL.iter().filter_map(words).collect();
            writeln!(f, "  {title}: {}", if have.is_empty() { "none".to_string() } else { have.join(", ") })?;
        }
        if self.texture_bytes > 0 {
            writeln!(f, "  pictures on surfaces: {:.1} MiB", self.texture_bytes as f64 / 1048576.0)?;
        }
        for line in &self.blind_spots {
            writeln!(f, "  not found: {line}")?;
        }
        Ok(())
    }
}
