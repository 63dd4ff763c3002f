//! `spirv-val`, where it is installed.

use std::io::Write;
use std::process::{Command, Stdio};

/// Whether it can be asked. Says so where not, and panics where it is demanded.
pub(crate) fn is_there() -> bool {
    let there = Command::new("spirv-val").arg("--version").output().is_ok();
    if !there {
        let demanded = std::env::var_os("SCREENDOOR_SPIRV_VAL").is_some_and(|v| v == "require");
        assert!(!demanded, "SCREENDOOR_SPIRV_VAL demands spirv-val, which cannot be run");
        println!("spirv-val is not installed: rewritten modules are not validated");
    }
    there
}

/// Its first complaint.
pub(crate) fn complaint(words: &[u32], environment: &str) -> Option<String> {
    let mut child = Command::new("spirv-val")
        .args(["--target-env", environment, "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    // It may have seen enough before it has read all.
    let _ = child.stdin.take().unwrap().write_all(&bytes);
    let output = child.wait_with_output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (!output.status.success()).then(|| String::from_utf8_lossy(&text).into_owned())
}

/// What it complains of, without where: ids and lines are others after rewriting.
pub(crate) fn kind(complaint: &str) -> String {
    let line = complaint.lines().next().unwrap_or_default();
    let line = line.split_once(": ").map_or(line, |(_, rest)| rest);
    let line = line.split_once(": ").map_or(line, |(_, rest)| rest);
    line.chars().filter(|c| !c.is_ascii_digit()).collect()
}
