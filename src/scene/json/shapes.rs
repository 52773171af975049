//! Shapes: geometry, material, emission and transform; groups of them, and instances of groups.

use crate::error::{Result, quoted, suggest};
use crate::geometry::area;
use crate::scene::gltf;
use crate::scene::gltf::Included;
use crate::scene::json::Node;
use crate::scene::json::keys::GEOMETRIES;
use crate::scene::json::load::{Loader, edges};
use crate::scene::json::spectra::Place;
use crate::scene::json::transform;
use crate::scene::json::units::Source;
use crate::scene::mesh;
use crate::scene::{Emission, Geometry, Material, Mesh, Passage, Shape};
use crate::spectrum::Spectrum;
use glam::{DMat4, DVec2, DVec3};
use std::sync::Arc;

/// Instances of groups may be nested this deep.
const DEEPEST_INSTANCE: usize = 16;
/// Shapes, instances and glTF nodes that are visited at most.
const MOST_VISITS: u32 = 1_000_000;
/// Triangles of the whole scene at most, those of shared meshes counted once.
pub(in crate::scene) const MOST_TRIANGLES: usize = 20_000_000;

/// Units of length, m.
const UNITS: [(&str, f64); 6] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("um", 1e-6), ("in", 0.0254), ("ft", 0.3048)];

impl Loader {
    /// Reads `shapes`, with `groups` to take instances from.
    pub(in crate::scene) fn shapes(&mut self, root: &Node) -> Result<()> {
        let groups = root.get("groups").map_or(Ok(Vec::new()), |n| n.entries())?;
        for (_, group) in &groups {
            group.array(1)?;
        }
        if let Some(shapes) = root.get("shapes") {
            let mut included = Included::default();
            for node in shapes.array(0)? {
                self.shape(&node, &groups, &mut included, DMat4::IDENTITY, 0)?;
            }
        }
        Ok(())
    }

    /// Counts a visit, so that no scene makes the loader run for ever.
    pub(in crate::scene) fn visit(&mut self, node: &Node) -> Result<()> {
        self.visits += 1;
        if self.visits > MOST_VISITS {
            return Err(
                node.fail(format!("the scene has more than {MOST_VISITS} shapes"), "use fewer instances, or merge meshes")
            );
        }
        Ok(())
    }

    fn shape<'a>(
        &mut self,
        node: &Node<'a>,
        groups: &[(&str, Node<'a>)],
        included: &mut Included<'a>,
        parent: DMat4,
        depth: usize,
    ) -> Result<()> {
        self.visit(node)?;
        node.object("shape")?;
        let (kind, inner) = node.one_of(GEOMETRIES)?;
        let world = match node.get("transform") {
            Some(t) => parent * transform::parse(&t)?,
            None => parent,
        };
        let world = unit(node, &inner)?.map_or(world, |metres| world * DMat4::from_scale(DVec3::splat(metres)));
        let surplus = node.get("material").or(node.get("emission")).or(node.get("volume"));
        if let (Some(surplus), "instance" | "gltf" | "lens") = (surplus, kind) {
            return Err(surplus.fail(format!("{kind:?} brings its own materials"), "remove this key"));
        }
        match kind {
            "instance" => {
                let name = inner.string()?;
                let Some((_, group)) = groups.iter().find(|(n, _)| *n == name) else {
                    return Err(
                        inner.fail(format!("unknown group {}", quoted(name)), suggest(name, groups.iter().map(|(n, _)| *n)))
                    );
                };
                if depth == DEEPEST_INSTANCE {
                    return Err(inner.fail("groups contain each other, or are nested too deeply", "break the circle"));
                }
                group.array(1)?.iter().try_for_each(|member| self.shape(member, groups, included, world, depth + 1))
            }
            "gltf" => {
                inner.object("gltf")?;
                gltf::include(self, &inner, included, world)
            }
            "lens" => self.lens(node, &inner, &world),
            _ => self.solid(node, kind, &inner, &world),
        }
    }

    fn solid(&mut self, node: &Node, kind: &str, inner: &Node, world: &DMat4) -> Result<()> {
        inner.object(kind)?;
        let mut parts = Vec::new();
        for part in self.geometry(kind, inner)? {
            let (placed, dropped) = self.place(inner, world, &part)?;
            if dropped > 0 {
                self.note(format!("{}: {dropped} triangles of no area were dropped", inner.path));
            }
            if matches!(&placed, Geometry::Mesh(mesh) if mesh.triangles.is_empty()) {
                return Err(inner.fail("no triangle has an area", "use a mesh with faces, and a transform that keeps them"));
            }
            parts.push(placed);
        }
        let name = name_of(node)?;
        let emission = node.get("emission").map(|e| self.emission(&e, &parts)).transpose()?;
        let material = match node.get("material") {
            Some(material) => self.material_index(&material)?,
            // A lamp that says nothing else reflects nothing.
            None if emission.is_some() => self.black(),
            None => return Err(node.fail("\"material\" is missing", "add \"material\" (or \"emission\", for a lamp)")),
        };
        let interior = node.get("volume").map(|volume| self.kit.volume(&volume)).transpose()?;
        let passage = self.scene.passage(material).unwrap_or(Passage::None);
        let is_other = |own| interior.is_some_and(|interior| interior != own);
        match passage {
            Passage::Refracted(own) | Passage::Into(own) if is_other(own) => {
                let problem = format!("the material bounds another volume, {:?}", self.scene.interiors[own].name);
                return Err(node.fail(problem, "remove \"volume\", or use a material that bounds this one"));
            }
            Passage::Straight if interior.is_some() => {
                return Err(node.fail(
                    "light goes straight through the material, so no volume is bounded by it",
                    "remove \"volume\", or use a dielectric or a boundary that names it",
                ));
            }
            _ => {}
        }
        for geometry in parts {
            self.push(node, Shape { name: name.clone(), geometry, material, interior, emission: emission.clone() })?;
        }
        Ok(())
    }

    /// Geometry under a transform, a large mesh as an instance; the second value counts dropped triangles.
    pub(in crate::scene) fn place(&mut self, node: &Node, world: &DMat4, geometry: &Geometry) -> Result<(Geometry, usize)> {
        let fail = |(problem, remedy): transform::Flaw| node.fail(problem, remedy);
        if let Geometry::Mesh(mesh) = geometry
            && let Some((instance, dropped, new)) = self.shared.instance(mesh, world).map_err(fail)?
        {
            self.count_triangles(node, new)?;
            return Ok((Geometry::Instance(instance), dropped));
        }
        transform::apply(world, geometry).map_err(fail)
    }

    fn count_triangles(&mut self, node: &Node, new: usize) -> Result<()> {
        self.triangles += new;
        if self.triangles > MOST_TRIANGLES {
            let problem = format!("the scene has more than {MOST_TRIANGLES} triangles");
            return Err(node.fail(problem, "use smaller meshes or fewer instances"));
        }
        Ok(())
    }

    /// Adds a shape to the scene.
    pub(in crate::scene) fn push(&mut self, node: &Node, mut shape: Shape) -> Result<()> {
        // Every triangle of a lamp is a light of its own.
        if let (Geometry::Instance(instance), Some(_)) = (&shape.geometry, &shape.emission) {
            shape.geometry = Geometry::Mesh(Arc::new(instance.flattened()));
        }
        if let Geometry::Mesh(mesh) = &shape.geometry {
            self.count_triangles(node, mesh.triangles.len())?;
        }
        if self.has_image(shape.material, shape.emission.as_ref()) {
            mesh::check_uvs(&shape.geometry).map_err(|(problem, remedy)| node.fail(problem, remedy))?;
        }
        self.scene.shapes.push(shape);
        Ok(())
    }

    /// Is there a picture in this material or emission?
    pub(in crate::scene) fn has_image(&self, material: usize, emission: Option<&Emission>) -> bool {
        let is_pictured = |m: usize| self.scene.materials[m].image().is_some();
        emission.is_some_and(|e| e.radiance.image().is_some()) || self.scene.made_of(material).into_iter().any(is_pictured)
    }

    /// The material that reflects nothing.
    pub(in crate::scene) fn black(&mut self) -> usize {
        *self.black.get_or_insert_with(|| {
            self.scene.materials.push(Material::Diffuse { reflectance: Spectrum::Constant(0.0).into() });
            self.scene.materials.len() - 1
        })
    }

    pub(in crate::scene) fn emission(&mut self, node: &Node, parts: &[Geometry]) -> Result<Emission> {
        node.object("emission")?;
        let two_sided = node.get("two_sided").map_or(Ok(false), |n| n.boolean())?;
        let area: f64 = parts.iter().map(area).sum();
        let sides = if two_sided { 2.0 } else { 1.0 };
        let radiance = node.need("radiance")?;
        let radiance = match self.image_texture(&radiance, Place::Light)? {
            Some(image) => image,
            None => self.reader.light(&radiance, Source::Surface(sides * area))?.into(),
        };
        Ok(Emission { radiance, two_sided })
    }

    fn geometry(&mut self, kind: &str, node: &Node) -> Result<Vec<Geometry>> {
        Ok(vec![match kind {
            "sphere" => Geometry::Sphere { center: node.need("center")?.point()?, radius: node.need("radius")?.length()? },
            "disc" => Geometry::Disc {
                center: node.need("center")?.point()?,
                normal: node.need("normal")?.direction()?,
                radius: node.need("radius")?.length()?,
            },
            "cylinder" => return cylinder(node),
            "quad" => quad(node)?,
            "box" => cuboid(node)?,
            "prism" => prism(node)?,
            _ => Geometry::Mesh(self.mesh_file(node)?),
        }])
    }

    fn mesh_file(&mut self, node: &Node) -> Result<Arc<Mesh>> {
        let file = node.need("file")?;
        let smooth = node.get("smooth").map(|n| n.boolean()).transpose()?;
        let key = (self.reader.files.base.join(file.string()?), smooth);
        if let Some(known) = self.meshes.get(&key) {
            return Ok(known.clone());
        }
        let (path, bytes) = self.reader.files.read(&file)?;
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let mut mesh = if extension == "glb" || extension == "gltf" {
            gltf::mesh(self, &file, &path, bytes)?
        } else {
            let name = quoted(file.string()?);
            mesh::read(&path, &bytes).map_err(|(problem, remedy)| file.fail(format!("{name}: {problem}"), remedy))?
        };
        match smooth {
            Some(false) => mesh.normals.clear(),
            Some(true) if mesh.normals.is_empty() => {
                // Checked here, as normals need positions that are there.
                let (checked, _) =
                    mesh::place(&mesh, &DMat4::IDENTITY).map_err(|(problem, remedy)| file.fail(problem, remedy))?;
                mesh.normals = mesh::smooth_normals(&checked);
            }
            _ => {}
        }
        let mesh = Arc::new(mesh);
        self.meshes.insert(key, mesh.clone());
        Ok(mesh)
    }
}

/// What messages call a shape.
pub(in crate::scene) fn name_of(node: &Node) -> Result<String> {
    let default_name = node.path.trim_start_matches("$.").to_string();
    node.get("name").map_or(Ok(default_name), |n| n.string().map(|s| s.chars().filter(|c| !c.is_control()).collect()))
}

/// What the lengths of a shape, or of the file of a mesh, are given in, m.
fn unit(shape: &Node, geometry: &Node) -> Result<Option<f64>> {
    let (of_shape, of_file) = (shape.get("unit"), geometry.get("unit"));
    if let (Some(_), Some(surplus)) = (&of_shape, &of_file) {
        return Err(surplus.fail("the shape has a \"unit\" already", "keep one of the two"));
    }
    let Some(unit) = of_shape.or(of_file) else { return Ok(None) };
    metres(&unit).map(Some)
}

/// The unit of length that a text names, m.
pub(in crate::scene) fn metres(unit: &Node) -> Result<f64> {
    let names = UNITS.map(|(name, _)| name);
    let name = unit.choice(&names)?;
    Ok(UNITS.iter().find(|(known, _)| *known == name).map_or(1.0, |(_, metres)| *metres))
}

fn polyhedron(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Geometry {
    Geometry::Mesh(Arc::new(Mesh { positions, triangles, ..Mesh::default() }))
}

/// A parallelogram; its normal is `edge_u x edge_v`. Pictures stand on it with `edge_u` to the right and `edge_v` upwards.
fn quad(node: &Node) -> Result<Geometry> {
    let corner = node.need("corner")?.point()?;
    let (u, v) = edges(node)?;
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(DVec2::from_array).to_vec();
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    Ok(Geometry::Mesh(Arc::new(Mesh { positions, uvs, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() })))
}

/// An axis-parallel box, normals outwards.
fn cuboid(node: &Node) -> Result<Geometry> {
    let (min, max) = (node.need("min")?.point()?, node.need("max")?.point()?);
    if !min.cmplt(max).all() {
        return Err(node.fail("min is not below max in every coordinate", "give opposite corners, the lower one as \"min\""));
    }
    let pick = |bit: u32, low: f64, high: f64, i: u32| if i >> bit & 1 == 1 { high } else { low };
    let corner = |i| DVec3::new(pick(0, min.x, max.x, i), pick(1, min.y, max.y, i), pick(2, min.z, max.z, i));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
    Ok(polyhedron((0..8).map(corner).collect(), triangles))
}

/// A convex polygon in x and y, drawn out along z to `length`, centred on z = 0; normals outwards.
fn prism(node: &Node) -> Result<Geometry> {
    let polygon = node.need("polygon")?;
    let mut points: Vec<[f64; 2]> = polygon.array(3)?.iter().map(|n| n.numbers()).collect::<Result<_>>()?;
    let half = 0.5 * node.need("length")?.length()?;
    let n = points.len();
    let turn = |p: &[[f64; 2]], i: usize| {
        let [a, b, c] = [p[i], p[(i + 1) % n], p[(i + 2) % n]];
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
    };
    let signs: Vec<f64> = (0..n).map(|i| turn(&points, i)).collect();
    let right_round = signs.iter().all(|&s| s > 0.0);
    if !right_round && !signs.iter().all(|&s| s < 0.0) || !winds_once(&points) {
        return Err(polygon.fail("the polygon is not convex", "list the corners of a convex polygon in order, each once"));
    }
    if !right_round {
        points.reverse();
    }
    let at = |z: f64| points.iter().map(move |p| DVec3::new(p[0], p[1], z));
    let positions: Vec<DVec3> = at(half).chain(at(-half)).collect();
    let m = n as u32;
    let mut triangles = Vec::new();
    for i in 2..m {
        triangles.push([0, i - 1, i]); // front, seen from +z
        triangles.push([m, m + i, m + i - 1]); // back
    }
    for i in 0..m {
        let j = (i + 1) % m;
        triangles.push([i, m + i, m + j]);
        triangles.push([i, m + j, j]);
    }
    Ok(polyhedron(positions, triangles))
}

/// Does a polygon whose turns have one sign go round once (a pentagram goes twice)?
fn winds_once(points: &[[f64; 2]]) -> bool {
    let n = points.len();
    let heading = |i: usize| {
        let (a, b) = (points[i % n], points[(i + 1) % n]);
        (b[1] - a[1]).atan2(b[0] - a[0])
    };
    let turned: f64 = (0..n)
        .map(|i| {
            let d = (heading(i + 1) - heading(i)).rem_euclid(std::f64::consts::TAU);
            if d > std::f64::consts::PI { d - std::f64::consts::TAU } else { d }
        })
        .sum();
    (turned.abs() - std::f64::consts::TAU).abs() < 1.0
}

fn cylinder(node: &Node) -> Result<Vec<Geometry>> {
    let (base, top) = (node.need("base")?.point()?, node.need("top")?.point()?);
    let radius = node.need("radius")?.length()?;
    let length = (top - base).length();
    if length < 1e-12 {
        return Err(node.fail("base and top coincide", "move them apart"));
    }
    let axis = (top - base) / length;
    let mut parts = vec![Geometry::Cylinder { base, axis, length, radius }];
    if node.get("capped").map_or(Ok(false), |n| n.boolean())? {
        parts.push(Geometry::Disc { center: base, normal: -axis, radius });
        parts.push(Geometry::Disc { center: top, normal: axis, radius });
    }
    Ok(parts)
}
