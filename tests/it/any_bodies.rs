//! Random bodies in random smooth fields, under every scheme, against a Runge–Kutta integration in this file: errors
//! fall with the step at least by the scheme's order. Bodies have parts off their origin, a gravity scale, damping,
//! locked axes, a user force and additional solver iterations. They attract each other, with reactions or without.

use rapier3d_fields::math::{DQuat, DVec3, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::{build as fields_of, either, largest, weightless};

/// Number of random worlds of one body, and of two and three.
const CASES: u64 = 40;
const END: f64 = 1.0;
/// Numbers of steps.
const COARSE: usize = 50;
const FINE: usize = 4 * COARSE;

/// The schemes with the order required of them, lower for `Forward4` because forces may read velocities.
pub const SCHEMES: [(Scheme, i32); 6] = [
    (Scheme::KickDriftKick, 2),
    (Scheme::Kick, 1),
    (Scheme::ExternalForce, 1),
    (Scheme::substeps(3), 2),
    (Scheme::LinearlyImplicit, 1),
    (Scheme::Forward4, 2),
];

/// A field that acts at centres of mass.
#[derive(Clone, Copy, Debug)]
enum Law {
    Uniform { vector: DVec3, per_mass: bool },
    Drag { rates: [f64; 2], per_mass: bool },
    Wind { velocity: DVec3, rates: [f64; 2] },
    Spring { stiffness: f64, at: DVec3 },
    Attraction { strength: f64, at: DVec3 },
    Magnetic(DVec3),
}

impl Law {
    fn any(numbers: &mut Numbers) -> Self {
        let per_mass = numbers.one_of(&[true, false]);
        let rates = [numbers.perhaps(0.5) + 0.05, numbers.perhaps(0.4)];
        match numbers.below(6) {
            0 => Law::Uniform {
                vector: numbers.vector() * 2.0,
                per_mass,
            },
            1 => Law::Drag { rates, per_mass },
            2 => Law::Wind {
                velocity: numbers.vector() * 3.0,
                rates,
            },
            3 => Law::Spring {
                stiffness: numbers.next() + 1.5,
                at: numbers.vector(),
            },
            4 => Law::Attraction {
                strength: 2.0,
                at: numbers.vector() * 2.0,
            },
            _ => Law::Magnetic(numbers.vector()),
        }
    }

    fn field(self) -> Field {
        let real = |numbers: [f64; 2]| numbers.map(from_f64);
        let by = |field: Field, per_mass: bool| {
            if per_mass {
                field.force_mode(ForceMode::Acceleration)
            } else {
                field
            }
        };
        let field = match self {
            Law::Uniform { vector, per_mass } => by(Field::uniform(from_dvec3(vector)), per_mass),
            Law::Drag { rates, per_mass } => {
                let [linear, quadratic] = real(rates);
                by(Field::drag(linear, quadratic), per_mass)
            }
            Law::Wind { velocity, rates } => {
                let [linear, quadratic] = real(rates);
                Field::wind(from_dvec3(velocity), linear, quadratic)
            }
            Law::Spring { stiffness, at } => Field::spring(from_f64(stiffness)).at(from_dvec3(at)),
            Law::Attraction { strength, at } => Field::radial(from_f64(-strength), -2.0)
                .softened(1.0)
                .at(from_dvec3(at)),
            Law::Magnetic(field) => Field::magnetic(from_dvec3(field)).coupled_to(Coupling::Share),
        };
        field.sampled(Sampling::Centre)
    }

    fn force(self, state: &State, mass: f64) -> DVec3 {
        let (place, velocity) = (state.place, state.velocity);
        let scale = |per_mass: bool| if per_mass { mass } else { 1.0 };
        let drag = |past: DVec3, [linear, quadratic]: [f64; 2]| {
            past * -(linear + quadratic * past.length())
        };
        match self {
            Law::Uniform { vector, per_mass } => vector * scale(per_mass),
            Law::Drag { rates, per_mass } => drag(velocity, rates) * scale(per_mass),
            Law::Wind {
                velocity: wind,
                rates,
            } => drag(velocity - wind, rates),
            Law::Spring { stiffness, at } => (place - at) * -stiffness,
            Law::Attraction { strength, at } => {
                let way = place - at;
                way * (-strength * (way.length_squared() + 1.0).powf(-1.5))
            }
            Law::Magnetic(field) => velocity.cross(field),
        }
    }
}

/// A spring or an attraction that is anchored to the origin of a body, and acts on the others.
#[derive(Clone, Copy, Debug)]
struct Pull {
    law: Law,
    reacts: bool,
}

#[derive(Debug)]
struct Start {
    shape: usize,
    arm: DVec3,
    gravity_scale: f64,
    damping: [f64; 2],
    locks: LockedAxes,
    force: DVec3,
    more_iterations: usize,
    place: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl Start {
    fn any(numbers: &mut Numbers) -> Self {
        let locks = numbers.one_of(&[
            LockedAxes::empty(),
            LockedAxes::empty(),
            LockedAxes::TRANSLATION_LOCKED_Y,
            LockedAxes::ROTATION_LOCKED,
        ]);
        let (mut velocity, mut spin) = (numbers.vector() * 2.0, numbers.vector() * 2.0);
        if locks.contains(LockedAxes::TRANSLATION_LOCKED_Y) {
            velocity.y = 0.0;
        }
        spin *= numbers.one_of(&[0.0, 1.0]);
        if locks.contains(LockedAxes::ROTATION_LOCKED) {
            spin = DVec3::ZERO;
        }
        Start {
            shape: numbers.below(4),
            arm: numbers.vector() * 0.3,
            gravity_scale: numbers.one_of(&[1.0, 1.0, 0.5, 0.0, -1.0]),
            damping: [numbers.perhaps(1.0), numbers.perhaps(1.0)],
            locks,
            force: numbers.vector() * numbers.one_of(&[0.0, 2.0]),
            more_iterations: numbers.one_of(&[0, 0, 1, 3]),
            place: numbers.vector() * 1.5,
            velocity,
            spin,
        }
    }

    fn insert(&self, world: &mut PhysicsWorld) -> RigidBodyHandle {
        let [linear, angular] = self.damping.map(from_f64);
        let body = RigidBodyBuilder::dynamic()
            .translation(from_dvec3(self.place))
            .linvel(from_dvec3(self.velocity))
            .angvel(from_dvec3(self.spin))
            .linear_damping(linear)
            .angular_damping(angular)
            .gravity_scale(from_f64(self.gravity_scale))
            .locked_axes(self.locks)
            .additional_solver_iterations(self.more_iterations)
            .can_sleep(false);
        let handle = world.insert_body(body);
        let arm = from_dvec3(self.arm);
        let parts = match self.shape {
            0 => vec![ColliderBuilder::ball(0.5)],
            1 => vec![ColliderBuilder::cuboid(0.5, 0.3, 0.4)],
            2 => vec![
                ColliderBuilder::ball(0.4).translation(arm),
                ColliderBuilder::cuboid(0.3, 0.2, 0.5).translation(arm * -2.0),
            ],
            _ => vec![ColliderBuilder::cylinder(0.4, 0.4).translation(arm)],
        };
        for part in parts {
            let part = part.collision_groups(InteractionGroups::none());
            world.insert_collider(part, Some(handle));
        }
        let (bodies, colliders) = (&mut world.bodies, &world.colliders);
        bodies[handle].recompute_mass_properties_from_colliders(colliders);
        bodies[handle].add_force(from_dvec3(self.force), true);
        handle
    }
}

#[derive(Debug)]
struct Case {
    gravity: DVec3,
    bodies: Vec<Start>,
    laws: Vec<Law>,
    /// One for each body, if there are several.
    pulls: Vec<Pull>,
}

impl Case {
    fn any(seed: u64, count: usize) -> Self {
        let numbers = &mut Numbers::new(seed);
        let down = DVec3::new(0.0, -9.81, 0.0);
        let gravity = numbers.one_of(&[DVec3::ZERO, down, DVec3::new(1.0, 2.0, -3.0)]);
        let bodies = (0..count).map(|_| Start::any(numbers)).collect();
        let laws = (0..1 + numbers.below(3)).map(|_| Law::any(numbers));
        let laws = laws.collect();
        let pull = |_| {
            let (strength, at) = (1.5 + numbers.next(), DVec3::ZERO);
            let spring = Law::Spring {
                stiffness: strength,
                at,
            };
            Pull {
                law: numbers.one_of(&[spring, Law::Attraction { strength, at }]),
                reacts: numbers.one_of(&[true, true, false]),
            }
        };
        let pulled = if count > 1 { count } else { 0 };
        Case {
            gravity,
            bodies,
            laws,
            pulls: (0..pulled).map(pull).collect(),
        }
    }

    fn world(&self, dt: f64) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
        let mut world = weightless(from_f64(dt));
        world.gravity = from_dvec3(self.gravity);
        let bodies = self.bodies.iter();
        let handles = bodies.map(|body| body.insert(&mut world)).collect();
        (world, handles)
    }

    fn tree(&self, handles: &[RigidBodyHandle]) -> Tree {
        let pulls = self.pulls.iter().zip(handles).map(|(pull, handle)| {
            let field = pull.law.field().at(*handle);
            if pull.reacts { field.reacting() } else { field }
        });
        let laws = self.laws.iter().map(|law| law.field());
        Tree::fold(Operator::SumUnion, laws.chain(pulls))
    }

    /// The states after some steps with fields.
    fn stepped(&self, scheme: Scheme, steps: usize) -> Vec<State> {
        let (mut world, handles) = self.world(END / steps as f64);
        let mut fields = fields_of(self.tree(&handles), scheme);
        for _ in 0..steps {
            fields.step(&mut world).expect("a finite step");
        }
        let bodies = handles.iter().map(|handle| &world.bodies[*handle]);
        bodies.map(State::of).collect()
    }

    /// The states at the end by the classical Runge–Kutta method with small steps.
    fn exact(&self) -> Vec<State> {
        const STEPS: usize = 3000;
        let (world, handles) = self.world(0.01);
        let bodies = || handles.iter().map(|handle| &world.bodies[*handle]);
        let tops: Vec<_> = bodies().map(Top::of).collect();
        let mut states: Vec<_> = bodies().map(State::of).collect();
        let h = END / STEPS as f64;
        for _ in 0..STEPS {
            let k1 = self.rates(&states, &tops);
            let k2 = self.rates(&plus(&states, &k1, h / 2.0), &tops);
            let k3 = self.rates(&plus(&states, &k2, h / 2.0), &tops);
            let k4 = self.rates(&plus(&states, &k3, h), &tops);
            for (rates, part) in [(k1, 6.0), (k2, 3.0), (k3, 3.0), (k4, 6.0)] {
                states = plus(&states, &rates, h / part);
            }
        }
        states
    }

    fn rates(&self, states: &[State], tops: &[Top]) -> Vec<State> {
        let mut wrenches = vec![(DVec3::ZERO, DVec3::ZERO); states.len()];
        for (number, (state, top)) in states.iter().zip(tops).enumerate() {
            let forces = self.laws.iter().map(|law| law.force(state, top.mass));
            wrenches[number].0 += forces.sum::<DVec3>() + self.bodies[number].force;
        }
        for (carrier, pull) in self.pulls.iter().enumerate() {
            let origin = states[carrier].place - states[carrier].attitude * tops[carrier].local_com;
            for felt in (0..states.len()).filter(|felt| *felt != carrier) {
                let mut relative = states[felt];
                relative.place -= origin;
                let force = pull.law.force(&relative, tops[felt].mass);
                wrenches[felt].0 += force;
                if pull.reacts {
                    let arm = states[felt].place - states[carrier].place;
                    wrenches[carrier].0 -= force;
                    wrenches[carrier].1 -= arm.cross(force);
                }
            }
        }
        let each = states.iter().zip(tops).zip(&self.bodies).zip(wrenches);
        each.map(|(((state, top), body), (force, torque))| {
            let mut acceleration = force / top.mass + self.gravity * body.gravity_scale;
            if body.locks.contains(LockedAxes::TRANSLATION_LOCKED_Y) {
                acceleration.y = 0.0;
            }
            let mut turn = top.angular_acceleration(state, torque);
            if body.locks.contains(LockedAxes::ROTATION_LOCKED) {
                turn = DVec3::ZERO;
            }
            let ([linear, angular], spin) = (body.damping, state.spin);
            State {
                place: state.velocity,
                velocity: acceleration - state.velocity * linear,
                attitude: DQuat::from_xyzw(spin.x, spin.y, spin.z, 0.0) * state.attitude * 0.5,
                spin: turn - spin * angular,
            }
        })
        .collect()
    }
}

/// The mass and the moments of inertia of a body.
struct Top {
    mass: f64,
    local_com: DVec3,
    moments: DVec3,
    axes: DQuat,
}

impl Top {
    fn of(body: &RigidBody) -> Self {
        let local = &body.mass_properties().local_mprops;
        Top {
            mass: to_f64(body.mass()),
            local_com: to_dvec3(body.local_center_of_mass()),
            moments: to_dvec3(local.inv_principal_inertia).recip(),
            axes: quaternion(&local.principal_inertia_local_frame),
        }
    }

    fn angular_acceleration(&self, state: &State, torque: DVec3) -> DVec3 {
        let axes = state.attitude.normalize() * self.axes;
        let (spin, torque) = (axes.inverse() * state.spin, axes.inverse() * torque);
        axes * (((self.moments * spin).cross(spin) + torque) / self.moments)
    }
}

fn quaternion(rotation: &Rotation) -> DQuat {
    let [x, y, z, w] = rotation.to_array().map(to_f64);
    DQuat::from_xyzw(x, y, z, w)
}

/// The motion of a body, or its rate.
#[derive(Clone, Copy)]
struct State {
    /// The centre of mass.
    place: DVec3,
    velocity: DVec3,
    attitude: DQuat,
    spin: DVec3,
}

impl State {
    fn of(body: &RigidBody) -> Self {
        let centre = body.position().transform_point(body.local_center_of_mass());
        State {
            place: to_dvec3(centre),
            velocity: to_dvec3(body.linvel()),
            attitude: quaternion(body.rotation()),
            spin: to_dvec3(body.angvel()),
        }
    }

    fn plus(&self, rate: &State, h: f64) -> Self {
        State {
            place: self.place + rate.place * h,
            velocity: self.velocity + rate.velocity * h,
            attitude: self.attitude + rate.attitude * h,
            spin: self.spin + rate.spin * h,
        }
    }

    /// The differences of places, velocities, attitudes and angular velocities.
    fn errors(&self, exact: &State) -> [f64; 4] {
        let (a, b) = (self.attitude, exact.attitude.normalize());
        [
            self.place.distance(exact.place),
            self.velocity.distance(exact.velocity),
            2.0 * (a - b).length().min((a + b).length()),
            self.spin.distance(exact.spin),
        ]
    }
}

fn plus(states: &[State], rates: &[State], h: f64) -> Vec<State> {
    let each = states.iter().zip(rates);
    each.map(|(state, rate)| state.plus(rate, h)).collect()
}

/// The largest errors among the bodies of a world.
fn errors(states: &[State], exact: &[State]) -> [f64; 4] {
    let each = states.iter().zip(exact);
    let each: Vec<_> = each.map(|(state, exact)| state.errors(exact)).collect();
    [0, 1, 2, 3].map(|of| largest(each.iter().map(|errors| errors[of])))
}

/// Asserts that errors in worlds of `count` bodies fall with the order of the scheme.
fn check(count: usize) {
    // Errors below this are rounding.
    let rounding = either(5e-4, 1e-6);
    for seed in 0..CASES {
        let case = Case::any(seed, count);
        let exact = case.exact();
        for (scheme, order) in SCHEMES {
            let [coarse, fine] =
                [COARSE, FINE].map(|steps| errors(&case.stepped(scheme, steps), &exact));
            let ratio = (FINE as f64 / COARSE as f64).powi(order);
            for (of, (coarse, fine)) in coarse.into_iter().zip(fine).enumerate() {
                let of = ["place", "velocity", "attitude", "spin"][of];
                assert!(
                    fine <= rounding || fine * 0.5 * ratio <= coarse,
                    "{seed}, {scheme:?}, {of}: {coarse:e}, {fine:e}, {case:#?}"
                );
            }
        }
    }
}

#[test]
fn single_bodies_move_at_the_order_of_the_scheme() {
    check(1);
}

#[test]
fn pairs_move_at_the_order_of_the_scheme() {
    check(2);
}

#[test]
fn triples_move_at_the_order_of_the_scheme() {
    check(3);
}
