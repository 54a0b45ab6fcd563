//! Parses a text into a program, by the precedence of operators.
//!
//! Operators and brackets wait on a stack until their operands are complete. There is no recursion, so texts
//! may be nested to any depth.

use super::function::{self, Function, Named};
use super::names::{self, Axes};
use super::program::{Op, StackCode};
use super::token::{ParseError, Spot, Symbol, Token, Tokens, beginning};
use crate::field::expression_error::ExpressionErrorKind;

/// The longest text in characters.
const LONGEST: usize = 65_536;

const OPERAND: &str = "a number, a name or `(`";
const OPERATOR: &str = "an operator";

/// Precedence of operators, from loose to tight.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Binding {
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

/// An operator, a bracket or a call that waits for its last operand.
enum Waiting {
    Operator {
        op: Op,
        operands: usize,
        binding: Binding,
    },
    Bracket {
        open: usize,
    },
    Call {
        named: &'static Named,
        open: usize,
        /// The number of complete arguments.
        complete: usize,
    },
    If {
        open: usize,
        complete: usize,
        /// The jump whose target is still to be set.
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
                self.waiting.push(Waiting::Bracket { open: spot.at });
                return Ok(true);
            }
            Token::Symbol(Symbol::Plus) => return Ok(true),
            Token::Symbol(Symbol::Minus) => {
                self.wait(Op::Negate, 1, Binding::Sign);
                return Ok(true);
            }
            Token::Symbol(Symbol::Not) => {
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
            Token::Symbol(symbol) => self.binary(symbol, spot)?,
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
        let function = match name {
            "if" => Some("if"),
            _ => function::named(name).map(|named| named.name),
        };
        if let Some(function) = function {
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
        let complete = 0;
        self.waiting.push(match (name, function::named(name)) {
            ("if", _) => Waiting::If {
                open,
                complete,
                jump: 0,
            },
            (_, Some(named)) => Waiting::Call {
                named,
                open,
                complete,
            },
            (_, None) => {
                let kind = ExpressionErrorKind::UnknownFunction {
                    name: beginning(name),
                    known: function::known(),
                };
                return Err(ParseError::new(spot.at, kind));
            }
        });
        Ok(())
    }

    fn wait(&mut self, op: Op, operands: usize, binding: Binding) {
        self.waiting.push(Waiting::Operator {
            op,
            operands,
            binding,
        });
    }

    /// Refuses `not` after an operator that binds more tightly, as in `-not x` and `a < not b`: its operand is
    /// unclear.
    fn check_not(&self, spot: &Spot<'_>) -> Result<(), ParseError> {
        match self.waiting.last() {
            Some(Waiting::Operator { binding, .. }) if *binding > Binding::Not => {
                Err(ParseError::new(spot.at, ExpressionErrorKind::LooseNot))
            }
            _ => Ok(()),
        }
    }

    fn binary(&mut self, symbol: Symbol, spot: &Spot<'_>) -> Result<(), ParseError> {
        let Some((op, binding)) = binary(symbol) else {
            return Err(unexpected(OPERATOR, spot));
        };
        match binding {
            // Powers are taken from right to left.
            Binding::Power => self.complete(Binding::Bracket),
            Binding::Comparison => {
                self.complete(Binding::Sum);
                self.check_chain(spot)?;
            }
            _ => self.complete(binding),
        }
        self.wait(op, 2, binding);
        Ok(())
    }

    fn check_chain(&self, spot: &Spot<'_>) -> Result<(), ParseError> {
        match self.waiting.last() {
            Some(Waiting::Operator {
                binding: Binding::Comparison,
                ..
            }) => Err(ParseError::new(spot.at, ExpressionErrorKind::Chained)),
            _ => Ok(()),
        }
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
        match self.waiting.last_mut() {
            Some(Waiting::Call {
                named, complete, ..
            }) => {
                *complete += 1;
                // One more argument follows.
                if named.most.is_some_and(|most| *complete >= most) {
                    return Err(wrong_number(named, spot));
                }
            }
            Some(Waiting::If { complete, jump, .. }) => {
                match *complete {
                    0 => *jump = self.program.jump_unless(),
                    1 => {
                        let over = self.program.jump();
                        self.program.land(*jump);
                        *jump = over;
                    }
                    _ => return Err(wrong_if(spot)),
                }
                *complete += 1;
            }
            _ => return Err(ParseError::new(spot.at, ExpressionErrorKind::Comma)),
        }
        Ok(())
    }

    fn close(&mut self, spot: &Spot<'_>) -> Result<(), ParseError> {
        self.complete(Binding::Or);
        match self.waiting.pop() {
            Some(Waiting::Call {
                named, complete, ..
            }) => {
                let arguments = complete + 1;
                if !named.takes(arguments) {
                    return Err(wrong_number(named, spot));
                }
                let op = Op::Call(named.function, arguments as u32);
                self.program.apply(op, arguments);
            }
            Some(Waiting::If { complete, jump, .. }) => {
                if complete != 2 {
                    return Err(wrong_if(spot));
                }
                self.program.land(jump);
            }
            Some(_) => {}
            None => return Err(ParseError::new(spot.at, ExpressionErrorKind::Unopened)),
        }
        Ok(())
    }

    fn finish(mut self) -> Result<StackCode, ParseError> {
        self.complete(Binding::Or);
        match self.waiting.last() {
            Some(
                Waiting::Bracket { open } | Waiting::Call { open, .. } | Waiting::If { open, .. },
            ) => Err(ParseError::new(*open, ExpressionErrorKind::Unclosed)),
            _ => Ok(self.program),
        }
    }
}

/// The operation of an operator between two operands, and its precedence.
fn binary(symbol: Symbol) -> Option<(Op, Binding)> {
    let function = |function| Op::Call(function, 2);
    Some(match symbol {
        Symbol::Or => (function(Function::Or), Binding::Or),
        Symbol::And => (function(Function::And), Binding::And),
        Symbol::Less => (function(Function::Less), Binding::Comparison),
        Symbol::LessOrEqual => (function(Function::LessOrEqual), Binding::Comparison),
        Symbol::Greater => (function(Function::Greater), Binding::Comparison),
        Symbol::GreaterOrEqual => (function(Function::GreaterOrEqual), Binding::Comparison),
        Symbol::Equal => (function(Function::Equal), Binding::Comparison),
        Symbol::Unequal => (function(Function::Unequal), Binding::Comparison),
        Symbol::Plus => (Op::Add, Binding::Sum),
        Symbol::Minus => (Op::Subtract, Binding::Sum),
        Symbol::Times => (Op::Multiply, Binding::Product),
        Symbol::Divide => (Op::Divide, Binding::Product),
        Symbol::Power => (function(Function::Power), Binding::Power),
        Symbol::Not => return None,
    })
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

fn wrong_if(spot: &Spot<'_>) -> ParseError {
    let kind = ExpressionErrorKind::Arguments {
        function: "if",
        fewest: 3,
        most: Some(3),
    };
    ParseError::new(spot.at, kind)
}
