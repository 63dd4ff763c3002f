//! Compute programs. Which buffers one has, its shader's text declares; here they go by the
//! names that they have there.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use crate::device::Gpu;
use screendoor_trace::error::Result;

/// A program, ready to be given its buffers.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    pub pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    buffers: Arc<[Declared]>,
}

/// A buffer that a shader declares.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Declared {
    binding: u32,
    kind: wgpu::BufferBindingType,
    name: String,
}

/// The buffers that the text of a shader declares: `@group(0) @binding(N) var<KIND> NAME: …`.
///
/// # Panics
/// Where a declaration is none of these: a fault of the crate's own, or of a design's shader.
fn declared(source: &str) -> Vec<Declared> {
    let declaration = |line: &str| -> Option<Declared> {
        let (binding, rest) = line.strip_prefix("@group(0) @binding(")?.split_once(") var<")?;
        let (kind, rest) = rest.split_once("> ")?;
        let kind = match kind {
            "uniform" => wgpu::BufferBindingType::Uniform,
            "storage, read" => wgpu::BufferBindingType::Storage { read_only: true },
            "storage, read_write" => wgpu::BufferBindingType::Storage { read_only: false },
            _ => return None,
        };
        let name = rest.split_once(':')?.0.to_string();
        Some(Declared { binding: binding.parse().ok()?, kind, name })
    };
    let lines = source.lines().filter(|line| line.contains("@binding"));
    lines.map(|l| declaration(l).unwrap_or_else(|| panic!("'{l}' declares no buffer"))).collect()
}

impl Gpu {
    /// The program `entry` of a shader; compiled once.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Gpu`] where it does not compile.
    pub(crate) fn program(&self, source: &str, entry: &str) -> Result<Program> {
        self.programs.get(source, entry, || self.compile(source, entry))
    }

    fn compile(&self, source: &str, entry: &str) -> Result<Program> {
        let device = &self.device;
        let module = self.run(&format!("compiling the shader of '{entry}'"), || {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(entry),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        })?;
        let buffers: Arc<[Declared]> = declared(source).into();
        let entries: Vec<_> = buffers
            .iter()
            .map(|buffer| wgpu::BindGroupLayoutEntry {
                binding: buffer.binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: buffer.kind,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        self.run(&format!("compiling '{entry}'"), || {
            let descriptor =
                wgpu::BindGroupLayoutDescriptor { label: Some(entry), entries: &entries };
            let layout = device.create_bind_group_layout(&descriptor);
            let whole = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                bind_group_layouts: &[Some(&layout)],
                ..Default::default()
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&whole),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            });
            Program { pipeline, layout, buffers }
        })
    }

    /// A program's buffers, by their names; those that it does not declare are left out.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Gpu`] where the device refuses them.
    ///
    /// # Panics
    /// Where one is missing: a fault of the crate's own.
    pub(crate) fn bind(
        &self,
        program: &Program,
        buffers: &[(&str, &wgpu::Buffer)],
    ) -> Result<wgpu::BindGroup> {
        let given = |name: &str| {
            let found = buffers.iter().find(|(given, _)| *given == name);
            found.unwrap_or_else(|| panic!("there is no buffer '{name}'")).1
        };
        let entries: Vec<_> = program
            .buffers
            .iter()
            .map(|buffer| wgpu::BindGroupEntry {
                binding: buffer.binding,
                resource: given(&buffer.name).as_entire_binding(),
            })
            .collect();
        let layout = &program.layout;
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        self.run("binding buffers", || self.device.create_bind_group(&descriptor))
    }
}

/// Programs that were compiled.
#[derive(Debug, Default)]
pub(crate) struct Compiled(Mutex<HashMap<(String, String), Program>>);

impl Compiled {
    /// Programs that are kept: enough for every design at several sample counts, which the
    /// suite of hard cases goes through again and again.
    const KEPT: usize = 512;

    fn get(
        &self,
        source: &str,
        entry: &str,
        compile: impl FnOnce() -> Result<Program>,
    ) -> Result<Program> {
        let key = (source.to_string(), entry.to_string());
        let mut all = self.0.lock().expect("no thread panicked");
        if let Some(program) = all.get(&key) {
            return Ok(program.clone());
        }
        if all.len() >= Self::KEPT {
            all.clear();
        }
        let program = compile()?;
        all.insert(key, program.clone());
        Ok(program)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_those_that_the_text_declares() {
        let text = "struct Params {\n}\n@group(0) @binding(0) var<uniform> params: Params;\n\
                    @group(0) @binding(7) var<storage, read_write> out: array<f32>;\n";
        let all = declared(text);
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].binding, &*all[0].name), (0, "params"));
        assert_eq!(all[0].kind, wgpu::BufferBindingType::Uniform);
        assert_eq!((all[1].binding, &*all[1].name), (7, "out"));
        assert_eq!(all[1].kind, wgpu::BufferBindingType::Storage { read_only: false });
    }

    #[test]
    #[should_panic(expected = "declares no buffer")]
    fn what_is_declared_otherwise_is_not_overlooked() {
        declared("@binding(0) @group(0) var<uniform> params: Params;");
    }
}
