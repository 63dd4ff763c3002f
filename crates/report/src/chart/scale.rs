//! From values to places along an axis.

/// How values lie on an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Evenly, from 0 on where none is negative.
    Linear,
    /// By their logarithms, with ticks at decimal numbers.
    Log,
    /// The same with ticks at powers of two.
    Log2,
}

/// A scale: a range of values over a range of places.
#[derive(Clone, PartialEq, Debug)]
pub struct Scale {
    kind: Kind,
    domain: [f64; 2],
    range: [f64; 2],
    /// Where 0 lies on a logarithmic scale: apart, at the range's start.
    zero: Option<f64>,
}

/// A place on an axis with what is said there; nothing for a small tick.
#[derive(Clone, PartialEq, Debug)]
pub struct Tick {
    /// The value.
    pub value: f64,
    /// The text.
    pub label: String,
}

/// What is kept apart for zeros at the start of a logarithmic scale.
const ZERO_BAND: f64 = 26.0;

impl Scale {
    /// A scale on which all of `values` lie within `range`, the first of which is where
    /// small values are.
    pub fn new(kind: Kind, values: impl IntoIterator<Item = f64>, range: [f64; 2]) -> Self {
        let finite: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        let shown = finite.iter().copied().filter(|v| kind == Kind::Linear || *v > 0.0);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in shown {
            low = low.min(v);
            high = high.max(v);
        }
        if low > high {
            (low, high) = (1.0, 1.0);
        }
        let has_zero = kind != Kind::Linear && finite.iter().any(|v| *v <= 0.0);
        let domain = match kind {
            Kind::Linear => {
                let low = low.min(0.0);
                let step = step_of(low, high);
                [(low / step).floor() * step, (high / step).ceil().max(1.0) * step]
            }
            _ => {
                // Air, so that no mark touches the frame; and never less than a third of a
                // decade, where differences would look larger than they are.
                let air = ((high / low).ln() * 0.06).max(0.03);
                let lack = ((2.2_f64.ln() - (high / low).ln()) / 2.0).max(0.0);
                [low * (-air - lack).exp(), high * (air + lack).exp()]
            }
        };
        let towards = (range[1] - range[0]).signum();
        let (zero, start) = if has_zero {
            (Some(range[0] + towards * ZERO_BAND / 3.0), range[0] + towards * ZERO_BAND)
        } else {
            (None, range[0])
        };
        Scale { kind, domain, range: [start, range[1]], zero }
    }

    /// Where a value lies; at the range's end where it is beyond.
    pub fn at(&self, value: f64) -> f64 {
        let share = match self.kind {
            Kind::Linear => (value - self.domain[0]) / (self.domain[1] - self.domain[0]),
            _ if value <= 0.0 => return self.zero.unwrap_or(self.range[0]),
            _ => (value / self.domain[0]).ln() / (self.domain[1] / self.domain[0]).ln(),
        };
        self.range[0] + share.clamp(0.0, 1.0) * (self.range[1] - self.range[0])
    }

    /// Where a logarithmic scale's zeros lie, if it has any.
    pub fn zero(&self) -> Option<f64> {
        self.zero
    }

    /// The ticks, small values first.
    pub(crate) fn ticks(&self) -> Vec<Tick> {
        let [low, high] = self.domain;
        match self.kind {
            Kind::Linear => {
                let step = step_of(low, high);
                let (first, last) = ((low / step).round() as i64, (high / step).round() as i64);
                let values = (first..=last).map(|i| i as f64 * step);
                values.map(|value| Tick { value, label: tidy(value) }).collect()
            }
            // Where there are fewer than two powers of two, decimal numbers say more.
            Kind::Log2 if high.log2().floor() > low.log2().ceil() => {
                let (first, last) = (low.log2().ceil() as i32, high.log2().floor() as i32);
                let every = ((last - first) / 9 + 1) as usize;
                let values = (first..=last).step_by(every).map(|e| 2_f64.powi(e));
                values.map(|value| Tick { value, label: tidy(value) }).collect()
            }
            Kind::Log | Kind::Log2 => self.decimal_ticks(),
        }
    }

    fn decimal_ticks(&self) -> Vec<Tick> {
        let [low, high] = self.domain;
        let decades = (high / low).log10();
        let labelled: &[f64] = match decades {
            d if d < 0.7 => &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
            d if d < 1.5 => &[1.0, 2.0, 3.0, 5.0, 7.0],
            d if d < 3.2 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let small: &[f64] = if decades < 0.7 { labelled } else { &DIGITS };
        let mut ticks = Vec::new();
        for exponent in low.log10().floor() as i32..=high.log10().ceil() as i32 {
            let every = (decades / 7.0).ceil().max(1.0) as i32;
            for digit in small {
                // Through text, so that 0.3 is 0.3.
                let value: f64 = format!("{digit}e{exponent}").parse().unwrap_or(f64::NAN);
                if !(low..=high).contains(&value) {
                    continue;
                }
                let says = labelled.contains(digit) && exponent.rem_euclid(every) == 0;
                ticks.push(Tick { value, label: if says { tidy(value) } else { String::new() } });
            }
        }
        ticks
    }
}

const DIGITS: [f64; 9] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];

/// A step of 1, 2 or 5 times a power of ten that divides the range in four to eight.
fn step_of(low: f64, high: f64) -> f64 {
    let width = if high > low { high - low } else { 1.0 };
    let rough = width / 6.0;
    let power = 10_f64.powf(rough.log10().floor());
    let digit = match rough / power {
        d if d < 1.5 => 1.0,
        d if d < 3.5 => 2.0,
        d if d < 7.5 => 5.0,
        _ => 10.0,
    };
    digit * power
}

/// A tick's number: no tail of rounding, thin spaces between thousands, M for millions.
fn tidy(v: f64) -> String {
    let digits = format!("{v:.6}");
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    match digits {
        "0" | "-0" if v != 0.0 => format!("{v:e}"),
        "-0" => "0".to_string(),
        _ if v.abs() >= 1e6 && (v / 1e5).fract() == 0.0 => format!("{} M", v / 1e6),
        _ if v.abs() >= 1e4 && v.fract() == 0.0 => crate::html::grouped(v as u64),
        _ => digits.replace('-', "−"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: &Scale) -> Vec<String> {
        scale.ticks().into_iter().map(|t| t.label).filter(|l| !l.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        let scale = Scale::new(Kind::Linear, [0.02, 0.97], [0.0, 100.0]);
        assert_eq!(labels(&scale), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        let scale = Scale::new(Kind::Log, [0.3, 40.0], [0.0, 100.0]);
        assert_eq!(labels(&scale), ["0.5", "1", "2", "5", "10", "20", "50"]);
        let scale = Scale::new(Kind::Log2, [2.0, 32.0], [0.0, 100.0]);
        assert_eq!(labels(&scale), ["2", "4", "8", "16", "32"]);
        let scale = Scale::new(Kind::Log, [1e-3, 1e9], [0.0, 100.0]);
        assert!(labels(&scale).len() <= 8, "{:?}", labels(&scale));
        // One value alone.
        assert!(labels(&Scale::new(Kind::Log, [7.0], [0.0, 100.0])).len() >= 3);
    }

    #[test]
    fn values_lie_in_order_and_zero_apart() {
        let scale = Scale::new(Kind::Log, [0.0, 0.1, 10.0], [400.0, 0.0]);
        assert!(scale.at(0.0) > scale.at(1e-12), "zero lies below all that is not");
        assert!(scale.at(0.1) > scale.at(1.0) && scale.at(1.0) > scale.at(10.0));
        assert_eq!(scale.at(f64::INFINITY), 0.0);
        assert_eq!(Scale::new(Kind::Log, [0.1], [0.0, 1.0]).zero(), None);
        let scale = Scale::new(Kind::Linear, [0.0], [0.0, 100.0]);
        assert_eq!(scale.at(0.0), 0.0);
        assert!(scale.at(0.5).is_finite());
    }
}
