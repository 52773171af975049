//! Guided emission: which random numbers of a light path's beginning are of use, learned while rendering.
//!
//! The unit cube of those numbers (primary sample space) becomes a binary tree of boxes, halved along one axis at each node (Guo et al. 2018, "Primary
//! sample space path guiding"). Light paths report their numbers and the squares of what they add to the picture, relative to its brightness there
//! (light/guide.wgsl). Paths go into leaves in proportion to sqrt(volume x integral of those squares), which makes the relative variance least, but for a
//! defensive share by volume. A tree is grown anew from what the paths of the last one reported, whenever that is twice as much (Mueller et al. 2017,
//! "Practical path guiding"). Guiding samples are sorted first: nothing depends on the order in which paths end.

use super::brightness::{BLOCKS, Brightness};
use crate::error::Result;
use crate::film::Tile;
use crate::gpu::{Gpu, Resource, Staging};
use crate::state::{Persistent, State, invalid};
use bytemuck::{Pod, Zeroable};
use glam::UVec4;
use rayon::slice::ParallelSliceMut;
use std::io;

/// Dimensions: a point on the light (2), a direction (2), the choice of a light, that of the wavelength kept where they part.
pub(super) const AXES: usize = 6;
/// Texel of the root, after the blocks.
pub(super) const ROOT: usize = BLOCKS * BLOCKS;
/// Most nodes.
const NODES: usize = 16384;
/// Most samples of one call.
const ROOM: usize = 1 << 16;
/// Their number, and they themselves.
const REPORT_BYTES: u64 = (1 + 2 * ROOM as u64) * 16;
/// Most samples that a tree is grown from.
const MOST_SAMPLES: usize = 1 << 17;
/// Share of the paths that go on evenly, since what was not of use so far may be yet.
const DEFENSIVE: f64 = 0.15;
/// Boxes of fewer samples are not halved.
const LEAST_SAMPLES: usize = 16;
/// Times a box is halved at most along each axis: numbers have 24 bits.
const MOST_HALVINGS: u32 = 16;
/// Halving along an axis is worth it if it leaves less than this of the deviation.
const WORTHWHILE: f64 = 0.95;
/// What is left of the deviation seems less by about this over the number of samples for each halving that tells nothing, as weights of the samples differ. Leaves that are there by
/// chance have shares by chance, and part numbers that are spread evenly together.
const APPARENT: f64 = 0.7;
/// Greatest difference that counts of two samples of a pixel, over the brightness around it.
const MOST_RELATIVE: f64 = 16.0;

/// A useful path: numbers, and its share in the integral of squared contribution.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GuidingSample {
    at: [f32; AXES],
    weight: f64,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    /// Halved along this axis; AXES for a leaf.
    axis: usize,
    /// Its lower half, the upper one is the next.
    first: usize,
    /// Share of all paths.
    share: f64,
}

/// The tree, and what its paths report.
#[derive(Debug)]
pub(super) struct Guide {
    nodes: Vec<Node>,
    samples: Vec<GuidingSample>,
    /// Guiding samples that the tree was grown from.
    grown_from: usize,
    /// Mean share of a path in the integral of squared contribution.
    share: f64,
    /// Probability of reporting over that share.
    reporting: f64,
    /// Squares of what the last paths added to the picture, relative to its brightness there: their sum over that of a pass of one path per pixel.
    pub squares: f64,
    /// Axes that the scene's lights use.
    axes: [bool; AXES],
    /// Axes whose lower half is aimed at what bends light and whose upper half is not: what is told of the one says nothing about the other.
    aims: [bool; AXES],
    /// What the error of a pixel is relative to, by all tiles but the last one.
    pub brightness: Brightness,
    /// Where the light pass stores them.
    pub guiding_samples: Resource,
    staging: Staging,
}

/// A box of the cube while the tree grows.
struct Box<'a> {
    samples: &'a mut [GuidingSample],
    low: [f32; AXES],
    halvings: [u32; AXES],
    /// Integral of squared contribution over it, as far as known, and its volume.
    squares: f64,
    volume: f64,
}

impl Guide {
    /// Even shares.
    ///
    /// # Errors
    /// [`crate::error::Error::Device`] if the adapter cannot hold the samples.
    pub fn new(gpu: &Gpu, axes: [bool; AXES], aims: [bool; AXES]) -> Result<Self> {
        Ok(Self {
            nodes: vec![Node { axis: AXES, first: 0, share: 1.0 }],
            samples: Vec::new(),
            grown_from: LEAST_SAMPLES / 2,
            share: 1.0,
            reporting: 1.0,
            squares: 0.0,
            axes,
            aims,
            brightness: Brightness::new(),
            guiding_samples: gpu.empty_storage("guiding samples", REPORT_BYTES)?,
            staging: Staging::new(gpu, REPORT_BYTES),
        })
    }

    /// What the paths have reported, for [`Gpu::take`].
    pub fn report(&self) -> (&Resource, &Staging, u64) {
        (&self.guiding_samples, &self.staging, REPORT_BYTES)
    }

    /// Probability that one of `paths` is stored, over its share in the integral of squared contribution, and room for samples.
    pub fn expect(&mut self, paths: f64) -> (f32, u32) {
        self.reporting = f64::from((0.5 * ROOM as f64 / (self.share * paths)) as f32);
        (self.reporting as f32, ROOM as u32)
    }

    /// Takes in what `paths` light paths reported, as it came back. All of it is forgotten if there was not room for it: what was left out depends on chance.
    pub fn learn(&mut self, reported: &[u32], paths: f64) {
        let count = reported[0] as usize;
        let is_complete = (1..=ROOM).contains(&count);
        // One more, so that it is never zero.
        self.share = (count as f64 + 1.0) / (self.reporting * paths);
        self.squares = 0.0;
        if !is_complete {
            return;
        }
        let mut records: Vec<[u32; 8]> = bytemuck::cast_slice(&reported[4..4 + 8 * count]).to_vec();
        records.par_sort_unstable();
        let records: &[[f32; 8]] = bytemuck::cast_slice(&records);
        // Share in the integral, over the probability of having been reported.
        let weight = |[.., share, density]: &[f32; 8]| {
            let share = f64::from(*share) / f64::from(*density);
            share / (self.reporting * share).min(1.0)
        };
        self.squares = records.iter().map(|r| weight(r) / f64::from(r[7])).sum::<f64>() / paths;
        self.share = (records.iter().map(weight).sum::<f64>() / paths).max(self.share);
        if self.grown_from >= MOST_SAMPLES / 2 {
            return;
        }
        self.samples.extend(records.iter().map(|r| GuidingSample { at: std::array::from_fn(|axis| r[axis]), weight: weight(r) }));
        if self.samples.len() >= 2 * self.grown_from {
            self.grow();
        }
    }

    /// Grows a new tree from the samples, which are then forgotten.
    fn grow(&mut self) {
        let mut samples = std::mem::take(&mut self.samples);
        self.grown_from = samples.len();
        let squares = samples.iter().map(|r| r.weight).sum();
        self.nodes.clear();
        self.nodes.push(Node { axis: AXES, first: 0, share: 0.0 });
        let whole = Box { samples: &mut samples, low: [0.0; AXES], halvings: [0; AXES], squares, volume: 1.0 };
        self.halve(0, whole);
        let total: f64 = self.nodes.iter().filter(|n| n.axis == AXES).map(|n| n.share).sum();
        let mut evenly = vec![0.0; self.nodes.len()];
        evenly[0] = 1.0;
        for i in 0..self.nodes.len() {
            let Node { axis, first, share } = self.nodes[i];
            if axis < AXES {
                evenly[first] = 0.5 * evenly[i];
                evenly[first + 1] = 0.5 * evenly[i];
            } else {
                self.nodes[i].share = DEFENSIVE * evenly[i] + (1.0 - DEFENSIVE) * share / total;
            }
        }
        for i in (0..self.nodes.len()).rev() {
            if self.nodes[i].axis < AXES {
                let first = self.nodes[i].first;
                self.nodes[i].share = self.nodes[first].share + self.nodes[first + 1].share;
            }
        }
    }

    /// Halves a box, and its halves again, as long as there are samples to tell how; leaves get the share that is best for them, times some constant.
    /// Halves that tell too little for so few samples are put together again. Returns what the leaves have together, and their number.
    fn halve(&mut self, node: usize, of: Box<'_>) -> (f64, usize) {
        let whole = (of.squares * of.volume).sqrt();
        let count = of.samples.len();
        self.nodes[node].share = whole;
        let least = LEAST_SAMPLES.max(4 * self.grown_from / NODES);
        if of.samples.len() < least || self.nodes.len() + 2 > NODES {
            return (whole, 1);
        }
        let middle = |axis: usize| of.low[axis] + 0.5f32.powi(of.halvings[axis] as i32 + 1);
        let total: f64 = of.samples.iter().map(|r| r.weight).sum();
        // Shares of the box's 2^AXES corners.
        let mut corners = [0.0; 1 << AXES];
        for r in of.samples.iter() {
            let corner: usize = (0..AXES).map(|axis| usize::from(r.at[axis] >= middle(axis)) << axis).sum();
            corners[corner] += r.weight / total;
        }
        // What is left of the deviation when the halves along these axes are told apart.
        let remains = |a: usize, b: usize| {
            let mut parts = [0.0; 4];
            corners.iter().enumerate().for_each(|(i, share)| parts[(i >> a & 1) << 1 | (i >> b & 1)] += share);
            0.5 * parts.iter().map(|p: &f64| p.sqrt()).sum::<f64>() * if a == b { 2f64.sqrt() } else { 1.0 }
        };
        let used: Vec<usize> = (0..AXES).filter(|&axis| self.axes[axis] && of.halvings[axis] < MOST_HALVINGS).collect();
        let Some(&longest) = used.iter().min_by_key(|&&axis| of.halvings[axis]) else { return (whole, 1) };
        // Pairs, since rays through a slit are a diagonal of which no axis tells anything by itself. Where no pair does, the longest side.
        let pairs = used.iter().flat_map(|&a| used.iter().map(move |&b| (a, b))).filter(|(a, b)| a <= b);
        let best =
            pairs.min_by(|x, y| remains(x.0, x.1).total_cmp(&remains(y.0, y.1))).filter(|&(a, b)| remains(a, b) < WORTHWHILE);
        let told = |axis: usize| (remains(axis, axis) * 100.0).round() as u32;
        let better = |(a, b): (usize, usize)| if (told(a), of.halvings[a]) <= (told(b), of.halvings[b]) { a } else { b };
        let aim = used.iter().copied().find(|&axis| self.aims[axis] && of.halvings[axis] == 0);
        let axis = aim.or(best.map(better)).unwrap_or(longest);
        let at = middle(axis);
        of.samples.sort_by(|a, b| (a.at[axis] >= at).cmp(&(b.at[axis] >= at)));
        let first_upper = of.samples.partition_point(|r| r.at[axis] < at);
        let (below, above) = of.samples.split_at_mut(first_upper);
        let first = self.nodes.len();
        self.nodes[node] = Node { axis, first, share: 0.0 };
        self.nodes.extend([Node { axis: AXES, first: 0, share: 0.0 }; 2]);
        // Half a report more: what has none may only have been missed.
        let missed = 0.5 * total / (below.len() + above.len()) as f64;
        let (mut parts, mut leaves) = (0.0, 0);
        for (i, samples) in [below, above].into_iter().enumerate() {
            let mut half = Box { samples, low: of.low, halvings: of.halvings, squares: 0.0, volume: 0.5 * of.volume };
            half.squares = half.samples.iter().map(|r| r.weight).sum::<f64>() + missed;
            half.halvings[axis] += 1;
            if i == 1 {
                half.low[axis] = at;
            }
            let (sum, of_half) = self.halve(first + i, half);
            parts += sum;
            leaves += of_half;
        }
        let by_chance = APPARENT * (leaves - 1) as f64 / count as f64;
        if !self.aims[axis] && parts > whole * (1.0 - by_chance) {
            self.nodes.truncate(first);
            self.nodes[node] = Node { axis: AXES, first: 0, share: whole };
            return (whole, 1);
        }
        (parts, leaves)
    }

    /// Half the mean square of the difference of two pictures (sums over the bins of each pixel) of a part of one of so many pixels, relative to brightness:
    /// the variance of one. No pixel counts for more than [`MOST_RELATIVE`]: else one that a lamp's mirror image was found in, or not, by chance, would decide for all.
    pub fn relative_variance(&self, (width, height): (u32, u32), part: Tile, a: &[f32], b: &[f32]) -> f64 {
        let brightness: Vec<f64> = self.brightness.of_blocks().collect();
        let block = |at: usize, size: usize| at * BLOCKS / size;
        let (width, height) = (width as usize, height as usize);
        let squares = part.numbers(width as u32).zip(a.iter().zip(b)).map(|(i, (a, b))| {
            let around = brightness[block(i / width, height) * BLOCKS + block(i % width, width)];
            if around > 0.0 { (f64::from(a - b).abs() / around).min(MOST_RELATIVE).powi(2) } else { 0.0 }
        });
        0.5 * squares.sum::<f64>() / a.len() as f64
    }

    /// For the shaders: brightness block by block, as the use of a radiance of 1 in a pass of one path for each of `pixels`, then the nodes.
    pub fn table(&self, pixels: f64) -> Vec<UVec4> {
        // Before anything was seen all blocks are alike.
        let of_blocks = self.brightness.of_blocks().map(|b| if b > 0.0 { 1.0 / (pixels * b) } else { 1.0 });
        let mut table: Vec<UVec4> = of_blocks.map(|u| UVec4::new((u as f32).to_bits(), 0, 0, 0)).collect();
        table.extend(self.nodes.iter().map(|node| {
            let lower = if node.axis < AXES { self.nodes[node.first].share / node.share } else { 1.0 };
            UVec4::new(node.axis as u32, node.first as u32, (lower as f32).to_bits(), 0)
        }));
        // Always of one size: software drivers compile kernels anew for textures of another shape.
        table.resize(ROOT + NODES, UVec4::ZERO);
        table
    }
}

impl Persistent for Guide {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Guide {
            nodes,
            samples,
            grown_from,
            share,
            reporting,
            squares,
            axes: _,
            aims: _,
            brightness,
            guiding_samples: _,
            staging: _,
        } = self;
        let mut axes: Vec<u32> = nodes.iter().map(|node| node.axis as u32).collect();
        let mut firsts: Vec<u32> = nodes.iter().map(|node| node.first as u32).collect();
        let mut shares: Vec<f64> = nodes.iter().map(|node| node.share).collect();
        state.list(&mut axes)?;
        state.list(&mut firsts)?;
        state.list(&mut shares)?;
        let (count, is_tree) = (axes.len(), (1..=NODES).contains(&axes.len()));
        let is_node =
            |(&axis, &first): (&u32, &u32)| axis as usize == AXES || (axis as usize) < AXES && first as usize + 1 < count;
        if !is_tree || firsts.len() != count || shares.len() != count || !axes.iter().zip(&firsts).all(is_node) {
            return Err(invalid(format!("a guide of {count} nodes that is no tree")));
        }
        let node =
            |((axis, first), share): ((&u32, &u32), &f64)| Node { axis: *axis as usize, first: *first as usize, share: *share };
        *nodes = axes.iter().zip(&firsts).zip(&shares).map(node).collect();
        state.list(samples)?;
        state.size(grown_from)?;
        state.value(share)?;
        state.value(reporting)?;
        state.value(squares)?;
        brightness.persist(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::sample_counts::splitmix;

    /// A tree grown from those of 200,000 random paths that are of use.
    fn grown(is_useful: impl Fn([f32; AXES]) -> bool) -> Guide {
        let gpu = Gpu::open(None).expect("an adapter");
        let mut guide = Guide::new(&gpu, [true, true, true, true, false, false], [false; AXES]).expect("room");
        // Random, so that boxes differ by chance.
        let number = |i: u64, axis: u64| (splitmix(4 * i + axis) >> 40) as f32 * 0.5f32.powi(24);
        let points = (0..200_000).map(|i| [number(i, 0), number(i, 1), number(i, 2), number(i, 3), 0.5, 0.5]);
        guide.samples = points.filter(|at| is_useful(*at)).map(|at| GuidingSample { at, weight: 1.0 }).collect();
        guide.grow();
        guide
    }

    /// A thin diagonal: the point on the light and the direction depend on each other, neither tells anything by itself.
    fn is_on_diagonal(at: [f32; AXES]) -> bool {
        (at[0] - at[2]).abs() < 0.02
    }

    /// Share of all paths and volume of the leaf that holds `at`.
    fn leaf(guide: &Guide, at: [f32; AXES]) -> (f64, f64) {
        let (mut node, mut low, mut size) = (0, [0.0f32; AXES], [1.0f32; AXES]);
        while guide.nodes[node].axis < AXES {
            let Node { axis, first, .. } = guide.nodes[node];
            size[axis] *= 0.5;
            let goes_up = at[axis] >= low[axis] + size[axis];
            low[axis] += if goes_up { size[axis] } else { 0.0 };
            node = first + usize::from(goes_up);
        }
        (guide.nodes[node].share, size.iter().map(|&s| f64::from(s)).product())
    }

    #[test]
    fn paths_go_where_they_are_of_use_though_no_axis_tells_by_itself() {
        let guide = grown(is_on_diagonal);
        let leaves = guide.nodes.iter().filter(|n| n.axis == AXES);
        assert!((leaves.map(|n| n.share).sum::<f64>() - 1.0).abs() < 1e-9, "shares add up to one");
        assert!((guide.nodes[0].share - 1.0).abs() < 1e-9);
        let density = |at| {
            let (share, volume) = leaf(&guide, at);
            share / volume
        };
        for t in [0.1, 0.3, 0.52, 0.77, 0.93] {
            let on = [t, 0.4, t, 0.6, 0.5, 0.5];
            let off = [t, 0.4, (t + 0.37) % 1.0, 0.6, 0.5, 0.5];
            assert!(is_on_diagonal(on) && !is_on_diagonal(off));
            // The diagonal takes 4 % of the volume.
            assert!(density(on) > 8.0, "{t}: {}", density(on));
            assert!((0.99 * DEFENSIVE..0.5).contains(&density(off)), "{t}: {}", density(off));
        }
    }

    #[test]
    fn boxes_are_not_halved_along_axes_that_tell_nothing() {
        let even = grown(|_| true).nodes.len();
        assert!(even < 100, "{even}");
        // An eighth along axis 2 has all.
        let eighth = grown(|at| at[2] < 0.125).nodes.len();
        assert!((7..100).contains(&eighth), "{eighth}");
    }

    #[test]
    fn the_table_has_room_for_every_tree() {
        let guide = grown(is_on_diagonal);
        assert!(guide.nodes.len() > 500 && guide.nodes.len() <= NODES, "{}", guide.nodes.len());
        assert_eq!(guide.table(100.0).len(), ROOT + NODES);
    }
}
