//! Orders of convergence under the world's gravity, linear and angular damping, over three halvings of the step,
//! against a Runge-Kutta integrator in this file at steps so fine that its own error does not count.

use rapier3d_fields::math::{DQuat, DVec3};
use rapier3d_fields::prelude::*;

use crate::support::runge_kutta::{self, State};
use crate::support::{assert_order, build, weightless};

const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);
const LINEAR_DAMPING: f64 = 0.3;
const ANGULAR_DAMPING: f64 = 0.4;

/// A nominal order, and how close to it every measured one must come.
const SECOND: (f64, f64) = (2.0, 0.05);
const FOURTH: (f64, f64) = (4.0, 0.1);

/// A rigid body at the start, its axes those of the world.
struct Top {
    mass: f64,
    moments: DVec3,
    place: DVec3,
    velocity: DVec3,
    spin: DVec3,
    /// Where forces act on it, in its axes, and with which charge.
    sites: Vec<(DVec3, f64)>,
}

impl Top {
    /// A body that forces do not turn, because its only site is its centre.
    fn point(mass: f64, place: DVec3, velocity: DVec3) -> Self {
        Top {
            mass,
            moments: DVec3::splat(0.4 * mass),
            place,
            velocity,
            spin: DVec3::ZERO,
            sites: vec![(DVec3::ZERO, 1.0)],
        }
    }
}

/// A site at a moment of the motion.
#[derive(Clone, Copy)]
struct Site {
    body: usize,
    place: DVec3,
    velocity: DVec3,
    charge: f64,
}

/// The fields, given the colliders at the sites.
type MakeTree = Box<dyn Fn(&[ColliderHandle]) -> Tree>;

/// The forces on sites.
type Forces = Box<dyn Fn(&[Site]) -> Vec<DVec3>>;

/// A motion: the bodies, the fields given the colliders at their sites, and the same forces by hand.
struct Case {
    bodies: Vec<Top>,
    tree: MakeTree,
    forces: Forces,
    end: f64,
}

/// The angular velocity in a state.
fn spin(state: &State, moments: DVec3) -> DVec3 {
    state.attitude * ((state.attitude.inverse() * state.momentum) / moments)
}

impl Case {
    fn sites(&self, states: &[State]) -> Vec<Site> {
        let of_one = |(body, (top, state)): (usize, (&Top, &State))| {
            let spin = spin(state, top.moments);
            let site = |(arm, charge): &(DVec3, f64)| {
                let arm = state.attitude * *arm;
                Site {
                    body,
                    place: state.place + arm,
                    velocity: state.velocity + spin.cross(arm),
                    charge: *charge,
                }
            };
            top.sites.iter().map(site).collect::<Vec<_>>()
        };
        let all = self.bodies.iter().zip(states).enumerate();
        all.flat_map(of_one).collect()
    }

    /// Newton's and Euler's equations.
    fn rates(&self, states: &[State]) -> Vec<State> {
        let sites = self.sites(states);
        let forces = (self.forces)(&sites);
        let of_one = |(body, (top, state)): (usize, (&Top, &State))| {
            let own = sites.iter().zip(&forces).filter(|(it, _)| it.body == body);
            let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
            for (site, push) in own {
                force += *push;
                torque += (site.place - state.place).cross(*push);
            }
            let spin = spin(state, top.moments);
            State {
                place: state.velocity,
                attitude: state.turning(spin),
                velocity: force / top.mass + GRAVITY - state.velocity * LINEAR_DAMPING,
                momentum: torque - state.momentum * ANGULAR_DAMPING,
            }
        };
        let all = self.bodies.iter().zip(states).enumerate();
        all.map(of_one).collect()
    }

    fn starts(&self) -> Vec<State> {
        let start = |top: &Top| State {
            place: top.place,
            attitude: DQuat::IDENTITY,
            velocity: top.velocity,
            momentum: top.moments * top.spin,
        };
        self.bodies.iter().map(start).collect()
    }

    /// The states at the end, by a number of Runge-Kutta steps.
    fn by_hand(&self, steps: u32) -> Vec<State> {
        let mut states = self.starts();
        for _ in 0..steps {
            let h = self.end / f64::from(steps);
            runge_kutta::step(&mut states, 0.0, h, |states, _| self.rates(states));
        }
        states
    }

    /// The states at the end, as exactly as 64 bits allow, and a bound of their error.
    fn exact(&self) -> (Vec<State>, f64) {
        let [coarse, fine] = [10_000, 20_000].map(|steps| self.by_hand(steps));
        let doubt = self.distance(&coarse, &fine) / 15.0;
        (fine, doubt)
    }

    /// The states at the end, by the fields.
    fn by_fields(&self, scheme: Scheme, steps: u32) -> Vec<State> {
        let mut world = weightless(self.end / f64::from(steps));
        world.gravity = GRAVITY;
        world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
        world.integration_parameters.max_ccd_substeps = 0;
        let mut sites = Vec::new();
        let bodies = self
            .bodies
            .iter()
            .map(|top| insert(&mut world, top, &mut sites));
        let bodies: Vec<RigidBodyHandle> = bodies.collect();
        let colliders: Vec<ColliderHandle> = sites.iter().map(|site| site.0).collect();
        let mut fields = build((self.tree)(&colliders), scheme);
        for (collider, charge) in sites {
            let charge = ColliderProperties::new().charge(charge);
            let set = fields.set_properties(collider, charge, &world.colliders);
            set.expect("a collider of the world");
        }
        for _ in 0..steps {
            fields.step(&mut world).expect("a finite step");
        }
        let all = bodies.iter().zip(&self.bodies);
        all.map(|(body, top)| seen(&world.bodies[*body], top))
            .collect()
    }

    /// The sum of the differences of places, attitudes, velocities and angular velocities.
    fn distance(&self, ours: &[State], theirs: &[State]) -> f64 {
        let all = self.bodies.iter().zip(ours.iter().zip(theirs));
        let off = all.map(|(top, (a, b))| a.distance(b, [a, b].map(|it| spin(it, top.moments))));
        off.sum()
    }

    fn check(&self, what: &str, plans: &[(Scheme, (f64, f64), u32)]) {
        let (exact, doubt) = self.exact();
        for (scheme, (order, band), first) in plans {
            let errors = [1, 2, 4, 8].map(|fold| {
                let end = self.by_fields(*scheme, first * fold);
                self.distance(&end, &exact)
            });
            assert!(
                doubt < 0.02 * errors[3],
                "{what}: {doubt:e} of {}",
                errors[3]
            );
            assert_order(&errors, *order, *band, &format!("{what}, {scheme:?}"));
        }
    }
}

fn insert(
    world: &mut PhysicsWorld,
    top: &Top,
    sites: &mut Vec<(ColliderHandle, f64)>,
) -> RigidBodyHandle {
    let properties = MassProperties::new(Vector::ZERO, top.mass, top.moments);
    let body = RigidBodyBuilder::dynamic()
        .translation(top.place)
        .linvel(top.velocity)
        .angvel(top.spin)
        .additional_mass_properties(properties)
        .linear_damping(LINEAR_DAMPING)
        .angular_damping(ANGULAR_DAMPING)
        .allow_fast_rotation(true)
        .can_sleep(false);
    let body = world.bodies.insert(body);
    for (arm, charge) in &top.sites {
        let site = ColliderBuilder::ball(0.01).density(0.0).translation(*arm);
        let site = site.collision_groups(InteractionGroups::none());
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        sites.push((colliders.insert_with_parent(site, body, bodies), *charge));
    }
    body
}

/// The state of a body of Rapier's.
fn seen(body: &RigidBody, top: &Top) -> State {
    let attitude = *body.rotation();
    let spin = attitude.inverse() * body.angvel();
    State {
        place: body.translation(),
        attitude,
        velocity: body.linvel(),
        momentum: attitude * (top.moments * spin),
    }
}

const KDK: Scheme = Scheme::KickDriftKick;
const SUBSTEP: Scheme = Scheme::substeps(3);
const FORWARD: Scheme = Scheme::Forward4;
/// So loose that one whole step meets the tolerance.
const PER_BODY: Scheme = Scheme::Substep(Substeps::PerBody { tolerance: 0.25 });
const AUTO: Scheme = Scheme::auto(0.25);

/// The schemes of second and fourth order: `whole` steps for those of whole steps, `divided` for those of substeps.
fn plans(whole: u32, divided: u32) -> [(Scheme, (f64, f64), u32); 5] {
    [
        (KDK, SECOND, whole),
        (PER_BODY, SECOND, whole),
        (AUTO, SECOND, whole),
        (SUBSTEP, SECOND, divided),
        (FORWARD, FOURTH, divided),
    ]
}

/// The same law for the force on every site.
fn each(force: impl Fn(&Site) -> DVec3 + 'static) -> Forces {
    Box::new(move |sites| sites.iter().map(&force).collect())
}

/// A field that acts in full on every site.
fn whole(field: Field) -> Field {
    field.coupled_to(Coupling::Each)
}

#[test]
fn spring() {
    let case = Case {
        bodies: vec![Top::point(2.0, DVec3::X, DVec3::new(0.5, 1.0, 2.0))],
        tree: Box::new(|_| whole(Field::spring(60.0)).into()),
        forces: each(|site| site.place * -60.0),
        end: 1.3,
    };
    case.check("spring", &plans(80, 40));
    // So strict that `Auto` makes steps of fourth order, whatever the step.
    let composing = Scheme::auto(1e-6);
    case.check("spring", &[(composing, FOURTH, 80)]);
}

#[test]
fn kepler() {
    let case = Case {
        bodies: vec![Top::point(1.5, DVec3::X, DVec3::new(0.0, 2.0, 5.5))],
        tree: Box::new(|_| whole(Field::radial(-60.0, -2.0)).into()),
        forces: each(|site| site.place * (-60.0 * site.place.length().powi(-3))),
        end: 1.0,
    };
    case.check("Kepler", &plans(400, 200));
}

#[test]
fn drag() {
    let start = DVec3::new(3.0, 4.0, -1.0);
    for (linear, quadratic) in [(2.0, 0.0), (0.0, 0.7), (1.0, 0.3)] {
        falls_in_drag(start, (linear, quadratic));
    }
}

/// The drag is zero at the start only, when the body is at rest.
#[test]
fn drag_from_rest() {
    falls_in_drag(DVec3::ZERO, (2.0, 0.0));
}

fn falls_in_drag(velocity: DVec3, (linear, quadratic): (f64, f64)) {
    let case = Case {
        bodies: vec![Top::point(0.5, DVec3::ZERO, velocity)],
        tree: Box::new(move |_| whole(Field::drag(linear, quadratic)).into()),
        forces: each(move |site| site.velocity * -(linear + quadratic * site.velocity.length())),
        end: 1.0,
    };
    // At the coarsest step a kick changes the force by less than a tenth; beyond that, the force is evaluated again.
    let name = format!("drag {linear}, {quadratic} from {velocity}");
    case.check(&name, &plans(240, 40));
}

#[test]
fn helix() {
    let magnetic = DVec3::new(1.0, 3.0, 6.0);
    for electric in [DVec3::ZERO, DVec3::new(4.0, -2.0, 1.0)] {
        let case = Case {
            bodies: vec![Top::point(0.7, DVec3::ZERO, DVec3::new(1.0, -0.5, 2.0))],
            tree: Box::new(move |_| {
                let push = Field::uniform(electric).coupled_to_axis(Axis::Charge);
                Field::magnetic(magnetic).sum_union(push)
            }),
            forces: each(move |site| (site.velocity.cross(magnetic) + electric) * site.charge),
            end: 1.5,
        };
        case.check(&format!("helix, E = {electric}"), &plans(160, 80));
    }
}

/// A force at the centre does not turn the body, but damping and its free rotation do act.
#[test]
fn spinning_in_a_spring() {
    let case = Case {
        bodies: vec![Top {
            sites: vec![(DVec3::ZERO, 1.0)],
            ..dipole(DVec3::new(3.0, 1.0, -2.0))
        }],
        tree: Box::new(|_| whole(Field::spring(30.0)).into()),
        forces: each(|site| site.place * -30.0),
        end: 1.0,
    };
    case.check("spinning in a spring", &plans(80, 40));
}

/// The same for a ball, and for a force that is the same everywhere.
#[test]
fn spinning_without_torque() {
    let spin = DVec3::new(3.0, 1.0, -2.0);
    let ball = |moments| Top {
        moments,
        spin,
        ..Top::point(2.0, DVec3::X, DVec3::Y)
    };
    let force = DVec3::new(3.0, -1.0, 2.0);
    for moments in [DVec3::splat(0.7), DVec3::new(0.9, 0.5, 1.2)] {
        let spring = Case {
            bodies: vec![ball(moments)],
            tree: Box::new(|_| whole(Field::spring(30.0)).into()),
            forces: each(|site| site.place * -30.0),
            end: 1.0,
        };
        spring.check(&format!("in a spring, {moments}"), &plans(80, 40));
        let wind = Case {
            bodies: vec![ball(moments)],
            tree: Box::new(move |_| whole(Field::uniform(force)).into()),
            forces: each(move |_| force),
            end: 1.0,
        };
        wind.check(&format!("in a wind, {moments}"), &plans(20, 4));
    }
}

/// A top with charges at its ends.
fn dipole(spin: DVec3) -> Top {
    Top {
        mass: 1.3,
        moments: DVec3::new(0.9, 0.5, 1.2),
        place: DVec3::new(0.2, 0.1, -0.3),
        velocity: DVec3::new(0.3, 1.0, 0.2),
        spin,
        sites: vec![
            (DVec3::new(0.8, 0.1, 0.0), 2.0),
            (DVec3::new(-0.6, 0.0, 0.2), -2.0),
        ],
    }
}

#[test]
fn dipole_pendulum() {
    let field = DVec3::new(2.0, 5.0, -1.0);
    let case = Case {
        bodies: vec![dipole(DVec3::ZERO)],
        tree: Box::new(move |_| Field::uniform(field).coupled_to_axis(Axis::Charge).into()),
        forces: each(move |site| field * site.charge),
        end: 1.5,
    };
    case.check("dipole pendulum", &plans(80, 40));
}

/// A body that hangs on a spring at one of its ends.
#[test]
fn swinging_body() {
    let case = Case {
        bodies: vec![Top {
            sites: vec![(DVec3::new(0.8, 0.1, 0.3), 1.0)],
            ..dipole(DVec3::new(0.3, -0.5, 0.2))
        }],
        tree: Box::new(|_| whole(Field::spring(20.0)).at(Vector::Y).into()),
        forces: each(|site| (site.place - DVec3::Y) * -20.0),
        end: 1.5,
    };
    case.check("swinging body", &plans(100, 50));
}

/// Fast tops, in a field that turns them and with drag at their ends.
#[test]
fn tops() {
    for spin in [
        DVec3::new(6.0, 1.0, 0.5),
        DVec3::new(0.1, 0.2, 9.0),
        DVec3::new(5.0, 0.01, 0.0),
    ] {
        let field = DVec3::new(1.0, 2.0, 0.5);
        let case = Case {
            bodies: vec![dipole(spin)],
            tree: Box::new(move |_| {
                let push = Field::uniform(field).coupled_to_axis(Axis::Charge);
                whole(Field::drag(0.2, 0.05)).sum_union(push)
            }),
            forces: each(move |site| {
                let drag = site.velocity * -(0.2 + 0.05 * site.velocity.length());
                field * site.charge + drag
            }),
            end: 1.0,
        };
        case.check(&format!("top, spin {spin}"), &plans(100, 50));
    }
}

/// The forces between sites of different bodies: the vector between two sites times `law`.
fn between(law: impl Fn(&Site, &Site, f64) -> f64 + 'static) -> Forces {
    Box::new(move |sites| {
        let push = |site: &Site| {
            let others = sites.iter().filter(|other| other.body != site.body);
            let pushes = others.map(|other| {
                let way = site.place - other.place;
                way * law(site, other, way.length())
            });
            pushes.sum()
        };
        sites.iter().map(push).collect()
    })
}

/// Two bodies that orbit each other.
fn two(masses: [f64; 2], distance: f64, speed: f64) -> Vec<Top> {
    let half = DVec3::X * (0.5 * distance);
    let aside = DVec3::new(0.0, 0.8, 0.6) * speed;
    let middle = DVec3::new(0.3, 2.0, -0.4);
    vec![
        Top::point(masses[0], middle + half, aside),
        Top::point(masses[1], middle - half, aside * (-masses[0] / masses[1])),
    ]
}

/// One body attracts the other, and the reaction acts on it.
#[test]
fn attracting_dimer() {
    let case = Case {
        bodies: two([1.0, 3.0], 1.0, 4.0),
        tree: Box::new(|sites| {
            let pull = whole(Field::radial(-30.0, -2.0));
            pull.reacting().at(sites[0]).into()
        }),
        forces: between(|_, _, r| -30.0 * r.powi(-3)),
        end: 1.0,
    };
    case.check("attracting dimer", &plans(400, 200));
}

fn lennard_jones(epsilon: f64, r: f64) -> f64 {
    24.0 * epsilon * (2.0 * r.powi(-12) - r.powi(-6)) * r.powi(-2)
}

#[test]
fn lennard_jones_dimer() {
    let fields: [fn(&[ColliderHandle]) -> Tree; 2] = [
        |sites| {
            let law = Field::lennard_jones(3.0, 1.0);
            law.reacting().at(sites[0]).into()
        },
        |sites| {
            let law = |site: &ColliderHandle| Field::lennard_jones(3.0, 1.0).at(*site);
            Tree::fold(Operator::SumUnion, sites.iter().map(law))
        },
    ];
    for (name, tree) in ["reacting", "mutual"].into_iter().zip(fields) {
        let case = Case {
            bodies: two([1.0, 2.0], 1.2, 0.7),
            tree: Box::new(tree),
            forces: between(|_, _, r| lennard_jones(3.0, r)),
            end: 0.8,
        };
        case.check(&format!("Lennard-Jones dimer, {name}"), &plans(160, 80));
    }
}

/// Two charged bodies that turn each other.
#[test]
fn turning_dimer() {
    let mut bodies = two([1.3, 1.3], 2.6, 1.0);
    for (body, spin) in bodies
        .iter_mut()
        .zip([DVec3::Y, DVec3::new(1.0, 2.0, -0.5)])
    {
        let like = dipole(spin);
        (body.moments, body.spin, body.sites) = (like.moments * 0.3, spin, like.sites);
    }
    let charges: Vec<f64> = bodies
        .iter()
        .flat_map(|top| top.sites.iter().map(|it| it.1))
        .collect();
    let case = Case {
        bodies,
        tree: Box::new(move |sites| {
            let all = sites
                .iter()
                .zip(charges.clone())
                .flat_map(|(site, charge)| {
                    let electric = Field::coulomb(1.5, charge).at(*site);
                    [electric, Field::lennard_jones(1.0, 1.0).at(*site)]
                });
            Tree::fold(Operator::SumUnion, all)
        }),
        forces: between(|a, b, r| 1.5 * a.charge * b.charge * r.powi(-3) + lennard_jones(1.0, r)),
        end: 1.0,
    };
    case.check("turning dimer", &plans(200, 100));
}
