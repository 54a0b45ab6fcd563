//! Copies of a world with its fields, which step like these.

use rapier3d_fields::prelude::*;
use serde::{Deserialize, Serialize};

use crate::bits::bits;
use crate::draw::Draw;
use crate::formats::{FORMATS, Format};

#[derive(Clone, Copy)]
pub enum Copying {
    Predict,
    /// Writing and reading all that a step reads.
    Write(Format),
}

impl Copying {
    pub fn draw(draw: &mut Draw) -> Self {
        match draw.once_in(2) {
            true => Copying::Predict,
            false => Copying::Write(draw.of(&FORMATS)),
        }
    }

    /// The bits after the next step of a copy, which are `None` if the step fails; or `None` if there is no copy.
    pub fn step(self, fields: &Fields, world: &PhysicsWorld) -> Option<Option<Vec<Vec<u64>>>> {
        let (mut world, fields) = match self {
            Copying::Predict => {
                let prediction = fields.predict(world);
                (prediction.world, Ok(prediction.fields))
            }
            Copying::Write(format) => written(format, fields, world)?,
        };
        // Fields that no step would take are refused.
        let Ok(mut fields) = fields else {
            return Some(None);
        };
        match fields.step(&mut world) {
            // A state that was read does not know its world again if all bodies were placed elsewhere.
            Err(StepError::OtherWorld { .. }) => None,
            outcome => Some(outcome.ok().map(|_| bits(&world))),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Saved<W, S, T, U> {
    world: W,
    set: S,
    settings: T,
    state: U,
}

/// A copy by way of a format; `None` if the fields contain code, or JSON has no number like one of the world's.
fn written(
    format: Format,
    fields: &Fields,
    world: &PhysicsWorld,
) -> Option<(PhysicsWorld, Result<Fields, StepError>)> {
    let saved = Saved {
        world,
        set: &fields.set,
        settings: &fields.settings,
        state: &fields.state,
    };
    let bytes = format.write(&saved).ok()?;
    let read: Result<Saved<PhysicsWorld, FieldSet, FieldSettings, FieldState>, _> =
        format.read(&bytes);
    let read = match format {
        Format::Json => read.ok()?,
        _ => read.expect("what was written"),
    };
    let fields = Fields::from_parts(read.set, read.settings, read.state);
    Some((read.world, fields))
}
