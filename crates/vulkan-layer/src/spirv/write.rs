//! The module with what was added to it.

use super::editor::Editor;
use super::module::{HEADER, Result, instruction, string_words};
use super::spec::op;

impl Editor<'_> {
    /// The module with `function`, begun before, as its only entry point.
    pub(super) fn finish(mut self, function: u32) -> Result<Vec<u32>> {
        self.put(op::RETURN, &[]);
        self.put(op::FUNCTION_END, &[]);
        let module = self.module;
        let operands = module.instructions[self.entry.at].operands();
        let entry = [&[operands[0], function], &self.entry.name[..], &self.listed].concat();
        if entry.len() >= 0xffff {
            return Err("the entry point has too many variables".into());
        }
        let declarations = module.declarations();
        let capabilities = declarations.iter().take_while(|i| i.op() == op::CAPABILITY).count();
        let annotated =
            declarations.iter().rposition(|i| precedes_types(i.op())).map_or(0, |n| n + 1);

        let mut words = module.header.to_vec();
        debug_assert_eq!(words.len(), HEADER);
        words[3] = self.bound;
        for (n, i) in module.instructions.iter().enumerate() {
            if n == capabilities {
                for capability in &self.capabilities {
                    words.extend(instruction(op::CAPABILITY, &[*capability]));
                }
                for name in &self.extensions {
                    words.extend(instruction(op::EXTENSION, &string_words(name.as_bytes())));
                }
            }
            if n == annotated {
                words.extend(&self.decorations);
            }
            if n == module.functions {
                words.extend(&self.globals);
            }
            match i.op() {
                // Other entry points go: one of the same function could not stay, since it is
                // called now.
                op::ENTRY_POINT => {
                    if n == self.entry.at {
                        words.extend(instruction(op::ENTRY_POINT, &entry));
                    }
                }
                op::EXECUTION_MODE | op::EXECUTION_MODE_ID => {
                    if i.operand(0) == Ok(self.entry.function) {
                        words.push(i.words[0]);
                        words.push(function);
                        words.extend(&i.words[2..]);
                    }
                }
                op::MEMORY_MODEL if self.addressing.is_some() => {
                    let addressing = self.addressing.unwrap_or_default();
                    words.extend(instruction(op::MEMORY_MODEL, &[addressing, i.operand(1)?]));
                }
                _ => words.extend(i.words),
            }
        }
        words.extend(&self.function);
        Ok(words)
    }
}

/// Whether an instruction stands before all types: names, decorations, and what stands before them.
fn precedes_types(op: u32) -> bool {
    matches!(
        op,
        op::CAPABILITY
            | op::EXTENSION
            | op::EXT_INST_IMPORT
            | op::MEMORY_MODEL
            | op::ENTRY_POINT
            | op::EXECUTION_MODE
            | op::EXECUTION_MODE_ID
            | op::SOURCE_CONTINUED
            | op::SOURCE
            | op::SOURCE_EXTENSION
            | op::NAME
            | op::MEMBER_NAME
            | op::STRING
            | op::MODULE_PROCESSED
            | op::DECORATE
            | op::MEMBER_DECORATE
            | op::DECORATION_GROUP
            | op::GROUP_DECORATE
            | op::GROUP_MEMBER_DECORATE
            | op::DECORATE_ID
            | op::DECORATE_STRING
            | op::MEMBER_DECORATE_STRING
    )
}
