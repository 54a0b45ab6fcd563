//! Rigid bodies and laws of force, as functions of places and velocities, and Newton's and Euler's equations.
//! Of the library only the names of vectors are used.

use rapier3d_fields::math::{DQuat, DVec3};

use crate::support::runge_kutta::{self, State};

/// A frame of the world, or of a body.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub origin: DVec3,
    pub axes: DQuat,
}

impl Frame {
    fn then(self, local: Frame) -> Frame {
        Frame {
            origin: self.origin + self.axes * local.origin,
            axes: self.axes * local.axes,
        }
    }
}

#[derive(Clone, Debug)]
pub struct Body {
    pub mass: f64,
    /// The centre of mass, in the body's frame.
    pub centre: DVec3,
    /// The principal axes, in the body's frame, and the moments about them.
    pub axes: DQuat,
    pub moments: DVec3,
    pub pose: Frame,
    pub velocity: DVec3,
    pub spin: DVec3,
    pub gravity_scale: f64,
    pub damping: f64,
    pub turn_damping: f64,
    pub user_force: DVec3,
    /// One for each world axis along which it can move, and zero for a locked one.
    pub free: DVec3,
    pub can_turn: bool,
    /// Where forces act on it, in its frame, with charges.
    pub sites: Vec<Site>,
}

#[derive(Clone, Copy, Debug)]
pub struct Site {
    pub arm: DVec3,
    pub charge: f64,
}

/// A force, from the place and the velocity in the field's frame.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    Uniform(DVec3),
    Spring(f64),
    /// Strength, softening.
    Coulomb(f64, f64),
    /// Height, width.
    Gaussian(f64, f64),
    /// Depth, stiffness, rest length.
    Morse(f64, f64, f64),
    /// Strength and core of a force around the y axis: strength · ŷ × ρ/(ρ² + core²).
    Vortex(f64, f64),
    /// Velocity of the air, linear and quadratic coefficients.
    Wind(DVec3, f64, f64),
    Magnetic(DVec3),
}

impl Law {
    pub fn reads_velocity(self) -> bool {
        matches!(self, Law::Wind(..) | Law::Magnetic(_))
    }

    /// Whether it points along the line to the origin.
    pub fn is_central(self) -> bool {
        !self.reads_velocity() && !matches!(self, Law::Uniform(_) | Law::Vortex(..))
    }

    fn force(self, place: DVec3, velocity: DVec3) -> DVec3 {
        let r = place.length();
        match self {
            Law::Uniform(force) => force,
            Law::Spring(stiffness) => place * -stiffness,
            Law::Coulomb(strength, soft) => place * strength * (r * r + soft * soft).powf(-1.5),
            Law::Gaussian(height, width) => {
                let square = width * width;
                place * (height / square * (-0.5 * r * r / square).exp())
            }
            Law::Morse(depth, stiffness, rest) => {
                let fallen = (-stiffness * (r - rest)).exp();
                place / r * (-2.0 * depth * stiffness * (1.0 - fallen) * fallen)
            }
            Law::Vortex(strength, core) => {
                let square = place.x * place.x + place.z * place.z;
                DVec3::Y.cross(place) * (strength / (square + core * core))
            }
            Law::Wind(air, linear, quadratic) => {
                let relative = velocity - air;
                relative * -(linear + quadratic * relative.length())
            }
            Law::Magnetic(field) => velocity.cross(field),
        }
    }
}

/// The points of a body at which a field acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// In full at each site.
    Sites,
    /// At each site, times its charge.
    Charges,
    /// At the centre of mass.
    Centre,
    /// At the centre of mass, times the mass.
    Mass,
}

#[derive(Clone, Debug)]
pub struct Push {
    pub law: Law,
    pub at: At,
    /// In the world, or in the frame of a body.
    pub frame: Frame,
    pub carrier: Option<usize>,
    pub reacts: bool,
    /// Times the time.
    pub grows: bool,
}

/// The angular velocity in a state, whose place is that of the centre of mass, and its attitude that of the body's frame.
pub fn spin(state: &State, body: &Body) -> DVec3 {
    let axes = state.attitude * body.axes;
    axes * ((axes.inverse() * state.momentum) / body.moments)
}

pub fn with_spin(mut state: State, body: &Body, spin: DVec3) -> State {
    let axes = state.attitude * body.axes;
    state.momentum = axes * (body.moments * (axes.inverse() * spin));
    state
}

fn frame(state: &State, body: &Body) -> Frame {
    Frame {
        origin: state.place - state.attitude * body.centre,
        axes: state.attitude,
    }
}

#[derive(Clone, Debug)]
pub struct Motion {
    pub bodies: Vec<Body>,
    pub pushes: Vec<Push>,
    pub gravity: DVec3,
    pub end: f64,
}

/// The force and the torque about the centre of mass.
#[derive(Clone, Copy, Default)]
struct Wrench {
    force: DVec3,
    torque: DVec3,
}

impl Wrench {
    fn add(&mut self, force: DVec3, arm: DVec3) {
        self.force += force;
        self.torque += arm.cross(force);
    }
}

impl Motion {
    pub fn starts(&self) -> Vec<State> {
        let start = |body: &Body| {
            let attitude = body.pose.axes;
            let still = State {
                place: body.pose.origin + attitude * body.centre,
                attitude,
                velocity: body.velocity,
                momentum: DVec3::ZERO,
            };
            with_spin(still, body, body.spin)
        };
        self.bodies.iter().map(start).collect()
    }

    fn add_push(&self, push: &Push, states: &[State], time: f64, wrenches: &mut [Wrench]) {
        let frame = match push.carrier {
            None => push.frame,
            Some(carrier) => frame(&states[carrier], &self.bodies[carrier]).then(push.frame),
        };
        for (number, (body, state)) in self.bodies.iter().zip(states).enumerate() {
            if push.carrier == Some(number) {
                continue;
            }
            let centre = [(
                DVec3::ZERO,
                if push.at == At::Mass { body.mass } else { 1.0 },
            )];
            let site = |site: &Site| {
                let factor = if push.at == At::Charges {
                    site.charge
                } else {
                    1.0
                };
                (state.attitude * (site.arm - body.centre), factor)
            };
            let points: Vec<(DVec3, f64)> = match push.at {
                At::Centre | At::Mass => centre.to_vec(),
                At::Sites | At::Charges => body.sites.iter().map(site).collect(),
            };
            let spin = if body.can_turn {
                spin(state, body)
            } else {
                DVec3::ZERO
            };
            for (arm, factor) in points {
                let back = frame.axes.inverse();
                let place = back * (state.place + arm - frame.origin);
                let velocity = back * (state.velocity + spin.cross(arm));
                let factor = if push.grows {
                    factor * time.exp()
                } else {
                    factor
                };
                let force = frame.axes * push.law.force(place, velocity) * factor;
                wrenches[number].add(force, arm);
                if let Some(carrier) = push.carrier.filter(|_| push.reacts) {
                    let there = state.place + arm - states[carrier].place;
                    wrenches[carrier].add(-force, there);
                }
            }
        }
    }

    /// Newton's and Euler's equations.
    fn rates(&self, states: &[State], time: f64) -> Vec<State> {
        let mut wrenches = vec![Wrench::default(); states.len()];
        for push in &self.pushes {
            self.add_push(push, states, time, &mut wrenches);
        }
        let all = self.bodies.iter().zip(states).zip(wrenches);
        all.map(|((body, state), wrench)| {
            let spin = if body.can_turn {
                spin(state, body)
            } else {
                DVec3::ZERO
            };
            let push = (wrench.force + body.user_force) / body.mass;
            let turn = wrench.torque - state.momentum * body.turn_damping;
            State {
                place: state.velocity,
                attitude: state.turning(spin),
                velocity: (push + self.gravity * body.gravity_scale) * body.free
                    - state.velocity * body.damping,
                momentum: if body.can_turn { turn } else { DVec3::ZERO },
            }
        })
        .collect()
    }

    /// The states at the end, by this number of steps.
    pub fn by_hand(&self, steps: u32) -> Vec<State> {
        let mut states = self.starts();
        let h = self.end / f64::from(steps);
        for step in 0..steps {
            let time = f64::from(step) * h;
            runge_kutta::step(&mut states, time, h, |states, time| {
                self.rates(states, time)
            });
        }
        states
    }

    /// The sum of the differences of places, attitudes, velocities and angular velocities.
    pub fn distance(&self, ours: &[State], theirs: &[State]) -> f64 {
        let all = self.bodies.iter().zip(ours.iter().zip(theirs));
        let off = all.map(|(body, (a, b))| a.distance(b, [a, b].map(|it| spin(it, body))));
        off.sum()
    }
}
