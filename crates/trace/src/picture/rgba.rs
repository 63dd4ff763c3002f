//! The pixels of decoded image files as RGBA, in the depth that these have.

use image::{DynamicImage, ImageBuffer, RgbaImage};

/// Whether a picture's channels have more than 8 bits.
pub fn is_deep(image: &DynamicImage) -> bool {
    image.color().bytes_per_pixel() > image.color().channel_count()
}

/// A picture of four channels of 8 or of 16 bits: deep ones are not cut to 8, as they would
/// look the same where they are not.
pub enum Rgba {
    /// 8 bits a channel.
    Eight(RgbaImage),
    /// 16 bits a channel.
    Sixteen(ImageBuffer<image::Rgba<u16>, Vec<u16>>),
}

impl Rgba {
    /// The pixels of a decoded picture.
    pub fn of(image: DynamicImage) -> Self {
        match is_deep(&image) {
            true => Rgba::Sixteen(image.into_rgba16()),
            false => Rgba::Eight(image.into_rgba8()),
        }
    }

    /// The number that stands for 1.
    pub fn full(&self) -> u16 {
        match self {
            Rgba::Eight(_) => u16::from(u8::MAX),
            Rgba::Sixteen(_) => u16::MAX,
        }
    }

    /// The numbers of pixel (`x`, `y`).
    pub fn get(&self, x: u32, y: u32) -> [u16; 4] {
        match self {
            Rgba::Eight(image) => image.get_pixel(x, y).0.map(u16::from),
            Rgba::Sixteen(image) => image.get_pixel(x, y).0,
        }
    }

    /// The alpha of pixel (`x`, `y`), 0 to 1.
    pub fn alpha(&self, x: u32, y: u32) -> f32 {
        f32::from(self.get(x, y)[3]) / f32::from(self.full())
    }

    /// Whether any alpha is below 1.
    pub fn is_transparent(&self) -> bool {
        match self {
            Rgba::Eight(image) => image.pixels().any(|p| p.0[3] < u8::MAX),
            Rgba::Sixteen(image) => image.pixels().any(|p| p.0[3] < u16::MAX),
        }
    }

    /// What `decode` makes of each number of a channel, told as 0 to 1.
    pub fn table<T>(&self, decode: impl Fn(f64) -> T) -> Vec<T> {
        let full = f64::from(self.full());
        (0..=self.full()).map(|v| decode(f64::from(v) / full)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_keeps_its_depth() {
        let shallow = DynamicImage::ImageLumaA8(ImageBuffer::from_pixel(2, 1, [7, 51].into()));
        let deep = DynamicImage::ImageRgb16(ImageBuffer::from_pixel(2, 1, [7, 300, 9].into()));
        assert_eq!([&shallow, &deep].map(is_deep), [false, true]);
        let (shallow, deep) = (Rgba::of(shallow), Rgba::of(deep));
        assert_eq!((shallow.get(1, 0), deep.get(1, 0)), ([7, 7, 7, 51], [7, 300, 9, 65535]));
        assert_eq!((shallow.alpha(0, 0), deep.alpha(0, 0)), (0.2, 1.0));
        assert_eq!([&shallow, &deep].map(Rgba::is_transparent), [true, false]);
        for rgba in [&shallow, &deep] {
            let table = rgba.table(|v| v);
            assert_eq!((table.len(), table[0]), (usize::from(rgba.full()) + 1, 0.0));
            assert_eq!(table.last(), Some(&1.0));
        }
    }
}
