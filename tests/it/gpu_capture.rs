//! Fragments captured by a GPU, held against our own rasteriser's. Without an adapter these
//! tests are skipped, as those of `gpu.rs` are.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use screendoor::capture::{Capture, CaptureOptions, Order, PatternKind, pattern};
use screendoor::gpu::Gpu;
use screendoor::gpu::capture::{
    Captured, CrossCheck, FragmentBuffer, GpuCapture, append_wgsl, sample_positions,
};
use screendoor::scene::{Scene, builtin::BUILTINS, load};
use screendoor::trace::{Fragment, SamplePattern, Trace};

use crate::util::gpu;

const SIDE: u32 = 256;
/// Of so many samples one may differ. What lavapipe makes of the built-in scenes stands in
/// `docs/GPU_CAPTURE.md`; the worst of them, hair, has
/// less than half of that: its ribbons are so thin that an edge is near every sample.
const ONE_IN: u64 = 2_500;

fn options() -> CaptureOptions {
    CaptureOptions { width: SIDE, height: SIDE, samples: 4, ..CaptureOptions::default() }
}

fn check(gpu: &Gpu, scene: &Scene, options: &CaptureOptions) -> CrossCheck {
    let capture = GpuCapture::new(gpu, scene, options).unwrap();
    capture.check(&capture.header().pattern, |_, _| ()).unwrap()
}

/// Whether the two rasterisers are as close as they should be.
fn agree(found: &CrossCheck) -> bool {
    found.differing.unexplained == 0 && found.differing.all() <= found.samples / ONE_IN
}

fn fragments(trace: &Trace) -> Vec<Fragment> {
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

#[test]
fn the_samples_lie_where_the_standard_has_them() {
    let Some(gpu) = gpu() else { return };
    let found = sample_positions(gpu).unwrap();
    assert_eq!(found, pattern(PatternKind::Standard, 4).unwrap(), "{}", gpu.adapter());
}

/// The built-in scenes' rows of the table in `docs/GPU_CAPTURE.md`.
fn table(gpu: &Gpu) -> String {
    let mut text = String::new();
    for builtin in BUILTINS {
        let scene = load(&format!("builtin:{}", builtin.name)).unwrap();
        let found = check(gpu, &scene, &options());
        assert!(agree(&found), "{}: {found:?}", builtin.name);
        let d = &found.differing;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.0e} |",
            builtin.name,
            found.triangles,
            found.both,
            found.only_ours,
            found.only_adapter,
            found.samples,
            d.on_an_edge,
            d.beside_an_edge,
            d.clipped + d.no_area + d.unexplained,
            found.furthest,
            found.depth,
        );
    }
    text
}

fn page() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/GPU_CAPTURE.md")
}

#[test]
fn our_rasteriser_covers_what_the_adapter_covers() {
    let Some(gpu) = gpu() else { return };
    let found = table(gpu);
    let page = std::fs::read_to_string(page()).unwrap();
    if page.contains(&gpu.adapter().name) {
        assert!(page.contains(&found), "the table is now\n{found}");
    } else {
        println!("{}\n{found}", gpu.adapter());
    }
}

#[test]
fn clipped_triangles_are_covered_alike() {
    let Some(gpu) = gpu() else { return };
    for scene in ["builtin:glass", "builtin:cloth:sheets=3,cells=24"] {
        let scene = load(scene).unwrap();
        let mut options = options();
        // From within the scene.
        options.camera.distance = Some(0.6);
        let found = check(gpu, &scene, &options);
        assert!(agree(&found), "{found:?}");
    }
}

#[test]
fn planted_defects_are_found() {
    let Some(gpu) = gpu() else { return };
    let (scene, options) = (load("builtin:glass").unwrap(), options());
    let capture = GpuCapture::new(gpu, &scene, &options).unwrap();
    let own = capture.header().pattern.clone();
    let with = |change: &dyn Fn(&mut SamplePattern)| {
        let mut pattern = own.clone();
        change(&mut pattern);
        capture.check(&pattern, |_, _| ()).unwrap()
    };
    assert!(agree(&with(&|_| ())));
    for found in [
        // Two bits of every mask exchanged.
        with(&|p| p.positions.swap(0, 1)),
        // One sample a sixteenth of a pixel aside.
        with(&|p| p.positions[2][0] += 1),
        // Rows from the bottom up.
        with(&|p| p.positions.iter_mut().for_each(|at| at[1] = -at[1])),
    ] {
        assert!(!agree(&found) && found.differing.unexplained > 0, "{found:?}");
    }
    let mut fewer = own;
    fewer.positions.truncate(2);
    assert!(capture.check(&fewer, |_, _| ()).unwrap_err().is_config());
}

#[test]
fn the_trace_is_ours_but_for_the_samples_that_differ() {
    let Some(gpu) = gpu() else { return };
    for (scene, order) in [
        ("builtin:ramps", Order::Api),
        ("builtin:glass", Order::Random),
        ("builtin:smoke:puffs=100", Order::FarToNear),
        ("builtin:foliage:cards=100", Order::NearToFar),
    ] {
        let scene = load(scene).unwrap();
        let options = CaptureOptions { order, width: 100, height: 80, ..options() };
        let capture = GpuCapture::new(gpu, &scene, &options).unwrap();
        let theirs = fragments(&capture.to_memory(|_, _| ()).unwrap());
        let ours = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
        let differing = check(gpu, &scene, &options).differing.all();
        assert!(differing <= 2, "choose a scene where the two agree");
        if differing == 0 {
            assert_eq!(theirs, fragments(&ours));
        }
    }
}

#[test]
fn what_does_not_fit_is_drawn_in_parts() {
    let Some(gpu) = gpu() else { return };
    let options = CaptureOptions { width: 70, height: 50, ..options() };
    // Layers hold more than a row of one triangle each.
    for scene in ["builtin:layers", "builtin:cloth:sheets=2,cells=8"] {
        let scene = load(scene).unwrap();
        let content = |capacity: Option<u32>| {
            let mut capture = GpuCapture::new(gpu, &scene, &options).unwrap();
            if let Some(fragments) = capacity {
                capture = capture.with_capacity(fragments);
            }
            let checked = capture.check(&capture.header().pattern, |_, _| ()).unwrap();
            let trace = capture.to_memory(|_, _| ()).unwrap();
            (trace.content().unwrap().to_string(), trace.rows(), checked)
        };
        let whole = content(None);
        assert!(whole.1 > 1000);
        for capacity in [1, 4000] {
            assert_eq!(content(Some(capacity)), whole, "{capacity}");
        }
    }
}

#[test]
fn options_that_a_gpu_cannot_follow_are_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = load("builtin:ramps").unwrap();
    let refused = |options: CaptureOptions| {
        GpuCapture::new(gpu, &scene, &options).err().map(|e| (e.is_config(), e.to_string()))
    };
    let (config, text) = refused(CaptureOptions { samples: 64, ..options() }).unwrap();
    assert!(config && text.contains("--samples 4"), "{text}");
    for pattern in [PatternKind::Nested, PatternKind::Centre] {
        assert!(refused(CaptureOptions { pattern, ..options() }).unwrap().0);
    }
    assert!(refused(CaptureOptions { pattern: PatternKind::Standard, ..options() }).is_none());
    let capture = CaptureOptions { width: 65536, ..options() };
    let capture = GpuCapture::new(gpu, &scene, &capture).unwrap();
    let error = capture.to_memory(|_, _| ()).unwrap_err().to_string();
    assert!(error.contains("--size"), "{error}");
}

/// A device that is not ours, as in somebody else's program.
pub fn foreign() -> Option<(wgpu::Device, wgpu::Queue)> {
    gpu()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    Some(pollster::block_on(adapter.request_device(&Default::default())).unwrap())
}

#[test]
fn a_buffer_that_is_full_says_how_much_was_needed() {
    let Some((device, queue)) = foreign() else { return };
    assert!(FragmentBuffer::new(&device, 0).unwrap_err().is_config());
    let most = FragmentBuffer::most(&device);
    assert!(FragmentBuffer::new(&device, most + 1).unwrap_err().is_config());

    // One triangle over half of a frame of 8 × 8 pixels, bound as group 1.
    let source = append_wgsl(1)
        + "@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
               return vec4<f32>(f32(i & 1u) * 2.0 - 1.0, f32(i >> 1u) * 2.0 - 1.0, 0.25, 1.0);
           }
           @fragment fn colour(
               @builtin(position) at: vec4<f32>,
               @builtin(sample_mask) coverage: u32,
           ) -> @location(0) vec4<f32> {
               let depth = captured_depth(at);
               let colour = vec4<f32>(0.25, 0.5, 0.75, 0.125);
               append_fragment(at, depth, coverage, 7u, 3u, colour);
               return colour;
           }";
    let draw = |capacity: u32| {
        let fragments = FragmentBuffer::new(&device, capacity).unwrap();
        draw_on((&device, &queue), &source, [8, 8], &[], &fragments);
        fragments.read(&device, &queue).unwrap()
    };
    let Captured::All(all) = draw(64) else { panic!("64 pixels are enough") };
    assert_eq!(draw(all.len() as u32), Captured::All(all.clone()));
    assert_eq!(draw(all.len() as u32 - 1), Captured::TooMany(all.len() as u64));
    // The diagonal's pixels are covered in part.
    assert_eq!(all.len(), 36);
    let whole = all.iter().filter(|raw| raw.coverage == 0xf).count();
    assert_eq!(whole, 28);
    let fragment = all[0].fragment();
    assert_eq!((fragment.primitive, fragment.object, fragment.alpha), (7, 3, 0.125));
    assert_eq!(fragment.colour, [0.25, 0.5, 0.75]);
    assert_eq!((fragment.depth.z.0, fragment.depth.dzdx), (1 << 30, 0));
}

/// Draws with a shader that records as group 1: triangles of these corners, each a place in
/// clip space and a colour, or one without any.
pub fn draw_on(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    source: &str,
    [width, height]: [u32; 2],
    corners: &[[f32; 8]],
    fragments: &FragmentBuffer,
) {
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let vertices = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes.len().max(4) as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&vertices, 0, &bytes);
    let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4];
    let layout_of_corners = wgpu::VertexBufferLayout {
        array_stride: 32,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    };
    let buffers = if corners.is_empty() { vec![] } else { vec![Some(layout_of_corners)] };
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[None, Some(fragments.layout())],
        ..Default::default()
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count: 4, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 4,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    fragments.clear(&mut encoder);
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(1, fragments.bind_group(), &[]);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.draw(0..corners.len().max(3) as u32, 0..1);
    }
    queue.submit([encoder.finish()]);
}

fn screendoor(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_screendoor"));
    command.args(arguments);
    command
}

fn fails(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(!output.status.success());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn without_a_gpu_the_command_says_what_to_install() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("t.arrow");
    let line = ["capture", "builtin:ramps", "--gpu", "-o", trace.to_str().unwrap()];
    let mut command = screendoor(&line);
    // No driver at all.
    command.env("VK_ICD_FILENAMES", folder.path()).env("VK_DRIVER_FILES", folder.path());
    let error = fails(&mut command);
    assert!(error.contains("no adapter was found; install a Vulkan driver"), "{error}");
    assert!(!trace.exists());
}

#[test]
fn the_command_captures_and_checks() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("t.arrow");
    let trace = trace.to_str().unwrap();
    let line = ["capture", "builtin:glass", "-o", trace, "--size", "64x64"];
    let output = screendoor(&[&line[..], &["--gpu", "--check"]].concat()).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && printed.contains("samples that differ"), "{printed}");
    assert_eq!(Trace::open(trace).unwrap().header().pattern.name, "standard-4");

    let refused = |more: &[&str]| fails(&mut screendoor(&[&line[..], more].concat()));
    assert!(refused(&["--gpu", "--samples", "8"]).contains("ask for --samples 4"));
    assert!(refused(&["--gpu", "--adapter", "none such"]).contains("there are: "));
    assert!(refused(&["--check"]).contains("--gpu"));
}

#[test]
#[ignore = "writes the table of docs/GPU_CAPTURE.md"]
fn write_table() {
    let gpu = gpu().expect("an adapter");
    let page_text = std::fs::read_to_string(page()).unwrap();
    let is_row =
        |line: &&str| BUILTINS.iter().any(|b| line.starts_with(&format!("| {} |", b.name)));
    let first = page_text.lines().position(|l| is_row(&l)).expect("a row for each scene");
    let mut lines: Vec<&str> = page_text.lines().filter(|l| !is_row(l)).collect();
    let rows = table(gpu);
    lines.splice(first..first, rows.lines());
    std::fs::write(page(), lines.join("\n") + "\n").unwrap();
}
