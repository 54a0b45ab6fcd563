//! Two ammonia molecules in each other's field.

use super::super::super::scenes::ammonia::{
    COULOMB, DISPERSION, LJ_EPSILON, LJ_SIGMA, Molecule, SITES, insert_molecule, interaction,
    set_probes,
};
use super::super::measure::{Counter, Driver, Simulation, time, weightless};
use super::super::{Effort, Measured, Method, Metric, PRECISION, Row, Run, StudyError, Table};
use super::fields;
use super::{Case, finite_or_infinite, halvings, whole_steps};
use fields::Fields;
use fields::math::{
    DPose3, DVec3, Pose, Real, RigidBodyHandle, RigidBodySet, Rotation, Vector, from_dvec3,
    from_f64, to_dpose3,
};
use fields::rapier::prelude::InteractionGroups;

/// A rigid molecule at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DimerStart {
    /// Body to world, its translation the centre of mass, Å.
    pub pose: DPose3,
    /// Velocity of the centre of mass, Å/ps.
    pub linvel: DVec3,
    /// Angular velocity along the world's axes, rad/ps.
    pub angvel: DVec3,
}

/// Two ammonia molecules in each other's field, without cutoff and without hard cores, from a
/// state to another that is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Dimer {
    /// The molecules at the start.
    pub start: [DimerStart; 2],
    /// Where the molecules are in the end: their centres of mass (Å) and attitudes.
    pub end: [DPose3; 2],
    /// Time between the two, ps.
    pub duration: f64,
}

const NAME: &str = "ammonia dimer";

impl Dimer {
    /// From the first sample of a trajectory to another, counted from 0.
    ///
    /// The table has two rows per sample, one per molecule, with the columns `t` (ps), `x y z`
    /// (Å), `qw qx qy qz` (body to world), `vx vy vz` (Å/ps) and `wx wy wz` (rad/ps, along the
    /// world's axes). Errors made on the way grow with those of the trajectory: choose an early
    /// sample.
    ///
    /// # Errors
    /// A row or column is not there, or a cell is no number.
    pub fn from_csv(text: &str, sample: usize) -> Result<Self, StudyError> {
        let table = Table::parse(text)?;
        let rows: Vec<Row<'_>> = table.rows().collect();
        let (Some([a, b]), Some([c, d])) = (rows.get(..2), rows.get(2 * sample..2 * sample + 2))
        else {
            let what = format!("sample {sample}");
            return Err(StudyError::Missing { what });
        };
        let pose = |row: &Row<'_>| {
            let translation = row.vector("", "")?;
            Ok::<_, StudyError>(DPose3::from_parts(translation, row.rotation()?))
        };
        let start = |row: &Row<'_>| {
            Ok::<_, StudyError>(DimerStart {
                pose: pose(row)?,
                linvel: row.vector("v", "")?,
                angvel: row.vector("w", "")?,
            })
        };
        Ok(Dimer {
            start: [start(a)?, start(b)?],
            end: [pose(c)?, pose(d)?],
            duration: c.number("t")? - a.number("t")?,
        })
    }

    fn set_up(
        &self,
        method: Method,
        dt: f64,
        counter: Option<&Counter>,
    ) -> Result<(Simulation, [Molecule; 2]), StudyError> {
        let mut world = weightless(from_f64(dt));
        let molecules = self.start.map(|start| {
            let [x, y, z, w] = start.pose.rotation.to_array().map(from_f64);
            let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
            let pose = Pose::from_parts(from_dvec3(start.pose.translation), rotation);
            let (linvel, angvel) = (from_dvec3(start.linvel), from_dvec3(start.angvel));
            let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
            insert_molecule(bodies, colliders, pose, linvel, angvel)
        });
        for (_, collider) in world.colliders.iter_mut() {
            collider.set_collision_groups(InteractionGroups::none());
        }
        let driver = match (method, method.scheme()) {
            (_, Some(scheme)) => {
                let mut tree = interaction(&molecules, None);
                if let Some(counter) = counter {
                    tree = tree.sum_union(counter.field());
                }
                let builder = Fields::builder(tree).scheme(scheme);
                let mut fields = builder.axis(DISPERSION, 0.0).build()?;
                set_probes(&mut fields, &molecules, &world.colliders)?;
                Driver::Fields(Box::new(fields))
            }
            (Method::AddForceLoop, _) => by_hand(molecules, counter.cloned()),
            _ => {
                let (case, method) = (NAME, method.name());
                return Err(StudyError::Method { case, method });
            }
        };
        Ok((Simulation { world, driver }, molecules))
    }

    /// Root mean square distance of the atoms from where they should be, Å.
    fn error(&self, found: [DPose3; 2]) -> f64 {
        let points = SITES.map(|site| DVec3::from_array(site.local_point));
        let square = |(found, expected): (&DPose3, &DPose3)| {
            let at = |pose: &DPose3, point: DVec3| pose.translation + pose.rotation * point;
            let squares =
                points.map(|point| at(found, point).distance_squared(at(expected, point)));
            squares.iter().sum::<f64>()
        };
        let squares: f64 = found.iter().zip(&self.end).map(square).sum();
        (squares / (2 * SITES.len()) as f64).sqrt()
    }
}

/// What one writes without fields: all pairs of atoms, both sides at once.
fn by_hand(molecules: [Molecule; 2], counter: Option<Counter>) -> Driver {
    let sites = SITES.map(|site| {
        let point: Vector = from_dvec3(DVec3::from_array(site.local_point));
        (point, from_f64(site.charge))
    });
    let coulomb = from_f64(COULOMB);
    let handles = molecules.map(|molecule| molecule.body);
    Driver::ByHand(Box::new(move |bodies: &mut RigidBodySet| {
        let poses = handles.map(|handle| *bodies[handle].position());
        let arms = poses.map(|pose| sites.map(|(point, _)| pose.rotation * point));
        let apart = poses[1].translation - poses[0].translation;
        let (mut force, mut torques) = (Vector::ZERO, [Vector::ZERO; 2]);
        for (i, (_, charge)) in sites.iter().enumerate() {
            for (j, (_, other)) in sites.iter().enumerate() {
                let d = apart + arms[1][j] - arms[0][i];
                let inverse = d.length_squared().recip();
                let mut strength = coulomb * charge * other * inverse * inverse.sqrt();
                if (i, j) == (0, 0) {
                    strength += lennard_jones(inverse);
                }
                let push = d * strength;
                force += push;
                torques[0] -= arms[0][i].cross(push);
                torques[1] += arms[1][j].cross(push);
            }
        }
        for ((handle, force), torque) in handles.into_iter().zip([-force, force]).zip(torques) {
            act(bodies, handle, force, torque);
        }
        if let Some(counter) = &counter {
            counter.count(2 * SITES.len() as u64);
        }
    }))
}

/// Lennard-Jones force over distance, from 1/r².
fn lennard_jones(inverse: Real) -> Real {
    let (sigma, epsilon): (Real, Real) = (from_f64(LJ_SIGMA), from_f64(LJ_EPSILON));
    let s6 = (sigma * sigma * inverse).powi(3);
    24.0 * epsilon * (2.0 * s6 * s6 - s6) * inverse
}

fn act(bodies: &mut RigidBodySet, handle: RigidBodyHandle, force: Vector, torque: Vector) {
    let body = &mut bodies[handle];
    body.reset_forces(true);
    body.reset_torques(true);
    body.add_force(force, true);
    body.add_torque(torque, true);
}

impl Case for Dimer {
    fn name(&self) -> &'static str {
        NAME
    }

    fn time_unit(&self) -> &'static str {
        "ps"
    }

    fn methods(&self) -> &'static [Method] {
        &Method::FORCES
    }

    /// From 50 steps to 6400.
    fn time_steps(&self) -> Vec<f64> {
        halvings(self.duration / 50.0, 8)
    }

    fn run(&self, method: Method, dt: f64, effort: Effort) -> Result<Run, StudyError> {
        let steps = whole_steps(NAME, self.duration, dt)?;
        let (mut simulation, molecules) = self.set_up(method, dt, None)?;
        let made = simulation.advance(steps);
        let bodies = &simulation.world.bodies;
        let found = molecules.map(|molecule| to_dpose3(bodies[molecule.body].position()));
        let error = if made == steps {
            finite_or_infinite(self.error(found))
        } else {
            f64::INFINITY
        };
        let counter = Counter::default();
        self.set_up(method, dt, Some(&counter))?.0.advance(steps);
        Ok(Run {
            case: NAME.to_owned(),
            method,
            precision: PRECISION,
            dt,
            steps: made,
            simulated: made as f64 * dt,
            evaluations: counter.counted() / (2 * SITES.len() as u64),
            errors: vec![Measured {
                metric: Metric::AtomPosition,
                value: error,
            }],
            timing: time(effort, steps, || {
                Ok::<_, StudyError>(vec![self.set_up(method, dt, None)?.0])
            })?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::math::to_f64;

    #[test]
    fn the_hand_written_force_is_that_of_the_fields() {
        let start = |x: f64, turn: f64| DimerStart {
            pose: DPose3::from_parts(
                DVec3::new(x, 0.3, -0.2),
                fields::math::DQuat::from_rotation_y(turn),
            ),
            linvel: DVec3::ZERO,
            angvel: DVec3::ZERO,
        };
        let dimer = Dimer {
            start: [start(-1.6, 0.4), start(1.7, 2.0)],
            end: [DPose3::default(); 2],
            duration: 1.0,
        };
        let (mut ours, molecules) = dimer.set_up(Method::Kick, 1e-3, None).unwrap();
        let (mut theirs, _) = dimer.set_up(Method::AddForceLoop, 1e-3, None).unwrap();
        let Driver::ByHand(act) = &mut theirs.driver else {
            panic!("written by hand");
        };
        act(&mut theirs.world.bodies);
        let Driver::Fields(fields) = &mut ours.driver else {
            panic!("fields");
        };
        for molecule in molecules {
            let world = &ours.world;
            let sampled = fields.sample(molecule.body, &world.bodies, &world.colliders);
            let wrench = sampled.unwrap().unwrap();
            let body = &theirs.world.bodies[molecule.body];
            let off = (body.user_force() - wrench.force).length()
                + (body.user_torque() - wrench.torque).length();
            let scale = wrench.force.length() + wrench.torque.length();
            assert!(to_f64(off) < 1e-4 * to_f64(scale), "{off} of {scale}");
        }
    }
}
