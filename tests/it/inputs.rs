//! What is done with hostile bytes: by the fuzz targets, and by the test that holds every
//! file of the corpus to the same.

use std::fs;
use std::sync::OnceLock;

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::configure;
use screendoor::error::{Error, Result};
use screendoor::rop::ReplayOptions;
use screendoor::scene::{Scene, load};
use screendoor::study::file::Study;
use screendoor::trace::Trace;
use tempfile::TempDir;

/// A way in for bytes that others wrote.
#[derive(Clone, Copy)]
pub struct Input {
    /// Its name: of the target and of the folder of its corpus.
    pub name: &'static str,
    take: fn(&[u8]) -> Result<()>,
}

/// All of them.
pub const INPUTS: [Input; 13] = [
    Input { name: "trace", take: trace },
    Input { name: "study", take: study },
    Input { name: "gltf", take: |bytes| scene("gltf", bytes) },
    Input { name: "glb", take: |bytes| scene("glb", bytes) },
    Input { name: "obj", take: obj },
    Input { name: "ply", take: |bytes| scene("ply", bytes) },
    Input { name: "splat", take: |bytes| scene("splat", bytes) },
    Input { name: "spz", take: |bytes| scene("spz", bytes) },
    Input { name: "stl", take: |bytes| scene("stl", bytes) },
    Input { name: "hair", take: |bytes| scene("hair", bytes) },
    Input { name: "tfx", take: |bytes| scene("tfx", bytes) },
    Input { name: "vdb", take: |bytes| scene("vdb", bytes) },
    Input { name: "picture", take: picture },
];

/// The one of that name.
///
/// # Panics
/// Where there is none.
pub fn named(name: &str) -> Input {
    *INPUTS.iter().find(|input| input.name == name).expect("a target's name")
}

impl Input {
    /// Takes the bytes as the program would. Returns whether they were good.
    ///
    /// # Panics
    /// Where they do what no bytes may: an error of several lines or of none, a picture
    /// with a NaN.
    pub fn take(&self, bytes: &[u8]) -> bool {
        let Err(error) = (self.take)(bytes) else { return true };
        let text = error.to_string();
        assert!(!text.is_empty() && !text.contains('\n'), "{}: {text:?}", self.name);
        false
    }
}

/// Fragments and pixels beyond which a good input is not drawn, which takes its time.
const MOST: u64 = 1 << 12;

fn trace(bytes: &[u8]) -> Result<()> {
    let trace = Trace::from_bytes(bytes.to_vec(), "fuzz")?;
    trace.verify(|_| ())?;
    let header = trace.header();
    let pixels = u64::from(header.width) * u64::from(header.height);
    if trace.rows() > MOST || pixels > MOST {
        return Ok(());
    }
    for design in ["exact", "lk"] {
        let design = configure(design, &[])?;
        let replayed =
            design.replay(&trace, header.pattern.samples(), 0, &ReplayOptions::default())?;
        // What does not fit is announced; a NaN would not be.
        assert_eq!(replayed.picture.not_finite(), 0);
    }
    Ok(())
}

fn study(bytes: &[u8]) -> Result<()> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| Error::invalid("fuzz", "it is no text", "write a study"))?;
    let study = Study::parse(text, "fuzz")?;
    // What is written down again is the same study.
    let again = Study::parse(&study.to_toml(), "fuzz")?;
    assert_eq!(again.to_toml(), study.to_toml());
    Ok(())
}

fn folder() -> &'static TempDir {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    // In memory where the system has a place for that.
    FOLDER.get_or_init(|| {
        tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
    })
}

fn put(name: &str, bytes: &[u8]) -> String {
    let path = folder().path().join(name);
    fs::write(&path, bytes).expect("written");
    path.display().to_string()
}

fn scene(ending: &str, bytes: &[u8]) -> Result<()> {
    draw(&load(&put(&format!("a.{ending}"), bytes))?)
}

/// An OBJ file and, behind a zero byte, the materials that it may name.
fn obj(bytes: &[u8]) -> Result<()> {
    let cut = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    let (file, materials) = bytes.split_at(cut);
    put("a.mtl", materials.get(1..).unwrap_or_default());
    scene("obj", file)
}

/// What is loaded is drawn.
fn draw(scene: &Scene) -> Result<()> {
    if scene.primitive_count() as u64 > MOST {
        return Ok(());
    }
    let options = CaptureOptions { width: 8, height: 8, samples: 4, ..CaptureOptions::default() };
    let trace = Capture::new(scene, &options)?.to_memory(|_, _| ())?;
    trace.verify(|_| ())?;
    Ok(())
}

fn picture(bytes: &[u8]) -> Result<()> {
    let ending = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) { "exr" } else { "png" };
    screendoor::picture::read(put(&format!("a.{ending}"), bytes), None).map(|_| ())
}
