//! What measures.

use crate::study::results::Machine;
use screendoor_rop::fast::levels;

impl Machine {
    /// This machine. `gpu` is the GPU that is used, if one is.
    pub fn here(gpu: Option<String>) -> Self {
        Machine {
            screendoor: env!("CARGO_PKG_VERSION").to_string(),
            processor: processor(),
            threads: rayon::current_num_threads(),
            memory: memory(),
            system: format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH),
            vectors: levels().first().map_or("", |(name, _)| name).to_string(),
            gpu,
        }
    }

    /// Several machines as one: what they do not have in common is listed.
    pub fn together(machines: &[Machine]) -> Self {
        let Some(first) = machines.first() else { return Machine::default() };
        let listed = |of: &dyn Fn(&Machine) -> String| {
            let mut values: Vec<String> = Vec::new();
            for value in machines.iter().map(of) {
                if !values.contains(&value) {
                    values.push(value);
                }
            }
            values.join("; ")
        };
        let gpu = listed(&|m| m.gpu.clone().unwrap_or_default());
        let gpu = gpu.trim_matches([';', ' ']);
        Machine {
            screendoor: listed(&|m| m.screendoor.clone()),
            processor: listed(&|m| m.processor.clone()),
            threads: first.threads,
            memory: machines.iter().filter_map(|m| m.memory).min(),
            system: listed(&|m| m.system.clone()),
            vectors: listed(&|m| m.vectors.clone()),
            gpu: (!gpu.is_empty()).then(|| gpu.to_string()),
        }
    }
}

/// The processor's name, where the system tells it.
pub fn processor() -> String {
    let name = told("/proc/cpuinfo", "model name");
    name.unwrap_or_else(|| std::env::consts::ARCH.to_string())
}

/// Bytes of memory, where the system tells.
fn memory() -> Option<u64> {
    let kilobytes = told("/proc/meminfo", "MemTotal")?;
    let number = kilobytes.split_whitespace().next()?.parse::<u64>().ok()?;
    number.checked_mul(1024)
}

/// The value of the first `name: value` in one of the system's files.
fn told(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.split_once(':'));
    line.map(|(_, value)| value.trim().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_machines_are_listed_once_each() {
        let machine = |processor: &str, gpu: Option<&str>| Machine {
            processor: processor.to_string(),
            gpu: gpu.map(str::to_string),
            ..Machine::default()
        };
        let all = [machine("a", None), machine("b", Some("g")), machine("a", None)];
        let one = Machine::together(&all);
        assert_eq!((one.processor.as_str(), one.gpu.as_deref()), ("a; b", Some("g")));
        assert_eq!(Machine::together(&all[..1]), all[0]);
        assert!(Machine::here(None).threads > 0);
    }
}
