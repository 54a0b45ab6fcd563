//! Fields beside the loop that does the same by hand.
//!
//! `cargo bench --bench rivals [-- NAME]`, measured as `leave_out` is. Compared is what the fields add to
//! Rapier's step with what the loop adds to it. With `--table` only that is printed, a line for each scene
//! and scheme, with what is aimed at: the README's table is made of it.

mod paired;

use std::path::{Path, PathBuf};

use paired::{ROUNDS, Variant, alone, balls, compare, is_chosen, measure, stepped, variant, with};
use rapier3d_fields::field::Turbulence;
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::random::Random;
use rapier3d_fields_lab::single::rivals::cell_list::CellList;
use rapier3d_fields_lab::single::rivals::lammps;
use rapier3d_fields_lab::single::rivals::vectorised::Vectorised;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, BoxOfAmmonia, interaction};

/// One uniform field against the loop that does the same by hand, and against Rapier's gravity.
fn uniform(count: usize) -> Vec<Variant> {
    let g = Vector::Y * -9.81;
    let kick = move |world: &mut PhysicsWorld, part: Real| {
        let dt = world.integration_parameters.dt * part;
        for (_, body) in world.bodies.iter_mut() {
            let impulse = g * (body.mass() * dt);
            body.apply_impulse(impulse, true);
        }
    };
    let mut looped = balls(count);
    let by_hand = variant("impulse loop by hand", move || {
        kick(&mut looped, 1.0);
        looped.step();
    });
    let mut halved = balls(count);
    let twice = variant("half before, half after by hand", move || {
        kick(&mut halved, 0.5);
        halved.step();
        kick(&mut halved, 0.5);
    });
    let mut forced = balls(count);
    let force = variant("force loop by hand", move || {
        for (_, body) in forced.bodies.iter_mut() {
            body.reset_forces(true);
            let force = g * body.mass();
            body.add_force(force, true);
        }
        forced.step();
    });
    let mut own = balls(count);
    own.gravity = g;
    let uniform = || Field::uniform(g).force_mode(ForceMode::Acceleration);
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(balls(count)),
        variant("Rapier's gravity", move || own.step()),
        by_hand,
        twice,
        force,
        with("field, kick", balls(count), uniform(), Scheme::Kick),
        with("field, kick-drift-kick", balls(count), uniform(), kdk),
    ]
}

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

/// A random flow as wind: by hand as many waves of the same kind, one after the other.
fn turbulence(count: usize) -> Vec<Variant> {
    const WAVES: usize = 32;
    let k = 0.1;
    let mut random = Random::new(3);
    let mut vector = move || {
        let unit = random.unit_vector().to_array();
        Vector::from_array(unit.map(|x| x as Real))
    };
    let waves: [_; WAVES] = std::array::from_fn(|_| [vector(), vector(), vector()]);
    let wind = move |body: &RigidBody, dt: Real| {
        let point = body.center_of_mass();
        let mut flow = Vector::ZERO;
        for [along, cosine, sine] in &waves {
            let (sin, cos) = along.dot(point).sin_cos();
            flow += cosine * cos + sine * sin;
        }
        (flow - body.linvel()) * (k * dt)
    };
    let gusts = || Field::turbulence(Turbulence::new(3, 2.0, 6.0)).as_wind(k, 0.0);
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(flying(count)),
        by_hand("by hand", flying(count), wind),
        with("field, kick", flying(count), gusts(), Scheme::Kick),
        with("field, kick-drift-kick", flying(count), gusts(), kdk),
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
        with("field at the centre", world(), centre(), kdk),
        with("field, kick", world(), planet(), Scheme::Kick),
        with("field, kick-drift-kick", world(), planet(), kdk),
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
    let mut world = balls(count);
    let carriers = riders(&world);
    let asked = variant("Rapier's query by hand", move || {
        let (zones, dt) = (&carriers, world.integration_parameters.dt);
        let mut impulses = Vec::new();
        for carrier in zones {
            let zone = world.bodies[*carrier].center_of_mass();
            let reach = Aabb::from_half_extents(zone, Vector::splat(REACH));
            let filter = QueryFilter::default().exclude_rigid_body(*carrier);
            let query = world.broad_phase.as_query_pipeline(
                world.narrow_phase.query_dispatcher(),
                &world.bodies,
                &world.colliders,
                filter,
            );
            let near = query.intersect_aabb_conservative(reach);
            impulses.extend(near.filter_map(|(_, collider)| {
                let handle = collider.parent()?;
                let way = zone - world.bodies[handle].center_of_mass();
                let r2 = way.length_squared();
                (r2 <= REACH * REACH).then(|| (handle, way / (r2 * r2.sqrt()) * dt))
            }));
        }
        for (handle, impulse) in impulses {
            world.bodies[handle].apply_impulse(impulse, true);
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
        asked,
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
    ]
}

/// Balls that all attract each other, in air.
fn attracted(count: usize) -> Vec<Variant> {
    const SOFT: Real = 0.5;
    let mut world = flying(count);
    let looped = variant("double loop by hand", move || {
        let dt = world.integration_parameters.dt;
        let places: Vec<_> = world
            .bodies
            .iter()
            .map(|it| it.1.center_of_mass())
            .collect();
        for (place, (_, body)) in world.bodies.iter_mut().enumerate() {
            let mut force = body.linvel() * -0.1;
            for (other, at) in places.iter().enumerate() {
                let way = *at - places[place];
                let r2 = way.length_squared() + SOFT * SOFT;
                if other != place {
                    force += way * (1e-3 / (r2 * r2.sqrt()));
                }
            }
            body.apply_impulse(force * dt, true);
        }
        world.step();
    });
    let fields = |name, scheme| {
        let world = flying(count);
        let pull = |(body, _)| Field::radial(-1e-3, -2.0).softened(SOFT).at(body);
        let tree = Tree::fold(Operator::SumUnion, world.bodies.iter().map(pull));
        with(name, world, tree + Field::drag(0.1, 0.0), scheme)
    };
    vec![
        alone(flying(count)),
        looped,
        fields("field, kick", Scheme::Kick),
        fields("field, kick-drift-kick", Scheme::KickDriftKick),
        fields("field, auto", Scheme::Auto { tolerance: 0.01 }),
    ]
}

const CUTOFF: Real = 10.0;

/// The boxes of ammonia: how many molecules, and how far apart.
const BOXES: [(&str, usize, Real); 5] = [
    ("liquid, 1,000 molecules", 1_000, 3.6),
    ("liquid, 10,000 molecules", 10_000, 3.6),
    ("gas, 1,000 molecules", 1_000, 20.0),
    ("gas, 10,000 molecules", 10_000, 20.0),
    ("gas, 100,000 molecules", 100_000, 20.0),
];

fn box_of(count: usize, spacing: Real) -> BoxOfAmmonia {
    let settings = AmmoniaSettings {
        count,
        spacing,
        ..AmmoniaSettings::default()
    };
    settings.build().expect("the settings are in range")
}

fn fields_of(scene: &BoxOfAmmonia, scheme: Scheme) -> Fields {
    let tree = interaction(scene.molecules.iter().map(|it| it.sites), Some(CUTOFF));
    let builder = Fields::builder(tree).scheme(scheme);
    scene.fields(builder).expect("the tree fits the scene")
}

/// Writes the boxes of ammonia for another program, one file each: see `lammps.sh`.
fn write_states(folder: &Path) {
    for (name, count, spacing) in BOXES {
        let scene = box_of(count, spacing);
        let file = folder.join(name.replace(' ', "_")).with_extension("data");
        let fields = fields_of(&scene, Scheme::Kick);
        lammps::write(&scene, &fields, &file).expect("a folder that can be written to");
    }
}

/// Molecules of ammonia that act on each other: as fields, and by loops written for them.
fn molecules(which: usize) -> Vec<Variant> {
    let (_, count, spacing) = BOXES[which];
    let scene = || box_of(count, spacing);
    let (mut plain, mut listed, mut wide) = (scene(), scene(), scene());
    let mut loops = CellList::new(&listed, CUTOFF);
    let mut vectors = Vectorised::new(&wide, CUTOFF);
    let fields = |name, scheme| {
        let scene = scene();
        stepped(name, fields_of(&scene, scheme), scene.world)
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

/// A scene, and what is aimed at: how much the fields add at most, over what rivals add, for `Kick` and
/// for the default scheme.
struct Row {
    scene: &'static str,
    stretch: usize,
    variants: fn() -> Vec<Variant>,
    rivals: [&'static str; 2],
    aim: Option<f64>,
}

const ALONE: &str = "Rapier alone";
const BY_HAND: [&str; 2] = ["by hand"; 2];
const LOOP: [&str; 2] = ["double loop by hand"; 2];
const LIST: [&str; 2] = ["cell list by hand"; 2];
const QUERY: [&str; 2] = ["Rapier's query by hand"; 2];
/// The bare kernel, and its list.
const KERNEL: [&str; 2] = ["SIMD for ammonia by hand"; 2];

const fn row(
    scene: &'static str,
    stretch: usize,
    variants: fn() -> Vec<Variant>,
    rivals: [&'static str; 2],
    aim: Option<f64>,
) -> Row {
    Row {
        scene,
        stretch,
        variants,
        rivals,
        aim,
    }
}

const ROWS: [Row; 18] = [
    row(
        "uniform field, 10,000 balls",
        20,
        || uniform(10_000),
        ["impulse loop by hand", "half before, half after by hand"],
        Some(1.1),
    ),
    row(
        "drag, 10,000 balls",
        10,
        || drag(10_000, Vector::ZERO, 0.0),
        BY_HAND,
        Some(2.0),
    ),
    row(
        "quadratic drag, 10,000 balls",
        10,
        || drag(10_000, Vector::ZERO, 0.1),
        BY_HAND,
        Some(2.0),
    ),
    row(
        "wind, 10,000 balls",
        10,
        || drag(10_000, Vector::Y * 2.0, 0.1),
        BY_HAND,
        Some(2.0),
    ),
    row(
        "turbulence as wind, 10,000 balls",
        5,
        || turbulence(10_000),
        BY_HAND,
        None,
    ),
    row(
        "three zones, summed, 10,000 balls",
        20,
        || zones(10_000, false),
        BY_HAND,
        Some(1.0),
    ),
    row(
        "three zones, replacing, 10,000 balls",
        20,
        || zones(10_000, true),
        BY_HAND,
        Some(1.0),
    ),
    row(
        "point gravity, 10,000 boxes",
        10,
        || boxes(10_000),
        [ALONE; 2],
        Some(0.5),
    ),
    row(
        "1,000 moving zones, 10,000 balls",
        5,
        || moving_zones(10_000),
        LOOP,
        Some(0.05),
    ),
    row(
        "1,000 moving zones, 10,000 balls",
        5,
        || moving_zones(10_000),
        QUERY,
        Some(0.33),
    ),
    row(
        "mutual attraction and drag, 2,000 balls",
        3,
        || attracted(2000),
        LOOP,
        None,
    ),
    row(BOXES[0].0, 5, || molecules(0), LIST, None),
    row(BOXES[0].0, 5, || molecules(0), KERNEL, Some(1.6)),
    row(BOXES[1].0, 2, || molecules(1), LIST, None),
    row(BOXES[1].0, 2, || molecules(1), KERNEL, Some(1.6)),
    row(BOXES[2].0, 20, || molecules(2), [ALONE; 2], Some(0.25)),
    row(BOXES[3].0, 3, || molecules(3), [ALONE; 2], Some(0.25)),
    row(BOXES[4].0, 1, || molecules(4), [ALONE; 2], Some(0.25)),
];

impl Row {
    /// As lines of a table of all scenes.
    fn print(&self) {
        let measured = measure(self.stretch, (self.variants)());
        for (scheme, rival) in ["kick", "kick-drift-kick"].into_iter().zip(self.rivals) {
            let variant = format!("field, {scheme}");
            let [low, median, high] = measured.added(&variant, rival);
            let aim = match self.aim {
                Some(aim) if median <= aim => format!("≤ {aim}, met"),
                Some(aim) => format!("≤ {aim}"),
                None => "–".to_owned(),
            };
            let scene = self.scene;
            let error = measured.error(&variant);
            println!(
                "| {scene} | {scheme} | {median:.2} ({low:.2} to {high:.2}) | {rival} | {aim} | {error} |"
            );
        }
    }
}

fn main() {
    let states = std::env::args().find_map(|it| it.strip_prefix("--states=").map(PathBuf::from));
    if let Some(folder) = states {
        write_states(&folder);
    }
    let as_table = std::env::args().any(|argument| argument == "--table");
    if as_table {
        println!(
            "`cargo bench --bench rivals -- --table`: what fields add to Rapier's step over what a rival adds to"
        );
        println!(
            "it, or over the whole step, if that is Rapier alone. Medians and quartiles of {ROUNDS} paired rounds."
        );
        println!(
            "The error is that of forces in the end, by the sum of their terms, at worst of fifty bodies.\n"
        );
        println!(
            "| scene | scheme | ratio | to what is added by | aim | error |\n|---|---|---|---|---|---|"
        );
    }
    for row in ROWS.iter().filter(|row| is_chosen(row.scene)) {
        match as_table {
            true => row.print(),
            false => compare(row.scene, row.stretch, row.variants),
        }
    }
}
