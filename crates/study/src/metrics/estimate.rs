//! Means with their uncertainty.

use crate::metrics::ROUNDING;
use serde::{Deserialize, Deserializer, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A mean over independent runs and how well it is known.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    #[serde(deserialize_with = "or_nan")]
    pub value: f64,
    /// Lower end of its 95 % confidence interval; the mean itself where there is
    /// only one run.
    #[serde(deserialize_with = "or_lowest")]
    pub low: f64,
    /// Upper end.
    #[serde(deserialize_with = "or_highest")]
    pub high: f64,
}

// JSON has no word for what is not finite and writes `null`. An interval's end that is
// missing is infinitely far away; a value that is missing is not known.

fn or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

fn or_lowest<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NEG_INFINITY))
}

fn or_highest<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

/// Student's t for a two-sided interval of `confidence` over `runs` runs: its
/// half-width in standard errors.
pub fn student_t(confidence: f64, runs: usize) -> f64 {
    let freedom = runs.saturating_sub(1) as f64;
    let quantile = 0.5 + confidence / 2.0;
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(quantile))
}

impl Estimate {
    /// What is known without uncertainty.
    pub fn exactly(value: f64) -> Self {
        Self::around(value, 0.0)
    }

    /// A value and half of its interval's width.
    pub fn around(value: f64, half: f64) -> Self {
        Estimate { value, low: value - half, high: value + half }
    }

    /// The mean of `runs` with Student's interval.
    pub fn of(runs: &[f64]) -> Self {
        let n = runs.len() as f64;
        let mean = runs.iter().sum::<f64>() / n.max(1.0);
        if runs.len() < 2 {
            return Self::exactly(mean);
        }
        let square = runs.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>();
        let half = student_t(0.95, runs.len()) * (square / (n - 1.0) / n).sqrt();
        Self::around(mean, half)
    }

    /// The root of a mean that cannot be negative, such as an RMSE from an MSE.
    pub fn sqrt(self) -> Self {
        let root = |v: f64| v.max(0.0).sqrt();
        Estimate { value: root(self.value), low: root(self.low), high: root(self.high) }
    }

    /// The same in other units.
    pub fn scaled(self, by: f64) -> Self {
        Estimate { value: self.value * by, low: self.low * by, high: self.high * by }
    }

    /// The ratio of two independent estimates of positive quantities: their
    /// intervals' relative half-widths, on a logarithmic scale, add in quadrature.
    pub fn ratio(self, other: Estimate) -> Self {
        let value = self.value / other.value;
        let half = |e: Estimate| (e.high / e.low).ln() / 2.0;
        let half = half(self).hypot(half(other));
        if half.is_finite() {
            Estimate { value, low: value * (-half).exp(), high: value * half.exp() }
        } else {
            Estimate { value, low: 0.0, high: f64::INFINITY }
        }
    }

    /// How far an [`Estimate::of`] so many runs, an error in 8-bit units, lies from 0 beyond
    /// [`ROUNDING`], in standard errors.
    pub fn standard_errors(&self, runs: usize) -> f64 {
        let beyond = (self.value.abs() - ROUNDING).max(0.0);
        if beyond == 0.0 { 0.0 } else { beyond * student_t(0.95, runs) / self.half_width() }
    }

    /// Half of the interval's width.
    pub fn half_width(&self) -> f64 {
        (self.high - self.low) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_intervals() {
        // n = 5, mean 3, s = √2.5: half-width t(4) · s/√5 = 2.776445 · 0.707107.
        let e = Estimate::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(e.value, 3.0);
        assert!((e.half_width() - 2.776_445 * 0.5_f64.sqrt()).abs() < 1e-5, "{e:?}");
        // 3 is 3 / √½ of its standard errors.
        assert!((e.standard_errors(5) - (3.0 - ROUNDING) * 2_f64.sqrt()).abs() < 1e-9);
        // What runs agree on is no chance: either rounding or a bias.
        let same = |value| Estimate::of(&[value; 5]).standard_errors(5);
        assert_eq!([0.0, ROUNDING / 2.0, 2.0 * ROUNDING].map(same), [0.0, 0.0, f64::INFINITY]);
        assert_eq!(Estimate::of(&[7.0]), Estimate::exactly(7.0));
    }

    #[test]
    fn estimates_come_back_from_records() {
        let back = |e: Estimate| -> Estimate {
            serde_json::from_str(&serde_json::to_string(&e).unwrap()).unwrap()
        };
        let e = Estimate { value: 0.1, low: -1e-300, high: 2.0 };
        assert_eq!(back(e), e);
        let unknown = Estimate::exactly(2.0).ratio(Estimate::exactly(0.0));
        assert!(back(unknown).value.is_nan());
        assert_eq!((back(unknown).low, back(unknown).high), (0.0, f64::INFINITY));
        assert!(serde_json::from_str::<Estimate>(r#"{"value": 1, "low": 0}"#).is_err());
    }

    #[test]
    fn ratios_carry_both_sides() {
        let a = Estimate { value: 2.0, low: 1.9, high: 2.1 };
        let exact = Estimate { value: 4.0, low: 4.0, high: 4.0 };
        let r = a.ratio(exact);
        assert_eq!(r.value, 0.5);
        assert!((r.low - 0.4756).abs() < 1e-3 && (r.high - 0.5257).abs() < 1e-3, "{r:?}");
        let wider = a.ratio(Estimate { value: 4.0, low: 3.8, high: 4.2 });
        assert!(wider.half_width() > r.half_width());
    }
}
