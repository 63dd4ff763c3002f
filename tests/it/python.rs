//! The Python of `docs/TRACE_FORMAT.md` and `docs/STUDIES.md` does what the documents say, and
//! FLIP is what its authors' Python package makes of the same pictures.

mod lk;
mod readers;

use std::path::Path;
use std::process::Command;

use screendoor::metrics::{Flip, FlipMap};
use screendoor::picture::Picture;
use screendoor::report::export::{arrow, json_lines};
use screendoor::study::record::Record;
use screendoor::trace::{Checksums, Trace, statistics};

use crate::util::{design, half_header as header, picture, random_fragments, trace_bytes};

fn document(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    std::fs::read_to_string(path).unwrap()
}

fn python_blocks(document: &str) -> Vec<String> {
    let blocks = document.split("```python\n").skip(1);
    blocks.map(|rest| rest.split("```").next().unwrap().to_string()).collect()
}

fn python() -> String {
    std::env::var("SCREENDOOR_PYTHON").unwrap_or("python3".into())
}

fn run(folder: &Path, program: &str) -> String {
    let output = Command::new(python()).args(["-c", program]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_document_shows_writing_and_reading() {
    assert_eq!(python_blocks(&document("TRACE_FORMAT.md")).len(), 4);
    assert_eq!(python_blocks(&document("STUDIES.md")).len(), 1);
}

#[test]
#[ignore = "needs python3 with pyarrow, numpy, duckdb, blake3 (SCREENDOOR_PYTHON names another)"]
fn pyarrow_writes_and_reads_traces() {
    let folder = tempfile::tempdir().unwrap();
    let blocks = python_blocks(&document("TRACE_FORMAT.md"));
    run(folder.path(), &blocks[0]);
    let path = folder.path().join("layers.arrow");
    let trace = Trace::open(&path).unwrap();
    assert!(!trace.is_sealed());
    trace.verify(|_| ()).unwrap();
    let stats = statistics(&trace, |_| ()).unwrap();
    assert_eq!((stats.fragments, stats.depth_complexity.max), (2 * 64 * 48, 2));
    // Near blue over far red, over black.
    let exact = picture(&design("exact"), &trace, 4, 0).get(10, 10);
    let half = |c: f32| f64::from(half::f16::from_f32(c).to_f32());
    let expected: [f64; 3] = std::array::from_fn(|i| {
        0.25 * half([0.1, 0.3, 1.0][i]) + 0.75 * 0.5 * half([1.0, 0.2, 0.1][i])
    });
    for (a, b) in exact.iter().zip(expected) {
        assert!((a - b).abs() < 1e-12, "{exact:?}");
    }
    let said = run(folder.path(), &blocks[1]);
    assert!(said.contains("two layers from Python 6144 fragments"), "{said}");

    // DuckDB is asked as the document says, and what is sealed as it says holds.
    let said = run(folder.path(), &blocks[2]);
    assert!(said.contains("3072") && said.contains("0.25"), "{said}");
    run(folder.path(), &blocks[3]);
    let sealed = Trace::open(folder.path().join("sealed.arrow")).unwrap();
    assert_eq!(sealed.checksums(), Checksums::All);
    assert_eq!(sealed.verify(|_| ()).unwrap(), trace.verify(|_| ()).unwrap());

    // The same reader opens what we write.
    let header = header(20, 20, 8);
    let fragments = random_fragments(&header, 500, 4);
    std::fs::write(&path, trace_bytes(&header, &fragments, Default::default())).unwrap();
    let said = run(folder.path(), &blocks[1]);
    let mean = fragments.iter().map(|f| f64::from(f.alpha)).sum::<f64>() / 500.0;
    assert!(said.contains("test 500 fragments"), "{said}");
    let found: f64 = said.rsplit(' ').next().unwrap().trim().parse().unwrap();
    assert!((found - mean).abs() < 1e-9, "{said}");
}

/// A record as a file of results has it.
fn record(design: &str, rmse: f64) -> Record {
    let e = serde_json::json!({"value": rmse, "low": null, "high": rmse * 1.1});
    let region = serde_json::json!({
        "seeds": 8, "pixels": 900, "rmse": e, "rmse_srgb": e, "mean": e, "max": 77.25,
        "variance": 1e-300, "bias_squared": null, "temporal": null,
    });
    let record = serde_json::json!({
        "id": format!("glass.8.{design}"), "scene": "glass", "trace": "é|,\"\n", "series": design,
        "design": design, "family": "stochastic", "samples": 8, "seeds": 8,
        "promises": {"unbiased": "distinct-depths", "consistent": "always", "same_picture": true,
            "same_expectation": "always", "seeded": false},
        "tied_fragments": 3,
        "fragments": (1_u64 << 53) + 1, "frame": region, "covered": region, "interior": region,
        "edges": region, "fine": e, "filtered": [{"sigma": 1.0, "rmse": e}], "flip": null,
        "flip_hdr": {"mean": e, "quartiles": [e, e, e]},
        "spectrum": {"frequency": [0.25, 0.5], "power": [0.1, rmse], "blueness": null},
        "events": {
            "fragments": 5, "samples_tested": 6, "samples_passed": 7, "samples_written": 8,
            "hashes": u64::MAX, "sorts_by_length": [0, 0, 3], "surfaces": 9,
            "layers_compared": 12, "multiplications": 13,
            "state_bits_read": 10, "state_bits_written": 11,
        },
        "state_bits": {"samples": 512, "extra": 42, "unbounded": false}, "passes": 1,
        "layout": "8 × (32 depth + 32 colour) + 42 made up",
        "touched_tiles": 12, "picture": "0", "speed": {"fast": {
            "seconds": {"low": 0.1, "median": 0.2, "high": 0.3}, "kernel": null,
            "same_bits": true, "missing": null,
        }},
    });
    serde_json::from_value(record).unwrap()
}

/// Holds each column of `results.arrow` to the same place in `results.jsonl`, and each place
/// there to a column.
const RESULTS: &str = r#"
import json, pyarrow as pa, pyarrow.ipc as ipc
table = ipc.open_file("results.arrow").read_all()
records = [json.loads(line) for line in open("results.jsonl", encoding="utf-8")]
types = {bool: pa.bool_(), int: pa.uint64(), float: pa.float64(), str: pa.string(),
         list: pa.list_(pa.float64())}
def leaves(value, name=""):
    nested = isinstance(value, list) and any(isinstance(v, dict) for v in value)
    if isinstance(value, dict) or nested:
        for key, v in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(v, f"{name}.{key}" if name else str(key))
    else:
        yield name, value
rows, seen = table.to_pylist(), 0
assert len(rows) == len(records)
for row, record in zip(rows, records):
    own = {name: value for name, value in leaves(record) if value not in (None, [])}
    for name, value in own.items():
        assert row[name] == value, (name, row[name], value)
        assert table.schema.field(name).type == types[type(value)], name
        seen += 1
    derived = {name for name, value in row.items() if value is not None} - set(own)
    assert derived == set("""state_bytes bytes_moved_per_fragment hashes_per_fragment
        comparators_per_fragment multiplications_per_fragment tied_share unbiased_here nanoseconds_per_fragment.fast.low
        nanoseconds_per_fragment.fast.median nanoseconds_per_fragment.fast.high""".split()), derived
print(seen)
"#;

#[test]
#[ignore = "needs python3 with pyarrow (SCREENDOOR_PYTHON names another interpreter)"]
fn pyarrow_reads_results() {
    let folder = tempfile::tempdir().unwrap();
    let mut records = [record("lk", 0.1 + 0.2), record("kbuffer:layers=8", 7.0)];
    records[1].filtered.clear();
    records[1].spectrum = None;
    std::fs::write(folder.path().join("results.arrow"), arrow(&records)).unwrap();
    std::fs::write(folder.path().join("results.jsonl"), json_lines(&records)).unwrap();
    let seen: usize = run(folder.path(), RESULTS).trim().parse().unwrap();
    assert!(seen > 150, "{seen}");
    let said = run(folder.path(), &python_blocks(&document("STUDIES.md"))[0]);
    assert_eq!(said.lines().count(), 2, "{said}");
    assert!(said.contains("'covered.rmse.value': 0.30000000000000004"), "{said}");
}

/// Reads two pictures, writes the map of FLIP's own evaluator.
const EVALUATOR: &str = r#"
import numpy as np, flip_evaluator
kind, width, height = open("kind").read().split()
read = lambda name: np.fromfile(name, "<f4").reshape(int(height), int(width), 3)
flip, mean, _ = flip_evaluator.evaluate(
    read("reference"), read("picture"), kind, inputsRGB=False, applyMagma=False)
np.asarray(flip, "<f4").tofile("map")
print(mean)
"#;

fn hold_to_the_evaluator(kind: &str, reference: &Picture, picture: &Picture, map: &FlipMap) {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    for (name, picture) in [("reference", reference), ("picture", picture)] {
        let pixel = |x, y| picture.get(x, y).map(|c| (c as f32).to_le_bytes()).concat();
        let row = |y| (0..picture.width()).flat_map(move |x| pixel(x, y));
        std::fs::write(place(name), (0..picture.height()).flat_map(row).collect::<Vec<u8>>())
            .unwrap();
    }
    let size = format!("{kind} {} {}", map.width(), map.height());
    std::fs::write(place("kind"), size).unwrap();
    let mean: f64 = run(folder.path(), EVALUATOR).trim().parse().unwrap();
    assert!((map.figures().mean - mean).abs() < 1e-5, "{kind}: {mean}, {:?}", map.figures());
    let theirs = std::fs::read(place("map")).unwrap();
    let theirs: Vec<f32> =
        theirs.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    assert_eq!(theirs.len(), map.values().len());
    let differences = map.values().iter().zip(&theirs).map(|(a, b)| (a - b).abs());
    let most = differences.fold(0.0, f32::max);
    println!("{kind}: mean {mean}, pixels differ by {most} at most");
    // Rounding of small differences is magnified by their powers.
    assert!(most < 1e-3, "{kind}: {most}");
}

#[test]
#[ignore = "needs python3 with flip-evaluator (SCREENDOOR_PYTHON names another interpreter)"]
fn flip_is_its_authors_evaluators() {
    for name in ["glass", "hair", "foliage", "layers"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("traces/{name}.arrow"));
        let trace = Trace::open(&path).unwrap();
        let reference = picture(&design("exact"), &trace, 8, 0);
        let noisy = picture(&design("lk"), &trace, 8, 1);
        let flip = Flip::new(&reference);
        hold_to_the_evaluator("LDR", &reference, &noisy, &flip.ldr(&noisy));
        // The same with highlights: from 0 up to some 30.
        let brighten = |p: &Picture| p.zip(p, |a, _| a.map(|c| c + 30.0 * c.powi(4)));
        let (reference, noisy) = (brighten(&reference), brighten(&noisy));
        hold_to_the_evaluator("HDR", &reference, &noisy, &Flip::new(&reference).hdr(&noisy));
    }
}
