//! A study file's text, and what is wrong with it.

use std::path::Path;

use screendoor_trace::error::{Error, Result};

/// Texts longer than this are no study files.
const MOST_BYTES: u64 = 1 << 20;

pub(super) fn read_text(path: &Path) -> Result<String> {
    use std::io::Read;
    let file = std::fs::File::open(path).map_err(|e| Error::io("read", path, e))?;
    let mut text = String::new();
    let read = file.take(MOST_BYTES + 1).read_to_string(&mut text);
    read.map_err(|e| Error::io("read", path, e))?;
    if text.len() as u64 > MOST_BYTES {
        let what = "it is longer than 1 MiB";
        return Err(Error::invalid(path.display(), what, "give a study file"));
    }
    Ok(text)
}

/// What is wrong with a study file, and where; of an unknown name, which is the nearest.
pub(super) fn explained(error: &toml::de::Error, text: &str, place: &str) -> Error {
    let place = match error.span() {
        Some(span) => {
            let before = text.get(..span.start).unwrap_or("");
            format!("{place}, line {}", before.matches('\n').count() + 1)
        }
        None => place.to_string(),
    };
    // serde: unknown field `a`, expected one of `b`, `c`.
    let message = error.message().replace('\n', " ");
    let mut names = message.split('`').skip(1).step_by(2);
    let kind = [("unknown field", "key"), ("unknown variant", "name")]
        .into_iter()
        .find_map(|(start, kind)| message.starts_with(start).then_some(kind));
    if let (Some(kind), Some(name)) = (kind, names.next()) {
        return Error::unknown(&format!("{kind} in {place}:"), name, names);
    }
    Error::config(format_args!("{place}: {message}"), "correct it")
}
