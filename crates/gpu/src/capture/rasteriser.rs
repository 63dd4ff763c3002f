//! The adapter's raster pipeline, drawing triangles four samples a pixel into nothing but
//! their fragments.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::capture::fragments::{Captured, FragmentBuffer, RawFragment};
use crate::device::Gpu;
use crate::shader;
use screendoor_trace::error::Result;

/// Samples of a pixel: the one count above 1 that every adapter has.
pub(super) const SAMPLES: u32 = 4;

/// A corner of a triangle, as `shaders/capture.wgsl` reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Corner {
    /// In clip space.
    pub position: [f32; 4],
    /// Not 0 where the triangle is drawn although it shows its back.
    pub keep_back: u32,
}

/// A pipeline over a frame.
pub(super) struct Rasteriser<'a> {
    gpu: &'a Gpu,
    pipeline: wgpu::RenderPipeline,
    target: wgpu::TextureView,
    fragments: FragmentBuffer,
    size: [u32; 2],
}

/// A part of a drawing: some triangles, on some rows.
struct Part {
    triangles: Range<u32>,
    rows: Range<u32>,
}

impl<'a> Rasteriser<'a> {
    /// For a frame of `size` pixels, with room for `capacity` fragments at a time.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Gpu`] where the adapter has no such frame or no memory.
    pub(super) fn new(gpu: &'a Gpu, size: [u32; 2], capacity: u32) -> Result<Self> {
        let longest = gpu.limits().max_texture_dimension_2d;
        if size.iter().any(|side| *side > longest) {
            return Err(gpu.error(
                format_args!("it has no frame of {}×{} pixels", size[0], size[1]),
                format_args!("each side is {longest} at most: choose a smaller --size"),
            ));
        }
        // One row of one triangle is the least that can be drawn at a time. Clipping by six
        // planes leaves up to seven pieces of it.
        let capacity = capacity.max(7 * size[0]).min(FragmentBuffer::most(&gpu.device));
        let fragments = FragmentBuffer::new(&gpu.device, capacity)?;
        let format = wgpu::TextureFormat::R8Unorm;
        let descriptor = wgpu::TextureDescriptor {
            label: Some("a frame to draw nothing into"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: SAMPLES,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        };
        let target = gpu.run("making a frame", || {
            gpu.device.create_texture(&descriptor).create_view(&Default::default())
        })?;
        let pipeline = gpu
            .run("compiling the capture's shaders", || pipeline(gpu, fragments.layout(), format))?;
        Ok(Rasteriser { gpu, pipeline, target, fragments, size })
    }

    /// Draws triangles of three corners each, and hands the fragments of some triangles, or
    /// of some rows of one, to `each`: in API order, as many at a time as there is room for.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Gpu`] where the adapter fails; as `each`.
    pub(super) fn draw(
        &self,
        corners: &[Corner],
        mut each: impl FnMut(Vec<RawFragment>) -> Result<()>,
    ) -> Result<()> {
        if corners.is_empty() {
            return Ok(());
        }
        let usage = wgpu::BufferUsages::VERTEX;
        let vertices = self.gpu.filled("triangles", bytemuck::cast_slice(corners), usage)?;
        let triangles = 0..corners.len() as u32 / 3;
        let mut left = vec![Part { triangles, rows: 0..self.size[1] }];
        while let Some(part) = left.pop() {
            self.pass(&vertices, &part)?;
            match self.fragments.read(&self.gpu.device, &self.gpu.queue)? {
                Captured::All(fragments) => each(fragments)?,
                Captured::TooMany(needed) => {
                    let room = u64::from(self.fragments.capacity());
                    if part.triangles.len() == 1 && part.rows.len() == 1 {
                        return Err(self.gpu.error(
                            format_args!("one row of a triangle leaves {needed} fragments in it"),
                            "choose a smaller --size, or capture without --gpu",
                        ));
                    }
                    // A little more than would do if all were of one size.
                    let parts = needed * 5 / 4 / room + 1;
                    left.extend(part.cut(parts.max(2) as u32).rev());
                }
            }
        }
        Ok(())
    }

    fn pass(&self, vertices: &wgpu::Buffer, part: &Part) -> Result<()> {
        let Range { start: first, end } = part.rows;
        let rows = bytemuck::bytes_of(&[first, end]).to_vec();
        let rows = self.gpu.filled("rows", &rows, wgpu::BufferUsages::VERTEX)?;
        self.gpu.submit("drawing fragments", |encoder| {
            self.fragments.clear(encoder);
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("fragments"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Discard,
                    },
                })],
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, self.fragments.bind_group(), &[]);
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.set_vertex_buffer(1, rows.slice(..));
            // Which rows are recorded is the shader's to say: lavapipe cuts samples half a
            // pixel beside the scissor's border. The scissor only saves work.
            let [above, below] = [first.saturating_sub(1), (end + 1).min(self.size[1])];
            pass.set_scissor_rect(0, above, self.size[0], below - above);
            pass.draw(part.triangles.start * 3..part.triangles.end * 3, 0..1);
            Ok(())
        })
    }
}

impl Part {
    /// Cuts it into about so many, in API order: by triangles, and a single one by rows.
    fn cut(&self, parts: u32) -> impl DoubleEndedIterator<Item = Part> {
        let by_rows = self.triangles.len() == 1;
        let whole = if by_rows { self.rows.clone() } else { self.triangles.clone() };
        let each = (whole.len() as u32).div_ceil(parts).max(1) as usize;
        whole.clone().step_by(each).map(move |start| {
            let range = start..whole.end.min(start + each as u32);
            match by_rows {
                true => Part { triangles: self.triangles.clone(), rows: range },
                false => Part { triangles: range, rows: self.rows.clone() },
            }
        })
    }
}

fn pipeline(
    gpu: &Gpu,
    fragments: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let device = &gpu.device;
    let source = shader::program(&[shader::named("capture")], SAMPLES, &[]);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("capture"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[Some(fragments)],
        ..Default::default()
    });
    let of_corner = wgpu::vertex_attr_array![0 => Float32x4, 1 => Uint32];
    let of_part = wgpu::vertex_attr_array![2 => Uint32x2];
    let vertices = |bytes: usize, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout { array_stride: bytes as u64, step_mode, attributes })
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("capture"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[
                vertices(size_of::<Corner>(), wgpu::VertexStepMode::Vertex, &of_corner),
                vertices(size_of::<[u32; 2]>(), wgpu::VertexStepMode::Instance, &of_part),
            ],
        },
        // Fronts and backs: what shows its back is left out by the shader.
        primitive: wgpu::PrimitiveState::default(),
        // Every fragment counts, however many lie before it.
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("record"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_cut_into_all_of_itself() {
        let part = Part { triangles: 3..20, rows: 0..9 };
        for parts in [2, 5, 17, 90] {
            let cut: Vec<Part> = part.cut(parts).collect();
            assert!(cut.len() > 1 && cut.iter().all(|p| p.rows == part.rows));
            assert!(cut.iter().flat_map(|p| p.triangles.clone()).eq(3..20));
        }
        let single = Part { triangles: 3..4, rows: 2..9 };
        let cut: Vec<Part> = single.cut(2).collect();
        assert!(cut.len() == 2 && cut.iter().flat_map(|p| p.rows.clone()).eq(2..9));
    }
}
