//! Captures of other programs of hostile sizes.

use std::fs;

use screendoor_vulkan_layer::log::{Event, Record};

use crate::left::{Left, over, pass, record};
use crate::measured::Run;

/// Records in the file: 183 MiB.
const RECORDS: u32 = 4_000_000;

/// What a conversion may take beside its records, in MiB.
const BESIDE_RECORDS: u64 = 96;

#[test]
pub(super) fn records_take_what_memory_says() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept");
    fs::create_dir(&kept).unwrap();
    let mut left = Left::new("a program", 512);
    let draws = 64;
    let events = (0..draws).map(|slot| Event::Draw(over(slot)));
    left.submit([Event::Pass(pass(512))].into_iter().chain(events).collect(), RECORDS.into());
    // In no order; nearly all of one draw.
    let records = (0..RECORDS).map(|i| {
        let scattered = i.wrapping_mul(0x9e37_79b1);
        let slot = if i % 16 == 0 { scattered % draws } else { 0 };
        let place = (scattered % 512) | (((scattered >> 9) % 512) << 16);
        Record { place, primitive: scattered >> 18, ..record(slot, 0, 0.5) }
    });
    left.write(&kept, records, &[]);
    let mut contents = Vec::new();
    for memory in ["32", "1024"] {
        let arguments =
            ["capture", "--vulkan", "--from", "kept", "-o", "t.arrow", "--memory", memory];
        let run = Run::of(folder.path(), &arguments);
        let most: u64 = memory.parse().unwrap();
        run.is_good(most.min(192) + BESIDE_RECORDS, "a capture");
        contents.push(run.output.split("content ").nth(1).unwrap()[..16].to_string());
    }
    assert_eq!(contents[0], contents[1]);

    // A log that claims more than there is costs nothing.
    let mut left = Left::new("a program", 65536);
    left.submit(vec![Event::Pass(pass(65536)), Event::Draw(over(0))], 1 << 40);
    left.write(&kept, [record(0, 0, 0.5)], &[]);
    let run = Run::of(folder.path(), &["capture", "--vulkan", "--from", "kept", "-o", "t.arrow"]);
    assert_eq!(run.status.code(), Some(1), "{}", run.error);
    assert!(run.error.contains("the file ends after 1"), "{}", run.error);
    assert!(run.mib <= BESIDE_RECORDS, "{} MiB", run.mib);
}
