//! What a scene needs, worked out before a shader is compiled: only that is in the pipeline.

use crate::geometry::{Bounds, bounds};
use crate::gpu::light_grid_pays;
use crate::scene::{Filter, Geometry, Light, Material, Mesh, Scene, Sensor, Shape};
use crate::spectrum::Ior;
use glam::DVec3;
use std::collections::BTreeMap;
use std::fmt;

/// Names of features and whether they are there.
pub type Features = BTreeMap<&'static str, bool>;

/// The ways in which paths are found; all of them unless told otherwise. What one cannot find, or finds badly, the others do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Techniques {
    /// Camera paths that meet a light by themselves.
    pub chance_hits: bool,
    /// Camera paths that are joined to a light wherever they scatter (next-event estimation).
    pub light_samples: bool,
    /// Light paths that are joined to the sensor wherever they scatter.
    pub light_paths: bool,
    /// Light paths that are gathered where camera paths arrive by way of metal or glass.
    pub gathering: bool,
    /// Light paths are sent to where they are of use.
    pub guiding: bool,
    /// Camera paths are sent to where errors are large.
    pub adaptive_sampling: bool,
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            chance_hits: true,
            light_samples: true,
            light_paths: true,
            gathering: true,
            guiding: true,
            adaptive_sampling: true,
        }
    }
}

/// The features of a scene's kernels.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Every feature that the camera pass's shaders may ask for, and whether this scene has it.
    pub camera: Features,
    /// Likewise for the light pass, if the scene has one: something bends light (or fog is lit by a spot or beam), and something scatters it to the sensor.
    pub light: Option<Features>,
    /// Wavelengths that a path carries.
    pub lanes: u32,
    /// Wavelength bins of the film.
    pub bins: u32,
    /// Bytes of all pictures on surfaces.
    pub texture_bytes: u64,
    /// How paths are found.
    pub techniques: Techniques,
    /// Light that no pass finds, and what to do, one line each.
    pub blind_spots: Vec<String>,
}

impl Plan {
    /// The plan for this scene, with these techniques.
    pub fn new(scene: &Scene, techniques: Techniques) -> Self {
        let used = used_materials(scene);
        let any = |f: &dyn Fn(&Material) -> bool| used.iter().any(|&m| f(&scene.materials[m]));
        let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
        let smooth_dielectric = any(&|m| matches!(m, Material::Dielectric { alpha, .. } if *alpha == 0.0));
        let rough_dielectric = any(&|m| matches!(m, Material::Dielectric { alpha, .. } if *alpha > 0.0));
        let thin = any(&|m| matches!(m, Material::ThinDielectric { .. }));
        let smooth_conductor =
            any(&|m| matches!(m, Material::Conductor { alpha, .. } | Material::ColoredConductor { alpha, .. } if *alpha == 0.0));
        let rough_conductor =
            any(&|m| matches!(m, Material::Conductor { alpha, .. } | Material::ColoredConductor { alpha, .. } if *alpha > 0.0));
        let smooth_coat = any(&|m| matches!(m, Material::Coated { alpha, .. } if *alpha == 0.0));
        let rough_coat = any(&|m| matches!(m, Material::Coated { alpha, .. } if *alpha > 0.0));
        let coat = smooth_coat || rough_coat;
        let sheen = any(&|m| matches!(m, Material::Sheen { .. }));
        let boundary = any(&|m| matches!(m, Material::Boundary { .. }));
        let dielectric = smooth_dielectric || rough_dielectric;
        let inner = volumes(scene, &used);
        let medium = |f: &dyn Fn(usize) -> bool| f(0) || inner.iter().any(|&i| f(i));
        let scattering = medium(&|i| !scene.interiors[i].sigma_s.is_zero());
        let absorbing = medium(&|i| !scene.interiors[i].sigma_a.is_zero());
        let dispersion = smooth_dielectric && medium(&|i| !scene.interiors[i].ior.is_constant_over(lo, hi));
        let diffuse = any(&|m| matches!(m, Material::Diffuse { .. }));
        let shape = |f: &dyn Fn(&Geometry) -> bool| scene.shapes.iter().any(|s| f(&s.geometry));
        let emits = |f: &dyn Fn(&Geometry) -> bool| {
            scene.shapes.iter().any(|s| f(&s.geometry) && s.emission.as_ref().is_some_and(|e| !e.radiance.is_zero()))
        };
        let light = |f: &dyn Fn(&Light) -> bool| scene.lights.iter().any(f);
        let area = emits(&|_| true);
        let sun = light(&|l| matches!(l, Light::Sun { .. }));
        let constant = light(&|l| matches!(l, Light::Constant { .. }));
        let profile = light(&|l| matches!(l, Light::Profile { .. }));
        let image = light(&|l| matches!(l, Light::Image(_)));
        let lights = area || !scene.lights.is_empty();
        let conductor = smooth_conductor || rough_conductor;
        // The reflectance of a metal or coat depends on what it lies in.
        let in_vacuum = scene.interiors[0].ior == Ior::constant(1.0);
        let interiors = dielectric || !inner.is_empty() || scattering || absorbing || ((conductor || coat) && !in_vacuum);
        let textured_lights = scene.shapes.iter().any(|s| s.emission.as_ref().is_some_and(|e| e.radiance.image().is_some()));
        let textured = any(&|m| match m {
            Material::Diffuse { reflectance: texture }
            | Material::ColoredConductor { reflectance: texture, .. }
            | Material::Mix { weight: texture, .. } => texture.image().is_some(),
            Material::Graded { .. } => true,
            _ => false,
        });
        let graded = any(&|m| matches!(m, Material::Graded { .. }));
        let normal_maps = any(&|m| matches!(m, Material::NormalMapped { .. }));
        let has_normals = |mesh: &Mesh| !mesh.normals.is_empty() || !mesh.tangents.is_empty();
        let lanes = super::Wavelengths::lanes(scene.film.bins.count);
        let features = BTreeMap::from([
            ("QUADRICS", shape(&|g| !matches!(g, Geometry::Mesh(_) | Geometry::Instance(_)))),
            ("SPHERES", shape(&|g| matches!(g, Geometry::Sphere { .. }))),
            ("DISCS", shape(&|g| matches!(g, Geometry::Disc { .. }))),
            ("CYLINDERS", shape(&|g| matches!(g, Geometry::Cylinder { .. }))),
            ("INSTANCES", shape(&|g| matches!(g, Geometry::Instance(_)))),
            (
                "SMOOTH_NORMALS",
                shape(&|g| match g {
                    Geometry::Mesh(mesh) => has_normals(mesh),
                    Geometry::Instance(instance) => has_normals(instance.mesh()),
                    _ => false,
                }),
            ),
            ("DIFFUSE", diffuse),
            ("DIELECTRIC", dielectric),
            ("SMOOTH_DIELECTRIC", smooth_dielectric),
            ("ROUGH_DIELECTRIC", rough_dielectric),
            ("THIN_DIELECTRIC", thin),
            ("CONDUCTOR", conductor),
            ("SMOOTH_CONDUCTOR", smooth_conductor),
            ("ROUGH_CONDUCTOR", rough_conductor),
            ("COAT", coat),
            ("SMOOTH_COAT", smooth_coat),
            ("ROUGH_COAT", rough_coat),
            ("GLOSSY", rough_conductor || rough_coat || sheen),
            ("ROUGH", rough_dielectric || rough_conductor || coat || sheen),
            ("FRESNEL", dielectric || thin || conductor || coat),
            ("TEXTURES", textured || textured_lights || normal_maps),
            ("NORMAL_MAPS", normal_maps),
            ("LIGHT_TEXTURES", textured_lights),
            ("FILM", used.iter().any(|m| scene.films.contains_key(m))),
            ("GRAIN", used.iter().any(|m| scene.grains.contains_key(m))),
            ("SHEEN", sheen),
            ("COLORED_CONDUCTOR", any(&|m| matches!(m, Material::ColoredConductor { .. }))),
            ("GRADED", graded),
            ("MIX", any(&|m| matches!(m, Material::Mix { .. }))),
            ("COMPOSITE", coat || sheen || graded || any(&|m| matches!(m, Material::Mix { .. } | Material::NormalMapped { .. }))),
            ("BOUNDARY", boundary),
            ("DISPERSION", dispersion),
            ("INTERIORS", interiors),
            ("MEDIA", scattering || absorbing),
            ("SCATTERING", scattering),
            ("CONTACT", volumes_touch(scene)),
            ("PASS_THROUGH", boundary || volumes_overlap(scene) || indices_match(scene)),
            ("LIGHTS_PRESENT", lights),
            ("LIGHT_GRID", techniques.light_samples && light_grid_pays(scene)),
            ("LIGHT_AREA", area),
            ("LIGHT_TRIANGLE", emits(&|g| matches!(g, Geometry::Mesh(_)))),
            ("LIGHT_SPHERE", emits(&|g| matches!(g, Geometry::Sphere { .. }))),
            ("LIGHT_DISC", emits(&|g| matches!(g, Geometry::Disc { .. }))),
            ("LIGHT_CYLINDER", emits(&|g| matches!(g, Geometry::Cylinder { .. }))),
            ("LIGHT_POINT", light(&|l| matches!(l, Light::Point { .. } | Light::Spot { .. } | Light::Profile { .. }))),
            ("LIGHT_PROFILE", profile),
            ("LIGHT_BEAM", light(&|l| matches!(l, Light::Beam { .. }))),
            ("LIGHT_SUN", sun),
            ("ENV_CONSTANT", constant),
            ("ENV_IMAGE", image),
            ("PRECISE_ANGLES", image || profile),
            ("LIGHT_ENVIRONMENT", sun || constant || image),
            ("SENSOR_PERSPECTIVE", matches!(scene.sensor, Sensor::Perspective { .. })),
            ("SENSOR_ORTHOGRAPHIC", matches!(scene.sensor, Sensor::Orthographic { .. })),
            ("SENSOR_PLANE", matches!(scene.sensor, Sensor::IrradiancePlane { .. })),
            ("LENS", matches!(scene.sensor, Sensor::Perspective { lens_radius, .. } if lens_radius > 0.0)),
            ("FILTER_TENT", matches!(scene.film.filter, Filter::Tent { .. })),
            ("FILTER_GAUSSIAN", matches!(scene.film.filter, Filter::Gaussian { .. })),
            ("MANY_BINS", lanes != scene.film.bins.count),
        ]);
        let camera = matches!(scene.sensor, Sensor::Perspective { .. } | Sensor::Orthographic { .. });
        let bends = dielectric || conductor || thin || coat;
        let gathers = diffuse || scattering;
        let scatters = gathers || rough_dielectric || rough_conductor || rough_coat || sheen;
        // Fog in the light of spots and beams is lit where few camera paths are.
        let shafts = scattering && light(&|l| matches!(l, Light::Spot { .. } | Light::Profile { .. } | Light::Beam { .. }));
        let caustics = lights && (bends || shafts) && (scatters || !camera);
        let joined = caustics && techniques.light_paths;
        let gathered = caustics && techniques.gathering && camera && bends && gathers;
        let caustics = joined || gathered;
        let mut base = features;
        base.extend([
            ("SENSOR_CAMERA", camera),
            ("CAUSTICS", caustics),
            ("JOINED", joined),
            ("GATHERED", gathered),
            ("GUIDED", caustics && techniques.guiding),
            ("CROSSINGS", joined && !camera),
            ("CHANCE", techniques.chance_hits),
            ("LIGHT_SAMPLES", lights && techniques.light_samples),
            ("COUNTED", false),
        ]);
        let variant = |light_paths: bool| {
            let connects =
                if light_paths { joined && scatters && camera } else { base["LIGHT_SAMPLES"] && (scatters || !camera) };
            let mut f = base.clone();
            f.extend([
                ("CAMERA_PATHS", !light_paths),
                ("LIGHT_PATHS", light_paths),
                // An irradiance sensor is crossed by light paths, but looks for lights itself.
                ("LIT_SENSOR", base["LIGHT_SAMPLES"] && !camera && !light_paths),
                ("CONNECT", connects),
                ("LANE_CHOICE", scattering || rough_dielectric || (light_paths && dispersion)),
                ("GATHERS_PAINT", light_paths && base["GATHERED"] && diffuse),
                ("ADJOINT_NORMALS", light_paths && (base["SMOOTH_NORMALS"] || base["NORMAL_MAPS"])),
            ]);
            f
        };
        Plan {
            camera: variant(false),
            light: caustics.then(|| variant(true)),
            lanes,
            bins: scene.film.bins.count,
            texture_bytes: crate::scene::texture::bytes(scene),
            techniques,
            blind_spots: blind_spots(scene, &base),
        }
    }

    /// The same, and the passes count what they do ([`crate::render::Counts`]), which takes time of its own.
    pub fn counted(mut self) -> Self {
        for features in std::iter::once(&mut self.camera).chain(&mut self.light) {
            features.insert("COUNTED", true);
        }
        self
    }

    /// The same, and lights are chosen by power, however many there are.
    pub fn with_lights_by_power(mut self) -> Self {
        for features in std::iter::once(&mut self.camera).chain(&mut self.light) {
            features.insert("LIGHT_GRID", false);
        }
        self
    }

    /// The axes of [`super::guide`] along which light paths from so many lights are guided, if they are, and those that aim (light/emit.wgsl).
    pub(super) fn guides(&self, lights: usize) -> Option<[[bool; super::guide::AXES]; 2]> {
        let distant = self.has("LIGHT_ENVIRONMENT");
        let on_light = distant || self.has("LIGHT_AREA") || self.has("LIGHT_BEAM");
        let direction = distant || self.has("LIGHT_AREA") || self.has("LIGHT_POINT");
        let aims = [distant, false, self.has("LIGHT_AREA") || self.has("LIGHT_POINT"), false, false, false];
        self.has("GUIDED").then_some([[on_light, on_light, direction, direction, lights > 1, self.has("DISPERSION")], aims])
    }

    /// True if the scene has this feature. Panics on an unknown name, which is a defect.
    pub fn has(&self, feature: &str) -> bool {
        self.camera[feature]
    }

    /// Whether blocks of pixels have samples by their errors. Where a pass has no wavelength in many bins, all of its passes are needed everywhere.
    pub fn is_adaptive(&self) -> bool {
        self.techniques.adaptive_sampling && !self.has("MANY_BINS")
    }

    /// The features of the pass of first hits, which follows no paths.
    pub fn first_hits(&self) -> Features {
        let mut features = self.camera.clone();
        features.extend([("CAMERA_PATHS", false), ("COUNTED", false)]);
        features
    }

    /// WGSL constants of the plan.
    pub fn constants(&self) -> String {
        use super::guide::{AXES, BLOCKS, ROOT};
        use crate::bsdf::energy::{ETA_MAX, ETA_NODES, GRAIN_NODES, MIN_MEAN, MU_NODES};
        use crate::bsdf::sheen::NODES as SHEEN_NODES;
        use crate::scene::roughness::STEPS;
        format!(
            "const GUIDE_AXES = {AXES}u;\nconst GUIDE_BLOCKS = {BLOCKS}u;\nconst GUIDE_ROOT = {ROOT}u;\nconst LANES = {}u;\nconst LANES4 = {}u;\nconst BINS = {}u;\nconst ENERGY_MU = {MU_NODES}u;\nconst ENERGY_ETA = {ETA_NODES}u;\nconst ENERGY_GRAIN = {GRAIN_NODES}u;\nconst ENERGY_SHEEN = {SHEEN_NODES}u;\n\
             const ENERGY_ETA_MAX = {ETA_MAX:?};\nconst ENERGY_MIN_MEAN = {MIN_MEAN:?};\nconst ROUGHNESS_STEPS = {STEPS}u;\n",
            self.lanes,
            self.lanes.div_ceil(4),
            self.bins
        )
    }
}

/// Materials that a path can meet: those of shapes, and what they mix.
fn used_materials(scene: &Scene) -> Vec<usize> {
    let mut is_used = vec![false; scene.materials.len()];
    let mut used: Vec<usize> = Vec::new();
    let mut todo: Vec<usize> = scene.shapes.iter().map(|s| s.material).collect();
    while let Some(m) = todo.pop() {
        if !std::mem::replace(&mut is_used[m], true) {
            used.push(m);
            match scene.materials[m] {
                Material::Mix { a, b, .. } => todo.extend([a, b]),
                Material::NormalMapped { base, .. } | Material::Coated { base, .. } | Material::Sheen { base, .. } => {
                    todo.push(base)
                }
                Material::Graded { first, ref levels, .. } => todo.extend(first..first + levels.len()),
                _ => {}
            }
        }
    }
    used
}

fn volumes(scene: &Scene, used: &[usize]) -> Vec<usize> {
    used.iter().filter_map(|&m| scene.interior_of(m)).collect()
}

/// True if the boxes of two volumes overlap, so that a surface may not be there because another volume rules.
fn volumes_overlap(scene: &Scene) -> bool {
    let is_volume = |s: &&Shape| scene.interior_of(s.material).is_some();
    some_meet(scene.shapes.iter().filter(is_volume).map(|s| (true, bounds(&s.geometry))).collect())
}

/// True if the box of a volume comes so close to another shape's that their surfaces may touch.
fn volumes_touch(scene: &Scene) -> bool {
    some_meet(scene.shapes.iter().map(|s| (scene.interior_of(s.material).is_some(), touch_box(s))).collect())
}

/// True if a volume has the index of what surrounds the scene, or of a volume that it may touch: their boundary is not there for light.
fn indices_match(scene: &Scene) -> bool {
    let mut alike: Vec<(&Ior, Vec<(bool, Bounds)>)> = vec![(&scene.interiors[0].ior, Vec::new())];
    for shape in &scene.shapes {
        let Some(interior) = scene.interior_of(shape.material) else { continue };
        let ior = &scene.interiors[interior].ior;
        match alike.iter().position(|(of, _)| *of == ior) {
            Some(0) => return true,
            Some(i) => alike[i].1.push((true, touch_box(shape))),
            None => alike.push((ior, vec![(true, touch_box(shape))])),
        }
    }
    alike.into_iter().any(|(_, boxes)| some_meet(boxes))
}

/// The box of a shape and of what may touch it.
fn touch_box(shape: &Shape) -> Bounds {
    let b = bounds(&shape.geometry);
    let slack = DVec3::splat(1e-5 * b.min.abs().max(b.max.abs()).max_element());
    Bounds { min: b.min - slack, max: b.max + slack }
}

/// Do two of these boxes overlap, one of which at least is marked? Only those that overlap along x are looked at.
fn some_meet(mut boxes: Vec<(bool, Bounds)>) -> bool {
    if !boxes.iter().any(|(marked, _)| *marked) {
        return false;
    }
    boxes.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
    boxes.iter().enumerate().any(|(i, a)| {
        let near = boxes[i + 1..].iter().take_while(|b| b.1.min.x <= a.1.max.x);
        near.into_iter().any(|b| (a.0 || b.0) && a.1.overlaps(&b.1))
    })
}

/// What the techniques at hand cannot see.
fn blind_spots(scene: &Scene, features: &Features) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut missing = |when: bool, line: &str| {
        if when && !out.iter().any(|o| o == line) {
            out.push(line.to_string());
        }
    };
    let has = |name: &str| features[name];
    let bends = has("FRESNEL");
    let camera = has("SENSOR_CAMERA");
    missing(
        has("LIGHTS_PRESENT") && !has("CHANCE"),
        "lamps seen straight or through metal and glass: chance hits are switched off",
    );
    for light in &scene.lights {
        let kind = match light {
            Light::Point { .. } => "point lights",
            Light::Spot { .. } | Light::Profile { .. } => "spot lights",
            Light::Beam { .. } => "parallel beams",
            Light::Sun { cos_angle, .. } if *cos_angle >= 1.0 => "suns of no angular size",
            _ => continue,
        };
        missing(!has("LIGHT_SAMPLES"), &format!("{kind} on what scatters them: light samples are switched off"));
        missing(
            bends && !has("JOINED"),
            &format!(
                "caustics of {kind} on what is seen directly: a path cannot hit a light of no size, and light paths are switched off"
            ),
        );
        missing(
            bends && camera && !has("GATHERED"),
            &format!(
                "caustics of {kind} seen through glass or in mirrors: a path cannot hit a light of no size, and nothing is gathered"
            ),
        );
    }
    out
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan: camera paths of {} wavelengths into {} bins", self.lanes, self.bins)?;
        if self.light.is_some() {
            let ways = [("JOINED", "joined to the sensor"), ("GATHERED", "gathered where metal and glass are looked into")];
            let ways: Vec<_> = ways.iter().filter(|(name, _)| self.has(name)).map(|(_, text)| *text).collect();
            writeln!(f, "  caustics: light paths, {}", ways.join(" and "))?;
        }
        if self.is_adaptive() {
            writeln!(f, "  samples: more of them where errors are large")?;
        }
        let groups: [(&str, &[(&str, &str)]); 4] = [
            (
                "shapes",
                &[
                    ("SPHERES", "spheres"),
                    ("DISCS", "discs"),
                    ("CYLINDERS", "cylinders"),
                    ("INSTANCES", "shared meshes"),
                    ("SMOOTH_NORMALS", "smooth normals"),
                    ("PASS_THROUGH", "surfaces to pass through"),
                    ("CONTACT", "surfaces in contact"),
                ],
            ),
            (
                "materials",
                &[
                    ("DIFFUSE", "diffuse"),
                    ("SMOOTH_DIELECTRIC", "smooth glass"),
                    ("ROUGH_DIELECTRIC", "rough glass"),
                    ("THIN_DIELECTRIC", "thin panes"),
                    ("SMOOTH_CONDUCTOR", "mirrors"),
                    ("ROUGH_CONDUCTOR", "rough metal"),
                    ("GRAIN", "brushed metal"),
                    ("COAT", "clear coats"),
                    ("SHEEN", "sheen"),
                    ("FILM", "thin films"),
                    ("GRADED", "roughness that varies"),
                    ("MIX", "mixtures"),
                    ("TEXTURES", "textures"),
                    ("NORMAL_MAPS", "normal maps"),
                    ("DISPERSION", "dispersion"),
                ],
            ),
            ("media", &[("MEDIA", "Beer-Lambert"), ("SCATTERING", "scattering")]),
            (
                "lights",
                &[
                    ("CONNECT", "sampled directly"),
                    ("LIGHT_GRID", "chosen by a grid"),
                    ("LIGHT_TRIANGLE", "meshes"),
                    ("LIGHT_SPHERE", "spheres"),
                    ("LIGHT_DISC", "discs"),
                    ("LIGHT_CYLINDER", "cylinders"),
                    ("LIGHT_POINT", "points and spots"),
                    ("LIGHT_PROFILE", "measured lamps"),
                    ("LIGHT_BEAM", "beams"),
                    ("LIGHT_SUN", "sun"),
                    ("ENV_CONSTANT", "constant environment"),
                    ("ENV_IMAGE", "environment picture"),
                ],
            ),
        ];
        for (title, features) in groups {
            let have: Vec<_> = features.iter().filter(|(name, _)| self.has(name)).map(|(_, text)| *text).collect();
            writeln!(f, "  {title}: {}", if have.is_empty() { "none".to_string() } else { have.join(", ") })?;
        }
        if self.texture_bytes > 0 {
            writeln!(f, "  pictures on surfaces: {:.1} MiB of spectra", self.texture_bytes as f64 / 1048576.0)?;
        }
        for line in &self.blind_spots {
            writeln!(f, "  not found: {line}")?;
        }
        Ok(())
    }
}
