//! The Python of `docs/TRACE_FORMAT.md` does what the document says.

use std::path::Path;
use std::process::Command;

use screendoor::trace::{Trace, statistics};

use crate::util::{design, header, picture, random_fragments, trace_bytes};

fn document() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/TRACE_FORMAT.md");
    std::fs::read_to_string(path).unwrap()
}

fn python_blocks(document: &str) -> Vec<String> {
    let blocks = document.split("```python\n").skip(1);
    blocks.map(|rest| rest.split("```").next().unwrap().to_string()).collect()
}

fn run(folder: &Path, program: &str) -> String {
    let python = std::env::var("SCREENDOOR_PYTHON").unwrap_or("python3".into());
    let output = Command::new(python).args(["-c", program]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_document_shows_writing_and_reading() {
    assert_eq!(python_blocks(&document()).len(), 2);
}

#[test]
#[ignore = "needs python3 with pyarrow and numpy (SCREENDOOR_PYTHON names another interpreter)"]
fn pyarrow_writes_and_reads_traces() {
    let folder = tempfile::tempdir().unwrap();
    let blocks = python_blocks(&document());
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
