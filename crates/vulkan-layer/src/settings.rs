//! What the layer is told by environment variables, declared once for both sides.

use std::ffi::OsString;
use std::path::PathBuf;

/// The layer's name, by which the loader is told to use it.
pub const LAYER: &str = "VK_LAYER_SCREENDOOR_capture";

/// The manifest by which the loader finds the layer's library: JSON. `library` is as it stands there:
/// without quotation marks and backslashes, relative to the manifest where it begins with a dot.
pub fn manifest(library: &str) -> String {
    format!(
        r#"{{
    "file_format_version": "1.1.2",
    "layer": {{
        "name": "{LAYER}",
        "type": "GLOBAL",
        "library_path": "{library}",
        "api_version": "1.3.0",
        "implementation_version": "1",
        "description": "screendoor's capture of fragments",
        "functions": {{
            "vkNegotiateLoaderLayerInterfaceVersion": "vkNegotiateLoaderLayerInterfaceVersion"
        }}
    }}
}}
"#
    )
}

/// What is captured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Span {
    /// The first frame that leaves a record; all there is where the program never presents.
    #[default]
    First,
    /// Frames, the last included, counted from 0 by presentations.
    Frames(u64, u64),
    /// Submissions of a device, the last included, counted from 0.
    Submissions(u64, u64),
}

/// How the layer captures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Where its files go. Nothing is captured without.
    pub folder: Option<PathBuf>,
    pub span: Span,
    /// Of which colour output records are made.
    pub location: u32,
    /// Records to have memory for at the start.
    pub capacity: u64,
    /// Read the images drawn into after each submission too.
    pub pictures: bool,
    /// Keep records where a buffer's address is, where the device can.
    pub address: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            folder: None,
            span: Span::First,
            location: 0,
            capacity: 1 << 22,
            pictures: false,
            address: true,
        }
    }
}

const FOLDER: &str = "SCREENDOOR_VULKAN_FOLDER";
const SPAN: &str = "SCREENDOOR_VULKAN_SPAN";
const LOCATION: &str = "SCREENDOOR_VULKAN_LOCATION";
const CAPACITY: &str = "SCREENDOOR_VULKAN_CAPACITY";
const PICTURES: &str = "SCREENDOOR_VULKAN_PICTURES";
const ADDRESS: &str = "SCREENDOOR_VULKAN_ADDRESS";

impl Settings {
    /// As variables for the program's environment.
    pub fn variables(&self) -> Vec<(&'static str, OsString)> {
        let span = match self.span {
            Span::First => "first".to_string(),
            Span::Frames(a, b) => format!("frames {a} {b}"),
            Span::Submissions(a, b) => format!("submissions {a} {b}"),
        };
        let mut all = vec![
            (SPAN, span.into()),
            (LOCATION, self.location.to_string().into()),
            (CAPACITY, self.capacity.to_string().into()),
            (PICTURES, u8::from(self.pictures).to_string().into()),
            (ADDRESS, u8::from(self.address).to_string().into()),
        ];
        all.extend(self.folder.iter().map(|f| (FOLDER, f.as_os_str().to_owned())));
        all
    }

    /// As `get` gives variables; what is not there or cannot be read is as by default.
    pub fn read(get: impl Fn(&str) -> Option<OsString>) -> Self {
        let default = Self::default();
        let text = |name| get(name).and_then(|value| value.into_string().ok());
        let flag = |name, other| text(name).map_or(other, |value| value != "0");
        Self {
            folder: get(FOLDER).map(PathBuf::from),
            span: text(SPAN).and_then(|s| span(&s)).unwrap_or_default(),
            location: text(LOCATION).and_then(|s| s.parse().ok()).unwrap_or(default.location),
            capacity: text(CAPACITY).and_then(|s| s.parse().ok()).unwrap_or(default.capacity),
            pictures: flag(PICTURES, default.pictures),
            address: flag(ADDRESS, default.address),
        }
    }
}

fn span(text: &str) -> Option<Span> {
    let mut words = text.split(' ');
    let kind = words.next()?;
    let mut number = || words.next()?.parse().ok();
    match kind {
        "frames" => Some(Span::Frames(number()?, number()?)),
        "submissions" => Some(Span::Submissions(number()?, number()?)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_read_as_they_were_written() {
        for span in [Span::First, Span::Frames(3, 9), Span::Submissions(0, u64::MAX)] {
            let settings = Settings {
                folder: Some("/a b".into()),
                span,
                location: 2,
                capacity: 17,
                pictures: true,
                address: false,
            };
            let variables = settings.variables();
            let get = |name: &str| variables.iter().find(|v| v.0 == name).map(|v| v.1.clone());
            assert_eq!(Settings::read(get), settings);
        }
        assert_eq!(Settings::read(|_| None), Settings::default());
    }
}
