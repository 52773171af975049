//! Animations of a glTF file: where its nodes stand at a time (glTF 2.0, 3.11 and appendix C). All of a file's animations run, from 0 s on; before its first
//! keyframe and after its last a property has the value there.

use crate::error::Result;
use crate::scene::gltf::document::{Asset, item};
use crate::scene::json::Node;
use glam::{DQuat, DVec3, DVec4};
use std::collections::HashMap;

/// What of a node's transform is animated.
#[derive(Default, Clone, Copy)]
pub(in crate::scene) struct Moved {
    pub translation: Option<DVec3>,
    /// Of length 1.
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
}

/// Nodes that move, by their numbers, and what is to be told of what was left out.
#[derive(Default)]
pub(in crate::scene) struct Motion {
    pub nodes: HashMap<usize, Moved>,
    pub notes: Vec<&'static str>,
}

/// Where the animated nodes of a document stand after so many seconds.
///
/// # Errors
/// Samplers, accessors or nodes that are not there, or whose numbers do not fit.
pub(in crate::scene) fn motion(asset: &Asset, root: &Node, seconds: f64) -> Result<Motion> {
    let mut motion = Motion::default();
    for animation in root.get("animations").map_or(Ok(Vec::new()), |n| n.array(0))? {
        for channel in animation.need("channels")?.array(0)? {
            let target = channel.need("target")?;
            let path = target.need("path")?;
            // Without a node an extension says what it is.
            let Some(node) = target.get("node").filter(|_| path.value != "pointer") else {
                motion.note("animations of other things than nodes are left out");
                continue;
            };
            item(root, "nodes", &node)?;
            let index = channel.need("sampler")?;
            let sampler = animation.need("samplers")?.element(index.integer(0, u32::MAX)? as usize);
            let sampler = sampler.ok_or_else(|| index.fail("there is no such sampler", "export the file again"))?;
            let moved = motion.nodes.entry(node.integer(0, u32::MAX)? as usize).or_default();
            let is_new = match path.string()? {
                "translation" => set(&mut moved.translation, DVec3::from_array(sampled(asset, root, &sampler, seconds, line)?)),
                "scale" => set(&mut moved.scale, DVec3::from_array(sampled(asset, root, &sampler, seconds, line)?)),
                "rotation" => {
                    let rotation = DVec4::from_array(sampled(asset, root, &sampler, seconds, arc)?);
                    let rotation = rotation.try_normalize();
                    let rotation =
                        rotation.ok_or_else(|| sampler.fail("a rotation without direction", "export the file again"))?;
                    set(&mut moved.rotation, DQuat::from_vec4(rotation))
                }
                "weights" => {
                    motion.note("animated weights of morph targets are left out: they stay as at rest");
                    continue;
                }
                _ => return Err(path.fail("no property of a node that moves", "use translation, rotation or scale")),
            };
            if !is_new {
                motion.note("where several animations move the same of a node, the first one counts");
            }
        }
    }
    Ok(motion)
}

impl Motion {
    fn note(&mut self, note: &'static str) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// Sets what is not set yet; whether it was.
fn set<T>(place: &mut Option<T>, value: T) -> bool {
    let is_new = place.is_none();
    place.get_or_insert(value);
    is_new
}

/// Between two values, at a share from 0 to 1.
type Between<const N: usize> = fn([f64; N], [f64; N], f64) -> [f64; N];

/// The value of a sampler at a time; `between` is what LINEAR means for it.
fn sampled<const N: usize>(asset: &Asset, root: &Node, sampler: &Node, seconds: f64, between: Between<N>) -> Result<[f64; N]> {
    let accessor = |key: &str| {
        let index = sampler.need(key)?;
        item(root, "accessors", &index)?;
        let found = asset.gltf.accessors().nth(index.integer(0, u32::MAX)? as usize);
        found.ok_or_else(|| index.fail("there is no such accessor", "export the file again"))
    };
    let times = asset.numbers::<1>(root, &accessor("input")?)?;
    let values = asset.numbers::<N>(root, &accessor("output")?)?;
    let interpolation = sampler.get("interpolation").map(|n| n.choice(&["LINEAR", "STEP", "CUBICSPLINE"])).transpose()?;
    let is_cubic = interpolation == Some("CUBICSPLINE");
    let each = if is_cubic { 3 } else { 1 };
    if times.is_empty() || values.len() != each * times.len() {
        let problem = format!("{} values for {} keyframes", values.len(), times.len());
        return Err(sampler.fail(problem, "export the file again"));
    }
    let is_finite = times.iter().flatten().chain(values.iter().flatten()).all(|v| v.is_finite());
    if !is_finite || times.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(sampler.fail("its keyframes do not rise, or are not finite", "export the file again"));
    }
    // Of a cubic spline: slope that leads in, value, slope that leads out.
    let value = |k: usize| values[each * k + each / 2];
    let last = times.len() - 1;
    let k = times.iter().rposition(|[at]| *at <= seconds).unwrap_or(0);
    let [at] = times[k];
    if k == last || seconds <= at || interpolation == Some("STEP") {
        return Ok(value(k));
    }
    let width = times[k + 1][0] - at;
    let t = (seconds - at) / width;
    if !is_cubic {
        return Ok(between(value(k), value(k + 1), t));
    }
    let (out, into) = (values[3 * k + 2], values[3 * (k + 1)]);
    let (t2, t3) = (t * t, t * t * t);
    Ok(std::array::from_fn(|i| {
        (2.0 * t3 - 3.0 * t2 + 1.0) * value(k)[i]
            + width * (t3 - 2.0 * t2 + t) * out[i]
            + (3.0 * t2 - 2.0 * t3) * value(k + 1)[i]
            + width * (t3 - t2) * into[i]
    }))
}

/// On the line.
fn line<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// Of rotations, on the shorter arc (Shoemake 1985).
fn arc(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    let quaternion = |q: [f64; 4]| DVec4::from_array(q).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4);
    quaternion(a).slerp(quaternion(b), t).to_array()
}
