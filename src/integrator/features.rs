//! What kernels can be asked for. Each feature is declared once: what it is, its name in WGSL's `#if`, for some a group and words for people, and what
//! needs it. The order matters: a feature may ask for those before it.

use super::Techniques;
use crate::geometry::{Bounds, bounds};
use crate::gpu::scene::{SLOTS, light_grid_pays};
use crate::lens::LensCamera;
use crate::scene::texture::{self, Texels};
use crate::scene::volumes::most_overlapping;
use crate::scene::{
    CoatNormals, EnvironmentTexels, Filter, Geometry, Interior, Light, Material, Mesh, Scene, Sensor, Shape, Starts,
};
use crate::spectrum::Ior;
use glam::DVec3;
use std::collections::BTreeMap;

/// Where the plan speaks of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    Shapes,
    Materials,
    Media,
    Lights,
}

macro_rules! features {
    ($($(#[$doc:meta])* $name:ident $wgsl:literal $(in $group:ident as $words:literal)? if $needed:expr;)*) => {
        /// A feature of kernels.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Feature { $($(#[$doc])* $name,)* }

        impl Feature {
            /// All of them, in the order in which they are decided.
            pub const ALL: &[Feature] = &[$(Feature::$name),*];

            /// Its name in the shaders' `#if`.
            pub fn wgsl(self) -> &'static str {
                match self { $(Feature::$name => $wgsl),* }
            }

            /// Its group, and what people call it; none for those that only serve others.
            pub(super) fn words(self) -> Option<(Group, &'static str)> {
                match self { $(Feature::$name => None$(.or(Some((Group::$group, $words))))?),* }
            }

            fn is_needed(self, n: &Needs) -> bool {
                match self { $(Feature::$name => { let needed: fn(&Needs) -> bool = $needed; needed(n) }),* }
            }
        }
    };
}

features! {
    /// Shapes other than triangles.
    Quadrics "QUADRICS" if |n| n.shape(|g| !matches!(g, Geometry::Mesh(_) | Geometry::Instance(_)));
    /// Analytic spheres.
    Spheres "SPHERES" in Shapes as "spheres" if |n| n.shape(|g| matches!(g, Geometry::Sphere { .. }));
    /// Analytic discs.
    Discs "DISCS" in Shapes as "discs" if |n| n.shape(|g| matches!(g, Geometry::Disc { .. }));
    /// Analytic cylinders.
    Cylinders "CYLINDERS" in Shapes as "cylinders" if |n| n.shape(|g| matches!(g, Geometry::Cylinder { .. }));
    /// Faces of lenses.
    LensFaces "LENS_FACES" in Shapes as "lenses" if |n| n.shape(|g| matches!(g, Geometry::LensFace(_)));
    /// Those that are no conics.
    Aspheres "ASPHERES" in Shapes as "aspheres" if |n| n.shape(|g| matches!(g, Geometry::LensFace(face) if face.is_asphere()));
    /// Meshes that stand in many places.
    Instances "INSTANCES" in Shapes as "shared meshes" if |n| n.shape(|g| matches!(g, Geometry::Instance(_)));
    /// Shading normals or tangents of vertices.
    SmoothNormals "SMOOTH_NORMALS" in Shapes as "smooth normals"
        if |n| n.mesh(|mesh| !mesh.normals.is_empty() || !mesh.tangents.is_empty());
    /// Lambertian surfaces that let light through.
    DiffuseTransmission "DIFFUSE_TRANSMISSION" in Materials as "diffuse transmission"
        if |n| n.material(|m| matches!(m, Material::DiffuseTransmission { .. }));
    /// Lambertian surfaces.
    Diffuse "DIFFUSE" in Materials as "diffuse"
        if |n| n.has(Feature::DiffuseTransmission) || n.material(|m| matches!(m, Material::Diffuse { .. }));
    /// Polished faces of solid glass.
    SmoothDielectric "SMOOTH_DIELECTRIC" in Materials as "smooth glass"
        if |n| n.material(|m| matches!(m, Material::Dielectric { alpha, .. } if *alpha == 0.0));
    /// Ground faces of solid glass.
    RoughDielectric "ROUGH_DIELECTRIC" in Materials as "rough glass"
        if |n| n.material(|m| matches!(m, Material::Dielectric { alpha, .. } if *alpha > 0.0));
    /// Any face of solid glass.
    Dielectric "DIELECTRIC" if |n| n.has(Feature::SmoothDielectric) || n.has(Feature::RoughDielectric);
    /// Solid glass that reflects nothing but what is reflected totally.
    Antireflective "ANTIREFLECTIVE"
        if |n| n.material(|m| matches!(m, Material::Dielectric { antireflective: true, .. }));
    /// Panes seen as one surface, and clear.
    SmoothThinDielectric "SMOOTH_THIN_DIELECTRIC"
        if |n| n.material(|m| matches!(m, Material::ThinDielectric { alpha, .. } if *alpha == 0.0));
    /// Panes that blur what is behind them.
    RoughThinDielectric "ROUGH_THIN_DIELECTRIC" in Materials as "rough thin panes"
        if |n| n.material(|m| matches!(m, Material::ThinDielectric { alpha, .. } if *alpha > 0.0));
    /// Any panes seen as one surface.
    ThinDielectric "THIN_DIELECTRIC" in Materials as "thin panes" if |n| n.material(|m| matches!(m, Material::ThinDielectric { .. }));
    /// Panes of glass that absorbs.
    AbsorbingPanes "ABSORBING_PANES" if |n| n.material(|m| matches!(m, Material::ThinDielectric { depth, .. } if !depth.is_zero()));
    /// Glass that tints what gets through.
    Tint "TINT" in Materials as "tinted glass" if |n| n.material(|m| m.tint().is_some());
    /// Mirrors of metal.
    SmoothConductor "SMOOTH_CONDUCTOR" in Materials as "mirrors" if |n| {
        n.material(|m| matches!(m, Material::Conductor { alpha, .. } | Material::ColoredConductor { alpha, .. } if *alpha == 0.0))
    };
    /// Rough metal.
    RoughConductor "ROUGH_CONDUCTOR" in Materials as "rough metal" if |n| {
        n.material(|m| matches!(m, Material::Conductor { alpha, .. } | Material::ColoredConductor { alpha, .. } if *alpha > 0.0))
    };
    /// Any metal.
    Conductor "CONDUCTOR" if |n| n.has(Feature::SmoothConductor) || n.has(Feature::RoughConductor);
    /// Metal of which only the reflectance at normal incidence is known.
    ColoredConductor "COLORED_CONDUCTOR" if |n| n.material(|m| matches!(m, Material::ColoredConductor { .. }));
    /// Metal or panes whose roughness has a direction.
    Grain "GRAIN" in Materials as "brushed metal" if |n| n.used.iter().any(|m| n.scene.grains.contains_key(m));
    /// Clear coats that are polished.
    SmoothCoat "SMOOTH_COAT" if |n| n.material(|m| matches!(m, Material::Coated { alpha, .. } if *alpha == 0.0));
    /// Clear coats that are not.
    RoughCoat "ROUGH_COAT" if |n| n.material(|m| matches!(m, Material::Coated { alpha, .. } if *alpha > 0.0));
    /// Any clear coat.
    Coat "COAT" in Materials as "clear coats" if |n| n.has(Feature::SmoothCoat) || n.has(Feature::RoughCoat);
    /// Sheen of cloth.
    Sheen "SHEEN" in Materials as "sheen" if |n| n.material(|m| matches!(m, Material::Sheen { .. }));
    /// What reflects by Fresnel's equations.
    Fresnel "FRESNEL" if |n| {
        n.has(Feature::Dielectric) || n.has(Feature::ThinDielectric) || n.has(Feature::Conductor) || n.has(Feature::Coat)
    };
    /// Interference in films.
    ThinFilm "THIN_FILM" in Materials as "thin films" if |n| n.used.iter().any(|m| n.scene.thin_films.contains_key(m));
    /// Roughness from pictures.
    Graded "GRADED" in Materials as "roughness that varies" if |n| n.material(|m| matches!(m, Material::Graded { .. }));
    /// Mixtures of two materials.
    Mix "MIX" in Materials as "mixtures" if |n| n.material(|m| matches!(m, Material::Mix { .. }));
    /// Shading normals from pictures.
    NormalMaps "NORMAL_MAPS" in Materials as "normal maps" if |n| n.material(|m| m.normals().is_some());
    /// Clear coats that point elsewhere than what they lie on.
    CoatNormals "COAT_NORMALS"
        if |n| n.material(|m| matches!(m, Material::Coated { normals, .. } if !matches!(normals, CoatNormals::OfBase)));
    /// Shading normals from pictures on meshes that have tangents of their own.
    Tangents "TANGENTS" if |n| n.has(Feature::NormalMaps) && n.mesh(|mesh| !mesh.tangents.is_empty());
    /// Lamps that show pictures.
    LightTextures "LIGHT_TEXTURES" if |n| {
        n.scene.shapes.iter().any(|s| s.emission.as_ref().is_some_and(|e| e.radiance.image().is_some()))
    };
    /// Pictures on surfaces.
    Textures "TEXTURES" in Materials as "textures" if |n| n.has(Feature::LightTextures) || n.material(|m| m.image().is_some());
    /// Pictures on the second set of texture coordinates.
    MoreUvs "MORE_UVS" if |n| n.has(Feature::Textures) && texture::coordinates_of(n.scene).0 > 1;
    /// Pictures that are tinted by the colours of vertices.
    Tints "TINTS" in Materials as "colours of vertices" if |n| n.has(Feature::Textures) && texture::coordinates_of(n.scene).1;
    /// Pictures in eight bytes a texel.
    SigmoidTexels "SIGMOID_TEXELS" if |n| n.texels(|t| matches!(t, Texels::Sigmoids { .. }));
    /// Pictures of spectra.
    SpectralTexels "SPECTRAL_TEXELS" if |n| n.texels(|t| matches!(t, Texels::Spectra { .. }));
    /// Materials made of others.
    Composite "COMPOSITE" if |n| {
        n.has(Feature::Coat) || n.has(Feature::Sheen) || n.has(Feature::Graded) || n.has(Feature::Mix) || n.has(Feature::NormalMaps)
    };
    /// Surfaces that are none, but may bound a medium.
    Boundary "BOUNDARY" if |n| n.material(|m| matches!(m, Material::Boundary { .. }));
    /// Fog.
    Scattering "SCATTERING" in Media as "scattering" if |n| n.volume(|i| !i.sigma_s.is_zero());
    /// Absorption or fog.
    Media "MEDIA" in Media as "Beer-Lambert" if |n| n.has(Feature::Scattering) || n.volume(|i| !i.sigma_a.is_zero());
    /// Refraction that depends on the wavelength.
    Dispersion "DISPERSION" in Materials as "dispersion" if |n| {
        let bins = &n.scene.film.bins;
        n.has(Feature::SmoothDielectric) && n.volume(|i| !i.ior.is_constant_over(bins.min_nm, bins.max_nm))
    };
    /// Paths know which volumes they are in; the reflectance of a metal or coat depends on what it lies in.
    Interiors "INTERIORS" if |n| {
        let around = (n.has(Feature::Conductor) || n.has(Feature::Coat)) && n.scene.interiors[0].ior != Ior::constant(1.0);
        n.has(Feature::Dielectric) || !n.volumes.is_empty() || n.has(Feature::Media) || around
    };
    /// There may be more volumes in one place than have room in four slots.
    ManyVolumes "MANY_VOLUMES" in Shapes as "many volumes in one place" if |n| n.has(Feature::Interiors) && most_overlapping(n.scene) > SLOTS;
    /// Each path finds out by itself which volumes it starts in.
    StartVolumes "START_VOLUMES" in Media as "looked for where paths start" if |n| n.has(Feature::Interiors) && match n.pass {
        Pass::Camera | Pass::Aov => n.starts.sensor_meets_volume,
        Pass::Light => n.starts.lamp_meets_volume,
    };
    /// Surfaces that lie in each other.
    Contact "CONTACT" in Shapes as "surfaces in contact" if |n| volumes_touch(n.scene) || n.starts.lamps_touch;
    /// Surfaces that a shadow ray may find not to be there.
    PassThrough "PASS_THROUGH" in Shapes as "surfaces to pass through" if |n| n.has(Feature::Boundary) || volumes_overlap(n.scene) || indices_match(n.scene);
    /// Any light.
    LightsPresent "LIGHTS_PRESENT" if |n| !n.scene.lights.is_empty() || n.emitter(|_| true);
    /// Lights with a surface.
    LightArea "LIGHT_AREA" if |n| n.emitter(|_| true);
    /// Meshes that shine.
    LightTriangle "LIGHT_TRIANGLE" in Lights as "meshes" if |n| n.emitter(|g| matches!(g, Geometry::Mesh(_)));
    /// Spheres that shine.
    LightSphere "LIGHT_SPHERE" in Lights as "spheres" if |n| n.emitter(|g| matches!(g, Geometry::Sphere { .. }));
    /// Discs that shine.
    LightDisc "LIGHT_DISC" in Lights as "discs" if |n| n.emitter(|g| matches!(g, Geometry::Disc { .. }));
    /// Cylinders that shine.
    LightCylinder "LIGHT_CYLINDER" in Lights as "cylinders" if |n| n.emitter(|g| matches!(g, Geometry::Cylinder { .. }));
    /// Lights at a point.
    LightPoint "LIGHT_POINT" in Lights as "points and spots"
        if |n| n.light(|l| matches!(l, Light::Point { .. } | Light::Spot { .. } | Light::Profile { .. }));
    /// Of these, lamps with a measured distribution.
    LightProfile "LIGHT_PROFILE" in Lights as "measured lamps" if |n| n.light(|l| matches!(l, Light::Profile { .. }));
    /// Parallel light of finite width.
    LightBeam "LIGHT_BEAM" in Lights as "beams" if |n| n.light(|l| matches!(l, Light::Beam { .. }));
    /// Parallel light, or nearly so, from infinity.
    LightSun "LIGHT_SUN" in Lights as "sun" if |n| n.light(|l| matches!(l, Light::Sun { .. }));
    /// The same light from everywhere.
    EnvConstant "ENV_CONSTANT" in Lights as "constant environment" if |n| n.light(|l| matches!(l, Light::Constant { .. }));
    /// Light from a picture all around.
    EnvImage "ENV_IMAGE" in Lights as "environment picture" if |n| n.light(|l| matches!(l, Light::Image(_)));
    /// A picture of spectra around the scene.
    EnvSpectra "ENV_SPECTRA"
        if |n| n.light(|l| matches!(l, Light::Image(map) if matches!(map.texels, EnvironmentTexels::Spectra(_))));
    /// Any light from infinity.
    LightEnvironment "LIGHT_ENVIRONMENT" if |n| n.has(Feature::LightSun) || n.has(Feature::EnvConstant) || n.has(Feature::EnvImage);
    /// Arctangents that are exact.
    PreciseAngles "PRECISE_ANGLES" if |n| n.has(Feature::EnvImage) || n.has(Feature::LightProfile);
    /// A pinhole or thin lens.
    SensorPerspective "SENSOR_PERSPECTIVE" if |n| matches!(n.scene.sensor, Sensor::Perspective { optics: None, .. });
    /// A camera that rays reach through the surfaces of a lens.
    SensorLens "SENSOR_LENS" if |n| n.optics().is_some();
    /// Aspheric surfaces in it.
    LensAspheres "LENS_ASPHERES" if |n| n.optics().is_some_and(|o| o.lens.surfaces.iter().any(|s| !s.aspheric.is_empty()));
    /// Glass in it that absorbs.
    LensAbsorption "LENS_ABSORPTION" if |n| {
        n.optics().is_some_and(|o| o.lens.surfaces.iter().any(|s| s.glass.as_ref().is_some_and(|g| g.absorption.is_some())))
    };
    /// A parallel view.
    SensorOrthographic "SENSOR_ORTHOGRAPHIC" if |n| matches!(n.scene.sensor, Sensor::Orthographic { .. });
    /// Irradiance on a plane.
    SensorPlane "SENSOR_PLANE" if |n| matches!(n.scene.sensor, Sensor::IrradiancePlane { .. });
    /// A camera.
    SensorCamera "SENSOR_CAMERA" if |n| n.has(Feature::SensorPerspective) || n.has(Feature::SensorLens) || n.has(Feature::SensorOrthographic);
    /// A lens of finite aperture.
    Lens "LENS" if |n| matches!(n.scene.sensor, Sensor::Perspective { lens_radius, optics: None, .. } if lens_radius > 0.0);
    /// The tent as reconstruction filter.
    FilterTent "FILTER_TENT" if |n| matches!(n.scene.film.filter, Filter::Tent { .. });
    /// The Gaussian.
    FilterGaussian "FILTER_GAUSSIAN" if |n| matches!(n.scene.film.filter, Filter::Gaussian { .. });
    /// More bins than a path has wavelengths.
    ManyBins "MANY_BINS" if |n| super::Wavelengths::per_path(n.scene.film.bins.count) != n.scene.film.bins.count;
    /// Emitters count where paths sampled by the BSDF meet them.
    BsdfSampling "BSDF_SAMPLING" if |n| n.techniques.bsdf_sampling;
    /// Next-event estimation. Of what shines alike from everywhere, and nothing else, scattered paths find as much by themselves, spread as it is wanted.
    NextEventEstimation "NEXT_EVENT_ESTIMATION" if |n| {
        n.has(Feature::LightsPresent) && n.techniques.next_event_estimation && !(n.is_lit_evenly() && n.has(Feature::BsdfSampling))
    };
    /// Lights are chosen by a grid over the scene.
    LightGrid "LIGHT_GRID" in Lights as "chosen by a grid" if |n| n.techniques.next_event_estimation && light_grid_pays(n.scene);
    /// Lamps lie in surfaces of others, which do not shadow them.
    TouchedLights "TOUCHED_LIGHTS" if |n| n.has(Feature::NextEventEstimation) && n.starts.lamps_touch;
    /// Light paths are connected to the sensor.
    LightTracing "LIGHT_TRACING" if |n| n.has_caustics() && n.techniques.light_paths;
    /// Light paths are merged at what camera paths see through metal and glass.
    Merging "MERGING" if |n| {
        let merges = n.has(Feature::Diffuse) || n.has(Feature::Scattering);
        n.has_caustics() && n.techniques.merging && n.has(Feature::SensorCamera) && n.has(Feature::Fresnel) && merges
    };
    /// There are light paths.
    Caustics "CAUSTICS" if |n| n.has(Feature::LightTracing) || n.has(Feature::Merging);
    /// Light paths are sent to where they are of use.
    Guided "GUIDED" if |n| n.has(Feature::Caustics) && n.techniques.guiding;
    /// Spots and beams light fog: what scatters there first belongs to light paths, which find all of a shaft, and not to light samples, which seldom meet it.
    Shafts "SHAFTS" if |n| n.has(Feature::LightTracing) && n.has(Feature::Scattering) && n.light(is_shaft);
    /// Light paths are seen where they cross an irradiance sensor.
    Crossings "CROSSINGS" if |n| n.has(Feature::LightTracing) && !n.has(Feature::SensorCamera);
    /// The kernel traces paths from the sensor.
    CameraPaths "CAMERA_PATHS" if |n| n.pass == Pass::Camera;
    /// Glass is made to reflect more often where it mirrors a small lamp.
    Highlights "HIGHLIGHTS" if |n| {
        let mirrors = n.has(Feature::SmoothDielectric) || n.has(Feature::SmoothThinDielectric);
        let suns = n.has(Feature::EnvImage) || n.light(|l| matches!(l, Light::Sun { cos_angle, .. } if *cos_angle < 1.0));
        n.has(Feature::CameraPaths) && n.has(Feature::BsdfSampling) && mirrors && (n.has(Feature::LightArea) || suns)
    };
    /// The kernel traces paths from lights.
    LightPaths "LIGHT_PATHS" if |n| n.pass == Pass::Light;
    /// An irradiance sensor looks for lights itself. (Light paths cross it.)
    LitSensor "LIT_SENSOR" if |n| n.has(Feature::NextEventEstimation) && !n.has(Feature::SensorCamera) && n.pass == Pass::Camera;
    /// Vertices are connected: of camera paths to a light, of light paths to the sensor.
    Connect "CONNECT" in Lights as "sampled directly" if |n| match n.pass {
        Pass::Light => n.has(Feature::LightTracing) && n.scatters() && n.has(Feature::SensorCamera),
        Pass::Camera | Pass::Aov => n.has(Feature::NextEventEstimation) && (n.scatters() || !n.has(Feature::SensorCamera)),
    };
    /// A path chooses one of its wavelengths by what it carries.
    WavelengthChoice "WAVELENGTH_CHOICE" if |n| {
        n.has(Feature::Scattering) || n.has(Feature::RoughDielectric) || (n.pass == Pass::Light && n.has(Feature::Dispersion))
    };
    /// Light paths are merged on surfaces.
    MergesAtSurfaces "MERGES_AT_SURFACES" if |n| n.pass == Pass::Light && n.has(Feature::Merging) && n.has(Feature::Diffuse);
    /// Shading normals may contradict the geometry.
    ShadingNormals "SHADING_NORMALS" if |n| n.has(Feature::SmoothNormals) || n.has(Feature::NormalMaps);
    /// Rays of the pass of AOVs go on behind smooth glass and in mirrors.
    Behind "BEHIND" if |n| n.pass == Pass::Aov && n.material(Material::is_smooth);
    /// The kernel counts what it does, which takes time of its own.
    Counted "COUNTED" if |_| false;
}

/// What the kernels of a pass are asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Features(u128);

const _: () = assert!(Feature::ALL.len() <= 128);

impl Features {
    /// True if this one is among them.
    pub fn has(self, feature: Feature) -> bool {
        self.0 & (1 << feature as u32) != 0
    }

    /// The same and this one.
    pub(super) fn with(self, feature: Feature) -> Self {
        Features(self.0 | 1 << feature as u32)
    }

    /// The same but this one.
    pub(super) fn without(self, feature: Feature) -> Self {
        Features(self.0 & !(1 << feature as u32))
    }

    /// All names that shaders may ask for, and whether they are there.
    pub fn switches(self) -> BTreeMap<&'static str, bool> {
        Feature::ALL.iter().map(|&f| (f.wgsl(), self.has(f))).collect()
    }
}

/// The passes whose kernels differ in their features.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    Camera,
    Light,
    Aov,
}

/// What decides the features of a pass.
pub(super) struct Needs<'a> {
    scene: &'a Scene,
    techniques: Techniques,
    /// Materials that a path can meet: those of shapes, and what they are made of.
    used: Vec<usize>,
    /// Volumes that they or shapes bound.
    volumes: Vec<usize>,
    starts: Starts,
    pass: Pass,
    features: Features,
}

impl<'a> Needs<'a> {
    pub fn new(scene: &'a Scene, techniques: Techniques) -> Self {
        let used = used_materials(scene);
        let walls = scene.shapes.iter().filter_map(|s| s.interior);
        let volumes = used.iter().filter_map(|&m| scene.interior_of(m)).chain(walls).collect();
        let features = Features::default();
        Self { scene, techniques, used, volumes, starts: Starts::of(scene), pass: Pass::Camera, features }
    }

    /// The features of this pass.
    pub fn of(&mut self, pass: Pass) -> Features {
        (self.pass, self.features) = (pass, Features::default());
        for &feature in Feature::ALL {
            if feature.is_needed(self) {
                self.features = self.features.with(feature);
            }
        }
        self.features
    }

    fn has(&self, feature: Feature) -> bool {
        self.features.has(feature)
    }

    /// The lens that the camera looks through.
    fn optics(&self) -> Option<&LensCamera> {
        self.scene.sensor.optics()
    }

    fn material(&self, f: impl Fn(&Material) -> bool) -> bool {
        self.used.iter().any(|&m| f(&self.scene.materials[m]))
    }

    /// Of a picture on a surface.
    fn texels(&self, f: impl Fn(&Texels) -> bool) -> bool {
        self.has(Feature::Textures) && texture::of_scene(self.scene).any(|t| f(&t.image.texels))
    }

    /// Of a volume, or of what surrounds the scene.
    fn volume(&self, f: impl Fn(&Interior) -> bool) -> bool {
        f(&self.scene.interiors[0]) || self.volumes.iter().any(|&i| f(&self.scene.interiors[i]))
    }

    fn shape(&self, f: impl Fn(&Geometry) -> bool) -> bool {
        self.scene.shapes.iter().any(|s| f(&s.geometry))
    }

    fn mesh(&self, f: impl Fn(&Mesh) -> bool) -> bool {
        self.shape(|geometry| match geometry {
            Geometry::Mesh(mesh) => f(mesh),
            Geometry::Instance(instance) => f(instance.mesh()),
            _ => false,
        })
    }

    fn emitter(&self, f: impl Fn(&Geometry) -> bool) -> bool {
        self.scene.shapes.iter().any(|s| f(&s.geometry) && s.emission.as_ref().is_some_and(|e| !e.radiance.is_zero()))
    }

    fn light(&self, f: impl Fn(&Light) -> bool) -> bool {
        self.scene.lights.iter().any(f)
    }

    /// A constant environment is the only light.
    fn is_lit_evenly(&self) -> bool {
        !self.emitter(|_| true) && self.scene.lights.iter().all(|l| matches!(l, Light::Constant { .. }))
    }

    /// Something bends light, or a lamp that has a place lights fog, and something scatters it to the sensor: camera paths find little of that.
    fn has_caustics(&self) -> bool {
        let is_lamp = |l: &Light| is_shaft(l) || matches!(l, Light::Point { .. });
        let bends =
            self.has(Feature::Fresnel) || (self.has(Feature::Scattering) && (self.light(is_lamp) || self.emitter(|_| true)));
        self.has(Feature::LightsPresent) && bends && (self.scatters() || !self.has(Feature::SensorCamera))
    }

    /// Something scatters light into directions that a connection can take.
    fn scatters(&self) -> bool {
        SCATTERING.iter().any(|&f| self.has(f))
    }
}

/// Light of no size that a cone or pencil holds.
fn is_shaft(light: &Light) -> bool {
    matches!(light, Light::Spot { .. } | Light::Profile { .. } | Light::Beam { .. })
}

/// What scatters light into directions that a connection can take.
pub(super) const SCATTERING: [Feature; 7] = [
    Feature::Diffuse,
    Feature::Scattering,
    Feature::RoughDielectric,
    Feature::RoughConductor,
    Feature::RoughThinDielectric,
    Feature::RoughCoat,
    Feature::Sheen,
];

/// Materials that a path can meet: those of shapes, and what they mix.
fn used_materials(scene: &Scene) -> Vec<usize> {
    let mut is_used = vec![false; scene.materials.len()];
    let mut used: Vec<usize> = Vec::new();
    let mut todo: Vec<usize> = scene.shapes.iter().map(|s| s.material).collect();
    while let Some(m) = todo.pop() {
        if !std::mem::replace(&mut is_used[m], true) {
            used.push(m);
            todo.extend(scene.materials[m].parts());
        }
    }
    used
}

/// True if the boxes of two volumes overlap, so that a surface may not be there because another volume rules.
fn volumes_overlap(scene: &Scene) -> bool {
    let is_volume = |s: &&Shape| scene.interior_of(s.material).is_some();
    some_meet(bodies(scene, scene.shapes.iter().filter(is_volume).map(|s| (s, true, bounds(&s.geometry)))))
}

/// True if the box of a volume comes so close to another shape's that their surfaces may touch.
fn volumes_touch(scene: &Scene) -> bool {
    some_meet(bodies(scene, scene.shapes.iter().map(|s| (s, scene.interior_of(s.material).is_some(), touch_box(s)))))
}

/// The same boxes with one for all faces of a piece of glass in a lens: those are closed where they meet.
fn bodies<'a>(scene: &Scene, boxes: impl Iterator<Item = (&'a Shape, bool, Bounds)>) -> Vec<(bool, Bounds)> {
    let mut bodies: Vec<(bool, Bounds)> = Vec::new();
    let mut last: Option<&Shape> = None;
    for (shape, marked, bounds) in boxes {
        match (last, bodies.last_mut()) {
            (Some(before), Some(body)) if scene.are_one_piece(before, shape) => *body = (body.0 || marked, body.1.union(bounds)),
            _ => bodies.push((marked, bounds)),
        }
        last = Some(shape);
    }
    bodies
}

/// Shapes of a body, as [`bodies`] takes them.
type Marked<'a> = (&'a Shape, bool, Bounds);

/// True if a volume has the index of what surrounds the scene, or of a volume that it may touch: their boundary is not there for light.
fn indices_match(scene: &Scene) -> bool {
    let mut alike: Vec<(&Ior, Vec<Marked>)> = vec![(&scene.interiors[0].ior, Vec::new())];
    for shape in &scene.shapes {
        let Some(interior) = scene.interior_of(shape.material) else { continue };
        let ior = &scene.interiors[interior].ior;
        match alike.iter().position(|(of, _)| *of == ior) {
            Some(0) => return true,
            Some(i) => alike[i].1.push((shape, true, touch_box(shape))),
            None => alike.push((ior, vec![(shape, true, touch_box(shape))])),
        }
    }
    alike.into_iter().any(|(_, boxes)| some_meet(bodies(scene, boxes.into_iter())))
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
