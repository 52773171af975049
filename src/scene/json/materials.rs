//! Materials, media and the volumes that dielectrics and boundaries enclose.

use crate::bsdf::sheen::LEAST;
use crate::error::{Result, quoted, suggest};
use crate::scene::grain::grain;
use crate::scene::json::Node;
use crate::scene::json::keys::Keys;
use crate::scene::json::load::Loader;
use crate::scene::json::spectra::Place;
use crate::scene::{CoatNormals, Interior, Material, Passage, Scene, Texture, ThinFilm};
use crate::spectrum::{Ior, Spectrum, library};
use std::collections::HashMap;

/// Kinds of material.
const MATERIALS: &[&str] = &[
    "diffuse",
    "diffuse_transmission",
    "dielectric",
    "thin_dielectric",
    "conductor",
    "coated",
    "sheen",
    "mix",
    "boundary",
    "normal_map",
];

/// What may take the place of a glTF file's material: any kind, or one of the scene (`use`); `emission` beside it.
const OVERRIDES: &[&str] = &{
    let mut all = ["emission"; MATERIALS.len() + 2];
    let mut i = 0;
    while i < MATERIALS.len() {
        all[i] = MATERIALS[i];
        i += 1;
    }
    all[i] = "use";
    all
};

/// The keys of materials, and of what a glTF file's material is replaced with.
pub(super) const KEYS: Keys = &[
    ("material", MATERIALS),
    ("diffuse", &["reflectance"]),
    ("diffuse_transmission", &["transmittance"]),
    ("volume", VOLUME),
    ("dielectric", &["volume", "ior", "alpha", "roughness", "tint", "thin_film", "absorption", "medium", "priority"]),
    ("absorption", ATTENUATION),
    ("thin_dielectric", &["ior", "alpha", "roughness", "anisotropy", "tint", "absorption", "thickness", "thin_film"]),
    ("conductor", &["metal", "eta", "k", "reflectance", "alpha", "roughness", "anisotropy", "thin_film"]),
    ("anisotropy", &["strength", "rotation_deg"]),
    ("thin_film", &["thickness", "ior"]),
    ("coated", &["of", "ior", "alpha", "roughness"]),
    ("sheen", &["of", "color", "alpha", "roughness"]),
    ("mix", &["a", "b", "weight"]),
    ("boundary", &["volume", "medium", "ior", "priority"]),
    ("normal_map", &["of", "texture", "tiles", "wrap", "filter", "strength"]),
    ("override", OVERRIDES),
];

/// Films thinner than this show no colours, nm: a soap film is black when it bursts.
const COLOURLESS_FILM: f64 = 4.0;
/// What says what is in a volume.
const VOLUME: &[&str] = &["ior", "absorption", "medium", "priority"];
/// Absorption by what is left after a way.
const ATTENUATION: &[&str] = &["color", "distance"];
/// Mixes of mixes may be this deep.
const DEEPEST_MIX: usize = 8;

/// A homogeneous medium as a scene names it.
#[derive(Clone)]
struct Medium {
    sigma_a: Spectrum,
    sigma_s: Spectrum,
    g: f64,
}

/// What the materials of a scene file are made with.
#[derive(Clone, Default)]
pub(in crate::scene) struct Materials {
    media: HashMap<String, Medium>,
    /// Interiors by name.
    volumes: HashMap<String, usize>,
}

impl Materials {
    /// Reads `media`, `surroundings`, `volumes` and `materials` into the loader's scene; `interiors[0]` is what surrounds everything.
    pub(in crate::scene) fn read(loader: &mut Loader, root: &Node) -> Result<()> {
        let mut media = HashMap::new();
        for (name, node) in root.get("media").map_or(Ok(Vec::new()), |n| n.entries())? {
            media.insert(name.to_string(), medium(loader, &node)?);
        }
        let mut this = Materials { media, volumes: HashMap::new() };
        let mut surroundings = Interior::vacuum("surroundings");
        if let Some(node) = root.get("surroundings") {
            node.object("surroundings")?;
            if let Some(ior) = node.get("ior") {
                surroundings.ior = loader.reader.ior(&ior)?;
            }
            if let Some(medium) = node.get("medium") {
                this.fill(&mut surroundings, &medium)?;
            }
        }
        loader.named_volume(surroundings);
        for (name, node) in root.get("volumes").map_or(Ok(Vec::new()), |n| n.entries())? {
            node.object("volume")?;
            let interior = this.content(loader, name, &node, u32::from(node.get("ior").is_some()))?;
            this.volumes.insert(name.to_string(), loader.named_volume(interior));
        }

        let nodes = root.get("materials").map_or(Ok(Vec::new()), |n| n.entries())?;
        for (index, (name, _)) in nodes.iter().enumerate() {
            loader.names.insert(name.to_string(), index);
            // Its place: materials may add others of no name.
            loader.scene.materials.push(Material::NOTHING);
        }
        for (index, (name, node)) in nodes.iter().enumerate() {
            node.object("material")?;
            this.place(loader, index, name, node)?;
        }
        loader.kit = this;
        for (index, (_, node)) in nodes.iter().enumerate() {
            check_parts(&loader.scene.materials, index, 0).map_err(|problem| node.fail(problem, "use simpler materials"))?;
            check_passage(&loader.scene, index, node)?;
        }
        Ok(())
    }

    /// The interior that `node` names.
    pub(in crate::scene) fn volume(&self, node: &Node) -> Result<usize> {
        let name = node.string()?;
        let unknown =
            || node.fail(format!("unknown volume {}", quoted(name)), suggest(name, self.volumes.keys().map(String::as_str)));
        self.volumes.get(name).copied().ok_or_else(unknown)
    }

    /// What is in a volume that `node` describes; of the index of the surroundings and this priority unless it says another.
    fn content(&self, loader: &mut Loader, name: &str, node: &Node, priority: u32) -> Result<Interior> {
        let ior = node.get("ior");
        let mut interior = Interior::vacuum(name);
        interior.ior = match &ior {
            Some(ior) => loader.reader.ior(ior)?,
            None => loader.scene.interiors[0].ior.clone(),
        };
        note_extrapolation(loader, name, &interior.ior);
        interior.priority = node.get("priority").map_or(Ok(priority), |n| n.integer(0, 255))? as u8;
        if let Some(absorption) = node.get("absorption") {
            interior.sigma_a = absorption_of(loader, &absorption, ior.as_ref())?;
        }
        if let Some(medium) = node.get("medium") {
            self.fill(&mut interior, &medium)?;
        }
        Ok(interior)
    }

    /// The interior that `node` names, or that it describes itself, then of this priority unless it says another.
    fn named_or_inline(&self, loader: &mut Loader, name: &str, node: &Node, priority: u32) -> Result<usize> {
        let Some(volume) = node.get("volume") else {
            let interior = self.content(loader, name, node, priority)?;
            return Ok(loader.volume(interior));
        };
        if let Some(surplus) = VOLUME.iter().find_map(|key| node.get(key)) {
            return Err(surplus.fail("\"volume\" already says what is inside", "keep the name, or what it stands for"));
        }
        self.volume(&volume)
    }

    fn fill(&self, interior: &mut Interior, name: &Node) -> Result<()> {
        let word = name.string()?;
        let Some(medium) = self.media.get(word) else {
            let known: Vec<&str> = self.media.keys().map(String::as_str).collect();
            return Err(name.fail(format!("unknown medium {}", quoted(word)), suggest(word, known)));
        };
        interior.sigma_a = sum(interior.sigma_a.clone(), medium.sigma_a.clone(), name)?;
        interior.sigma_s = medium.sigma_s.clone();
        interior.g = medium.g;
        Ok(())
    }

    /// Puts the material that `node` describes at this index; `name` is for what it encloses.
    pub(in crate::scene) fn place(&self, loader: &mut Loader, index: usize, name: &str, node: &Node) -> Result<()> {
        let material = self.material(loader, name, node)?;
        let film = film(loader, node, &material)?;
        loader.scene.materials[index] = material;
        if let Some(film) = film {
            loader.put_thin_film(index, &film);
        }
        let inner = node.get("conductor").or(node.get("thin_dielectric"));
        if let Some(node) = inner.and_then(|inner| inner.get("anisotropy")) {
            if loader.scene.materials[index].alpha() == Some(0.0) {
                return Err(
                    node.fail("a smooth surface has no grain", "give it a \"roughness\": the least it has in any direction")
                );
            }
            loader.put_grain(index, grain(&node)?);
        }
        Ok(())
    }

    fn material(&self, loader: &mut Loader, name: &str, node: &Node) -> Result<Material> {
        let (kind, inner) = node.one_of(MATERIALS)?;
        inner.object(kind)?;
        Ok(match kind {
            "diffuse" => Material::Diffuse { reflectance: loader.share(&inner.need("reflectance")?)? },
            "diffuse_transmission" => {
                Material::DiffuseTransmission { transmittance: loader.share(&inner.need("transmittance")?)? }
            }
            "dielectric" => {
                if inner.get("volume").is_none() {
                    inner.need("ior")?;
                }
                let interior = self.named_or_inline(loader, name, &inner, 1)?;
                let (roughness, tint) = (loader.roughness(&inner)?, tint(loader, &inner)?);
                loader.rough(&roughness, |alpha| Material::Dielectric {
                    interior,
                    alpha,
                    tint: tint.clone(),
                    antireflective: false,
                })
            }
            "thin_dielectric" => {
                let ior = loader.reader.ior(&inner.need("ior")?)?;
                note_extrapolation(loader, name, &ior);
                let depth = match (inner.get("absorption"), inner.get("thickness")) {
                    (None, _) => Spectrum::Constant(0.0),
                    (Some(absorption), Some(thickness)) => {
                        absorption_of(loader, &absorption, inner.get("ior").as_ref())?.scaled(thickness.length()?)
                    }
                    (Some(absorption), None) => {
                        return Err(
                            absorption.fail("a pane without a thickness has nothing that absorbs", "add \"thickness\" in m")
                        );
                    }
                };
                let (roughness, tint) = (loader.roughness(&inner)?, tint(loader, &inner)?);
                let pane = |alpha| Material::ThinDielectric { ior: ior.clone(), alpha, tint: tint.clone(), depth: depth.clone() };
                loader.rough(&roughness, pane)
            }
            "conductor" => {
                let roughness = loader.roughness(&inner)?;
                if let Some(reflectance) = inner.get("reflectance") {
                    if let Some(surplus) = ["metal", "eta", "k"].iter().find_map(|key| inner.get(key)) {
                        return Err(surplus.fail("\"reflectance\" already says what it reflects", "keep one of the two"));
                    }
                    let reflectance = loader.share(&reflectance)?;
                    return Ok(
                        loader.rough(&roughness, |alpha| Material::ColoredConductor { reflectance: reflectance.clone(), alpha })
                    );
                }
                let (eta, k) = conductor(loader, &inner)?;
                loader.rough(&roughness, |alpha| Material::Conductor { eta: eta.clone(), k: k.clone(), alpha })
            }
            "coated" => {
                let ior = loader.reader.ior(&inner.need("ior")?)?;
                note_extrapolation(loader, name, &ior);
                let (base, roughness) = (loader.material_index(&inner.need("of")?)?, loader.roughness(&inner)?);
                loader.rough(&roughness, |alpha| Material::Coated {
                    base,
                    ior: ior.clone(),
                    alpha,
                    seen: false,
                    normals: CoatNormals::OfBase,
                })
            }
            "sheen" => {
                let color = loader.reader.spectrum(&inner.need("color")?, Place::Share)?;
                let (base, roughness) = (loader.material_index(&inner.need("of")?)?, loader.roughness(&inner)?);
                loader.rough(&roughness, |alpha| Material::Sheen { base, color: color.clone(), alpha: alpha.max(LEAST) })
            }
            "mix" => Material::Mix {
                a: loader.material_index(&inner.need("a")?)?,
                b: loader.material_index(&inner.need("b")?)?,
                weight: loader.share(&inner.need("weight")?)?,
            },
            "normal_map" => {
                Material::NormalMapped { base: loader.material_index(&inner.need("of")?)?, normals: loader.normals(&inner)? }
            }
            _ => Material::Boundary { interior: self.boundary(loader, name, &inner)? },
        })
    }

    fn boundary(&self, loader: &mut Loader, name: &str, node: &Node) -> Result<Option<usize>> {
        let is_bare = node.get("medium").or(node.get("volume")).is_none();
        if let (true, Some(surplus)) = (is_bare, node.get("ior").or(node.get("priority"))) {
            return Err(surplus.fail("a boundary without a medium has no inside", "add \"medium\", or remove this key"));
        }
        if is_bare { Ok(None) } else { Ok(Some(self.named_or_inline(loader, name, node, 0)?)) }
    }
}

impl Interior {
    /// Index 1, nothing in it, lowest priority.
    pub(in crate::scene) fn vacuum(name: &str) -> Self {
        Interior {
            name: name.chars().filter(|c| !c.is_control()).collect(),
            ior: Ior::constant(1.0),
            sigma_a: Spectrum::Constant(0.0),
            sigma_s: Spectrum::Constant(0.0),
            g: 0.0,
            priority: 0,
            depth: 0,
        }
    }
}

impl Loader {
    /// Puts a film on the material at this index, or on what it is made of.
    pub(in crate::scene) fn put_thin_film(&mut self, index: usize, film: &ThinFilm) {
        let simple = |i: &usize| self.scene.materials[*i].parts().is_empty();
        let filmed: Vec<usize> = self.scene.made_of(index).into_iter().filter(simple).collect();
        self.scene.thin_films.extend(filmed.into_iter().map(|i| (i, film.clone())));
    }

    /// The index of the material that `node` names.
    pub(in crate::scene) fn material_index(&self, node: &Node) -> Result<usize> {
        let name = node.string()?;
        let unknown =
            || node.fail(format!("unknown material {}", quoted(name)), suggest(name, self.names.keys().map(String::as_str)));
        self.names.get(name).copied().ok_or_else(unknown)
    }
}

/// The factor on what glass lets through.
fn tint(loader: &mut Loader, node: &Node) -> Result<Option<Texture>> {
    node.get("tint").map(|tint| loader.share(&tint)).transpose()
}

/// The film on a material, or of a pane that is one itself.
fn film(loader: &Loader, node: &Node, material: &Material) -> Result<Option<ThinFilm>> {
    let (_, inner) = node.one_of(MATERIALS)?;
    let first = if let Material::Graded { materials, .. } = material { &loader.scene.materials[materials[0]] } else { material };
    let (node, own_ior) = match (first, inner.get("thin_film"), inner.get("thickness")) {
        (Material::ThinDielectric { .. }, Some(node), Some(_)) => {
            return Err(node.fail("a film on what absorbs, or is a film itself", "leave out \"thickness\", or the film"));
        }
        (_, Some(node), _) => {
            node.object("thin_film")?;
            (node, None)
        }
        // Of a pane that absorbs, it is that of the glass.
        (Material::ThinDielectric { ior, depth, .. }, None, Some(_)) if depth.is_zero() => (inner, Some(ior)),
        _ => return Ok(None),
    };
    match first {
        Material::Dielectric { .. } if !matches!(material, Material::Dielectric { alpha: 0.0, .. }) => {
            return Err(node.fail("a film on rough glass", "make the glass smooth, or leave out the film"));
        }
        Material::ColoredConductor { .. } => {
            return Err(node.fail("what a film does depends on the metal's index", "give \"metal\", or \"eta\" and \"k\""));
        }
        _ => {}
    }
    let ior = own_ior.map_or_else(|| loader.reader.ior(&node.need("ior")?), |ior| Ok(ior.clone()))?;
    let thickness = node.need("thickness")?;
    let thickness_nm = thickness.thickness()?;
    if thickness_nm > 0.0 && thickness_nm < COLOURLESS_FILM {
        let text = format!("a film of {thickness_nm} nm is too thin to show; if um were meant, write {}", 1000.0 * thickness_nm);
        loader.reader.remarks.warn(&thickness, &text);
    }
    Ok(Some(ThinFilm { ior, thickness_nm }))
}

fn medium(loader: &Loader, node: &Node) -> Result<Medium> {
    node.object("medium")?;
    let coefficient = |key| match node.get(key) {
        Some(n) => loader.reader.spectrum(&n, Place::Coefficient),
        None => Ok(Spectrum::Constant(0.0)),
    };
    let g = node.get("g").map_or(Ok(0.0), |n| n.within(-0.999, 0.999))?;
    Ok(Medium { sigma_a: coefficient("sigma_a")?, sigma_s: coefficient("sigma_s")?, g })
}

/// Glass absorbs by itself or by what is dissolved in it: both together are not one spectrum here.
fn sum(own: Spectrum, medium: Spectrum, at: &Node) -> Result<Spectrum> {
    match (own.is_zero(), medium.is_zero()) {
        (true, _) => Ok(medium),
        (false, true) => Ok(own),
        (false, false) => Err(at.fail("both \"absorption\" and the medium's \"sigma_a\" absorb", "keep one of the two")),
    }
}

/// `absorption` in m^-1: a spectrum, what is left of light after a distance, or `"catalogue"` for what is known of the named glass.
fn absorption_of(loader: &Loader, node: &Node, ior: Option<&Node>) -> Result<Spectrum> {
    if let (true, Some(color)) = (node.value.is_object(), node.get("color")) {
        node.object("absorption")?;
        let distance = node.need("distance")?.length()?;
        let color = loader.reader.spectrum(&color, Place::Share)?;
        return Ok(color.attenuation(distance, loader.reader.range));
    }
    if !node.value.is_string() {
        return loader.reader.spectrum(node, Place::Coefficient);
    }
    node.choice(&["catalogue"])?;
    if let Some((ior, file)) = ior.and_then(|ior| Some((ior, ior.get("file")?))) {
        let spectrum = loader.reader.glass_file(ior, &file)?.absorption();
        return known_absorption(loader, node, spectrum, &file);
    }
    let name = ior.map(|ior| ior.get("glass").unwrap_or_else(|| ior.clone()));
    let Some(at) = name.filter(|name| name.value.is_string()) else {
        return Err(node.fail("the glass has no name to look up", "name the glass, or give the absorption in m^-1"));
    };
    known_absorption(loader, node, library::glass_absorption(at.string()?), &at)
}

/// The absorption that is known of the glass that `glass` names.
fn known_absorption(loader: &Loader, node: &Node, found: Option<Spectrum>, glass: &Node) -> Result<Spectrum> {
    let unknown = || {
        node.fail(
            format!("no absorption is known of {}", quoted(glass.string().unwrap_or_default())),
            "give the absorption in m^-1",
        )
    };
    let spectrum = found.ok_or_else(unknown)?;
    loader.reader.check(node, &spectrum, Place::Coefficient)?;
    loader.reader.note_held(node, &spectrum);
    Ok(spectrum)
}

fn conductor(loader: &Loader, node: &Node) -> Result<(Spectrum, Spectrum)> {
    if let Some(metal) = node.get("metal") {
        if let Some(surplus) = node.get("eta").or(node.get("k")) {
            return Err(surplus.fail("\"metal\" already gives eta and k", "keep either the name or the numbers"));
        }
        let name = metal.string()?;
        let unknown =
            || metal.fail(format!("unknown metal {}", quoted(name)), suggest(name, library::metal_names().iter().copied()));
        let (eta, k) = library::metal(name).ok_or_else(unknown)?;
        loader.reader.note_held(&metal, &eta);
        return Ok((eta, k));
    }
    let missing = |key| node.fail(format!("{key:?} is missing"), "add \"metal\", \"reflectance\", or \"eta\" and \"k\"");
    let [eta, k] = ["eta", "k"].map(|key| node.get(key).ok_or_else(|| missing(key)));
    Ok((loader.reader.spectrum(&eta?, Place::Coefficient)?, loader.reader.spectrum(&k?, Place::Coefficient)?))
}

pub(in crate::scene) fn note_extrapolation(loader: &mut Loader, name: &str, ior: &Ior) {
    let (lo, hi) = loader.reader.range;
    let (min, max) = ior.range_nm;
    if ior.extrapolate && (lo < min || hi > max) {
        loader.note(format!("the index of {} is known from {min} to {max} nm and extrapolated to {lo} to {hi} nm", quoted(name)));
    }
}

/// Light gets through a mixture in one way, or not at all.
pub(in crate::scene) fn check_passage(scene: &Scene, index: usize, node: &Node) -> Result<()> {
    let what = |way: &Passage| match way {
        Passage::Refracted(i) => format!("the solid {:?}", scene.interiors[*i].name),
        Passage::Into(i) => format!("a boundary of {:?}", scene.interiors[*i].name),
        Passage::Straight | Passage::None => "a thin pane or nothing".into(),
    };
    scene.passage(index).map(|_| ()).map_err(|ways| {
        let [a, b] = ways.each_ref().map(what);
        node.fail(
            format!("a mix of {a} and {b} would make light or lose it, as its two sides would not be one volume"),
            "mix surfaces of one and the same volume, or use \"thin_dielectric\" in place of the solid",
        )
    })
}

/// What contains itself or is nested too deeply is an error, and so is a coat on what does not end a ray.
fn check_parts(materials: &[Material], index: usize, depth: usize) -> std::result::Result<(), String> {
    if depth > DEEPEST_MIX {
        return Err(format!("materials contain each other, or are nested more than {DEEPEST_MIX} deep"));
    }
    match &materials[index] {
        Material::Coated { base, .. } => {
            check_parts(materials, *base, depth + 1)?;
            if is_coatable(materials, *base) {
                Ok(())
            } else {
                Err("a coat lies on paint or metal, or on mixtures of them".into())
            }
        }
        Material::Sheen { base, .. } => {
            check_parts(materials, *base, depth + 1)?;
            if wears_sheen(materials, *base) {
                Ok(())
            } else {
                Err("sheen lies on paint, metal or what is coated, or on mixtures of them".into())
            }
        }
        part => part.parts().into_iter().try_for_each(|part| check_parts(materials, part, depth + 1)),
    }
}

fn wears_sheen(materials: &[Material], index: usize) -> bool {
    match &materials[index] {
        Material::Coated { .. } => true,
        part @ (Material::Graded { .. } | Material::Mix { .. }) => {
            part.parts().into_iter().all(|part| wears_sheen(materials, part))
        }
        _ => is_coatable(materials, index),
    }
}

fn is_coatable(materials: &[Material], index: usize) -> bool {
    match &materials[index] {
        Material::Diffuse { .. }
        | Material::DiffuseTransmission { .. }
        | Material::Conductor { .. }
        | Material::ColoredConductor { .. } => true,
        part @ (Material::Graded { .. } | Material::Mix { .. }) => {
            part.parts().into_iter().all(|part| is_coatable(materials, part))
        }
        _ => false,
    }
}
