//! The small vocabulary in which the fast engine is written: 32-bit words, one for
//! each sample of a pixel, in as many vectors as they take.
//!
//! Everything here is made of `fearless_simd`'s safe operations, so that a kernel is
//! written once and compiled for each instruction set.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Select, Simd, i32x4, i32x8, i32x16};

/// A count of samples as a type.
#[derive(Clone, Copy, Debug)]
pub struct Count<const N: usize>;

/// How the samples of a pixel lie in memory and in vectors.
pub trait Width: Send + Sync + 'static {
    /// A word for each sample. Pixels of fewer than four samples are padded to four.
    type Row: AsRef<[i32]> + AsMut<[i32]> + Copy + Send + Sync + 'static;
    /// The words in vectors.
    type Lanes<S: Simd>: Lanes<S>;

    /// A row of which each word is `word(i)`.
    fn row(word: impl FnMut(usize) -> i32) -> Self::Row;
}

/// Words in lanes, one for each sample.
pub trait Lanes<S: Simd>: Copy {
    /// One truth value a lane.
    type Mask: Copy;

    /// How many there are.
    const LEN: usize;

    /// The same word in each lane.
    fn splat(simd: S, word: i32) -> Self;
    /// `LEN` words.
    fn load(simd: S, words: &[i32]) -> Self;
    /// Writes `LEN` words.
    fn store(self, words: &mut [i32]);
    /// Lane by lane, modulo 2^32.
    fn add(self, other: Self) -> Self;
    /// Lane by lane, modulo 2^32.
    fn sub(self, other: Self) -> Self;
    /// Lane by lane, modulo 2^32.
    fn mul(self, other: Self) -> Self;
    /// Lane by lane.
    fn xor(self, other: Self) -> Self;
    /// Lane by lane.
    fn or(self, other: Self) -> Self;
    /// Shifted right by `bits`, the sign kept.
    fn shift_right(self, bits: u32) -> Self;
    /// Shifted right by `bits`, with zeros.
    fn shift_right_zeros(self, bits: u32) -> Self;
    /// Shifted left by the lower five bits of the other lane.
    fn shift_left_by(self, other: Self) -> Self;
    /// Where a signed lane exceeds the other.
    fn greater(self, other: Self) -> Self::Mask;
    /// Where the upper bit is set.
    fn negative(self, simd: S) -> Self::Mask;
    /// One less where `a` exceeds `b`.
    fn less_one_where_greater(self, a: Self, b: Self) -> Self;
    /// 0, 1, 2, … in the lanes that `bits` names, in rising order; 0 in the others.
    fn numbered(simd: S, bits: u64) -> Self;
    /// `yes` where `mask` is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// A mask from one bit a lane, the first lane's lowest.
    fn mask(simd: S, bits: u64) -> Self::Mask;
    /// One bit a lane.
    fn bits(mask: Self::Mask) -> u64;
    /// All lanes together, modulo 2^32.
    fn sum(self) -> i32;
}

/// `K` vectors side by side.
#[derive(Clone, Copy)]
pub struct Vectors<V, const K: usize>([V; K]);

impl<V: Copy, const K: usize> Vectors<V, K> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(V, V) -> V) -> Self {
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| f(self.0[i], other.0[i]),
        ))
    }

    #[inline(always)]
    fn map(self, f: impl Fn(V) -> V) -> Self {
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| f(self.0[i]),
        ))
    }
}

impl<S, V, M, const K: usize> Lanes<S> for Vectors<V, K>
where
    S: Simd,
    V: SimdInt<S, Element = i32, Mask = M>,
    M: SimdMask<S, Element = i32, Ints = V> + Select<V>,
{
    type Mask = [M; K];

    const LEN: usize = K * V::LEN;

    #[inline(always)]
    fn splat(simd: S, word: i32) -> Self {
        Vectors([V::splat(simd, word); K])
    }
    #[inline(always)]
    fn load(simd: S, words: &[i32]) -> Self {
        let words = &words[..Self::LEN];
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| V::from_slice(simd, &words[i * V::LEN..][..V::LEN]),
        ))
    }
    #[inline(always)]
    fn store(self, words: &mut [i32]) {
        let words = &mut words[..Self::LEN];
        for (i, vector) in self.0.into_iter().enumerate() {
            vector.store_slice(&mut words[i * V::LEN..][..V::LEN]);
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a + b,
        )
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a - b,
        )
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a * b,
        )
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a ^ b,
        )
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a | b,
        )
    }
    #[inline(always)]
    fn shift_right(self, bits: u32) -> Self {
        self.map(
            #[inline(always)]
            |a| a >> bits,
        )
    }
    #[inline(always)]
    fn shift_right_zeros(self, bits: u32) -> Self {
        let kept = (u32::MAX >> bits) as i32;
        self.map(
            #[inline(always)]
            |a| (a >> bits) & kept,
        )
    }
    #[inline(always)]
    fn shift_left_by(self, other: Self) -> Self {
        self.zip(
            other,
            #[inline(always)]
            |a, b| a << (b & 31),
        )
    }
    #[inline(always)]
    fn greater(self, other: Self) -> [M; K] {
        std::array::from_fn(
            #[inline(always)]
            |i| self.0[i].simd_gt(other.0[i]),
        )
    }
    #[inline(always)]
    fn negative(self, simd: S) -> [M; K] {
        Self::splat(simd, 0).greater(self)
    }
    #[inline(always)]
    fn less_one_where_greater(self, a: Self, b: Self) -> Self {
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| self.0[i] + a.0[i].simd_gt(b.0[i]).to_vector(),
        ))
    }
    #[inline(always)]
    fn numbered(simd: S, bits: u64) -> Self {
        const IOTA: [i32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        let iota = V::from_slice(simd, &IOTA[..V::LEN]);
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| {
                let shift = (i * V::LEN) as u32;
                let before = (bits & ((1 << shift) - 1)).count_ones() as i32;
                (iota + before).expand(M::from_bitmask(simd, bits >> shift))
            },
        ))
    }
    #[inline(always)]
    fn select(mask: [M; K], yes: Self, no: Self) -> Self {
        Vectors(std::array::from_fn(
            #[inline(always)]
            |i| mask[i].select(yes.0[i], no.0[i]),
        ))
    }
    #[inline(always)]
    fn mask(simd: S, bits: u64) -> [M; K] {
        std::array::from_fn(
            #[inline(always)]
            |i| M::from_bitmask(simd, bits >> (i * V::LEN)),
        )
    }
    #[inline(always)]
    fn bits(mask: [M; K]) -> u64 {
        let mut bits = 0;
        for (i, mask) in mask.into_iter().enumerate() {
            bits |= mask.to_bitmask() << (i * V::LEN);
        }
        bits
    }
    #[inline(always)]
    fn sum(self) -> i32 {
        let [first, others @ ..] = &self.0[..] else { return 0 };
        let mut sum = *first;
        for vector in others {
            sum += *vector;
        }
        sum.reduce_sum()
    }
}

macro_rules! width {
    ($($samples:literal: $lanes:literal in $k:literal $vector:ident;)+) => {
        $(impl Width for Count<$samples> {
            type Row = [i32; $lanes];
            type Lanes<S: Simd> = Vectors<$vector<S>, $k>;

            #[inline(always)]
            fn row(word: impl FnMut(usize) -> i32) -> [i32; $lanes] {
                std::array::from_fn(word)
            }
        })+
    };
}

width! {
    1: 4 in 1 i32x4;
    2: 4 in 1 i32x4;
    4: 4 in 1 i32x4;
    8: 8 in 1 i32x8;
    16: 16 in 1 i32x16;
    32: 32 in 2 i32x16;
    64: 64 in 4 i32x16;
}

/// Instruction sets for which kernels are compiled and that this machine has, with
/// their names, the fastest first. Without any of them the plain text is faster than a
/// kernel would be. (x86 processors with SSE2 alone are old by now, and each set costs compile
/// time.)
pub fn levels() -> Vec<(&'static str, Level)> {
    let here = Level::new();
    let mut levels = Vec::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(here.as_avx512().map(|token| ("avx512", Level::Avx512(token))));
        levels.extend(here.as_avx2().map(|token| ("avx2", Level::Avx2(token))));
    }
    #[cfg(target_arch = "aarch64")]
    levels.extend(here.as_neon().map(|token| ("neon", Level::Neon(token))));
    levels
}

/// The body of a function: `$body` with `$simd` as the token of `$level`, one of [`levels`],
/// compiled for AVX-512, AVX2 or NEON.
#[macro_export]
#[doc(hidden)]
macro_rules! for_level {
    ($level:expr, $simd:ident => $body:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            if let Some($simd) = level.as_avx512() {
                return fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $body,
                );
            }
            if let Some($simd) = level.as_avx2() {
                return fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $body,
                );
            }
        }
        #[cfg(target_arch = "aarch64")]
        if let Some($simd) = level.as_neon() {
            return fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $body,
            );
        }
        unreachable!("no kernel is compiled for {level:?}")
    }};
}
