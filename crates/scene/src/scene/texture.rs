//! Textures with mip levels, filtered in linear light.

use std::path::Path;

use glam::{Vec2, Vec4};
use image::DynamicImage;

use crate::elementary;
use crate::scene::file;
use crate::scene::image_file::{self, MAX_SIDE};
use crate::scene::sampling::{Filter, Sampling, Taps, Wrap};
use screendoor_trace::error::Result;
use screendoor_trace::picture::{Rgba, srgb};

/// What the numbers of an image file mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Encoding {
    /// Colours, encoded as sRGB; alphas are linear nonetheless.
    Srgb,
    /// Data, such as opacity.
    Linear,
    /// Colours as sRGB, which have no alpha, whatever the file has for one.
    OpaqueSrgb,
    /// Data without an alpha.
    OpaqueLinear,
}

impl Encoding {
    fn is_srgb(self) -> bool {
        matches!(self, Encoding::Srgb | Encoding::OpaqueSrgb)
    }

    fn is_opaque(self) -> bool {
        matches!(self, Encoding::OpaqueSrgb | Encoding::OpaqueLinear)
    }
}

/// A texture: linear colours multiplied by alpha, in 16 bits a channel, so that
/// filtering leaves no fringes around cut-outs; level 0 and all its mip levels.
#[derive(Clone)]
pub struct Texture {
    levels: Vec<Level>,
    sampling: Sampling,
    has_alpha: bool,
}

#[derive(Clone)]
struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u16; 4]>,
}

const UNORM16: f32 = 65535.0;

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({}x{})", self.width(), self.height())
    }
}

impl Texture {
    /// A texture whose texel (x, y) has the linear colour and the alpha (not
    /// multiplied) that `texel` gives, each in [0, 1].
    ///
    /// # Panics
    /// Where a side is 0 or above 16384.
    pub fn from_fn(width: u32, height: u32, mut texel: impl FnMut(u32, u32) -> Vec4) -> Self {
        assert!((1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height));
        let mut has_alpha = false;
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let c = texel(x, y).clamp(Vec4::ZERO, Vec4::ONE);
                has_alpha |= c.w < 1.0;
                let premultiplied = (c.truncate() * c.w).extend(c.w);
                texels.push((premultiplied * UNORM16 + 0.5).to_array().map(|v| v as u16));
            }
        }
        let mut levels = vec![Level { width, height, texels }];
        while let Some(next) = levels.last().and_then(Level::halved) {
            levels.push(next);
        }
        Texture { levels, sampling: Sampling::default(), has_alpha }
    }

    /// The same texture with other rules beyond its edges, horizontally and
    /// vertically.
    pub fn wrapped(mut self, wrap: [Wrap; 2]) -> Self {
        self.sampling.wrap = wrap;
        self
    }

    /// The same texture, sampled in another way.
    pub fn sampled(self, sampling: Sampling) -> Self {
        Texture { sampling, ..self }
    }

    /// Decodes a PNG, JPEG, WebP, BMP or TGA; colours are taken as sRGB. `place` names it in errors.
    ///
    /// # Errors
    /// [`Error::Invalid`](screendoor_trace::error::Error::Invalid) where it cannot be decoded,
    /// [`Error::Unsupported`](screendoor_trace::error::Error::Unsupported) where
    /// it has more than 16384 texels on a side or 64 Mi in all.
    pub fn decode(bytes: &[u8], place: &str) -> Result<Self> {
        Ok(Self::from_image(image_file::decode(bytes, place)?, Encoding::Srgb))
    }

    /// Reads a PNG, JPEG, WebP, BMP or TGA file; colours are taken as sRGB.
    ///
    /// # Errors
    /// [`Error::Io`](screendoor_trace::error::Error::Io) where it cannot be read or is no regular file; as
    /// [`Texture::decode`].
    pub fn read(path: &Path) -> Result<Self> {
        Self::decode(&file::read(path)?, &path.display().to_string())
    }

    /// The texture of a decoded picture.
    pub(super) fn from_image(image: DynamicImage, encoding: Encoding) -> Self {
        let (width, height) = (image.width(), image.height());
        // Decodes a channel that is not alpha.
        let decode = |v: f64| if encoding.is_srgb() { srgb::decode(v) as f32 } else { v as f32 };
        let alpha = |v: f32| if encoding.is_opaque() { 1.0 } else { v };
        let rgba = Rgba::of(image);
        let table = rgba.table(decode);
        Texture::from_fn(width, height, |x, y| {
            let [r, g, b, _] = rgba.get(x, y);
            let [r, g, b] = [r, g, b].map(|v| table[usize::from(v)]);
            Vec4::new(r, g, b, alpha(rgba.alpha(x, y)))
        })
    }

    /// Makes every texel white, keeping alphas.
    pub(super) fn whiten(&mut self) {
        for [r, g, b, a] in self.levels.iter_mut().flat_map(|level| &mut level.texels) {
            // Colours are stored multiplied by alpha.
            (*r, *g, *b) = (*a, *a, *a);
        }
    }

    /// Texels across.
    pub fn width(&self) -> u32 {
        self.levels[0].width
    }

    /// Texels down.
    pub fn height(&self) -> u32 {
        self.levels[0].height
    }

    /// Whether any texel has an alpha below 1.
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// The texture's linear colour and alpha (not multiplied) at `uv`, filtered as its
    /// sampling says. `dx` and `dy` are the changes of `uv` over one pixel to the right and
    /// downwards.
    #[inline(always)]
    pub fn sample(&self, uv: Vec2, dx: Vec2, dy: Vec2) -> Vec4 {
        let size = Vec2::new(self.width() as f32, self.height() as f32);
        // The longer of the pixel's two sides in texels: OpenGL 4.6, section 8.14.
        let footprint = (dx * size).length_squared().max((dy * size).length_squared());
        let texels = if footprint > 1.0 { 0.5 * libm::log2f(footprint) } else { 0.0 };
        let top = self.levels.len() - 1;
        let (filter, fine, blend) = self.sampling.choose(texels, top);
        let mut colour = self.filtered(filter, fine, uv);
        if blend > 0.0 && fine < top {
            colour = colour.lerp(self.filtered(filter, fine + 1, uv), blend);
        }
        divided(colour)
    }

    /// [`Texture::sample`] for the first `count` of several places at once.
    #[inline(always)]
    pub(crate) fn sample_each<const N: usize>(
        &self,
        uv: &[[f32; N]; 2],
        dx: &[[f32; N]; 2],
        dy: &[[f32; N]; 2],
        count: usize,
    ) -> [Vec4; N] {
        let count = count.min(N);
        let linear = [self.sampling.magnify, self.sampling.minify] == [Filter::Linear; 2];
        let many = if linear { self.filtered_each(uv, dx, dy, count) } else { None };
        many.unwrap_or_else(|| {
            let mut colours = [Vec4::ZERO; N];
            for (i, colour) in colours[..count].iter_mut().enumerate() {
                let at = |v: &[[f32; N]; 2]| Vec2::new(v[0][i], v[1][i]);
                *colour = self.sample(at(uv), at(dx), at(dy));
            }
            colours
        })
    }

    /// The same where filters are linear; `None` where a number is beyond all reason.
    #[inline(always)]
    fn filtered_each<const N: usize>(
        &self,
        uv: &[[f32; N]; 2],
        dx: &[[f32; N]; 2],
        dy: &[[f32; N]; 2],
        count: usize,
    ) -> Option<[Vec4; N]> {
        let (width, height) = (self.width() as f32, self.height() as f32);
        let square = |x: f32, y: f32| {
            let (x, y) = (x * width, y * height);
            x * x + y * y
        };
        let mut sizes = [0.0; N];
        let mut finite = true;
        for i in 0..N {
            let footprint = square(dx[0][i], dx[1][i]).max(square(dy[0][i], dy[1][i]));
            finite &= i >= count || footprint < f32::INFINITY;
            let texels = 0.5 * elementary::log2(footprint);
            sizes[i] = if footprint > 1.0 { texels } else { 0.0 };
        }
        if !finite {
            return None;
        }
        let top = self.levels.len() - 1;
        // The finer level of each place and the share of the next.
        let (mut fine, mut blends) = ([0; N], [0.0; N]);
        for i in 0..count {
            (_, fine[i], blends[i]) = self.sampling.choose(sizes[i], top);
        }
        let mut colours = self.level_each(uv, &fine, count)?;
        let both = |i: usize| blends[i] > 0.0 && fine[i] < top;
        if (0..count).any(both) {
            let coarse = fine.map(|level| (level + 1).min(top));
            let others = self.level_each(uv, &coarse, count)?;
            for i in (0..count).filter(|i| both(*i)) {
                colours[i] = colours[i].lerp(others[i], blends[i]);
            }
        }
        for colour in &mut colours[..count] {
            *colour = divided(*colour);
        }
        Some(colours)
    }

    /// [`Texture::filtered`], linear, of a level for each place.
    #[inline(always)]
    fn level_each<const N: usize>(
        &self,
        uv: &[[f32; N]; 2],
        levels: &[usize; N],
        count: usize,
    ) -> Option<[Vec4; N]> {
        let mut sizes = [[1; N]; 2];
        let mut coordinates = [[0.5; N]; 2];
        for i in 0..count {
            let level = &self.levels[levels[i]];
            (sizes[0][i], sizes[1][i]) = (level.width, level.height);
            (coordinates[0][i], coordinates[1][i]) = (uv[0][i], uv[1][i]);
        }
        let x = Taps::linear(&coordinates[0], &sizes[0], self.sampling.wrap[0]);
        let y = Taps::linear(&coordinates[1], &sizes[1], self.sampling.wrap[1]);
        if !(x.good && y.good) {
            return None;
        }
        let mut colours = [Vec4::ZERO; N];
        for i in 0..count {
            let level = &self.levels[levels[i]];
            let row =
                |y: u32| level.texel(x.low[i], y).lerp(level.texel(x.high[i], y), x.weight[i]);
            colours[i] = row(y.low[i]).lerp(row(y.high[i]), y.weight[i]);
        }
        Some(colours)
    }

    #[inline(always)]
    fn filtered(&self, filter: Filter, level: usize, uv: Vec2) -> Vec4 {
        let (level, wrap) = (&self.levels[level], self.sampling.wrap);
        let (x0, x1, fx) = filter.taps(uv.x, level.width, wrap[0]);
        let (y0, y1, fy) = filter.taps(uv.y, level.height, wrap[1]);
        if filter == Filter::Nearest {
            return level.texel(x0, y0);
        }
        let top = level.texel(x0, y0).lerp(level.texel(x1, y0), fx);
        let bottom = level.texel(x0, y1).lerp(level.texel(x1, y1), fx);
        top.lerp(bottom, fy)
    }
}

/// A colour that was multiplied by its alpha, not multiplied.
#[inline(always)]
fn divided(colour: Vec4) -> Vec4 {
    let alpha = colour.w;
    if alpha > 0.0 { (colour.truncate() / alpha).extend(alpha) } else { Vec4::ZERO }
}

impl Level {
    #[inline(always)]
    fn texel(&self, x: u32, y: u32) -> Vec4 {
        let [r, g, b, a] = self.texels[(y * self.width + x) as usize].map(f32::from);
        Vec4::new(r, g, b, a) / UNORM16
    }

    /// The next mip level: a box filter over 2 × 2 texels (odd sides repeat the
    /// last texel); `None` below 1 × 1.
    fn halved(&self) -> Option<Level> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut texels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0_u32; 4];
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let x = (2 * x + dx).min(self.width - 1);
                    let y = (2 * y + dy).min(self.height - 1);
                    let texel = self.texels[(y * self.width + x) as usize];
                    for (s, t) in sum.iter_mut().zip(texel) {
                        *s += u32::from(t);
                    }
                }
                texels.push(sum.map(|s| ((s + 2) / 4) as u16));
            }
        }
        Some(Level { width, height, texels })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use screendoor_trace::random::Stream;

    use super::*;

    fn checker() -> Texture {
        Texture::from_fn(4, 4, |x, y| {
            if (x + y) % 2 == 0 { Vec4::ONE } else { Vec4::new(0.0, 0.0, 0.0, 1.0) }
        })
    }

    #[test]
    fn texel_centres_are_exact_and_midpoints_are_means() {
        let texture = checker();
        let at = |x: f32, y: f32| texture.sample(Vec2::new(x, y) / 4.0, Vec2::ZERO, Vec2::ZERO).x;
        assert_eq!(at(0.5, 0.5), 1.0);
        assert_eq!(at(1.5, 0.5), 0.0);
        assert!((at(1.0, 0.5) - 0.5).abs() < 1e-6);
        // Beyond the edge the texture repeats.
        assert_eq!(at(4.5, 0.5), 1.0);
        assert_eq!(at(-0.5, 0.5), 0.0);
        assert!((at(0.0, 0.5) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn several_texels_are_those_of_each() {
        let mut random = Stream::new([0x7e4]);
        let mut real = |scale: f32| (random.word() as f32 / 2.2e9 - 0.98) * scale;
        for (round, [width, height]) in [[1, 1], [2, 3], [16, 5], [31, 64]].into_iter().enumerate()
        {
            let texture = Texture::from_fn(width, height, |x, y| {
                let value = |k: u32| ((x * 7 + y * 13 + k * 5) % 11) as f32 / 10.0;
                Vec4::new(value(0), value(1), value(2), value(3))
            });
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                for magnify in [Filter::Linear, Filter::Nearest] {
                    let sampling = Sampling {
                        wrap: [wrap, Wrap::Repeat],
                        magnify,
                        levels: [Some(Filter::Linear), Some(Filter::Nearest), None][round % 3],
                        ..Sampling::default()
                    };
                    let texture = texture.clone().sampled(sampling);
                    for i in 0..300 {
                        // Coordinates that no vector is for now and then.
                        let reach = [1.0, 3.0, 300.0, 1e12, f32::INFINITY][i % 5];
                        let mut lanes = |scale| [[0.0_f32; 8]; 2].map(|v| v.map(|_| real(scale)));
                        let (uv, size) = (lanes(reach), [0.001, 0.1, 2.0, 1e30][i % 4]);
                        let (dx, dy) = (lanes(size), lanes(size));
                        let count = i % 9;
                        let found = texture.sample_each(&uv, &dx, &dy, count);
                        for (k, found) in found[..count].iter().enumerate() {
                            let at = |v: &[[f32; 8]; 2]| Vec2::new(v[0][k], v[1][k]);
                            let wanted = texture.sample(at(&uv), at(&dx), at(&dy));
                            let bits = |v: Vec4| v.to_array().map(f32::to_bits);
                            assert_eq!(bits(*found), bits(wanted), "{sampling:?} {uv:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn far_away_it_is_its_mean() {
        let far = checker().sample(Vec2::new(0.3, 0.7), Vec2::X, Vec2::Y);
        assert!((far - Vec4::new(0.5, 0.5, 0.5, 1.0)).abs().max_element() < 1e-4, "{far}");
    }

    #[test]
    fn transparent_texels_do_not_bleed() {
        // White and opaque beside black and transparent: half way the colour is
        // still white.
        let texture = Texture::from_fn(2, 1, |x, _| if x == 0 { Vec4::ONE } else { Vec4::ZERO });
        let half = texture.sample(Vec2::new(0.5, 0.5), Vec2::ZERO, Vec2::ZERO);
        assert!((half - Vec4::new(1.0, 1.0, 1.0, 0.5)).abs().max_element() < 1e-4, "{half}");
        assert!(texture.has_alpha());
    }

    #[test]
    fn nearest_texels_are_not_mixed() {
        let sampling =
            Sampling { magnify: Filter::Nearest, minify: Filter::Nearest, ..Sampling::default() };
        let texture = checker().sampled(Sampling { levels: None, ..sampling });
        let at = |x: f32, dx: f32| {
            texture.sample(Vec2::new(x / 4.0, 0.125), Vec2::new(dx, 0.0), Vec2::ZERO).x
        };
        assert_eq!([at(0.01, 0.0), at(0.99, 0.0), at(1.01, 0.0)], [1.0, 1.0, 0.0]);
        // From far away too, where there are no mip levels.
        assert_eq!([at(0.99, 1.0), at(1.01, 1.0)], [1.0, 0.0]);
    }

    #[test]
    fn opaque_textures_keep_the_colours_of_transparent_texels() {
        let half = image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba([200, 100, 50, x as u8]));
        let texture = |encoding| Texture::from_image(half.clone().into(), encoding);
        let opaque = texture(Encoding::OpaqueSrgb);
        let middle = opaque.sample(Vec2::splat(0.5), Vec2::ZERO, Vec2::ZERO);
        let wanted = [200, 100, 50].map(|v| srgb::decode(f64::from(v) / 255.0) as f32);
        assert!((middle.truncate() - Vec3::from(wanted)).abs().max_element() < 1e-4, "{middle}");
        assert!(middle.w == 1.0 && !opaque.has_alpha() && texture(Encoding::Srgb).has_alpha());
        let data = texture(Encoding::OpaqueLinear).sample(Vec2::ZERO, Vec2::ZERO, Vec2::ZERO);
        assert!((data.x - 200.0 / 255.0).abs() < 1e-4, "{data}");
    }

    #[test]
    fn a_broken_file_is_one_error() {
        let error = Texture::decode(b"\x89PNG\r\n\x1a\nrubbish", "a.png").unwrap_err().to_string();
        assert!(error.starts_with("a.png: the texture cannot be decoded"), "{error}");
    }
}
