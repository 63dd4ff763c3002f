//! How splats are drawn: what renderers do differently, as parameters, and the renderers as
//! settings of these.

use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Param, Typed, Values, parse_spec};

screendoor_trace::options! {
    /// A splat's opacity over q, the square of the distance from its centre in standard
    /// deviations.
    pub enum Kernel {
        Gaussian = "gaussian": "exp(-q/2)",
        Shifted = "shifted": "the same less its value at the extent, and scaled so that it begins at 1",
        Lowered = "lowered": "the same less its value at the extent",
    }
}

screendoor_trace::options! {
    /// When opacity is lowered by as much as dilation has made a splat larger
    /// (Mip-Splatting: Yu et al. 2024, equation 9).
    pub enum Factor {
        Auto = "auto": "where the file says that it was trained so",
        Always = "always": "of all splats",
        Never = "never": "of none",
    }
}

screendoor_trace::options! {
    /// What a splat's depth follows.
    pub enum Distance {
        Axis = "axis": "the distance of its mean along the view axis",
        Eye = "eye": "the distance of its mean from the eye",
    }
}

screendoor_trace::options! {
    /// A splat's depth over its pixels.
    pub enum Depth {
        Flat = "flat": "that of its mean, everywhere",
        Plane = "plane": "where lines of sight are nearest to its mean, in its own measure: without popping",
    }
}

screendoor_trace::options! {
    /// Where alphas are taken.
    pub enum Alphas {
        Centre = "centre": "at the pixel's centre, for all of its samples: one fragment a pixel",
        Sample = "sample": "at each sample: one fragment a sample",
    }
}

const KERNEL: Typed<Kernel> = Typed::choice("kernel", "gaussian", "how opacity falls off");
const EXTENT: Typed<f64> =
    Typed::real("extent", "0", (0.0, 16.0), "where splats end, in standard deviations; 0: nowhere");
const DILATION: Typed<f64> = Typed::real(
    "dilation",
    "0.3",
    (0.0, 16.0),
    "added to variances on the frame, in pixels squared",
);
const FACTOR: Typed<Factor> =
    Typed::choice("factor", "auto", "lower opacity by what dilation adds to the size");
const CAP: Typed<f64> = Typed::real("cap", "0.99", (0.001, 1.0), "the greatest alpha");
const CUT: Typed<f64> =
    Typed::real("cut", "0.00392156862745098", (0.0, 1.0), "alphas below are not drawn");
const DISTANCE: Typed<Distance> = Typed::choice("distance", "axis", "what depth follows");
const DEPTH: Typed<Depth> = Typed::choice("depth", "flat", "depth over the splat's pixels");
const ALPHAS: Typed<Alphas> = Typed::choice("alpha", "centre", "where alphas are taken");
const NEAR: Typed<f64> =
    Typed::real("near", "0.2", (1e-6, 1e6), "nearer splats are not drawn, in the scene's units");
const LEAN: Typed<f64> = Typed::real(
    "lean",
    "0.3",
    (0.0, 1e3),
    "how far outside of the frame, in halves of it, splats lean as they do there",
);
const LARGEST: Typed<f64> = Typed::real(
    "largest",
    "0",
    (0.0, 65536.0),
    "the most standard deviations times the root of 2 in pixels, and the frame's shorter side; 0: any",
);

/// The parameters, with the defaults of the first of the [`RULE_SETS`].
pub const PARAMS: [Param; 12] = [
    KERNEL.param,
    EXTENT.param,
    DILATION.param,
    FACTOR.param,
    CAP.param,
    CUT.param,
    DISTANCE.param,
    DEPTH.param,
    ALPHAS.param,
    NEAR.param,
    LEAN.param,
    LARGEST.param,
];

/// What a renderer does, by what it does differently from the first.
#[derive(Clone, Copy, Debug)]
pub struct RuleSet {
    /// Its name.
    pub name: &'static str,
    /// Whose rules they are.
    pub help: &'static str,
    /// What it sets, beside the defaults of [`PARAMS`].
    pub settings: &'static [(&'static str, &'static str)],
}

/// √8.
const ROOT_8: &str = "2.8284271247461903";

/// The renderers that are known, the one first whose rules hold where none are asked for.
pub const RULE_SETS: [RuleSet; 8] = [
    RuleSet {
        name: "inria",
        help: "the reference rasteriser (Kerbl et al. 2023), without its stop where little light is left",
        settings: &[],
    },
    RuleSet { name: "gsplat", help: "nerfstudio's", settings: &[("near", "0.01")] },
    RuleSet {
        name: "mip",
        help: "Mip-Splatting (Yu et al. 2024)",
        settings: &[("dilation", "0.1"), ("factor", "always")],
    },
    RuleSet {
        name: "playcanvas",
        help: "PlayCanvas' engine",
        settings: &[
            ("kernel", "shifted"),
            ("extent", ROOT_8),
            ("cap", "1"),
            ("near", "0.1"),
            ("largest", "1024"),
        ],
    },
    RuleSet {
        name: "splat-transform",
        help: "PlayCanvas' offline renderer",
        settings: &[("kernel", "lowered"), ("extent", "3")],
    },
    RuleSet {
        name: "nvpro",
        help: "NVIDIA's vk_gaussian_splatting",
        settings: &[("extent", ROOT_8), ("cap", "1"), ("near", "0.1")],
    },
    RuleSet {
        name: "spark",
        help: "Spark: sorted by distance, always antialiased",
        settings: &[
            ("extent", ROOT_8),
            ("factor", "always"),
            ("cap", "1"),
            ("cut", "0.00196078431372549"),
            ("distance", "eye"),
            ("near", "0.1"),
        ],
    },
    RuleSet {
        name: "khr",
        help: "KHR_gaussian_splatting, as its text has it",
        settings: &[
            ("extent", "3"),
            ("cap", "1"),
            ("cut", "0"),
            ("distance", "eye"),
            ("near", "0.1"),
        ],
    },
];

/// How splats are drawn.
#[derive(Clone, PartialEq, Debug)]
pub struct SplatRules {
    /// The name and what was set beside it, as it was given.
    spec: String,
    pub(super) kernel: Kernel,
    pub(super) extent: f64,
    pub(super) dilation: f64,
    pub(super) factor: Factor,
    pub(super) cap: f64,
    pub(super) cut: f64,
    pub(super) distance: Distance,
    pub(super) depth: Depth,
    pub(super) alphas: Alphas,
    pub(super) near: f64,
    pub(super) lean: f64,
    pub(super) largest: f64,
}

impl SplatRules {
    /// The rules of `NAME[:parameter=value,…]`.
    ///
    /// # Errors
    /// [`Error::Config`] for a name, a parameter or a value that is not known.
    pub fn parse(spec: &str) -> Result<Self> {
        let (name, given) = parse_spec(spec)?;
        let Some(set) = RULE_SETS.iter().find(|set| set.name == name) else {
            return Err(Error::unknown("splat rules", name, RULE_SETS.iter().map(|s| s.name)));
        };
        let is_given = |name: &str| given.iter().any(|(own, _)| own == name);
        let own = set.settings.iter().filter(|(name, _)| !is_given(name));
        let own = own.map(|(name, value)| (name.to_string(), value.to_string()));
        let settings: Vec<(String, String)> = own.chain(given.iter().cloned()).collect();
        let values = Values::resolve(&format!("splat rules '{name}'"), &PARAMS, &settings)?;
        if values.get(KERNEL) != Kernel::Gaussian && values.get(EXTENT) == 0.0 {
            let what = format_args!("splat rules '{spec}': this kernel needs an extent");
            return Err(Error::config(what, "set extent to where splats end, such as 3"));
        }
        if values.get(DEPTH) == Depth::Plane && values.get(DISTANCE) == Distance::Eye {
            let what =
                format_args!("splat rules '{spec}': planes are of depths along the view axis");
            return Err(Error::config(what, "set distance=axis, or depth=flat"));
        }
        Ok(SplatRules {
            spec: spec.to_string(),
            kernel: values.get(KERNEL),
            extent: values.get(EXTENT),
            dilation: values.get(DILATION),
            factor: values.get(FACTOR),
            cap: values.get(CAP),
            cut: values.get(CUT),
            distance: values.get(DISTANCE),
            depth: values.get(DEPTH),
            alphas: values.get(ALPHAS),
            near: values.get(NEAR),
            lean: values.get(LEAN),
            largest: values.get(LARGEST),
        })
    }

    /// The name and what was set beside it.
    pub fn spec(&self) -> &str {
        &self.spec
    }

    /// Splats are drawn whose means lie further away than this, in the scene's units.
    pub(crate) fn near(&self) -> f64 {
        self.near
    }

    /// Whether depth varies over a splat.
    pub(crate) fn is_deep(&self) -> bool {
        self.depth == Depth::Plane
    }

    /// The kernel's value at its extent.
    fn edge(&self) -> f64 {
        libm::exp(-self.extent * self.extent / 2.0)
    }

    /// The share of a splat's opacity at `q`, the square of the distance from its centre in
    /// standard deviations, within its extent.
    pub(super) fn kernel(&self, q: f64) -> f64 {
        let [share] = self.shares([libm::exp(-q / 2.0)]);
        share
    }

    /// The same of the Gaussian's values there.
    #[inline(always)]
    pub(super) fn shares<const N: usize>(&self, values: [f64; N]) -> [f64; N] {
        match self.kernel {
            Kernel::Gaussian => values,
            Kernel::Shifted => {
                let edge = self.edge();
                values.map(|value| (value - edge) / (1.0 - edge))
            }
            Kernel::Lowered => {
                let edge = self.edge();
                values.map(|value| value - edge)
            }
        }
    }

    /// The greatest q at which a splat of this opacity is drawn; `None` where it is nowhere.
    pub(super) fn reach(&self, opacity: f64) -> Option<f64> {
        let share = self.least() / opacity;
        let value = match self.kernel {
            Kernel::Gaussian => share,
            Kernel::Shifted => share * (1.0 - self.edge()) + self.edge(),
            Kernel::Lowered => share + self.edge(),
        };
        // What is no number is nowhere.
        if value.is_nan() || value > 1.0 {
            return None;
        }
        let cut = -2.0 * libm::log(value);
        Some(if self.extent > 0.0 { cut.min(self.extent * self.extent) } else { cut })
    }

    /// The least alpha that is drawn: never what no trace records.
    pub(super) fn least(&self) -> f64 {
        self.cut.max(f64::from(crate::capture::shade::LEAST_ALPHA))
    }
}

impl Default for SplatRules {
    fn default() -> Self {
        SplatRules::parse(RULE_SETS[0].name).expect("the rules of the table are good")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_rules_of_the_table_are_good_and_can_be_changed() {
        for set in RULE_SETS {
            let rules = SplatRules::parse(set.name).unwrap();
            let changed = SplatRules::parse(&format!("{}:cut=0.5,dilation=2", set.name)).unwrap();
            assert_eq!((changed.cut, changed.dilation), (0.5, 2.0), "{}", set.name);
            assert_eq!(changed.kernel, rules.kernel);
        }
        let says = |spec: &str, part: &str| {
            let error = SplatRules::parse(spec).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        says("inri", "inria");
        says("inria:kernel=shifted", "extent");
        says("inria:dilation=-1", "dilation");
        says("inria:cutt=1", "cut");
        says("spark:depth=plane", "distance=axis");
    }

    #[test]
    fn a_splat_reaches_to_where_its_alpha_is_the_least() {
        for set in RULE_SETS {
            let rules = SplatRules::parse(set.name).unwrap();
            for opacity in [0.01, 0.3, 1.0] {
                let Some(q) = rules.reach(opacity) else { panic!("{}", set.name) };
                let alpha = opacity * rules.kernel(q);
                let at_extent = rules.extent > 0.0 && q == rules.extent * rules.extent;
                assert!(at_extent || (alpha - rules.least()).abs() < 1e-12, "{} {alpha}", set.name);
            }
        }
        assert_eq!(SplatRules::default().reach(1.0 / 256.0), None);
        assert_eq!(SplatRules::default().reach(f64::NAN), None);
    }
}
