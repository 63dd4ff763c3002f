//! Loops over a pixel's samples, written out.
//!
//! An array stays in registers only where all its indices are constants. Compilers unroll few loops by
//! themselves: into each, lest a fault hang the device, a count of its turns is built, and
//! each index is held against the array's length. Written out, neither is there.

use std::fmt::Write;

/// Loops of at most so many turns are written out.
const MOST: u32 = 16;

/// The text with each `for (var NAME = 0u; NAME < SAMPLES; NAME++)` written out, where samples are
/// few. Loops that are left early stay.
pub(super) fn unrolled(text: &str, samples: u32) -> String {
    let mut done = String::with_capacity(text.len());
    match samples <= MOST {
        true => append(&text.lines().collect::<Vec<_>>(), samples, &mut done),
        false => done.push_str(text),
    }
    done
}

fn append(lines: &[&str], samples: u32, to: &mut String) {
    let put = |to: &mut String, line: &str| writeln!(to, "{line}").expect("strings grow");
    let mut at = 0;
    while at < lines.len() {
        let line = lines[at];
        let indent = &line[..line.len() - line.trim_start().len()];
        let ends = |line: &&str| line.strip_prefix(indent) == Some("}");
        let body = index(line).and_then(|index| {
            let body = &lines[at + 1..];
            let body = &body[..body.iter().position(ends)?];
            let leaves = |line: &&str| line.contains("break;") || line.contains("continue;");
            (!body.iter().any(leaves)).then_some((index, body))
        });
        let Some((index, body)) = body else {
            put(to, line);
            at += 1;
            continue;
        };
        for turn in 0..samples {
            put(to, &format!("{indent}{{\n{indent}    const {index} = {turn}u;"));
            append(body, samples, to);
            put(to, &format!("{indent}}}"));
        }
        at += body.len() + 2;
    }
}

/// The index of a loop over all samples.
fn index(line: &str) -> Option<&str> {
    let (index, rest) = line.trim().strip_prefix("for (var ")?.split_once(" = 0u; ")?;
    (rest == format!("{index} < SAMPLES; {index}++) {{")).then_some(index)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOP: &str = "for (var s = 0u; s < SAMPLES; s++) {\n    put(s);\n}\nend();\n";

    #[test]
    fn a_loop_becomes_its_turns() {
        let turn = |s: u32| format!("{{\n    const s = {s}u;\n    put(s);\n}}\n");
        assert_eq!(unrolled(LOOP, 2), turn(0) + &turn(1) + "end();\n");
    }

    #[test]
    fn loops_within_loops_are_written_out_too() {
        let inner = "    for (var t = 0u; t < SAMPLES; t++) {\n        put(s, t);\n    }";
        let text = unrolled(&LOOP.replace("    put(s);", inner), 4);
        assert_eq!((text.matches("const s").count(), text.matches("const t").count()), (4, 16));
        assert!(!text.contains("for"));
    }

    #[test]
    fn many_samples_and_loops_that_are_left_early_stay_loops() {
        assert_eq!(unrolled(LOOP, 32), LOOP);
        let early = LOOP.replace("put(s);", "if done(s) {\n        break;\n    }");
        assert_eq!(unrolled(&early, 4), early);
    }
}
