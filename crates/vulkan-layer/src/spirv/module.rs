//! A module as a list of instructions that borrow its words.

use super::spec::op;

pub(super) type Result<T> = std::result::Result<T, String>;

const MAGIC: u32 = 0x0723_0203;
pub(super) const HEADER: usize = 5;

/// One instruction.
#[derive(Clone, Copy)]
pub(super) struct Instruction<'a> {
    /// All its words, the first of which holds length and opcode.
    pub(super) words: &'a [u32],
}

impl<'a> Instruction<'a> {
    pub(super) fn op(&self) -> u32 {
        self.words[0] & 0xffff
    }

    pub(super) fn operands(&self) -> &'a [u32] {
        &self.words[1..]
    }

    /// One operand: modules may be cut short anywhere.
    pub(super) fn operand(&self, n: usize) -> Result<u32> {
        let short = || format!("an instruction (opcode {}) lacks operands", self.op());
        self.operands().get(n).copied().ok_or_else(short)
    }

    /// The operands of which ids of variables may be among, without most that are numbers.
    ///
    /// Tells what a variable is used for only roughly: what is left of numbers among them may look
    /// like an id.
    pub(super) fn ids(&self) -> impl Iterator<Item = u32> + 'a {
        let operands = self.operands();
        let (first, rest): (&[u32], &[u32]) = match self.op() {
            op::LINE
            | op::VECTOR_SHUFFLE
            | op::COMPOSITE_EXTRACT
            | op::COMPOSITE_INSERT
            | op::SELECTION_MERGE
            | op::LOOP_MERGE
            | op::BRANCH_CONDITIONAL
            | op::SWITCH
            | op::FUNCTION
            | op::VARIABLE => (&[], &[]),
            // Number of the instruction within its set.
            op::EXT_INST => (operands.get(..3).unwrap_or(&[]), operands.get(4..).unwrap_or(&[])),
            // Alignment.
            op::LOAD => (operands.get(..3).unwrap_or(&[]), &[]),
            op::STORE => (operands.get(..2).unwrap_or(&[]), &[]),
            _ => (operands, &[]),
        };
        first.iter().chain(rest).copied()
    }
}

/// A module, cut into instructions.
pub(super) struct Module<'a> {
    /// Magic number, version, generator, bound of ids, 0.
    pub(super) header: [u32; HEADER],
    pub(super) instructions: Vec<Instruction<'a>>,
    /// Where among them the functions begin.
    pub(super) functions: usize,
}

impl<'a> Module<'a> {
    pub(super) fn parse(words: &'a [u32]) -> Result<Self> {
        let (header, mut rest) = words
            .split_first_chunk::<HEADER>()
            .filter(|(header, _)| header[0] == MAGIC)
            .ok_or("this is no SPIR-V module")?;
        if header[1] >> 16 != 1 {
            return Err("the module is of an unknown version of SPIR-V".into());
        }
        let mut instructions = Vec::new();
        while let Some(first) = rest.first() {
            let n = (first >> 16) as usize;
            if n == 0 || n > rest.len() {
                return Err("an instruction's length is not possible".into());
            }
            let (words, after) = rest.split_at(n);
            instructions.push(Instruction { words });
            rest = after;
        }
        let functions = instructions
            .iter()
            .position(|i| i.op() == op::FUNCTION)
            .ok_or("the module has no functions")?;
        Ok(Self { header: *header, instructions, functions })
    }

    pub(super) fn version(&self) -> u32 {
        self.header[1]
    }

    fn model(&self, n: usize) -> Option<u32> {
        self.declarations().iter().find(|i| i.op() == op::MEMORY_MODEL)?.operand(n).ok()
    }

    pub(super) fn addressing(&self) -> Option<u32> {
        self.model(0)
    }

    pub(super) fn memory_model(&self) -> Option<u32> {
        self.model(1)
    }

    /// What precedes the functions.
    pub(super) fn declarations(&self) -> &[Instruction<'a>] {
        &self.instructions[..self.functions]
    }

    pub(super) fn bodies(&self) -> &[Instruction<'a>] {
        &self.instructions[self.functions..]
    }
}

/// A string of an instruction, without its zero, and what follows it.
pub(super) fn string(words: &[u32]) -> Option<(Vec<u8>, &[u32])> {
    let mut bytes = Vec::new();
    for (n, word) in words.iter().enumerate() {
        for byte in word.to_le_bytes() {
            if byte == 0 {
                return Some((bytes, &words[n + 1..]));
            }
            bytes.push(byte);
        }
    }
    None
}

/// A string as words.
pub(super) fn string_words(text: &[u8]) -> Vec<u32> {
    let mut words: Vec<u32> = text
        .chunks(4)
        .map(|chunk| {
            let mut bytes = [0; 4];
            bytes[..chunk.len()].copy_from_slice(chunk);
            u32::from_le_bytes(bytes)
        })
        .collect();
    if text.len().is_multiple_of(4) {
        words.push(0);
    }
    words
}

/// The words of an instruction.
pub(super) fn instruction(op: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = Vec::with_capacity(operands.len() + 1);
    words.push(((operands.len() as u32 + 1) << 16) | op);
    words.extend_from_slice(operands);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_are_words_and_back() {
        for text in ["", "a", "abc", "main", "vertex_main"] {
            let mut words = string_words(text.as_bytes());
            words.push(7);
            assert_eq!(string(&words), Some((text.as_bytes().to_vec(), &[7][..])));
        }
        assert_eq!(string(&[0x6161_6161]), None);
    }
}
