//! The Python of `docs/TRACE_FORMAT.md` does what the document says, and FLIP is what its
//! authors' Python package makes of the same pictures.

use std::path::Path;
use std::process::Command;

use screendoor::metrics::{Flip, FlipMap};
use screendoor::picture::Picture;
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
