//! A study's scenes with shadows: the camera's and the light's traces, which several scenes share, and
//! the camera's shaded by a design.

use std::path::Path;

use crate::study::file::{SceneEntry, ShadowEntry};
use crate::study::results::ShadowFacts;
use crate::study::run::store::Store;
use crate::study::shadows::Shade;
use screendoor_rop::ReplayOptions;
use screendoor_scene::capture::Capture;
use screendoor_scene::scene::Scene;
use screendoor_trace::edit::{Edit, write};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::OutputFile;
use screendoor_trace::param::Options as _;
use screendoor_trace::trace::{Header, Trace, TraceWriter, WriteOptions};

/// Writes a trace, whole or not at all. Returns how many fragments it has.
///
/// # Errors
/// As `draw`; [`Error::Io`].
pub(super) fn put_trace(
    path: &Path,
    header: &Header,
    draw: impl FnOnce(&mut TraceWriter<OutputFile>) -> Result<()>,
) -> Result<u64> {
    let file = OutputFile::create(path)?;
    let place = path.display().to_string();
    let mut writer = TraceWriter::new(file, &place, header.clone(), WriteOptions::default())?;
    draw(&mut writer)?;
    let (file, written) = writer.finish()?;
    file.commit()?;
    Ok(written.rows)
}

/// Draws a scene with the shadows of its light into the trace at `path`. Returns how many fragments
/// it has, and what was found of the shadows.
///
/// # Errors
/// As [`Capture::draw`] and [`Shade::new`].
pub(super) fn shaded(
    store: &Store,
    entry: &SceneEntry,
    shadow: &ShadowEntry,
    (scene, capture): (&Scene, &Capture<'_>),
    path: &Path,
) -> Result<(u64, ShadowFacts)> {
    let folder = store.folder().join("shadows");
    let [width, height] = shadow.size;
    let Some(of_light) = capture.of_light(shadow.size) else {
        return Err(Error::config("a shadow without a light", "give the scene a light"));
    };
    let kept = |name: &str, capture: &Capture<'_>| {
        let path = folder.join(format!("{name}.arrow"));
        if !path.exists() {
            put_trace(&path, capture.header(), |w| capture.draw(w, |_, _| ()))?;
        }
        Trace::open(&path)
    };
    let base = unshaded(entry);
    let camera = kept(&format!("{base}-camera"), capture)?;
    let light = Capture::new(scene, &of_light)?;
    let light = kept(&format!("{base}-light-{width}x{height}"), &light)?;
    let options = shadow.options()?;
    let memory = store.study().memory << 20;
    let replay = ReplayOptions { memory, ..ReplayOptions::default() };
    let shade = Shade::new(&camera, &light, &options, &replay)?;
    let rows = put_trace(path, shade.header(), |w| write(&shade, w, &mut |_, _| ()))?;
    let content = |trace: &Trace| match trace.content() {
        Some(content) => Ok(content.to_string()),
        None => trace.verify(|_| ()),
    };
    let Some(error) = shade.error() else { unreachable!("errors of a study's shadows are taken") };
    let facts = ShadowFacts {
        source: camera.header().source.clone(),
        camera: content(&camera)?,
        light: content(&light)?,
        size: shadow.size,
        series: shadow.design.all()[0].clone(),
        design: options.design.label(),
        family: options.design.info().family.name().to_string(),
        samples: options.samples,
        rounds: options.rounds,
        pcf: options.filter.taps,
        cost: shade.cost(),
        error,
    };
    Ok((rows, facts))
}

/// A name for what a scene is without its shadows: scenes that differ in these alone share it.
fn unshaded(entry: &SceneEntry) -> String {
    let same = SceneEntry { name: String::new(), pixel: None, shadow: None, ..entry.clone() };
    let text = toml::to_string(&same).expect("a scene's fields are values that TOML has");
    blake3::hash(text.as_bytes()).to_hex()[..16].to_string()
}
