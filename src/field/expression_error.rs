//! The errors in the text of an expression.

/// The reason why the text of an expression was refused, and the place of the fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{}`, character {position}: {kind}", excerpt(.text, *.position))]
pub struct ExpressionError {
    /// The component that the text is for: 0 for x, 1 for y, 2 for z.
    pub component: usize,
    /// The text.
    pub text: String,
    /// The character at which the fault is, counted from one. If the text ends too early, this is one more than
    /// its length.
    pub position: usize,
    /// The fault at that place.
    pub kind: ExpressionErrorKind,
}

/// A fault at a character of an expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionErrorKind {
    /// The text has nothing but spaces.
    #[error("the text is empty: the number zero is written `0`")]
    Empty,
    /// The text is too long.
    #[error("the text has {length} characters; at most {limit} are read")]
    TooLong {
        /// Characters of the text.
        length: usize,
        /// The limit.
        limit: usize,
    },
    /// A character that has no meaning in expressions.
    #[error("`{}` cannot stand in an expression", .found.escape_default())]
    UnknownCharacter {
        /// The character.
        found: char,
    },
    /// A single `=`.
    #[error("`=` is not an operator; `==` compares two numbers")]
    Assignment,
    /// A number beyond the range of `f64`.
    #[error("the number `{number}` is too large")]
    TooLarge {
        /// The number, or how it begins.
        number: String,
    },
    /// Something else should stand here.
    #[error("expected {expected}, found {}", found_text(.found))]
    Unexpected {
        /// The tokens that are allowed here.
        expected: &'static str,
        /// The token found, or how it begins; `None` at the end of the text.
        found: Option<String>,
    },
    /// A name before a bracket that is not that of a function.
    #[error("there is no function `{name}`; there are: {known}")]
    UnknownFunction {
        /// The name, or how it begins.
        name: String,
        /// The names of all functions.
        known: String,
    },
    /// A function without its brackets.
    #[error("`{function}` is a function: expected `(` after it")]
    NotCalled {
        /// The function.
        function: &'static str,
    },
    /// A function with too few or too many arguments.
    #[error("`{function}` takes {}", arguments(*.fewest, *.most))]
    Arguments {
        /// The function.
        function: &'static str,
        /// The fewest arguments it takes.
        fewest: usize,
        /// The most; `None` without a limit.
        most: Option<usize>,
    },
    /// A comma that is not between the arguments of a function.
    #[error("a comma can only stand between the arguments of a function")]
    Comma,
    /// A bracket that opens and is not closed.
    #[error("this bracket is not closed")]
    Unclosed,
    /// A bracket that closes while none is open.
    #[error("this bracket closes nothing")]
    Unopened,
    /// A comparison of the result of a comparison.
    #[error("comparisons do not chain: write `a < b and b < c`")]
    Chained,
    /// A `not` after an operator that binds more tightly.
    #[error("`not` binds more loosely than what stands before it: put it in brackets")]
    LooseNot,
}

/// The part of the text around a character, on one line.
fn excerpt(text: &str, position: usize) -> String {
    const AROUND: usize = 32;
    let first = position.saturating_sub(AROUND + 1);
    let mut rest = text.chars().skip(first);
    let mut shown = String::from(if first > 0 { "…" } else { "" });
    let visible = |c: char| if c.is_control() { ' ' } else { c };
    shown.extend(rest.by_ref().take(2 * AROUND + 1).map(visible));
    if rest.next().is_some() {
        shown.push('…');
    }
    shown
}

fn arguments(fewest: usize, most: Option<usize>) -> String {
    match most {
        Some(1) => "one argument".into(),
        Some(most) if most == fewest => format!("{most} arguments"),
        Some(most) => format!("{fewest} to {most} arguments"),
        None => format!("{fewest} arguments or more"),
    }
}

fn found_text(found: &Option<String>) -> String {
    match found {
        Some(text) => format!("`{text}`"),
        None => "the end of the text".into(),
    }
}
