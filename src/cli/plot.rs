//! Plots as SVG: curves over two axes, linear or logarithmic, with an optional fill below the first.

use std::fmt::Write;

/// Size of the picture and of the margins around the axes, in SVG units (pixels at scale 1).
const SIZE: (f64, f64) = (800.0, 480.0);
const LEFT: f64 = 86.0;
const RIGHT: f64 = 24.0;
/// Widths of a legend's line and, about, of a letter.
const LEGEND_LINE: f64 = 22.0;
const LETTER: f64 = 7.6;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 58.0;
/// Ticks aimed at, along x and y.
const TICKS: (f64, f64) = (9.0, 7.0);
/// Curve colours, told apart in colour-blind vision too (Okabe & Ito, "Color Universal Design", 2008).
const COLORS: [&str; 7] = ["#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// A picture of curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plot {
    /// Heading.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, drawn in this order. More than one is told apart by a legend.
    pub curves: Vec<Curve>,
    /// Colours of the area below the first curve, from left to right: pairs of x and an SVG colour, blended in between.
    pub fill: Vec<(f64, String)>,
}

/// An axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Logarithmic; then only what is positive is drawn.
    pub log: bool,
    /// Show 0, whatever the data (of a linear axis).
    pub from_zero: bool,
}

/// Points joined by lines.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points x, y. A point that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Error bars: x, y and the error of y.
    pub errors: Vec<(f64, f64, f64)>,
}

impl Plot {
    /// The picture, an SVG document of 800 x 480 units on white. Without a point to draw it shows empty axes.
    pub fn svg(&self) -> String {
        self.panel(0, (0.0, 0.0))
    }

    /// The picture as panel number `id` at `place` of another.
    fn panel(&self, id: usize, place: (f64, f64)) -> String {
        let points = || self.curves.iter().flat_map(|c| c.points.iter().copied());
        let bars = || self.curves.iter().flat_map(|c| &c.errors).flat_map(|&(x, y, e)| [(x, y - e), (x, y + e)]);
        let all = || points().chain(bars());
        let x = Scale::new(&self.x, all().map(|p| p.0), 0.0, (LEFT, SIZE.0 - RIGHT - self.legend_width()), TICKS.0);
        let y = Scale::new(&self.y, all().map(|p| p.1), 0.05, (SIZE.1 - BOTTOM, TOP), TICKS.1);

        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = self.draw(&mut svg, (id, place), &x, &y);
        svg
    }

    fn draw(&self, svg: &mut String, (id, place): (usize, (f64, f64)), x: &Scale, y: &Scale) -> std::fmt::Result {
        let (width, height) = SIZE;
        writeln!(
            svg,
            r#"<svg xmlns="http://www.w3.org/2000/svg" x="{}" y="{}" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">
<rect width="{width}" height="{height}" fill="white"/>
<clipPath id="area{id}"><rect x="{LEFT}" y="{TOP}" width="{}" height="{}"/></clipPath>"#,
            place.0,
            place.1,
            x.to.1 - x.to.0,
            height - TOP - BOTTOM
        )?;
        self.draw_fill(svg, id, x, y)?;
        self.draw_axes(svg, x, y)?;
        for (curve, color) in self.curves.iter().zip(COLORS.iter().cycle()) {
            writeln!(
                svg,
                r#"<g fill="none" stroke="{color}" stroke-width="1.6" stroke-linejoin="round" clip-path="url(#area{id})">"#
            )?;
            for line in runs(&curve.points, x, y) {
                writeln!(svg, r#"<polyline points="{}"/>"#, join(&line))?;
            }
            for &(at, mean, error) in &curve.errors {
                let bar = [(at, mean - error), (at, mean + error)].map(|(a, b)| (x.place(a), y.place_within(b)));
                if let [(Some(x), Some(low)), (_, Some(high))] = bar {
                    writeln!(svg, r#"<path d="M{x:.1} {low:.1}V{high:.1}" stroke-width="1"/>"#)?;
                }
            }
            writeln!(svg, "</g>")?;
        }
        self.draw_legend(svg)?;
        writeln!(svg, "</svg>")
    }

    fn draw_fill(&self, svg: &mut String, id: usize, x: &Scale, y: &Scale) -> std::fmt::Result {
        let (Some(curve), Some(first), Some(last)) = (self.curves.first(), self.fill.first(), self.fill.last()) else {
            return Ok(());
        };
        let (Some(left), Some(right)) = (x.place(first.0), x.place(last.0)) else { return Ok(()) };
        writeln!(
            svg,
            r#"<linearGradient id="fill{id}" gradientUnits="userSpaceOnUse" x1="{left:.1}" x2="{right:.1}" y1="0" y2="0">"#
        )?;
        for (at, color) in &self.fill {
            let offset = x.place(*at).map_or(0.0, |at| (at - left) / (right - left));
            writeln!(svg, r#"<stop offset="{offset:.4}" stop-color="{}"/>"#, escape(color))?;
        }
        writeln!(svg, "</linearGradient>")?;
        let base = y.place_within(0.0).unwrap_or(SIZE.1 - BOTTOM);
        for line in runs(&curve.points, x, y) {
            if let (Some(&(from, _)), Some(&(to, _))) = (line.first(), line.last()) {
                let points = join(&line);
                writeln!(
                    svg,
                    r#"<polygon fill="url(#fill{id})" fill-opacity="0.75" clip-path="url(#area{id})" points="{from:.1},{base:.1} {points} {to:.1},{base:.1}"/>"#
                )?;
            }
        }
        Ok(())
    }

    fn draw_axes(&self, svg: &mut String, x: &Scale, y: &Scale) -> std::fmt::Result {
        let (right, bottom) = (x.to.1, SIZE.1 - BOTTOM);
        writeln!(svg, r##"<g stroke="#888888" stroke-opacity="0.35">"##)?;
        x.ticks.iter().filter_map(|t| x.place(t.0)).try_for_each(|at| writeln!(svg, r#"<path d="M{at:.1} {TOP}V{bottom}"/>"#))?;
        y.ticks.iter().filter_map(|t| y.place(t.0)).try_for_each(|at| writeln!(svg, r#"<path d="M{LEFT} {at:.1}H{right}"/>"#))?;
        writeln!(svg, "</g>")?;
        writeln!(svg, r##"<path d="M{LEFT} {TOP}V{bottom}H{right}" fill="none" stroke="#333333"/>"##)?;
        for (value, text) in &x.ticks {
            if let Some(at) = x.place(*value) {
                writeln!(svg, r#"<text x="{at:.1}" y="{}" text-anchor="middle">{text}</text>"#, bottom + 18.0)?;
            }
        }
        for (value, text) in &y.ticks {
            if let Some(at) = y.place(*value) {
                writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#, LEFT - 8.0, at + 4.5)?;
            }
        }
        let (mid_x, mid_y) = (0.5 * (LEFT + right), 0.5 * (TOP + bottom));
        writeln!(svg, r#"<text x="{mid_x}" y="{}" text-anchor="middle">{}</text>"#, SIZE.1 - 14.0, escape(&self.x.label))?;
        let label = escape(&self.y.label);
        writeln!(svg, r#"<text transform="translate(20 {mid_y}) rotate(-90)" text-anchor="middle">{label}</text>"#)?;
        writeln!(svg, r#"<text x="{mid_x}" y="26" text-anchor="middle" font-size="16">{}</text>"#, escape(&self.title))
    }

    /// Room for the names of more than one curve, at the right.
    fn legend_width(&self) -> f64 {
        let longest = self.curves.iter().map(|c| c.name.chars().count()).max().unwrap_or(0) as f64;
        if self.curves.len() < 2 { 0.0 } else { LEGEND_LINE + 16.0 + LETTER * longest }
    }

    fn draw_legend(&self, svg: &mut String) -> std::fmt::Result {
        let left = SIZE.0 - self.legend_width() - 8.0;
        let named = self.curves.iter().zip(COLORS.iter().cycle()).enumerate().filter(|_| self.curves.len() > 1);
        for (i, (curve, color)) in named {
            let y = TOP + 8.0 + 20.0 * i as f64;
            writeln!(svg, r#"<path d="M{left:.1} {y}h{LEGEND_LINE}" stroke="{color}" stroke-width="2"/>"#)?;
            writeln!(svg, r#"<text x="{:.1}" y="{}">{}</text>"#, left + LEGEND_LINE + 6.0, y + 4.5, escape(&curve.name))?;
        }
        Ok(())
    }
}

/// Plots side by side in one SVG document, so many in a row.
pub fn grid(plots: &[Plot], columns: usize) -> String {
    let columns = columns.min(plots.len()).max(1);
    let (width, height) = (SIZE.0 * columns as f64, SIZE.1 * plots.len().div_ceil(columns) as f64);
    let place = |i: usize| (SIZE.0 * (i % columns) as f64, SIZE.1 * (i / columns) as f64);
    let panels: String = plots.iter().enumerate().map(|(i, plot)| plot.panel(i, place(i))).collect();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n{panels}</svg>\n"
    )
}

/// From values to places on the paper.
struct Scale {
    log: bool,
    /// Values (their logarithms to base 10) at the two ends, and where these are.
    from: (f64, f64),
    to: (f64, f64),
    ticks: Vec<(f64, String)>,
}

impl Scale {
    /// Shows all of `values`, with a share `room` of their range to spare at both ends, and about `ticks` ticks.
    fn new(axis: &Axis, values: impl Iterator<Item = f64>, room: f64, to: (f64, f64), ticks: f64) -> Self {
        let map = |v: f64| if axis.log { v.log10() } else { v };
        let values = values.chain((axis.from_zero && !axis.log).then_some(0.0)).map(map).filter(|v| v.is_finite());
        let (mut lo, mut hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if lo > hi {
            (lo, hi) = (0.0, 1.0);
        }
        // A range that its own rounding would fill is no range.
        if hi - lo <= 1e-9 * hi.abs().max(lo.abs()) {
            let half = if lo == 0.0 || axis.log { 0.5 } else { 0.05 * lo.abs() };
            (lo, hi) = (lo - half, hi + half);
        }
        let spare = room * (hi - lo);
        let ends_at_zero = |v: f64| axis.from_zero && v == 0.0;
        let from = (if ends_at_zero(lo) { lo } else { lo - spare }, if ends_at_zero(hi) { hi } else { hi + spare });
        let ticks = if axis.log { log_ticks(from, ticks) } else { linear_ticks(from, ticks) };
        Scale { log: axis.log, from, to, ticks }
    }

    /// Where `value` is; `None` where it is not finite on this scale.
    fn place(&self, value: f64) -> Option<f64> {
        let v = if self.log { value.log10() } else { value };
        let share = (v - self.from.0) / (self.from.1 - self.from.0);
        v.is_finite().then_some(self.to.0 + share * (self.to.1 - self.to.0))
    }

    /// As [`Scale::place`]; what lies below the scale is at its lower end.
    fn place_within(&self, value: f64) -> Option<f64> {
        let least = if self.log { 10f64.powf(self.from.0) } else { self.from.0 };
        self.place(value.max(least))
    }
}

/// Multiples of 1, 2 or 5 times a power of ten within `range`, about `count` of them, with their texts.
fn linear_ticks(range: (f64, f64), count: f64) -> Vec<(f64, String)> {
    let rough = (range.1 - range.0) / count;
    let decade = rough.log10().floor();
    let power = 10f64.powf(decade);
    let step = [1.0, 2.0, 5.0, 10.0].map(|f| f * power).into_iter().find(|s| *s >= rough * 0.999).unwrap_or(10.0 * power);
    let (first, last) = ((range.0 / step - 1e-6).ceil() as i64, (range.1 / step + 1e-6).floor() as i64);
    let exponent = range.0.abs().max(range.1.abs()).log10().floor();
    let scientific = !(-3.0..5.0).contains(&exponent);
    let unit = if scientific { exponent } else { 0.0 };
    let digits = (unit - (step.log10() + 1e-6).floor()).max(0.0) as usize;
    let text = |value: f64| match value {
        0.0 => "0".to_string(),
        v if scientific => format!("{:.digits$}e{unit}", v / 10f64.powf(unit)),
        v => format!("{v:.digits$}"),
    };
    (first..=last).map(|i| (i as f64 * step, text(i as f64 * step))).collect()
}

/// Powers of ten within `range` (of logarithms); where there are few, 2 and 5 times them too; where many, every second, third, ...
fn log_ticks(range: (f64, f64), count: f64) -> Vec<(f64, String)> {
    let (first, last) = (range.0.floor() as i64, range.1.ceil() as i64);
    let every = ((last - first) as f64 / count).ceil().max(1.0) as usize;
    let factors: &[f64] = if range.1 - range.0 < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let values = (first..=last).step_by(every).flat_map(|decade| factors.iter().map(move |f| (*f, decade)));
    let text = |f: f64, decade: i64| match decade {
        -3..5 => format!("{}", f * 10f64.powi(decade as i32)),
        _ => format!("{f}e{decade}"),
    };
    let all = values.map(|(f, decade)| (f * 10f64.powi(decade as i32), text(f, decade)));
    all.filter(|(v, _)| (range.0 - 1e-9..=range.1 + 1e-9).contains(&v.log10())).collect()
}

/// The unbroken stretches of a line, on the paper.
fn runs(points: &[(f64, f64)], x: &Scale, y: &Scale) -> Vec<Vec<(f64, f64)>> {
    let placed: Vec<Option<(f64, f64)>> = points.iter().map(|p| x.place(p.0).zip(y.place(p.1))).collect();
    placed.split(Option::is_none).filter(|run| !run.is_empty()).map(|run| run.iter().flatten().copied().collect()).collect()
}

fn join(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Text as XML has it.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
