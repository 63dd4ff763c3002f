//! The buffer that a fragment shader appends to, on anybody's device.

use bytemuck::{Pod, Zeroable};

use crate::device::most_bytes;
use crate::guard::Guard;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// What a shader that records fragments begins with: `captured_depth` and
/// `append_fragment`, bound as group 0, binding 0.
pub const APPEND_WGSL: &str = include_str!("../shaders/append.wgsl");

/// [`APPEND_WGSL`], bound as another group.
pub fn append_wgsl(group: u32) -> String {
    APPEND_WGSL.replace("@group(0)", &format!("@group({group})"))
}

/// A fragment as the shader records it.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct RawFragment {
    /// The pixel's column, and its row times 65536.
    pub pixel: u32,
    /// The primitive's number in the order of drawing.
    pub primitive: u32,
    /// The object's number.
    pub object: u32,
    /// Bit `s` stands for sample `s`.
    pub coverage: u32,
    /// Depth at the pixel's centre: 0 at the near plane, 1 at the far one.
    pub z: f32,
    /// How it changes per pixel, to the right and downwards.
    pub slopes: [f32; 2],
    /// Colour in the trace's space, not multiplied by alpha.
    pub colour: [f32; 3],
    /// Opacity.
    pub alpha: f32,
}

impl RawFragment {
    /// The pixel: column and row.
    pub fn at(&self) -> [u16; 2] {
        [self.pixel as u16, (self.pixel >> 16) as u16]
    }

    /// The depth over the pixel in a trace's units. A plane that leaves the depth range at
    /// the pixel's centre, or half of it within a pixel, is flat.
    pub fn depth(&self) -> DepthPlane {
        let whole = |v: f32| (f64::from(v) * f64::from(u32::MAX)).round();
        let [dx, dy] = self.slopes.map(whole);
        let fits = |slope: f64| slope.abs() <= f64::from(i32::MAX);
        let inside = (0.0..=1.0).contains(&self.z) && fits(dx) && fits(dy);
        let [dzdx, dzdy] = if inside { [dx as i32, dy as i32] } else { [0, 0] };
        // What is no number becomes 0.
        DepthPlane { z: Unorm32(whole(self.z.clamp(0.0, 1.0)) as u32), dzdx, dzdy }
    }

    /// The row of a trace that it becomes; alpha is clamped to [0, 1].
    pub fn fragment(&self) -> Fragment {
        let [x, y] = self.at();
        Fragment {
            x,
            y,
            coverage: SampleMask(self.coverage.into()),
            depth: self.depth(),
            colour: self.colour,
            alpha: self.alpha.clamp(0.0, 1.0),
            primitive: self.primitive,
            object: self.object,
            ..Fragment::default()
        }
    }
}

/// What a buffer holds after drawing.
#[derive(Clone, PartialEq, Debug)]
pub enum Captured {
    /// All fragments, as [`in_order`] has them.
    All(Vec<RawFragment>),
    /// There were so many, and there was not room for all: draw again with a larger buffer,
    /// or less at a time.
    TooMany(u64),
}

/// Restores what shaders append in any order to API order: by primitive, then by row, then
/// by column. A primitive that clipping has split can leave several fragments in a pixel:
/// their coverage is put together, the rest is that of the one that covers most.
pub fn in_order(mut raw: Vec<RawFragment>) -> Vec<RawFragment> {
    // By all that may differ, so that the outcome does not depend on the order of appending.
    let key = |f: &RawFragment| {
        let most = (32 - f.coverage.count_ones(), f.coverage);
        (f.primitive, f.pixel, most, f.z.to_bits())
    };
    raw.sort_unstable_by_key(key);
    raw.dedup_by(|next, kept| {
        let same = (next.primitive, next.pixel) == (kept.primitive, kept.pixel);
        if same {
            kept.coverage |= next.coverage;
        }
        same
    });
    raw
}

/// A storage buffer that takes fragments, with its binding.
#[derive(Debug)]
pub struct FragmentBuffer {
    buffer: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    capacity: u32,
}

/// The count that the buffer begins with.
const HEAD: u64 = 4;
/// What one fragment takes.
const EACH: u64 = size_of::<RawFragment>() as u64;

impl FragmentBuffer {
    /// Makes room for `capacity` fragments of 44 bytes.
    ///
    /// # Errors
    /// [`Error::Config`] for more than [`FragmentBuffer::most`], [`Error::Gpu`] where there
    /// is no memory.
    pub fn new(device: &wgpu::Device, capacity: u32) -> Result<Self> {
        let most = Self::most(device);
        if !(1..=most).contains(&capacity) {
            return Err(Error::config(
                format_args!("a buffer for {capacity} fragments cannot be"),
                format_args!("the device's buffers hold 1 to {most}"),
            ));
        }
        guard().run(device, "making room for fragments", || {
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("captured fragments"),
                size: HEAD + u64::from(capacity) * EACH,
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("captured fragments"),
                entries: &[wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Storage { read_only: false },
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                    count: None,
                }],
            });
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("captured fragments"),
                layout: &layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: buffer.as_entire_binding(),
                }],
            });
            FragmentBuffer { buffer, layout, group, capacity }
        })
    }

    /// How many fragments a buffer of this device can take.
    pub fn most(device: &wgpu::Device) -> u32 {
        (most_bytes(device).saturating_sub(HEAD) / EACH).min(u64::from(u32::MAX >> 1)) as u32
    }

    /// How many fragments it has room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// The layout of its group, for a pipeline's layout.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Its group, for a render pass.
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Forgets what it holds, before the passes that `encoder` gets next.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.buffer, 0, Some(HEAD));
    }

    /// Waits for what was submitted, and brings the fragments back.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device was lost or has no memory for that.
    pub fn read(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Captured> {
        let guard = guard();
        let doing = "reading fragments";
        let count =
            guard.read((device, queue), (&self.buffer, 0..HEAD), doing, |words| words[0])?;
        if count > self.capacity {
            return Ok(Captured::TooMany(count.into()));
        }
        if count == 0 {
            return Ok(Captured::All(Vec::new()));
        }
        let part = (&self.buffer, HEAD..HEAD + u64::from(count) * EACH);
        let look = |words: &[u32]| bytemuck::cast_slice(words).to_vec();
        let fragments = guard.read((device, queue), part, doing, look)?;
        Ok(Captured::All(in_order(fragments)))
    }
}

/// Of anybody's device, whose name is not known here.
fn guard() -> Guard {
    Guard::new("the GPU")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_restored_and_split_primitives_are_whole_again() {
        let raw = |primitive, x: u32, y: u32, coverage| RawFragment {
            pixel: x | y << 16,
            primitive,
            coverage,
            z: coverage as f32,
            ..RawFragment::default()
        };
        let drawn = [raw(1, 0, 0, 1), raw(0, 5, 1, 0b0111), raw(0, 5, 1, 0b1000), raw(0, 7, 0, 2)];
        let expected = [
            raw(0, 7, 0, 2),
            RawFragment { coverage: 0b1111, ..raw(0, 5, 1, 0b0111) },
            raw(1, 0, 0, 1),
        ];
        for turn in 0..drawn.len() {
            let mut turned = drawn.to_vec();
            turned.rotate_left(turn);
            assert_eq!(in_order(turned), expected);
        }
    }

    #[test]
    fn depths_become_unorm32() {
        let raw = |z, slopes| RawFragment { z, slopes, ..RawFragment::default() }.depth();
        let half = raw(0.5, [0.25, -0.25]);
        assert_eq!(half.z, Unorm32(1 << 31));
        assert_eq!([half.dzdx, half.dzdy], [1 << 30, -(1 << 30)]);
        assert_eq!(raw(1.0, [0.0; 2]).z, Unorm32::FAR);
        // Steeper than a trace can say, outside, and no number.
        for (z, slopes) in [(0.5, [0.6, 0.0]), (1.5, [0.1, 0.0]), (f32::NAN, [0.1; 2])] {
            let plane = raw(z, slopes);
            assert_eq!([plane.dzdx, plane.dzdy], [0, 0], "{z}");
        }
        assert_eq!(raw(f32::NAN, [f32::NAN; 2]).z, Unorm32::NEAR);
    }

    #[test]
    fn the_shader_declares_what_is_read() {
        let declared = APPEND_WGSL.split("struct CapturedFragment {").nth(1).unwrap();
        let declared = declared.split("\n}").next().unwrap();
        let members = declared.lines().filter(|l| l.trim_end().ends_with(',')).count();
        assert_eq!(members * 4, size_of::<RawFragment>());
        assert!(append_wgsl(3).contains("@group(3) @binding(0)"));
    }
}
