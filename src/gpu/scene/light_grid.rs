//! A grid over the scene whose cells choose among the lights that have a place, each by an alias table of its own over what every light could send there,
//! shadows left out: one or two reads choose, one gives the probability of a choice. A lamp made of triangles sends from every side those that face it, not
//! the half that do not; of many lamps, those close by are chosen. Where lights are too many for tables of their own, those alike in place and direction
//! share an entry, and are chosen among by power (lookup: shaders/light/grid.wgsl).
//!
//! Along each axis half of the cells lie evenly over the scene, half over the lights and what is close by, as far off as they are wide.

use super::alias::alias_table;
use super::placed_lights::{Glimpse, PlacedLight};
use crate::geometry::Bounds;
use glam::{DVec3, UVec4};
use rayon::prelude::*;

/// Entries of the tables of all cells; each takes 8 bytes and some 0.1 us to make.
const ENTRIES: usize = 1 << 21;
/// Entries of a cell's table.
const MOST_ENTRIES: usize = 4096;
/// Cells along an axis.
const MOST_CELLS: usize = 16;
/// Share of choices by power: shadows may hide what seems to matter.
const BY_POWER: f64 = 0.1;
/// Steps of the thresholds, which share a word with the number of an entry.
const STEPS: f64 = 65536.0;

/// The tables of all cells, x fastest, and the constants by which the shader finds a cell.
#[derive(Default)]
pub(super) struct LightGrid {
    /// Two entries to a texel: threshold (upper half) and alias, probability as a float. Where entries stand for several lights, behind all cells the lights
    /// in the order of their entries, one to a texel: threshold and alias among those of the entry, probability there, number; and for each light its place
    /// in that order, four to a texel.
    pub texels: Vec<UVec4>,
    pub constants: String,
}

/// Lights in an order in which those alike follow one another: by the axis that they face, then along a space-filling curve (Morton 1966).
fn order(lights: &[PlacedLight], around: Bounds) -> Vec<usize> {
    let key = |light: &PlacedLight| {
        let (axis, size) = (light.cone.axis, light.cone.axis.abs());
        let along = (0..3).fold(0, |best, i| if size[i] > size[best] { i } else { best });
        let faces = if light.two_sided || light.cone.angle > 1.0 { 6 } else { 2 * along + usize::from(axis[along] < 0.0) };
        let at = (light.center() - around.min) / (around.max - around.min).max(DVec3::splat(1e-30));
        let [x, y, z] = at.to_array().map(|t| (t.clamp(0.0, 1.0) * 1023.0) as u32);
        let code = (0..10).fold(0, |code, bit| {
            code | (x >> bit & 1) << (3 * bit) | (y >> bit & 1) << (3 * bit + 1) | (z >> bit & 1) << (3 * bit + 2)
        });
        (faces, code)
    };
    let mut order: Vec<usize> = (0..lights.len()).collect();
    order.sort_by_cached_key(|&i| key(&lights[i]));
    order
}

/// Where cells lie along the axes: the mean of two ramps from 0 to 1.
struct Ramps {
    scene: Bounds,
    near: Bounds,
}

impl Ramps {
    fn new(scene: Bounds, lights: Bounds) -> Self {
        let farthest = scene.min.abs().max(scene.max.abs()).max_element();
        let extent = (scene.max - scene.min).max_element().max(1e-9 * farthest).max(1e-12);
        // Uneven margins, so that a surface in the middle of a scene is not where two cells meet: rounding would tell which it is in.
        let scene = Bounds { min: scene.min - 0.0037 * extent, max: scene.max + 0.0061 * extent };
        let reach = (lights.max - lights.min).length();
        let near = Bounds { min: (lights.min - reach).max(scene.min), max: (lights.max + reach).min(scene.max) };
        let is_thin = (near.max - near.min).cmple(DVec3::splat(1e-4 * extent));
        let near = Bounds { min: DVec3::select(is_thin, scene.min, near.min), max: DVec3::select(is_thin, scene.max, near.max) };
        Self { scene, near }
    }

    fn at(&self, axis: usize, x: f64) -> f64 {
        let ramp = |b: &Bounds| ((x - b.min[axis]) / (b.max[axis] - b.min[axis])).clamp(0.0, 1.0);
        0.5 * (ramp(&self.scene) + ramp(&self.near))
    }

    /// Where along the axis the ramps' mean is `t`.
    fn inverse(&self, axis: usize, t: f64) -> f64 {
        let (mut low, mut high) = (self.scene.min[axis], self.scene.max[axis]);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.at(axis, middle) < t {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    fn constants(&self, origin: DVec3) -> String {
        let vector = |v: DVec3| format!("vec3f({:?}, {:?}, {:?})", v.x as f32, v.y as f32, v.z as f32);
        let ramp = |name: &str, b: &Bounds| {
            let [low, per_metre] = [b.min - origin, 1.0 / (b.max - b.min)].map(vector);
            format!("const {name}_LOW = {low};\nconst {name}_PER_METRE = {per_metre};\n")
        };
        ramp("SCENE_RAMP", &self.scene) + &ramp("NEAR_RAMP", &self.near)
    }
}

/// The grid for `lights`, whose shares are by power, in a scene with these bounds. Positions are relative to `origin`.
pub(super) fn build(lights: &[PlacedLight], scene: Bounds, origin: DVec3) -> LightGrid {
    let around = lights.iter().map(|l| l.bounds).fold(Bounds::EMPTY, Bounds::union);
    let ramps = Ramps::new(if scene.is_empty() { around } else { scene }, around);
    let each = lights.len().div_ceil(MOST_ENTRIES).max(1);
    let order = if each > 1 { order(lights, around) } else { (0..lights.len()).collect() };
    let entries: Vec<PlacedLight> =
        order.chunks(each).filter_map(|c| c.iter().map(|&i| lights[i]).reduce(PlacedLight::union)).collect();
    let side = (((ENTRIES / entries.len().max(1)) as f64).cbrt() as usize).min(MOST_CELLS);
    let seen: Vec<Glimpse> = entries.iter().map(Glimpse::from).collect();
    let total: f64 = lights.iter().map(|l| l.share).sum();
    let by_power: Vec<f64> = entries.iter().map(|l| l.share / total).collect();
    // Two places in each cell along each axis, and of the eight points that they make every other: each two of these differ along two axes.
    let points = [0, 1, 2]
        .map(|axis| (0..2 * side).map(|i| ramps.inverse(axis, (0.5 * i as f64 + 0.25) / side as f64)).collect::<Vec<_>>());
    let mut texels: Vec<UVec4> = (0..side * side * side)
        .into_par_iter()
        .flat_map_iter(|cell| {
            let at = [cell % side, cell / side % side, cell / (side * side)];
            let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|axis| points[axis][2 * at[axis] + (i >> axis & 1)]));
            let table = table(&weights(&seen, &by_power, &[0, 3, 5, 6].map(corner)));
            table.chunks(2).map(|c| UVec4::new(c[0].0, c[0].1, c[c.len() - 1].0, c[c.len() - 1].1)).collect::<Vec<_>>()
        })
        .collect();
    let constants = format!(
        "const LIGHT_GRID_SIDE = {side}u;\nconst LIGHT_ENTRIES = {}u;\nconst LIGHTS_OF_ENTRY = {each}u;\nconst FIRST_LIGHT_IN_ORDER = {}u;\n{}",
        entries.len(),
        texels.len(),
        ramps.constants(origin)
    );
    if each > 1 {
        let mut places = vec![0; order.len().next_multiple_of(4)];
        for (at, lights_of_entry) in order.chunks(each).enumerate() {
            let shares: Vec<f64> = lights_of_entry.iter().map(|&i| lights[i].share).collect();
            for (i, (&light, (word, probability))) in lights_of_entry.iter().zip(table(&shares)).enumerate() {
                texels.push(UVec4::new(word, probability, light as u32, 0));
                places[light] = (at * each + i) as u32;
            }
        }
        texels.extend(places.chunks_exact(4).map(UVec4::from_slice));
    }
    LightGrid { texels, constants }
}

/// Probabilities of the entries in a cell that has these points.
fn weights(lights: &[Glimpse], by_power: &[f64], points: &[DVec3]) -> Vec<f64> {
    let mut out: Vec<f64> = by_power.iter().map(|p| BY_POWER * p).collect();
    let mut dark = 0;
    let mut importances = vec![0.0; lights.len()];
    for &p in points {
        importances.iter_mut().zip(lights).for_each(|(i, light)| *i = light.importance(p));
        let sum: f64 = importances.iter().sum();
        if sum > 0.0 {
            let scale = (1.0 - BY_POWER) / (points.len() as f64 * sum);
            out.iter_mut().zip(&importances).for_each(|(o, i)| *o += scale * i);
        } else {
            dark += 1;
        }
    }
    let left = (1.0 - BY_POWER) * f64::from(dark) / points.len() as f64;
    out.iter_mut().zip(by_power).for_each(|(o, p)| *o += left * p);
    out
}

/// An alias table: threshold and alias in a word, and the probability that the rounded thresholds give, as a float's bits.
fn table(weights: &[f64]) -> Vec<(u32, u32)> {
    let n = weights.len() as f64;
    let mut probabilities = vec![0.0; weights.len()];
    let mut words = vec![0; weights.len()];
    for (i, (_, threshold, alias)) in alias_table(weights).into_iter().enumerate() {
        // Upwards: a light that no path meets by chance must be chosen at times.
        let steps = (threshold * STEPS).ceil().min(STEPS - 1.0);
        probabilities[i] += steps / STEPS / n;
        probabilities[alias as usize] += (1.0 - steps / STEPS) / n;
        words[i] = (steps as u32) << 16 | alias;
    }
    words.into_iter().zip(probabilities.iter().map(|&p| (p as f32).to_bits())).collect()
}

#[cfg(test)]
mod tests {
    use super::super::placed_lights::Cone;
    use super::*;
    use glam::dvec3;

    /// The sides of a small cube in the middle of a room, each a light.
    fn cube() -> (Vec<PlacedLight>, Bounds) {
        let side = |axis: DVec3| {
            let p = 0.1 * axis;
            let bounds = Bounds { min: p - 0.1 * (DVec3::ONE - axis.abs()), max: p + 0.1 * (DVec3::ONE - axis.abs()) };
            PlacedLight { bounds, cone: Cone { axis, angle: 0.0 }, two_sided: false, share: 1.0 }
        };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
        (axes.map(side).to_vec(), Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE })
    }

    /// Probability of light `i` in the table that starts at `first`, and how often its thresholds choose it.
    fn chosen(texels: &[UVec4], n: usize, i: usize) -> (f64, f64) {
        let word = |j: usize| texels[j / 2][2 * (j % 2)];
        let probability = f64::from(f32::from_bits(texels[i / 2][2 * (i % 2) + 1]));
        let often = (0..n).map(|j| {
            let threshold = f64::from(word(j) >> 16) / STEPS;
            f64::from(u8::from(j == i)) * threshold + f64::from(u8::from((word(j) & 0xffff) as usize == i)) * (1.0 - threshold)
        });
        (probability, often.sum::<f64>() / n as f64)
    }

    #[test]
    fn tables_choose_with_the_probabilities_that_they_name_and_lights_that_face_away_seldom() {
        let (lights, room) = cube();
        let grid = build(&lights, room, DVec3::ZERO);
        let ramps = Ramps::new(room, Bounds { min: DVec3::splat(-0.1), max: DVec3::splat(0.1) });
        let side = MOST_CELLS;
        assert_eq!(grid.texels.len(), 3 * side.pow(3));
        let p = dvec3(0.9, 0.02, 0.02);
        let at = [0, 1, 2].map(|axis| (ramps.at(axis, p[axis]) * side as f64) as usize);
        let first = 3 * (at[0] + side * (at[1] + side * at[2]));
        let found: Vec<_> = (0..6).map(|i| chosen(&grid.texels[first..first + 3], 6, i)).collect();
        for (named, often) in &found {
            assert!((named - often).abs() < 1e-6, "{found:?}");
        }
        assert!((found.iter().map(|f| f.0).sum::<f64>() - 1.0).abs() < 1e-6, "{found:?}");
        assert!(found[0].0 > 0.75 && found[3].0 < 0.03, "{found:?}");
    }

    #[test]
    fn ramps_are_undone_and_half_of_the_cells_are_near_the_lights() {
        let (lights, room) = cube();
        let around = lights.iter().map(|l| l.bounds).fold(Bounds::EMPTY, Bounds::union);
        let ramps = Ramps::new(room, around);
        for t in [0.01, 0.3, 0.5, 0.77, 0.99] {
            assert!((ramps.at(1, ramps.inverse(1, t)) - t).abs() < 1e-9);
        }
        let reach = (around.max - around.min).length();
        assert!(ramps.at(0, around.max.x + reach) - ramps.at(0, around.min.x - reach) > 0.5);
        // A scene that is a point, and lights beside the scene.
        let point = Bounds { min: DVec3::ONE, max: DVec3::ONE };
        assert!(Ramps::new(point, point).at(2, 1.0).is_finite());
        let beside = Bounds { min: DVec3::splat(7.0), max: DVec3::splat(7.1) };
        assert!((Ramps::new(room, beside).at(0, 0.0) - 0.5).abs() < 0.01);
    }

    #[test]
    fn lights_that_share_an_entry_are_alike_and_all_there() {
        let x = |i: usize, k: usize| ((i * k) % 10_007) as f64 / 10_007.0;
        let at = |i: usize| dvec3(x(i, 17), x(i, 23), x(i, 29));
        let axis = |i: usize| dvec3(x(i, 31) - 0.5, x(i, 37) - 0.5, x(i, 41) - 0.49).normalize();
        let light = |i: usize| {
            let bounds = Bounds { min: at(i) - 1e-3, max: at(i) + 1e-3 };
            PlacedLight { bounds, cone: Cone { axis: axis(i), angle: 0.0 }, two_sided: false, share: 1.0 + x(i, 43) }
        };
        let lights: Vec<_> = (1..=9001).map(light).collect();
        let grid = build(&lights, Bounds { min: DVec3::ZERO, max: DVec3::ONE }, DVec3::ZERO);
        // Three to an entry.
        let (entries, side) = (3001, 8);
        let first = side * side * side * (entries + 1) / 2;
        assert_eq!(grid.texels.len(), first + 9001 + 9001usize.div_ceil(4));
        let of_entry = |entry: usize| &grid.texels[first + 3 * entry..first + (3 * entry + 3).min(9001)];
        let (mut met, mut far, mut away) = (vec![false; 9001], 0.0, 0);
        for entry in 0..entries {
            let total: f64 = of_entry(entry).iter().map(|t| lights[t.z as usize].share).sum();
            for (i, t) in of_entry(entry).iter().enumerate() {
                let light = t.z as usize;
                assert!(!std::mem::replace(&mut met[light], true));
                assert!((f64::from(f32::from_bits(t.y)) - lights[light].share / total).abs() < 1e-4);
                assert_eq!(grid.texels[first + 9001 + light / 4][light % 4] as usize, 3 * entry + i);
                let neighbour = &lights[of_entry(entry)[0].z as usize];
                far += neighbour.center().distance(lights[light].center()) / 9001.0;
                away += usize::from(neighbour.cone.axis.dot(lights[light].cone.axis) < 0.0);
            }
        }
        assert!(met.iter().all(|&m| m));
        // Any two are 0.66 apart in the mean, and half of all pairs face away from each other.
        assert!(far < 0.1 && away < 900, "{far} {away}");
    }
}
