//! Entry points.

use std::collections::BTreeSet;

use super::declared::{Declared, Type};
use super::module::{Instruction, Module, Result, string, string_words};
use super::spec::{op, version};

/// An entry point and what it can see.
#[derive(Debug)]
pub(super) struct Entry {
    /// Which instruction declares it.
    pub(super) at: usize,
    pub(super) function: u32,
    pub(super) name: Vec<u32>,
    /// Variables as they are listed.
    pub(super) listed: Vec<u32>,
    /// Inputs and outputs among them, each once.
    pub(super) interface: BTreeSet<u32>,
    /// Those that a function names, or that have a value without.
    pub(super) used: BTreeSet<u32>,
}

impl Entry {
    pub(super) fn find(
        module: &Module,
        declared: &Declared,
        model: u32,
        entry: &str,
    ) -> Result<Self> {
        let (at, (function, listed)) = module
            .declarations()
            .iter()
            .enumerate()
            .find_map(|(n, i)| Some((n, named(i, model, entry)?)))
            .ok_or_else(|| format!("the module has no entry point '{entry}' of this stage"))?;
        let interface: BTreeSet<u32> =
            listed.iter().copied().filter(|id| declared.variables.contains_key(id)).collect();
        let named = module.bodies().iter().flat_map(Instruction::ids);
        let mut used: BTreeSet<u32> = named.filter(|id| interface.contains(id)).collect();
        let initialized = |id: &&u32| declared.variables.get(id).is_some_and(|v| v.initialized);
        used.extend(interface.iter().filter(initialized));
        let entry = Self {
            at,
            function,
            name: string_words(entry.as_bytes()),
            listed: listed.to_vec(),
            interface,
            used,
        };
        entry.check(module, declared)?;
        Ok(entry)
    }

    /// It is called by the new one, so that it has to be what an entry point has to be.
    fn check(&self, module: &Module, declared: &Declared) -> Result<()> {
        let function = module
            .bodies()
            .iter()
            .find(|i| i.op() == op::FUNCTION && i.operand(1) == Ok(self.function))
            .ok_or("the entry point's function is missing")?;
        let returns = match declared.ty(function.operand(3)?) {
            Some(Type::Function { returns, parameters: 0 }) => declared.ty(*returns),
            _ => None,
        };
        if returns != Some(&Type::Void) {
            return Err("the entry point's function takes or returns something".into());
        }
        Ok(())
    }
}

/// Function and listed variables of an entry point of this stage and name.
fn named<'a>(i: &Instruction<'a>, model: u32, entry: &str) -> Option<(u32, &'a [u32])> {
    if i.op() != op::ENTRY_POINT || i.operand(0) != Ok(model) {
        return None;
    }
    let (name, listed) = string(i.operands().get(2..)?)?;
    (name == entry.as_bytes()).then_some((i.operand(1).ok()?, listed))
}

/// Whether entry points list all variables, and not inputs and outputs alone.
pub(super) fn lists_all(module: &Module) -> bool {
    module.version() >= version::V1_4
}
