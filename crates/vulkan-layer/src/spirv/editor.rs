//! A module with additions: types, constants, variables and a new entry point that calls the old
//! one. What is there already is used where a second would not be allowed, and nothing is moved.

use std::collections::BTreeSet;

use super::declared::{Declared, Type, Variable};
use super::entry::{Entry, lists_all};
use super::locations::Locations;
use super::module::{Module, Result, instruction, string_words};
use super::spec::{class, decoration, memory, op};

/// Ids below this are left to grow from, far above what any compiler gives.
const MOST_IDS: u32 = 1 << 30;

/// An input or output that is built in: how it is found, and its type.
#[derive(Clone, Copy, Debug)]
pub(super) struct BuiltIn {
    pub(super) variable: u32,
    /// Of a block.
    pub(super) member: Option<u32>,
    pub(super) ty: u32,
}

pub(super) struct Editor<'a> {
    pub(super) module: &'a Module<'a>,
    pub(super) declared: Declared,
    pub(super) entry: Entry,
    pub(super) bound: u32,
    /// Variables of the new entry point.
    pub(super) listed: Vec<u32>,
    pub(super) capabilities: BTreeSet<u32>,
    pub(super) extensions: BTreeSet<&'static str>,
    pub(super) addressing: Option<u32>,
    pub(super) decorations: Vec<u32>,
    pub(super) globals: Vec<u32>,
    pub(super) function: Vec<u32>,
}

impl<'a> Editor<'a> {
    pub(super) fn new(module: &'a Module<'a>, model: u32, entry: &str) -> Result<Self> {
        let declared = Declared::new(module)?;
        let entry = Entry::find(module, &declared, model, entry)?;
        let bound = module.header[3];
        if bound == 0 || bound > MOST_IDS {
            return Err("the header's bound of ids is not possible".into());
        }
        Ok(Self {
            module,
            declared,
            listed: entry.listed.clone(),
            entry,
            bound,
            capabilities: BTreeSet::new(),
            extensions: BTreeSet::new(),
            addressing: None,
            decorations: Vec::new(),
            globals: Vec::new(),
            function: Vec::new(),
        })
    }

    pub(super) fn id(&mut self) -> u32 {
        let id = self.bound;
        self.bound += 1;
        id
    }

    pub(super) fn capability(&mut self, capability: u32) {
        if !self.declared.capabilities.contains(&capability) {
            self.capabilities.insert(capability);
        }
    }

    /// An extension, unless the module has it.
    pub(super) fn extension(&mut self, name: &'static str) {
        let new = instruction(op::EXTENSION, &string_words(name.as_bytes()));
        if !self.module.declarations().iter().any(|i| i.words == new) {
            self.extensions.insert(name);
        }
    }

    /// Pointers to storage buffers are 64 bits wide, whatever the module had before.
    pub(super) fn use_addresses(&mut self) {
        self.addressing = Some(memory::PHYSICAL_STORAGE_BUFFER_64);
    }

    pub(super) fn decorate(&mut self, id: u32, decoration: &[u32]) {
        self.decorations.extend(instruction(op::DECORATE, &[&[id], decoration].concat()));
    }

    pub(super) fn decorate_member(&mut self, id: u32, member: u32, decoration: &[u32]) {
        let operands = [&[id, member], decoration].concat();
        self.decorations.extend(instruction(op::MEMBER_DECORATE, &operands));
    }

    /// A type of which there is one: by its opcode and operands.
    fn unique(&mut self, op: u32, operands: &[u32], ty: Type) -> u32 {
        let key = [&[op], operands].concat();
        if let Some(id) = self.declared.known.get(&key) {
            return *id;
        }
        let id = self.aggregate(op, operands, ty);
        self.declared.known.insert(key, id);
        id
    }

    /// A type of its own, whatever others are like it: its decorations are.
    fn aggregate(&mut self, op: u32, operands: &[u32], ty: Type) -> u32 {
        let id = self.id();
        self.globals.extend(instruction(op, &[&[id], operands].concat()));
        self.declared.types.insert(id, ty);
        id
    }

    pub(super) fn void(&mut self) -> u32 {
        self.unique(op::TYPE_VOID, &[], Type::Void)
    }

    pub(super) fn bool(&mut self) -> u32 {
        self.unique(op::TYPE_BOOL, &[], Type::Bool)
    }

    pub(super) fn uint(&mut self) -> u32 {
        self.unique(op::TYPE_INT, &[32, 0], Type::Int { width: 32 })
    }

    pub(super) fn float(&mut self) -> u32 {
        self.unique(op::TYPE_FLOAT, &[32], Type::Float { width: 32 })
    }

    pub(super) fn vector(&mut self, of: u32, n: u32) -> u32 {
        self.unique(op::TYPE_VECTOR, &[of, n], Type::Vector { of, n })
    }

    pub(super) fn pointer(&mut self, class: u32, to: u32) -> u32 {
        self.unique(op::TYPE_POINTER, &[class, to], Type::Pointer { class, to })
    }

    /// Of functions that take and return nothing.
    pub(super) fn procedure(&mut self) -> u32 {
        let returns = self.void();
        self.unique(op::TYPE_FUNCTION, &[returns], Type::Function { returns, parameters: 0 })
    }

    pub(super) fn array(&mut self, of: u32, n: u32) -> u32 {
        let length = self.constant(n);
        self.aggregate(op::TYPE_ARRAY, &[of, length], Type::Array { of, length })
    }

    /// An array as long as its buffer.
    pub(super) fn endless(&mut self, of: u32, stride: u32) -> u32 {
        let id = self.id();
        self.globals.extend(instruction(op::TYPE_RUNTIME_ARRAY, &[id, of]));
        self.decorate(id, &[decoration::ARRAY_STRIDE, stride]);
        id
    }

    /// A structure in memory: its members and where they lie.
    pub(super) fn structure(&mut self, members: &[(u32, u32)]) -> u32 {
        let types: Vec<u32> = members.iter().map(|m| m.0).collect();
        let id = self.aggregate(op::TYPE_STRUCT, &types, Type::Struct { members: types.clone() });
        for (n, (_, offset)) in members.iter().enumerate() {
            self.decorate_member(id, n as u32, &[decoration::OFFSET, *offset]);
        }
        id
    }

    fn declare_constant(&mut self, ty: u32, bits: u32) -> u32 {
        let key = vec![op::CONSTANT, ty, bits];
        if let Some(id) = self.declared.known.get(&key) {
            return *id;
        }
        let id = self.id();
        self.globals.extend(instruction(op::CONSTANT, &[ty, id, bits]));
        self.declared.known.insert(key, id);
        id
    }

    pub(super) fn constant(&mut self, value: u32) -> u32 {
        let ty = self.uint();
        self.declare_constant(ty, value)
    }

    pub(super) fn float_constant(&mut self, value: f32) -> u32 {
        let ty = self.float();
        self.declare_constant(ty, value.to_bits())
    }

    /// A variable of the new entry point.
    pub(super) fn variable(&mut self, class: u32, to: u32) -> u32 {
        let pointer = self.pointer(class, to);
        let id = self.id();
        self.globals.extend(instruction(op::VARIABLE, &[pointer, id, class]));
        self.declared.variables.insert(id, Variable { class, to, initialized: false });
        if lists_all(self.module) || matches!(class, class::INPUT | class::OUTPUT) {
            self.listed.push(id);
        }
        id
    }

    /// What the entry point has that is built in, alone or in a block.
    pub(super) fn built_in(&self, class: u32, which: u32) -> Option<BuiltIn> {
        self.entry.interface.iter().find_map(|id| {
            let Variable { to, .. } =
                *self.declared.variables.get(id).filter(|v| v.class == class)?;
            if self.declared.decoration(*id, decoration::BUILT_IN) == Some(which) {
                return Some(BuiltIn { variable: *id, member: None, ty: to });
            }
            let Type::Struct { members } = self.declared.ty(to)? else {
                return None;
            };
            let member = self.declared.built_in_member(to, which)?;
            let ty = *members.get(member as usize)?;
            Some(BuiltIn { variable: *id, member: Some(member), ty })
        })
    }

    /// An input that is built in: the module's own, or a new one of this type.
    pub(super) fn built_in_input(&mut self, which: u32, ty: u32, flat: bool) -> BuiltIn {
        self.built_in(class::INPUT, which).unwrap_or_else(|| {
            let variable = self.variable(class::INPUT, ty);
            self.decorate(variable, &[decoration::BUILT_IN, which]);
            if flat {
                self.decorate(variable, &[decoration::FLAT]);
            }
            BuiltIn { variable, member: None, ty }
        })
    }

    /// Whether a new variable can have this location.
    pub(super) fn require_free(&self, class: u32, location: u32) -> Result<()> {
        let free = Locations::new(&self.declared).free(&self.entry, class)?;
        if location < free {
            return Err(format!(
                "location {location} is the shader's own: the first free is {free}"
            ));
        }
        Ok(())
    }
}
