//! Error over time: slopes, and how much longer one method takes to the error of another.

use crate::cli::plot::{self, Axis, Plot};

/// A method's relMSE of luminance over time.
pub struct Curve {
    pub name: String,
    /// Time is that of all processors.
    pub on_cpu: bool,
    /// Time, s, and relMSE.
    pub points: Vec<(f64, f64)>,
}

/// How much longer a method takes to an error than another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ratio {
    /// The greater of the two last errors, so that both have got there.
    error: f64,
    times_longer: f64,
    /// The faster one was there before its first row: the ratio is greater still.
    at_least: bool,
    /// Ratio of efficiencies, 1 / (error x time), at the ends: what it would be if both errors fell as 1 / time.
    by_efficiency: f64,
}

/// The slope of log error over log time by least squares, over all rows since half of the rows were done, and three at least.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let later = points.get((points.len() / 2).min(points.len().checked_sub(3)?)..)?;
    let logs: Vec<(f64, f64)> = later.iter().map(|(t, e)| (t.ln(), e.ln())).filter(|(t, e)| (t + e).is_finite()).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (xy, xx) = logs.iter().map(|(x, y)| (x - mean.0, y - mean.1)).fold((0.0, 0.0), |s, (x, y)| (s.0 + x * y, s.1 + x * x));
    (logs.len() >= 3).then(|| xy / xx).filter(|slope| slope.is_finite())
}

/// When the error fell below `error` for good, between rows as a power of time; `None` if it has not.
fn time_to(points: &[(f64, f64)], error: f64) -> Option<f64> {
    let Some(above) = points.iter().rposition(|p| p.1 > error) else { return points.first().map(|p| p.0) };
    let ((t0, e0), (t1, e1)) = (points[above], *points.get(above + 1)?);
    // What is net of a reference's noise may be negative.
    let share = (e0 / error).ln() / (e0 / e1.max(1e-300)).ln();
    Some(t0 * (t1 / t0).powf(share))
}

/// How much longer `other` takes than `first`.
fn ratio(first: &[(f64, f64)], other: &[(f64, f64)]) -> Option<Ratio> {
    let (ends, error) = ([first.last()?, other.last()?], first.last()?.1.max(other.last()?.1));
    let times_longer = time_to(other, error)? / time_to(first, error)?;
    let [by_first, by_other] = ends.map(|(time, error)| time * error);
    // Clocks have ticks: what is over at once has no ratio.
    let known = times_longer.is_finite() && by_other.is_finite() && by_first != 0.0;
    known.then_some(Ratio { error, times_longer, at_least: first.first()?.1 <= error, by_efficiency: by_other / by_first })
}

/// What the curves of a scene come to, a line each.
pub fn findings(scene: &str, curves: &[Curve]) -> Vec<String> {
    let found = |(i, curve): (usize, &Curve)| {
        let slope = slope(&curve.points).map_or("?".to_string(), |slope| format!("{slope:.2}"));
        let ratio = ratio(&curves[0].points, &curve.points).filter(|_| i > 0);
        let longer = ratio.map_or(String::new(), |r| {
            let bound = if r.at_least { "over " } else { "" };
            let (times, by_efficiency, first) = (factor(r.times_longer), factor(r.by_efficiency), &curves[0].name);
            format!(
                ", {bound}{times} times as long as {first} to relMSE {:.2e}, {by_efficiency} times by relMSE x time at the end",
                r.error
            )
        });
        format!("{scene}, {}: slope {slope}{longer}", curve.name)
    };
    curves.iter().enumerate().map(found).collect()
}

fn factor(ratio: f64) -> String {
    let digits = if ratio < 10.0 { 1 } else { 0 };
    format!("{ratio:.digits$}")
}

/// The curves of a scene.
pub fn plot(scene: &str, curves: &[Curve]) -> Plot {
    let time = if curves.iter().all(|curve| curve.on_cpu) { "time of all processors, s" } else { "time, s" };
    let log = |label: &str| Axis { label: label.to_string(), log: true, ..Axis::default() };
    let curve = |(i, curve): (usize, &Curve)| {
        let slope = slope(&curve.points).map_or(String::new(), |slope| format!(", t^{slope:.2}"));
        let ratio = ratio(&curves[0].points, &curve.points).filter(|_| i > 0);
        let ratio = ratio.map_or(String::new(), |r| format!(", {} x", factor(r.by_efficiency)));
        plot::Curve { name: format!("{}{slope}{ratio}", curve.name), points: curve.points.clone(), errors: Vec::new() }
    };
    Plot {
        title: scene.to_string(),
        x: log(time),
        y: log("relMSE of luminance"),
        curves: curves.iter().enumerate().map(curve).collect(),
        fill: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power(factor: f64, exponent: f64) -> Vec<(f64, f64)> {
        (0..8).map(|i| f64::from(1 << i)).map(|t| (t, factor * t.powf(exponent))).collect()
    }

    #[test]
    fn a_power_law_has_its_slope_and_its_time() {
        assert!((slope(&power(3.0, -0.7)).unwrap() + 0.7).abs() < 1e-12);
        assert!((time_to(&power(1.0, -1.0), 0.03).unwrap() - 1.0 / 0.03).abs() < 1e-9);
        assert_eq!(time_to(&power(1.0, -1.0), 1e-3), None, "not reached");
        assert_eq!(slope(&power(1.0, -1.0)[..2]), None, "two points say nothing");
        let mut bent = power(1.0, 0.0);
        bent.iter_mut().skip(4).for_each(|p| p.1 = 16.0 / p.0);
        assert!((slope(&bent).unwrap() + 1.0).abs() < 1e-12, "the later half counts");
    }

    #[test]
    fn the_ratio_is_taken_at_an_error_that_both_reach() {
        let fast = power(1.0, -1.0);
        let r = ratio(&fast, &power(5.0, -1.0)).unwrap();
        assert!((r.times_longer - 5.0).abs() < 1e-9 && !r.at_least, "{r:?}");
        assert!((r.by_efficiency - 5.0).abs() < 1e-9, "{r:?}");
        let r = ratio(&power(5.0, -1.0), &fast).unwrap();
        assert!((r.times_longer - 0.2).abs() < 1e-9, "{r:?}");
        // One that never gets better than the other's first row.
        let r = ratio(&fast, &power(2.0, 0.0)).unwrap();
        assert!(r.at_least && r.error == 2.0, "{r:?}");
    }
}
