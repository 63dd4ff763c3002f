//! How textures are read between and beyond their texels.

/// What lies beyond a texture's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture mirrored.
    Mirror,
    /// Its last texel.
    Clamp,
}

/// What lies between texels, and between mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The nearest of them.
    Nearest,
    /// Both, by how near they are.
    #[default]
    Linear,
}

/// How a texture is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampling {
    /// What lies beyond its edges, horizontally and vertically.
    pub wrap: [Wrap; 2],
    /// The filter where a texel is larger than a pixel.
    pub magnify: Filter,
    /// The filter where texels are smaller than pixels.
    pub minify: Filter,
    /// The filter between mip levels; without one the texture itself serves all sizes.
    pub levels: Option<Filter>,
}

impl Default for Sampling {
    /// Repeated, linear in all ways.
    fn default() -> Self {
        Sampling {
            wrap: [Wrap::Repeat; 2],
            magnify: Filter::Linear,
            minify: Filter::Linear,
            levels: Some(Filter::Linear),
        }
    }
}

impl Sampling {
    /// The filter within a level, the finer of the levels that are read of 0..=`top`, and
    /// the share of the next one, where a pixel is 2^`size` texels wide.
    #[inline(always)]
    pub(super) fn choose(&self, size: f32, top: usize) -> (Filter, usize, f32) {
        if size <= 0.0 {
            return (self.magnify, 0, 0.0);
        }
        let size = size.min(top as f32);
        match self.levels {
            None => (self.minify, 0, 0.0),
            // Halves go to the finer one, as OpenGL has it.
            Some(Filter::Nearest) => (self.minify, libm::ceilf(size - 0.5).max(0.0) as usize, 0.0),
            Some(Filter::Linear) => {
                let fine = size as usize;
                (self.minify, fine, size - fine as f32)
            }
        }
    }
}

/// The two texels around each of several coordinates, the weights of the second ones, and
/// whether they are what [`Filter::taps`] says: not where a coordinate is beyond all reason.
pub(super) struct Taps<const N: usize> {
    pub low: [u32; N],
    pub high: [u32; N],
    pub weight: [f32; N],
    pub good: bool,
}

impl<const N: usize> Taps<N> {
    /// By the linear filter, of textures of `sizes` texels.
    #[inline(always)]
    pub(super) fn linear(coordinates: &[f32; N], sizes: &[u32; N], wrap: Wrap) -> Self {
        match wrap {
            Wrap::Repeat => Self::with(
                coordinates,
                sizes,
                1,
                false,
                #[inline(always)]
                |i, n| {
                    let i = if i < 0 { i + n } else { i };
                    if i >= n { i - n } else { i }
                },
            ),
            Wrap::Clamp => Self::with(
                coordinates,
                sizes,
                1,
                true,
                #[inline(always)]
                |i, n| i.max(0).min(n - 1),
            ),
            Wrap::Mirror => Self::with(
                coordinates,
                sizes,
                2,
                false,
                #[inline(always)]
                |i, n| {
                    let i = if i < 0 { i + 2 * n } else { i };
                    let i = if i >= 2 * n { i - 2 * n } else { i };
                    if i < n { i } else { 2 * n - 1 - i }
                },
            ),
        }
    }

    /// The same with a period of `periods` sizes, of which `place` finds a texel at most a
    /// period beside the first.
    #[inline(always)]
    fn with(
        coordinates: &[f32; N],
        sizes: &[u32; N],
        periods: u32,
        clamped: bool,
        place: impl Fn(i32, i32) -> i32,
    ) -> Self {
        let mut taps = Taps { low: [0; N], high: [0; N], weight: [0.0; N], good: true };
        for i in 0..N {
            let (n, size) = (sizes[i] as i32, sizes[i] as f32);
            let period = periods as f32 * size;
            let at = coordinates[i] * size;
            let at = match clamped {
                true if at < 0.0 => 0.0,
                true if at > period => period,
                true => at,
                false => at - period * (at / period).floor(),
            } - 0.5;
            let low = at.floor();
            // What is no number is not good either.
            taps.good &= low >= -1.0 && low < period;
            taps.weight[i] = at - low;
            // Between -1 and a period, which 16 bits hold, or not good.
            let first = low as i32;
            taps.low[i] = place(first, n) as u32;
            taps.high[i] = place(first + 1, n) as u32;
        }
        taps
    }
}

impl Filter {
    /// The two texels around a coordinate of a texture of `size` texels and the weight of the
    /// second.
    #[inline(always)]
    pub(super) fn taps(self, coordinate: f32, size: u32, wrap: Wrap) -> (u32, u32, f32) {
        let period = match wrap {
            Wrap::Repeat | Wrap::Clamp => size as f32,
            Wrap::Mirror => 2.0 * size as f32,
        };
        let mut at = coordinate * size as f32;
        if wrap == Wrap::Clamp {
            at = at.clamp(0.0, period);
        } else {
            // Keeps large coordinates of tiled textures precise.
            at -= period * (at / period).floor();
        }
        let index = |i: f32| {
            let (i, n) = (i as i64, i64::from(size));
            // Most are within the texture, and a division takes long.
            if (0..n).contains(&i) {
                return i as u32;
            }
            let i = match wrap {
                Wrap::Repeat => i.rem_euclid(n),
                Wrap::Clamp => i.clamp(0, n - 1),
                Wrap::Mirror => {
                    let i = i.rem_euclid(2 * n);
                    if i < n { i } else { 2 * n - 1 - i }
                }
            };
            i as u32
        };
        match self {
            Filter::Nearest => {
                let nearest = index(at.floor());
                (nearest, nearest, 0.0)
            }
            Filter::Linear => {
                let at = at - 0.5;
                let low = at.floor();
                (index(low), index(low + 1.0), at - low)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirror_and_clamp() {
        let taps = |coordinate, wrap| Filter::Linear.taps(coordinate, 4, wrap);
        assert_eq!(taps(-0.125, Wrap::Clamp).0, 0);
        assert_eq!(taps(1.2, Wrap::Clamp).1, 3);
        assert_eq!(taps(1.125, Wrap::Mirror).0, 3);
        assert_eq!(taps(-0.125, Wrap::Mirror).0, 0);
    }

    #[test]
    fn the_nearest_texel_and_what_is_beyond() {
        let nearest = |coordinate, wrap| {
            let (a, b, weight) = Filter::Nearest.taps(coordinate, 4, wrap);
            assert_eq!((a, weight), (b, 0.0));
            a
        };
        for (i, texel) in
            [(-0.3, [2, 1, 0]), (0.26, [1, 1, 1]), (0.99, [3, 3, 3]), (1.3, [1, 2, 3])]
        {
            let all = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| nearest(i, wrap));
            assert_eq!(all, texel, "{i}");
        }
    }

    #[test]
    fn levels_are_chosen_as_the_filters_say() {
        let of = |levels| Sampling { minify: Filter::Nearest, levels, ..Sampling::default() };
        // As large as a texel, or larger.
        assert_eq!(of(Some(Filter::Linear)).choose(0.0, 5), (Filter::Linear, 0, 0.0));
        assert_eq!(of(Some(Filter::Linear)).choose(1.25, 5), (Filter::Nearest, 1, 0.25));
        assert_eq!(of(Some(Filter::Linear)).choose(9.0, 5), (Filter::Nearest, 5, 0.0));
        assert_eq!(of(Some(Filter::Nearest)).choose(0.4, 5), (Filter::Nearest, 0, 0.0));
        assert_eq!(of(Some(Filter::Nearest)).choose(1.5, 5), (Filter::Nearest, 1, 0.0));
        assert_eq!(of(Some(Filter::Nearest)).choose(1.6, 5), (Filter::Nearest, 2, 0.0));
        assert_eq!(of(None).choose(3.0, 5), (Filter::Nearest, 0, 0.0));
    }
}
