//! Edits as users make them between steps.

use rapier3d_fields::math::Real;
use rapier3d_fields::prelude::*;

use crate::draw::Draw;
use crate::{trees, worlds};

pub struct Edits {
    pub steps: usize,
    /// Draws the edits of the world, which are the same with and without fields.
    of_world: Draw,
    of_fields: Draw,
    /// Whether a collider of several parts was given another shape. Rapier may then read beyond its contacts in a step
    /// without fields, and crash (seed 30025842); fields prevent it.
    pub crashes_alone: bool,
    /// Whether masses are not known before Rapier's next step, because a collider or an additional mass was edited.
    pub changes_masses: bool,
}

/// The kinds of edits of a world that set a mass, or a collider.
const OF_MASSES: [usize; 4] = [10, 13, 14, 15];

impl Edits {
    pub fn new(seed: u64) -> Self {
        let mut of_world = Draw::new(seed, 2);
        Edits {
            steps: of_world.of(&[1, 3, 10, 30]),
            of_world,
            of_fields: Draw::new(seed, 3),
            crashes_alone: false,
            changes_masses: false,
        }
    }

    pub fn apply(&mut self, step: usize, world: &mut PhysicsWorld, fields: Option<&mut Fields>) {
        self.changes_masses = false;
        // The first step is made with the world as it was built.
        if step == 0 {
            return;
        }
        if self.of_world.once_in(3) {
            let done = edit_world(&mut self.of_world, world);
            self.crashes_alone |= done.reshapes;
            self.changes_masses = done.changes_masses;
        }
        if let Some(fields) = fields.filter(|_| self.of_fields.once_in(4)) {
            edit_fields(&mut self.of_fields, world, fields);
        }
    }
}

/// The consequences of an edit.
#[derive(Default)]
struct Edit {
    /// A collider of several parts was given another shape.
    reshapes: bool,
    changes_masses: bool,
}

fn edit_world(draw: &mut Draw, world: &mut PhysicsWorld) -> Edit {
    let bodies: Vec<_> = world.bodies.iter().map(|it| it.0).collect();
    let kind = draw.below(16);
    if kind == 0 || bodies.is_empty() {
        worlds::insert(draw, world);
        return Edit::default();
    }
    let chosen = draw.of(&bodies);
    // Rapier panics at some edits of the links of multibodies.
    if world.multibody_joints.rigid_body_link(chosen).is_some() {
        return Edit::default();
    }
    let mut done = Edit {
        reshapes: false,
        changes_masses: OF_MASSES.contains(&kind),
    };
    let body = &mut world.bodies[chosen];
    match kind {
        1 => drop(world.remove_body(chosen)),
        2 => body.set_position(draw.pose(6.0), draw.once_in(2)),
        3 => body.set_linvel(draw.vector(20.0), true),
        4 => body.set_angvel(draw.vector(20.0), true),
        5 => body.sleep(),
        6 => body.wake_up(true),
        7 => body.add_force(draw.vector(20.0), true),
        8 => body.set_body_type(
            draw.of(&[RigidBodyType::Dynamic, RigidBodyType::Fixed]),
            true,
        ),
        9 => body.set_enabled(draw.once_in(2)),
        10 => body.set_additional_mass(draw.between(0.0, 20.0), true),
        11 => world.integration_parameters.dt = draw.of(&[1.0 / 60.0, 1.0 / 240.0, 0.05, 0.0]),
        12 => world.gravity = draw.vector(10.0),
        13 if draw.once_in(4) => body.set_linvel(Vector::splat(Real::NAN), true),
        14 if draw.once_in(4) => body.set_linvel(Vector::splat(1e9), true),
        _ => {
            let colliders: Vec<_> = world.colliders.iter().map(|it| it.0).collect();
            if colliders.is_empty() {
                return done;
            }
            let chosen = draw.of(&colliders);
            let collider = &mut world.colliders[chosen];
            match draw.below(6) {
                0 => {
                    done.reshapes = collider.shape().as_composite_shape().is_some();
                    collider.set_shape(SharedShape::ball(draw.size()));
                }
                1 => collider.set_enabled(draw.once_in(2)),
                2 => collider.set_density(draw.between(0.0, 5.0)),
                3 => collider.set_sensor(draw.once_in(2)),
                4 => collider.set_collision_groups(InteractionGroups::all()),
                _ => drop(world.remove_collider(chosen)),
            }
        }
    }
    done
}

fn edit_fields(draw: &mut Draw, world: &PhysicsWorld, fields: &mut Fields) {
    let all: Vec<_> = fields.set.iter().map(|it| it.0).collect();
    let kind = draw.below(10);
    if all.is_empty() && kind < 4 {
        return;
    }
    match kind {
        0 => {
            let chosen = draw.of(&all);
            if let Some(field) = fields.set.get_mut(chosen) {
                *field = field.clone().strength(draw.number());
            }
        }
        1 => {
            let chosen = draw.of(&all);
            if let Some(field) = fields.set.get_mut(chosen) {
                *field = field.clone().enabled(draw.once_in(2));
            }
        }
        2 => drop(fields.set.remove_field(draw.of(&all))),
        3 => {
            let chosen = draw.of(&all);
            if let Some(field) = fields.set.get_mut(chosen) {
                *field = field.clone().at(draw.pose(5.0));
            }
        }
        4 => drop(fields.set.insert(trees::tree(draw, world, 1))),
        5 => {
            // A tree that is refused leaves the set as it is.
            let _ = fields.set_tree(trees::tree(draw, world, 2));
        }
        6 => fields.settings.scheme = trees::scheme(draw),
        7 => fields.settings.detection = draw.of(&[Detection::Discrete, Detection::Swept]),
        8 => fields.set.clear(),
        _ => {
            let parts = (
                fields.set.clone(),
                fields.settings.clone(),
                fields.state.clone(),
            );
            // Invalid edits since the last step are refused here, as they are by a step.
            if let Ok(again) = Fields::from_parts(parts.0, parts.1, parts.2) {
                *fields = again;
            }
        }
    }
}
