//! Values as JSON has them, their keys in the order in which they were written.

use std::fmt;

use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

/// A JSON value. `serde_json::Value` would sort the keys; here a record's fields stay in the
/// order of its declaration, and whole numbers stay apart from others.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Tree {
    Missing,
    Flag(bool),
    Count(u64),
    Number(f64),
    Text(String),
    List(Vec<Tree>),
    Map(Vec<(String, Tree)>),
}

impl Tree {
    /// What serde writes of a value.
    pub(super) fn of(value: &impl Serialize) -> Self {
        let text = serde_json::to_string(value).expect("keys are texts");
        serde_json::from_str(&text).expect("what was just written is JSON")
    }
}

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Tree;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Tree, E> {
        Ok(Tree::Missing)
    }

    fn visit_bool<E: Error>(self, flag: bool) -> Result<Tree, E> {
        Ok(Tree::Flag(flag))
    }

    fn visit_u64<E: Error>(self, count: u64) -> Result<Tree, E> {
        Ok(Tree::Count(count))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Tree, E> {
        Ok(Tree::Number(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Tree, E> {
        Ok(Tree::Number(number))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Tree, E> {
        Ok(Tree::Text(text.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Tree, A::Error> {
        let mut list = Vec::new();
        while let Some(value) = from.next_element()? {
            list.push(value);
        }
        Ok(Tree::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut from: A) -> Result<Tree, A::Error> {
        let mut map = Vec::new();
        while let Some(entry) = from.next_entry()? {
            map.push(entry);
        }
        Ok(Tree::Map(map))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_keep_their_order_and_numbers_their_kind() {
        let tree: Tree = serde_json::from_str(r#"{"b": 1, "a": [1.0, -2, null, true]}"#).unwrap();
        let list = [Tree::Number(1.0), Tree::Number(-2.0), Tree::Missing, Tree::Flag(true)];
        let map = [("b", Tree::Count(1)), ("a", Tree::List(list.into()))];
        assert_eq!(tree, Tree::Map(map.map(|(k, v)| (k.to_string(), v)).into()));
        assert_eq!(Tree::of(&(u64::MAX, 0.1_f64, f64::NAN, "é")), {
            let text = Tree::Text("é".into());
            Tree::List(vec![Tree::Count(u64::MAX), Tree::Number(0.1), Tree::Missing, text])
        });
    }
}
