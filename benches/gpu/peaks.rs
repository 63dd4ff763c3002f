//! What a device can do at most, by small kernels: bytes a second and integer operations a second.
//!
//! A kernel is started again and again in one submission, until that takes so long that starting
//! and waiting do not count: the clock on the wall serves where a device has none.

use std::time::{Duration, Instant};

use screendoor::gpu::{Adapter, Gpu};
use serde::{Deserialize, Serialize};

/// Peaks, each in units a second.
#[derive(Serialize, Deserialize)]
pub struct Peaks {
    pub adapter: String,
    /// Bytes that are read from memory.
    pub read: f64,
    /// Bytes that are read and written.
    pub copy: f64,
    /// Bytes that are brought to the device.
    pub upload: f64,
    /// Multiplications and additions of 32-bit integers, as many of the one as of the other.
    pub multiply_add: f64,
    /// Exclusive ors and additions of 32-bit integers.
    pub xor_add: f64,
}

const GROUP: u64 = 256;
/// Steps that are written out, of vectors of four, of two operations each.
const STEPS: u64 = 32;
const TURNS: u64 = 64;

/// How much is measured: a processor that runs a GPU's code is slow.
struct Size {
    groups: u32,
    bytes: u64,
    /// How long a submission takes at least.
    long: Duration,
}

const TEXT: &str = "
@group(0) @binding(0) var<storage, read_write> given: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> made: array<vec4<u32>>;

// Not zeros, which memory may be kept without.
@compute @workgroup_size(256)
fn fill(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    for (var i = id.x; i < arrayLength(&given); i += groups.x * 256u) {
        given[i] = (vec4<u32>(i) + vec4<u32>(1u, 2u, 3u, 4u)) * 0x9e3779b9u;
    }
}

// The sum is written where it is what it hardly can be: so it has to be made.
fn use_up(sum: vec4<u32>) {
    if all(sum == vec4<u32>(0x01234567u, 0x89abcdefu, 0x02468aceu, 0x13579bdfu)) {
        made[0] = sum;
    }
}

@compute @workgroup_size(256)
fn read(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    var sum = vec4<u32>(0u);
    for (var i = id.x; i < arrayLength(&given); i += groups.x * 256u) {
        sum ^= given[i];
    }
    use_up(sum);
}

@compute @workgroup_size(256)
fn copy(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    for (var i = id.x; i < arrayLength(&given); i += groups.x * 256u) {
        made[i] = given[i];
    }
}
";

/// A kernel of nothing but arithmetic, a step after the other.
fn arithmetic(name: &str, step: &str) -> String {
    let steps = format!("        {step}\n").repeat(STEPS as usize);
    format!(
        "@compute @workgroup_size(256)\n\
         fn {name}(@builtin(global_invocation_id) id: vec3<u32>) {{\n    \
             let factor = given[id.x & 7u] | vec4<u32>(1u);\n    \
             var x = vec4<u32>(id.x) * vec4<u32>(1u, 3u, 5u, 7u);\n    \
             for (var turn = 0u; turn < {TURNS}u; turn++) {{\n{steps}    }}\n    \
             use_up(x);\n}}\n"
    )
}

/// Measures the adapter that [`Gpu::open`] opens by this name; without `long`, hardly at all.
pub fn measure(name: Option<&str>, long: bool) -> Result<Peaks, String> {
    let chosen = Gpu::open(name).map_err(|e| e.to_string())?.adapter().clone();
    let (device, queue) = open(&chosen)?;
    let limits = device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let size = match (long, chosen.kind) {
        (false, _) => Size { groups: 4, bytes: 1 << 16, long: Duration::ZERO },
        (true, "CPU") => Size { groups: 64, bytes: 1 << 26, long: Duration::from_millis(300) },
        (true, _) => Size { groups: 8192, bytes: 1 << 30, long: Duration::from_millis(300) },
    };
    let bytes = size.bytes.min(most) & !15;
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let buffer = || {
        let mapped_at_creation = false;
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage,
            mapped_at_creation,
        })
    };
    let bench = Bench::new(device.clone(), queue.clone(), [buffer(), buffer()]);
    let groups = size.groups;
    bench.run("fill", groups, 1);
    let best = |name| bench.best(name, groups, size.long);
    let operations = f64::from(groups) * (GROUP * TURNS * STEPS * 4 * 2) as f64;
    let peaks = Peaks {
        adapter: chosen.to_string(),
        read: bytes as f64 / best("read"),
        copy: 2.0 * bytes as f64 / best("copy"),
        upload: bench.upload(bytes.min(1 << 26)),
        multiply_add: operations / best("multiply_add"),
        xor_add: operations / best("xor_add"),
    };
    Ok(peaks)
}

/// Opens an adapter that [`Gpu`] knows, with all that it has.
fn open(chosen: &Adapter) -> Result<(wgpu::Device, wgpu::Queue), String> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let is_it = |adapter: &&wgpu::Adapter| {
        let info = adapter.get_info();
        info.name.trim() == chosen.name && info.backend.to_str() == chosen.backend
    };
    let adapter = all.iter().find(is_it).ok_or("the adapter is gone")?;
    let required_limits = adapter.limits();
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| e.to_string())
}

struct Bench {
    device: wgpu::Device,
    queue: wgpu::Queue,
    module: wgpu::ShaderModule,
    layout: wgpu::BindGroupLayout,
    bound: wgpu::BindGroup,
    to: wgpu::Buffer,
}

impl Bench {
    fn new(device: wgpu::Device, queue: wgpu::Queue, [from, to]: [wgpu::Buffer; 2]) -> Self {
        let text = TEXT.to_string()
            + &arithmetic("multiply_add", "x = x * factor + factor.yzwx;")
            + &arithmetic("xor_add", "x = (x ^ factor) + factor.yzwx;");
        let source = wgpu::ShaderSource::Wgsl(text.into());
        let module =
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let entry = |binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[entry(0), entry(1)],
        });
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: from.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: to.as_entire_binding() },
            ],
        });
        Bench { device, queue, module, layout, bound, to }
    }

    fn pipeline(&self, name: &str) -> wgpu::ComputePipeline {
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: &[Some(&self.layout)],
            ..Default::default()
        });
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&layout),
            module: &self.module,
            entry_point: Some(name),
            compilation_options: Default::default(),
            cache: None,
        })
    }

    fn wait(&self) {
        self.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device is there");
    }

    /// Runs a kernel so many times.
    fn run(&self, name: &str, groups: u32, times: u32) {
        self.submit(&self.pipeline(name), groups, times);
    }

    /// Seconds that so many runs of a kernel take.
    fn submit(&self, pipeline: &wgpu::ComputePipeline, groups: u32, times: u32) -> f64 {
        let begun = Instant::now();
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.bound, &[]);
        for _ in 0..times {
            pass.dispatch_workgroups(groups, 1, 1);
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
        self.wait();
        begun.elapsed().as_secs_f64()
    }

    /// Seconds of a run, the best of some.
    fn best(&self, name: &str, groups: u32, long: Duration) -> f64 {
        let pipeline = self.pipeline(name);
        let mut times = 1;
        while self.submit(&pipeline, groups, times) < long.as_secs_f64() && times < 1 << 16 {
            times *= 2;
        }
        let runs = (0..3).map(|_| self.submit(&pipeline, groups, times) / f64::from(times));
        runs.fold(f64::INFINITY, f64::min)
    }

    /// Bytes a second to the device, the best of some.
    fn upload(&self, bytes: u64) -> f64 {
        let from = vec![1_u8; bytes as usize];
        let seconds = (0..5).map(|_| {
            let begun = Instant::now();
            self.queue.write_buffer(&self.to, 0, &from);
            self.queue.submit([]);
            self.wait();
            begun.elapsed().as_secs_f64()
        });
        bytes as f64 / seconds.fold(f64::INFINITY, f64::min)
    }
}
