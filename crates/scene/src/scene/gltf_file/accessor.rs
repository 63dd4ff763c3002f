//! The numbers that accessors stand for (glTF 2.0, section 3.6.2).

use super::Loader;
use super::extensions::treatment;
use super::json::{Accessor, View};
use screendoor_trace::error::{Error, Result};

/// The most vertex attributes and indices of a file, since many primitives may
/// read the same bytes.
const MAX_ELEMENTS: usize = 1 << 28;
/// The most elements of accessors that have no bytes behind them (sparse ones).
const MAX_ZEROS: usize = 1 << 24;

/// The type of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Type {
    fn from_number(number: u32) -> Option<Self> {
        Some(match number {
            5120 => Type::I8,
            5121 => Type::U8,
            5122 => Type::I16,
            5123 => Type::U16,
            5125 => Type::U32,
            5126 => Type::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::U32 | Type::F32 => 4,
        }
    }

    /// What integers of the type are shares of, where they stand for shares of 1.
    fn whole(self) -> f32 {
        match self {
            Type::I8 => 127.0,
            Type::U8 => 255.0,
            Type::I16 => 32767.0,
            Type::U16 => 65535.0,
            Type::U32 | Type::F32 => 1.0,
        }
    }

    /// The number in the first bytes of `b`.
    fn number(self, b: &[u8]) -> f32 {
        match (self, b) {
            (Type::I8, [a, ..]) => f32::from(*a as i8),
            (Type::U8, [a, ..]) => f32::from(*a),
            (Type::I16, [a, b, ..]) => f32::from(i16::from_le_bytes([*a, *b])),
            (Type::U16, [a, b, ..]) => f32::from(u16::from_le_bytes([*a, *b])),
            (Type::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]) as f32,
            (Type::F32, [a, b, c, d, ..]) => f32::from_le_bytes([*a, *b, *c, *d]),
            _ => unreachable!("as many bytes as the type has"),
        }
    }

    /// The whole number in the first bytes of `b`.
    fn index(self, b: &[u8]) -> u32 {
        match (self, b) {
            (Type::U8, [a, ..]) => u32::from(*a),
            (Type::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
            (Type::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => unreachable!("a type of indices"),
        }
    }
}

/// The types that indices have.
const INDICES: &[Type] = &[Type::U8, Type::U16, Type::U32];

/// When integers stand for shares of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Normalised {
    /// Always, whatever the accessor says.
    Always,
    /// Where the accessor says so.
    AsSaid,
    /// Never: they are numbers of something.
    Never,
}

/// What is read of an accessor: its shapes with their widths, its types.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub shapes: &'static [(&'static str, usize)],
    pub types: &'static [Type],
    pub normalised: Normalised,
}

/// An accessor's numbers, `width` of them an element.
pub(super) struct Numbers {
    pub width: usize,
    numbers: Vec<f32>,
}

impl Numbers {
    /// How many elements there are.
    pub(super) fn len(&self) -> usize {
        self.numbers.len() / self.width
    }

    /// The elements, each made of its first numbers, and of `rest` where it has fewer.
    pub(super) fn arrays<const N: usize>(&self, rest: f32) -> impl Iterator<Item = [f32; N]> {
        let element = move |e: &[f32]| std::array::from_fn(|i| e.get(i).copied().unwrap_or(rest));
        self.numbers.chunks_exact(self.width).map(element)
    }
}

impl Loader<'_> {
    /// The accessor of that number, with its place for errors.
    fn accessor(&self, index: usize, part: &str) -> Result<(&Accessor, String)> {
        let Some(accessor) = self.root.accessors.get(index) else {
            let (what, count) =
                ("it names an accessor that is not there", self.root.accessors.len());
            let what = format!("{what} ({index} of {count})");
            return Err(self.bad(part, what, "export the file again"));
        };
        Ok((accessor, format!("{part}, accessor {index}")))
    }

    /// The numbers of an accessor.
    pub(super) fn numbers(&mut self, index: usize, kind: Kind, part: &str) -> Result<Numbers> {
        let (accessor, part) = self.accessor(index, part)?;
        let width = kind.shapes.iter().find(|(shape, _)| accessor.shape == *shape);
        let (width, of) = self.checked(accessor, width.map(|w| w.1), kind.types, &part)?;
        let (elements, zeros) = (accessor.count, accessor.buffer_view.is_none());
        let normalised = match kind.normalised {
            Normalised::Always => true,
            Normalised::AsSaid => accessor.normalized,
            Normalised::Never => false,
        };
        let (unit, least) = if normalised { (of.whole().recip(), -1.0) } else { (1.0, f32::MIN) };
        self.count(elements, zeros, &part)?;
        let (accessor, _) = self.accessor(index, &part)?;
        let size = of.size();
        let mut numbers = vec![0.0; width * elements];
        let put = |at: usize, bytes: &[u8], numbers: &mut Vec<f32>| {
            for (k, slot) in numbers[width * at..][..width].iter_mut().enumerate() {
                let number = of.number(&bytes[size * k..]);
                // Floats as they are, be they infinite.
                *slot = if of == Type::F32 { number } else { (number * unit).max(least) };
            }
        };
        self.each_element(accessor, width * size, &part, |at, b| put(at, b, &mut numbers))?;
        Ok(Numbers { width, numbers })
    }

    /// The indices of an accessor.
    pub(super) fn indices(&mut self, index: usize, part: &str) -> Result<Vec<u32>> {
        let (accessor, part) = self.accessor(index, part)?;
        let width = (accessor.shape == "SCALAR").then_some(1);
        let (_, of) = self.checked(accessor, width, INDICES, &part)?;
        let (elements, zeros) = (accessor.count, accessor.buffer_view.is_none());
        self.count(elements, zeros, &part)?;
        let (accessor, _) = self.accessor(index, &part)?;
        let mut indices = vec![0; elements];
        self.each_element(accessor, of.size(), &part, |at, b| indices[at] = of.index(b))?;
        Ok(indices)
    }

    /// Counts what an accessor holds, and refuses what would fill the memory.
    fn count(&mut self, elements: usize, zeros: bool, part: &str) -> Result<()> {
        self.elements = self.elements.saturating_add(elements);
        if zeros {
            self.zeros = self.zeros.saturating_add(elements);
        }
        let what = if self.elements > MAX_ELEMENTS {
            "there are more than 2^28 vertex attributes and indices up to here"
        } else if self.zeros > MAX_ZEROS {
            "there are more than 2^24 elements without bytes up to here"
        } else {
            return Ok(());
        };
        Err(Error::unsupported(format_args!("{}, {part}", self.place), what, "split the scene"))
    }

    /// An accessor's width and type, where they are among those that may be; refused is
    /// what reaches beyond its bytes, before anything is allocated for it.
    fn checked(
        &self,
        accessor: &Accessor,
        width: Option<usize>,
        types: &[Type],
        part: &str,
    ) -> Result<(usize, Type)> {
        let bad = |what: &str| Err(self.bad(part, what, "export the file again"));
        let Some(of) = Type::from_number(accessor.component_type) else {
            let what = format!(
                "its componentType {} is not one that glTF allows",
                accessor.component_type
            );
            return Err(self.bad(part, what, "export the file again"));
        };
        let Some(width) = width.filter(|_| types.contains(&of)) else {
            return bad("its type is not one that glTF allows here");
        };
        if accessor.count == 0 || accessor.buffer_view.is_none() && accessor.count > MAX_ZEROS {
            return bad("it reaches beyond its buffer");
        }
        if accessor.sparse.as_ref().is_some_and(|sparse| sparse.count > accessor.count) {
            return bad("it has more sparse values than elements");
        }
        if let Some(view) = accessor.buffer_view {
            let size = width * of.size();
            drop(self.elements(view, accessor.byte_offset, size, accessor.count, part)?);
        }
        Ok((width, of))
    }

    /// Hands over the bytes of each element that has some, `size` bytes long, with its
    /// number; those of sparse values later.
    fn each_element(
        &self,
        accessor: &Accessor,
        size: usize,
        part: &str,
        mut each: impl FnMut(usize, &[u8]),
    ) -> Result<()> {
        if let Some(view) = accessor.buffer_view {
            let elements = self.elements(view, accessor.byte_offset, size, accessor.count, part)?;
            elements.enumerate().for_each(|(i, bytes)| each(i, bytes));
        }
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let (indices, values) = (&sparse.indices, &sparse.values);
        let of = Type::from_number(indices.component_type).filter(|of| INDICES.contains(of));
        let Some(of) = of else {
            let what = "the type of its sparse indices is not one that glTF allows";
            return Err(self.bad(part, what, "export the file again"));
        };
        let n = sparse.count;
        let numbers =
            self.elements(indices.buffer_view, indices.byte_offset, of.size(), n, part)?;
        let values = self.elements(values.buffer_view, values.byte_offset, size, n, part)?;
        for (number, bytes) in numbers.zip(values) {
            let number = of.index(number) as usize;
            if number >= accessor.count {
                let count = accessor.count;
                let what = format!("its sparse values include element {number} of only {count}");
                return Err(self.bad(part, what, "export the file again"));
            }
            each(number, bytes);
        }
        Ok(())
    }

    /// The bytes of `count` elements of `size` bytes in a buffer view.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        size: usize,
        count: usize,
        part: &str,
    ) -> Result<impl Iterator<Item = &[u8]>> {
        let (view, bytes) = self.view(view, part)?;
        let stride = view.byte_stride.unwrap_or(size);
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size)?.checked_add(offset));
        if stride < size || end.is_none_or(|end| end > bytes.len()) {
            let what = "it reaches beyond its buffer";
            return Err(self.bad(part, what, "export the file again"));
        }
        Ok((0..count).map(move |i| &bytes[offset + i * stride..][..size]))
    }

    /// A buffer view and its bytes.
    pub(super) fn view(&self, index: usize, part: &str) -> Result<(&View, &[u8])> {
        let bad = |what: &str| self.bad(part, what, "export the file again");
        let gone = || bad("it names a buffer view that is not there");
        let view = self.root.buffer_views.get(index).ok_or_else(gone)?;
        let buffer = self.buffers.get(view.buffer);
        let buffer = buffer.ok_or_else(|| bad("it names a buffer that is not there"))?;
        let Some(buffer) = buffer else {
            let packed = view.extensions.names().find(|name| name.contains("meshopt"));
            return Err(match packed {
                Some(name) => Error::unsupported(
                    format_args!("{}, {part}", self.place),
                    format_args!("its bytes are packed by {name}, which is not read"),
                    treatment(name).hint(),
                ),
                None => bad("its buffer's bytes are missing"),
            });
        };
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end));
        Ok((view, bytes.ok_or_else(|| bad("it reaches beyond its buffer"))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_shares_of_the_largest() {
        let share = |of: Type, bytes: &[u8]| of.number(bytes) * of.whole().recip();
        assert_eq!(share(Type::I8, &[0x81]), -1.0);
        assert_eq!(share(Type::U8, &[0xff]), 1.0);
        assert_eq!(share(Type::U16, &[0xff, 0xff]), 1.0);
        assert_eq!(share(Type::I16, &[0x01, 0x80]), -1.0);
        assert_eq!(Type::U32.index(&[1, 0, 0, 1]), 0x0100_0001);
    }
}
