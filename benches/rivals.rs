//! Fields beside the loop that does the same by hand.
//!
//! `cargo bench --bench rivals [-- NAME]`, measured as `leave_out` is. Compared is what the fields add to
//! Rapier's step with what the loop adds to it; a scene's name says what is aimed at.

mod paired;

use paired::{Variant, alone, balls, compare, variant, with};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::rivals::cell_list::CellList;
use rapier3d_fields_lab::single::rivals::vectorised::Vectorised;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, BoxOfAmmonia, interaction};

/// Balls that fly slowly, so that Rapier has no more to do than for those that stand.
fn flying(count: usize) -> PhysicsWorld {
    let mut world = balls(count);
    for (_, body) in world.bodies.iter_mut() {
        body.set_linvel(Vector::new(0.05, 0.02, -0.03), true);
    }
    world
}

/// A world in which a loop over all bodies adds its impulses before each step.
fn by_hand(
    name: &'static str,
    mut world: PhysicsWorld,
    impulse: impl Fn(&RigidBody, Real) -> Vector + 'static,
) -> Variant {
    variant(name, move || {
        let dt = world.integration_parameters.dt;
        for (_, body) in world.bodies.iter_mut() {
            let impulse = impulse(body, dt);
            body.apply_impulse(impulse, true);
        }
        world.step();
    })
}

/// Drag, or wind, with and without a term of the second order.
fn drag(count: usize, wind: Vector, quadratic: Real) -> Vec<Variant> {
    let k = 0.1;
    let tree = || match wind == Vector::ZERO {
        true => Field::drag(k, quadratic),
        false => Field::wind(wind, k, quadratic),
    };
    let drag = move |body: &RigidBody, dt: Real| {
        let past = wind - body.linvel();
        past * ((k + quadratic * past.length()) * dt)
    };
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(flying(count)),
        by_hand("by hand", flying(count), drag),
        with("field, kick", flying(count), tree(), Scheme::Kick),
        with("field, kick-drift-kick", flying(count), tree(), kdk),
    ]
}

const ZONES: [Vector; 3] = [
    Vector::new(20.0, 20.0, 20.0),
    Vector::new(60.0, 60.0, 60.0),
    Vector::new(90.0, 40.0, 60.0),
];
const RADIUS: Real = 50.0;

/// What a zone does to a body, unless that is out of its reach.
fn pull(body: &RigidBody, zone: Vector) -> Option<Vector> {
    let way = zone - body.center_of_mass();
    let r2 = way.length_squared();
    (r2 <= RADIUS * RADIUS).then(|| way / (r2 * r2.sqrt()))
}

/// Three zones that attract: all of them, or the last that holds a body.
fn zones(count: usize, replace: bool) -> Vec<Variant> {
    let impulse = move |body: &RigidBody, dt: Real| {
        let mut pulls = ZONES.iter().rev().filter_map(|zone| pull(body, *zone));
        let force = match replace {
            true => pulls.next().unwrap_or(Vector::ZERO),
            false => pulls.sum(),
        };
        force * dt
    };
    let tree = || {
        let zone = |at| {
            let zone = Field::radial(-1.0, -2.0).within(Region::ball(RADIUS));
            zone.at(at)
        };
        let operator = match replace {
            true => Operator::ReplaceUnion,
            false => Operator::SumUnion,
        };
        Tree::fold(operator, ZONES.map(zone))
    };
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(balls(count)),
        by_hand("by hand", balls(count), impulse),
        with("field, kick", balls(count), tree(), Scheme::Kick),
        with("field, kick-drift-kick", balls(count), tree(), kdk),
    ]
}

/// Free boxes that turn in the gravity of a planet.
fn boxes(count: usize) -> Vec<Variant> {
    let world = || {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        let side = (count as f64).cbrt().ceil() as usize;
        for i in 0..count {
            let cell = [i % side, i / side % side, i / side / side].map(|n| n as Real);
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::from_array(cell) * 5.0)
                .angvel(Vector::new(0.1, 0.2, 0.3))
                .can_sleep(false);
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.4, 0.3));
        }
        world.step();
        world
    };
    let planet = || Field::point_gravity(10.0).at(Vector::splat(-50.0));
    let centre = || planet().sampled(Sampling::Centre);
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(world()),
        with("at the centre", world(), centre(), kdk),
        with("in the volume, kick", world(), planet(), Scheme::Kick),
        with("in the volume", world(), planet(), kdk),
    ]
}

/// Zones that ride on every tenth ball.
fn moving_zones(count: usize) -> Vec<Variant> {
    const REACH: Real = 6.0;
    let riders = |world: &PhysicsWorld| -> Vec<RigidBodyHandle> {
        let all = world.bodies.iter().map(|(handle, _)| handle);
        all.step_by(10).collect()
    };
    let mut world = balls(count);
    let carriers = riders(&world);
    let looped = variant("double loop by hand", move || {
        let dt = world.integration_parameters.dt;
        let place = |handle: &RigidBodyHandle| (*handle, world.bodies[*handle].center_of_mass());
        let zones: Vec<_> = carriers.iter().map(place).collect();
        for (handle, body) in world.bodies.iter_mut() {
            let point = body.center_of_mass();
            let mut force = Vector::ZERO;
            for (carrier, zone) in &zones {
                let way = *zone - point;
                let r2 = way.length_squared();
                if r2 <= REACH * REACH && *carrier != handle {
                    force += way / (r2 * r2.sqrt());
                }
            }
            body.apply_impulse(force * dt, true);
        }
        world.step();
    });
    let fields = |name, scheme| {
        let world = balls(count);
        let zone = |carrier: RigidBodyHandle| {
            let zone = Field::radial(-1.0, -2.0).within(Region::ball(REACH));
            zone.at(carrier)
        };
        let tree = Tree::fold(Operator::SumUnion, riders(&world).into_iter().map(zone));
        with(name, world, tree, scheme)
    };
    vec![
        alone(balls(count)),
        looped,
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
    ]
}

/// Molecules of ammonia that act on each other: as fields, and by loops written for them.
fn molecules(count: usize, spacing: Real) -> Vec<Variant> {
    const CUTOFF: Real = 10.0;
    let scene = || -> BoxOfAmmonia {
        let settings = AmmoniaSettings {
            count,
            spacing,
            ..AmmoniaSettings::default()
        };
        settings.build().expect("the settings are in range")
    };
    let (mut plain, mut listed, mut wide) = (scene(), scene(), scene());
    let mut loops = CellList::new(&listed, CUTOFF);
    let mut vectors = Vectorised::new(&wide, CUTOFF);
    let fields = |name, scheme| {
        let mut scene = scene();
        let tree = interaction(scene.molecules.iter().map(|it| it.sites), Some(CUTOFF));
        let builder = Fields::builder(tree).scheme(scheme);
        let mut fields = scene.fields(builder).expect("the tree fits the scene");
        variant(name, move || {
            fields.step(&mut scene.world).expect("no field is singular");
        })
    };
    vec![
        variant("Rapier alone", move || plain.world.step()),
        variant("cell list by hand", move || loops.step(&mut listed.world)),
        variant("SIMD for ammonia by hand", move || {
            vectors.step(&mut wide.world);
        }),
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
    ]
}

fn main() {
    compare("drag, 10,000 balls (≤ 2 × by hand)", 10, || {
        drag(10_000, Vector::ZERO, 0.0)
    });
    compare(
        "quadratic drag, 10,000 balls (≤ 2 × by hand)",
        20,
        || drag(10_000, Vector::ZERO, 0.1),
    );
    compare("wind, 10,000 balls (≤ 2 × by hand)", 10, || {
        drag(10_000, Vector::Y * 2.0, 0.1)
    });
    compare(
        "three zones, summed, 10,000 balls (≤ 1 × by hand)",
        20,
        || zones(10_000, false),
    );
    compare(
        "three zones, replacing, 10,000 balls (≤ 1 × by hand)",
        20,
        || zones(10_000, true),
    );
    compare(
        "10,000 boxes, point gravity (added ≤ 0.5 × Rapier)",
        10,
        || boxes(10_000),
    );
    compare(
        "1,000 moving zones, 10,000 balls (≤ 0.05 × by hand)",
        5,
        || moving_zones(10_000),
    );
    compare("liquid, 1,000 molecules", 5, || molecules(1_000, 3.6));
    compare("liquid, 10,000 molecules", 2, || molecules(10_000, 3.6));
    compare("gas, 10,000 molecules", 3, || molecules(10_000, 20.0));
}
