//! The textures of glTF files: samplers and images.

use std::borrow::Cow;

use super::Loader;
use super::extensions::TEXTURE_SOURCES;
use super::json::{Sampler, TextureSource};
use super::warnings::Matter;
use crate::scene::image_file;
use crate::scene::texture::Encoding;
use crate::scene::{Filter, Sampling, Texture, Wrap};
use screendoor_trace::error::Result;

/// What makes textures of the file the same in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct TextureKey {
    image: usize,
    sampling: Sampling,
    encoding: Encoding,
}

impl Loader<'_> {
    /// The scene's texture for the glTF texture of that number; none, where its image is
    /// missing or cannot be decoded. The second value is what is told of it.
    pub(super) fn texture(
        &mut self,
        index: usize,
        encoding: Encoding,
        namer: &str,
    ) -> Result<(Option<usize>, Vec<Matter>)> {
        let Some(said) = self.root.textures.get(index) else {
            let what = format!("it names texture {index}, which is not there");
            return Err(self.bad(namer, what, "export the file again"));
        };
        let part = format!("texture {index}");
        let default = Sampler::default();
        let sampler = match said.sampler {
            None => &default,
            Some(i) => match self.root.samplers.get(i) {
                Some(sampler) => sampler,
                None => {
                    let what = format!("it names sampler {i}, which is not there");
                    return Err(self.bad(&part, what, "export the file again"));
                }
            },
        };
        let sampling = sampling(sampler).map_err(|(name, value)| {
            let what = format!("its sampler's {name} {value} is not one that glTF allows");
            self.bad(&part, what, "export the file again")
        })?;
        let mut matters = self.warnings.extensions(said.extensions.names());
        // What an extension names comes first, where it is read; the core's is for readers
        // without it.
        let mut images = Vec::new();
        for name in &TEXTURE_SOURCES[..1] {
            let named: Option<TextureSource> = self.said(&said.extensions, name, &part)?;
            images.extend(named.and_then(|named| named.source));
        }
        images.extend(said.source);
        for image in &images {
            match self.image_texture(TextureKey { image: *image, sampling, encoding }) {
                Ok(texture) => return Ok((Some(texture), matters)),
                Err(matter) => matters.push(matter),
            }
        }
        // An image that only an extension names is told already.
        let elsewhere = TEXTURE_SOURCES.iter().any(|name| said.extensions.has(name));
        if images.is_empty() && !elsewhere {
            matters.push(self.warnings.matter(format_args!("{part} names no image")));
        }
        Ok((None, matters))
    }

    /// The scene's texture, or what is told where there is none.
    fn image_texture(&mut self, key: TextureKey) -> Result<usize, Matter> {
        if let Some(known) = self.textures.get(&key) {
            return *known;
        }
        let part = format!("image {}", key.image);
        let place = format!("{}, {part}", self.place);
        let decoded = self
            .image(key.image, &part)
            .and_then(|bytes| image_file::decode(&bytes, &place))
            .map(|image| Texture::from_image(image, key.encoding))
            .and_then(|texture| self.scene.add_texture(texture.sampled(key.sampling)));
        let made = decoded.map_err(|e| self.warnings.error(&e));
        self.textures.insert(key, made);
        made
    }

    /// The bytes of an image; their format stands in them, whatever the file says.
    fn image(&self, index: usize, part: &str) -> Result<Cow<'_, [u8]>> {
        let bad = |what: &str| Err(self.bad(part, what, "export the file again"));
        let Some(image) = self.root.images.get(index) else {
            return bad("it is not there");
        };
        match (image.buffer_view, &image.uri) {
            (Some(view), _) => self.view(view, part).map(|(_, bytes)| Cow::Borrowed(bytes)),
            (None, Some(uri)) => self.resolve(uri, part).map(Cow::Owned),
            (None, None) => bad("it names neither a file nor a buffer view"),
        }
    }
}

/// How a sampler reads textures; which of its values is not allowed, where one is not.
fn sampling(sampler: &Sampler) -> Result<Sampling, (&'static str, u32)> {
    use Filter::{Linear, Nearest};
    let wrap = |name, value| match value {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33071) => Ok(Wrap::Clamp),
        Some(33648) => Ok(Wrap::Mirror),
        Some(other) => Err((name, other)),
    };
    let magnify = match sampler.mag_filter {
        Some(9728) => Nearest,
        None | Some(9729) => Linear,
        Some(other) => return Err(("magFilter", other)),
    };
    let (minify, levels) = match sampler.min_filter {
        Some(9728) => (Nearest, None),
        Some(9729) => (Linear, None),
        Some(9984) => (Nearest, Some(Nearest)),
        Some(9985) => (Linear, Some(Nearest)),
        Some(9986) => (Nearest, Some(Linear)),
        None | Some(9987) => (Linear, Some(Linear)),
        Some(other) => return Err(("minFilter", other)),
    };
    let wrap = [wrap("wrapS", sampler.wrap_s)?, wrap("wrapT", sampler.wrap_t)?];
    Ok(Sampling { wrap, magnify, minify, levels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samplers_are_read_by_their_numbers() {
        use Filter::{Linear, Nearest};
        assert_eq!(sampling(&Sampler::default()), Ok(Sampling::default()));
        let minified = [
            (9728, Nearest, None),
            (9729, Linear, None),
            (9984, Nearest, Some(Nearest)),
            (9985, Linear, Some(Nearest)),
            (9986, Nearest, Some(Linear)),
            (9987, Linear, Some(Linear)),
        ];
        for (number, minify, levels) in minified {
            let said = Sampler { min_filter: Some(number), ..Sampler::default() };
            let read = sampling(&said).unwrap();
            assert_eq!((read.minify, read.levels, read.magnify), (minify, levels, Linear));
        }
        let wraps = [(10497, Wrap::Repeat), (33071, Wrap::Clamp), (33648, Wrap::Mirror)];
        for (number, wrap) in wraps {
            let said = Sampler { wrap_t: Some(number), ..Sampler::default() };
            assert_eq!(sampling(&said).unwrap().wrap, [Wrap::Repeat, wrap]);
        }
        let mipped = Sampler { mag_filter: Some(9987), ..Sampler::default() };
        assert_eq!(sampling(&mipped), Err(("magFilter", 9987)));
    }
}
