//! What several tests share.

use std::collections::{HashMap, VecDeque};
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use screendoor::design::{Configured, DESIGNS, Entry};
use screendoor::error::Error;
use screendoor::gpu::Gpu;
use screendoor::param::{Kind, parse_spec};
use screendoor::picture::Picture;
use screendoor::random::Stream;
use screendoor::rop::{ReplayOptions, colour};
use screendoor::trace::{
    ColourFormat, DepthPlane, Fragment, Header, Projection, SampleMask, SamplePattern, Trace,
    TraceWriter, Unorm32, View, WriteOptions,
};

/// As [`header`], with colours in half precision, as captures have them by default.
pub fn half_header(width: u32, height: u32, samples: u32) -> Header {
    Header { colour: ColourFormat::F16, ..header(width, height, samples) }
}

/// A view for tests: over a wide range, so that view depths differ much.
pub fn view() -> View {
    let (near, far) = (0.5, 200.0);
    let (scale, offset) = (-far / (far - near), -far * near / (far - near));
    View {
        projection: Projection::Perspective,
        near,
        far,
        world_to_view: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.],
        view_to_clip: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., scale, -1., 0., 0., offset, 0.],
    }
}

/// A header for tests: `samples` samples at made-up places, black background, and a view,
/// which some parameters ask for.
pub fn header(width: u32, height: u32, samples: u32) -> Header {
    let positions = (0..samples as i32).map(|s| [(s % 8 * 2 - 8) as i8, (s / 8 * 2 - 8) as i8]);
    Header {
        width,
        height,
        pattern: SamplePattern {
            name: "test".into(),
            positions: positions.collect(),
            nested: true,
        },
        background: [0.0; 3],
        // So wide that no design rounds colours: what narrower ones do is tested apart.
        colour: ColourFormat::F32,
        source: "test".into(),
        camera: "none".into(),
        view: Some(view()),
        ..Header::default()
    }
}

/// `count` fragments with everything random, within the rules of `header`.
pub fn random_fragments(header: &Header, count: usize, seed: u32) -> Vec<Fragment> {
    let samples = header.pattern.samples();
    let mut random = Stream::new([0x7e57, seed]);
    let mut fragment = |i: usize| {
        let coverage = loop {
            let bits = u64::from(random.word()) << 32 | u64::from(random.word());
            let mask = SampleMask(bits) & SampleMask::first(samples);
            if !mask.is_empty() {
                break mask;
            }
        };
        Fragment {
            x: random.below(header.width) as u16,
            y: random.below(header.height) as u16,
            coverage,
            depth: DepthPlane {
                z: Unorm32(random.word()),
                dzdx: random.word() as i32 >> 8,
                dzdy: random.word() as i32 >> 8,
            },
            colour: [random.unit(), random.unit(), random.unit()],
            alpha: random.unit(),
            primitive: i as u32,
            object: i as u32 / 100,
            ..Fragment::default()
        }
    };
    (0..count).map(&mut fragment).collect()
}

/// The bytes of a trace file that holds `fragments`.
pub fn trace_bytes(header: &Header, fragments: &[Fragment], options: WriteOptions) -> Vec<u8> {
    let mut writer = TraceWriter::new(Vec::new(), "test", header.clone(), options).unwrap();
    for fragment in fragments {
        writer.push(fragment).unwrap();
    }
    writer.finish().unwrap().0
}

/// A trace that holds `fragments`, in memory.
pub fn trace(header: &Header, fragments: &[Fragment]) -> Trace {
    let bytes = trace_bytes(header, fragments, WriteOptions::default());
    Trace::from_bytes(bytes, "test").unwrap()
}

/// Every design of the registry with its defaults, and with each of its
/// parameters changed alone to each of its other values (the ends of a range), and
/// with the combinations that it names.
pub fn all_variants() -> Vec<Configured> {
    DESIGNS.iter().flat_map(variants).collect()
}

/// The variants of one design.
pub fn variants(entry: &Entry) -> Vec<Configured> {
    let mut settings: Vec<Vec<(String, String)>> = vec![Vec::new()];
    // The width of stored colours rounds, whatever is promised: tests/it/colour.rs.
    for param in entry.info.params.iter().filter(|p| p.name != colour::PARAM.param.name) {
        let values: Vec<String> = match param.kind {
            Kind::Flag => vec!["true".into(), "false".into()],
            Kind::Choice { options } => options.iter().map(|o| o.name.into()).collect(),
            Kind::Integer { min, max } => vec![min.to_string(), max.to_string()],
            Kind::Real { min, max } => vec![min.to_string(), max.to_string()],
        };
        let changed = values.into_iter().filter(|v| v != param.default);
        settings.extend(changed.map(|v| vec![(param.name.to_string(), v)]));
    }
    for combination in entry.info.combinations {
        settings.push(parse_spec(&format!(":{combination}")).unwrap().1);
    }
    settings.iter().map(|given| entry.configure(given).unwrap()).collect()
}

/// The design of a spec such as `lk:sort=false`.
pub fn design(spec: &str) -> Configured {
    screendoor::design::configure(spec, &[]).unwrap()
}

/// The picture of `design` on `trace`.
pub fn picture(design: &Configured, trace: &Trace, samples: u32, seed: u32) -> Picture {
    design.replay(trace, samples, seed, &ReplayOptions::default()).unwrap().picture
}

/// A trace of `layers` fragments over every pixel of the frame, whole, one layer
/// after the other from the first on; `layer` gives depth, colour and alpha.
pub fn layered(
    header: &Header,
    layers: u32,
    layer: impl Fn(u32) -> (u32, [f32; 3], f32),
) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    for i in 0..layers {
        let (z, colour, alpha) = layer(i);
        for y in 0..header.height as u16 {
            for x in 0..header.width as u16 {
                fragments.push(Fragment {
                    x,
                    y,
                    coverage: SampleMask::first(header.pattern.samples()),
                    depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
                    colour,
                    alpha,
                    primitive: i,
                    object: i,
                    ..Fragment::default()
                });
            }
        }
    }
    fragments
}

/// Colours that a sum of several of them, in single precision, is rounded away from, and the
/// ends of what a trace can hold.
pub const AWKWARD: [f32; 5] = [0.1, 1.0 / 3.0, 0.7, 1e-38, 65504.0];

/// Three tiles over a background: in the first one a transparent fragment that covers a
/// part of a pixel and an opaque one elsewhere, in the others nothing.
pub fn nearly_bare(samples: u32, background: [f32; 3]) -> Trace {
    let header = Header { background, colour: ColourFormat::F32, ..header(48, 8, samples) };
    let fragment = |x: u16, alpha: f32| Fragment {
        x,
        y: 2,
        coverage: SampleMask::first(samples.div_ceil(2)),
        depth: DepthPlane { z: Unorm32(1 << 30), dzdx: 0, dzdy: 0 },
        colour: [1.0, 0.5, 0.25],
        alpha,
        primitive: u32::from(x),
        object: 0,
        ..Fragment::default()
    };
    trace(&header, &[fragment(3, 0.5), fragment(5, 1.0)])
}

/// The pixels of a picture of [`nearly_bare`] that no fragment covers and that are not the
/// background, bit for bit.
pub fn not_bare(picture: &Picture, background: [f32; 3]) -> Vec<(u32, u32, [f64; 3])> {
    let bits = |colour: [f64; 3]| colour.map(f64::to_bits);
    let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    let bare = pixels.filter(|at| ![(3, 2), (5, 2)].contains(at));
    bare.map(|(x, y)| (x, y, picture.get(x, y)))
        .filter(|(_, _, colour)| bits(*colour) != bits(background.map(f64::from)))
        .collect()
}

/// The fragments of `order`, which holds those of `api` in another order, with those of a
/// pixel that share a plane in the sequence that they have in `api`: of these the last lies
/// in front in the exact picture, too.
pub fn in_sequence_at_equal_depths(api: &[Fragment], order: Vec<Fragment>) -> Vec<Fragment> {
    let place = |f: &Fragment| (f.x, f.y, f.depth.z.0, f.depth.dzdx, f.depth.dzdy);
    let mut waiting: HashMap<_, VecDeque<Fragment>> = HashMap::new();
    for f in api {
        waiting.entry(place(f)).or_default().push_back(*f);
    }
    let next = |f: Fragment| waiting.get_mut(&place(&f)).and_then(VecDeque::pop_front);
    order.into_iter().filter_map(next).collect()
}

/// The GPU, opened once. Where there is none, the tests that ask for it are skipped, and
/// counted so; with `SCREENDOOR_GPU=require` they fail.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Result<Gpu, Error>> = OnceLock::new();
    static SKIPPED: AtomicUsize = AtomicUsize::new(0);
    match GPU.get_or_init(|| Gpu::open(None)) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            let required = std::env::var_os("SCREENDOOR_GPU").is_some_and(|v| v == "require");
            assert!(!required, "SCREENDOOR_GPU=require, but: {error}");
            let skipped = SKIPPED.fetch_add(1, Ordering::Relaxed) + 1;
            // Not by the macro, of which a passed test's words are not shown.
            let said = format!("skipped GPU tests: {skipped} ({error})\n");
            std::io::stderr().write_all(said.as_bytes()).unwrap();
            None
        }
    }
}

/// Nodes of a glTF file, each within the one before and as large as a number there can make
/// it, the last of them `leaf`: together too large for double precision.
pub fn endlessly_scaled(leaf: serde_json::Value) -> serde_json::Value {
    let outer = |i: usize| serde_json::json!({ "scale": [3e38, 1.0, 1.0], "children": [i + 1] });
    (0..9).map(outer).chain([leaf]).collect()
}
