//! Bounces by Rapier under schemes that divide a step: Rapier's change of the velocity belongs to the middle of the
//! step, as in kick-drift-kick.

use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, assert_close, build, weightless};

const DT: f64 = 1.0 / 60.0;

/// A ball at rest at x = 1, on a spring to the origin, beside a wall without a field.
struct Spring {
    world: PhysicsWorld,
    fields: Fields,
    ball: RigidBodyHandle,
    omega: f64,
}

/// The load of the spring.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hung {
    Ball,
    /// The ball in a negligible drag.
    Slowed,
}

impl Spring {
    fn new(hung: Hung, scheme: Scheme, restitution: Real, wall: Real, swing: f64) -> Self {
        let mut world = weightless(from_f64(DT));
        let smooth = |it: ColliderBuilder| it.restitution(restitution).friction(0.0);
        let side = ColliderBuilder::new(SharedShape::halfspace(Vector::X));
        world.insert(
            RigidBodyBuilder::fixed().translation(Vector::X * wall),
            smooth(side),
        );
        let body = RigidBodyBuilder::dynamic().translation(Vector::X);
        let ball = smooth(ColliderBuilder::ball(0.2).mass(1.0));
        let (ball, _) = world.insert(body.can_sleep(false), ball);
        let omega = swing / DT;
        let spring = Field::spring(from_f64(omega * omega));
        let slowed = (hung == Hung::Slowed).then(|| Tree::from(Field::drag(1e-6, 0.0)));
        let tree = Tree::fold(
            Operator::SumUnion,
            slowed.into_iter().chain([spring.into()]),
        );
        Spring {
            world,
            fields: build(tree, scheme),
            ball,
            omega,
        }
    }

    /// The energy, divided by that at the start.
    fn energy(&self) -> f64 {
        let body = &self.world.bodies[self.ball];
        let place = to_f64(body.translation().length());
        let speed = to_f64(body.linvel().length());
        place.powi(2) + (speed / self.omega).powi(2)
    }
}

/// The largest energy over that at the start, and whether a step to a new largest one above `told` gave no warning.
fn peak(mut spring: Spring, steps: usize, told: f64) -> (f64, bool) {
    let (mut peak, mut silent) = (0.0_f64, false);
    for _ in 0..steps {
        spring.fields.step(&mut spring.world).expect("a step");
        let energy = spring.energy();
        silent |= energy > told.max(peak) && spring.fields.warnings().is_empty();
        // Not `max`, which ignores NaN.
        peak = if energy <= peak { peak } else { energy };
    }
    (peak, silent)
}

/// Regression: with the change added to the velocity at the end of the step, the energy of a ball that hits a wall at
/// dt·ω = 0.2 grew 5.6 times under `Auto` and 4.9 times under a scheme of fourth order, and at a restitution of 0.8
/// without bound from dt·ω = 1 on, without a warning.
#[test]
fn bounces_in_divided_steps_add_no_energy() {
    let auto = Scheme::auto(1e-3);
    let fixed = Scheme::substeps(4);
    let chosen = Scheme::Substep(Substeps::PerBody { tolerance: 1e-3 });
    for scheme in [auto, Scheme::Forward4, fixed, chosen] {
        for (restitution, wall) in [1.0, 0.8]
            .into_iter()
            .flat_map(|e| [-0.7, -0.2, -1.1].map(|wall| (e, wall)))
        {
            for swing in [0.1, 0.2, 0.3, 0.4, 0.58, 0.8, 1.0, 1.3, 1.5] {
                let spring = Spring::new(Hung::Ball, scheme, restitution, wall, swing);
                let (peak, silent) = peak(spring, 1200, 1.02);
                let what = format!("{scheme:?}, e = {restitution}, wall at {wall}, dt·ω {swing}");
                assert_at_most(peak, 1.02, format_args!("{what}"));
                assert!(!silent, "{what}");
            }
        }
    }
}

/// After a bounce the velocity is that of the middle of the step, and half a kick at the new position follows:
/// v = v_out + dt/2 F(x_out)/m. As for all bodies in contact, the shown velocity lags by half a solver iteration.
#[test]
fn half_a_kick_follows_a_bounce() {
    let fixed = Scheme::substeps(4);
    for scheme in [Scheme::auto(1e-3), Scheme::Forward4, fixed] {
        for (restitution, wall, swing) in [(1.0, -0.7, 0.3), (0.8, -0.2, 1.0), (1.0, -0.2, 0.58)] {
            let what = format!("{scheme:?}, e = {restitution}, wall at {wall}, dt·ω {swing}");
            let mut spring = Spring::new(Hung::Ball, scheme, restitution, wall, swing);
            let (ball, world) = (spring.ball, &mut spring.world);
            let mut bounces = 0;
            for _ in 0..60 {
                let open = spring.fields.begin(WorldMut::from(&mut *world));
                let open = open.expect("a step");
                let given = world.bodies[ball].linvel();
                world.step();
                let out = world.bodies[ball].linvel();
                let place = world.bodies[ball].translation();
                let finished = spring.fields.finish(open, WorldMut::from(&mut *world));
                finished.expect("a step");
                if given.x >= 0.0 || out.x <= 0.0 {
                    continue;
                }
                bounces += 1;
                let lag = (world.integration_parameters.num_solver_iterations as f64).recip();
                let push = 0.5 * DT * (1.0 - lag) * spring.omega.powi(2) * to_f64(place.x);
                let due = to_f64(out.x) - push;
                let found = to_f64(world.bodies[ball].linvel().x);
                let size = to_f64(out.x) + push.abs();
                assert_close(found, due, 1e-6 * size, format_args!("{what}"));
            }
            assert!(bounces > 0, "{what}");
        }
    }
}

/// Where forces read velocities, `Forward4` is a composition that is unstable from dt·ω = 2.72 on, and warns from half
/// of that on; it warned from half of 3.46 on. Its energy oscillates by 2.7 % at dt·ω = 1.3.
#[test]
fn bounces_under_forward4_in_drag_add_no_energy() {
    for wall in [-0.7, -0.2, -1.1] {
        for swing in [0.1, 0.3, 0.58, 1.0, 1.3, 1.5, 1.7] {
            let spring = Spring::new(Hung::Slowed, Scheme::Forward4, 1.0, wall, swing);
            let (peak, silent) = peak(spring, 1200, 1.03);
            let what = format!("wall at {wall}, dt·ω {swing}");
            let most = if swing < 1.36 { 1.03 } else { 1.2 };
            assert_at_most(peak, most, format_args!("{what}"));
            assert!(!silent, "{what}");
        }
    }
}
