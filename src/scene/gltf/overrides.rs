//! `"override": {"Glass": {"dielectric": {"ior": "N-SF66"}}}`: other materials for those of a glTF file, by their names there.

use crate::error::{Result, quoted, suggest};
use crate::scene::Material;
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::json::materials::check_passage;

/// What replaces a glTF file's materials.
#[derive(Default)]
pub(in crate::scene) struct Overrides<'a> {
    /// Index of a glTF material, the material that replaces it, if one does, and what it emits instead, if that is replaced.
    list: Vec<(usize, Option<usize>, Option<Node<'a>>)>,
}

impl<'a> Overrides<'a> {
    /// Reads `node` for the glTF document `root`. Every name must be that of a material there.
    pub(in crate::scene) fn read(loader: &mut Loader, node: &Node<'a>, root: &Node) -> Result<Self> {
        let materials = root.get("materials").map_or(Ok(Vec::new()), |n| n.array(0))?;
        let names: Vec<&str> =
            materials.iter().map(|m| m.get("name").and_then(|n| n.value.as_str()).unwrap_or_default()).collect();
        let mut list = Vec::new();
        for (name, node) in node.entries()? {
            node.object("override")?;
            let emission = node.get("emission");
            let material = match (node.get("use"), emission.is_some() && node.entries()?.len() == 1) {
                (Some(known), _) => Some(loader.material_index(&known)?),
                (None, true) => None,
                (None, false) => {
                    let index = loader.scene.materials.len();
                    loader.scene.materials.push(Material::NOTHING);
                    loader.kit.clone().place(loader, index, name, &node)?;
                    check_passage(&loader.scene, index, &node)?;
                    Some(index)
                }
            };
            if !names.contains(&name) {
                let known = names.iter().copied().filter(|n| !n.is_empty());
                return Err(node.fail(format!("the file has no material {}", quoted(name)), suggest(name, known)));
            }
            let matching = names.iter().enumerate().filter(|(_, n)| **n == name);
            list.extend(matching.map(|(i, _)| (i, material, emission.clone())));
        }
        Ok(Overrides { list })
    }

    /// The material that replaces glTF material `index`, if one does.
    pub(in crate::scene) fn material(&self, index: usize) -> Option<usize> {
        self.of(index).find_map(|(_, material, _)| *material)
    }

    /// What glTF material `index` emits instead, if that is replaced.
    pub(in crate::scene) fn emission(&self, index: usize) -> Option<&Node<'a>> {
        self.of(index).find_map(|(.., emission)| emission.as_ref())
    }

    fn of(&self, index: usize) -> impl Iterator<Item = &(usize, Option<usize>, Option<Node<'a>>)> {
        self.list.iter().filter(move |(i, ..)| *i == index)
    }
}
