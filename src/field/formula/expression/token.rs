//! Splits a text into tokens.

use super::function::Function;
use super::program::Op;
use crate::field::expression_error::ExpressionErrorKind;

/// A fault at a byte of a text.
#[derive(Debug)]
pub(super) struct ParseError {
    pub at: usize,
    pub kind: ExpressionErrorKind,
}

impl ParseError {
    pub(super) fn new(at: usize, kind: ExpressionErrorKind) -> Self {
        ParseError { at, kind }
    }
}

/// A token of the language.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    /// A name: an axis or a constant.
    Name(&'a str),
    /// A name in braces: an axis, even if the name has another meaning without them.
    Braced(&'a str),
    /// A name and the bracket after it, with the byte at which the bracket is.
    Call(&'a str, usize),
    /// An operator between two operands. `+` and `-` may stand before one operand, too.
    Binary(Op, Binding),
    Not,
    Open,
    Close,
    Comma,
}

/// Precedence of operators, from loose to tight.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) enum Binding {
    Or,
    And,
    Not,
    Comparison,
    Sum,
    Product,
    Sign,
    Power,
    /// Tighter than any operator.
    Bracket,
}

const OR: Token = binary(Function::Or, Binding::Or);
const AND: Token = binary(Function::And, Binding::And);

/// Longer marks come first, so that `<=` is not read as `<`.
const MARKS: [(&str, Token); 17] = [
    ("<=", binary(Function::LessOrEqual, Binding::Comparison)),
    (">=", binary(Function::GreaterOrEqual, Binding::Comparison)),
    ("==", binary(Function::Equal, Binding::Comparison)),
    ("!=", binary(Function::Unequal, Binding::Comparison)),
    ("&&", AND),
    ("||", OR),
    ("+", Token::Binary(Op::Add, Binding::Sum)),
    ("-", Token::Binary(Op::Subtract, Binding::Sum)),
    ("*", Token::Binary(Op::Multiply, Binding::Product)),
    ("/", Token::Binary(Op::Divide, Binding::Product)),
    ("^", binary(Function::Power, Binding::Power)),
    ("<", binary(Function::Less, Binding::Comparison)),
    (">", binary(Function::Greater, Binding::Comparison)),
    ("!", Token::Not),
    ("(", Token::Open),
    (")", Token::Close),
    (",", Token::Comma),
];

const fn binary(function: Function, binding: Binding) -> Token<'static> {
    Token::Binary(Op::Call(function, 2), binding)
}

/// A token with its place.
pub(super) struct Spot<'a> {
    pub token: Token<'a>,
    /// The byte at which it begins.
    pub at: usize,
    /// Its text.
    pub text: &'a str,
}

/// Reads tokens from left to right.
pub(super) struct Tokens<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Tokens { text, at: 0 }
    }

    /// The next token, `None` at the end of the text.
    pub(super) fn advance(&mut self) -> Result<Option<Spot<'a>>, ParseError> {
        self.skip_spaces();
        let at = self.at;
        let rest = self.rest();
        let Some(first) = rest.chars().next() else {
            return Ok(None);
        };
        let token = match first {
            '0'..='9' => self.number()?,
            '.' if rest[1..].starts_with(|c: char| c.is_ascii_digit()) => self.number()?,
            '{' => self.braced()?,
            _ if begins_name(first) => return Ok(Some(self.name())),
            _ => self.mark(first)?,
        };
        let text = &self.text[at..self.at];
        Ok(Some(Spot { token, at, text }))
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Takes this number of bytes.
    fn take(&mut self, length: usize) -> &'a str {
        let taken = &self.rest()[..length];
        self.at += length;
        taken
    }

    fn skip_spaces(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
    }

    fn number(&mut self) -> Result<Token<'a>, ParseError> {
        let at = self.at;
        let text = self.take(number_length(self.rest()));
        match text.parse() {
            Ok(number) if f64::is_finite(number) => Ok(Token::Number(number)),
            _ => {
                let number = beginning(text);
                let kind = ExpressionErrorKind::TooLarge { number };
                Err(ParseError::new(at, kind))
            }
        }
    }

    fn braced(&mut self) -> Result<Token<'a>, ParseError> {
        let Some(length) = self.rest().find('}') else {
            return Err(ParseError::new(self.at, ExpressionErrorKind::Unclosed));
        };
        Ok(Token::Braced(&self.take(length + 1)[1..length]))
    }

    /// A name, which may be an operator, or the beginning of a call.
    fn name(&mut self) -> Spot<'a> {
        let at = self.at;
        let goes_on = |c: char| begins_name(c) || c.is_ascii_digit();
        let rest = self.rest();
        let text = self.take(rest.find(|c| !goes_on(c)).unwrap_or(rest.len()));
        let token = match text {
            "and" => AND,
            "or" => OR,
            "not" => Token::Not,
            _ => self.call(text).unwrap_or(Token::Name(text)),
        };
        Spot { token, at, text }
    }

    /// Takes the bracket after a name, if there is one.
    fn call(&mut self, name: &'a str) -> Option<Token<'a>> {
        let after_name = self.at;
        self.skip_spaces();
        let open = self.at;
        if self.rest().starts_with('(') {
            self.at += 1;
            return Some(Token::Call(name, open));
        }
        self.at = after_name;
        None
    }

    fn mark(&mut self, first: char) -> Result<Token<'a>, ParseError> {
        let rest = self.rest();
        let mut marks = MARKS.iter();
        if let Some((mark, token)) = marks.find(|(mark, _)| rest.starts_with(mark)) {
            self.at += mark.len();
            return Ok(*token);
        }
        let kind = match first {
            '=' => ExpressionErrorKind::Assignment,
            found => ExpressionErrorKind::UnknownCharacter { found },
        };
        Err(ParseError::new(self.at, kind))
    }
}

fn begins_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// The bytes of the number that a text begins with: digits, a point, an exponent.
fn number_length(text: &str) -> usize {
    let after_digits = |from: usize| {
        let digits = text[from..].bytes().take_while(u8::is_ascii_digit);
        from + digits.count()
    };
    let mut end = after_digits(0);
    if text[end..].starts_with('.') {
        end = after_digits(end + 1);
    }
    if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
        let signs = usize::from(exponent.starts_with(['+', '-']));
        let first = end + 1 + signs;
        let last = after_digits(first);
        // Without digits this is a name after a number, which the parser refuses.
        if last > first {
            end = last;
        }
    }
    end
}

/// The first characters of a word, for messages.
pub(super) fn beginning(word: &str) -> String {
    const SHOWN: usize = 32;
    match word.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}
