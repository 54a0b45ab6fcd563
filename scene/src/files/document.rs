//! Types that can be read from JSON and written to it.

use std::io;

use serde::Serialize;

use super::collider::ProbeDoc;
use super::error::{FileError, content, parse};
use super::field::FieldDoc;
use super::fields::ColliderProperties;
use super::fields::{BuildError, Field, Region, Scalar, Tree};
use super::names::Names;
use super::region::RegionDoc;
use super::scalar::{self, ScalarDoc};
use super::scene::SceneFile;
use super::tree::TreeDoc;
use super::{MOST_BRACES, pretty};

/// A type that a file can hold.
///
/// In a tree or field outside of a [scene](SceneFile), bodies and colliders are Rapier's handles, as
/// index and generation.
///
/// ```
/// use rapier3d_fields_scene::single::Document;
/// use rapier3d_fields::prelude::*;
/// let shell = Region::ball(3.0).difference(Region::ball(2.0));
/// let text = shell.to_json()?;
/// assert_eq!(Region::from_json(&text)?, shell);
/// let error = Region::from_json(r#"{ "ball": { "radius": "two" } }"#).unwrap_err();
/// assert!(error.to_string().starts_with("line 1, column 27, at `ball.radius`: invalid type"));
/// # Ok::<(), rapier3d_fields_scene::single::FileError>(())
/// ```
pub trait Document: Sized {
    /// Reads a JSON text.
    ///
    /// # Errors
    /// The text is not JSON, does not fit the schema, or is not possible; the error says where.
    fn from_json(text: &str) -> Result<Self, FileError>;

    /// Writes a JSON text with indented lines.
    ///
    /// # Errors
    /// Something is code or not finite, or is nested too deeply to be read back.
    fn to_json(&self) -> Result<String, FileError>;
}

/// Refuses numbers that are not finite, which JSON cannot represent.
struct Finite;

impl serde_json::ser::Formatter for Finite {
    fn write_null<W: ?Sized + io::Write>(&mut self, _: &mut W) -> io::Result<()> {
        let message = "a number is not finite, and cannot stand in a file";
        Err(io::Error::other(message))
    }
}

/// Writes a document, unless it is nested too deeply to be read back.
fn text<T: Serialize>(document: &T) -> Result<String, FileError> {
    let mut bytes = Vec::new();
    let mut writer = serde_json::Serializer::with_formatter(&mut bytes, Finite);
    document
        .serialize(&mut writer)
        .map_err(FileError::writing)?;
    let compact = String::from_utf8(bytes).map_err(|error| content(error.to_string()))?;
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
                $read(&doc).map_err(|error: FileError| error.located(json))
            }

            fn to_json(&self) -> Result<String, FileError> {
                text(&$write(self)?)
            }
        }
    )*};
}

fn read_field(doc: &FieldDoc) -> Result<Field, FileError> {
    let field = doc.read(&Names::default())?;
    match Tree::from(field.clone()).check(&[]) {
        // Axes are declared where the field is used.
        Ok(()) | Err(BuildError::UnknownAxis { .. }) => Ok(field),
        Err(error) => Err(content(error.to_string())),
    }
}

fn read_tree(doc: &TreeDoc) -> Result<Tree, FileError> {
    let names = Names::default();
    let tree = doc.read(&names)?;
    match tree.check(&[]) {
        Ok(()) | Err(BuildError::UnknownAxis { .. } | BuildError::Empty) => Ok(tree),
        Err(error) => Err(doc.blame(&names, &[], error)),
    }
}

documents! {
    Region: RegionDoc, RegionDoc::read, RegionDoc::write;
    Scalar: ScalarDoc, scalar::read, scalar::write;
    Field: FieldDoc, read_field, |field: &Field| {
        let name = field.view().name;
        let label = name.map_or("field".to_owned(), |name| format!("field `{name}`"));
        FieldDoc::write(field, &label, None)
    };
    Tree: TreeDoc, read_tree, |tree| TreeDoc::write(tree, None);
    ColliderProperties: ProbeDoc, |doc: &ProbeDoc| Ok::<_, FileError>(doc.read()),
        |properties| Ok::<_, FileError>(ProbeDoc::write(properties));
}

impl Document for SceneFile {
    fn from_json(json: &str) -> Result<Self, FileError> {
        let file: SceneFile = parse(json)?;
        Ok(file.with_text(json))
    }

    fn to_json(&self) -> Result<String, FileError> {
        text(self)
    }
}
