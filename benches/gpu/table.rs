//! The documents of a run put together, beside what the device's peaks allow.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::peaks::Peaks;

/// Runs of `screendoor throughput`: name, and what a thread is given.
const RUNS: [(&str, &str); 3] = [("all", "pixel"), ("pixel", "pixel"), ("sample", "sample")];

/// All that is known of a device.
#[derive(Serialize)]
struct Document {
    fragments: u64,
    peaks: Peaks,
    /// Watts on average over each run of `throughput`, its reading and uploading included.
    watts: Vec<Option<f64>>,
    results: Vec<Line>,
}

/// A design at a sample count.
#[derive(Serialize)]
struct Line {
    run: &'static str,
    threads: &'static str,
    design: String,
    samples: u64,
    /// Fragments drawn, over all passes.
    drawn: f64,
    /// Bytes that must move for each of them: columns, and state once a pass.
    bytes: f64,
    /// 32-bit integer operations for each, where they have been counted.
    operations: Option<f64>,
    /// Seconds as `throughput` gives them: medians and quartiles.
    kernel: Value,
    bin: Value,
    upload: Value,
    whole: Value,
}

impl Line {
    fn rate(&self) -> Option<f64> {
        Some(self.drawn / self.kernel["median"].as_f64()?)
    }

    /// Fragments a second that the peaks allow: by bytes, and by operations.
    fn bounds(&self, peaks: &Peaks) -> [Option<f64>; 2] {
        [Some(peaks.copy / self.bytes), self.operations.map(|count| peaks.xor_add / count)]
    }
}

/// Operations of a fragment by count of the shaders' text; `None` where nobody has counted.
/// `docs/PERFORMANCE.md` says of what they are.
fn operations(design: &str, samples: u64) -> Option<f64> {
    let n = samples as f64;
    let places = if samples <= 16 { 2.0 * n * (n - 1.0) + 4.0 * n } else { 4.0 * n * n };
    let hashes = if samples <= 8 { 50.0 + 6.0 * n } else { 12.0 * n };
    (design == "lk").then_some(18.0 * n + places + hashes + 40.0)
}

/// Writes `OUT.json` and `OUT.md`.
pub fn write(folder: &Path, out: &str) -> Result<(), String> {
    let read = |name: &str| {
        let path = folder.join(name);
        fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let peaks = serde_json::from_str(&read("peaks.json")?).map_err(|e| e.to_string())?;
    let mut document = Document { fragments: 0, peaks, watts: Vec::new(), results: Vec::new() };
    for (run, threads) in RUNS {
        let text = read(&format!("{run}.json"))?;
        let found: Value = serde_json::from_str(&text).map_err(|e| format!("{run}: {e}"))?;
        document.fragments = found["rows"].as_u64().unwrap_or(0);
        let results = found["results"].as_array().ok_or(format!("{run}: there are no results"))?;
        document.results.extend(results.iter().filter_map(|result| line(run, threads, result)));
        document.watts.push(mean(&read(&format!("{run}.watts"))?));
    }
    let json = serde_json::to_string_pretty(&document).expect("it is numbers and names") + "\n";
    for (ending, text) in [("json", json), ("md", markdown(&document))] {
        let name = format!("{out}.{ending}");
        fs::write(&name, text).map_err(|e| format!("{name}: {e}"))?;
    }
    Ok(())
}

fn line(run: &'static str, threads: &'static str, result: &Value) -> Option<Line> {
    let passes = result["passes"].as_u64()?;
    let drawn = (result["fragments"].as_u64()? * passes) as f64;
    let (design, samples) = (result["design"].as_str()?.to_string(), result["samples"].as_u64()?);
    let of = |name: &str| result[name].clone();
    Some(Line {
        run,
        threads,
        samples,
        drawn,
        bytes: result["bytes"].as_f64()? / drawn,
        operations: operations(&design, samples),
        design,
        kernel: of("kernel"),
        bin: of("bin"),
        upload: of("upload"),
        whole: of("whole"),
    })
}

/// The mean of numbers, a line each.
fn mean(lines: &str) -> Option<f64> {
    let all: Vec<f64> = lines.lines().filter_map(|line| line.trim().parse().ok()).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

/// A figure, or that there is none.
fn shown(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_string(), |v| format!("{v:.decimals$}"))
}

fn milliseconds(spread: &Value) -> String {
    let [low, median, high] = ["low", "median", "high"].map(|at| spread[at].as_f64());
    let ms = |value: Option<f64>| shown(value.map(|v| v * 1e3), 1);
    format!("{} ({} to {})", ms(median), ms(low), ms(high))
}

fn markdown(document: &Document) -> String {
    let Document { fragments, peaks, watts, results } = document;
    let mut text = String::new();
    let mut put = |line: &str| writeln!(text, "{line}").expect("strings can be written to");
    put(&format!("{}, {:.2} million fragments.\n", peaks.adapter, *fragments as f64 / 1e6));
    put("| peak | measured |\n|---|---:|");
    for (name, value, unit) in [
        ("read", peaks.read, "GB/s"),
        ("read and written", peaks.copy, "GB/s"),
        ("brought to the device", peaks.upload, "GB/s"),
        ("32-bit multiplications and additions", peaks.multiply_add, "billion/s"),
        ("32-bit exclusive ors and additions", peaks.xor_add, "billion/s"),
    ] {
        put(&format!("| {name} | {:.1} {unit} |", value / 1e9));
    }
    for ((run, _), watts) in RUNS.iter().zip(watts) {
        put(&format!("| power while '{run}' ran | {} W |", shown(*watts, 0)));
    }
    put("\n| a thread a | design | samples | kernel, ms | M frag/s | bytes | allow M frag/s \
         | operations | allow M frag/s | of the lower | sorting, ms | upload, ms | whole, ms |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    for line in results {
        let rate = line.rate();
        let [by_bytes, by_operations] = line.bounds(peaks);
        let lower = by_bytes.map(|bytes| by_operations.unwrap_or(bytes).min(bytes));
        let share = rate.zip(lower).map(|(rate, lower)| 100.0 * rate / lower);
        let million = |value: Option<f64>| shown(value.map(|v| v / 1e6), 1);
        let cells = [
            line.threads.to_string(),
            format!("`{}`", line.design),
            line.samples.to_string(),
            milliseconds(&line.kernel),
            million(rate),
            shown(Some(line.bytes), 0),
            million(by_bytes),
            shown(line.operations, 0),
            million(by_operations),
            shown(share, 1) + " %",
            milliseconds(&line.bin),
            milliseconds(&line.upload),
            milliseconds(&line.whole),
        ];
        put(&format!("| {} |", cells.join(" | ")));
    }
    text
}
