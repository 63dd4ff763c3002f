//! Studies of hostile traces, and what is measured without any input.

use std::fs;

use crate::limits::traces::{many, write};
use crate::measured::{BESIDE, Run};
use crate::util::header;

/// A study of a deep pixel and of a frame of many fragments, in two parts, put together, and
/// its report written again.
#[test]
pub(super) fn memory_of_a_study_is_what_was_allowed_and_a_constant() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let memory = 8;
    write(&folder.join("deep.arrow"), &header(64, 64, 4), 50_000, |_| (30, 30));
    write(&folder.join("many.arrow"), &header(256, 256, 4), 300_000, many);
    let text = format!(
        "name = 'hostile'\ndesigns = ['lk', 'exact', 'kbuffer:layers={{n}}']\nsamples = [4]\n\
         seeds = 2\ntiming = 0\nmetrics = []\npictures = []\nmemory = {memory}\n\
         [[scene]]\nname = 'deep'\ntrace = 'deep.arrow'\npixel = [30, 30]\n\
         [[scene]]\nname = 'many'\ntrace = 'many.arrow'\n"
    );
    fs::write(folder.join("s.toml"), text).unwrap();
    for (part, folder_of_part) in [("1/2", "a"), ("2/2", "b")] {
        let study = ["study", "s.toml", "-o", folder_of_part, "--shard", part];
        Run::of(folder, &study).is_good(memory + BESIDE, part);
    }
    for command in [&["merge", "m", "a", "b"][..], &["report", "m"]] {
        let run = Run::of(folder, command);
        run.is_good(BESIDE, command[0]);
        assert!(run.seconds < 30.0, "{}: {} s", command[0], run.seconds);
    }
}

#[test]
#[ignore = "takes a quarter of a minute"]
pub(super) fn the_smallest_reproduction() {
    let folder = tempfile::tempdir().unwrap();
    let least = ["--side", "128", "--comparison-side", "32", "--seeds", "2"];
    let least = [&least[..], &["--seeds-of-means", "2"]].concat();
    let run = Run::of(
        folder.path(),
        &[&["reproduce", "--part", "methods", "-o", "r"], &least[..]].concat(),
    );
    run.is_good(BESIDE, "reproduce");
    assert!(folder.path().join("r/RESULTS.md").exists());
}
