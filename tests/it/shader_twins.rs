//! What `append.glsl` and `append.hlsl` record under plain Vulkan is what `append.wgsl` records
//! under wgpu, bit for bit, through the examples of `docs/capture`.
//!
//! They need a compiler of C with Vulkan's headers and loader, and `glslangValidator`; without
//! them they are skipped and say so, and fail with `SCREENDOOR_CC=require`. HLSL is compiled by
//! dxc, of which a package of Python's brings a copy.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use screendoor::gpu::capture::{Captured, FragmentBuffer, RawFragment, append_wgsl};
use screendoor::random::Stream;
use screendoor::trace::{Fragment, Trace};

use crate::c_header::{absent, compiler, place};
use crate::gpu_capture::{draw_on, foreign};

/// The size of the examples' frame.
const FRAME: [u32; 2] = [320, 240];

const TRIANGLES_WGSL: &str = "
    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) @interpolate(flat) triangle: u32,
        @location(1) @interpolate(flat) colour: vec4<f32>,
    }

    @vertex
    fn corner(
        @builtin(vertex_index) index: u32,
        @location(0) place: vec4<f32>,
        @location(1) colour: vec4<f32>,
    ) -> Corner {
        return Corner(place, index / 3u, colour);
    }

    @fragment
    fn record(in: Corner, @builtin(sample_mask) coverage: u32) -> @location(0) vec4<f32> {
        let depth = captured_depth(in.position);
        append_fragment(in.position, depth, coverage, in.triangle, 0u, in.colour);
        return in.colour;
    }";

/// Triangles of all sizes, some cut by the frame, the near and the far plane, some seen from
/// behind: enough for the examples' buffer to be too small at first.
fn corners() -> Vec<[f32; 8]> {
    let mut random = Stream::new([0x7419]);
    let mut corners = Vec::new();
    for _ in 0..150 {
        let colour = [(); 4].map(|()| random.unit());
        let [x, y] = [(); 2].map(|()| random.range(-1.1, 1.1));
        for _ in 0..3 {
            let w = random.range(0.5, 2.0);
            let [dx, dy] = [(); 2].map(|()| random.range(-0.4, 0.4));
            let z = random.range(-0.1, 1.1);
            let at = [(x + dx) * w, (y + dy) * w, z * w, w];
            corners.push([at[0], at[1], at[2], at[3], colour[0], colour[1], colour[2], colour[3]]);
        }
    }
    corners
}

/// What wgpu captures of them.
fn by_wgpu(corners: &[[f32; 8]]) -> Option<Vec<RawFragment>> {
    let (device, queue) = foreign()?;
    let source = append_wgsl(1) + TRIANGLES_WGSL;
    let fragments = FragmentBuffer::new(&device, 1 << 20).unwrap();
    draw_on((&device, &queue), &source, FRAME, corners, &fragments);
    match fragments.read(&device, &queue).unwrap() {
        Captured::All(all) => Some(all),
        Captured::TooMany(many) => panic!("{many} fragments"),
    }
}

/// The example in C, with the corners in a file beside it.
struct Example {
    folder: tempfile::TempDir,
    corners: Vec<[f32; 8]>,
}

impl Example {
    fn build() -> Option<Self> {
        const FOR: &str = "the shaders' twins";
        let cc = compiler("CC", "cc", FOR)?;
        compiler("GLSLANG", "glslangValidator", FOR)?;
        let folder = tempfile::tempdir().unwrap();
        let probe = folder.path().join("probe.c");
        fs::write(&probe, "#include <vulkan/vulkan.h>\nint main(void) { return 0; }\n").unwrap();
        let mut has_vulkan = Command::new(&cc);
        has_vulkan.arg(&probe).args(["-lvulkan", "-o"]).arg(folder.path().join("probe"));
        if !has_vulkan.output().unwrap().status.success() {
            absent("header or loader of Vulkan", FOR);
            return None;
        }
        let output = Command::new(cc)
            .args(["-std=c99", "-O1", "-Wall", "-Wextra", "-Wno-missing-field-initializers"])
            .arg("-Werror")
            .arg("-I")
            .arg(place("crates/trace/include"))
            .arg(place("docs/capture/vulkan.c"))
            .arg("-lvulkan")
            .arg("-o")
            .arg(folder.path().join("vulkan"))
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let corners = corners();
        let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        fs::write(folder.path().join("corners"), bytes).unwrap();
        Some(Example { folder, corners })
    }

    /// Compiles a shader of `docs/capture` from GLSL.
    fn glsl(&self, name: &str) -> PathBuf {
        let path = self.folder.path().join(format!("{name}.spv"));
        let include = format!("-I{}", place("crates/gpu/src/shaders").display());
        let output = Command::new(std::env::var("GLSLANG").unwrap_or("glslangValidator".into()))
            .args(["-V", &include])
            .arg(place("docs/capture").join(name))
            .arg("-o")
            .arg(&path)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        path
    }

    /// Draws, and reads the trace that it writes.
    fn draw(&self, shaders: [&Path; 2], corners: bool) -> Vec<Fragment> {
        let mut command = Command::new(self.folder.path().join("vulkan"));
        command.args(shaders).arg("out.arrow").current_dir(self.folder.path());
        if corners {
            command.arg("corners");
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let trace = Trace::open(self.folder.path().join("out.arrow")).unwrap();
        trace.verify(|_| ()).unwrap();
        assert_eq!((trace.header().width, trace.header().height), (FRAME[0], FRAME[1]));
        trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
    }
}

/// What a trace holds of raw fragments: colours in half precision.
fn expected(raw: &[RawFragment]) -> Vec<Fragment> {
    let half = |c: f32| half::f16::from_f32(c).to_f32();
    let fragment = |raw: &RawFragment| {
        let fragment = raw.fragment();
        Fragment { colour: fragment.colour.map(half), ..fragment }
    };
    raw.iter().map(fragment).collect()
}

#[test]
fn glsl_records_what_wgsl_records() {
    let Some(example) = Example::build() else { return };
    let Some(raw) = by_wgpu(&example.corners) else { return };
    assert!(raw.len() > 100_000 && raw.iter().any(|raw| raw.coverage != 0xf));
    let shaders = ["triangles.vert", "triangles.frag"].map(|name| example.glsl(name));
    let found = example.draw(shaders.each_ref().map(|path| &**path), true);
    assert!(found == expected(&raw), "{} and {} fragments", found.len(), raw.len());
    // The example's own triangles, as its reader runs it.
    let own = example.draw(shaders.each_ref().map(|path| &**path), false);
    assert!(own.iter().any(|f| f.primitive == 2) && own.len() > 50_000);
}

/// Compiles HLSL by the dxc that `compushady` brings along: to DXIL, as Direct3D takes it, and
/// to SPIR-V.
const DXC: &str = "
import ctypes, glob, importlib.util, os, pathlib, sys
folder = os.path.dirname(importlib.util.find_spec('compushady').origin) + '/backends'
ctypes.CDLL(glob.glob(folder + '/libdxcompiler*')[0], ctypes.RTLD_GLOBAL)
from compushady.backends import dxc
text = pathlib.Path(sys.argv[1]).read_text()
append = pathlib.Path(sys.argv[2]).read_text()
text = text.replace('#include \"append.hlsl\"', append)
def compiled(text, entry, kind, target):
    made = dxc.compile(text, entry, kind, target)
    return made[0] if isinstance(made, tuple) else made

for entry, target, file in [('corner', 'vs_6_0', 'corner.spv'), ('record', 'ps_6_0', 'record.spv')]:
    assert len(compiled(text, entry, 0, target)) > 1000
    # The example looks for main.
    words = compiled(text.replace(' ' + entry + '(', ' main('), 'main', 1, target)
    pathlib.Path(file).write_bytes(words)
";

#[test]
#[ignore = "needs python3 with compushady (SCREENDOOR_PYTHON names another)"]
fn hlsl_records_what_wgsl_records() {
    let Some(example) = Example::build() else { return };
    let Some(raw) = by_wgpu(&example.corners) else { return };
    let output = Command::new(std::env::var("SCREENDOOR_PYTHON").unwrap_or("python3".into()))
        .args(["-c", DXC])
        .arg(place("docs/capture/triangles.hlsl"))
        .arg(place("crates/gpu/src/shaders/append.hlsl"))
        .current_dir(example.folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = example.draw([Path::new("corner.spv"), Path::new("record.spv")], true);
    assert!(found == expected(&raw), "{} and {} fragments", found.len(), raw.len());
}

#[test]
fn the_twins_declare_one_record() {
    let words = [
        "pixel",
        "primitive",
        "object",
        "coverage",
        "z",
        "dzdx",
        "dzdy",
        "red",
        "green",
        "blue",
        "alpha",
    ];
    let read = |name: &str| fs::read_to_string(place("crates/gpu/src/shaders").join(name)).unwrap();
    let members = |text: &str| -> Vec<String> {
        let body = text.split("struct CapturedFragment {").nth(1).unwrap();
        let body = body.split('}').next().unwrap();
        let lines = body.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("//"));
        let name = |line: &str| match line.split_once(':') {
            Some((name, _)) => name.to_string(),
            None => line.trim_end_matches(';').split_whitespace().nth(1).unwrap().to_string(),
        };
        lines.map(name).collect()
    };
    assert_eq!(members(&read("append.wgsl")), words);
    assert_eq!(members(&read("append.glsl")), words);
    assert!(read("append.hlsl").contains("44u * place"));
    // The examples draw the same triangles.
    let fan = |name: &str| {
        let text = fs::read_to_string(place("docs/capture").join(name)).unwrap();
        let begin = text.find("static const Corner FAN[] = {").unwrap();
        text[begin..].split("};").next().unwrap().to_string()
    };
    assert_eq!(fan("vulkan.c"), fan("direct3d.cpp"));
}
