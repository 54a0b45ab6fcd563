//! Bodies without contacts, in fields that a hand-written loop can compute as well.

mod by_hand;
mod charges;
mod converged;
mod crowd;
mod molecules;
mod orbits;
mod tops;
mod wells;

pub use charges::{crossed_fields, dipole, helix};
pub use crowd::Crowd;
pub use molecules::{cluster, dimer_bound, dimer_scattering, molecules_from_csv};
pub use orbits::{close_pass, kepler};
pub use tops::{asymmetric_top, spinning_in_a_spring};
pub use wells::{drag, fall, spring, spring_under_gravity, stiff_well};

use std::sync::Arc;

use super::fields;
use super::simulation::{Counter, Driver, Simulation, weightless};
use super::{About, Case, run, scheme};
use crate::study::{Measured, Method, Metric, Run, State, StudyError};
use fields::math::{
    DQuat, DVec3, Pose, Real, RigidBodyHandle, RigidBodySet, Rotation, Vector, from_dvec3,
    from_f64, to_dpose3, to_dvec3, to_f64,
};
use fields::prelude::{ColliderProperties, Fields, Tree};
use fields::rapier::prelude::{
    ColliderBuilder, ColliderHandle, InteractionGroups, MassProperties, PhysicsWorld,
    RigidBodyBuilder,
};

/// A rigid body in its initial state, with the points on which forces act.
#[derive(Clone, Debug)]
pub struct Top {
    mass: f64,
    /// Moments of inertia about its axes, which are principal.
    moments: DVec3,
    start: State,
    /// Points in its frame, relative to the centre of mass, with their charges.
    sites: Vec<(DVec3, f64)>,
}

impl Top {
    /// A body on which forces act at its centre only.
    fn point(mass: f64, position: DVec3, velocity: DVec3) -> Self {
        Top {
            mass,
            moments: DVec3::splat(0.4 * mass),
            start: State {
                position,
                velocity,
                ..State::default()
            },
            sites: vec![(DVec3::ZERO, 1.0)],
        }
    }
}

/// The present state of a point on which forces act.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    body: usize,
    world_point: Vector,
    velocity: Vector,
    charge: Real,
}

/// The forces on all sites, by hand.
type Forces = Arc<dyn Fn(&[Site], &mut [Vector]) + Send + Sync>;
/// The potential energy of all sites.
type Potential = Arc<dyn Fn(&[Site]) -> f64 + Send + Sync>;
/// The fields, given the colliders at the sites.
type MakeTree = Arc<dyn Fn(&[ColliderHandle]) -> Tree + Send + Sync>;
/// The states of all bodies at a time, in closed form.
type Closed = Arc<dyn Fn(f64) -> Vec<State> + Send + Sync>;

/// The source of the exact final states.
#[derive(Clone)]
enum Reference {
    /// A formula.
    Closed(Closed),
    /// Final states from other programs.
    Table(Vec<State>),
    /// Newton's and Euler's equations in 64 bits, at steps so short that shorter ones change nothing; independent of
    /// fields and of Rapier.
    Converged,
}

/// Bodies without contacts, in fields that a hand-written loop can compute as well.
#[derive(Clone)]
pub struct Motion {
    about: About,
    tops: Vec<Top>,
    gravity: DVec3,
    /// The length and the speed by which errors of positions and of velocities are divided.
    scales: [f64; 2],
    tree: MakeTree,
    forces: Forces,
    /// `None` if the energy is not conserved.
    potential: Option<Potential>,
    /// An axis on which the first site of each body is 1, and the others 0.
    first_site_axis: Option<&'static str>,
    reference: Reference,
}

/// The bodies of a world, in order, and the colliders at their sites.
struct Inserted {
    bodies: Vec<RigidBodyHandle>,
    sites: Vec<ColliderHandle>,
}

impl Motion {
    /// All motions.
    pub fn all() -> Vec<Motion> {
        vec![
            fall(),
            spring(),
            spring_under_gravity(),
            stiff_well(),
            kepler(0.5),
            kepler(0.9),
            kepler(0.99),
            close_pass(),
            helix(),
            crossed_fields(),
            dipole(),
            asymmetric_top(),
            spinning_in_a_spring(),
            drag(),
            dimer_bound(),
            dimer_scattering(),
            cluster(),
        ]
    }

    /// The name in tables and files.
    pub fn name(&self) -> &str {
        &self.about.name
    }

    fn insert(&self, world: &mut PhysicsWorld) -> Inserted {
        let mut inserted = Inserted {
            bodies: Vec::new(),
            sites: Vec::new(),
        };
        for top in &self.tops {
            let [x, y, z, w] = top.start.rotation.to_array().map(from_f64);
            let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
            let position = from_dvec3(top.start.position);
            let moments = from_dvec3(top.moments);
            let mass = MassProperties::new(Vector::ZERO, from_f64(top.mass), moments);
            let body = RigidBodyBuilder::dynamic()
                .pose(Pose::from_parts(position, rotation))
                .linvel(from_dvec3(top.start.velocity))
                .angvel(from_dvec3(top.start.angvel(top.moments)))
                .additional_mass_properties(mass)
                .can_sleep(false);
            let body = world.bodies.insert(body);
            inserted.bodies.push(body);
            for (point, _) in &top.sites {
                let site = ColliderBuilder::ball(0.01)
                    .density(0.0)
                    .translation(from_dvec3(*point))
                    .collision_groups(InteractionGroups::none());
                let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
                let site = colliders.insert_with_parent(site, body, bodies);
                inserted.sites.push(site);
            }
        }
        inserted
    }

    fn world(&self, method: Method, dt: f64) -> (PhysicsWorld, Inserted) {
        let mut world = weightless(from_f64(dt));
        world.gravity = from_dvec3(self.gravity);
        // By default, Rapier limits speeds.
        world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
        if method.iterates_once() {
            world.integration_parameters.num_solver_iterations = 1;
        }
        let inserted = self.insert(&mut world);
        (world, inserted)
    }

    fn fields(
        &self,
        scheme: fields::Scheme,
        (world, inserted): (&PhysicsWorld, &Inserted),
        counter: Option<&Counter>,
    ) -> Result<Fields, StudyError> {
        let mut tree = (self.tree)(&inserted.sites);
        if let Some(counter) = counter {
            tree = tree.sum_union(counter.field());
        }
        let mut builder = Fields::builder(tree).scheme(scheme);
        if let Some(axis) = self.first_site_axis {
            builder = builder.axis(axis, 0.0);
        }
        let mut fields = builder.build()?;
        let sites = self
            .tops
            .iter()
            .flat_map(|top| top.sites.iter().enumerate());
        for (collider, (number, (_, charge))) in inserted.sites.iter().zip(sites) {
            let mut properties = ColliderProperties::new().charge(from_f64(*charge));
            if let Some(axis) = self.first_site_axis.filter(|_| number == 0) {
                properties = properties.axis(axis, 1.0);
            }
            fields.set_properties(*collider, properties, &world.colliders)?;
        }
        Ok(fields)
    }

    fn simulation(
        &self,
        method: Method,
        dt: f64,
        counter: Option<&Counter>,
    ) -> Result<(Simulation, Vec<RigidBodyHandle>), StudyError> {
        self.steps(dt)?;
        let (world, inserted) = self.world(method, dt);
        let bodies = inserted.bodies.clone();
        let driver = match (method, scheme(method)) {
            (_, Some(scheme)) => {
                let fields = self.fields(scheme, (&world, &inserted), counter)?;
                Driver::Fields(Box::new(fields))
            }
            (Method::AddForce | Method::AddForceOnce, _) => {
                self.add_force(inserted.bodies, counter.cloned())
            }
            (Method::KicksByHand, _) => self.kicks(inserted.bodies, dt, counter.cloned()),
            _ => {
                let (case, method) = (self.about.name.clone(), method.name());
                return Err(StudyError::Method { case, method });
            }
        };
        Ok((Simulation { world, driver }, bodies))
    }

    /// The exact final states of the bodies.
    fn end(&self) -> Vec<State> {
        let time = self.about.duration;
        match &self.reference {
            Reference::Closed(closed) => closed(time),
            Reference::Table(states) => states.clone(),
            Reference::Converged => {
                let mut all = crate::double::cases::Motion::all().into_iter();
                let twin = all.find(|motion| motion.name() == self.name());
                twin.map_or_else(Vec::new, |twin| twin.converged().0)
            }
        }
    }

    fn energy(&self, bodies: &RigidBodySet, handles: &[RigidBodyHandle]) -> Option<f64> {
        let potential = self.potential.as_ref()?;
        let mut sites = Vec::new();
        self.read_sites(bodies, handles, &mut sites);
        let moving = |(handle, top): (&RigidBodyHandle, &Top)| {
            let body = &bodies[*handle];
            let (velocity, position) = (to_dvec3(body.linvel()), to_dvec3(body.translation()));
            let local = to_dpose3(body.position()).rotation.inverse() * to_dvec3(body.angvel());
            let turning = 0.5 * (top.moments * local).dot(local);
            0.5 * top.mass * velocity.length_squared() + turning
                - top.mass * self.gravity.dot(position)
        };
        let kinetic: f64 = handles.iter().zip(&self.tops).map(moving).sum();
        Some(kinetic + potential(&sites))
    }

    fn errors(&self, ends: &[State]) -> Vec<Measured> {
        let exact = self.end();
        let count = exact.len() as f64;
        let [length, speed] = self.scales;
        let mut errors = Vec::new();
        if self.about.views[0].0 == Metric::AtomPosition {
            let value = self.site_distance(ends, &exact);
            errors.push(Measured::new(Metric::AtomPosition, value));
        } else {
            let off = |(a, b): (&State, &State)| {
                let place = a.position.distance(b.position) / length;
                let velocity = a.velocity.distance(b.velocity) / speed;
                place * place + velocity * velocity
            };
            let squares: f64 = ends.iter().zip(&exact).map(off).sum();
            let value = (squares / count).sqrt();
            errors.push(Measured::new(Metric::FinalState, value));
        }
        if self.tops.iter().any(|top| top.is_turned()) {
            let angle = |(a, b): (&State, &State)| a.angle_to(b);
            let angles = ends.iter().zip(&exact).map(angle);
            let value = angles.fold(0.0, |most: f64, angle| match angle.is_nan() {
                true => f64::INFINITY,
                false => most.max(angle),
            });
            errors.push(Measured::new(Metric::Attitude, value));
        }
        // The metric by which methods are compared comes first.
        errors.sort_by_key(|error| error.metric != self.about.views[0].0);
        errors
    }

    /// Root mean square distance of the sites from their exact positions.
    fn site_distance(&self, ends: &[State], exact: &[State]) -> f64 {
        let all = self.tops.iter().zip(ends.iter().zip(exact));
        let squares = all.flat_map(|(top, (a, b))| {
            let of_site = move |(point, _): &(DVec3, f64)| {
                let at = |state: &State| state.position + state.rotation * *point;
                at(a).distance_squared(at(b))
            };
            top.sites.iter().map(of_site)
        });
        let sites: usize = self.tops.iter().map(|top| top.sites.len()).sum();
        (squares.sum::<f64>() / sites as f64).sqrt()
    }

    /// Number of times a run evaluates the forces on all bodies.
    fn evaluations(&self, method: Method, dt: f64) -> Result<u64, StudyError> {
        let (steps, counter) = (self.steps(dt)?, Counter::default());
        let (mut simulation, _) = self.simulation(method, dt, Some(&counter))?;
        simulation.advance(steps);
        Ok(counter.counted() / self.samples())
    }

    fn samples(&self) -> u64 {
        self.tops.iter().map(|top| top.sites.len() as u64).sum()
    }
}

impl Top {
    /// Whether it rotates at the start, or forces can exert a torque on it.
    fn is_turned(&self) -> bool {
        self.start.momentum != DVec3::ZERO || self.sites.iter().any(|(at, _)| *at != DVec3::ZERO)
    }
}

/// The present state of a body of Rapier.
fn seen(bodies: &RigidBodySet, handle: RigidBodyHandle, moments: DVec3) -> State {
    let body = &bodies[handle];
    let pose = to_dpose3(body.position());
    let local = pose.rotation.inverse() * to_dvec3(body.angvel());
    State {
        position: pose.translation,
        rotation: pose.rotation,
        velocity: to_dvec3(body.linvel()),
        momentum: pose.rotation * (moments * local),
    }
}

impl Case for Motion {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn methods(&self) -> &'static [Method] {
        &Method::FORCES
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        Ok(vec![self.simulation(method, dt, None)?.0])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let steps = self.steps(dt)?;
        let (mut simulation, bodies) = self.simulation(method, dt, None)?;
        let energy = |simulation: &Simulation| self.energy(&simulation.world.bodies, &bodies);
        let start = energy(&simulation);
        let (mut worst, mut made, mut warned) = (0.0_f64, 0, 0);
        while made < steps {
            let Ok(told) = simulation.step() else {
                break;
            };
            made += 1;
            warned += u64::from(told);
            if let (Some(start), Some(now)) = (start, energy(&simulation)) {
                let off = (now - start).abs();
                worst = if off.is_nan() {
                    f64::INFINITY
                } else {
                    worst.max(off)
                };
            }
        }
        let set = &simulation.world.bodies;
        let ends = bodies.iter().zip(&self.tops);
        let ends: Vec<State> = ends.map(|(it, top)| seen(set, *it, top.moments)).collect();
        let mut errors = self.errors(&ends);
        if start.is_some() {
            let mass: f64 = self.tops.iter().map(|top| top.mass).sum();
            let scale = 0.5 * mass * self.scales[1] * self.scales[1];
            errors.push(Measured::new(Metric::Energy, worst / scale));
        }
        if made < steps {
            errors.iter_mut().for_each(|it| it.value = f64::INFINITY);
        }
        let evaluations = self.evaluations(method, dt)?;
        Ok(run(
            &self.about,
            (method, dt),
            (made, warned),
            evaluations,
            errors,
        ))
    }
}

fn about(
    name: impl Into<String>,
    description: &'static str,
    (duration, time_unit): (f64, &'static str),
    (longest, halvings): (f64, usize),
    views: &[(Metric, f64)],
) -> About {
    About {
        name: name.into(),
        description,
        time_unit,
        duration,
        longest,
        halvings,
        views: views.to_vec(),
    }
}

/// A number in the precision of the world.
fn real(value: f64) -> Real {
    from_f64(value)
}

/// The same force law on every site.
fn each(force: impl Fn(&Site) -> Vector + Send + Sync + 'static) -> Forces {
    Arc::new(move |sites, forces| {
        for (site, out) in sites.iter().zip(forces) {
            *out = force(site);
        }
    })
}

/// The sum of a potential over all sites.
fn summed(potential: impl Fn(DVec3, f64) -> f64 + Send + Sync + 'static) -> Option<Potential> {
    Some(Arc::new(move |sites| {
        let one = |site: &Site| potential(to_dvec3(site.world_point), to_f64(site.charge));
        sites.iter().map(one).sum()
    }))
}

/// One body that keeps its attitude.
fn alone(position: DVec3, velocity: DVec3) -> Vec<State> {
    vec![State {
        position,
        velocity,
        rotation: DQuat::IDENTITY,
        momentum: DVec3::ZERO,
    }]
}
