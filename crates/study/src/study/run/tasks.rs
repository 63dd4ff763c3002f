//! What a study consists of, as tasks that can be done one by one, in parts, anywhere.

use std::str::FromStr;

use crate::study::file::{Publication, Study};
use screendoor_trace::error::{Error, Result};

/// One design at one sample count on one scene.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Job {
    /// Names it within its study: `scene.samples.design`, a file name on every system.
    pub id: String,
    /// The scene's place in the study.
    pub scene: usize,
    /// Samples per pixel.
    pub samples: u32,
    /// The design as the study has it.
    pub series: String,
}

/// A part of a study that is done or is not.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Task {
    /// A run.
    Run(Job),
    /// A publication that is measured again.
    Publication(Publication),
}

/// A study's runs: scene after scene, sample count after sample count, designs in the
/// study's order.
pub fn jobs(study: &Study) -> Vec<Job> {
    let mut list = Vec::new();
    for (scene, entry) in study.scenes.iter().enumerate() {
        for samples in &study.samples {
            list.extend(study.designs.iter().map(|series| Job {
                id: format!("{}.{samples}.{}", entry.name, slug(series)),
                scene,
                samples: *samples,
                series: series.clone(),
            }));
        }
    }
    list
}

/// Everything that a study asks for: its runs, then the publications.
pub fn tasks(study: &Study) -> Vec<Task> {
    let publications = study.publications_to_measure().into_iter().map(Task::Publication);
    jobs(study).into_iter().map(Task::Run).chain(publications).collect()
}

/// Longest name of a design in a file's name.
const MOST_CHARS: usize = 80;

/// A design in a file's name. What had to be changed or is too long ends in a hash, so
/// that no two designs share a name.
fn slug(series: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=,".contains(c);
    let mut name = String::new();
    for c in series.chars() {
        match c {
            c if plain(c) => name.push(c),
            ':' => name.push('-'),
            '{' | '}' => {}
            _ => name.push('_'),
        }
    }
    // What these changes alone give stays readable; it is unique where series are.
    let regular = series.chars().all(|c| plain(c) || ":{}".contains(c));
    if regular && name.len() <= MOST_CHARS {
        return name;
    }
    name.truncate(MOST_CHARS - 9);
    let hash = blake3::hash(series.as_bytes()).to_hex();
    format!("{name}-{}", &hash[..8])
}

/// One of several parts of a study: `2/5` is the second of five.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shard {
    /// Which, from 1.
    pub part: u32,
    /// Of how many.
    pub of: u32,
}

impl Shard {
    /// The whole.
    pub const WHOLE: Shard = Shard { part: 1, of: 1 };

    /// The part's share of a list: neighbours stay together, since they share a scene, and
    /// sizes differ by one at most.
    pub fn share<T>(self, list: &[T]) -> &[T] {
        let edge = |part: u32| (list.len() as u64 * u64::from(part) / u64::from(self.of)) as usize;
        &list[edge(self.part - 1)..edge(self.part)]
    }
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = |text: &str| text.trim().parse::<u32>().ok().filter(|n| *n <= 1_000_000);
        let parts = text.split_once('/').and_then(|(i, n)| Some((number(i)?, number(n)?)));
        match parts {
            Some((part, of)) if (1..=of).contains(&part) => Ok(Shard { part, of }),
            _ => Err(Error::config(
                format_args!("'{text}' is no part"),
                "write the second of five as 2/5",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_hold_everything_once() {
        let list: Vec<u32> = (0..17).collect();
        for of in 1..=20 {
            let parts = (1..=of).map(|part| Shard { part, of }.share(&list));
            let sizes: Vec<usize> = parts.clone().map(<[u32]>::len).collect();
            assert_eq!(parts.flatten().copied().collect::<Vec<_>>(), list);
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
        }
        assert_eq!("2/5".parse::<Shard>().unwrap(), Shard { part: 2, of: 5 });
        for bad in ["", "1", "0/3", "4/3", "1/0", "-1/2", "1/2/3", "a/b", "1/9999999"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }

    #[test]
    fn designs_have_names_of_their_own() {
        assert_eq!(slug("kbuffer:layers={n}"), "kbuffer-layers=n");
        assert_eq!(slug("slab:layers=4,bits=8"), "slab-layers=4,bits=8");
        let long = format!("lk:{}", "a".repeat(300));
        assert!(slug(&long).len() <= MOST_CHARS && slug(&long) != slug(&format!("{long}b")));
        assert_ne!(slug("a/b"), slug("a\\b"));
        assert!(!slug("../../x").contains('/') && !slug("é").contains('é'));
    }
}
