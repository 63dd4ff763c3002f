//! What programs are told, in the layout that they read it in.

use bytemuck::{Pod, Zeroable};

use screendoor_rop::Frame;
use screendoor_trace::tile::{TILE_SIDE, TileGrid};
use screendoor_trace::trace::ColumnId;

/// Declares a structure that a shader declares too, and a list of its members, by which a
/// test holds the one against the other.
macro_rules! mirrored {
    ($(#[$meta:meta])* $name:ident { $($(#[$member_meta:meta])* $member:ident : $type:ty),+ $(,)? }) => {
        $(#[$meta])*
        #[repr(C, align(16))]
        #[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
        pub(super) struct $name { $($(#[$member_meta])* pub $member: $type),+ }

        #[cfg(test)]
        impl $name {
            /// Names, places and sizes of its members.
            const MEMBERS: &[(&str, usize, usize)] = &[
                $((stringify!($member), std::mem::offset_of!($name, $member), size_of::<$type>())),+
            ];
        }
    };
}

mirrored! {
    /// Where a column of a chunk lies, or the value that it has in every row.
    Column { at: u32, low: u32, high: u32, unused: u32 }
}

mirrored! {
    /// As in `shaders/bindings.wgsl`.
    Params {
        background: [f32; 3],
        rows: u32,
        pass_number: u32,
        first_pixel: u32,
        pixels: u32,
        taken: u32,
        seed: u32,
        zero: u32,
        samples_low: u32,
        samples_high: u32,
        width: u32,
        height: u32,
        side_bits: u32,
        tile_columns: u32,
        from_fragment: u32,
        fragments: u32,
        digit_at: u32,
        blocks: u32,
        columns: [Column; ColumnId::COUNT],
    }
}

impl Params {
    /// Of a frame, without a chunk.
    pub(crate) fn of(frame: &Frame) -> Self {
        let grid = frame.grid;
        let [low, high] = words(screendoor_trace::trace::SampleMask::first(frame.samples()).0);
        Params {
            background: frame.background,
            seed: frame.seed,
            samples_low: low,
            samples_high: high,
            width: grid.width(),
            height: grid.height(),
            side_bits: side_bits(grid),
            tile_columns: grid.width().div_ceil(TILE_SIDE as u32),
            ..Params::default()
        }
    }
}

/// As [`screendoor_rop::PixelOrder::index`] takes it.
fn side_bits(grid: TileGrid) -> u32 {
    grid.width().max(grid.height()).next_power_of_two().trailing_zeros()
}

/// The two words of a long one, the lower first.
pub(super) fn words(long: u64) -> [u32; 2] {
    [long as u32, (long >> 32) as u32]
}

#[cfg(test)]
mod tests {
    use wgpu::naga::TypeInner;
    use wgpu::naga::front::wgsl;

    use super::*;
    use crate::shader;

    /// The members of a shader's structure, but for gaps.
    fn members(name: &str) -> (Vec<(String, usize, usize)>, usize) {
        let text = shader::program(&[shader::named("bindings")], 8, &[]);
        let module = wgsl::parse_str(&text).unwrap();
        let mut layouter = wgpu::naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        let (_, found) =
            module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let TypeInner::Struct { members, span } = &found.inner else {
            panic!("{name} is no structure");
        };
        let list = members.iter().map(|m| {
            let size = layouter[m.ty].size as usize;
            (m.name.clone().unwrap(), m.offset as usize, size)
        });
        (list.collect(), *span as usize)
    }

    #[test]
    fn structures_are_those_of_the_shaders() {
        for (name, ours, size) in [
            ("Column", Column::MEMBERS, size_of::<Column>()),
            ("Params", Params::MEMBERS, size_of::<Params>()),
        ] {
            let (theirs, span) = members(name);
            let ours: Vec<_> = ours
                .iter()
                .filter(|(member, ..)| name == "Column" || *member != "unused")
                .map(|(member, at, size)| (member.to_string(), *at, *size))
                .collect();
            assert_eq!(ours, theirs, "{name}");
            assert_eq!(size, span, "{name}");
        }
    }
}
