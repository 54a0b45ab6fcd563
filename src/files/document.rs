//! What can be read from JSON and written to it.

use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::collider::ProbeDoc;
use super::error::{FileError, parse};
use super::field::FieldDoc;
use super::region::RegionDoc;
use super::scalar::{self, ScalarDoc};
use super::scene::SceneFile;
use super::tree::TreeDoc;
use super::{MOST_BRACES, pretty};
use crate::field::ColliderProperties;
use crate::field::{Field, Region, Scalar, Tree};

/// What can stand in a file.
///
/// Bodies and colliders of a tree or field that stands by itself, outside of a [scene](SceneFile),
/// are Rapier's handles, as index and generation.
///
/// ```
/// use rapier3d_fields::files::Document;
/// use rapier3d_fields::prelude::*;
/// let shell = Region::ball(3.0).difference(Region::ball(2.0));
/// let text = shell.to_json()?;
/// assert_eq!(Region::from_json(&text)?, shell);
/// let error = Region::from_json(r#"{ "ball": { "radius": "two" } }"#).unwrap_err();
/// assert!(error.to_string().starts_with("line 1, column 27, at `ball.radius`: invalid type"));
/// # Ok::<(), rapier3d_fields::files::FileError>(())
/// ```
pub trait Document: Sized {
    /// Reads a JSON text.
    ///
    /// # Errors
    /// It is not JSON, or not what the schema says, or impossible; the error says where.
    fn from_json(text: &str) -> Result<Self, FileError>;

    /// Writes a JSON text for people to read.
    ///
    /// # Errors
    /// Something is code or is not finite, or is nested too deeply for readers of JSON.
    fn to_json(&self) -> Result<String, FileError>;
}

/// Writes a document, unless it is nested more deeply than is read back.
fn text<T: Serialize>(document: &T) -> Result<String, FileError> {
    let compact = serde_json::to_string(document).map_err(FileError::writing)?;
    let depth = pretty::depth(&compact);
    if depth > MOST_BRACES {
        return Err(FileError::TooDeep {
            depth,
            limit: MOST_BRACES,
        });
    }
    Ok(pretty::print(&compact))
}

macro_rules! documents {
    ($($kind:ty: $doc:ty, $read:expr, $write:expr;)*) => {$(
        impl Document for $kind {
            fn from_json(json: &str) -> Result<Self, FileError> {
                let doc: $doc = parse(json)?;
                $read(&doc)
            }

            fn to_json(&self) -> Result<String, FileError> {
                text(&$write(self)?)
            }
        }

        /// As [`files`](crate::files) describes.
        impl Serialize for $kind {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let doc: Result<$doc, FileError> = $write(self);
                doc.map_err(S::Error::custom)?.serialize(serializer)
            }
        }

        /// As [`files`](crate::files) describes.
        impl<'de> Deserialize<'de> for $kind {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let doc = <$doc>::deserialize(deserializer)?;
                $read(&doc).map_err(D::Error::custom)
            }
        }
    )*};
}

documents! {
    Region: RegionDoc, RegionDoc::read, RegionDoc::write;
    Scalar: ScalarDoc, scalar::read, scalar::write;
    Field: FieldDoc, |doc: &FieldDoc| doc.read(None), |field: &Field| {
        let name = field.name.as_deref();
        let label = name.map_or("field".to_owned(), |name| format!("field `{name}`"));
        FieldDoc::write(field, &label, None)
    };
    Tree: TreeDoc, |doc: &TreeDoc| doc.read(None), |tree| TreeDoc::write(tree, None);
    ColliderProperties: ProbeDoc, |doc: &ProbeDoc| Ok::<_, FileError>(doc.read()),
        |properties| Ok::<_, FileError>(ProbeDoc::write(properties));
}

impl Document for SceneFile {
    fn from_json(json: &str) -> Result<Self, FileError> {
        parse(json)
    }

    fn to_json(&self) -> Result<String, FileError> {
        text(self)
    }
}
