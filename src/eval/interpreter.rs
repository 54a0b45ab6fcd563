//! Programs: composite terms, evaluated at one sample at a time.

use crate::compile::{Program, Step};
use crate::field::{
    Frame, LocalQuery, Motion, Neighbourhood, Normal, Number, Operator, Override, Pieces, Query,
    Vec3, constant,
};
use crate::math::DVec3;

/// A composite at a sample.
#[derive(Clone, Copy, Debug)]
struct Value<T> {
    defined: Pieces,
    vector: Vec3<T>,
    /// Whether the vector would hold that of the leaf that is watched, were it not zero.
    watched: bool,
}

impl<T: Number> Value<T> {
    fn undefined() -> Self {
        Value {
            defined: Pieces::NONE,
            vector: constant(DVec3::ZERO),
            watched: false,
        }
    }
}

/// What a program gives at a sample where it is defined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome<T = f64> {
    /// The force, world axes.
    pub force: Vec3<T>,
    /// Whether the leaf that is watched contributes to it.
    watched: bool,
}

/// Evaluates programs; keeps its stack between calls. With numbers that carry derivatives it
/// gives the derivatives of the force, too.
#[derive(Debug)]
pub(crate) struct Interpreter<T = f64> {
    stack: Vec<Value<T>>,
    normals: Vec<Normal>,
}

impl<T> Default for Interpreter<T> {
    fn default() -> Self {
        Interpreter {
            stack: Vec::new(),
            normals: Vec::new(),
        }
    }
}

/// One sample before one instance of a program.
#[derive(Clone, Copy)]
struct SampleContext<'a, T> {
    pub program: &'a Program,
    pub instance: usize,
    pub frames: &'a [Option<Frame>],
    pub query: &'a Query,
    pub motion: &'a Motion<T>,
    /// A leaf of which is asked whether it contributes.
    pub watched: Option<u32>,
}

impl<T: Number> Interpreter<T> {
    /// The program's instance at a sample; `None` where it is not defined.
    pub(crate) fn run(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        motion: &Motion<T>,
    ) -> Option<Outcome<T>> {
        self.run_at(&SampleContext {
            program,
            instance,
            frames,
            query,
            motion,
            watched: None,
        })
    }

    /// Whether a leaf contributes to a program's instance at a sample, be it by zero.
    pub(crate) fn contributes(
        &mut self,
        (program, leaf): (&Program, u32),
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        motion: &Motion<T>,
    ) -> bool {
        let outcome = self.run_at(&SampleContext {
            program,
            instance,
            frames,
            query,
            motion,
            watched: Some(leaf),
        });
        outcome.is_some_and(|outcome| outcome.watched)
    }

    fn run_at(&mut self, place: &SampleContext<'_, T>) -> Option<Outcome<T>> {
        let open = Neighbourhood::open();
        let outcome = self.walk(place, &open);
        if !open.met_a_surface() {
            return outcome;
        }
        // The sample lies on a surface: find the pieces around it, and walk again.
        self.normals.clear();
        for (leaf, field) in place.program.leaves.iter().enumerate() {
            if let Some(local) = place.acting(leaf) {
                field.region.touched(&local, &mut self.normals);
            }
        }
        let here = Neighbourhood::of(&self.normals);
        self.walk(place, &here)
    }

    fn walk(&mut self, place: &SampleContext<'_, T>, here: &Neighbourhood) -> Option<Outcome<T>> {
        let program = place.program;
        self.stack.clear();
        for step in &program.steps {
            match *step {
                Step::Nowhere => self.stack.push(Value::undefined()),
                Step::Leaf(leaf) => self.stack.push(place.leaf_value(leaf, here)),
                Step::Apply(operator, count) => {
                    self.combine(count, |operands| {
                        let combined = operands.iter().copied();
                        combined.reduce(|u, v| apply(operator, u, v, here))
                    });
                }
                Step::Layers(count, modes) => {
                    let modes = &program.modes[modes as usize];
                    self.combine(count, |operands| Some(layers(operands, modes, here)));
                }
                Step::Modify(number) => {
                    if let Some(value) = self.stack.last_mut().filter(|v| v.defined.any()) {
                        place.modify(number, value);
                    }
                }
            }
        }
        let value = self.stack.pop()?;
        value.defined.any().then_some(Outcome {
            force: value.vector,
            watched: value.watched,
        })
    }

    /// Puts one value in place of the last `count`.
    fn combine(&mut self, count: u32, rule: impl FnOnce(&[Value<T>]) -> Option<Value<T>>) {
        let start = self.stack.len() - count as usize;
        let combined = rule(&self.stack[start..]).unwrap_or_else(Value::undefined);
        self.stack.truncate(start);
        self.stack.push(combined);
    }
}

impl<'a, T: Number> SampleContext<'a, T> {
    fn frame(&self, anchored: usize) -> Option<&'a Frame> {
        self.program.frame(self.instance, anchored, self.frames)
    }

    /// The sample as a leaf sees it, if the leaf is there and acts on the sample.
    fn acting(&self, leaf: usize) -> Option<LocalQuery<'a, T>> {
        let frame = self.frame(leaf)?;
        let acts = self.program.leaves[leaf].acts_on(self.query, frame);
        acts.then(|| LocalQuery::moving(self.query, self.motion, frame))
    }

    fn leaf_value(&self, leaf: u32, here: &Neighbourhood) -> Value<T> {
        let Some(local) = self.acting(leaf as usize) else {
            return Value::undefined();
        };
        let field = &self.program.leaves[leaf as usize];
        let defined = field.region.pieces(&local, here);
        if !defined.any() {
            return Value::undefined();
        }
        Value {
            defined,
            vector: field.force_of(self.program.strength(self.instance, leaf as usize), &local),
            watched: self.watched == Some(leaf),
        }
    }

    fn modify(&self, number: u32, value: &mut Value<T>) {
        let frame = self.frame(self.program.leaves.len() + number as usize);
        let local = frame.map(|frame| LocalQuery::moving(self.query, self.motion, frame));
        let modifier = &self.program.modifiers[number as usize];
        value.vector = modifier.apply(value.vector, local.as_ref());
    }
}

/// An operator on the values of its operands; see the table at [`Operator`].
fn apply<T: Number>(
    operator: Operator,
    u: Value<T>,
    v: Value<T>,
    here: &Neighbourhood,
) -> Value<T> {
    let (e, g) = (u.defined, v.defined);
    let defined = operator.set(e, g, here);
    if !defined.any() {
        return Value::undefined();
    }
    if !g.any() {
        return Value { defined, ..u };
    }
    if !e.any() {
        return Value { defined, ..v };
    }
    let watched = match operator {
        Operator::Difference => u.watched,
        Operator::ReplaceUnion | Operator::ReplaceIntersection => v.watched,
        _ => u.watched || v.watched,
    };
    Value {
        defined,
        vector: operator.vector(u.vector, v.vector),
        watched,
    }
}

/// The rule at [`Tree::layers`](crate::Tree::layers), for operands of falling priority.
fn layers<T: Number>(operands: &[Value<T>], modes: &[Override], here: &Neighbourhood) -> Value<T> {
    let mut gathered = Value::undefined();
    let mut stopped = false;
    for (value, mode) in operands.iter().zip(modes) {
        gathered.defined = here.union(gathered.defined, value.defined);
        if stopped || !value.defined.any() {
            continue;
        }
        if mode.replaces {
            gathered.vector = constant(DVec3::ZERO);
            gathered.watched = false;
        }
        gathered.vector += value.vector;
        gathered.watched |= value.watched;
        stopped = mode.stops;
    }
    gathered
}
