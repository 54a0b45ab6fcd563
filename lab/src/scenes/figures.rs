//! The paper's Figure 3, an attraction that a repulsion replaces close to its centre, and Figure 4, three bodies that
//! each carry such a field.
//!
//! The inner field is dynamic, as in the paper: it simulates a surface, so that its radius depends on the radius of the
//! body that enters. Both fields have constant strength, so that every fall and bounce has a closed form.

use super::fields;
use fields::math::{Real, RigidBodyHandle, Vector};
use fields::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};
use fields::{Axis, Field, Region, Tree};

use super::{SceneError, check_range, empty_world};

/// The composite of Figure 3: a pull towards the centre that is replaced by a push away from it where a body touches
/// the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayeredField {
    /// Strength of the attraction, a force.
    pub pull: Real,
    /// Radius within which it acts.
    pub reach: Real,
    /// Strength of the repulsion, a force.
    pub push: Real,
    /// Radius of the surface that the repulsion simulates.
    pub surface: Real,
}

impl Default for LayeredField {
    /// A pull of 1 out to 8, and a push of 20 at a surface of radius 1.
    fn default() -> Self {
        Self {
            pull: 1.0,
            reach: 8.0,
            push: 20.0,
            surface: 1.0,
        }
    }
}

impl LayeredField {
    /// The tree: `replace_union` of the two fields, around the origin.
    pub fn tree(&self) -> Tree {
        let surface = self.surface;
        let touching = Region::predicate([Axis::Radius], move |sample| {
            sample.local_point.length() <= surface + sample.axes[0]
        });
        let pull = Field::radial(-self.pull, 0.0).within(Region::ball(self.reach));
        // The ball bounds the region. Otherwise every body would be tested.
        let push =
            Field::radial(self.push, 0.0).within(Region::ball(self.reach).intersection(touching));
        pull.named("attraction")
            .replace_union(push.named("repulsion"))
    }

    /// The same tree for bodies of certain radii, as plain data: one ball per radius replaces the predicate that tests
    /// whether a body of any radius touches. Unlike the other tree, it can be stored in a file.
    ///
    /// Radii are equal if they differ by less than a thousandth.
    pub fn tree_for(&self, radii: &[Real]) -> Tree {
        let reach = Region::ball(self.reach);
        let touching = radii.iter().map(|radius| {
            let alike = Region::interval(Axis::Radius, radius * 0.999, radius * 1.001);
            Region::ball(self.surface + radius).intersection(alike)
        });
        let pull = Field::radial(-self.pull, 0.0).within(reach.clone());
        let pull = pull.named("attraction");
        let Some(touching) = touching.reduce(Region::union) else {
            return pull.into();
        };
        let push = Field::radial(self.push, 0.0).within(reach.intersection(touching));
        pull.replace_union(push.named("repulsion"))
    }

    fn check(&self) -> Result<(), SceneError> {
        check_range("pull", self.pull, 0.0, 1e6)?;
        check_range("push", self.push, 0.0, 1e6)?;
        check_range("surface", self.surface, 1e-3, 1e3)?;
        check_range("reach", self.reach, self.surface, 1e4)
    }
}

/// Settings of Figure 3: bodies of several sizes around one fixed body with the composite field.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure3Settings {
    /// The field.
    pub field: LayeredField,
    /// Radius, position and velocity of each body; all have mass 1.
    pub bodies: Vec<(Real, Vector, Vector)>,
    /// Time step.
    pub dt: Real,
}

impl Default for Figure3Settings {
    /// A small and a large body that fall straight to the centre, one that bounces around it, and one out of reach.
    fn default() -> Self {
        Self {
            field: LayeredField::default(),
            bodies: vec![
                (0.2, Vector::new(-5.0, 3.0, 0.0), Vector::ZERO),
                (0.8, Vector::new(5.0, 4.0, 0.0), Vector::ZERO),
                (0.4, Vector::new(0.0, -6.0, 0.0), Vector::X * 0.7),
                (0.4, Vector::new(8.0, -4.0, 0.0), Vector::ZERO),
            ],
            dt: 1.0 / 240.0,
        }
    }
}

/// A figure as a world and a tree.
pub struct Figure {
    /// The physics world, without gravity. Rapier solves no contacts in it: bodies bounce off the fields.
    pub world: PhysicsWorld,
    /// The composite field.
    pub tree: Tree,
    /// The bodies that move.
    pub bodies: Vec<RigidBodyHandle>,
    /// The bodies that carry the field.
    pub sources: Vec<RigidBodyHandle>,
}

impl Figure3Settings {
    /// Builds the figure, with the field on a fixed body at the origin.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn build(&self) -> Result<Figure, SceneError> {
        self.field.check()?;
        check_range("dt", self.dt, 1e-6, 1.0)?;
        let mut world = empty_world(self.dt);
        let surface = untouched(ColliderBuilder::ball(self.field.surface));
        let (centre, _) = world.insert(RigidBodyBuilder::fixed(), surface);
        let mut bodies = Vec::new();
        for &(radius, place, velocity) in &self.bodies {
            check_range("radius", radius, 1e-3, 1e3)?;
            bodies.push(insert_ball(&mut world, radius, place, velocity));
        }
        Ok(Figure {
            world,
            tree: Tree::instances(self.field.tree(), [centre]),
            bodies,
            sources: vec![centre],
        })
    }
}

/// Settings of Figure 4: three bodies, each with the composite field, on an equilateral triangle around the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure4Settings {
    /// The field of each body; its surface is the body's own.
    pub field: LayeredField,
    /// Length of the sides.
    pub side: Real,
    /// Initial speed around the origin.
    pub speed: Real,
    /// Time step.
    pub dt: Real,
}

impl Default for Figure4Settings {
    /// Sides of 6, and a slow rotation.
    fn default() -> Self {
        Self {
            field: LayeredField::default(),
            side: 6.0,
            speed: 0.4,
            dt: 1.0 / 240.0,
        }
    }
}

impl Figure4Settings {
    /// Builds the figure. The three bodies of mass 1 are listed as `bodies` and as `sources`.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn build(&self) -> Result<Figure, SceneError> {
        self.field.check()?;
        check_range("dt", self.dt, 1e-6, 1.0)?;
        check_range("side", self.side, 2.0 * self.field.surface, 1e4)?;
        check_range("speed", self.speed, 0.0, 1e6)?;
        let mut world = empty_world(self.dt);
        let handles = self.corners().map(|outward| {
            let place = outward * (self.side / Real::sqrt(3.0));
            let velocity = Vector::Z.cross(outward) * self.speed;
            insert_ball(&mut world, self.field.surface, place, velocity)
        });
        Ok(Figure {
            world,
            tree: Tree::instances(self.field.tree(), handles),
            bodies: handles.to_vec(),
            sources: handles.to_vec(),
        })
    }

    /// Directions from the origin to the corners, in the plane of x and y.
    fn corners(&self) -> [Vector; 3] {
        let half = Real::sqrt(3.0) / 2.0;
        [
            Vector::Y,
            Vector::new(-half, -0.5, 0.0),
            Vector::new(half, -0.5, 0.0),
        ]
    }
}

fn insert_ball(
    world: &mut PhysicsWorld,
    radius: Real,
    place: Vector,
    velocity: Vector,
) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(velocity)
        .can_sleep(false);
    let ball = untouched(ColliderBuilder::ball(radius).mass(1.0));
    world.insert(body, ball).0
}

/// Makes Rapier find the contacts of a collider, but not solve them.
fn untouched(collider: ColliderBuilder) -> ColliderBuilder {
    use fields::rapier::geometry::{Group, InteractionGroups};
    collider.solver_groups(InteractionGroups {
        memberships: Group::GROUP_32,
        filter: Group::ALL - Group::GROUP_32,
        ..InteractionGroups::all()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::field::Query;
    use fields::math::{DVec3, to_dvec3, to_f64};
    use fields::reference::Reference;
    use fields::{Fields, WorldRef};

    /// The force on a sample at `point`, of a body or of none.
    fn force(
        figure: &Figure,
        point: DVec3,
        radius: f64,
        body: Option<RigidBodyHandle>,
    ) -> Option<DVec3> {
        let query = Query {
            world_point: point,
            radius,
            body,
            ..Query::default()
        };
        let frames = WorldRef::from(&figure.world);
        let reference = Reference::new(&figure.tree).unwrap();
        reference.force(&frames, &query)
    }

    fn place(figure: &Figure, index: usize) -> DVec3 {
        to_dvec3(figure.world.bodies[figure.bodies[index]].translation())
    }

    #[track_caller]
    fn assert_near(found: DVec3, expected: DVec3, tolerance: f64) {
        let error = found.distance(expected);
        assert!(error <= tolerance, "{found} is not {expected}");
    }

    #[test]
    fn figure_3_pulls_outside_pushes_inside_and_has_a_finite_reach() {
        let figure = Figure3Settings::default().build().unwrap();
        let along = DVec3::new(0.6, 0.0, 0.8);
        let at = |distance: f64, radius| force(&figure, along * distance, radius, None);
        assert_near(at(7.9, 0.0).unwrap(), -along, 1e-7);
        assert_near(at(1.1, 0.0).unwrap(), -along, 1e-7);
        assert_near(at(0.9, 0.0).unwrap(), 20.0 * along, 1e-5);
        assert_near(at(1.1, 0.2).unwrap(), 20.0 * along, 1e-5);
        assert_eq!(at(8.1, 0.0), None, "not defined is not zero");
    }

    /// Released at rest at r₀, a body of mass 1 reaches the surface s after √(2 (r₀ − s)/pull), sinks in by
    /// pull (r₀ − s)/push, and is back after twice the time to that depth.
    #[test]
    fn figure_3_falls_and_bounces_by_the_closed_form() {
        let field = LayeredField::default();
        let (pull, push) = (to_f64(field.pull), to_f64(field.push));
        for (radius, start) in [(0.25, 4.0), (0.75, 6.0)] {
            let fall: f64 = start - 1.0 - radius;
            let speed = (2.0 * pull * fall).sqrt();
            let period = 2.0 * speed * (1.0 / pull + 1.0 / push);
            let steps = 4000;
            let settings = Figure3Settings {
                bodies: vec![(radius as Real, Vector::X * start as Real, Vector::ZERO)],
                dt: (period / f64::from(steps)) as Real,
                ..Default::default()
            };
            let mut figure = settings.build().unwrap();
            let mut fields = Fields::new(figure.tree.clone()).unwrap();
            let mut nearest = f64::INFINITY;
            for _ in 0..steps {
                fields.step(&mut figure.world).unwrap();
                nearest = nearest.min(place(&figure, 0).x);
            }
            let depth = pull * fall / push;
            // A step that straddles the surface errs by up to push · dt of velocity.
            let step_error = push * period / f64::from(steps);
            assert!((1.0 + radius - depth - nearest).abs() < depth * 2.0 * step_error / speed);
            assert_near(
                place(&figure, 0),
                DVec3::X * start,
                2.0 * step_error * period,
            );
        }
    }

    #[test]
    fn figure_4_forces_add_and_cancel() {
        let figure = Figure4Settings::default().build().unwrap();
        let [a, b, c] = [0, 1, 2].map(|index| place(&figure, index));
        let at = |point, body| force(&figure, point, 0.0, body).unwrap();
        // In the middle of all, and between two of them.
        assert_near(at(DVec3::ZERO, None), DVec3::ZERO, 1e-6);
        let between = (b + c) / 2.0;
        assert_near(at(between, None), (a - between).normalize(), 1e-6);
        // The fields of the other two act on each body, its own does not.
        let on_a = at(a, Some(figure.bodies[0]));
        assert_near(on_a, -(3.0_f64.sqrt()) * a.normalize(), 1e-6);
        // Within the surface of one, that one pushes and the others pull.
        let within = a + DVec3::new(0.3, 0.2, 0.1);
        let pulls = (b - within).normalize() + (c - within).normalize();
        let pushed = 20.0 * (within - a).normalize() + pulls;
        assert_near(at(within, None), pushed, 1e-4);
    }

    /// Released at rest, the bodies fall towards their middle until they touch, sink in by the depth that follows from
    /// the energy, and return to where they were; the centre of mass stays.
    #[test]
    fn figure_4_bodies_attract_until_they_touch_and_bounce() {
        let settings = Figure4Settings {
            speed: 0.0,
            dt: 1.0 / 1000.0,
            ..Default::default()
        };
        let mut figure = settings.build().unwrap();
        let mut fields = Fields::new(figure.tree.clone()).unwrap();
        let start = place(&figure, 0).y;
        let touch = 2.0 / 3.0_f64.sqrt();
        let (pull, push) = (3.0_f64.sqrt(), 20.0 * 3.0_f64.sqrt());
        let speed = (2.0 * pull * (start - touch)).sqrt();
        let period = 2.0 * speed * (1.0 / pull + 1.0 / push);
        let mut nearest = f64::INFINITY;
        for _ in 0..(period * 1000.0).round() as usize {
            fields.step(&mut figure.world).unwrap();
            nearest = nearest.min(place(&figure, 0).y);
        }
        let depth = (start - touch) / 20.0;
        let step_error = push / 1000.0;
        assert!((touch - depth - nearest).abs() < depth * 2.0 * step_error / speed);
        assert!((place(&figure, 0).y - start).abs() < 2.0 * step_error * period);
        let middle = (0..3).map(|index| place(&figure, index)).sum::<DVec3>() / 3.0;
        assert_near(middle, DVec3::ZERO, 1e-5);
    }

    #[test]
    fn bad_settings_are_errors() {
        let field = LayeredField {
            push: Real::NAN,
            ..Default::default()
        };
        let error = Figure4Settings {
            field,
            ..Default::default()
        };
        let error = error.build().err().unwrap().to_string();
        assert!(error.contains("push is NaN"), "{error}");
        let close = Figure4Settings {
            side: 1.0,
            ..Default::default()
        };
        assert!(close.build().is_err());
    }
}
