//! What a file says that is not read, counted for one warning.

use std::collections::BTreeMap;

use super::lines::shown;

/// How many different words are counted, and how many a warning names.
const MAX_WORDS: usize = 1 << 10;
const MAX_NAMED: usize = 12;

/// Words that were met, each with the line of its first and how many there were.
#[derive(Default)]
pub(super) struct Unread(BTreeMap<String, (usize, usize)>);

impl Unread {
    /// Counts a word that stands in that line.
    pub(super) fn add(&mut self, word: &str, line: usize) {
        if let Some((_, count)) = self.0.get_mut(word) {
            *count += 1;
        } else if self.0.len() < MAX_WORDS {
            self.0.insert(word.to_string(), (line, 1));
        }
    }

    /// The words, as a warning names them; `None` where there are none.
    pub(super) fn named(&self) -> Option<String> {
        let mut words: Vec<_> = self.0.iter().collect();
        words.sort_by_key(|(_, (line, _))| *line);
        let more = words.len().saturating_sub(MAX_NAMED);
        let name = |(word, (line, count)): &(&String, &(usize, usize))| match count {
            1 => format!("{} in line {line}", shown(word)),
            _ => format!("{} {count} times from line {line} on", shown(word)),
        };
        let mut named: Vec<String> = words.iter().take(MAX_NAMED).map(name).collect();
        if more > 0 {
            named.push(format!("and {more} others"));
        }
        (!named.is_empty()).then(|| named.join(", "))
    }
}
