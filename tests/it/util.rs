//! What several tests share.

use screendoor::random::Stream;
use screendoor::trace::{
    ColourFormat, DepthPlane, Fragment, Header, SampleMask, SamplePattern, Trace, TraceWriter,
    Unorm32, WriteOptions,
};

/// A header for tests: `samples` samples at made-up places, black background.
pub fn header(width: u32, height: u32, samples: u32) -> Header {
    let positions = (0..samples as i32).map(|s| [(s % 8 * 2 - 8) as i8, (s / 8 * 2 - 8) as i8]);
    Header {
        width,
        height,
        pattern: SamplePattern {
            name: "test".into(),
            positions: positions.collect(),
            nested: true,
        },
        background: [0.0; 3],
        colour: ColourFormat::F16,
        source: "test".into(),
        camera: "none".into(),
        constants: Default::default(),
    }
}

/// `count` fragments with everything random, within the rules of `header`.
pub fn random_fragments(header: &Header, count: usize, seed: u32) -> Vec<Fragment> {
    let samples = header.pattern.samples();
    let mut random = Stream::new([0x7e57, seed]);
    let mut fragment = |i: usize| {
        let coverage = loop {
            let bits = u64::from(random.word()) << 32 | u64::from(random.word());
            let mask = SampleMask(bits) & SampleMask::first(samples);
            if !mask.is_empty() {
                break mask;
            }
        };
        Fragment {
            x: random.below(header.width) as u16,
            y: random.below(header.height) as u16,
            coverage,
            depth: DepthPlane {
                z: Unorm32(random.word()),
                dzdx: random.word() as i32 >> 8,
                dzdy: random.word() as i32 >> 8,
            },
            colour: [random.unit(), random.unit(), random.unit()],
            alpha: random.unit(),
            primitive: i as u32,
            object: i as u32 / 100,
        }
    };
    (0..count).map(&mut fragment).collect()
}

/// The bytes of a trace file that holds `fragments`.
pub fn trace_bytes(header: &Header, fragments: &[Fragment], options: WriteOptions) -> Vec<u8> {
    let mut writer = TraceWriter::new(Vec::new(), "test", header.clone(), options).unwrap();
    for fragment in fragments {
        writer.push(fragment).unwrap();
    }
    writer.finish().unwrap().0
}

/// A trace that holds `fragments`, in memory.
pub fn trace(header: &Header, fragments: &[Fragment]) -> Trace {
    let bytes = trace_bytes(header, fragments, WriteOptions::default());
    Trace::from_bytes(bytes, "test").unwrap()
}
