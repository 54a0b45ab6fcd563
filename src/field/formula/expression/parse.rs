//! Parses a text into a program, by the precedence of operators.
//!
//! Operators and brackets wait on a stack until their operands are complete. There is no recursion, so texts
//! may be nested to any depth.

use super::function::{self, Function, Named};
use super::names::{self, Axes};
use super::program::{Op, StackCode};
use super::token::{Binding, ParseError, Spot, Token, Tokens, beginning};
use crate::field::expression_error::ExpressionErrorKind;

/// The longest text in characters.
const LONGEST: usize = 65_536;

const OPERAND: &str = "a number, a name or `(`";
const OPERATOR: &str = "an operator";

/// An operator or a bracket that waits for its last operand.
enum Waiting {
    Operator {
        op: Op,
        operands: usize,
        binding: Binding,
    },
    Bracket {
        open: usize,
        /// The function whose arguments are in the bracket.
        called: Option<&'static Named>,
        /// The number of complete arguments.
        complete: usize,
        /// The jump of an `if` whose target is still to be set.
        jump: usize,
    },
}

struct Parser<'n> {
    names: &'n mut Axes,
    waiting: Vec<Waiting>,
    program: StackCode,
}

/// Parses a text.
pub(super) fn parse(text: &str, names: &mut Axes) -> Result<StackCode, ParseError> {
    check_length(text)?;
    let mut parser = Parser {
        names,
        waiting: Vec::new(),
        program: StackCode::default(),
    };
    let mut tokens = Tokens::new(text);
    let mut is_empty = true;
    let mut is_operand_next = true;
    while let Some(spot) = tokens.advance()? {
        is_empty = false;
        is_operand_next = if is_operand_next {
            parser.operand(&spot)?
        } else {
            parser.operator(&spot)?
        };
    }
    if is_empty {
        return Err(ParseError::new(0, ExpressionErrorKind::Empty));
    }
    if is_operand_next {
        let kind = ExpressionErrorKind::Unexpected {
            expected: OPERAND,
            found: None,
        };
        return Err(ParseError::new(text.len(), kind));
    }
    parser.finish()
}

fn check_length(text: &str) -> Result<(), ParseError> {
    let Some((at, _)) = text.char_indices().nth(LONGEST) else {
        return Ok(());
    };
    let kind = ExpressionErrorKind::TooLong {
        length: text.chars().count(),
        limit: LONGEST,
    };
    Err(ParseError::new(at, kind))
}

impl Parser<'_> {
    /// Takes a token where an operand is expected. Returns true if one is still expected after it.
    fn operand(&mut self, spot: &Spot<'_>) -> Result<bool, ParseError> {
        match spot.token {
            Token::Number(number) => self.program.push(Op::Number(number)),
            Token::Name(name) => self.name(name, spot)?,
            Token::Braced(name) => self.axis(name),
            Token::Call(name, open) => {
                self.call(name, open, spot)?;
                return Ok(true);
            }
            Token::Open => {
                self.open(spot.at, None);
                return Ok(true);
            }
            Token::Binary(Op::Add, _) => return Ok(true),
            Token::Binary(Op::Subtract, _) => {
                self.wait(Op::Negate, 1, Binding::Sign);
                return Ok(true);
            }
            Token::Not => {
                self.check_not(spot)?;
                self.wait(Op::Call(Function::Not, 1), 1, Binding::Not);
                return Ok(true);
            }
            _ => return Err(unexpected(OPERAND, spot)),
        }
        Ok(false)
    }

    /// Takes a token where an operator is expected. Returns true if an operand is expected after it.
    fn operator(&mut self, spot: &Spot<'_>) -> Result<bool, ParseError> {
        match spot.token {
            Token::Binary(op, binding) => self.binary(op, binding, spot)?,
            Token::Comma => self.comma(spot)?,
            Token::Close => {
                self.close(spot)?;
                return Ok(false);
            }
            _ => return Err(unexpected(OPERATOR, spot)),
        }
        Ok(true)
    }

    fn name(&mut self, name: &str, spot: &Spot<'_>) -> Result<(), ParseError> {
        if let Some(named) = function::named(name) {
            let function = named.name;
            let kind = ExpressionErrorKind::NotCalled { function };
            return Err(ParseError::new(spot.at + name.len(), kind));
        }
        match names::constant(name) {
            Some(number) => self.program.push(Op::Number(number)),
            None => self.axis(name),
        }
        Ok(())
    }

    fn axis(&mut self, name: &str) {
        let number = self.names.axis(name) as u32;
        self.program.push(Op::Axis(number));
    }

    fn call(&mut self, name: &str, open: usize, spot: &Spot<'_>) -> Result<(), ParseError> {
        let Some(named) = function::named(name) else {
            let kind = ExpressionErrorKind::UnknownFunction {
                name: beginning(name),
                known: function::known(),
            };
            return Err(ParseError::new(spot.at, kind));
        };
        self.open(open, Some(named));
        Ok(())
    }

    fn open(&mut self, open: usize, called: Option<&'static Named>) {
        self.waiting.push(Waiting::Bracket {
            open,
            called,
            complete: 0,
            jump: 0,
        });
    }

    fn wait(&mut self, op: Op, operands: usize, binding: Binding) {
        self.waiting.push(Waiting::Operator {
            op,
            operands,
            binding,
        });
    }

    /// The precedence of the last operator that waits; `None` if a bracket waits after it.
    fn last_binding(&self) -> Option<Binding> {
        match self.waiting.last()? {
            Waiting::Operator { binding, .. } => Some(*binding),
            Waiting::Bracket { .. } => None,
        }
    }

    /// Refuses `not` after an operator that binds more tightly, as in `-not x` and `a < not b`: its operand is
    /// unclear.
    fn check_not(&self, spot: &Spot<'_>) -> Result<(), ParseError> {
        if self.last_binding() > Some(Binding::Not) {
            return Err(ParseError::new(spot.at, ExpressionErrorKind::LooseNot));
        }
        Ok(())
    }

    fn binary(&mut self, op: Op, binding: Binding, spot: &Spot<'_>) -> Result<(), ParseError> {
        // Powers are taken from right to left, and comparisons do not chain.
        self.complete(match binding {
            Binding::Power => Binding::Bracket,
            Binding::Comparison => Binding::Sum,
            _ => binding,
        });
        if binding == Binding::Comparison && self.last_binding() == Some(binding) {
            return Err(ParseError::new(spot.at, ExpressionErrorKind::Chained));
        }
        self.wait(op, 2, binding);
        Ok(())
    }

    /// Completes the waiting operators that bind at least as tightly as `least`.
    fn complete(&mut self, least: Binding) {
        while let Some(&Waiting::Operator {
            op,
            operands,
            binding,
        }) = self.waiting.last()
            && binding >= least
        {
            self.waiting.pop();
            self.program.apply(op, operands);
        }
    }

    fn comma(&mut self, spot: &Spot<'_>) -> Result<(), ParseError> {
        self.complete(Binding::Or);
        let Some(Waiting::Bracket {
            called: Some(named),
            complete,
            jump,
            ..
        }) = self.waiting.last_mut()
        else {
            return Err(ParseError::new(spot.at, ExpressionErrorKind::Comma));
        };
        *complete += 1;
        // One more argument follows.
        if named.most.is_some_and(|most| *complete >= most) {
            return Err(wrong_number(named, spot));
        }
        if named.function == Function::If && *complete == 1 {
            *jump = self.program.jump(Op::JumpUnless(0));
        } else if named.function == Function::If {
            let over = self.program.jump(Op::Jump(0));
            self.program.land(*jump);
            *jump = over;
        }
        Ok(())
    }

    fn close(&mut self, spot: &Spot<'_>) -> Result<(), ParseError> {
        self.complete(Binding::Or);
        let Some(Waiting::Bracket {
            called,
            complete,
            jump,
            ..
        }) = self.waiting.pop()
        else {
            return Err(ParseError::new(spot.at, ExpressionErrorKind::Unopened));
        };
        let Some(named) = called else {
            return Ok(());
        };
        let arguments = complete + 1;
        if !named.takes(arguments) {
            return Err(wrong_number(named, spot));
        }
        if named.function == Function::If {
            self.program.land(jump);
        } else {
            let op = Op::Call(named.function, arguments as u32);
            self.program.apply(op, arguments);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<StackCode, ParseError> {
        self.complete(Binding::Or);
        match self.waiting.last() {
            Some(Waiting::Bracket { open, .. }) => {
                Err(ParseError::new(*open, ExpressionErrorKind::Unclosed))
            }
            _ => Ok(self.program),
        }
    }
}

fn unexpected(expected: &'static str, spot: &Spot<'_>) -> ParseError {
    let found = Some(beginning(spot.text));
    ParseError::new(spot.at, ExpressionErrorKind::Unexpected { expected, found })
}

fn wrong_number(named: &Named, spot: &Spot<'_>) -> ParseError {
    let kind = ExpressionErrorKind::Arguments {
        function: named.name,
        fewest: named.fewest,
        most: named.most,
    };
    ParseError::new(spot.at, kind)
}
