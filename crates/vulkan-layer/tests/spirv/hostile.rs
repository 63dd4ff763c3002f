//! Damaged and hostile modules: a reason or a module comes back, and soon.

use std::time::{Duration, Instant};

use screendoor_vulkan_layer::spirv::{inputs, outputs};

use crate::corpus::{FRAGMENT, VERTEX, modules, rewrites};

/// A generator of numbers that are the same each time (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// Damages a module: cuts it off, or changes bits or words of it.
fn damage(words: &mut Vec<u32>, numbers: &mut Numbers) {
    match numbers.below(8) {
        0 => words.truncate(numbers.below(words.len())),
        1 => {
            let at = numbers.below(words.len());
            words.remove(at);
        }
        2 => {
            let (from, to) = (numbers.below(words.len()), numbers.below(words.len()));
            words[to] = words[from];
        }
        3 => {
            let extremes = [0, 1, u32::MAX, 0x8000_0000, 0x7fff_ffff, 0xffff_0000, 64];
            let at = numbers.below(words.len());
            words[at] = extremes[numbers.below(extremes.len())];
        }
        _ => {
            for _ in 0..=numbers.below(3) {
                let at = numbers.below(words.len());
                words[at] ^= 1 << numbers.below(32);
            }
        }
    }
}

#[test]
fn no_damage_breaks_the_rewriter() {
    let mut numbers = Numbers(1);
    let (mut refused, mut rewritten) = (0, 0);
    for module in modules() {
        let ways = rewrites(&module);
        for _ in 0..200 {
            let mut words = module.words.clone();
            damage(&mut words, &mut numbers);
            let way = &ways[numbers.below(ways.len())];
            match way.run(&words) {
                Ok(_) => rewritten += 1,
                Err(_) => refused += 1,
            }
            let locations = if way.model == VERTEX { outputs } else { inputs };
            let _ = locations(&words, &way.entry);
        }
        // Cut off everywhere.
        let way = &ways[numbers.below(ways.len())];
        for n in 0..module.words.len() {
            let _ = way.run(&module.words[..n]);
        }
    }
    println!("of damaged modules {rewritten} were rewritten, {refused} refused");
    assert!(rewritten > 1000 && refused > 1000);
}

/// A module of fragment shader `main` that does nothing, with instructions before its function.
fn built(listed: &[u32], declarations: &[Vec<u32>]) -> Vec<u32> {
    let mut words = vec![0x0723_0203, 0x0001_0000, 0, 1 << 29, 0];
    let mut add = |op: u32, operands: &[u32]| {
        words.push(((operands.len() as u32 + 1) << 16) | op);
        words.extend(operands);
    };
    add(17, &[1]);
    add(14, &[0, 1]);
    let main = [u32::from_le_bytes(*b"main"), 0];
    add(15, &[&[FRAGMENT, 1][..], &main, listed].concat());
    for instruction in declarations {
        add(instruction[0], &instruction[1..]);
    }
    add(19, &[2]);
    add(33, &[3, 2]);
    add(54, &[2, 1, 0, 3]);
    add(248, &[4]);
    add(253, &[]);
    add(56, &[]);
    words
}

/// However things refer to each other, it takes no longer than the module's words do.
#[test]
fn nothing_takes_long() {
    const INPUT: u32 = 1;
    const N: u32 = 60_000;
    let ids = || 100..100 + N;
    let variables = |to: u32| {
        let pointer = vec![32, 90, INPUT, to];
        std::iter::once(pointer).chain(ids().map(|id| vec![59, 90, id, INPUT]))
    };
    let located = || ids().map(|id| vec![71, id, 30, 7]);
    let listed: Vec<u32> = ids().collect();
    let float = vec![22, 10, 32];
    let pairs = |group: u32| [&[74, group][..], &listed].concat();

    // Many variables of one structure with many members.
    let members = [&[30, 11][..], &vec![10; 60_000]].concat();
    let one: Vec<_> = located().chain([float.clone(), members]).chain(variables(11)).collect();
    // Many variables in many groups of many decorations.
    let groups = (0..20).map(|n| 20 + n);
    let many: Vec<_> = groups
        .clone()
        .flat_map(|g| (0..3000).map(move |n| vec![71, g, 40 + n, 0]))
        .chain(groups.map(pairs))
        .chain([float.clone()])
        .chain(variables(10))
        .collect();
    // One variable, listed often, in many groups.
    let often: Vec<_> = (0..N)
        .map(|n| vec![74, 1000 + n, 100])
        .chain([float.clone()])
        .chain(variables(10).take(2))
        .collect();
    // Arrays of arrays of arrays, and variables of the last.
    let three = [vec![21, 12, 32, 0], vec![43, 12, 13, 3]];
    let nested: Vec<_> = [float.clone()]
        .into_iter()
        .chain(three)
        .chain(
            (0..N).map(|n| vec![28, 1 << 20 | n, if n == 0 { 10 } else { 1 << 20 | (n - 1) }, 13]),
        )
        .chain(variables(1 << 20 | (N - 1)))
        .collect();
    // Structures of two of the one before: 2^60000 locations.
    let doubled: Vec<_> = [float.clone()]
        .into_iter()
        .chain((0..N).map(|n| {
            let before = if n == 0 { 10 } else { 1 << 20 | (n - 1) };
            vec![30, 1 << 20 | n, before, before]
        }))
        .chain(located())
        .chain(variables(1 << 20 | (N - 1)))
        .collect();
    // Types made of themselves, or of each other.
    let round = [
        vec![28, 11, 11, 13],
        vec![30, 14, 15, 14],
        vec![28, 15, 14, 13],
        vec![23, 16, 16, 4],
        vec![24, 17, 17, 4],
    ];
    let round: Vec<_> = round.into_iter().chain(variables(15)).collect();

    let repeated = vec![100; 60_000];
    let cases = [
        (&listed, one),
        (&listed, many),
        (&repeated, often),
        (&listed, nested),
        (&listed, doubled),
        (&listed, round),
    ];
    for (n, (listed, declarations)) in cases.into_iter().enumerate() {
        let words = built(listed, &declarations);
        let start = Instant::now();
        let options = screendoor_vulkan_layer::spirv::Options {
            set: 3,
            primitive_id: true,
            instance: Some(60),
            ..Default::default()
        };
        let result = screendoor_vulkan_layer::spirv::fragment(&words, "main", &options);
        let free = inputs(&words, "main");
        let time = start.elapsed();
        println!("case {n}: {time:?}, {:?}, {free:?}", result.map(|_| ()));
        assert!(time < Duration::from_secs(20), "case {n} took {time:?}");
    }
}
