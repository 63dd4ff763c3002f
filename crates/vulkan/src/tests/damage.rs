//! Files that are cut, flipped, or name what is not there: an error, and nothing else.

use super::*;
use crate::{DepthRule, Listing};

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn made() -> Made {
    let mut made = Made::new();
    let events = vec![
        begin(with_depth(pass(CLEAR, BLACK), 1.0)),
        draw(testing(over(0), vk::CompareOp::LESS, true)),
        clear(BLACK, [0, 0, 1, 1]),
        write_to(1, "vkCmdCopyImage"),
    ];
    made.submit(events, vec![grey(0, 0, 0.5), grey(0, 1, 0.5)]);
    made.picture(0, true, &[[1, 2, 3, 4]; 16]);
    made.present(0, &[1]);
    made
}

/// Does with a folder all that can be done.
fn try_all(made: &Made) -> Result<()> {
    let captures = Captures::read(made.path())?;
    Listing::new(&captures)?;
    for depth in [DepthRule::Program, DepthRule::Order] {
        convert(&captures, ConvertOptions { depth, ..ConvertOptions::default() })?;
    }
    Ok(())
}

#[test]
fn a_log_that_is_cut_anywhere_is_read_as_far_as_it_goes() {
    let made = made();
    made.write();
    try_all(&made).unwrap();
    let log = made.log();
    let mut torn = 0;
    for length in 0..log.len() {
        fs::write(made.files().log, &log[..length]).unwrap();
        // Some are good, and some say that there is no such frame; none panics.
        let _ = try_all(&made);
        let captures = Captures::read(made.path()).unwrap();
        torn += captures.devices.iter().filter(|d| d.is_torn).count();
    }
    assert!(torn > 100, "{torn}");
}

#[test]
fn a_log_with_any_byte_changed_is_no_panic() {
    let made = made();
    made.write();
    let log = made.log();
    let mut refused = 0;
    for at in 0..log.len() {
        for value in [0, 0xff, log[at] ^ 1, log[at].wrapping_add(0x40)] {
            let mut changed = log.clone();
            changed[at] = value;
            fs::write(made.files().log, &changed).unwrap();
            refused += usize::from(try_all(&made).is_err());
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn what_a_log_claims_has_to_be_there() {
    let made = made();
    made.write();
    let files = made.files();
    let error = || try_all(&made).unwrap_err().to_string();
    let records = fs::read(&files.records).unwrap();
    fs::write(&files.records, &records[..95]).unwrap();
    let said = error();
    assert!(said.contains("has 2 records from record 0 on, and the file ends after 1"), "{said}");
    fs::remove_file(&files.records).unwrap();
    assert!(error().contains("ends after 0"));
    fs::write(&files.records, &records).unwrap();
    let pictures = fs::read(&files.pictures).unwrap();
    fs::write(&files.pictures, &pictures[..63]).unwrap();
    assert!(error().contains("the picture of image 1 at submission 0 is not there"));
}

/// The error where a submission is made of `events`.
fn error(events: Vec<Event>, records: Vec<Record>) -> String {
    let mut made = Made::new();
    made.submit(events, records);
    made.write();
    try_all(&made).unwrap_err().to_string()
}

#[test]
fn what_is_named_has_to_be_known() {
    let begun = || begin(pass(CLEAR, BLACK));
    let mut unknown = pass(CLEAR, BLACK);
    unknown.resolve = Some(attachment(77, LOAD, BLACK));
    let mut level = pass(CLEAR, BLACK);
    level.colour.as_mut().unwrap().level = 3;
    let mut far = level.clone();
    far.colour.as_mut().unwrap().level = u32::MAX;
    let cases = [
        (vec![begin(unknown)], "a pass draws into the unknown image 77"),
        (vec![begin(level)], "image 1 has no mip level 3"),
        (vec![begin(far)], "image 1 has no mip level 4294967295"),
        (vec![draw(over(5))], "draw 5 comes before there is a pass"),
        (vec![clear(BLACK, [0; 4])], "cleared before there is a pass"),
        (vec![begun(), draw(Draw { pipeline: 8, ..over(5) })], "draw 5 has the unknown pipeline 8"),
        (vec![begun(), draw(over(5)), draw(over(5))], "there are two draws 5"),
        (vec![write_to(78, "vkCmdCopyImage")], "vkCmdCopyImage writes to the unknown image 78"),
    ];
    for (events, says) in cases {
        let said = error(events, Vec::new());
        assert!(said.contains(says), "{said}");
        assert!(said.contains(", submission 0: "), "{said}");
    }
    // Those of which no records are used may share one.
    let refused = || draw(Draw { refused: "twice".into(), ..over(5) });
    let none = || draw(Draw { refused: "none".into(), ..over(u32::MAX) });
    let mut made = Made::new();
    let records = vec![grey(5, 0, 0.5), grey(6, 0, 0.5)];
    made.submit(vec![begun(), refused(), refused(), none(), none(), draw(over(6))], records);
    made.write();
    try_all(&made).unwrap();
    let said = error(vec![begun(), none()], vec![grey(u32::MAX, 0, 0.5)]);
    assert!(said.contains("a record of draw 4294967295"), "{said}");
    let said = error(vec![begun(), draw(over(5))], vec![grey(6, 0, 0.5)]);
    assert!(said.contains("a record of draw 6, which its log does not have"), "{said}");
    let said = error(vec![begun(), draw(over(5))], vec![grey(5, 4, 0.5)]);
    assert!(said.contains("pixel 4,0 of an image of 4 x 4"), "{said}");
    let mut made = Made::new();
    made.image(5, UNORM, 1, 65537);
    made.write();
    assert!(try_all(&made).unwrap_err().to_string().contains("65537 x 65537 pixels"));
    fs::write(made.files().log, b"something else entirely").unwrap();
    assert!(try_all(&made).unwrap_err().to_string().contains("no log of this version"));
}

#[test]
fn vast_images_cost_what_is_drawn_in_them() {
    let mut made = Made::new();
    made.entries.retain(|e| !matches!(e, Entry::Image(_)));
    made.image(1, UNORM, 16, 65536);
    made.image(9, vk::Format::D32_SFLOAT, 16, 65536);
    let area = [0, 0, 65536, 65536];
    let part = Event::Clear(Clear { depth: true, value: [1.0; 4], area: [0, 0, 65535, 65536] });
    let events = vec![
        begin(Pass { area, ..with_depth(pass(CLEAR, BLACK), 1.0) }),
        draw(testing(over(0), vk::CompareOp::LESS, true)),
        part,
        draw(testing(over(1), vk::CompareOp::LESS, true)),
    ];
    made.submit(events, vec![grey(0, 65535, 0.5), grey(1, 65534, 0.5)]);
    made.write();
    try_all(&made).unwrap();
}
