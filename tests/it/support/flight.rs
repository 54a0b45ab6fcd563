//! Exact free flight of bodies made of balls: an independent oracle, in `f64`.

use rapier3d_fields::math::{DQuat, DVec3, Real, from_dvec3, from_f64, to_dpose3, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::collide::{Thing, insert};
use crate::support::{Row, Table};

/// A body in free flight, at one moment. Its frame is principal, its origin the centre of mass.
#[derive(Clone, Debug)]
pub struct Flight {
    pub mass: f64,
    pub inertia: DVec3,
    pub spheres: Vec<(DVec3, f64)>,
    pub position: DVec3,
    pub velocity: DVec3,
    pub rotation: DQuat,
    /// The angular momentum, in the world's frame.
    pub momentum: DVec3,
}

impl Flight {
    /// The angular velocity in the world's frame.
    pub fn angvel(&self) -> DVec3 {
        angvel(self.rotation, self.momentum, self.inertia)
    }

    /// The state after a time, by small Runge–Kutta steps.
    pub fn after(&self, time: f64) -> Flight {
        let mut rotation = self.rotation;
        let turn = self.angvel().length() * time.abs() * 2.0;
        if turn > 0.0 {
            let steps = (turn / 0.004).ceil().max(1.0) as usize;
            for _ in 0..steps {
                rotation = self.turned(rotation, time / steps as f64);
            }
        }
        Flight {
            position: self.position + self.velocity * time,
            rotation,
            ..self.clone()
        }
    }

    fn turned(&self, q: DQuat, h: f64) -> DQuat {
        let rate = |q: DQuat| {
            let w = angvel(q.normalize(), self.momentum, self.inertia) * 0.5;
            DQuat::from_xyzw(w.x, w.y, w.z, 0.0) * q
        };
        let k1 = rate(q);
        let k2 = rate(q + k1 * (h * 0.5));
        let k3 = rate(q + k2 * (h * 0.5));
        let k4 = rate(q + k3 * h);
        (q + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0)).normalize()
    }

    pub fn centre(&self, sphere: usize) -> DVec3 {
        self.position + self.rotation * self.spheres[sphere].0
    }
}

fn angvel(rotation: DQuat, momentum: DVec3, inertia: DVec3) -> DVec3 {
    rotation * ((rotation.inverse() * momentum) / inertia)
}

/// The nearest spheres of two bodies.
pub struct Nearest {
    pub gap: f64,
    pub normal: DVec3,
    pub point: DVec3,
    pub radii: f64,
}

pub fn nearest(flights: &[Flight; 2]) -> Nearest {
    let [a, b] = flights;
    let pairs = (0..a.spheres.len()).flat_map(|i| (0..b.spheres.len()).map(move |j| (i, j)));
    let of = |(i, j): (usize, usize)| {
        let (from, to) = (a.centre(i), b.centre(j));
        let radii = a.spheres[i].1 + b.spheres[j].1;
        let normal = (to - from).normalize();
        Nearest {
            gap: (to - from).length() - radii,
            normal,
            point: from + normal * a.spheres[i].1,
            radii,
        }
    };
    pairs
        .map(of)
        .min_by(|a, b| a.gap.total_cmp(&b.gap))
        .expect("spheres")
}

/// The deepest overlap in a time, sampled; zero if there is none.
pub fn deepest_before(flights: &[Flight; 2], time: f64) -> f64 {
    let samples = 400;
    let step = time / samples as f64;
    let mut now = flights.clone();
    let mut deepest: f64 = 0.0;
    for _ in 0..samples {
        deepest = deepest.max(-nearest(&now).gap);
        now = now.map(|flight| flight.after(step));
    }
    deepest
}

/// The exact answer to a frictionless impact.
pub struct Impact {
    pub approach: f64,
    pub impulse: f64,
    normal: DVec3,
    point: DVec3,
}

impl Impact {
    pub fn of(flights: &[Flight; 2], at: &Nearest, restitution: f64) -> Self {
        let [a, b] = flights.each_ref().map(|f| {
            let arm = at.point - f.position;
            let lever = arm.cross(at.normal);
            let turned = angvel(f.rotation, lever, f.inertia).dot(lever);
            (f.velocity + f.angvel().cross(arm), f.mass.recip() + turned)
        });
        let approach = (b.0 - a.0).dot(at.normal);
        Impact {
            approach,
            impulse: -(1.0 + restitution) * approach / (a.1 + b.1),
            normal: at.normal,
            point: at.point,
        }
    }

    /// The largest speed of a sphere's centre before or after the impact.
    pub fn speed_scale(&self, flights: &[Flight; 2]) -> f64 {
        let speed = |which: usize, impulse: DVec3| {
            let f = &flights[which];
            let sign = if which == 0 { -1.0 } else { 1.0 };
            let twist = (self.point - f.position).cross(impulse * sign);
            let w = angvel(f.rotation, f.momentum + twist, f.inertia);
            let far = f.spheres.iter().map(|s| s.0.length()).fold(0.0, f64::max);
            (f.velocity + impulse * (sign / f.mass)).length() + w.length() * far
        };
        let after = self.normal * self.impulse;
        let speeds = [0, 1].map(|i| speed(i, DVec3::ZERO).max(speed(i, after)));
        speeds[0].max(speeds[1])
    }

    /// The largest error of a velocity due to an error of the impulse.
    pub fn velocity_error(&self, flights: &[Flight; 2], off: DVec3) -> f64 {
        let of = |f: &Flight| {
            let twist = (self.point - f.position).cross(off);
            let w = angvel(f.rotation, twist, f.inertia);
            let far = f.spheres.iter().map(|s| s.0.length()).fold(0.0, f64::max);
            off.length() / f.mass + w.length() * far
        };
        of(&flights[0]).max(of(&flights[1]))
    }
}

/// A case of a table: two bodies that may meet.
#[cfg_attr(
    feature = "f32",
    allow(dead_code, reason = "answers are compared in f64 only")
)]
pub struct Case {
    pub number: usize,
    pub kind: usize,
    pub flights: [Flight; 2],
    pub restitution: f64,
    pub hit: bool,
    pub toi: f64,
    pub normal: DVec3,
    pub approach: f64,
    pub impulse: f64,
    /// Velocities after the impact.
    pub after: [DVec3; 2],
    /// The end of the time that was searched for a hit.
    pub end: f64,
    /// The least gap of a miss.
    pub gap: f64,
    pub size: f64,
}

pub fn spheres() -> Vec<Case> {
    let kinds = [
        "headon",
        "random",
        "graze",
        "mass_ratio",
        "bullet",
        "near_miss",
        "miss",
        "receding",
        "rest",
    ];
    let mut text = include_str!("../../data/f_collisions/spheres.csv").to_owned();
    for (kind, name) in kinds.iter().enumerate().rev() {
        text = text.replace(&format!(",{name},"), &format!(",{},", kind + 6));
    }
    let table = Table::parse(Box::leak(text.into_boxed_str()));
    let case = |row: Row<'_>| {
        let flight = |which: &str| {
            let (mass, radius) = (
                row.number(&format!("m{which}")),
                row.number(&format!("r{which}")),
            );
            Flight {
                mass,
                inertia: DVec3::splat(0.4 * mass * radius * radius),
                spheres: vec![(DVec3::ZERO, radius)],
                position: row.vector("", which),
                velocity: row.vector("v", which),
                rotation: DQuat::IDENTITY,
                momentum: DVec3::ZERO,
            }
        };
        let hit = row.number("hit") == 1.0;
        let tca = row.number("tca");
        Case {
            number: row.number("i") as usize,
            kind: row.number("kind") as usize,
            flights: [flight("1"), flight("2")],
            restitution: row.number("e"),
            hit,
            toi: row.number("toi"),
            normal: row.vector("n", ""),
            approach: row.number("vn"),
            impulse: row.number("J"),
            after: [row.vector("v1p", ""), row.vector("v2p", "")],
            end: if tca.is_finite() {
                (tca * 1.2).min(10.0) + 0.05
            } else {
                1.0
            },
            gap: row.number("min_gap"),
            size: row.number("r1") + row.number("r2"),
        }
    };
    table.rows().map(case).collect()
}

pub fn molecules() -> Vec<Case> {
    let table = Table::parse(include_str!("../../data/f_collisions/molecules.csv"));
    let bodies = Table::parse(include_str!("../../data/f_collisions/bodies.csv"));
    let body = |number: f64| {
        bodies
            .rows()
            .find(|b| b.number("i") == number)
            .expect("a body")
    };
    let case = |row: Row<'_>| {
        let number = row.number("i");
        let flight = |which: &str, number: f64| {
            let shape = body(number);
            let rotation = row.rotation(which);
            let inertia = shape.vector("I", "");
            let spin = row.vector("w", which);
            let sphere = |k: usize| {
                let name = k.to_string();
                (shape.vector("", &name), shape.number(&format!("r{k}")))
            };
            Flight {
                mass: shape.number("m"),
                inertia,
                spheres: (0..4).map(sphere).collect(),
                position: row.vector("", which),
                velocity: row.vector("v", which),
                rotation,
                momentum: rotation * (inertia * (rotation.inverse() * spin)),
            }
        };
        Case {
            number: number as usize,
            kind: row.number("cat") as usize,
            flights: [flight("A", number), flight("B", number + 1000.0)],
            restitution: 1.0,
            hit: row.number("hit") == 1.0,
            toi: row.number("toi"),
            normal: row.vector("n", ""),
            approach: row.number("un"),
            impulse: row.number("J"),
            after: [row.vector("v", "A_post"), row.vector("v", "B_post")],
            end: row.number("t_max"),
            gap: row.number("miss_min_gap"),
            size: 2.0,
        }
    };
    table.rows().map(case).collect()
}

/// Inserts a body in flight into a world.
pub fn insert_flight(world: &mut PhysicsWorld, flight: &Flight, restitution: Real) -> Thing {
    let [x, y, z, w] = flight.rotation.to_array().map(from_f64);
    let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
    let inertia = from_dvec3(flight.inertia);
    let properties = MassProperties::new(Vector::ZERO, from_f64(flight.mass), inertia);
    let body = RigidBodyBuilder::dynamic()
        .pose(Pose::from_parts(from_dvec3(flight.position), rotation))
        .linvel(from_dvec3(flight.velocity))
        .angvel(from_dvec3(flight.angvel()))
        .additional_mass_properties(properties)
        .allow_fast_rotation(true)
        .can_sleep(false);
    let parts = flight.spheres.iter().map(|(place, radius)| {
        ColliderBuilder::ball(from_f64(*radius))
            .translation(from_dvec3(*place))
            .density(0.0)
            .restitution(restitution)
            .friction(0.0)
    });
    insert(world, body, parts.collect::<Vec<_>>())
}

/// The present flights of the two bodies of a world.
pub fn flights_of(world: &PhysicsWorld, case: &Case) -> [Flight; 2] {
    let mut bodies = world.bodies.iter();
    [0, 1].map(|which| {
        let (_, body) = bodies.next().expect("two bodies");
        let pose = to_dpose3(body.position());
        let like = &case.flights[which];
        let spin = to_dvec3(body.angvel());
        Flight {
            position: pose.translation,
            velocity: to_dvec3(body.linvel()),
            rotation: pose.rotation,
            momentum: pose.rotation * (like.inertia * (pose.rotation.inverse() * spin)),
            ..like.clone()
        }
    })
}
