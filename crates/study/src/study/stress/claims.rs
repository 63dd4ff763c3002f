//! Files that claim what they do not hold: how soon and with how little memory they are
//! refused.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use serde::Serialize;

use crate::study::stress::child::{Ended, command, run};
use screendoor_trace::error::{Error, Result};

/// Longest time that a refusal may take, in seconds.
pub const MOST_SECONDS: f64 = 0.1;

/// Most memory that it may take, in bytes.
pub const MOST_BYTES: u64 = 64 << 20;

/// A claim and how it was met.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The file.
    pub file: String,
    /// What it claims.
    pub what: String,
    /// What is said of it.
    pub message: String,
    /// How long that took.
    pub seconds: f64,
    /// The most memory that it took.
    pub bytes: u64,
    /// Whether it was refused with one clear error, in time and within its memory.
    pub held: bool,
}

macro_rules! hostile {
    ($($name:literal: $what:literal),+ $(,)?) => {
        [$(($name, $what, &include_bytes!(concat!("../../../../../traces/hostile/", $name))[..])),+]
    };
}

/// Times that each is tried; the quickest counts, on a machine that others use too.
const TRIES: usize = 5;

/// Gives each to `program`.
///
/// # Errors
/// [`Error::Io`] where the files cannot be written or the program not run.
pub(super) fn claims(program: &Path) -> Result<Vec<Claim>> {
    let made = png();
    let mut files: Vec<(&str, &str, &[u8])> = hostile![
        "many-rows.arrow": "a trace of 2^40 rows",
        "huge-frame.arrow": "a frame of 10^6 x 10^6 pixels",
        "bomb.arrow": "a compressed column of 2^61 bytes",
        "circle.gltf": "a node that is its own child",
        "doubling.gltf": "2^40 ways to one node",
        "sparse.gltf": "a sparse accessor of 10^12 zeros",
        "outside.gltf": "a buffer outside the scene's folder",
        "many.ply": "10^12 - 1 splats",
        "list.ply": "a face of 2^32 - 1 corners",
        "many.spz": "2^32 - 1 splats of degree 4",
        "bomb.spz": "a MiB that packs into a KiB",
        "many.hair": "2^26 points of hair",
        "many.tfx": "65025 points of hair",
        "metadata.vdb": "a name of 4 GiB",
    ]
    .to_vec();
    files.push(("bomb.png", "a picture of 16384 x 16384 pixels in 65 bytes", &made));
    let folder = tempfile::tempdir().map_err(|e| Error::io("create", std::env::temp_dir(), e))?;
    files
        .into_iter()
        .map(|(name, what, bytes)| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).map_err(|e| Error::io("write", &path, e))?;
            claim(program, &path, name, what)
        })
        .collect()
}

fn claim(program: &Path, path: &Path, name: &str, what: &str) -> Result<Claim> {
    let output = path.with_extension("out.arrow");
    let path: &OsStr = path.as_ref();
    let arguments: Vec<&OsStr> = match name.rsplit('.').next() {
        Some("arrow") => vec!["verify".as_ref(), path],
        Some("png") => vec!["compare".as_ref(), path, path],
        _ => vec!["capture".as_ref(), path, "-o".as_ref(), output.as_ref()],
    };
    let once = || run(&mut command(program, &arguments)).map_err(|e| Error::io("run", program, e));
    let ends = (0..TRIES).map(|_| once()).collect::<Result<Vec<Ended>>>()?;
    let seconds = ends.iter().map(|e| e.seconds).fold(f64::INFINITY, f64::min);
    let bytes = ends.iter().map(|e| e.peak).max().unwrap_or(0);
    let said = ends[0].said.trim_start_matches("screendoor: error: ");
    Ok(Claim {
        file: name.to_string(),
        what: what.to_string(),
        // Without the folder, which is another every time.
        message: said
            .rsplit_once(&format!("/{name}"))
            .map_or(said, |(_, rest)| rest)
            .trim_start_matches([':', ',', ' '])
            .to_string(),
        seconds,
        bytes,
        held: ends.iter().all(Ended::refused)
            && !output.exists()
            && seconds <= MOST_SECONDS
            && bytes <= MOST_BYTES,
    })
}

/// The head of a PNG of 16384 × 16384 pixels, and next to no data.
fn png() -> Vec<u8> {
    let side = 16384_u32.to_be_bytes();
    let head = [&side[..], &side, &[8, 2, 0, 0, 0]].concat();
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [kind, data].concat();
        [&(data.len() as u32).to_be_bytes()[..], &body, &crc32fast::hash(&body).to_be_bytes()]
            .concat()
    };
    // A zlib stream of nothing.
    let data = [0x78, 0x9c, 0x03, 0, 0, 0, 0, 1];
    [
        &b"\x89PNG\r\n\x1a\n"[..],
        &chunk(b"IHDR", &head),
        &chunk(b"IDAT", &data),
        &chunk(b"IEND", &[]),
    ]
    .concat()
}
