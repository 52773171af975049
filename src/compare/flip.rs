//! FLIP: how strongly people see the difference when two pictures are flipped in place (Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom
//! & Fairchild, "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM CGIT 3(2), 2020; equation numbers are theirs).

use super::lab::lab_of_xyz;
use crate::color::convert::{linear_srgb_of_xyz, xyz_of_linear_srgb};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of what the authors take as the usual view: a screen of 3840 pixels and 0.7 m from 0.7 m away.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Contrast sensitivity of the achromatic, red-green and blue-yellow channel: pairs a, b of the Gaussians in equation 4 (table 1).
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
/// Width in degrees of the edges and points that are looked for.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponents q_c and q_f, and the point p_c, p_t of the piecewise linear map (section 4).
const COLOR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
const KNEE: (f64, f64) = (0.4, 0.95);

/// The FLIP map of two pictures of linear sRGB, [0, 1] (what is outside is clipped), `width` pixels wide: 0 the same to 1.
pub fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize, pixels_per_degree: f64) -> Vec<f32> {
    let [a, b] = [reference, test].map(|picture| Seen::new(picture, width, pixels_per_degree));
    let most = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT);
    let pixel = |p: usize| {
        let power = hyab(a.lab[p], b.lab[p]).powf(COLOR_EXPONENT);
        let knee = KNEE.0 * most;
        let color = if power < knee { KNEE.1 / knee * power } else { KNEE.1 + (power - knee) / (most - knee) * (1.0 - KNEE.1) };
        let feature = f64::from((a.edges[p] - b.edges[p]).abs().max((a.points[p] - b.points[p]).abs()));
        color.powf(1.0 - (feature * 0.5f64.sqrt()).powf(FEATURE_EXPONENT)) as f32
    };
    (0..reference.len()).into_par_iter().map(pixel).collect()
}

/// What an eye gets of a picture.
struct Seen {
    /// L*a*b* with a* and b* after Hunt, of the blurred picture.
    lab: Vec<[f64; 3]>,
    /// Strengths of edges and of points.
    edges: Vec<f32>,
    points: Vec<f32>,
}

impl Seen {
    fn new(picture: &[[f32; 3]], width: usize, pixels_per_degree: f64) -> Self {
        let planes: Vec<[f32; 3]> = picture.par_iter().map(|rgb| opponent(rgb.map(|v| f64::from(v).clamp(0.0, 1.0)))).collect();
        let plane = |c: usize| planes.iter().map(|v| v[c]).collect::<Vec<f32>>();

        let blurred: [Vec<f32>; 3] = std::array::from_fn(|c| blur(&plane(c), width, SENSITIVITY[c], pixels_per_degree));
        let lab = |p: usize| {
            let rgb = rgb_of_opponent([blurred[0][p], blurred[1][p], blurred[2][p]].map(f64::from));
            hunt(rgb.map(|v| v.clamp(0.0, 1.0)))
        };
        let lab = (0..picture.len()).into_par_iter().map(lab).collect();

        let lightness: Vec<f32> = planes.iter().map(|v| (v[0] + 16.0) / 116.0).collect();
        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as i32;
        let gauss = |x: f64| (-0.5 * x * x / (sigma * sigma)).exp();
        let flat = balanced(radius, gauss);
        // Along x and along y, the size of both together (equations 10 to 12).
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let x = convolve(&lightness, width, kernel, &flat);
            let y = convolve(&lightness, width, &flat, kernel);
            x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect()
        };
        let edges = strength(&balanced(radius, |x| -x * gauss(x)));
        let points = strength(&balanced(radius, |x| (x * x / (sigma * sigma) - 1.0) * gauss(x)));
        Seen { lab, edges, points }
    }
}

/// X, Y, Z of white.
fn white() -> [f64; 3] {
    xyz_of_linear_srgb([1.0; 3])
}

/// The linear opponent space Y C_x C_z.
fn opponent(rgb: [f64; 3]) -> [f32; 3] {
    let (xyz, white) = (xyz_of_linear_srgb(rgb), white());
    let [x, y, z] = [xyz[0] / white[0], xyz[1] / white[1], xyz[2] / white[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)].map(|v| v as f32)
}

fn rgb_of_opponent([l, cx, cz]: [f64; 3]) -> [f64; 3] {
    let (y, white) = ((l + 16.0) / 116.0, white());
    linear_srgb_of_xyz([(y + cx / 500.0) * white[0], y * white[1], (y - cz / 200.0) * white[2]])
}

/// L*a*b*, with less colour where it is dark (equation 6).
fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    let [l, a, b] = lab_of_xyz(xyz_of_linear_srgb(rgb), white());
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// Distance of colours that are far apart (equation 7).
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Blurs by the sum of Gaussians that is the Fourier transform of a sensitivity (equations 4 and 5).
fn blur(plane: &[f32], width: usize, sensitivity: &[(f64, f64)], pixels_per_degree: f64) -> Vec<f32> {
    let widest = SENSITIVITY.iter().flat_map(|s| s.iter()).map(|s| s.1).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let mut sum = vec![0.0; plane.len()];
    let mut total = 0.0;
    for &(a, b) in sensitivity {
        let gauss = |x: f64| (-PI * PI / b * (x / pixels_per_degree).powi(2)).exp();
        let weight = a * (PI / b).sqrt() * (-radius..=radius).map(|x| gauss(f64::from(x))).sum::<f64>().powi(2);
        let kernel = balanced(radius, gauss);
        let part = convolve(plane, width, &kernel, &kernel);
        sum.iter_mut().zip(part).for_each(|(sum, v)| *sum += weight as f32 * v);
        total += weight as f32;
    }
    sum.iter_mut().for_each(|v| *v /= total);
    sum
}

/// `f` at -radius to radius, its positive values scaled to sum to 1 and its negative ones to -1.
fn balanced(radius: i32, f: impl Fn(f64) -> f64) -> Vec<f32> {
    let values: Vec<f64> = (-radius..=radius).map(|x| f(f64::from(x))).collect();
    let sum = |sign: f64| values.iter().map(|v| (sign * v).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    values.iter().map(|v| if *v < 0.0 { v / negative } else { v / positive } as f32).collect()
}

/// Convolution along rows, then along columns; beyond the edge the picture goes on with its last pixel.
fn convolve(plane: &[f32], width: usize, along_x: &[f32], along_y: &[f32]) -> Vec<f32> {
    let height = plane.len() / width;
    // The place in a row or column that tap `i` of a kernel reads.
    let at = |here: usize, i: usize, taps: usize, end: usize| (here + i).saturating_sub(taps / 2).min(end - 1);
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(to, from)| {
        for (x, to) in to.iter_mut().enumerate() {
            *to = along_x.iter().enumerate().map(|(i, k)| k * from[at(x, i, along_x.len(), width)]).sum();
        }
    });
    let mut both = vec![0.0; plane.len()];
    both.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
        for (i, k) in along_y.iter().enumerate() {
            let from = &rows[at(y, i, along_y.len(), height) * width..][..width];
            to.iter_mut().zip(from).for_each(|(to, v)| *to += k * v);
        }
    });
    both
}
