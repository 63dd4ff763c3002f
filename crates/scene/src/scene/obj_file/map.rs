//! The statements of MTL files that name textures.

use glam::{Affine2, Vec2};

use super::lines::Statement;
use super::unread::Unread;
use crate::scene::image_file::Channel;

/// A texture as a statement names it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// The file.
    pub name: String,
    /// From the mesh's texture coordinates, with v downwards, to the texture's.
    pub transform: Affine2,
    /// Whether its last texels go on beyond its edges.
    pub clamp: bool,
    /// Which channel is an opacity.
    pub channel: Channel,
}

/// Reads a map statement: options, then the file's name. Options that are not applied are
/// counted in `unread`.
///
/// # Errors
/// What is missing.
pub(super) fn map(statement: &Statement, unread: &mut Unread) -> Result<Map, String> {
    let mut rest = statement.name();
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let (mut clamp, mut channel) = (false, Channel::AlphaOrLuminance);
    while let Some(option) = rest.split_whitespace().next().filter(|w| w.starts_with('-')) {
        let lower = option.to_ascii_lowercase();
        let (numbers, words) = match lower.as_str() {
            "-o" | "-s" | "-t" => (3, 0),
            "-mm" => (2, 0),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-bm" | "-boost"
            | "-imfchan" | "-type" => (0, 1),
            // A name that begins with a dash.
            _ => break,
        };
        rest = after(rest, option);
        let mut given = Vec::new();
        for i in 0..numbers + words {
            let Some(word) = rest.split_whitespace().next() else { break };
            // One number suffices to the options that take several.
            if i >= words && word.parse::<f32>().is_err() {
                break;
            }
            given.push(word);
            rest = after(rest, word);
        }
        let numbers: Vec<f32> = given.iter().filter_map(|word| word.parse().ok()).collect();
        let or = |i: usize, default| numbers.get(i).copied().unwrap_or(default);
        match (lower.as_str(), given.first().copied()) {
            ("-s", _) => scale = Vec2::new(or(0, 1.0), or(1, 1.0)),
            ("-o", _) => offset = Vec2::new(or(0, 0.0), or(1, 0.0)),
            ("-clamp", word) => clamp = word == Some("on"),
            ("-imfchan", Some("r")) => channel = Channel::One(0),
            ("-imfchan", Some("g")) => channel = Channel::One(1),
            ("-imfchan", Some("b")) => channel = Channel::One(2),
            ("-imfchan", Some("m")) => channel = Channel::One(3),
            ("-imfchan", Some("l")) => channel = Channel::Luminance,
            _ => unread.add(&lower, statement.line),
        }
    }
    if rest.is_empty() {
        return Err("it names no file; the statement is ignored".to_string());
    }
    if !(scale.is_finite() && offset.is_finite()) {
        return Err("its scale or offset is not finite; the statement is ignored".to_string());
    }
    // In the file v counts upwards: there the coordinate is scaled, then moved.
    let down = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    let transform = Affine2::from_scale_angle_translation(scale, 0.0, down);
    Ok(Map { name: rest.to_string(), transform, clamp, channel })
}

/// What follows the first word, which is `word`.
fn after<'a>(text: &'a str, word: &str) -> &'a str {
    text.trim_start()[word.len()..].trim_start()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map_of(text: &str) -> (Map, Option<String>) {
        let mut unread = Unread::default();
        (map(&Statement::of(text), &mut unread).unwrap(), unread.named())
    }

    #[test]
    fn options_stand_before_the_name() {
        let name_of = |text: &str| map_of(text).0.name;
        assert_eq!(name_of("map_Kd a.png"), "a.png");
        assert_eq!(name_of("map_Kd my leaf.png"), "my leaf.png");
        assert_eq!(name_of("map_Kd -s 2 2 1 -clamp on a b.png"), "a b.png");
        assert_eq!(name_of("map_Kd -o 0.5 a.png"), "a.png");
        assert_eq!(name_of("map_Kd -s 1 1 1 1.png"), "1.png");
        assert_eq!(name_of("map_d -imfchan m a.png"), "a.png");
        assert_eq!(name_of("map_Kd -mine.png"), "-mine.png");
        for text in ["map_Kd", "map_Kd -s 1 1 1", "map_Kd -s inf 1 1 a.png"] {
            assert!(map(&Statement::of(text), &mut Unread::default()).is_err(), "{text}");
        }
    }

    #[test]
    fn options_are_applied_or_counted() {
        let (map, unread) = map_of("map_Kd -o 0.5 0.25 0 -S 2 4 1 -clamp on a.png");
        assert_eq!((map.clamp, unread), (true, None));
        // (u, v) of the file becomes (2 u + 0.5, 4 v + 0.25), v being counted upwards.
        let at = map.transform.transform_point2(Vec2::new(0.25, 1.0 - 0.125));
        assert_eq!(at, Vec2::new(1.0, 1.0 - 0.75));
        assert_eq!(map_of("map_d -imfchan g a.png").0.channel, Channel::One(1));
        let (map, unread) = map_of("map_Kd -mm 0 1 -bm 2 -blendu off a.png");
        assert_eq!((map.transform, map.clamp), (Affine2::IDENTITY, false));
        let wanted = "-blendu in line 1, -bm in line 1, -mm in line 1";
        assert_eq!(unread.as_deref(), Some(wanted));
    }
}
