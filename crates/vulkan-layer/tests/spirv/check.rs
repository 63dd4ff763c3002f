//! What has to hold of a rewritten module, found by another reading of it than the rewriter's.

use std::collections::{BTreeMap, BTreeSet};

use crate::corpus::Module;

struct Instruction<'a> {
    op: u32,
    operands: &'a [u32],
}

fn instructions(words: &[u32]) -> Vec<Instruction<'_>> {
    let mut rest = &words[5..];
    let mut all = Vec::new();
    while !rest.is_empty() {
        let n = (rest[0] >> 16) as usize;
        all.push(Instruction { op: rest[0] & 0xffff, operands: &rest[1..n] });
        rest = &rest[n..];
    }
    all
}

/// Which operand of an instruction is its result, by the specification's tables.
fn result(op: u32) -> Option<usize> {
    match op {
        // OpString, OpExtInstImport, types, OpDecorationGroup, OpLabel.
        7 | 11 | 19..=38 | 73 | 248 => Some(0),
        // What has neither type nor result.
        0 | 2..=6 | 8 | 10 | 14..=17 | 39 | 56 | 62..=64 | 71 | 72 | 74 | 75 | 99 => None,
        218..=221 | 224 | 225 | 228 | 246 | 247 | 249..=257 | 317 | 330..=332 => None,
        4416 | 5364 | 5365 | 5380 | 5632 | 5633 => None,
        // The rest has a type before its result.
        1..=400 | 5381 => Some(1),
        _ => panic!("instruction {op} is not in the check's table"),
    }
}

/// Name of an entry point, and its variables.
fn name_and_variables(operands: &[u32]) -> (&[u32], &[u32]) {
    let end = operands[2..].iter().position(|w| w.to_le_bytes().contains(&0)).unwrap() + 3;
    (&operands[2..end], &operands[end..])
}

/// Panics where something does not hold.
pub(crate) fn check(before: &Module, after: &[u32], model: u32, entry: &str) {
    assert_eq!(after[..3], before.words[..3]);
    let all = instructions(after);

    let mut results = BTreeSet::new();
    for i in &all {
        if let Some(at) = result(i.op) {
            let id = i.operands[at];
            assert!(id > 0 && id < after[3], "id {id} is not below the bound");
            assert!(results.insert(id), "id {id} has two definitions");
        }
    }
    assert!(after[3] - before.words[3] < 200, "more ids than are needed");

    // One entry point is left, by its name, and its function is new.
    let entries: Vec<_> = all.iter().filter(|i| i.op == 15).collect();
    let [only] = &entries[..] else { panic!("{} entry points", entries.len()) };
    let (name, listed) = name_and_variables(only.operands);
    let name: Vec<u8> = name.iter().flat_map(|word| word.to_le_bytes()).collect();
    assert_eq!(&name[..entry.len()], entry.as_bytes());
    assert_eq!(name[entry.len()], 0);
    assert_eq!(only.operands[0], model);
    let function = only.operands[1];
    assert!(function >= before.words[3]);
    assert!(all.iter().any(|i| i.op == 54 && i.operands[1] == function));
    for i in all.iter().filter(|i| matches!(i.op, 16 | 331)) {
        assert_eq!(i.operands[0], function, "an execution mode of another function");
    }
    let unique: BTreeSet<_> = listed.iter().collect();
    assert_eq!(unique.len(), listed.len(), "a variable is listed twice");

    // New variables are listed, from 1.4 on all of them.
    for i in &all {
        if i.op == 59 && i.operands[1] >= before.words[3] {
            let between = matches!(i.operands[2], 1 | 3);
            assert_eq!(unique.contains(&i.operands[1]), between || after[1] >= 0x0001_0400);
        }
    }

    // What was there is there, in the same order.
    let changed = |op| matches!(op, 14 | 15 | 16 | 331);
    let mut old = all.iter();
    for i in instructions(&before.words).iter().filter(|i| !changed(i.op)) {
        let found = old.any(|j| j.op == i.op && j.operands == i.operands);
        assert!(found, "instruction {} {:?} is gone or moved", i.op, i.operands);
    }

    unique_where_demanded(&all);
}

/// No two declarations of one type, but for arrays and structures.
fn unique_where_demanded(all: &[Instruction]) {
    let mut types = BTreeMap::new();
    for i in all.iter().filter(|i| matches!(i.op, 19..=27 | 33)) {
        let second = types.insert((i.op, &i.operands[1..]), i.operands[0]);
        assert_eq!(second, None, "type {} {:?} is declared twice", i.op, i.operands);
    }
}
