//! What a module declares before its functions, as far as it matters here.

use std::collections::{BTreeMap, BTreeSet};

use super::module::{Instruction, Module, Result};
use super::spec::{decoration, op};

/// A type; others than these are left alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Type {
    Void,
    Bool,
    Int { width: u32 },
    Float { width: u32 },
    Vector { of: u32, n: u32 },
    Matrix { of: u32, n: u32 },
    Array { of: u32, length: u32 },
    Struct { members: Vec<u32> },
    Pointer { class: u32, to: u32 },
    Function { returns: u32, parameters: usize },
}

impl Type {
    /// Result id and type of an instruction that declares one of these.
    fn parse(instruction: &Instruction) -> Result<Option<(u32, Self)>> {
        let at = |n| instruction.operand(n);
        let ty = match instruction.op() {
            op::TYPE_VOID => Self::Void,
            op::TYPE_BOOL => Self::Bool,
            op::TYPE_INT => Self::Int { width: at(1)? },
            // A third operand says that it is no IEEE number (bfloat16).
            op::TYPE_FLOAT if instruction.operands().len() == 2 => Self::Float { width: at(1)? },
            op::TYPE_VECTOR => Self::Vector { of: at(1)?, n: at(2)? },
            op::TYPE_MATRIX => Self::Matrix { of: at(1)?, n: at(2)? },
            op::TYPE_ARRAY => Self::Array { of: at(1)?, length: at(2)? },
            op::TYPE_STRUCT => {
                at(0)?;
                Self::Struct { members: instruction.operands()[1..].to_vec() }
            }
            op::TYPE_POINTER => Self::Pointer { class: at(1)?, to: at(2)? },
            op::TYPE_FUNCTION => {
                Self::Function { returns: at(1)?, parameters: instruction.operands().len() - 2 }
            }
            _ => return Ok(None),
        };
        Ok(Some((at(0)?, ty)))
    }

    /// Whether two of a kind may not be declared: the other kinds differ by their decorations.
    fn is_unique(&self) -> bool {
        !matches!(self, Self::Array { .. } | Self::Struct { .. })
    }
}

/// A variable outside of functions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variable {
    pub(super) class: u32,
    /// The type that is pointed to.
    pub(super) to: u32,
    /// Whether it has a value from the beginning.
    pub(super) initialized: bool,
}

/// What is decorated: an id, or a member of a structure.
type Place = (u32, Option<u32>);

/// Decorations that matter here; others are not kept.
const KEPT: [u32; 7] = [
    decoration::BUILT_IN,
    decoration::SAMPLE,
    decoration::LOCATION,
    decoration::COMPONENT,
    decoration::INDEX,
    decoration::DESCRIPTOR_SET,
    decoration::PER_VERTEX,
];

/// What a module declares.
#[derive(Debug, Default)]
pub(super) struct Declared {
    pub(super) types: BTreeMap<u32, Type>,
    /// Ids of types in the order of their declaration: each is made of earlier ones.
    pub(super) order: Vec<u32>,
    /// Constants of 32-bit integers. Specialization constants are not among them: their value is
    /// not known before the pipeline is made.
    pub(super) integers: BTreeMap<u32, u32>,
    /// Instructions that declare unique types or constants, without their result, to that.
    pub(super) known: BTreeMap<Vec<u32>, u32>,
    pub(super) variables: BTreeMap<u32, Variable>,
    decorations: BTreeMap<(Place, u32), u32>,
    /// Which member of a structure is this built-in.
    built_in_members: BTreeMap<(u32, u32), u32>,
    /// Structures with a member that is interpolated for each sample.
    sampled: BTreeSet<u32>,
    pub(super) capabilities: BTreeSet<u32>,
}

impl Declared {
    pub(super) fn new(module: &Module) -> Result<Self> {
        let mut declared = Self::default();
        for instruction in module.declarations() {
            declared.take(instruction)?;
        }
        // New ids begin at the bound.
        let Self { types, known, variables, .. } = &declared;
        let ids = types.keys().chain(known.values()).chain(variables.keys());
        if ids.into_iter().any(|id| *id >= module.header[3]) {
            return Err("the module has ids that its header says it has not".into());
        }
        Ok(declared)
    }

    fn take(&mut self, i: &Instruction) -> Result<()> {
        let at = |n| i.operand(n);
        let operands = i.operands();
        match i.op() {
            op::CAPABILITY => {
                self.capabilities.insert(at(0)?);
            }
            op::DECORATE => self.decorate((at(0)?, None), at(1)?, operands.get(2)),
            op::MEMBER_DECORATE => {
                self.decorate((at(0)?, Some(at(1)?)), at(2)?, operands.get(3));
            }
            // A group is decorated before it decorates.
            op::GROUP_DECORATE => {
                let group = at(0)?;
                operands[1..].iter().for_each(|id| self.decorate_as(group, (*id, None)));
            }
            op::GROUP_MEMBER_DECORATE => {
                let group = at(0)?;
                for pair in operands[1..].chunks_exact(2) {
                    self.decorate_as(group, (pair[0], Some(pair[1])));
                }
            }
            op::CONSTANT => {
                let (ty, id, value) = (at(0)?, at(1)?, at(2)?);
                if operands.len() == 3 {
                    if self.types.get(&ty) == Some(&Type::Int { width: 32 }) {
                        self.integers.entry(id).or_insert(value);
                    }
                    self.known.entry(vec![op::CONSTANT, ty, value]).or_insert(id);
                }
            }
            op::VARIABLE => {
                let (pointer, id, class) = (at(0)?, at(1)?, at(2)?);
                if let Some(Type::Pointer { to, .. }) = self.types.get(&pointer) {
                    let initialized = operands.len() > 3;
                    let variable = Variable { class, to: *to, initialized };
                    self.variables.entry(id).or_insert(variable);
                }
            }
            _ => {
                if let Some((id, ty)) = Type::parse(i)?
                    && !self.types.contains_key(&id)
                {
                    if ty.is_unique() {
                        let key = [&[i.op()], &operands[1..]].concat();
                        self.known.entry(key).or_insert(id);
                    }
                    self.types.insert(id, ty);
                    self.order.push(id);
                }
            }
        }
        Ok(())
    }

    fn decorate(&mut self, place: Place, decoration: u32, value: Option<&u32>) {
        if !KEPT.contains(&decoration) {
            return;
        }
        let value = value.copied().unwrap_or(0);
        self.decorations.entry((place, decoration)).or_insert(value);
        // What is asked of a structure is kept with it, so that nobody has to go through its
        // members.
        if let (id, Some(member)) = place {
            match decoration {
                decoration::BUILT_IN => {
                    self.built_in_members.entry((id, value)).or_insert(member);
                }
                decoration::SAMPLE => {
                    self.sampled.insert(id);
                }
                _ => {}
            }
        }
    }

    fn decorate_as(&mut self, group: u32, place: Place) {
        for decoration in KEPT {
            if let Some(value) = self.decoration(group, decoration) {
                self.decorate(place, decoration, Some(&value));
            }
        }
    }

    /// A decoration's first operand, or 0 where it has none.
    pub(super) fn decoration(&self, id: u32, decoration: u32) -> Option<u32> {
        self.decorations.get(&((id, None), decoration)).copied()
    }

    /// The same of a member of a structure.
    pub(super) fn member_decoration(&self, id: u32, member: u32, decoration: u32) -> Option<u32> {
        self.decorations.get(&((id, Some(member)), decoration)).copied()
    }

    /// Which member of a structure is built in so.
    pub(super) fn built_in_member(&self, id: u32, which: u32) -> Option<u32> {
        self.built_in_members.get(&(id, which)).copied()
    }

    /// Whether a member of a structure is interpolated for each sample.
    pub(super) fn samples(&self, id: u32) -> bool {
        self.sampled.contains(&id)
    }

    /// Every value that a decoration has in the module.
    pub(super) fn values(&self, decoration: u32) -> impl Iterator<Item = u32> {
        self.decorations.iter().filter(move |((_, d), _)| *d == decoration).map(|(_, v)| *v)
    }

    pub(super) fn ty(&self, id: u32) -> Option<&Type> {
        self.types.get(&id)
    }

    /// Of what a vector is made, and how much of it; a scalar is made of one of itself.
    pub(super) fn components(&self, id: u32) -> Option<(&Type, u32)> {
        match self.ty(id)? {
            Type::Vector { of, n } => Some((self.ty(*of)?, *n)),
            ty @ (Type::Bool | Type::Int { .. } | Type::Float { .. }) => Some((ty, 1)),
            _ => None,
        }
    }
}
