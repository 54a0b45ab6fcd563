//! Expressions as instructions for a stack machine.

use super::exact;
use super::function::{Function, holds};
use crate::number::Number;

/// An instruction. It takes its operands off the stack and puts its result there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Op {
    Number(f64),
    /// An axis, by its number.
    Axis(u32),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    /// A power with this whole exponent.
    Whole(i32),
    /// A function of this number of arguments.
    Call(Function, u32),
    /// Continues at this instruction.
    Jump(u32),
    /// Takes a condition, and continues at this instruction unless it holds.
    JumpUnless(u32),
}

/// Instructions that leave one number on the stack.
#[derive(Clone, Debug, Default)]
pub(super) struct StackCode {
    ops: Vec<Op>,
    /// The latest target of a jump. Operations are not merged across it, since it can be reached in two ways.
    met: usize,
    /// The number of values on the stack after the last instruction.
    depth: usize,
    /// The largest number of values on the stack at any time.
    deepest: usize,
}

impl StackCode {
    /// Adds an instruction that puts a number on the stack.
    pub(super) fn push(&mut self, op: Op) {
        self.ops.push(op);
        self.depth += 1;
        self.deepest = self.deepest.max(self.depth);
    }

    /// Adds an operation on the last `operands` numbers. If all of them are constants, it is computed at once.
    pub(super) fn apply(&mut self, op: Op, operands: usize) {
        self.depth = self.depth + 1 - operands;
        let op = self.with_whole_exponent(op);
        let operands = if matches!(op, Op::Whole(_)) {
            1
        } else {
            operands
        };
        let first = self.ops.len() - operands;
        let is_number = |op: &Op| matches!(op, Op::Number(_));
        let is_constant = first >= self.met && self.ops[first..].iter().all(is_number);
        self.ops.push(op);
        if is_constant {
            let mut stack = vec![0.0; operands];
            let value = run(&self.ops[first..], &mut stack, |_| f64::NAN);
            self.ops.truncate(first);
            self.ops.push(Op::Number(value));
        }
    }

    /// A power with a constant whole exponent needs no logarithm.
    fn with_whole_exponent(&mut self, op: Op) -> Op {
        let last = self.ops[self.met..].last();
        if let (Op::Call(Function::Power, _), Some(&Op::Number(exponent))) = (op, last)
            && let Some(whole) = exact::whole(exponent)
        {
            self.ops.pop();
            return Op::Whole(whole);
        }
        op
    }

    /// Adds a jump, whose target is set later.
    pub(super) fn jump(&mut self, jump: Op) -> usize {
        self.ops.push(jump);
        self.depth -= 1;
        self.ops.len() - 1
    }

    /// Sets the target of a jump to the next instruction.
    pub(super) fn land(&mut self, jump: usize) {
        self.met = self.ops.len();
        if let Op::Jump(target) | Op::JumpUnless(target) = &mut self.ops[jump] {
            *target = self.met as u32;
        }
    }

    /// The result, with a value for each axis.
    pub(super) fn value<T: Number<Plain = f64>>(&self, axis: impl Fn(usize) -> T) -> T {
        /// Stacks up to this depth need no allocation; deeper ones are rare.
        const SHALLOW: usize = 12;
        let zero = T::from(0.0);
        if self.deepest <= SHALLOW {
            return run(&self.ops, &mut [zero; SHALLOW], axis);
        }
        run(&self.ops, &mut vec![zero; self.deepest], axis)
    }
}

/// Runs instructions, and returns the number that they leave at the bottom of the stack.
fn run<T: Number<Plain = f64>>(ops: &[Op], stack: &mut [T], axis: impl Fn(usize) -> T) -> T {
    let mut depth = 0;
    let mut at = 0;
    while let Some(op) = ops.get(at) {
        at += 1;
        match *op {
            Op::Number(number) => {
                stack[depth] = number.into();
                depth += 1;
            }
            Op::Axis(number) => {
                stack[depth] = axis(number as usize);
                depth += 1;
            }
            Op::Negate => stack[depth - 1] = -stack[depth - 1],
            Op::Add => combine(stack, &mut depth, |a, b| a + b),
            Op::Subtract => combine(stack, &mut depth, |a, b| a - b),
            Op::Multiply => combine(stack, &mut depth, |a, b| a * b),
            Op::Divide => combine(stack, &mut depth, |a, b| a / b),
            Op::Whole(exponent) => stack[depth - 1] = exact::product(stack[depth - 1], exponent),
            Op::Call(function, arguments) => {
                let first = depth - arguments as usize;
                stack[first] = function.of(&stack[first..depth]);
                depth = first + 1;
            }
            Op::Jump(target) => at = target as usize,
            Op::JumpUnless(target) => {
                depth -= 1;
                if !holds(&stack[depth]) {
                    at = target as usize;
                }
            }
        }
    }
    stack[0]
}

/// Replaces the two numbers on top by one.
#[inline(always)]
fn combine<T: Copy>(stack: &mut [T], depth: &mut usize, operation: impl FnOnce(T, T) -> T) {
    *depth -= 1;
    stack[*depth - 1] = operation(stack[*depth - 1], stack[*depth]);
}

#[cfg(test)]
mod tests {
    use super::super::names::Axes;
    use super::super::parse::parse;
    use super::*;

    #[test]
    fn constants_are_folded_but_not_across_the_end_of_an_if() {
        let ops = |text: &str| {
            let program = parse(text, &mut Axes::default());
            program.expect("a good text").ops
        };
        let constant = ops("-(2*3)^2/max(1, 2, 3) + sqrt(4)");
        assert_eq!(constant, [Op::Number(-10.0)]);
        assert_eq!(ops("x^-2"), [Op::Axis(0), Op::Whole(-2)]);
        assert_eq!(ops("x^if(x, 2, 2)").len(), 7);
        assert_eq!(ops("-if(x, 2, 2)").len(), 6);
    }
}
