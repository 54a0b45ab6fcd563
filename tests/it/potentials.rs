//! The potential energy under every modifier: forces are its negative gradient, or it reports that some have none.

use rapier3d_fields::math::{DVec3, from_dvec3, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::weightless;

/// Fields with a potential, by name.
fn bases() -> Vec<(&'static str, Field)> {
    vec![
        ("uniform", Field::uniform(Vector::new(1.0, -2.0, 0.5))),
        ("spring", Field::spring(3.0)),
        ("rest length", Field::spring_damper(3.0, 0.0, 0.7)),
        ("radial", Field::radial(-1.5, -1.0)),
        ("gravity", Field::point_gravity(4.0)),
        ("softened", Field::point_gravity(4.0).softened(0.3)),
        ("no nearer", Field::point_gravity(4.0).no_nearer_than(0.4)),
        ("coulomb", Field::coulomb(2.0, -1.0)),
        ("dispersion", Field::lennard_jones(0.2, 0.9)),
        (
            "cut",
            Field::lennard_jones(0.2, 0.9).shifted_to_zero_at(3.0),
        ),
        ("yukawa", Field::yukawa(2.0, 0.8)),
        ("morse", Field::morse(1.0, 1.2, 0.9)),
        ("gaussian", Field::gaussian(2.0, 0.8)),
        ("hertz", Field::hertz(5.0, 2.5)),
    ]
}

type Change<T> = (&'static str, fn(T) -> T);

fn changes() -> Vec<Change<Field>> {
    vec![
        ("plain", |field| field),
        ("strength", |field| field.strength(-1.7)),
        ("disabled", |field| field.enabled(false)),
        ("later", |field| {
            field.lifetime(Lifetime::between(5.0, f64::INFINITY))
        }),
        ("limited", |field| field.limited_to(0.6)),
        ("scaled", |field| field.scaled_by(Scalar::distance())),
        ("constantly", |field| field.scaled_by(Scalar::constant(0.4))),
        ("in a ball", |field| field.within(Region::ball(1.6))),
        ("moved", |field| {
            field.at(Anchor::from(Pose::new(Vector::splat(0.2), Vector::Y)))
        }),
        ("by axis", |field| field.coupled_to_axis(Axis::Charge)),
        ("per mass", |field| {
            field.force_mode(ForceMode::Acceleration)
        }),
        ("velocity", |field| {
            field.force_mode(ForceMode::VelocityChange)
        }),
        ("no group", |field| field.groups(InteractionGroups::none())),
    ]
}

fn operations() -> Vec<Change<Tree>> {
    vec![
        ("alone", |tree| tree),
        ("limited whole", |tree| tree.limited_to(0.5)),
        ("scaled whole", |tree| tree.scaled_by(Scalar::distance())),
        ("sum", |tree| tree.sum_union(inner())),
        ("common sum", |tree| tree.sum_intersection(inner())),
        ("cross", |tree| tree.cross_union(inner())),
        ("replaced", |tree| tree.replace_union(inner())),
        ("common replaced", |tree| tree.replace_intersection(inner())),
        ("without", |tree| tree.difference(inner())),
        ("strongest", |tree| tree.strongest(inner())),
        ("weakest", |tree| tree.weakest(inner())),
        ("minimum", |tree| tree.minimum(inner())),
        ("masked", |tree| tree.masked_by(inner())),
        ("instances", |tree| {
            let places = [-0.4, 0.5].map(|x| Pose::from_translation(Vector::X * x));
            Tree::instances(tree, places)
        }),
        ("layers", |tree| {
            Tree::layers([Layer::new(tree), Layer::new(inner()).replacing()])
        }),
    ]
}

fn inner() -> Tree {
    Field::spring(1.3).within(Region::ball(1.4)).into()
}

/// The force and the potential energy of a ball at a place.
struct Probe {
    world: PhysicsWorld,
    body: RigidBodyHandle,
    fields: Fields,
}

impl Probe {
    fn new(tree: Tree) -> Option<Self> {
        let mut world = weightless(0.01);
        let body = RigidBodyBuilder::dynamic();
        let (body, collider) = world.insert(body, ColliderBuilder::ball(0.1).mass(1.5));
        world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
        // Combinations that are refused are left out.
        let mut fields = Fields::new(tree).ok()?;
        let properties = ColliderProperties::new().charge(-1.2);
        let set = fields.set_properties(collider, properties, &world.colliders);
        set.expect("a collider that is there");
        Some(Probe {
            world,
            body,
            fields,
        })
    }

    fn at(&mut self, point: DVec3) -> (DVec3, f64, usize) {
        let pose = Pose::from_translation(from_dvec3(point));
        self.world.bodies[self.body].set_position(pose, true);
        let (bodies, colliders) = (&mut self.world.bodies, &mut self.world.colliders);
        bodies.propagate_modified_body_positions_to_colliders(colliders);
        let wrench = self.fields.sample(self.body, &self.world);
        let force = wrench
            .expect("a wrench")
            .map_or(DVec3::ZERO, |it| to_dvec3(it.force));
        let potential = self.fields.potential_energy(&self.world);
        (force, potential.total, potential.without)
    }
}

#[test]
fn forces_are_the_gradient_of_the_potential_or_have_none() {
    let h = 1e-5;
    let points = [
        DVec3::new(0.7, 0.4, -0.5),
        DVec3::new(-0.3, 1.9, 0.6),
        DVec3::new(0.5, -0.1, 0.45),
    ];
    let (mut compared, mut without, mut wrong) = (0, 0, Vec::new());
    for (base, field) in bases() {
        for (change, changed) in changes() {
            for (operation, operated) in operations() {
                let tree = operated(changed(field.clone()).into());
                let Some(mut probe) = Probe::new(tree) else {
                    continue;
                };
                for point in points {
                    let (force, _, unknown) = probe.at(point);
                    if unknown > 0 {
                        without += 1;
                        continue;
                    }
                    let slope = DVec3::AXES.map(|axis| {
                        let [up, down] = [h, -h].map(|h| probe.at(point + axis * h).1);
                        (down - up) / (2.0 * h)
                    });
                    let error = (DVec3::from_array(slope) - force).length();
                    compared += 1;
                    if error > 1e-6 * (1.0 + force.length()) {
                        wrong.push(format!(
                            "{base}, {change}, {operation} at {point}: {force}, by the potential {slope:?}"
                        ));
                    }
                }
            }
        }
    }
    println!("{compared} compared, {without} without a potential");
    assert!(compared > 500 && without > 500);
    let some = &wrong[..wrong.len().min(12)];
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        some.join("\n")
    );
}

/// Also in a prototype of instances, whose fields are evaluated together.
#[test]
fn the_potential_of_a_sum_is_the_sum_of_potentials() {
    let point = DVec3::new(0.7, 0.4, -0.5);
    let spring = || Field::spring(1.3).at(Vector::Y);
    let potential = |tree: Tree| Probe::new(tree).expect("a sound tree").at(point).1;
    for (name, field) in bases() {
        let alone = [Tree::from(field.clone()), spring().into()].map(potential);
        let expected: f64 = alone.iter().sum();
        let sum = || field.clone().sum_union(spring());
        let places = [Pose::IDENTITY; 2];
        for (tree, count) in [(sum(), 1.0), (Tree::instances(sum(), places), 2.0)] {
            let (_, found, without) = Probe::new(tree).expect("a sound tree").at(point);
            let off = (found - count * expected).abs();
            assert!(
                without == 0 && off <= 1e-6 * expected.abs(),
                "{name}: {found}, {expected}"
            );
        }
    }
}
