//! The shaders are valid where there is no GPU, defects in them are found where there is
//! one, and what fails there is told.

use wgpu::naga::front::wgsl;
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};

use super::device::Gpu;
use super::loaders;
use super::replay::source;
use super::shader::defect::{self, Defect};
use super::shader::{self, OWN};
use super::{GpuOptions, GpuRun, Threads};
use screendoor_designs::{Configured, DESIGNS, configure};
use screendoor_rop::{Constant, Contents, Implementation, SHADERS};
use screendoor_trace::param::Kind;
use screendoor_trace::random::Stream;
use screendoor_trace::trace::{
    ColourFormat, ColumnId, DepthPlane, Fragment, Header, Projection, SampleMask, SamplePattern,
    Trace, TraceWriter, Unorm32, View, WriteOptions,
};

/// Checks a program as wgpu does before it hands it to a driver.
fn validate(text: &str, name: &str) {
    let module =
        wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SUBGROUP);
    if let Err(e) = validator.validate(&module) {
        panic!("{name}: {}", e.emit_to_string(text));
    }
}

/// Columns as they are stored at `samples` samples, or constants.
fn types(stored: bool, samples: u32) -> Vec<(String, Constant)> {
    let bytes = |id: ColumnId| match stored {
        true => id.narrowest(samples).bytes() as u32,
        false => 0,
    };
    let constant = |id| (loaders::bytes_constant(id), Constant::Whole(bytes(id)));
    ColumnId::ALL.into_iter().map(constant).collect()
}

/// Every value of every choice, each alone.
fn variants(name: &str) -> Vec<Configured> {
    let entry = DESIGNS.iter().find(|e| e.info.name == name).unwrap();
    let mut list = vec![entry.configure(&[]).unwrap()];
    for param in entry.info.params {
        let options: Vec<&str> = match param.kind {
            Kind::Choice { options } => options.iter().map(|o| o.name).collect(),
            Kind::Flag => vec!["true", "false"],
            _ => vec![],
        };
        let given = options.iter().map(|o| [(param.name.to_string(), o.to_string())]);
        list.extend(given.map(|given| entry.configure(&given).unwrap()));
    }
    list
}

/// Fragments that crowd some tiles at few depths: equal ones, crossing ones, all kinds of
/// masks and alphas.
fn trace(samples: u32) -> Trace {
    let header = Header {
        width: 40,
        height: 24,
        pattern: SamplePattern {
            name: "test".to_string(),
            positions: (0..samples as i8).map(|s| [s % 8 * 2 - 8, s / 8 * 2 - 8]).collect(),
            nested: true,
        },
        background: [0.25; 3],
        colour: ColourFormat::F16,
        source: "test".to_string(),
        camera: "none".to_string(),
        // Some parameters ask for one.
        view: Some(View {
            projection: Projection::Orthographic,
            near: 0.0625,
            far: 128.0625,
            world_to_view: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.],
            view_to_clip: [
                [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, -1.0 / 128.0, 0.0, 0.0, 0.0, -0.0625 / 128.0, 1.0],
            ]
            .concat()
            .try_into()
            .unwrap(),
        }),
        ..Header::default()
    };
    let mut random = Stream::new([0xdef, samples]);
    let place = "test";
    let mut writer = TraceWriter::new(Vec::new(), place, header, WriteOptions::default()).unwrap();
    for i in 0..6000 {
        let bits = u64::from(random.word()) << 32 | u64::from(random.word());
        let mask = SampleMask(bits | 1 << random.below(samples)) & SampleMask::first(samples);
        let flat = random.below(2) == 0;
        let mut slope = || if flat { 0 } else { random.word() as i32 >> 6 };
        let (dzdx, dzdy) = (slope(), slope());
        let z = Unorm32((2 + random.below(5)) << 29 | random.below(2));
        let alpha = [1.0, 1e-9, random.unit(), random.unit()][random.below(4) as usize];
        let fragment = Fragment {
            x: random.below(40) as u16,
            y: random.below(24) as u16,
            coverage: mask,
            depth: DepthPlane { z, dzdx, dzdy },
            colour: [random.unit(), -random.unit(), random.unit() * 40.0],
            alpha,
            primitive: i,
            object: i / 50,
            ..Fragment::default()
        };
        writer.push(&fragment).unwrap();
    }
    Trace::from_bytes(writer.finish().unwrap().0, place).unwrap()
}

#[test]
fn every_program_is_valid_at_every_sample_count() {
    let columns = [types(true, 64), types(false, 64)];
    let trace = trace(64);
    for entry in DESIGNS.iter().filter(|e| e.is_ported()) {
        for (i, design) in variants(entry.info.name).into_iter().enumerate() {
            for samples in [1, 2, 4, 8, 16, 32, 64] {
                let frame = design.frame(&trace, samples, 0).unwrap();
                let port = design.port(&frame).unwrap();
                let label = format!("{} {samples}", design.label());
                let types = || columns[i % 2].clone().into_iter();
                validate(&source(&[port.program], &port, samples, types()), &label);
                if port.by_sample {
                    for lanes in ["lanes_subgroup", "lanes_workgroup"] {
                        let text =
                            source(&[port.program, shader::named(lanes)], &port, samples, types());
                        validate(&text, &format!("{label} {lanes}"));
                    }
                }
            }
        }
    }
    for file in ["bin", "scan", "touch", "longest"] {
        for samples in [8, 64] {
            validate(&shader::program(&[shader::named(file)], samples, &columns[0]), file);
        }
    }
}

/// What pixels hold and show of a design on a GPU.
fn held(
    gpu: &Gpu,
    design: &Configured,
    trace: &Trace,
    threads: Threads,
) -> (Vec<Contents>, String) {
    let frame = design.frame(trace, 8, 5).unwrap();
    let port = design.port(&frame).unwrap();
    // A defect in sorting is not to be met by what a sound replay has left sorted.
    let options = GpuOptions { threads, keep: false, ..GpuOptions::default() };
    let mut run = GpuRun::new(gpu, &port, &frame, trace, &options).unwrap();
    let contents = |_, state| -> Vec<Contents> {
        (0..256).map(|within| port.plain.contents(&state, within)).collect()
    };
    let mut tiles = run.states(contents).unwrap();
    tiles.sort_by_key(|(tile, _)| *tile);
    let held = tiles.into_iter().flat_map(|(_, contents)| contents).collect();
    (held, run.picture().unwrap().hash())
}

/// The same by the plain text, but for what pixels hold.
fn shown(design: &Configured, trace: &Trace) -> String {
    let options = screendoor_rop::ReplayOptions {
        implementation: Implementation::Reference,
        ..Default::default()
    };
    design.replay(trace, 8, 5, &options).unwrap().picture.hash()
}

/// One wrong bit or comparison in each part of the way. The designs that meet it, and whether
/// threads are given samples.
const DEFECTS: &[(&str, Threads, Defect)] = &[
    ("lk", Threads::Sample, ("x ^= x * 0xb82f1e52u", "x ^= x * 0xb82f1e53u")),
    ("lk", Threads::Pixel, ("nested_round(n, 0xb82f1e52u)", "nested_round(n, 0xb82f1e50u)")),
    ("lk", Threads::Pixel, ("0x73516240u", "0x73516204u")),
    ("lk", Threads::Pixel, ("<= depth[s]", "< depth[s]")),
    ("lk", Threads::Pixel, ("keys[t] < keys[s]", "keys[t] > keys[s]")),
    ("lk", Threads::Pixel, ("place_bit(t) & counts;", "place_bit(t);")),
    ("lk", Threads::Pixel, ("surface_id += 1u", "surface_id += 2u")),
    ("lk", Threads::Pixel, ("covered |= s;", "covered |= s >> 1u;")),
    ("lk", Threads::Pixel, ("numbered += count;", "numbered += count & 6u;")),
    ("lk", Threads::Pixel, ("(3u * right) ^ down", "(2u * right) ^ down")),
    ("lk", Threads::Pixel, ("exponent >= 127u", "exponent >= 126u")),
    ("lk", Threads::Pixel, ("+ (left >> 4u)", "")),
    (
        "lk",
        Threads::Pixel,
        ("(magnitude << 13u) + 0x38000000u", "(magnitude << 13u) + 0x38002000u"),
    ),
    (
        "lk",
        Threads::Pixel,
        ("let share = 1.0 / f32(SAMPLES);", "let share = 1.0000001 / f32(SAMPLES);"),
    ),
    ("lk", Threads::Pixel, ("rows_to[place] = row;", "rows_to[place] = row - (row & 1u);")),
    ("lk", Threads::Pixel, ("((y & 15u) << 4u) | (x & 15u)", "((y & 15u) << 4u) | (x & 7u)")),
    (
        "lk",
        Threads::Pixel,
        (
            "for (var i = 0u; i < GROUP; i++) {\n        let held = tally[pair * GROUP + i];",
            "for (var j = 0u; j < GROUP; j++) {\n        let i = j ^ 1u;\n        let held = tally[pair * GROUP + i];",
        ),
    ),
    ("lk", Threads::Sample, ("its_depth < lane_depth ||", "its_depth > lane_depth ||")),
    ("lk", Threads::Sample, ("<= lane_depth;", "< lane_depth;")),
    (
        "lk:method=depth-correction",
        Threads::Pixel,
        (
            "stored(transmittance[s] * (1.0 - f.alpha))",
            "stored(transmittance[s] * (1.001 - f.alpha))",
        ),
    ),
    (
        "lk:method=depth-correction",
        Threads::Pixel,
        (
            "sum_weight = stored(sum_weight + weight);",
            "sum_weight = stored(sum_weight + weight + 1.0);",
        ),
    ),
    ("lk:method=alpha-correction", Threads::Pixel, ("<= opaque_depth[s]", "< opaque_depth[s]")),
    (
        "systematic",
        Threads::Pixel,
        ("phase += opacity.low * count;", "phase += opacity.low * (count + 1u);"),
    ),
    ("enderton", Threads::Pixel, ("x *= 0x846ca68bu", "x *= 0x846ca68au")),
    ("enderton", Threads::Pixel, ("before < count", "before <= count")),
    ("kbuffer", Threads::Pixel, ("layers[count].depth < depth", "layers[count].depth <= depth")),
    ("mlab:layers=2", Threads::Pixel, ("let through = mine +", "let through = 0.0001 + mine +")),
];

#[test]
fn a_planted_defect_is_found_whatever_part_it_is_in() {
    // Where there is none, `tests/it/gpu.rs` says so.
    let Ok(gpu) = Gpu::open(None) else { return };
    let trace = trace(8);
    let (mut sound, mut hidden) = (Vec::new(), Vec::new());
    for (name, threads, planted) in DEFECTS {
        let design = configure(name, &[]).unwrap();
        let same = |case: &&(&str, Threads, _)| case.0 == *name && case.1 == *threads;
        if sound.iter().find(same).is_none() {
            let held = held(&gpu, &design, &trace, *threads);
            assert_eq!(held.1, shown(&design, &trace), "{name}");
            sound.push((*name, *threads, held));
        }
        let (.., sound) = sound.iter().find(same).unwrap();
        let frame = design.frame(&trace, 8, 0).unwrap();
        let program = design.port(&frame).unwrap().program;
        let mut all = OWN.iter().chain(SHADERS).chain([&program]);
        assert!(all.any(|s| s.text.contains(planted.0)), "no '{}'", planted.0);
        let found = defect::with(Some(*planted), || held(&gpu, &design, &trace, *threads));
        if found == *sound {
            hidden.push(format!("{name}: '{}'", planted.1));
        }
    }
    assert!(hidden.is_empty(), "hidden: {hidden:?}");
}

#[test]
fn what_a_replay_leaves_sorted_serves_other_seeds_and_designs() {
    let Ok(gpu) = Gpu::open(None) else { return };
    let (first, other) = (trace(8), trace(8));
    let plain = screendoor_rop::ReplayOptions {
        implementation: Implementation::Reference,
        ..Default::default()
    };
    // Whether a replay uploaded anything; its picture is held against the plain text's.
    let uploads = |trace: &Trace, name: &str, (samples, seed), options: &GpuOptions<'_>| {
        let design = configure(name, &[]).unwrap();
        let (found, seconds, _) =
            super::replay::replay(&gpu, &design, trace, samples, seed, options).unwrap();
        let expected = design.replay(trace, samples, seed, &plain).unwrap();
        assert_eq!(found.picture.hash(), expected.picture.hash(), "{name} {samples} {seed}");
        seconds.upload > 0.0
    };
    for rows in [u64::MAX, 1000] {
        let keep = GpuOptions { rows, ..GpuOptions::default() };
        let case = |trace: &Trace, name: &str, of| uploads(trace, name, of, &keep);
        assert!(case(&first, "lk", (8, 1)));
        assert!(!case(&first.clone(), "lk", (8, 2)));
        assert!(!case(&first, "systematic", (8, 1)));
        assert!(!case(&first, "lk:method=depth-correction", (8, 1)));
        // Other samples are sorted otherwise; another trace takes the place of the first.
        assert!(case(&first, "lk", (4, 1)) && case(&first, "lk", (8, 1)));
        assert!(case(&other, "lk", (8, 1)) && case(&first, "lk", (8, 1)));
        // What is not to be kept is not, nor is what does not fit.
        for asked in [GpuOptions { keep: false, ..keep }, GpuOptions { resident: 0, ..keep }] {
            assert!(uploads(&other, "lk", (8, 1), &asked));
            assert!(uploads(&other, "lk", (8, 1), &asked));
        }
    }
}

#[test]
fn what_fails_on_a_device_is_told() {
    let Ok(gpu) = Gpu::open(None) else { return };
    let error = gpu.program("fn broken(", "broken").unwrap_err().to_string();
    assert!(error.contains("compiling the shader of 'broken' failed"), "{error}");

    let gpu = Gpu::open(None).unwrap();
    let most = gpu.limits().max_buffer_size;
    let error = gpu.buffer("a lot", most + 4, wgpu::BufferUsages::STORAGE).unwrap_err().to_string();
    assert!(error.contains("a lot take") && error.contains("do without the GPU"), "{error}");

    // As when it is pulled out.
    let gpu = Gpu::open(None).unwrap();
    gpu.device.destroy();
    let (trace, design) = (trace(4), configure("lk", &[]).unwrap());
    let lost = super::replay::replay(&gpu, &design, &trace, 4, 0, &GpuOptions::default());
    let error = lost.map(|_| ()).unwrap_err().to_string();
    assert!(error.contains(&gpu.adapter().name) && error.contains("lost"), "{error}");
}

#[test]
fn anybodys_device_draws_the_same_and_keeps_its_handler() {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let Some(adapter) = all.first() else { return };
    // With the least that a device has, as an engine opens it.
    let opened = adapter.request_device(&wgpu::DeviceDescriptor::default());
    let Ok((device, queue)) = pollster::block_on(opened) else { return };
    device.on_uncaptured_error(std::sync::Arc::new(|e| panic!("the owner is told: {e}")));
    let gpu = Gpu::from_device(adapter, device, queue);
    let (trace, design) = (trace(8), configure("lk", &[]).unwrap());
    assert_eq!(held(&gpu, &design, &trace, Threads::Pixel).1, shown(&design, &trace));
    let error = gpu.program("fn broken(", "broken").unwrap_err().to_string();
    assert!(error.contains("compiling the shader of 'broken' failed"), "{error}");
}
