//! What a design costs.

use crate::study::analysis::relative::{RunName, records_over_scenes};
use crate::study::record::Record;
use crate::study::results::Results;
use crate::study::throughput::Spread;

screendoor_trace::options! {
    /// What a design costs, as charts put it against the error.
    pub enum Cost {
        State = "state": "State per pixel",
        Moved = "moved": "State moved",
        Hashes = "hashes": "Hashes",
        Comparators = "comparators": "Comparators",
        Multiplications = "multiplications": "Multiplications",
        Cpu = "cpu": "CPU time",
        Gpu = "gpu": "GPU time",
    }
}

impl Cost {
    /// What it is counted in.
    pub fn unit(self) -> &'static str {
        match self {
            Cost::State => "bytes per pixel",
            Cost::Moved => "bytes per fragment",
            Cost::Hashes => "hashes per fragment",
            Cost::Comparators => "comparisons per fragment",
            Cost::Multiplications => "products per fragment",
            Cost::Cpu | Cost::Gpu => "ns per fragment",
        }
    }

    /// How it is told.
    pub fn meaning(self) -> &'static str {
        match self {
            Cost::State => {
                "pixel state as hardware would hold it, the multisample buffer included; over \
                 several scenes the largest"
            }
            Cost::Moved => "pixel state read and written for each fragment, over all passes",
            Cost::Hashes => "hashes evaluated for each fragment",
            Cost::Comparators => {
                "depths compared for each fragment: depth tests, layers kept, and the comparators of sorting \
                 networks"
            }
            Cost::Multiplications => {
                "colours, opacities and errors multiplied for each fragment; of designs for which \
                 that is an honest count"
            }
            Cost::Cpu => {
                "time of the fast engine on this machine's processor, median and quartiles"
            }
            Cost::Gpu => "time of the GPU engine from file to picture, median and quartiles",
        }
    }

    /// The engine that is timed, where time is the cost.
    pub fn engine(self) -> Option<&'static str> {
        match self {
            Cost::Cpu => Some("fast"),
            Cost::Gpu => Some("gpu"),
            _ => None,
        }
    }

    /// Of a run. What is counted has no spread.
    ///
    /// # Errors
    /// Why there is no figure.
    pub fn of(self, record: &Record) -> Result<Spread, String> {
        let counted = match self {
            Cost::State => {
                let bytes = record.state_bytes().ok_or("its state grows with the fragments")?;
                return Ok(Spread::exactly(bytes));
            }
            Cost::Moved => record.bytes_moved_per_fragment(),
            Cost::Hashes => record.hashes_per_fragment(),
            Cost::Comparators => record.comparators_per_fragment(),
            Cost::Multiplications if record.events.multiplications.is_none() => {
                return Err("the design does not say".to_string());
            }
            Cost::Multiplications => record.multiplications_per_fragment(),
            Cost::Cpu | Cost::Gpu => return self.time(record),
        };
        counted.map(Spread::exactly).ok_or("no events were counted".to_string())
    }

    fn time(self, record: &Record) -> Result<Spread, String> {
        let engine = self.engine().unwrap_or_default();
        let why = record.speed.get(engine).and_then(|s| s.missing.clone());
        record
            .nanoseconds_per_fragment(engine)
            .ok_or_else(|| why.unwrap_or_else(|| format!("not timed with the engine {engine}")))
    }

    /// Over all scenes: of the state the largest, of all else the scenes' mean.
    ///
    /// # Errors
    /// Why there is no figure: which scenes lack, or what lacks on a scene.
    pub fn over_scenes(self, results: &Results, run: RunName<'_>) -> Result<Spread, String> {
        let records = records_over_scenes(results, run)
            .map_err(|scenes| format!("no result on {}", scenes.join(", ")))?;
        let costs = records.iter().map(|r| self.of(r)).collect::<Result<Vec<Spread>, String>>()?;
        let over = |part: fn(&Spread) -> f64| {
            let values = costs.iter().map(part);
            match self {
                Cost::State => values.fold(0.0, f64::max),
                _ => values.sum::<f64>() / costs.len() as f64,
            }
        };
        Ok(Spread { low: over(|s| s.low), median: over(|s| s.median), high: over(|s| s.high) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Estimate;
    use crate::study::analysis::made_up::planted;
    use crate::study::record::Speed;

    #[test]
    fn what_grows_has_no_figure_and_time_needs_an_engine() {
        let two = &[Estimate::exactly(1.0), Estimate::exactly(2.0)];
        let mut results = planted(&["s", "t"], &[8], &[("a", two)]);
        let run = RunName { series: "a", samples: 8 };
        results.records[0].state_bits.samples = 784;
        assert_eq!(Cost::State.over_scenes(&results, run).unwrap().median, 100.0);
        results.records[1].state_bits.unbounded = true;
        assert!(Cost::State.over_scenes(&results, run).unwrap_err().contains("grows"));
        let not_timed = Cost::Cpu.over_scenes(&results, run).unwrap_err();
        assert_eq!(not_timed, "not timed with the engine fast");
        for (i, record) in results.records.iter_mut().enumerate() {
            let s = (i + 1) as f64;
            let seconds = Some(Spread { low: s, median: 2.0 * s, high: 3.0 * s });
            let speed = Speed { seconds, ..Speed::default() };
            record.speed.insert("fast".into(), speed);
            record.fragments = 1_000_000_000;
        }
        let time = Cost::Cpu.over_scenes(&results, run).unwrap();
        assert_eq!((time.low, time.median, time.high), (1.5, 3.0, 4.5));
        results.records.pop();
        assert_eq!(Cost::Cpu.over_scenes(&results, run).unwrap_err(), "no result on t");
    }
}
