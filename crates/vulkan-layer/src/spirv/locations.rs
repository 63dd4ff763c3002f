//! Which locations the variables between stages take.

use std::collections::BTreeMap;

use super::declared::{Declared, Type};
use super::entry::Entry;
use super::module::{Module, Result};
use super::spec::{class, decoration, model};

/// Arrays within arrays beyond which a type is taken for nonsense.
const DEEPEST: usize = 16;

/// How many locations something takes, or where it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Extent {
    Known(u64),
    /// The length of an array is a specialization constant.
    Specialized,
}

impl Extent {
    fn combine(self, other: Self, f: impl Fn(u64, u64) -> u64) -> Self {
        match (self, other) {
            (Self::Known(a), Self::Known(b)) => Self::Known(f(a, b)),
            _ => Self::Specialized,
        }
    }

    fn plus(self, other: Self) -> Self {
        self.combine(other, u64::saturating_add)
    }

    fn times(self, other: Self) -> Self {
        self.combine(other, u64::saturating_mul)
    }

    fn max(self, other: Self) -> Self {
        self.combine(other, u64::max)
    }
}

/// A structure as a block between stages.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Locations of the members before the first that has one of its own: they follow the block's.
    leading: Extent,
    /// Where the others end at most.
    end: Option<Extent>,
    /// Whether a member has a value for each vertex.
    per_vertex: bool,
}

/// Sizes of all types.
///
/// Found once, in the order of declaration, so that no module, however its types are nested, takes
/// more than a step for each word.
pub(super) struct Locations<'a> {
    declared: &'a Declared,
    sizes: BTreeMap<u32, Extent>,
    blocks: BTreeMap<u32, Block>,
}

impl<'a> Locations<'a> {
    pub(super) fn new(declared: &'a Declared) -> Self {
        let mut all = Self { declared, sizes: BTreeMap::new(), blocks: BTreeMap::new() };
        for id in &declared.order {
            if let Some(ty) = declared.ty(*id)
                && let Some(size) = all.measure(ty)
            {
                all.sizes.insert(*id, size);
                if let Type::Struct { members } = ty {
                    let block = all.block(*id, members);
                    all.blocks.insert(*id, block);
                }
            }
        }
        all
    }

    fn measure(&self, ty: &Type) -> Option<Extent> {
        let size = |id: &u32| self.sizes.get(id).copied();
        Some(match ty {
            Type::Bool | Type::Int { .. } | Type::Float { .. } => Extent::Known(1),
            Type::Vector { of, n } => {
                let (Type::Int { width } | Type::Float { width }) = self.declared.ty(*of)? else {
                    return Some(Extent::Known(1));
                };
                // A location is four words.
                Extent::Known(u64::from(width.div_ceil(32)).saturating_mul((*n).into()).div_ceil(4))
            }
            Type::Matrix { of, n } => size(of)?.times(Extent::Known((*n).into())),
            Type::Array { of, length } => {
                let nested = std::iter::successors(Some(ty), |ty| match ty {
                    Type::Array { of, .. } => self.declared.ty(*of),
                    _ => None,
                });
                if nested.take(DEEPEST + 1).count() > DEEPEST {
                    return None;
                }
                size(of)?.times(self.length(*length))
            }
            Type::Struct { members } => {
                members.iter().try_fold(Extent::Known(0), |sum, m| Some(sum.plus(size(m)?)))?
            }
            Type::Void | Type::Pointer { .. } | Type::Function { .. } => return None,
        })
    }

    fn length(&self, id: u32) -> Extent {
        self.declared.integers.get(&id).map_or(Extent::Specialized, |n| Extent::Known((*n).into()))
    }

    fn block(&self, id: u32, members: &[u32]) -> Block {
        let mut block = Block { leading: Extent::Known(0), end: None, per_vertex: false };
        // Where the next member goes that has no location of its own.
        let mut next = None;
        for (n, member) in members.iter().enumerate() {
            let decorated = |d| self.declared.member_decoration(id, n as u32, d);
            block.per_vertex |= decorated(decoration::PER_VERTEX).is_some();
            if decorated(decoration::BUILT_IN).is_some() {
                continue;
            }
            let size = self.sizes.get(member).copied().unwrap_or(Extent::Known(0));
            let own = decorated(decoration::LOCATION).map(|l| Extent::Known(l.into()));
            match own.or(next) {
                None => block.leading = block.leading.plus(size),
                Some(first) => {
                    let end = first.plus(size);
                    next = Some(end);
                    block.end = Some(block.end.map_or(end, |e| e.max(end)));
                }
            }
        }
        block
    }

    /// The first location after all that a variable takes; `None` where it takes none.
    fn end(&self, id: u32, mut ty: u32) -> Result<Option<Extent>> {
        let strange = || format!("the type of a variable between stages (id {id}) is not known");
        let decorated = |d| self.declared.decoration(id, d);
        if decorated(decoration::BUILT_IN).is_some() {
            return Ok(None);
        }
        let location = decorated(decoration::LOCATION).map(|l| Extent::Known(l.into()));
        let mut count = Extent::Known(1);
        let mut inner = ty;
        while let Some(Type::Array { of, length }) = self.declared.ty(inner)
            && self.sizes.contains_key(&inner)
        {
            let per_vertex = decorated(decoration::PER_VERTEX).is_some()
                || self.blocks.get(of).is_some_and(|b| b.per_vertex);
            if inner == ty && per_vertex {
                ty = *of;
            } else {
                count = count.times(self.length(*length));
            }
            inner = *of;
        }
        let size = *self.sizes.get(&ty).ok_or_else(strange)?;
        let Some(block) = self.blocks.get(&inner) else {
            return Ok(location.map(|l| l.plus(size)));
        };
        let first = match (location, block.end) {
            (None, end) => end,
            (Some(l), None) => Some(l.plus(block.leading)),
            (Some(l), Some(end)) => Some(l.plus(block.leading).max(end)),
        };
        // The further elements of an array follow the first.
        let element = *self.sizes.get(&inner).ok_or_else(strange)?;
        let others = count.combine(Extent::Known(1), u64::saturating_sub);
        Ok(first.map(|f| f.plus(element.times(others))))
    }

    /// The first location after all that an entry point has of a storage class.
    pub(super) fn free(&self, entry: &Entry, class: u32) -> Result<u32> {
        let mut free = 0;
        for id in &entry.interface {
            let Some(variable) = self.declared.variables.get(id).filter(|v| v.class == class)
            else {
                continue;
            };
            match self.end(*id, variable.to)? {
                None => {}
                Some(Extent::Known(end)) => free = free.max(end),
                Some(Extent::Specialized) => {
                    return Err(
                        "an array between stages has a specialization constant's length".into()
                    );
                }
            }
        }
        // The most that any device has is far less.
        u32::try_from(free)
            .ok()
            .filter(|free| *free <= 1 << 16)
            .ok_or_else(|| "a variable between stages has too high a location".into())
    }

    /// Which part of a variable of this type at `first` lies at `location`: indices into arrays,
    /// and the type found there. `None` where it does not reach as far.
    pub(super) fn part(
        &self,
        ty: u32,
        first: u32,
        location: u32,
    ) -> Result<Option<(Vec<u32>, u32)>> {
        let Some(mut offset) = location.checked_sub(first).map(u64::from) else {
            return Ok(None);
        };
        match self.sizes.get(&ty) {
            Some(Extent::Known(size)) if offset >= *size => return Ok(None),
            Some(Extent::Specialized) if offset > 0 => {
                return Err("an array of outputs has a specialization constant's length".into());
            }
            Some(_) => {}
            None => return Ok(None),
        }
        let (mut ty, mut indices) = (ty, Vec::new());
        // Ends, since each type that has a size is made of earlier ones.
        while let Some(Type::Array { of, .. }) = self.declared.ty(ty) {
            let index = match self.sizes.get(of) {
                Some(Extent::Known(size)) if *size > 0 => offset / size,
                _ => 0,
            };
            offset -= index * self.known(*of).unwrap_or(0);
            indices.push(u32::try_from(index).map_err(|_| "an array of outputs is too long")?);
            ty = *of;
        }
        Ok(Some((indices, ty)))
    }

    fn known(&self, ty: u32) -> Option<u64> {
        match self.sizes.get(&ty)? {
            Extent::Known(size) => Some(*size),
            Extent::Specialized => None,
        }
    }
}

fn free(words: &[u32], entry: &str, model: u32, class: u32) -> Result<u32> {
    let module = Module::parse(words)?;
    let declared = Declared::new(&module)?;
    let entry = Entry::find(&module, &declared, model, entry)?;
    Locations::new(&declared).free(&entry, class)
}

/// The first location after all that a vertex shader writes.
///
/// Where the module cannot be read, or has no such vertex shader, that is said in one line.
pub fn outputs(words: &[u32], entry: &str) -> std::result::Result<u32, String> {
    free(words, entry, model::VERTEX, class::OUTPUT)
}

/// The first location after all that a fragment shader reads.
///
/// Where the module cannot be read, or has no such fragment shader, that is said in one line.
pub fn inputs(words: &[u32], entry: &str) -> std::result::Result<u32, String> {
    free(words, entry, model::FRAGMENT, class::INPUT)
}
