//! References of a file: to bodies, their colliders, and definitions.

use std::cell::Cell;
use std::collections::{BTreeMap, HashMap};
use std::fmt;

use serde::de::Visitor;
use serde::{Deserialize, Deserializer, Serialize};

use super::error::{FileError, content};
use super::fields::Tree;
use super::fields::math::{ColliderHandle, RigidBodyHandle};

/// A body of the scene, by its number or its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(super) enum Reference {
    Number(usize),
    Name(String),
}

impl From<usize> for Reference {
    fn from(number: usize) -> Self {
        Reference::Number(number)
    }
}

impl<'de> Deserialize<'de> for Reference {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl Visitor<'_> for Reader {
            type Value = Reference;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the number or the name of a body")
            }

            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Reference, E> {
                let number = usize::try_from(number);
                number.map(Reference::Number).map_err(E::custom)
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Reference, E> {
                Ok(Reference::Name(name.to_owned()))
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

/// The bodies and parts of a scene, by number, by name and by handle.
#[derive(Clone, Debug, Default)]
pub(super) struct Directory {
    pub bodies: Vec<RigidBodyHandle>,
    pub parts: Vec<Vec<ColliderHandle>>,
    body_numbers: HashMap<RigidBodyHandle, usize>,
    pub part_numbers: HashMap<ColliderHandle, (usize, usize)>,
    /// `None` for a name that several bodies have.
    named: HashMap<String, Option<usize>>,
}

impl Directory {
    pub(super) fn push(
        &mut self,
        name: Option<&str>,
        body: RigidBodyHandle,
        parts: Vec<ColliderHandle>,
    ) {
        let number = self.bodies.len();
        self.body_numbers.insert(body, number);
        for (place, part) in parts.iter().enumerate() {
            self.part_numbers.insert(*part, (number, place));
        }
        if let Some(name) = name {
            let known = self.named.insert(name.to_owned(), Some(number));
            if known.is_some() {
                self.named.insert(name.to_owned(), None);
            }
        }
        self.bodies.push(body);
        self.parts.push(parts);
    }

    pub(super) fn number_of_body(&self, body: RigidBodyHandle) -> Option<usize> {
        self.body_numbers.get(&body).copied()
    }

    /// The number of its body, and its own among the parts of that body.
    pub(super) fn number_of_part(&self, part: ColliderHandle) -> Option<(usize, usize)> {
        self.part_numbers.get(&part).copied()
    }

    /// The bodies with their parts.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&RigidBodyHandle, &Vec<ColliderHandle>)> {
        self.bodies.iter().zip(&self.parts)
    }

    fn number(&self, body: &Reference) -> Result<usize, FileError> {
        let count = self.bodies.len();
        let message = match body {
            Reference::Number(number) if *number < count => return Ok(*number),
            Reference::Number(number) => {
                format!("there is no body {number}; the scene has {count}, from 0")
            }
            Reference::Name(name) => match self.named.get(name) {
                Some(Some(number)) => return Ok(*number),
                Some(None) => format!("several bodies are named `{name}`"),
                None => format!("there is no body `{name}`"),
            },
        };
        Err(content(message).within("body"))
    }

    pub(super) fn body(&self, body: &Reference) -> Result<RigidBodyHandle, FileError> {
        self.number(body).map(|number| self.bodies[number])
    }

    pub(super) fn part(&self, body: &Reference, part: usize) -> Result<ColliderHandle, FileError> {
        let body = self.number(body)?;
        let parts = &self.parts[body];
        let count = parts.len();
        let missing = || {
            content(format!(
                "body {body} has no part {part}; it has {count}, from 0"
            ))
        };
        let part = parts.get(part).copied();
        part.ok_or_else(|| missing().within("part"))
    }
}

/// The most fields that all uses of definitions may make together.
const MOST_USED: usize = 1_000_000;

/// The bodies and definitions to which a tree may refer.
#[derive(Default)]
pub(super) struct Names<'a> {
    /// The bodies of the scene; without a scene, bodies are Rapier's handles.
    pub directory: Option<&'a Directory>,
    pub definitions: BTreeMap<String, Tree>,
    used: Cell<usize>,
}

impl<'a> Names<'a> {
    pub(super) fn of(directory: Option<&'a Directory>) -> Self {
        Names {
            directory,
            ..Names::default()
        }
    }

    pub(super) fn definition(&self, name: &str) -> Result<Tree, FileError> {
        let Some(tree) = self.definitions.get(name) else {
            return Err(content(format!("there is no definition `{name}`")));
        };
        let used = self.used.get().saturating_add(tree.field_count());
        self.used.set(used);
        if used > MOST_USED {
            let message = format!("definitions make more than {MOST_USED} fields");
            return Err(content(message));
        }
        Ok(tree.clone())
    }
}
