//! Tone curves: from light of any brightness towards what a screen can show.

use super::wgsl;
use crate::color::convert::{Matrix, apply, multiply};
use crate::color::space::Space;

/// A tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// Proportional to the light.
    #[default]
    None,
    /// Reinhard et al., "Photographic Tone Reproduction for Digital Images", SIGGRAPH 2002, equation 4, of the luminance; colours keep
    /// their chromaticity. Four times the luminance of white comes out white.
    Reinhard,
    /// S. Hill's fit to the ACES reference rendering and output transforms for sRGB (in M. Pettineo, "BakingLab", 2016).
    Aces,
    /// In the manner of T. Sobotka's AgX: a sigmoid over the logarithm of mixed components, which whitens bright colours. The mixing for
    /// Rec.2020 is Blender's, the polynomial for the sigmoid B. Wrensch's ("Minimal AgX Implementation", 2023).
    AgX,
}

impl Tone {
    /// All of them by name.
    pub const NAMED: [(&str, Tone); 4] =
        [("none", Tone::None), ("reinhard", Tone::Reinhard), ("aces", Tone::Aces), ("agx", Tone::AgX)];
}

/// A tone curve for linear RGB of one space.
#[derive(Debug, Clone)]
pub struct ToneCurve {
    tone: Tone,
    /// From the space into that of the curve, and back.
    into: Matrix,
    back: Matrix,
    /// Weights of R, G, B in the luminance.
    luminance: [f64; 3],
}

impl ToneCurve {
    /// The curve for colours of `space`.
    pub fn new(tone: Tone, space: Space) -> Self {
        let luminance = space.to_xyz()[1];
        let (into, back) = match tone {
            Tone::None | Tone::Reinhard => (IDENTITY, IDENTITY),
            Tone::Aces => {
                // The rendering transform takes off a little saturation, the output transform for dim surrounds some more.
                let weights = Space::AcesCg.to_xyz()[1];
                let into = multiply(&saturation(0.96, weights), &space.to(Space::AcesCg));
                (into, multiply(&Space::AcesCg.to(space), &saturation(0.93, weights)))
            }
            Tone::AgX => (multiply(&AGX_INSET, &space.to(Space::Rec2020)), Space::Rec2020.to(space)),
        };
        ToneCurve { tone, into, back, luminance }
    }

    /// Up to here the largest component of the result is left as it is when it is brought into [0, 1]. Curves that approach 1 by themselves
    /// need no second shoulder.
    pub fn knee(&self) -> f64 {
        match self.tone {
            Tone::None | Tone::Reinhard => 0.9,
            Tone::Aces | Tone::AgX => 1.0,
        }
    }

    /// Names and values of the numbers of [`ToneCurve::apply`] for the same on a GPU, and the name of the curve there.
    pub(super) fn wgsl(&self) -> (String, &'static str) {
        let matrices = wgsl::matrix("TONE_INTO", &self.into) + &wgsl::matrix("TONE_BACK", &self.back);
        match self.tone {
            Tone::None => (String::new(), "TONE_NONE"),
            Tone::Reinhard => {
                let numbers = [wgsl::vector("LUMINANCE", self.luminance), wgsl::number("REINHARD_WHITE", REINHARD_WHITE)];
                (numbers.concat(), "TONE_REINHARD")
            }
            Tone::Aces => (matrices + &wgsl::array("ACES_FIT", &ACES_FIT), "TONE_ACES"),
            Tone::AgX => {
                let numbers = [
                    wgsl::matrix("AGX_OUTSET", &AGX_OUTSET),
                    wgsl::array("AGX_SIGMOID_AROUND_HALF", &around_half(AGX_SIGMOID)),
                    wgsl::number("AGX_LEAST", AGX_LEAST),
                    wgsl::number("AGX_GREY", AGX_GREY),
                    wgsl::number("AGX_STOPS_BELOW", AGX_STOPS_BELOW),
                    wgsl::number("AGX_STOPS_ABOVE", AGX_STOPS_ABOVE),
                    wgsl::number("AGX_EXPONENT", AGX_EXPONENT),
                ];
                (matrices + &numbers.concat(), "TONE_AGX")
            }
        }
    }

    /// Linear RGB, white at 1, to linear RGB for a screen.
    pub fn apply(&self, rgb: [f64; 3]) -> [f64; 3] {
        match self.tone {
            Tone::None => rgb,
            Tone::Reinhard => {
                let y = (0..3).map(|i| self.luminance[i] * rgb[i]).sum::<f64>().max(0.0);
                rgb.map(|v| v * (1.0 + y / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + y))
            }
            Tone::Aces => {
                let [a, b, c, d, e] = ACES_FIT;
                let fit = |v: f64| (v * (v + a) + b) / (v * (c * v + d) + e);
                apply(&self.back, apply(&self.into, rgb).map(|v| fit(v.max(0.0)).max(0.0)))
            }
            Tone::AgX => {
                let stops = |v: f64| (v.max(AGX_LEAST) / AGX_GREY).log2();
                let log = |v: f64| (stops(v) + AGX_STOPS_BELOW) / (AGX_STOPS_BELOW + AGX_STOPS_ABOVE);
                let shaped = apply(&self.into, rgb).map(|v| agx_sigmoid(log(v).clamp(0.0, 1.0)));
                apply(&self.back, apply(&AGX_OUTSET, shaped).map(|v| v.max(0.0).powf(AGX_EXPONENT)))
            }
        }
    }
}

const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Draws colours towards grey of the same luminance.
fn saturation(share: f64, luminance: [f64; 3]) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| share * IDENTITY[r][c] + (1.0 - share) * luminance[c]))
}

/// The luminance that comes out white.
const REINHARD_WHITE: f64 = 4.0;

/// Of `(v (v + a) + b) / (v (c v + d) + e)`.
const ACES_FIT: [f64; 5] = [0.024_578_6, -0.000_090_537, 0.983_729, 0.432_951_0, 0.238_081];

/// Middle grey, how many stops below and above it the sigmoid reaches, and what counts for less.
const AGX_GREY: f64 = 0.18;
const AGX_STOPS_BELOW: f64 = 10.0;
const AGX_STOPS_ABOVE: f64 = 6.5;
const AGX_LEAST: f64 = 1e-10;
/// What the sigmoid's result is encoded with.
const AGX_EXPONENT: f64 = 2.2;
const AGX_INSET: Matrix = [
    [0.856_627_153_315_983, 0.095_121_240_538_158_8, 0.048_251_606_145_858_3],
    [0.137_318_972_929_847, 0.761_241_990_602_591, 0.101_439_036_467_562],
    [0.111_898_212_999_95, 0.076_799_418_603_190_3, 0.811_302_368_396_859],
];
const AGX_OUTSET: Matrix = [
    [1.127_100_581_814_436_8, -0.110_606_643_096_603_23, -0.016_493_938_717_834_573],
    [-0.141_329_763_498_438_3, 1.157_823_702_216_272, -0.016_493_938_717_834_257],
    [-0.141_329_763_498_438_26, -0.110_606_643_096_602_94, 1.251_936_406_595_040_5],
];

/// Coefficients, of the highest power first.
const AGX_SIGMOID: [f64; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];

/// The coefficients of the same polynomial in x - 1/2, whose terms cancel less where digits are few.
fn around_half(mut c: [f64; 7]) -> [f64; 7] {
    // Horner's division by x - 1/2, again and again: each remainder is a coefficient.
    for last in (1..c.len()).rev() {
        (1..=last).for_each(|i| c[i] += 0.5 * c[i - 1]);
    }
    c
}

fn agx_sigmoid(x: f64) -> f64 {
    AGX_SIGMOID.into_iter().fold(0.0, |sum, c| sum * x + c)
}
