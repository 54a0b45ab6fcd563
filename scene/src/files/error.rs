//! Errors of reading and writing files.

use serde::de::DeserializeOwned;

use super::fields::{BuildError, PropertyError};
use crate::text;

/// The reason for which a file was not read, or a value not written to one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The text does not fit the schema, or what it describes is not possible.
    #[error("line {line}, column {column}, at `{path}`: {message}")]
    Text {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// The path in the document, such as `tree.sum-union[1].field.formula`; `.` is the whole.
        path: String,
        /// The value found, and the one expected.
        message: String,
    },
    /// A value that was not read from a text is not possible, or cannot be written: a body that is not
    /// there, a shape without volume.
    #[error("at `{path}`: {message}")]
    Content {
        /// The path in the document.
        path: String,
        /// The value found, and the one expected.
        message: String,
    },
    /// Something is code, which a file cannot hold.
    #[error("{what}: a {kind} is code and cannot be written to a file")]
    Code {
        /// The field, or the path of the code.
        what: String,
        /// The kind of code: a closure or a predicate.
        kind: &'static str,
    },
    /// The nesting is too deep to be read back.
    #[error("nested {depth} levels deep; a file holds at most {limit}")]
    TooDeep {
        /// Levels of the tree, region or scalar, or of brackets.
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

/// The error for content that is well-formed but not possible.
pub(super) fn content(message: impl Into<String>) -> FileError {
    FileError::Content {
        path: String::new(),
        message: message.into(),
    }
}

impl FileError {
    /// Puts an outer name before the path, which is built from the inside out.
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

    /// Adds the line and column of the path in the text.
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

    /// From an error of a writer, which has no path.
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
        // `?` stands for a key that was not read to its end.
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

/// Serde's message in terms of JSON, without the names of Rust's types.
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
