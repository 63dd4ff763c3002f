//! The corpus of the fuzz targets: what they begin with, and what they found.

use std::fs;
use std::path::{Path, PathBuf};

use screendoor::picture::{Layer, Picture, write_exr};
use screendoor::tile::TileGrid;
use screendoor::trace::{Compression, Trace, WriteOptions};

use crate::hostile;
use crate::inputs::{INPUTS, named};
use crate::loaders::damage::good_files;
use crate::trace_file::unsealed;
use crate::util::{half_header as header, random_fragments, trace_bytes};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds")
}

#[test]
fn nothing_that_fuzzing_kept_does_harm() {
    for input in INPUTS {
        let (mut good, mut all) = (0, 0);
        for entry in fs::read_dir(folder().join(input.name)).expect(input.name) {
            let path = entry.unwrap().path();
            good += u32::from(input.take(&fs::read(&path).unwrap()));
            all += 1;
        }
        // The corpus is neither all good nor all bad.
        assert!(good > 0 && good < all, "{}: {good} of {all}", input.name);
    }
}

/// What a target begins with: by its name, files and their bytes.
fn seeds() -> Vec<(&'static str, String, Vec<u8>)> {
    let mut seeds = Vec::new();
    let mut add = |input: &'static str, name: &str, bytes: Vec<u8>| {
        seeds.push((input, name.to_string(), bytes));
    };
    let files = good_files();
    let materials = &files.iter().find(|(name, _)| *name == "a.mtl").unwrap().1;
    for (name, bytes) in &files {
        let ending = name.rsplit('.').next().unwrap();
        match INPUTS.iter().find(|i| i.name == ending) {
            Some(input) if ending == "obj" => {
                add(input.name, name, [&bytes[..], b"\0", materials].concat());
            }
            Some(input) => add(input.name, name, bytes.clone()),
            None if ending == "png" => add("picture", name, bytes.clone()),
            None => {}
        }
    }
    for (name, bytes) in hostile::files() {
        let ending = name.rsplit('.').next().unwrap();
        let input = if ending == "arrow" { "trace" } else { ending };
        if let Some(input) = INPUTS.iter().find(|i| i.name == input) {
            add(input.name, &format!("hostile-{name}"), bytes);
        }
    }
    for samples in [1, 8, 64] {
        let header = header(20, 20, samples);
        let fragments = random_fragments(&header, 9, samples);
        for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
            let name = |kind| format!("{kind}-{samples}-{compression:?}").to_lowercase();
            let options = WriteOptions { compression, batch_rows: 4 };
            add("trace", &name("sealed"), trace_bytes(&header, &fragments, options));
            add("trace", &name("foreign"), unsealed(&header, &fragments, compression));
        }
    }
    let study = |file: &str| fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    add("trace", "unaligned-footer", unaligned());
    add("study", "default", study("crates/study/src/study/default.toml"));
    add("study", "small", study("workflow/small.toml"));
    add("study", "none", Vec::new());
    add("picture", "short", vec![0x76, 0x2f, 0x31, 0x01]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let picture = Picture::new(TileGrid::new(3, 2), [0.5; 3]);
    write_exr(&path, &[Layer { name: "colour", picture: &picture }]).unwrap();
    add("picture", "a.exr", fs::read(path).unwrap());
    seeds
}

/// A trace whose footer the library cannot read, which it says in several lines: a bit of
/// it is flipped until that is so.
fn unaligned() -> Vec<u8> {
    let header = header(20, 20, 8);
    let good = unsealed(&header, &random_fragments(&header, 9, 8), Compression::None);
    let flipped = (good.len() - 4096.min(good.len())..good.len()).flat_map(|at| {
        let good = &good;
        (0..8).map(move |bit| {
            let mut bytes = good.clone();
            bytes[at] ^= 1 << bit;
            bytes
        })
    });
    let mut unaligned = flipped.filter(|bytes| {
        Trace::from_bytes(bytes.clone(), "a")
            .is_err_and(|e| e.to_string().contains("while verifying"))
    });
    unaligned.next().expect("some bit does it")
}

#[test]
fn errors_of_several_lines_become_one() {
    assert!(!named("trace").take(&unaligned()));
}

#[test]
#[ignore = "writes fuzz/seeds"]
fn write_fuzz_seeds() {
    for (input, name, bytes) in seeds() {
        let folder = folder().join(input);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join(name), bytes).unwrap();
    }
}
