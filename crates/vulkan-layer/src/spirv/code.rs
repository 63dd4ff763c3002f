//! The new function's instructions.

use super::declared::Type;
use super::editor::{BuiltIn, Editor};
use super::module::{Result, instruction};
use super::spec::op;

impl Editor<'_> {
    /// Loads an integer, or the first of an array of them, as unsigned.
    pub(super) fn load_integer(&mut self, class: u32, from: BuiltIn, name: &str) -> Result<u32> {
        let mut indices: Vec<u32> = from.member.into_iter().collect();
        let mut ty = from.ty;
        if let Some(Type::Array { of, .. }) = self.declared.ty(ty) {
            indices.push(0);
            ty = *of;
        }
        if self.declared.ty(ty) != Some(&Type::Int { width: 32 }) {
            return Err(format!("{name} is of an unknown type"));
        }
        let uint = self.uint();
        let value = self.load(class, from.variable, &indices, ty);
        Ok(if ty == uint { value } else { self.value(op::BITCAST, uint, &[value]) })
    }

    /// An instruction of the new function without a result.
    pub(super) fn put(&mut self, op: u32, operands: &[u32]) {
        self.function.extend(instruction(op, operands));
    }

    /// One with a result.
    pub(super) fn value(&mut self, op: u32, ty: u32, operands: &[u32]) -> u32 {
        let id = self.id();
        self.put(op, &[&[ty, id], operands].concat());
        id
    }

    /// Loads what lies at these members and elements of a variable.
    pub(super) fn load(&mut self, class: u32, variable: u32, indices: &[u32], ty: u32) -> u32 {
        let mut from = variable;
        if !indices.is_empty() {
            from = self.element(class, variable, indices, ty);
        }
        self.value(op::LOAD, ty, &[from])
    }

    /// A pointer to it.
    pub(super) fn element(&mut self, class: u32, base: u32, indices: &[u32], ty: u32) -> u32 {
        let pointer = self.pointer(class, ty);
        let mut operands = vec![base];
        for index in indices {
            operands.push(self.constant(*index));
        }
        self.value(op::ACCESS_CHAIN, pointer, &operands)
    }

    /// Begins the new function; returns its id.
    pub(super) fn begin(&mut self) -> u32 {
        let void = self.void();
        let ty = self.procedure();
        let function = self.value(op::FUNCTION, void, &[0, ty]);
        let label = self.id();
        self.put(op::LABEL, &[label]);
        function
    }

    /// Calls the old entry point.
    pub(super) fn call(&mut self) {
        let void = self.void();
        self.value(op::FUNCTION_CALL, void, &[self.entry.function]);
    }

    /// Goes on only where `condition` holds. Returns where to meet again.
    pub(super) fn begin_if(&mut self, condition: u32) -> u32 {
        let (then, after) = (self.id(), self.id());
        self.put(op::SELECTION_MERGE, &[after, 0]);
        self.put(op::BRANCH_CONDITIONAL, &[condition, then, after]);
        self.put(op::LABEL, &[then]);
        after
    }

    pub(super) fn end_if(&mut self, after: u32) {
        self.put(op::BRANCH, &[after]);
        self.put(op::LABEL, &[after]);
    }
}
