//! Every key that a scene file may contain, by the kind of object it stands in. The parser refuses all others; `scenes/scene.schema.json`
//! has a definition of the same name for each, and a test holds the two together.

use super::{lights, materials};

/// The keys that an object of each kind may have.
pub(super) type Keys = &'static [(&'static str, &'static [&'static str])];

/// `(kind, keys)`; those of materials and lights stand beside what reads them.
pub fn all() -> impl Iterator<Item = (&'static str, &'static [&'static str])> {
    [KEYS, materials::KEYS, lights::KEYS].into_iter().flatten().copied()
}

const KEYS: Keys = &[
    (
        "scene",
        &[
            "$schema",
            "name",
            "description",
            "film",
            "camera",
            "max_depth",
            "reference",
            "media",
            "surroundings",
            "volumes",
            "materials",
            "groups",
            "shapes",
            "lights",
            "animate",
            "frames_per_second",
        ],
    ),
    ("animation", &["key", "frames", "values", "interpolation"]),
    ("film", &["width", "height", "range_nm", "bins", "filter", "sampling", "exposure"]),
    ("filter", &["tent", "gaussian"]),
    ("tent", &["radius"]),
    ("gaussian", &["sigma"]),
    ("camera", SENSORS),
    ("perspective", &["eye", "target", "up", "vfov_deg", "aperture_radius", "focus_distance"]),
    ("orthographic", &["eye", "target", "up", "height"]),
    (
        "camera_lens",
        &[
            "eye",
            "target",
            "up",
            "file",
            "prescription",
            "surfaces",
            "diameter",
            "unit",
            "film",
            "focus_distance",
            "film_distance",
            "f_number",
        ],
    ),
    ("prescription", &["name", "source", "unit", "surfaces", "diameter"]),
    ("lens_surface", &["radius", "conic", "aspheric", "thickness", "glass", "diameter", "stop"]),
    ("irradiance_plane", &["origin", "edge_u", "edge_v"]),
    ("irradiance_sphere", &["center", "radius"]),
    ("medium", &["sigma_a", "sigma_s", "g"]),
    ("surroundings", &["ior", "medium"]),
    (
        "shape",
        &[
            "sphere",
            "disc",
            "cylinder",
            "quad",
            "box",
            "prism",
            "mesh",
            "gltf",
            "instance",
            "lens",
            "name",
            "material",
            "volume",
            "emission",
            "transform",
            "unit",
        ],
    ),
    ("sphere", &["center", "radius"]),
    ("disc", &["center", "normal", "radius"]),
    ("cylinder", &["base", "top", "radius", "capped"]),
    ("quad", &["corner", "edge_u", "edge_v"]),
    ("box", &["min", "max"]),
    ("prism", &["polygon", "length"]),
    ("mesh", &["file", "smooth", "unit"]),
    ("gltf", &["file", "override", "lights"]),
    ("lens", &["file", "prescription", "surfaces", "diameter", "edge"]),
    ("relit", &["intensity", "irradiance", "profile", "rotate_deg"]),
    ("emission", &["radiance", "two_sided"]),
    ("transform", &["scale", "axis", "rotate_deg", "translate", "matrix"]),
    ("spectrum", SPECTRUM),
    ("texture", &["texture", "tiles", "wrap", "filter", "linear", "scale", "bands"]),
    ("line", &["nm", "width", "power"]),
    ("band", &["nm", "width", "value"]),
    (
        "quantity",
        &[
            "spectrum",
            "luminance_cd_m2",
            "illuminance_lx",
            "luminous_flux_lm",
            "luminous_intensity_cd",
            "irradiance_W_m2",
            "power_W",
        ],
    ),
    ("ior", &["glass", "file", "name", "relative_to", "sellmeier", "cauchy", "nd", "abbe", "table", "range_nm", "extrapolate"]),
    ("sellmeier", &["b", "c_um2"]),
];

/// Kinds of sensor.
pub const SENSORS: &[&str] = &["perspective", "lens", "orthographic", "irradiance_plane", "irradiance_sphere"];
/// Kinds of geometry.
pub const GEOMETRIES: &[&str] = &["sphere", "disc", "cylinder", "quad", "box", "prism", "mesh", "gltf", "instance", "lens"];
/// Kinds of spectrum written as an object.
pub const SPECTRA: &[&str] = SPECTRUM.split_at(SPECTRUM.len() - 2).0;
/// Keys of such an object: its kinds, and what goes with them.
const SPECTRUM: &[&str] = &[
    "file",
    "illuminant",
    "blackbody",
    "daylight",
    "white_led",
    "chromaticity",
    "line",
    "band",
    "srgb",
    "linear_rgb",
    "reflectance",
    "column",
    "scale",
];

/// The keys of `kind`; none for an unknown kind.
pub fn keys_of(kind: &str) -> &'static [&'static str] {
    all().find(|(name, _)| *name == kind).map_or(&[], |(_, keys)| keys)
}
