//! Free bodies in plain fields.
//!
//! In all worlds of a scene bodies fly alike, even if nothing acts on them, since moving bodies cost Rapier more.
//! Fields are weak, so that velocities change by little during the measurement.

use rapier3d_fields::field::Turbulence;
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::random::Random;

use super::paired::{Variant, alone, balls, lattice, variant, with};

/// The velocity of bodies at the start.
const VELOCITY: Vector = Vector::new(0.05, 0.02, -0.03);

/// Balls on a wide lattice, all of the same velocity.
fn flying(count: usize, velocity: Vector) -> PhysicsWorld {
    let mut world = balls(count);
    for (_, body) in world.bodies.iter_mut() {
        body.set_linvel(velocity, true);
    }
    world
}

/// Gives every body the impulse of a force over some time.
fn kick(world: &mut PhysicsWorld, time: Real, force: impl Fn(&RigidBody) -> Vector) {
    for (_, body) in world.bodies.iter_mut() {
        let impulse = force(body) * time;
        body.apply_impulse(impulse, true);
    }
}

/// Rapier alone, loops that kick once and twice a step, and fields under both schemes.
fn beside_loops(
    world: impl Fn() -> PhysicsWorld,
    force: impl Fn(&RigidBody) -> Vector + Copy + 'static,
    tree: impl Fn() -> Tree,
) -> Vec<Variant> {
    let (mut once, mut twice) = (world(), world());
    let dt = once.integration_parameters.dt;
    vec![
        alone(world()),
        variant("kick by hand", move || {
            kick(&mut once, dt, force);
            once.step();
        }),
        variant("two half kicks by hand", move || {
            kick(&mut twice, 0.5 * dt, force);
            twice.step();
            kick(&mut twice, 0.5 * dt, force);
        }),
        with("field, kick", world(), tree(), Scheme::Kick),
        with(
            "field, kick-drift-kick",
            world(),
            tree(),
            Scheme::KickDriftKick,
        ),
    ]
}

/// One uniform field; also as Rapier's gravity, and as forces that are set anew in each step.
pub fn uniform(count: usize) -> Vec<Variant> {
    let g = Vector::Y * -1e-3;
    let world = || flying(count, VELOCITY);
    let mut forced = world();
    let force_loop = variant("force by hand", move || {
        for (_, body) in forced.bodies.iter_mut() {
            body.reset_forces(true);
            let force = g * body.mass();
            body.add_force(force, true);
        }
        forced.step();
    });
    let mut own = world();
    own.gravity = g;
    let field = || Field::uniform(g).force_mode(ForceMode::Acceleration).into();
    let mut variants = beside_loops(world, move |body| g * body.mass(), field);
    variants.push(variant("Rapier's gravity", move || own.step()));
    variants.push(force_loop);
    variants
}

/// Drag, or wind, with and without a quadratic term.
pub fn drag(count: usize, wind: Vector, quadratic: Real) -> Vec<Variant> {
    let rate = 1e-3;
    let force = move |body: &RigidBody| {
        let past = wind - body.linvel();
        past * (rate + quadratic * past.length())
    };
    let tree = || match wind == Vector::ZERO {
        true => Field::drag(rate, quadratic).into(),
        false => Field::wind(wind, rate, quadratic).into(),
    };
    beside_loops(|| flying(count, wind + VELOCITY), force, tree)
}

/// A random flow as wind. The loop by hand sums as many waves of the same kind, one after the other.
pub fn turbulence(count: usize) -> Vec<Variant> {
    const WAVES: usize = 32;
    let rate = 1e-3;
    let mut random = Random::new(3);
    let mut vector = move || {
        let unit = random.unit_vector().to_array();
        Vector::from_array(unit.map(|x| x as Real))
    };
    let waves: [_; WAVES] = std::array::from_fn(|_| [vector(), vector(), vector()]);
    let force = move |body: &RigidBody| {
        let point = body.center_of_mass();
        let mut flow = Vector::ZERO;
        for [along, cosine, sine] in &waves {
            let (sin, cos) = along.dot(point).sin_cos();
            flow += cosine * cos + sine * sin;
        }
        (flow - body.linvel()) * rate
    };
    let gusts = || Field::turbulence(Turbulence::new(3, 2.0, 6.0)).as_wind(rate, 0.0);
    beside_loops(|| flying(count, VELOCITY), force, || gusts().into())
}

/// Centres of zones, between balls of the lattice: at the centre of a ball, a loop by hand would divide by zero.
const ZONES: [Vector; 3] = [
    Vector::new(21.5, 22.0, 21.0),
    Vector::new(61.0, 62.5, 61.5),
    Vector::new(92.0, 41.5, 61.0),
];
const RADIUS: Real = 50.0;
const STRENGTH: Real = 1e-3;

/// The force of a zone on a body; `None` if the body is out of reach.
fn pull(body: &RigidBody, zone: Vector) -> Option<Vector> {
    let way = zone - body.center_of_mass();
    let r2 = way.length_squared();
    (r2 <= RADIUS * RADIUS).then(|| way * (STRENGTH / (r2 * r2.sqrt())))
}

fn zones_by(count: usize, operator: Operator, force: fn(&RigidBody) -> Vector) -> Vec<Variant> {
    let zone = |at| {
        let zone = Field::radial(-STRENGTH, -2.0).within(Region::ball(RADIUS));
        zone.at(at)
    };
    let tree = || Tree::fold(operator, ZONES.map(zone));
    beside_loops(|| flying(count, VELOCITY), force, tree)
}

/// Three attracting zones, whose forces add up.
pub fn zones(count: usize) -> Vec<Variant> {
    zones_by(count, Operator::SumUnion, |body| {
        ZONES.iter().filter_map(|zone| pull(body, *zone)).sum()
    })
}

/// Three attracting zones, of which only the last one that contains a body acts on it.
pub fn replacing_zones(count: usize) -> Vec<Variant> {
    zones_by(count, Operator::ReplaceUnion, |body| {
        let mut pulls = ZONES.iter().rev().filter_map(|zone| pull(body, *zone));
        pulls.next().unwrap_or(Vector::ZERO)
    })
}

/// Rotating boxes in the gravity of a planet.
pub fn boxes(count: usize) -> Vec<Variant> {
    let world = || {
        let mut world = lattice(count, &ColliderBuilder::cuboid(0.5, 0.4, 0.3));
        for (_, body) in world.bodies.iter_mut() {
            body.set_linvel(VELOCITY, true);
            body.set_angvel(Vector::new(0.1, 0.2, 0.3), true);
        }
        world
    };
    let planet = || Field::point_gravity(1.0).at(Vector::splat(-50.0));
    let centre = || planet().sampled(Sampling::Centre);
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(world()),
        with("field at the centre", world(), centre(), kdk),
        with("field, kick", world(), planet(), Scheme::Kick),
        with("field, kick-drift-kick", world(), planet(), kdk),
    ]
}

/// Zones anchored to every tenth ball.
pub fn moving_zones(count: usize) -> Vec<Variant> {
    const REACH: Real = 6.0;
    let riders = |world: &PhysicsWorld| -> Vec<RigidBodyHandle> {
        let all = world.bodies.iter().map(|(handle, _)| handle);
        all.step_by(10).collect()
    };
    let pull = |way: Vector| {
        let r2 = way.length_squared();
        (r2 <= REACH * REACH).then(|| way * (STRENGTH / (r2 * r2.sqrt())))
    };
    let mut world = flying(count, VELOCITY);
    let carriers = riders(&world);
    let looped = variant("double loop by hand", move || {
        let dt = world.integration_parameters.dt;
        let place = |handle: &RigidBodyHandle| (*handle, world.bodies[*handle].center_of_mass());
        let zones: Vec<_> = carriers.iter().map(place).collect();
        for (handle, body) in world.bodies.iter_mut() {
            let point = body.center_of_mass();
            let others = zones.iter().filter(|(carrier, _)| *carrier != handle);
            let force: Vector = others.filter_map(|(_, zone)| pull(*zone - point)).sum();
            body.apply_impulse(force * dt, true);
        }
        world.step();
    });
    let mut world = flying(count, VELOCITY);
    let carriers = riders(&world);
    let asked = variant("Rapier's query by hand", move || {
        let dt = world.integration_parameters.dt;
        let mut impulses = Vec::new();
        for carrier in &carriers {
            let zone = world.bodies[*carrier].center_of_mass();
            let reach = Aabb::from_half_extents(zone, Vector::splat(REACH));
            let query = world.broad_phase.as_query_pipeline(
                world.narrow_phase.query_dispatcher(),
                &world.bodies,
                &world.colliders,
                QueryFilter::default().exclude_rigid_body(*carrier),
            );
            let near = query.intersect_aabb_conservative(reach);
            impulses.extend(near.filter_map(|(_, collider)| {
                let handle = collider.parent()?;
                let force = pull(zone - world.bodies[handle].center_of_mass())?;
                Some((handle, force * dt))
            }));
        }
        for (handle, impulse) in impulses {
            world.bodies[handle].apply_impulse(impulse, true);
        }
        world.step();
    });
    let fields = |name, scheme| {
        let world = flying(count, VELOCITY);
        let zone = |carrier: RigidBodyHandle| {
            let zone = Field::radial(-STRENGTH, -2.0).within(Region::ball(REACH));
            zone.at(carrier)
        };
        let tree = Tree::fold(Operator::SumUnion, riders(&world).into_iter().map(zone));
        with(name, world, tree, scheme)
    };
    vec![
        alone(flying(count, VELOCITY)),
        looped,
        asked,
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
    ]
}

/// Balls that all attract each other, with drag.
pub fn attracted(count: usize) -> Vec<Variant> {
    const SOFT: Real = 0.5;
    const PULL: Real = 1e-5;
    const DRAG: Real = 1e-3;
    let mut world = flying(count, VELOCITY);
    let looped = variant("double loop by hand", move || {
        let dt = world.integration_parameters.dt;
        let places: Vec<_> = world
            .bodies
            .iter()
            .map(|it| it.1.center_of_mass())
            .collect();
        for (place, (_, body)) in world.bodies.iter_mut().enumerate() {
            let mut force = body.linvel() * -DRAG;
            for (other, at) in places.iter().enumerate() {
                let way = *at - places[place];
                let r2 = way.length_squared() + SOFT * SOFT;
                if other != place {
                    force += way * (PULL / (r2 * r2.sqrt()));
                }
            }
            body.apply_impulse(force * dt, true);
        }
        world.step();
    });
    let fields = |name, scheme| {
        let world = flying(count, VELOCITY);
        let pull = |(body, _)| Field::radial(-PULL, -2.0).softened(SOFT).at(body);
        let tree = Tree::fold(Operator::SumUnion, world.bodies.iter().map(pull));
        with(name, world, tree + Field::drag(DRAG, 0.0), scheme)
    };
    vec![
        alone(flying(count, VELOCITY)),
        looped,
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
        fields("field, auto", Scheme::auto(0.01)),
    ]
}
