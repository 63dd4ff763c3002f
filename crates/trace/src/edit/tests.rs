use super::*;
use crate::param::Options;
use crate::random::Stream;
use crate::trace::{
    ColourFormat, ColumnId, DepthPlane, SampleMask, SamplePattern, Scalar, Unorm32, WriteOptions,
};

fn header(width: u32, height: u32, samples: u32) -> Header {
    let positions = (0..samples as i32).map(|s| [(s % 8 * 2 - 8) as i8, (s / 8 * 2 - 8) as i8]);
    let name = format!("test-{samples}");
    Header {
        width,
        height,
        pattern: SamplePattern { name, positions: positions.collect(), nested: true },
        source: "test".into(),
        colour: ColourFormat::F32,
        ..Header::default()
    }
}

pub(super) fn trace(header: &Header, fragments: &[Fragment]) -> Trace {
    let header = match header.pattern.positions.is_empty() {
        true => Header { pattern: self::header(1, 1, 1).pattern, ..header.clone() },
        false => header.clone(),
    };
    // Small batches, so that there are several.
    let options = WriteOptions { batch_rows: 100, ..WriteOptions::default() };
    let mut writer = TraceWriter::new(Vec::new(), "test", header, options).unwrap();
    fragments.iter().for_each(|fragment| writer.push(fragment).unwrap());
    Trace::from_bytes(writer.finish().unwrap().0, "test").unwrap()
}

fn made_up(header: &Header, count: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0xed17, count]);
    let all = SampleMask::first(header.pattern.samples());
    let mut fragment = |i: u32| Fragment {
        x: random.below(header.width) as u16,
        y: random.below(header.height) as u16,
        coverage: match SampleMask(u64::from(random.word()) << 32 | u64::from(random.word())) & all
        {
            SampleMask::NONE => all,
            some => some,
        },
        depth: DepthPlane { z: Unorm32(random.word() >> 28 << 28), dzdx: 3, dzdy: -4 },
        colour: [random.unit(), random.unit(), 0.5],
        alpha: random.unit(),
        primitive: i / 5,
        object: i / 50,
        ..Fragment::default()
    };
    (0..count).map(&mut fragment).collect()
}

fn fragments(trace: &Trace) -> Vec<Fragment> {
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

/// The trace that an edit makes, through its file.
fn made(edit: &dyn Edit) -> Trace {
    let header = edit.header().clone();
    let mut writer = TraceWriter::new(Vec::new(), "made", header, WriteOptions::default()).unwrap();
    let mut last = (0, 1);
    write(edit, &mut writer, &mut |done, of| last = (done, of)).unwrap();
    let trace = Trace::from_bytes(writer.finish().unwrap().0, "made").unwrap();
    assert!(trace.rows() == 0 || last.0 == last.1, "progress ended at {last:?}");
    trace
}

fn compared(a: &Trace, b: &Trace) -> Difference {
    let by_much = difference([a, b], 1 << 20, &mut |_, _| ()).unwrap();
    // Row by row of pixels, and one pixel's fragments: the same but for how many it looks at.
    let by_little = difference([a, b], 1, &mut |_, _| ()).unwrap();
    let without = |d: &Difference| Difference { columns: Vec::new(), compared: 0, ..d.clone() };
    assert_eq!(without(&by_little), without(&by_much));
    by_much
}

#[test]
fn a_conversion_without_a_change_has_the_same_content() {
    let header = header(40, 30, 8);
    let trace = trace(&header, &made_up(&header, 1000));
    let convert = Convert::new(&trace, ConvertOptions::default(), &mut |_, _| ()).unwrap();
    assert_eq!(made(&convert).content(), trace.content());
    assert_eq!(convert.rounded(), 0);
}

#[test]
fn constant_columns_are_found_stated_and_stored() {
    let header = header(40, 30, 8);
    let all = made_up(&header, 1000);
    let trace = trace(&header, &all);
    let with = |trace: &Trace, constants| {
        let options = ConvertOptions { constants, ..ConvertOptions::default() };
        made(&Convert::new(trace, options, &mut |_, _| ()).unwrap())
    };
    let found = with(&trace, Constants::Find);
    let expected = [
        (ColumnId::Dzdx, Scalar::Signed(3)),
        (ColumnId::Dzdy, Scalar::Signed(-4)),
        (ColumnId::B, Scalar::Real(0.5)),
    ];
    assert_eq!(found.header().constants, expected.into());
    assert_eq!(with(&found, Constants::Keep).content(), found.content());
    assert_eq!(with(&found, Constants::Store).content(), trace.content());
    // A zero of either sign is a value of its own.
    let signed = [0.0, -0.0].map(|c| Fragment { colour: [c; 3], ..all[0] });
    let found = with(&self::trace(&header, &signed), Constants::Find);
    assert!(!found.header().constants.contains_key(&ColumnId::R));
    assert_eq!(fragments(&found).map_bits(), signed.to_vec().map_bits());
}

#[test]
fn one_column_stays_stored_and_wide_colours_stay_wide() {
    let wide = header(40, 30, 8);
    let fragment = made_up(&wide, 1)[0];
    let find = |trace: &Trace| {
        let options = ConvertOptions { constants: Constants::Find, ..ConvertOptions::default() };
        made(&Convert::new(trace, options, &mut |_, _| ()).unwrap())
    };
    let found = find(&trace(&wide, &[fragment; 3]));
    assert_eq!(fragments(&found), [fragment; 3]);
    assert_eq!(found.header().colour, ColourFormat::F32);
    let narrow = Header { colour: ColourFormat::F16, ..wide.clone() };
    let fragment = Fragment { colour: [0.25, 0.5, 0.75], ..fragment };
    let found = find(&trace(&narrow, &[fragment; 3]));
    assert_eq!((fragments(&found), found.columns().len()), (vec![fragment; 3], 1));
    let all = ColumnId::ALL.into_iter().filter(|id| wide.has(*id));
    let constants = all.map(|id| (id, fragment.value(id))).collect();
    let error = Header { constants, ..wide }.check().unwrap_err();
    assert!(error.to_string().contains("rows cannot be counted"), "{error}");
}

trait Bits {
    fn map_bits(&self) -> Vec<u64>;
}

impl Bits for Vec<Fragment> {
    fn map_bits(&self) -> Vec<u64> {
        let bits = |f: &Fragment| ColumnId::ALL.map(|id| f.value(id).bits());
        self.iter().flat_map(bits).collect()
    }
}

#[test]
fn rounded_colours_are_counted_and_stated_ones_are_not_rounded() {
    let wide = header(4, 4, 1);
    let fragment = made_up(&wide, 1)[0];
    let colours = [0.1, 0.25, 0.1].map(|c| Fragment { colour: [c, 0.5, 0.5], ..fragment });
    let trace = trace(&wide, &colours);
    let options = ConvertOptions { colour: Some(ColourFormat::F16), ..ConvertOptions::default() };
    let convert = Convert::new(&trace, options, &mut |_, _| ()).unwrap();
    assert_eq!(fragments(&made(&convert))[0].colour[0], half::f16::from_f32(0.1).to_f32());
    assert_eq!(convert.rounded(), 2);

    // What halves cannot hold at all is told with its row.
    let bright = self::trace(&wide, &[fragment, Fragment { colour: [7e4; 3], ..fragment }]);
    let error = Convert::new(&bright, options, &mut |_, _| ()).unwrap();
    let error = error.fragments(&mut |_| Ok(()), &mut |_, _| ()).unwrap_err().to_string();
    assert!(error.contains("test, row 1") && error.contains("beyond 65504"), "{error}");

    // 0.1 is stated beside stored halves, and would be rounded if it were stored as one.
    let constants = [(ColumnId::R, Scalar::Real(0.1))].into();
    let narrow = Header { colour: ColourFormat::F16, constants, ..wide };
    let fragment = Fragment { colour: [0.1, 0.5, 0.25], ..fragment };
    let stated = self::trace(&narrow, &[fragment]);
    let options = ConvertOptions { constants: Constants::Store, ..ConvertOptions::default() };
    let stored = made(&Convert::new(&stated, options, &mut |_, _| ()).unwrap());
    assert_eq!(fragments(&stored), [fragment]);
    // Unless halves are asked for: then it is counted.
    let colour = Some(ColourFormat::F16);
    let options = ConvertOptions { colour, constants: Constants::Store };
    let convert = Convert::new(&stated, options, &mut |_, _| ()).unwrap();
    made(&convert);
    assert_eq!(convert.rounded(), 1);
    let plain = self::trace(
        &Header { constants: [].into(), ..narrow },
        &[Fragment { colour: [0.5; 3], ..fragment }],
    );
    let both = [stated, plain];
    let merged = made(&Merge::new(&both, MergeOptions::default()).unwrap());
    assert_eq!(fragments(&merged)[0].colour, [0.1, 0.5, 0.25]);
}

#[test]
fn what_is_trimmed_is_what_was_asked_for() {
    let header = header(40, 30, 8);
    let all = made_up(&header, 2000);
    let trace = trace(&header, &all);
    let options = TrimOptions {
        area: Some(Area { origin: [7, 11], size: [20, 9] }),
        samples: Some(2),
        rows: Some(100..=1899),
        primitives: Some(30..=300),
        objects: Some(4..=u32::MAX),
        keep_frame: false,
    };
    let expected: Vec<Fragment> = all[100..1900]
        .iter()
        .filter(|f| (7..27).contains(&f.x) && (11..20).contains(&f.y))
        .filter(|f| (30..=300).contains(&f.primitive) && f.object >= 4)
        .map(|f| Fragment { x: f.x - 7, y: f.y - 11, coverage: f.coverage & SampleMask(3), ..*f })
        .filter(|f| !f.coverage.is_empty())
        .collect();
    assert!(expected.len() > 100);
    let cut = made(&Trim::new(&trace, options.clone()).unwrap());
    assert_eq!(fragments(&cut), expected);
    let SamplePattern { name, positions, .. } = &cut.header().pattern;
    assert_eq!((name.as_str(), &**positions), ("test-2", &header.pattern.positions[..2]));
    assert_eq!(
        cut.header().source,
        "test; 20x9 pixels from 7,11; first 2 samples; rows 100-1899; primitives 30-300; \
         objects 4-4294967295"
    );
    let stay = TrimOptions { keep_frame: true, ..options };
    let kept = made(&Trim::new(&trace, stay).unwrap());
    assert_eq!((kept.header().width, kept.header().height), (40, 30));
    let moved = |f: &Fragment| Fragment { x: f.x + 7, y: f.y + 11, ..*f };
    assert_eq!(fragments(&kept), expected.iter().map(moved).collect::<Vec<_>>());
}

#[test]
fn stated_columns_are_trimmed_too() {
    let constants = [
        (ColumnId::Coverage, Scalar::Unsigned(0b1100)),
        (ColumnId::X, Scalar::Unsigned(9)),
        (ColumnId::Y, Scalar::Unsigned(5)),
    ];
    let header = Header { constants: constants.into(), ..header(16, 16, 4) };
    let fragment = Fragment { x: 9, y: 5, coverage: SampleMask(0b1100), ..Fragment::default() };
    let trace = trace(&header, &[fragment; 3]);
    let cut = |origin, samples| {
        let area = Some(Area { origin, size: [8, 8] });
        let options = TrimOptions { area, samples: Some(samples), ..TrimOptions::default() };
        fragments(&made(&Trim::new(&trace, options).unwrap()))
    };
    assert_eq!(cut([8, 0], 4), [Fragment { x: 1, ..fragment }; 3]);
    assert_eq!(cut([0, 0], 4), []);
    assert_eq!(cut([8, 8], 4), []);
    assert_eq!(cut([8, 0], 2), []);
}

#[test]
fn parts_that_a_trace_does_not_have_are_refused() {
    let header = header(40, 30, 8);
    let trace = trace(&header, &[]);
    for (origin, size) in [
        ([0, 0], [41, 1]),
        ([40, 0], [1, 1]),
        ([0, 29], [1, 2]),
        ([3, 3], [0, 1]),
        ([u32::MAX, 0], [2, 1]),
    ] {
        let options = TrimOptions { area: Some(Area { origin, size }), ..TrimOptions::default() };
        let error = Trim::new(&trace, options).unwrap_err();
        assert!(error.is_config() && error.to_string().contains("40x30"), "{error}");
    }
    let options = TrimOptions { samples: Some(16), ..TrimOptions::default() };
    let error = Trim::new(&trace, options).unwrap_err();
    assert!(error.is_config() && error.to_string().contains("power of two up to 8"), "{error}");
}

#[test]
fn parts_together_are_the_whole() {
    let header = header(40, 30, 8);
    let trace = trace(&header, &made_up(&header, 2000));
    let part = |rows| {
        let options = TrimOptions { rows: Some(rows), ..TrimOptions::default() };
        made(&Trim::new(&trace, options).unwrap())
    };
    let keep = MergeOptions { keep_numbers: true };
    let parts = [part(0..=699), part(700..=700), part(701..=5000)];
    let whole = made(&Merge::new(&parts, keep).unwrap());
    assert_eq!(compared(&trace, &whole).same, Kept::Rows);
    // Left and right halves are other rows, and the same pixels.
    let half = |x| {
        let area = Some(Area { origin: [x, 0], size: [20, 30] });
        let options = TrimOptions { area, keep_frame: true, ..TrimOptions::default() };
        made(&Trim::new(&trace, options).unwrap())
    };
    let halves = [half(0), half(20)];
    let found = compared(&trace, &made(&Merge::new(&halves, keep).unwrap()));
    assert!(found.row.is_some() && found.first.is_none());
    assert_eq!((found.same, found.pixels), (Kept::Pixels, 0));
}

#[test]
fn merged_primitives_have_numbers_of_their_own() {
    let header = header(8, 8, 1);
    let numbered = |primitive, object| Fragment {
        primitive,
        object,
        coverage: SampleMask(1),
        ..Fragment::default()
    };
    let numbers = |trace: &Trace| -> Vec<[u32; 2]> {
        fragments(trace).iter().map(|f| [f.primitive, f.object]).collect()
    };
    let parts = [
        trace(&header, &[numbered(4, 0), numbered(2, 0)]),
        trace(&header, &[]),
        trace(&header, &[numbered(0, 0), numbered(9, 3)]),
        trace(&header, &[numbered(1, 1)]),
    ];
    let merged = made(&Merge::new(&parts, MergeOptions::default()).unwrap());
    assert_eq!(numbers(&merged), [[4, 0], [2, 0], [5, 1], [14, 4], [16, 6]]);
    assert_eq!(merged.header().source, "test");
    let high = [trace(&header, &[numbered(7, 0)]), trace(&header, &[numbered(u32::MAX, 0)])];
    let merge = Merge::new(&high, MergeOptions::default()).unwrap();
    let error = merge.fragments(&mut |_| Ok(()), &mut |_, _| ()).unwrap_err().to_string();
    assert!(error.contains("row 0") && error.contains("4294967295"), "{error}");
}

#[test]
fn traces_of_different_frames_are_not_merged() {
    let one = header(8, 8, 4);
    let other = |change: &dyn Fn(&mut Header)| {
        let mut header = one.clone();
        change(&mut header);
        let pair = [trace(&one, &[]), trace(&header, &[])];
        Merge::new(&pair, MergeOptions::default()).unwrap_err().to_string()
    };
    for (what, error) in [
        ("frame", other(&|h| h.height = 9)),
        ("samples", other(&|h| h.pattern.positions[0][0] += 1)),
        ("background", other(&|h| h.background[2] = 0.5)),
        ("space", other(&|h| h.space = crate::picture::Space::Encoded)),
    ] {
        assert!(error.contains(what), "{error}");
    }
    assert!(Merge::new(&[], MergeOptions::default()).unwrap_err().is_config());
}

#[test]
fn every_order_is_the_same_in_little_memory() {
    let header = header(40, 30, 8);
    let all = made_up(&header, 3000);
    let trace = trace(&header, &all);
    let ordered = |order, seed, memory| {
        fragments(&made(&Shuffle::new(&trace, ShuffleOptions { order, seed, memory }).unwrap()))
    };
    for &order in Sequence::ALL {
        let name = order.name();
        let found = ordered(order, 1, 1 << 20);
        // Some hundred fragments at a time, and a few.
        for memory in [10_000, 1_000] {
            assert_eq!(ordered(order, 1, memory), found, "{name}");
        }
        let mut sorted = [all.map_sorted(), found.map_sorted()].into_iter();
        assert_eq!(sorted.next(), sorted.next(), "{name}");
        match order {
            Sequence::Random | Sequence::Fragments => {
                assert!(found != all && found != ordered(order, 2, 1 << 20), "{name}");
            }
            Sequence::Reverse => assert!(found.iter().eq(all.iter().rev())),
            Sequence::NearToFar => assert!(found.is_sorted_by_key(|f| f.depth.z)),
            Sequence::FarToNear => assert!(found.iter().rev().is_sorted_by_key(|f| f.depth.z)),
            // Made up in this order.
            Sequence::Primitives => assert_eq!(found, all),
            Sequence::Tiles => {
                assert!(found.is_sorted_by_key(|f| (f.y / 16, f.x / 16)));
                let shuffle = ShuffleOptions { order, seed: 0, memory: 1 << 20 };
                let tiles = made(&Shuffle::new(&trace, shuffle).unwrap());
                assert_eq!(compared(&trace, &tiles).same, Kept::Pixels);
            }
        }
    }
    // What an order does not tell apart stays as it was.
    let random = ordered(Sequence::Random, 5, 1000);
    for five in random.chunks(5) {
        let first = all.iter().position(|f| f == &five[0]).unwrap();
        assert_eq!(five, &all[first..first + 5]);
    }
    let none = ShuffleOptions { order: Sequence::Reverse, seed: 0, memory: 1 };
    assert!(Shuffle::new(&trace, none).unwrap_err().is_config());
}

trait Sorted {
    fn map_sorted(&self) -> Vec<[u64; ColumnId::COUNT]>;
}

impl Sorted for Vec<Fragment> {
    fn map_sorted(&self) -> Vec<[u64; ColumnId::COUNT]> {
        let mut all: Vec<_> =
            self.iter().map(|f| ColumnId::ALL.map(|id| f.value(id).bits())).collect();
        all.sort_unstable();
        all
    }
}

#[test]
fn the_first_difference_is_found_in_every_column() {
    let header = header(40, 30, 8);
    let all = made_up(&header, 3000);
    let trace_a = trace(&header, &all);
    assert_eq!(compared(&trace_a, &trace_a).same, Kept::Rows);
    type Change = (&'static str, fn(&mut Fragment), f64);
    let changed: [Change; 8] = [
        ("coverage", |f| f.coverage = SampleMask(f.coverage.0 ^ 0b11), 2.0),
        ("z", |f| f.depth.z = Unorm32(f.depth.z.0 ^ 1), 1.0),
        ("dzdx", |f| f.depth.dzdx += 9, 9.0),
        ("dzdy", |f| f.depth.dzdy -= 2, 2.0),
        ("b", |f| f.colour[2] = 0.75, 0.25),
        ("alpha", |f| f.alpha = 1.0 - f.alpha, f64::NAN),
        ("primitive", |f| f.primitive += 3, 3.0),
        ("object", |f| f.object += 1, 1.0),
    ];
    for (column, change, most) in changed {
        let mut other = all.clone();
        let row = other.iter().rposition(|f| (f.x, f.y) == (all[7].x, all[7].y)).unwrap();
        let row = if other[row].coverage.0 == 0b11 { 7 } else { row };
        change(&mut other[row]);
        let found = compared(&trace_a, &trace(&header, &other));
        assert_eq!((found.same, found.pixels, found.counts), (Kept::Nothing, 1, 0), "{column}");
        assert_eq!(found.row, Some(row as u64));
        let first = found.first.unwrap();
        assert_eq!(first.pixel, [all[row].x, all[row].y]);
        assert_eq!(first.rows, [Some(row as u64); 2]);
        assert_eq!(first.fragments, [Some(all[row]), Some(other[row])]);
        assert_eq!(first.columns, [column]);
        let before = all[..row].iter().filter(|f| [f.x, f.y] == first.pixel).count();
        assert_eq!(first.fragment, before as u64);
        assert_eq!((found.compared, found.columns.len()), (1, 1));
        let of = found.columns[0];
        assert_eq!((of.column, of.fragments), (column, 1));
        assert!(most.is_nan() || of.most == most, "{column}: {}", of.most);
    }
}

#[test]
fn missing_and_reordered_fragments_are_told_apart() {
    let header = header(40, 30, 8);
    let all = made_up(&header, 3000);
    let whole = trace(&header, &all);
    let mut fewer = all.clone();
    let gone = fewer.remove(1234);
    let found = compared(&whole, &trace(&header, &fewer));
    assert_eq!((found.same, found.pixels, found.counts), (Kept::Nothing, 1, 1));
    assert_eq!(found.fragments, [3000, 2999]);
    assert_eq!(found.first.unwrap().pixel, [gone.x, gone.y]);
    assert!(found.columns.is_empty() && found.compared == 0);
    // The last of its pixel is missing.
    let last = all.iter().rposition(|f| (f.x, f.y) == (gone.x, gone.y)).unwrap();
    let mut fewer = all.clone();
    fewer.remove(last);
    let first = compared(&trace(&header, &fewer), &whole).first.unwrap();
    assert_eq!(first.rows, [None, Some(last as u64)]);
    assert_eq!(first.fragments, [None, Some(all[last])]);

    let mut two = all.clone();
    let again = (0..2000).find(|i| (two[*i].x, two[*i].y) == (gone.x, gone.y)).unwrap();
    let last = two.iter().rposition(|f| (f.x, f.y) == (gone.x, gone.y)).unwrap();
    assert!(again < last);
    two.swap(again, last);
    let found = compared(&whole, &trace(&header, &two));
    assert_eq!((found.same, found.pixels, found.reordered), (Kept::Fragments, 1, 1));
    assert_eq!(found.first.unwrap().pixel, [gone.x, gone.y]);
}

#[test]
fn headers_say_where_they_differ() {
    let a = header(8, 9, 2);
    assert_eq!(header_differences(&a, &a), []);
    let mut b = Header { width: 7, source: "other".into(), ..a.clone() };
    b.pattern.positions[1] = [0, 0];
    let found = header_differences(&a, &b);
    let what: Vec<(&str, bool)> = found.iter().map(|d| (d.entry, d.matters)).collect();
    assert_eq!(what, [("frame", true), ("samples", true), ("source", false)]);
    assert_eq!(found[0].values, ["8x9", "7x9"]);
}
