//! Formulas given as text.

use super::super::error::{FileError, content};
use crate::field::Field;

#[cfg(feature = "expression")]
pub(super) fn expression(texts: &[String; 3]) -> Result<Field, FileError> {
    check_texts(texts)?;
    let [x, y, z] = texts;
    Ok(Field::expression([x, y, z]))
}

/// Readers of expressions call themselves for each bracket.
#[cfg(feature = "expression")]
pub(super) fn check_texts(texts: &[String; 3]) -> Result<(), FileError> {
    const LONGEST: usize = 4096;
    const DEEPEST: usize = 64;
    for (place, text) in texts.iter().enumerate() {
        let mut depth = 0_usize;
        let mut deepest = 0;
        for c in text.chars() {
            match c {
                '(' => depth += 1,
                ')' => depth = depth.saturating_sub(1),
                _ => {}
            }
            deepest = deepest.max(depth);
        }
        if text.len() > LONGEST || deepest > DEEPEST {
            let message = format!(
                "expected at most {LONGEST} characters and {DEEPEST} levels of brackets, found {} \
                 and {deepest}",
                text.len()
            );
            return Err(content(message).within(&format!("expression[{place}]")));
        }
    }
    Ok(())
}

#[cfg(not(feature = "expression"))]
pub(super) fn expression(_: &[String; 3]) -> Result<Field, FileError> {
    let message = "expressions need the feature `expression` of this crate";
    Err(content(message).within("expression"))
}
