//! The types of a file, in the precision of `super::fields`.

use super::fields;

mod body;
mod collider;
mod document;
mod error;
mod field;
mod formula;
mod mass;
mod names;
mod number;
mod parameters;
mod pretty;
mod region;
mod scalar;
mod scene;
mod settings;
mod shape;
mod tree;

pub use document::Document;
pub use error::FileError;
pub use scene::{Scene, SceneFile};

/// The most levels of a tree, region or scalar that are written.
const MOST_LEVELS: usize = 64;

/// The deepest nesting of brackets that `serde_json` reads.
const MOST_BRACES: usize = 127;

/// Limits the depth of writers, which are recursive.
fn check_depth(depth: usize) -> Result<(), FileError> {
    if depth > MOST_LEVELS {
        return Err(FileError::TooDeep {
            depth,
            limit: MOST_LEVELS,
        });
    }
    Ok(())
}
