//! Runs programs (composite terms) at one sample, with or without derivatives, or at several samples at once.

use crate::compile::{Instruction, Program};
use crate::field::{
    Frame, LocalQuery, Motion, Neighbourhood, Normal, Open, Operator, Override, Query, QueryNumber,
    Sets, Single, Stack,
};
use crate::math::DVec3;
use crate::number::{Mask, Number, Vec3, real};

/// The value of a composite at a sample.
#[derive(Clone, Copy)]
pub(super) struct Value<T: Number, S> {
    pub defined: S,
    pub vector: Vec3<T>,
    /// True if the watched leaf contributes to the vector, even by zero.
    watched: T::Mask,
}

impl<T: Number, S> Value<T, S> {
    #[inline(always)]
    fn undefined(nowhere: S) -> Self {
        Value {
            defined: nowhere,
            vector: Vec3::zero(),
            watched: false.into(),
        }
    }
}

/// The result of a program at a sample where it is defined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome<T = f64> {
    /// The force, in world axes.
    pub force: Vec3<T>,
    /// True if the watched leaf contributes to the force.
    watched: bool,
}

/// Runs programs at one sample at a time; keeps its buffer between calls.
#[derive(Debug, Default)]
pub(crate) struct Interpreter {
    normals: Vec<Normal>,
}

/// An instance of a program, and the sample or samples at which it is run.
pub(super) struct SampleContext<'a, T: QueryNumber> {
    pub program: &'a Program,
    pub instance: usize,
    pub frames: &'a [Option<Frame>],
    pub query: &'a T::Query,
    pub motion: &'a Motion<T>,
    /// The leaf whose contribution is reported.
    pub watched: Option<u32>,
}

impl Interpreter {
    /// Runs an instance of a program at a sample; `None` where it is not defined. Numbers that carry derivatives
    /// give the derivatives of the force, too.
    pub(crate) fn run<T: Single>(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        motion: &Motion<T>,
    ) -> Option<Outcome<T>> {
        self.run_at(&SampleContext::new(
            program, instance, frames, query, motion,
        ))
    }

    /// The force of an instance of a program on a sample; `None` where it is not defined.
    pub(super) fn force(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
    ) -> Option<DVec3> {
        let outcome = self.run(program, instance, frames, query, &Motion::of(query))?;
        Some(real(outcome.force))
    }

    /// Returns true if a leaf contributes to an instance of a program at a sample, even by zero.
    pub(crate) fn contributes(
        &mut self,
        program: &Program,
        leaf: u32,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        motion: &Motion<f64>,
    ) -> bool {
        let outcome = self.run_at(&SampleContext {
            watched: Some(leaf),
            ..SampleContext::new(program, instance, frames, query, motion)
        });
        outcome.is_some_and(|outcome| outcome.watched)
    }

    /// [`Interpreter::run`] for a given context.
    pub(super) fn run_at<T: Single>(&mut self, place: &SampleContext<'_, T>) -> Option<Outcome<T>> {
        let open = Open::<T>::new();
        let value = place.walk(&open);
        if !open.on_a_surface() {
            return outcome(value, &open);
        }
        // The sample lies on a surface: find the pieces of its neighbourhood, and run again.
        self.normals.clear();
        for (leaf, field) in place.program.leaves.iter().enumerate() {
            if let Some(local) = place.acting(leaf).filter(|(_, acts)| *acts) {
                field.region.touched(&local.0, &mut self.normals);
            }
        }
        let here = Neighbourhood::of(&self.normals);
        outcome(place.walk(&here), &here)
    }
}

fn outcome<T: Single, S: Sets<T>>(value: Value<T, S::Set>, here: &S) -> Option<Outcome<T>> {
    here.any(value.defined).then_some(Outcome {
        force: value.vector,
        watched: value.watched,
    })
}

impl<'a, T: QueryNumber> SampleContext<'a, T> {
    #[inline(always)]
    pub(super) fn new(
        program: &'a Program,
        instance: usize,
        frames: &'a [Option<Frame>],
        query: &'a T::Query,
        motion: &'a Motion<T>,
    ) -> Self {
        SampleContext {
            program,
            instance,
            frames,
            query,
            motion,
            watched: None,
        }
    }

    /// Runs the steps of the program.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn walk<S: Sets<T>>(&self, here: &S) -> Value<T, S::Set> {
        let undefined = Value::undefined(here.all(false.into()));
        let mut stack = Stack::<_, 8>::new(undefined);
        for step in &self.program.steps {
            let value = match *step {
                Instruction::Nowhere => undefined,
                Instruction::Leaf(leaf) | Instruction::Join(_, leaf) => self.leaf_value(leaf, here),
                Instruction::Apply(_) | Instruction::Modify(_) => stack.pop(),
                Instruction::Layers(count, modes) => {
                    let mut gathered = Layers::new(undefined);
                    let modes = &self.program.modes[modes as usize];
                    for (number, mode) in modes.iter().enumerate() {
                        gathered.add(stack.last(count as usize, number), mode, here);
                    }
                    stack.remove(count as usize);
                    gathered.value
                }
            };
            let value = match *step {
                Instruction::Apply(operator) | Instruction::Join(operator, _) => {
                    apply(operator, stack.pop(), value, here)
                }
                Instruction::Modify(number) => self.modified(number, value, here),
                _ => value,
            };
            stack.push(value);
        }
        stack.top()
    }

    #[inline(always)]
    fn frame(&self, anchored: usize) -> Option<&'a Frame> {
        self.program.frame(self.instance, anchored, self.frames)
    }

    /// The sample in the frame of a leaf, and the mask of samples on which the leaf acts; `None` if that is
    /// empty, or if the carrier of the leaf is gone.
    #[inline(always)]
    fn acting(&self, leaf: usize) -> Option<(LocalQuery<'a, T>, T::Mask)> {
        let frame = self.frame(leaf)?;
        let acts = self.program.leaves[leaf].acts_on(self.query, frame);
        acts.any()
            .then(|| (LocalQuery::moving(self.query, self.motion, frame), acts))
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn leaf_value<S: Sets<T>>(&self, leaf: u32, here: &S) -> Value<T, S::Set> {
        let nowhere = here.all(false.into());
        let Some((local, acts)) = self.acting(leaf as usize) else {
            return Value::undefined(nowhere);
        };
        let field = &self.program.leaves[leaf as usize];
        let holds = if field.region.is_everywhere() {
            here.all(true.into())
        } else {
            T::apart(
                #[inline(always)]
                || field.region.set(&local, here),
            )
        };
        let defined = here.intersection(here.all(acts), holds);
        if !here.any(defined).any() {
            return Value::undefined(nowhere);
        }
        Value {
            defined,
            vector: self.force(leaf as usize, &local),
            watched: (self.watched == Some(leaf)).into(),
        }
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn force(&self, leaf: usize, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let strength = self.program.strength(self.instance, leaf);
        T::apart(
            #[inline(always)]
            || self.program.leaves[leaf].force_of(strength, local),
        )
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn modified<S: Sets<T>>(
        &self,
        number: u32,
        value: Value<T, S::Set>,
        here: &S,
    ) -> Value<T, S::Set> {
        if !here.any(value.defined).any() {
            return value;
        }
        let frame = self.frame(self.program.leaves.len() + number as usize);
        let local = frame.map(|frame| LocalQuery::moving(self.query, self.motion, frame));
        let modifier = &self.program.modifiers[number as usize];
        let vector = T::apart(
            #[inline(always)]
            || modifier.apply(value.vector, local.as_ref()),
        );
        Value { vector, ..value }
    }
}

/// The result of an operator on two operands; see the table at [`Operator`].
#[cfg_attr(not(debug_assertions), inline(always))]
fn apply<T: QueryNumber, S: Sets<T>>(
    operator: Operator,
    u: Value<T, S::Set>,
    v: Value<T, S::Set>,
    here: &S,
) -> Value<T, S::Set> {
    let (e, g) = (here.any(u.defined), here.any(v.defined));
    let alone = Vec3::select(e, u.vector, v.vector);
    let watched = match operator {
        Operator::Difference => u.watched,
        Operator::ReplaceUnion | Operator::ReplaceIntersection => {
            (g & v.watched) | (!g & u.watched)
        }
        _ => (e & u.watched) | (g & v.watched),
    };
    Value {
        defined: operator.set(u.defined, v.defined, here),
        vector: Vec3::select(e & g, operator.vector(u.vector, v.vector), alone),
        watched,
    }
}

/// The rule at [`Tree::layers`](crate::Tree::layers), for operands of falling priority.
struct Layers<T: Number, S> {
    undefined: Value<T, S>,
    value: Value<T, S>,
    stopped: T::Mask,
}

impl<T: QueryNumber, S: Copy> Layers<T, S> {
    #[inline(always)]
    fn new(undefined: Value<T, S>) -> Self {
        Layers {
            undefined,
            value: undefined,
            stopped: false.into(),
        }
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn add(&mut self, next: Value<T, S>, mode: &Override, here: &impl Sets<T, Set = S>) {
        let gathered = &mut self.value;
        gathered.defined = here.union(gathered.defined, next.defined);
        let counts = here.any(next.defined) & !self.stopped;
        let before = if mode.replaces {
            &self.undefined
        } else {
            &*gathered
        };
        let sum = before.vector + next.vector;
        let watched = before.watched | next.watched;
        gathered.vector = Vec3::select(counts, sum, gathered.vector);
        gathered.watched = (counts & watched) | (!counts & gathered.watched);
        self.stopped = self.stopped | (counts & mode.stops.into());
    }
}
