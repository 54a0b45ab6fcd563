//! Soft bodies in drag, wind and pools: against closed forms.

use rapier3d_fields::math::{DVec3, Real, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, assert_close, build};

const GRAVITY: f64 = 9.81;
const RATES: [f64; 2] = [60.0, 240.0];
/// Drag rate times time step, k·dt.
const NUMBERS: [f64; 7] = [1e-3, 0.05, 0.33, 3.0, 33.0, 333.0, 1e4];
const SCHEMES: [Scheme; 3] = [Scheme::KickDriftKick, Scheme::Kick, Scheme::auto(1e-3)];

fn world(rate: f64) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::Y * from_f64(-GRAVITY);
    world.integration_parameters.dt = from_f64(rate.recip());
    world
}

fn cloth() -> SoftBodyBuilder {
    let side = 0.5;
    let cloth = SoftBodyBuilder::cloth(Vector::ZERO, Vector::X * side, Vector::Z * side, 3, 3);
    cloth.mass(2.0).can_sleep(false)
}

fn block(mass: Real) -> SoftBodyBuilder {
    let block = SoftBodyBuilder::cuboid(Vector::ZERO, Vector::splat(0.5), 3, 3, 3);
    block.mass(mass).can_sleep(false)
}

fn rope() -> SoftBodyBuilder {
    let rope = SoftBodyBuilder::rope(Vector::ZERO, Vector::X, 5);
    rope.mass(2.0).can_sleep(false).no_surface_collider()
}

/// A soft body of each kind, under each scheme.
fn kinds() -> impl Iterator<Item = (&'static str, SoftBodyBuilder, Scheme)> {
    SCHEMES.into_iter().flat_map(|scheme| {
        let kinds = [
            ("cloth", cloth()),
            ("block", block(500.0)),
            ("rope", rope()),
        ];
        kinds.map(|(kind, builder)| (kind, builder, scheme))
    })
}

/// The rounding of positions within 1 m of the origin in a step: half a last digit in each of four iterations.
fn rounding() -> f64 {
    4.0 * 0.25 * to_f64(Real::EPSILON)
}

/// The mean position and velocity of the particles, by mass.
fn means(world: &PhysicsWorld, handle: SoftBodyHandle) -> [DVec3; 2] {
    let soft = &world.soft_bodies[handle];
    let sum = |of: fn(&SoftBodyParticle) -> Vector| {
        let particles = soft.particles().iter();
        let sum: DVec3 = particles
            .map(|it| to_dvec3(of(it)) * to_f64(it.mass()))
            .sum();
        sum / to_f64(soft.mass())
    };
    [sum(|it| it.position()), sum(|it| it.velocity())]
}

/// A drag of this rate, for bodies of any mass.
fn drag(rate: f64) -> Field {
    Field::drag(from_f64(rate), 0.0).force_mode(ForceMode::Acceleration)
}

/// At k·dt = 33 the drag threw cloth at thousands of metres per second; at less it left out the velocity that gravity
/// adds within the step, and the motion was off by g·dt/2. Expected: v = g/k (1 − exp(−k t)), and the distance that
/// follows, which Rapier's iterations lengthen by half of one.
#[test]
fn soft_bodies_fall_through_drag_as_in_closed_form() {
    for (kind, builder, scheme) in kinds() {
        for (rate, number) in RATES
            .into_iter()
            .flat_map(|rate| NUMBERS.map(|it| (rate, it)))
        {
            let mut world = world(rate);
            let soft = world.insert_soft_body(builder.clone());
            let k = number * rate;
            let mut fields = build(drag(k), scheme);
            let fall = |t: f64| GRAVITY / k * (t + (-k * t).exp_m1() / k);
            for _ in 0..60 {
                fields.step(&mut world).expect("a finite step");
            }
            let [start, _] = means(&world, soft);
            for _ in 0..60 {
                fields.step(&mut world).expect("a finite step");
            }
            let [end, velocity] = means(&world, soft);
            let place = format!("{kind}, {scheme:?}, {rate} Hz, k·dt = {number}");
            let t = 120.0 / rate;
            let due = -GRAVITY / k * -(-k * t).exp_m1();
            assert_close(velocity.y, due, 5e-3 * due.abs(), &place);
            let way = fall(t / 2.0) - fall(t);
            let rounding = 60.0 * rounding();
            assert_close(end.y - start.y, way, 5e-3 * way.abs() + rounding, &place);
        }
    }
}

/// Wind of 5 m/s at k·dt = 33 threw cloth at 6,183 m/s, at 333 at 65,433. Expected: never faster than the wind and the
/// velocity that gravity adds, and u + g/k in the end.
#[test]
fn wind_of_any_strength_carries_soft_bodies_along() {
    for (kind, builder, scheme) in kinds() {
        for (rate, number) in RATES
            .into_iter()
            .flat_map(|rate| NUMBERS.map(|it| (rate, it)))
        {
            let mut world = world(rate);
            let soft = world.insert_soft_body(builder.clone());
            let k = number * rate;
            let wind = Field::wind(Vector::X * 5.0, from_f64(k), 0.0);
            let wind = wind.force_mode(ForceMode::Acceleration);
            let mut fields = build(wind, scheme);
            let place = format!("{kind}, {scheme:?}, {rate} Hz, k·dt = {number}");
            let mut velocity = DVec3::ZERO;
            for _ in 0..120 {
                fields.step(&mut world).expect("a finite step");
                [_, velocity] = means(&world, soft);
                assert_at_most(velocity.x, 5.0 * 1.005, &place);
            }
            let reached = -(-k * 120.0 / rate).exp_m1();
            let due = DVec3::new(5.0, -GRAVITY / k, 0.0) * reached;
            assert_at_most((velocity - due).length(), 5e-3 * due.length(), &place);
        }
    }
}

/// Three soft bodies of different kinds in one wind move as each of them alone, bit for bit.
#[test]
fn soft_bodies_beside_others_move_as_alone() {
    for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
        let wind = Field::wind(Vector::new(5.0, 0.0, 2.0), 40.0, 0.0);
        let moved = |builders: &[SoftBodyBuilder]| -> Vec<[DVec3; 2]> {
            let mut world = world(60.0);
            let insert = |it: &SoftBodyBuilder| world.insert_soft_body(it.clone());
            let softs: Vec<_> = builders.iter().map(insert).collect();
            let mut fields = build(wind.clone(), scheme);
            for _ in 0..30 {
                fields.step(&mut world).expect("a finite step");
            }
            softs.into_iter().map(|it| means(&world, it)).collect()
        };
        let from = Vector::X * 50.0;
        let rope = SoftBodyBuilder::rope(from, from + Vector::X, 5).no_surface_collider();
        let block = SoftBodyBuilder::cuboid(from * 2.0, Vector::splat(0.5), 3, 3, 3);
        let [rope, block] = [rope, block].map(|it| it.mass(2.0).can_sleep(false));
        let all = [cloth(), rope, block];
        let alone: Vec<_> = all
            .iter()
            .map(|it| moved(std::slice::from_ref(it)))
            .collect();
        assert_eq!(moved(&all), alone.concat(), "{scheme:?}");
    }
}

/// Cloth and blocks fell through pools at 98 m/s, as if there were none. Expected: (g/k) (1 − ρ V/m), with the volume
/// of the cells for blocks, and none for cloth.
#[test]
fn soft_bodies_sink_in_pools_at_their_terminal_velocity() {
    for (rate, scheme) in RATES
        .into_iter()
        .flat_map(|rate| SCHEMES.map(|it| (rate, it)))
    {
        for number in [0.1, 1.0, 10.0, 333.0, 1e4] {
            for is_cloth in [true, false] {
                let mut world = world(rate);
                let builder = if is_cloth { cloth() } else { block(2000.0) };
                let soft = world.insert_soft_body(builder);
                let k = number * rate;
                let middle = Vector::Y * 50.0;
                let pool = Vector::splat(100.0);
                let pool = Tree::pool(middle, pool, 1000.0, from_f64(GRAVITY), from_f64(k));
                let mut fields = build(pool, scheme);
                for _ in 0..120 {
                    fields.step(&mut world).expect("a finite step");
                }
                let [start, _] = means(&world, soft);
                for _ in 0..30 {
                    fields.step(&mut world).expect("a finite step");
                }
                let [end, velocity] = means(&world, soft);
                let soft = &world.soft_bodies[soft];
                let lifted = 1000.0 * to_f64(soft.volume()) / to_f64(soft.mass());
                let due = -GRAVITY / k * (1.0 - lifted);
                let place = format!("{scheme:?}, {rate} Hz, k·dt = {number}, cloth: {is_cloth}");
                assert_close(velocity.y, due, 5e-3 * due.abs(), &place);
                let way = due * 30.0 / rate;
                let rounding = 30.0 * rounding();
                assert_close(end.y - start.y, way, 5e-3 * way.abs() + rounding, &place);
                let flat = StepWarning::NoVolume {
                    body: soft.root_body(),
                };
                assert_eq!(fields.warnings().contains(&flat), is_cloth, "{place}");
            }
        }
    }
}

/// Soft bodies displaced nothing. Expected: the weight of the volume that their cells fill or their closed surface
/// encloses, shared out to the particles without loss.
#[test]
fn particles_displace_the_volume_of_their_body() {
    let ball = SoftBodyBuilder::sphere(Vector::ZERO, 0.7, 2);
    for (what, builder) in [("cells", block(500.0)), ("a surface", ball.mass(500.0))] {
        let mut world = world(60.0);
        world.gravity = Vector::ZERO;
        // Far from the origin, where the volume must not be the difference of large numbers.
        let soft = world.insert_soft_body(builder.translated(Vector::X * 50.0));
        let volume = to_f64(world.soft_bodies[soft].rest_volume());
        let far = Field::buoyancy(1000.0, from_f64(GRAVITY)).at(Vector::Y * 100.0);
        let mut fields = build(far, Scheme::Kick);
        fields.step(&mut world).expect("a finite step");
        let [_, velocity] = means(&world, soft);
        let due = 1000.0 * volume * GRAVITY / 500.0 / 60.0;
        assert_close(velocity.y, due, 2e-3 * due, what);
    }
}

/// The block sank. Expected: a block of half the density of the fluid floats half submerged.
#[test]
fn a_light_block_floats() {
    let mut world = world(60.0);
    let soft = world.insert_soft_body(block(500.0).translated(Vector::Y * 0.2));
    let pool = Tree::pool(Vector::ZERO, Vector::splat(10.0), 1000.0, 9.81, 3.0);
    let mut fields = build(pool, Scheme::KickDriftKick);
    for _ in 0..480 {
        fields.step(&mut world).expect("a finite step");
    }
    let [place, velocity] = means(&world, soft);
    // The block is three layers of particles, each a ball, so not exactly half.
    assert_at_most(place.y.abs(), 0.05, "the middle is at the surface");
    assert_at_most(velocity.length(), 0.01, "at rest");
}

/// A particle on a pinned rope hangs at tan θ = k u/g. The load is the mean over the step of the force on a free
/// particle, so a held particle gets less, by k·dt/2.
#[test]
fn a_pinned_particle_hangs_in_the_wind() {
    let (rate, k, speed) = (240.0, 4.0, 2.0);
    let mut world = world(rate);
    let rope = SoftBodyBuilder::rope(Vector::ZERO, Vector::Y * -1.0, 2).mass(2.0);
    let rope = rope.pinned_particles([0]).can_sleep(false);
    let rope = world.insert_soft_body(rope.no_surface_collider());
    let wind = Field::wind(Vector::X * from_f64(speed), from_f64(k), 0.0);
    let mut fields = build(
        wind.force_mode(ForceMode::Acceleration),
        Scheme::KickDriftKick,
    );
    for _ in 0..1200 {
        fields.step(&mut world).expect("a finite step");
    }
    let hangs = to_dvec3(world.soft_bodies[rope].particle_position(1));
    let (found, due) = (hangs.x / -hangs.y, k * speed / GRAVITY);
    assert_close(found, due, due * k / rate, "tan θ");
    assert_eq!(fields.warnings(), [], "less than a hundredth");
}

/// A pinned rope in a wind of constant pull stretches less as k·dt grows: by the share that the warning states.
#[test]
fn a_warning_states_the_force_that_pinned_particles_lack() {
    let rate = 60.0;
    let mut whole = 0.0;
    for x in [0.001, 0.1, 1.0, 10.0] {
        let mut world = world(rate);
        world.gravity = Vector::ZERO;
        let rope = SoftBodyBuilder::rope(Vector::ZERO, Vector::X, 2).mass(2.0);
        let rope = rope.pinned_particles([0]).can_sleep(false);
        let rope = world.insert_soft_body(rope.no_surface_collider());
        let k = x * rate;
        let wind = Field::wind(Vector::X * from_f64(1000.0 / k), from_f64(k), 0.0);
        let mut fields = build(
            wind.force_mode(ForceMode::Acceleration),
            Scheme::KickDriftKick,
        );
        for _ in 0..600 {
            fields.step(&mut world).expect("a finite step");
        }
        let soft = &world.soft_bodies[rope];
        let stretch = to_f64(soft.particle_position(1).x) - 1.0;
        match fields.warnings() {
            [] => whole = stretch,
            [StepWarning::PinnedParticles { body, share }] => {
                assert_eq!(*body, soft.root_body());
                let due = whole * (1.0 - to_f64(*share));
                assert_close(stretch, due, 2e-3 * due, "stretch");
            }
            others => panic!("{others:?}"),
        }
    }
    assert!(whole > 0.01, "no wind: {whole}");
}

/// Drag is added to a user's forces and removed after the step, bit for bit; also after a step that was never finished.
#[test]
fn users_keep_their_forces() {
    let mut world = world(60.0);
    let cloth = world.insert_soft_body(cloth());
    let own = Vector::new(0.1, 0.7, -0.3);
    world.soft_bodies[cloth].add_particle_force(4, own, true);
    let forces = |world: &PhysicsWorld| {
        let particles = world.soft_bodies[cloth].particles().iter();
        particles.map(SoftBodyParticle::force).collect::<Vec<_>>()
    };
    let before = forces(&world);
    let mut fields = build(drag(3.0), Scheme::KickDriftKick);
    fields.step(&mut world).expect("a finite step");
    assert_eq!(forces(&world), before);
    let open = fields.begin(WorldMut::from(&mut world)).expect("a step");
    assert_ne!(forces(&world), before, "drag is a force during the step");
    drop(open);
    let again = fields.begin(WorldMut::from(&mut world));
    assert!(matches!(again, Err(StepError::Unfinished)));
    assert_eq!(forces(&world), before);
}

/// The same where the body is torn within the step: then it has other particles, and some belong to another body.
#[test]
fn users_keep_their_forces_on_torn_bodies() {
    let mut world = world(60.0);
    let rope = SoftBodyBuilder::rope(Vector::ZERO, Vector::X * 8.0, 9).mass(1.0);
    let rope = world.insert_soft_body(rope.can_sleep(false));
    let pulls = [Vector::X, Vector::Y];
    world.soft_bodies[rope].add_particle_force(1, pulls[0], true);
    world.soft_bodies[rope].add_particle_force(7, pulls[1], true);
    let mut fields = build(drag(3.0), Scheme::KickDriftKick);
    let open = fields.begin(WorldMut::from(&mut world)).expect("a step");
    let torn = world.tear_soft_body(rope, &[4], &[]);
    assert!(torn.is_some() && world.soft_bodies.len() == 2, "two ropes");
    fields
        .finish(open, WorldMut::from(&mut world))
        .expect("a step");
    let all = world.soft_bodies.iter();
    let all = all.flat_map(|(_, soft)| soft.particles());
    let mut forces: Vec<_> = all
        .map(|it| it.force())
        .filter(|it| *it != Vector::ZERO)
        .collect();
    forces.sort_by(|a, b| b.x.total_cmp(&a.x));
    assert_eq!(forces, pulls);
}

/// Fields leave soft bodies alone that are disabled.
#[test]
fn disabled_soft_bodies_stay_as_they_are() {
    let pull = Field::uniform(Vector::X).within(Region::ball(30.0));
    for scheme in SCHEMES {
        let mut world = world(60.0);
        let handle = world.insert_soft_body(block(2.0));
        let mut fields = build(pull.clone(), scheme);
        world.soft_bodies[handle].set_enabled(false);
        let before = means(&world, handle);
        for _ in 0..3 {
            let outcome = fields.step(&mut world).expect("a step");
            assert_eq!(outcome.particles, 0, "{scheme:?}");
        }
        assert_eq!(means(&world, handle), before, "{scheme:?}");
    }
}
