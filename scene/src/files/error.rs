//! What can be wrong with a file.

use serde::de::DeserializeOwned;

use super::fields::{BuildError, PropertyError};
use crate::text;

/// Why a file was not read, or something not written to one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The text is not what the schema says.
    #[error("line {line}, column {column}, at `{path}`: {message}")]
    Text {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// Where in the document, such as `tree.sum-union[1].field.formula`; `.` is the whole.
        path: String,
        /// What was found, and what was expected.
        message: String,
    },
    /// The text is well-formed, but what it says is not possible: a body that is not there, a
    /// shape without volume.
    #[error("at `{path}`: {message}")]
    Content {
        /// Where in the document.
        path: String,
        /// What was found, and what was expected.
        message: String,
    },
    /// Something is code, which a file cannot hold.
    #[error("{what}: a {kind} is code and cannot be written to a file")]
    Code {
        /// The field, or where the code stands.
        what: String,
        /// What it is: a closure, a predicate.
        kind: &'static str,
    },
    /// Braces would be nested more deeply than readers of JSON take.
    #[error("nested {depth} levels deep; a file holds at most {limit}")]
    TooDeep {
        /// Levels of the tree, region or scalar, or of braces.
        depth: usize,
        /// The most that are written.
        limit: usize,
    },
    /// The tree or a setting was refused.
    #[error(transparent)]
    Tree(#[from] BuildError),
    /// A property of a sample was refused.
    #[error(transparent)]
    Property(#[from] PropertyError),
}

/// The error for what is well-formed but not possible.
pub(super) fn content(message: impl Into<String>) -> FileError {
    FileError::Content {
        path: String::new(),
        message: message.into(),
    }
}

impl FileError {
    /// Says in what it stands, from the inside out.
    pub(super) fn within(mut self, outer: &str) -> Self {
        let place = match &mut self {
            FileError::Content { path, .. } => path,
            FileError::Code { what, .. } if !what.starts_with("field") => what,
            _ => return self,
        };
        *place = match place.chars().next() {
            None => outer.to_owned(),
            Some('[') => format!("{outer}{place}"),
            Some(_) => format!("{outer}.{place}"),
        };
        self
    }

    /// Says where in the text it stands.
    pub(super) fn located(self, text: &str) -> Self {
        let (path, message) = match self {
            FileError::Content { path, message } => (path, message),
            other => return other,
        };
        let (line, column) = text::locate(text, &path);
        FileError::Text {
            line,
            column,
            path,
            message,
        }
    }

    /// Names the field that holds code.
    pub(super) fn of_field(self, field: &str) -> Self {
        match self {
            FileError::Code { kind, .. } => FileError::Code {
                what: field.to_owned(),
                kind,
            },
            other => other,
        }
    }

    /// From an error of a writer, which knows no place.
    pub(super) fn writing(error: serde_json::Error) -> Self {
        content(error.to_string()).within(".")
    }
}

/// Reads a document.
pub(super) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, FileError> {
    let text = text::without_comments(text);
    let mut reader = serde_json::Deserializer::from_str(&text);
    let document = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        // Of a key that was not read to its end nothing is known.
        let known = path.trim_end_matches('?').trim_end_matches('.');
        let path = if known.is_empty() { "." } else { known };
        at_line(error.inner(), path.to_owned())
    })?;
    reader
        .end()
        .map_err(|error| at_line(&error, ".".to_owned()))?;
    Ok(document)
}

fn at_line(error: &serde_json::Error, path: String) -> FileError {
    let (line, column) = (error.line(), error.column());
    let text = error.to_string();
    let place = format!(" at line {line} column {column}");
    FileError::Text {
        line,
        column,
        path,
        message: plain(text.strip_suffix(&place).unwrap_or(&text)),
    }
}

/// What serde says, without the names of types of Rust: in the words of JSON.
fn plain(message: &str) -> String {
    let Some((found, expected)) = message.split_once(", expected ") else {
        return message.to_owned();
    };
    let found = match found.rsplit_once(": ") {
        Some((what, "map")) => format!("{what}: object"),
        Some((what, "sequence")) => format!("{what}: list"),
        _ => found.replace("floating point `", "number `"),
    };
    let first = expected.split([' ', '<']).next().unwrap_or_default();
    let whole = |least: i128, most: u128| format!("a whole number from {least} to {most}");
    let expected = match first {
        "struct" | "internally" => "an object".to_owned(),
        "f32" | "f64" => "a number".to_owned(),
        "u8" => whole(0, u8::MAX.into()),
        "u16" => whole(0, u16::MAX.into()),
        "u32" => whole(0, u32::MAX.into()),
        "u64" | "usize" => whole(0, u64::MAX.into()),
        "i8" => whole(i8::MIN.into(), i8::MAX as u128),
        "i32" => whole(i32::MIN.into(), i32::MAX as u128),
        _ => match expected {
            "a map" => "an object".to_owned(),
            "a sequence" => "a list".to_owned(),
            "a boolean" => "true or false".to_owned(),
            "a string" | "string or map" | "variant identifier" | "field identifier" => {
                "a name".to_owned()
            }
            other => other
                .replacen("an array of length", "a list of length", 1)
                .replacen("a sequence of", "a list of", 1)
                .replace(" f32 values", " numbers")
                .replace(" f64 values", " numbers"),
        },
    };
    format!("{found}, expected {expected}")
}
