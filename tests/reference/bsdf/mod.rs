//! Surfaces and fog: known values, sampling against densities, reciprocity, and energy.

use crate::random::Random;
use abbe::bsdf::coat::Coat;
use abbe::bsdf::conductor::RoughConductor;
use abbe::bsdf::dielectric::RoughDielectric;
use abbe::bsdf::energy::EnergyTable;
use abbe::bsdf::thin_film::Stack;
use abbe::bsdf::{fresnel, ggx, phase, sample_cosine};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

mod grain;
mod pane;
mod sheen;

impl Random {
    fn array<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.next())
    }
}

#[test]
fn fresnel_has_its_known_values() {
    let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{a} is not {b}");
    close(fresnel::average_dielectric(1.5), 0.091778, 1e-6);
    close(fresnel::average_dielectric(1.0 / 1.5), 0.596346, 1e-6);
    close(fresnel::dielectric(1.0, 1.5168), 0.04216, 5e-6);
    close(
        fresnel::dielectric(56.604f64.to_radians().cos(), 1.5168),
        0.5 * {
            // At Brewster's angle only the perpendicular half is left.
            let (i, t) = (56.604f64.to_radians(), (56.604f64.to_radians().sin() / 1.5168).asin());
            ((i - t).sin() / (i + t).sin()).powi(2)
        },
        1e-9,
    );
    let critical = 41.245f64.to_radians();
    assert!(fresnel::dielectric((critical - 1e-3).cos(), 1.0 / 1.5168) < 0.9);
    assert_eq!(fresnel::dielectric((critical + 1e-3).cos(), 1.0 / 1.5168), 1.0);
    assert_eq!(fresnel::dielectric(0.0, 1.5), 1.0);
    // A metal without absorption is a dielectric.
    for cos in [0.1, 0.5, 0.9, 1.0] {
        close(fresnel::conductor(cos, 1.5, 0.0), fresnel::dielectric(cos, 1.5), 1e-12);
    }
    // Aluminium-like at normal incidence: ((n-1)^2 + k^2) / ((n+1)^2 + k^2).
    close(fresnel::conductor(1.0, 0.9, 6.5), (0.01 + 42.25) / (3.61 + 42.25), 1e-12);
}

/// A chi-square test of directions against a density over cells of equal solid angle; what `pdf` leaves to 1 is absorbed.
fn chi_square(name: &str, pdf: impl Fn(DVec3) -> f64, mut sample: impl FnMut(&mut Random) -> Option<DVec3>) {
    const ROWS: usize = 16;
    const COLS: usize = 16;
    const FINE: usize = 24; // per cell along the azimuth, and four times that along the height
    const SAMPLES: usize = 200_000;
    let direction = |y: f64, phi: f64| dvec3(phi.cos() * (1.0 - y * y).sqrt(), phi.sin() * (1.0 - y * y).sqrt(), y);
    let mut expected = vec![0.0; ROWS * COLS + 1];
    for r in 0..ROWS * 4 * FINE {
        for c in 0..COLS * FINE {
            let y = -1.0 + 2.0 * (r as f64 + 0.5) / (ROWS * 4 * FINE) as f64;
            let phi = 2.0 * PI * (c as f64 + 0.5) / (COLS * FINE) as f64;
            let solid_angle = 4.0 * PI / (ROWS * COLS * 4 * FINE * FINE) as f64;
            expected[r / (4 * FINE) * COLS + c / FINE] += pdf(direction(y, phi)) * solid_angle * SAMPLES as f64;
        }
    }
    expected[ROWS * COLS] = SAMPLES as f64 - expected.iter().sum::<f64>();
    assert!(expected[ROWS * COLS] > -3e-3 * SAMPLES as f64, "{name}: the density integrates to more than 1");
    let mut seen = vec![0.0; ROWS * COLS + 1];
    let mut random = Random(name.len() as u64);
    for _ in 0..SAMPLES {
        let cell = sample(&mut random).map_or(ROWS * COLS, |w| {
            let row = (((w.z + 1.0) * 0.5 * ROWS as f64) as usize).min(ROWS - 1);
            let col = ((w.y.atan2(w.x).rem_euclid(2.0 * PI) / (2.0 * PI) * COLS as f64) as usize).min(COLS - 1);
            row * COLS + col
        });
        seen[cell] += 1.0;
    }
    // Cells with little in them are pooled; the error of the quadrature is allowed for in the variance.
    let (mut statistic, mut cells, mut rest) = (0.0, 0.0, (0.0, 0.0));
    for (s, e) in seen.iter().zip(&expected) {
        if *e > 10.0 {
            statistic += (s - e) * (s - e) / (e + (2e-3 * e).powi(2));
            cells += 1.0;
        } else {
            rest = (rest.0 + s, rest.1 + e);
        }
    }
    assert!((rest.0 - rest.1).abs() < 5.0 * f64::max(rest.1, 0.0).sqrt() + 10.0, "{name}: {} where {} belong", rest.0, rest.1);
    let dof: f64 = cells - 1.0;
    // Wilson-Hilferty; 4.5 standard deviations.
    let limit = dof * (1.0 - 2.0 / (9.0 * dof) + 4.5 * (2.0 / (9.0 * dof)).sqrt()).powi(3);
    assert!(statistic < limit, "{name}: chi-square {statistic:.0} of {dof} cells, limit {limit:.0}");
}

fn tilted(mu: f64) -> DVec3 {
    dvec3(0.6 * (1.0 - mu * mu).sqrt(), 0.8 * (1.0 - mu * mu).sqrt(), mu)
}

#[test]
fn directions_are_sampled_with_the_density_that_is_claimed() {
    chi_square("cosine", |w| w.z.max(0.0) / PI, |r| Some(sample_cosine(r.array())));
    for g in [-0.5, 0.0, 5e-5, 0.8] {
        let dir = dvec3(0.36, -0.48, 0.8);
        chi_square(&format!("hg {g}"), |w| phase::pdf_hg(w.dot(dir), g), |r| Some(phase::sample_hg(dir, g, r.array())));
    }
    for alpha in [0.3, 0.8] {
        let (table, mirror) = (EnergyTable::dielectric(alpha), EnergyTable::conductor(alpha));
        for mu in [0.15, 0.7] {
            let wo = tilted(mu);
            chi_square("vndf", |m| ggx::pdf_vndf(alpha, wo, m), |r| Some(ggx::sample_vndf(alpha, wo, r.array())));
            for eta in [1.5, 1.0 / 1.5] {
                let b = RoughDielectric { alpha, eta, reflectance: fresnel::dielectric, energy: &table };
                chi_square(&format!("dielectric {alpha} {mu} {eta}"), |w| b.pdf(wo, w), |r| b.sample(wo, r.array()).map(|s| s.0));
            }
            let b = RoughConductor { alpha: alpha.into(), energy: &mirror };
            chi_square(&format!("conductor {alpha} {mu}"), |w| b.pdf(wo, w), |r| b.sample(wo, r.array()).map(|s| s.wi));
        }
    }
}

#[test]
fn weights_of_rough_samples_are_value_over_density() {
    // Over many samples, the weight averaged in a half space must be the integral of the value there.
    let (alpha, mut random) = (0.5, Random(3));
    let table = EnergyTable::dielectric(alpha);
    for eta in [1.5, 1.0 / 1.5] {
        let (b, wo) = (RoughDielectric { alpha, eta, reflectance: fresnel::dielectric, energy: &table }, tilted(0.6));
        for side in [1.0, -1.0] {
            const N: usize = 400_000;
            // Mean and standard error of the difference, weighted so that directions count.
            let (mut sum, mut difference, mut squares) = (0.0, 0.0, 0.0);
            for _ in 0..N {
                let by_weight = b.sample(wo, random.array()).filter(|s| s.0.z * side > 0.0).map_or(0.0, |s| s.1 * s.0.x.abs());
                let wi = sample_cosine(random.array());
                let by_value = b.eval(wo, dvec3(wi.x, wi.y, wi.z * side)) * PI / wi.z * wi.x.abs();
                sum += by_value;
                difference += by_weight - by_value;
                squares += (by_weight - by_value).powi(2);
            }
            let error = squares.sqrt() / N as f64;
            assert!(difference.abs() / (N as f64) < 4.0 * error, "eta {eta}, side {side}: {} +- {error}", difference / N as f64);
            assert!(error < 0.02 * sum / N as f64, "an error of {error} is too large to tell anything");
        }
    }
}

#[test]
fn rough_glass_is_reciprocal_and_rough_metal_too() {
    let mut random = Random(11);
    for (alpha, n) in [(0.1, 1.3), (0.4, 1.5), (1.0, 2.4)] {
        let (table, mirror) = (EnergyTable::dielectric(alpha), EnergyTable::conductor(alpha));
        let near = RoughDielectric { alpha, eta: n, reflectance: fresnel::dielectric, energy: &table };
        let far = RoughDielectric { alpha, eta: 1.0 / n, reflectance: fresnel::dielectric, energy: &table };
        let metal = RoughConductor { alpha: alpha.into(), energy: &mirror };
        for _ in 0..200 {
            let (a, b) = (sample_cosine(random.array()), sample_cosine(random.array()));
            let same = |x: f64, y: f64| assert!((x - y).abs() <= 1e-9 * (x + y), "{alpha} {n}: {x} against {y}");
            same(near.eval(a, b) / b.z, near.eval(b, a) / a.z);
            let index = |lobe| metal.reflectance(lobe, fresnel::Metal::Index(0.5, 3.0));
            same(metal.eval(a, b, index) / b.z, metal.eval(b, a, index) / a.z);
            // n_a^2 g_ab = n_b^2 g_ba, the far side's frame being turned upside down.
            let turned = |w: DVec3| dvec3(w.x, w.y, -w.z);
            same(near.eval(a, turned(b)) / b.z, n * n * far.eval(b, turned(a)) / a.z);
        }
    }
}

/// The table of a face of glass of some width, and what its facets reflect.
type Face = (fn(f64) -> EnergyTable, fn(f64, f64) -> f64);

#[test]
fn energy_lost_to_single_scattering_is_given_back() {
    let bare: Face = (EnergyTable::dielectric, fresnel::dielectric);
    let coated: Face = (EnergyTable::antireflective, fresnel::antireflective);
    for (alpha, (table, reflectance)) in
        [0.02, 0.1, 0.3, 0.7, 1.0].map(|alpha| (alpha, bare)).into_iter().chain([(0.1, coated), (0.7, coated)])
    {
        let table = table(alpha);
        for eta in [1.1, 1.33, 1.5168, 2.417, 1.0 / 1.1, 1.0 / 1.33, 1.0 / 1.5168, 1.0 / 2.417] {
            let b = RoughDielectric { alpha, eta, reflectance, energy: &table };
            let mut random = Random((alpha * 100.0 + eta * 1e4) as u64);
            const N: usize = 150_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..N {
                let wo = sample_cosine(random.array());
                let w = b.sample(wo, random.array()).map_or(0.0, |s| s.1);
                sum += w;
                squares += w * w;
            }
            let mean = sum / N as f64;
            let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
            println!("alpha {alpha} eta {eta:.4}: {mean:.5} +- {error:.5}");
            assert!((mean - 1.0).abs() < 1e-3 + 4.0 * error, "alpha {alpha} eta {eta}: {mean} +- {error}");
        }
    }
}

/// Coats of all kinds: index, roughness, its table.
fn coats() -> Vec<(f64, f64, EnergyTable)> {
    let widths = [0.0, 0.05, 0.3, 1.0];
    widths.into_iter().flat_map(|a| [1.1, 1.5, 2.4, 1.33 / 1.5].map(|n| (n, a, EnergyTable::coat(a)))).collect()
}

fn coat((eta, alpha, energy): &(f64, f64, EnergyTable)) -> Coat<'_> {
    Coat { eta: *eta, rough: (*alpha > 0.0).then_some((*alpha, energy)), seen: false }
}

#[test]
fn a_coat_on_white_reflects_all_light_and_on_a_perfect_mirror_if_it_is_smooth() {
    for case in &coats() {
        let (coat, mut random) = (coat(case), Random(5));
        for mu in [0.02, 0.1, 0.3, 0.6, 0.95] {
            let wo = tilted(mu);
            let (mut sum, mut squares) = (0.0, 0.0);
            const N: usize = 100_000;
            for _ in 0..N {
                // The coat's own reflection, and what comes from the base, whose samples have the density cos / pi.
                let own = coat.sample(wo, random.array()).map_or(0.0, |(_, w, cos)| w * fresnel::dielectric(cos, coat.eta));
                let below = coat.over_diffuse(1.0, mu, sample_cosine(random.array()).z);
                sum += own + below;
                squares += (own + below).powi(2);
            }
            let mean = sum / N as f64;
            let error = ((squares / N as f64 - mean * mean) / N as f64).max(0.0).sqrt();
            // The table holds means over cells of cosines; near grazing incidence they differ from the value by their width.
            let floor = if case.1 > 0.0 { 0.004 } else { 1e-6 } + if mu < 0.05 && case.1 > 0.0 { 0.06 } else { 0.0 };
            assert!((mean - 1.0).abs() < floor + 4.0 * error, "{:?} mu {mu}: {mean} +- {error}", (case.0, case.1));
            if case.1 == 0.0 {
                let (t, both) = (coat.transmittance(mu), coat.over_mirror(1.0, mu, mu));
                assert!((1.0 - t + both - 1.0).abs() < 1e-12, "{:?} mu {mu}: {both} instead of {t}", case.0);
            }
        }
    }
}

#[test]
fn coats_are_reciprocal_and_rough_ones_are_sampled_with_their_density() {
    let mut random = Random(12);
    for case in &coats() {
        let coat = coat(case);
        for _ in 0..100 {
            let (a, b): (DVec3, DVec3) = (sample_cosine(random.array()), sample_cosine(random.array()));
            let same = |x: f64, y: f64| assert!((x - y).abs() <= 1e-9 * (x + y), "{:?}: {x} against {y}", (case.0, case.1));
            same(coat.eval(a, b) / b.z, coat.eval(b, a) / a.z);
            same(coat.over_diffuse(0.7, a.z, b.z), coat.over_diffuse(0.7, b.z, a.z));
            same(coat.over_mirror(0.7, a.z, b.z), coat.over_mirror(0.7, b.z, a.z));
            // No light comes from nowhere, whatever the two directions.
            assert!(coat.over_mirror(1.0, a.z, b.z) <= coat.transmittance(a.z) * (1.0 + 1e-12));
        }
        if case.1 > 0.1 {
            let wo = tilted(0.6);
            let pdf = |w: DVec3| {
                let m = (wo + w).normalize();
                if w.z > 0.0 { ggx::pdf_vndf(case.1, wo, m) / (4.0 * wo.dot(m)) } else { 0.0 }
            };
            chi_square(&format!("coat {} {}", case.0, case.1), pdf, |r| coat.sample(wo, r.array()).map(|s| s.0));
        }
    }
}

/// Light followed through a smooth coat bounce by bounce, with nothing but Fresnel's and Snell's laws: what leaves does so as often, and under the same
/// angles, as the formula says.
#[test]
fn a_smooth_coat_on_paint_is_as_light_that_is_followed_through_it() {
    const N: usize = 400_000;
    for (n, rho, mu) in [(1.5, 0.5, 0.9), (1.5, 0.9, 0.2), (2.2, 0.8, 0.6)] {
        let (coat, mut random) = (Coat { eta: n, rough: None, seen: false }, Random(21));
        let mut seen = [0.0f64; 4];
        for _ in 0..N {
            if random.next() < fresnel::dielectric(mu, n) {
                continue;
            }
            // Below: a diffuse bounce, then out or down again.
            while random.next() < rho {
                let up = sample_cosine(random.array());
                if random.next() >= fresnel::dielectric(up.z, 1.0 / n) {
                    let out = fresnel::cos_transmitted(up.z, 1.0 / n).expect("less than all is reflected");
                    seen[((out * out * 4.0) as usize).min(3)] += 1.0;
                    break;
                }
            }
        }
        for (cell, &count) in seen.iter().enumerate() {
            // Equal steps of the cosine's square are equal shares of projected solid angle.
            let steps = 1000;
            let at = |i: usize| ((cell as f64 + (i as f64 + 0.5) / steps as f64) / 4.0).sqrt();
            let exact = (0..steps).map(|i| coat.over_diffuse(rho, mu, at(i))).sum::<f64>() / steps as f64 / 4.0 * N as f64;
            assert!((count - exact).abs() < 4.5 * exact.sqrt(), "n {n} rho {rho} mu {mu} cell {cell}: {count}, exact {exact}");
        }
    }
}

/// Airy's formula for a film that does not absorb, written with real numbers (Born & Wolf, 7th ed., eq. 1.6.60), by Snell's and Fresnel's laws.
fn airy(s: &Stack, cos: f64) -> f64 {
    let cosine = |n: f64| (1.0 - (s.near / n).powi(2) * (1.0 - cos * cos)).sqrt();
    let (n, c) = ([s.near, s.film, s.far.0], [cos, cosine(s.film), cosine(s.far.0)]);
    let phase = (4.0 * PI * s.waves * n[1] * c[1]).cos();
    let both = |r: f64, q: f64| (r * r + q * q + 2.0 * r * q * phase) / (1.0 + r * r * q * q + 2.0 * r * q * phase);
    let across = |i: usize| (n[i] * c[i] - n[i + 1] * c[i + 1]) / (n[i] * c[i] + n[i + 1] * c[i + 1]);
    let along = |i: usize| (n[i + 1] * c[i] - n[i] * c[i + 1]) / (n[i + 1] * c[i] + n[i] * c[i + 1]);
    0.5 * (both(across(0), across(1)) + both(along(0), along(1)))
}

#[test]
fn films_reflect_what_airys_formula_says() {
    let close = |a: f64, b: f64, what: &str| assert!((a - b).abs() < 1e-9, "{what}: {a} is not {b}");
    let mut random = Random(31);
    for _ in 0..2000 {
        let [near, film, far, waves, cos, k] = random.array();
        let stack = Stack { near: 1.0 + near, film: 1.0 + 1.5 * film, waves: 3.0 * waves, far: (1.0 + 2.0 * far, 0.0) };
        // At total reflection the formula with real numbers ends.
        if (stack.near * (1.0 - cos * cos).sqrt()) < stack.film.min(stack.far.0) {
            close(stack.reflectance(cos), airy(&stack, cos), &format!("{stack:?} at {cos}"));
            // The same from the other side.
            let beyond = (1.0 - (stack.near / stack.far.0).powi(2) * (1.0 - cos * cos)).sqrt();
            let turned = Stack { near: stack.far.0, far: (stack.near, 0.0), ..stack };
            close(turned.reflectance(beyond), stack.reflectance(cos), "from behind");
        }
        // A film of no thickness is not there.
        let (bare, metal) = (Stack { waves: 0.0, ..stack }, (stack.far.0, 4.0 * k));
        close(bare.reflectance(cos), fresnel::dielectric(cos, stack.far.0 / stack.near), "none on glass");
        let bare = Stack { far: metal, ..bare };
        close(bare.reflectance(cos), fresnel::conductor(cos, metal.0 / stack.near, metal.1 / stack.near), "none on metal");
    }
    // A quarter of a wave of the geometric mean of the indices on glass reflects nothing, a half what the bare glass does.
    let n = 1.52f64;
    let coating = |waves| Stack { near: 1.0, film: n.sqrt(), waves: waves / n.sqrt(), far: (n, 0.0) }.reflectance(1.0);
    close(coating(0.25), 0.0, "quarter");
    close(coating(0.5), fresnel::dielectric(1.0, n), "half");
    // Over all thicknesses a film in air is in the mean as a pane, in which nothing interferes.
    let pane =
        |i: u32| Stack { near: 1.0, film: 1.4, waves: f64::from(i) / 1000.0 / (2.0 * 1.4), far: (1.0, 0.0) }.reflectance(1.0);
    close((0..1000).map(pane).sum::<f64>() / 1000.0, fresnel::thin_pane(1.0, 1.4), "mean");
}
