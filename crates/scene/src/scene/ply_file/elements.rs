//! The elements of PLY files, as text or as bytes in either order: read in place, since the
//! library makes a map of each row.

use ply_rs_bw::ply::{ElementDef, PropertyType, ScalarType};

use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

/// The most numbers that are held of elements with lists and of text, 8 bytes each: a byte of
/// the file may be one.
pub(super) const MAX_NUMBERS: usize = 1 << 28;

/// An element: rows of the same properties.
pub(in crate::scene) struct Element<'a> {
    pub(in crate::scene) name: String,
    /// How many rows it has.
    pub(in crate::scene) count: usize,
    columns: Vec<Column>,
    rows: Rows<'a>,
}

/// A property with one value a row, and where the rows have it.
struct Column {
    name: String,
    scalar: ScalarType,
    at: usize,
}

/// Where values are.
enum Rows<'a> {
    /// In the file, a row every so many bytes.
    Bytes { bytes: &'a [u8], stride: usize, big_endian: bool },
    /// Taken from text or from between lists, row after row of `width` values.
    Values { values: Vec<f64>, width: usize, lists: Vec<List> },
}

/// A property with a list a row.
pub(in crate::scene) struct List {
    pub(in crate::scene) name: String,
    /// Where each row's list ends among the values.
    ends: Vec<usize>,
    values: Vec<f64>,
}

impl List {
    /// Every row's list.
    pub(in crate::scene) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.values[start..*end])
    }
}

/// Which value of each row a property is.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Place(usize);

impl Element<'_> {
    /// The property of that name; `None` where there is none with one value a row.
    pub(in crate::scene) fn column(&self, name: &str) -> Option<Place> {
        self.columns.iter().position(|c| c.name == name).map(Place)
    }

    /// The properties of these names with one value a row; the first name that is missing.
    pub(in crate::scene) fn columns<'n, const N: usize>(
        &self,
        names: [&'n str; N],
    ) -> std::result::Result<[Place; N], &'n str> {
        let mut found = [Place(0); N];
        for (place, name) in found.iter_mut().zip(names) {
            *place = self.column(name).ok_or(name)?;
        }
        Ok(found)
    }

    /// The names of the properties with one value a row.
    pub(in crate::scene) fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|c| c.name.as_str())
    }

    /// The properties with a list a row.
    pub(in crate::scene) fn lists(&self) -> &[List] {
        match &self.rows {
            Rows::Bytes { .. } => &[],
            Rows::Values { lists, .. } => lists,
        }
    }

    /// The greatest whole number that the property's type holds; 1 for real numbers.
    pub(in crate::scene) fn greatest(&self, Place(column): Place) -> f64 {
        match self.columns[column].scalar {
            ScalarType::Char => f64::from(i8::MAX),
            ScalarType::UChar => f64::from(u8::MAX),
            ScalarType::Short => f64::from(i16::MAX),
            ScalarType::UShort => f64::from(u16::MAX),
            ScalarType::Int => f64::from(i32::MAX),
            ScalarType::UInt => f64::from(u32::MAX),
            ScalarType::Float | ScalarType::Double => 1.0,
        }
    }

    /// The value of a property in a row.
    pub(in crate::scene) fn value(&self, row: usize, Place(column): Place) -> f64 {
        let Column { scalar, at, .. } = &self.columns[column];
        match &self.rows {
            Rows::Values { values, width, .. } => values[row * width + at],
            Rows::Bytes { bytes, stride, big_endian } => {
                number(&bytes[row * stride + at..], scalar, *big_endian)
            }
        }
    }
}

/// How many bytes a number has.
fn size(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The number that `bytes` begin with; all of them hold in double precision.
fn number(bytes: &[u8], scalar: &ScalarType, big_endian: bool) -> f64 {
    let mut word = [0; 8];
    let word = &mut word[..size(scalar)];
    word.copy_from_slice(&bytes[..word.len()]);
    if big_endian {
        word.reverse();
    }
    macro_rules! read {
        ($type:ty) => {
            <$type>::from_le_bytes((&*word).try_into().expect("as many bytes as it has"))
        };
    }
    match scalar {
        ScalarType::Char => f64::from(read!(i8)),
        ScalarType::UChar => f64::from(read!(u8)),
        ScalarType::Short => f64::from(read!(i16)),
        ScalarType::UShort => f64::from(read!(u16)),
        ScalarType::Int => f64::from(read!(i32)),
        ScalarType::UInt => f64::from(read!(u32)),
        ScalarType::Float => f64::from(read!(f32)),
        ScalarType::Double => read!(f64),
    }
}

/// The next numbers of a file, whatever their encoding.
pub(super) struct Numbers<'a> {
    pub(super) from: Encoded<'a>,
    /// How many more may be held.
    pub(super) left: usize,
}

pub(super) enum Encoded<'a> {
    Bytes { bytes: Bytes<'a>, big_endian: bool },
    Text { place: &'a str, words: std::str::SplitAsciiWhitespace<'a> },
}

impl<'a> Numbers<'a> {
    fn next(&mut self, scalar: &ScalarType, of: &str) -> Result<f64> {
        match &mut self.from {
            Encoded::Bytes { bytes, big_endian } => {
                Ok(number(bytes.take(size(scalar))?, scalar, *big_endian))
            }
            Encoded::Text { place, words } => {
                let bad = |what: String| Bytes::new(place, &[]).bad(what);
                let Some(word) = words.next() else {
                    return Err(bad(format!("it ends within its element '{of}'")));
                };
                word.parse().map_err(|_| {
                    let few: String = word.chars().take(20).collect();
                    bad(format!("in its element '{of}' stands '{few}' where a number is needed"))
                })
            }
        }
    }

    /// The same, for one that is held.
    fn held(&mut self, scalar: &ScalarType, of: &str) -> Result<f64> {
        let Some(left) = self.left.checked_sub(1) else {
            let what = format!("up to its element '{of}' it has too many numbers to be held");
            let hint = format!("divide it into files of fewer than {MAX_NUMBERS} numbers");
            return Err(match &self.from {
                Encoded::Bytes { bytes, .. } => bytes.unsupported(what, hint),
                Encoded::Text { place, .. } => Bytes::new(place, &[]).unsupported(what, hint),
            });
        };
        self.left = left;
        self.next(scalar, of)
    }

    /// All rows of an element, where they lie in the file as they are; else one by one.
    pub(super) fn element(&mut self, name: String, definition: ElementDef) -> Result<Element<'a>> {
        let (mut columns, mut lists) = (Vec::new(), Vec::new());
        let mut stride = 0;
        // What stands in a row, in its order: which column or list, and a list's types.
        let mut order: Vec<(ScalarType, Option<ScalarType>)> = Vec::new();
        for (name, property) in definition.properties {
            match property.data_type {
                PropertyType::Scalar(scalar) => {
                    order.push((scalar.clone(), None));
                    stride += size(&scalar);
                    columns.push(Column { name, scalar, at: stride });
                }
                PropertyType::List(length, scalar) => {
                    order.push((scalar, Some(length)));
                    lists.push(List { name, ends: Vec::new(), values: Vec::new() });
                }
            }
        }
        columns.iter_mut().for_each(|c| c.at -= size(&c.scalar));
        let count = definition.count;
        if let (Encoded::Bytes { bytes, big_endian }, []) = (&mut self.from, &lists[..]) {
            let length = count.checked_mul(stride).filter(|length| *length <= bytes.left());
            let Some(length) = length else {
                let (left, what) = (bytes.left(), format!("{count} rows of {stride} bytes"));
                let what = format!("its element '{name}' has {what}, and {left} bytes are left");
                return Err(bytes.bad(what));
            };
            let rows = Rows::Bytes { bytes: bytes.take(length)?, stride, big_endian: *big_endian };
            return Ok(Element { name, count, columns, rows });
        }
        columns.iter_mut().enumerate().for_each(|(i, c)| c.at = i);
        // Rows of nothing have no bytes: a file may claim any number of them.
        let mut values = Vec::new();
        let rows = if order.is_empty() { 0 } else { count };
        for _ in 0..rows {
            let mut list = lists.iter_mut();
            for (scalar, length) in &order {
                match length {
                    None => values.push(self.held(scalar, &name)?),
                    Some(length) => {
                        let many = self.held(length, &name)?;
                        let list = list.next().expect("one for each property");
                        if !(many >= 0.0 && many.fract() == 0.0) {
                            return Err(self
                                .bad(format!("its element '{name}' has a list of {many} values")));
                        }
                        // Counted as read: a file may claim any number.
                        let mut left = many;
                        while left > 0.0 {
                            list.values.push(self.held(scalar, &name)?);
                            left -= 1.0;
                        }
                        list.ends.push(list.values.len());
                    }
                }
            }
        }
        let width = columns.len();
        Ok(Element { name, count, columns, rows: Rows::Values { values, width, lists } })
    }

    fn bad(&self, what: String) -> screendoor_trace::error::Error {
        match &self.from {
            Encoded::Bytes { bytes, .. } => bytes.bad(what),
            Encoded::Text { place, .. } => Bytes::new(place, &[]).bad(what),
        }
    }

    /// Nothing but white space may follow.
    pub(super) fn end(&mut self) -> Result<()> {
        let (more, what) = match &mut self.from {
            Encoded::Bytes { bytes, .. } => (bytes.left(), "bytes"),
            Encoded::Text { words, .. } => (words.count(), "numbers"),
        };
        match more {
            0 => Ok(()),
            more => Err(self.bad(format!("it has {more} {what} more than its header says"))),
        }
    }
}
