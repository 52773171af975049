//! Every key that a scene file may contain, by the kind of object it stands in. The parser refuses all others; `scenes/scene.schema.json`
//! has a definition of the same name for each, and a test holds the two together.

/// `(kind, keys)`.
pub const KEYS: &[(&str, &[&str])] = &[
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
            "materials",
            "groups",
            "shapes",
            "lights",
        ],
    ),
    ("film", &["width", "height", "range_nm", "bins", "filter", "sampling", "exposure"]),
    ("filter", &["tent", "gaussian"]),
    ("tent", &["radius"]),
    ("gaussian", &["sigma"]),
    ("camera", SENSORS),
    ("perspective", &["eye", "target", "up", "vfov_deg", "aperture_radius", "focus_distance"]),
    ("orthographic", &["eye", "target", "up", "height"]),
    ("irradiance_plane", &["origin", "edge_u", "edge_v"]),
    ("irradiance_sphere", &["center", "radius"]),
    ("medium", &["sigma_a", "sigma_s", "g"]),
    ("surroundings", &["ior", "medium"]),
    ("material", MATERIALS),
    ("diffuse", &["reflectance"]),
    ("dielectric", &["ior", "alpha", "roughness", "thin_film", "absorption", "medium", "priority"]),
    ("thin_dielectric", &["ior", "thickness"]),
    ("conductor", &["metal", "eta", "k", "reflectance", "alpha", "roughness", "anisotropy", "thin_film"]),
    ("anisotropy", &["strength", "rotation_deg"]),
    ("thin_film", &["thickness", "ior"]),
    ("coated", &["of", "ior", "alpha", "roughness"]),
    ("sheen", &["of", "color", "alpha", "roughness"]),
    ("mix", &["a", "b", "weight"]),
    ("boundary", &["medium", "ior", "priority"]),
    ("normal_map", &["of", "texture", "tiles", "wrap", "filter", "strength"]),
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
            "name",
            "material",
            "emission",
            "transform",
        ],
    ),
    ("sphere", &["center", "radius"]),
    ("disc", &["center", "normal", "radius"]),
    ("cylinder", &["base", "top", "radius", "capped"]),
    ("quad", &["corner", "edge_u", "edge_v"]),
    ("box", &["min", "max"]),
    ("prism", &["polygon", "length"]),
    ("mesh", &["file", "smooth"]),
    ("gltf", &["file", "override", "lights"]),
    ("relit", &["intensity", "irradiance", "profile", "rotate_deg"]),
    (
        "override",
        &[
            "diffuse",
            "dielectric",
            "thin_dielectric",
            "conductor",
            "coated",
            "sheen",
            "mix",
            "boundary",
            "normal_map",
            "use",
            "emission",
        ],
    ),
    ("emission", &["radiance", "two_sided"]),
    ("transform", &["scale", "axis", "rotate_deg", "translate", "matrix"]),
    ("light", LIGHTS),
    ("point", &["position", "intensity"]),
    ("spot", &["position", "direction", "intensity", "inner_deg", "outer_deg", "profile", "rotate_deg"]),
    ("beam", &["origin", "direction", "radius", "irradiance"]),
    ("laser", &["origin", "direction", "radius", "power_W", "wavelength_nm", "width_nm"]),
    ("sun", &["direction", "angle_deg", "irradiance"]),
    ("constant", &["radiance"]),
    ("image", &["file", "scale", "transform"]),
    ("spectrum", &["file", "illuminant", "blackbody", "line", "band", "srgb", "linear_rgb", "reflectance", "scale"]),
    ("texture", &["texture", "tiles", "wrap", "filter", "linear", "scale"]),
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
    ("ior", &["glass", "sellmeier", "cauchy", "nd", "abbe", "table", "range_nm", "extrapolate"]),
    ("sellmeier", &["b", "c_um2"]),
];

/// Kinds of sensor.
pub const SENSORS: &[&str] = &["perspective", "orthographic", "irradiance_plane", "irradiance_sphere"];
/// Kinds of material.
pub const MATERIALS: &[&str] =
    &["diffuse", "dielectric", "thin_dielectric", "conductor", "coated", "sheen", "mix", "boundary", "normal_map"];
/// Kinds of geometry.
pub const GEOMETRIES: &[&str] = &["sphere", "disc", "cylinder", "quad", "box", "prism", "mesh", "gltf", "instance"];
/// Kinds of light that are not shapes.
pub const LIGHTS: &[&str] = &["point", "spot", "beam", "laser", "sun", "constant", "image"];
/// Kinds of spectrum written as an object.
pub const SPECTRA: &[&str] = &["file", "illuminant", "blackbody", "line", "band", "srgb", "linear_rgb", "reflectance"];

/// The keys of `kind`; none for an unknown kind.
pub fn keys_of(kind: &str) -> &'static [&'static str] {
    KEYS.iter().find(|(name, _)| *name == kind).map_or(&[], |(_, keys)| keys)
}
