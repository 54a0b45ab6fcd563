//! Trajectory, wrenches, contacts, energies and warnings as CSV, in full precision.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use super::Scene;
use super::fields::StepWarning;
use super::fields::contact::FieldContact;
use super::fields::math::{to_dvec3, to_f64};
use super::fields::prelude::*;
use crate::program::{AnyError, Paths};

/// The tables that were asked for.
pub struct Tables {
    trajectory: Option<Table>,
    wrenches: Option<Table>,
    contacts: Option<Table>,
    energies: Option<Table>,
    warnings: Option<Table>,
    /// The colliders before the step: Rapier's contacts belong to their poses.
    before: HashMap<ColliderHandle, Before>,
    time_before: f64,
    /// Contacts that the fields found in the last step; Rapier answers contacts at the same poses in the next step.
    found: Vec<Found>,
}

/// Creates a file, and the folder that it is in.
///
/// # Errors
/// The file or the folder cannot be created.
pub fn create_file(path: &str) -> Result<File, AnyError> {
    if let Some(folder) = Path::new(path).parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    }
    File::create(path).map_err(|error| format!("cannot write {path}: {error}").into())
}

struct Table {
    path: String,
    file: BufWriter<File>,
    line: String,
}

impl Table {
    /// `None` for an empty path.
    fn create(path: &str, header: &str) -> Result<Option<Self>, AnyError> {
        if path.is_empty() {
            return Ok(None);
        }
        let mut table = Table {
            path: path.to_owned(),
            file: BufWriter::new(create_file(path)?),
            line: header.to_owned(),
        };
        table.end_row()?;
        Ok(Some(table))
    }

    fn begin_row(&mut self, step: usize, time: f64) {
        // `Debug` gives the fewest digits that read back as the same number.
        let _ = write!(self.line, "{step},{time:?}");
    }

    fn count(&mut self, number: usize) {
        let _ = write!(self.line, ",{number}");
    }

    fn numbers(&mut self, numbers: &[Real]) {
        for number in numbers {
            let _ = write!(self.line, ",{number:?}");
        }
    }

    fn end_row(&mut self) -> Result<(), AnyError> {
        self.line.push('\n');
        let written = self.file.write_all(self.line.as_bytes());
        self.line.clear();
        written.map_err(|error| format!("cannot write {}: {error}", self.path).into())
    }
}

/// The pose of a collider, and the motion of its body, before a step.
struct Before {
    pose: Pose,
    centre: Vector,
    linvel: Vector,
    angvel: Vector,
}

impl Before {
    fn velocity_at(&self, point: Vector) -> Vector {
        self.linvel + self.angvel.cross(point - self.centre)
    }
}

/// A row of the table of contacts.
struct Row {
    colliders: [ColliderHandle; 2],
    normal: Vector,
    point: Vector,
    depth: Real,
    approach_speed: Real,
    /// On the first and on the second collider.
    impulses: [Vector; 2],
    /// By the fields and by Rapier.
    answered: [bool; 2],
}

/// A contact that the fields found, with its step and time.
struct Found {
    step: usize,
    time: f64,
    contact: FieldContact,
}

impl Row {
    fn of(found: &Found, by_rapier: bool) -> Self {
        let contact = &found.contact;
        Row {
            colliders: contact.colliders,
            normal: contact.world_normal,
            point: contact.world_point,
            depth: contact.depth,
            approach_speed: contact.approach_speed,
            impulses: contact.impulses,
            answered: [answered(contact), by_rapier],
        }
    }

    fn answered_by(&self) -> &'static str {
        match self.answered {
            [true, true] => "both",
            [true, false] => "fields",
            [false, true] => "rapier",
            [false, false] => "nobody",
        }
    }
}

fn answered(contact: &FieldContact) -> bool {
    contact
        .impulses
        .iter()
        .any(|impulse| *impulse != Vector::ZERO)
}

impl Tables {
    /// Creates the tables whose paths are not empty.
    pub fn create(paths: &Paths) -> Result<Self, AnyError> {
        let state = "step,time,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";
        let contact = "step,time,body1,part1,body2,part2,nx,ny,nz,px,py,pz,depth,source,\
                       approach_speed,jx1,jy1,jz1,jx2,jy2,jz2,answered_by";
        let energy = "step,time,kinetic,gravity,fields,total,terms_without";
        let warning = "step,time,body,warning";
        Ok(Tables {
            trajectory: Table::create(&paths.trajectory, state)?,
            wrenches: Table::create(&paths.wrenches, "step,time,body,fx,fy,fz,tx,ty,tz")?,
            contacts: Table::create(&paths.contacts, contact)?,
            energies: Table::create(&paths.energies, energy)?,
            warnings: Table::create(&paths.warnings, warning)?,
            before: HashMap::new(),
            time_before: 0.0,
            found: Vec::new(),
        })
    }

    /// Writes the poses and velocities of all bodies.
    pub fn poses(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.trajectory else {
            return Ok(());
        };
        for (number, handle) in scene.bodies.iter().enumerate() {
            let body = &scene.world.bodies[*handle];
            let pose = body.position();
            let (centre, turn) = (pose * body.local_center_of_mass(), pose.rotation);
            table.begin_row(step, scene.fields.time());
            table.count(number);
            table.numbers(&centre.to_array());
            table.numbers(&[turn.w, turn.x, turn.y, turn.z]);
            table.numbers(&body.linvel().to_array());
            table.numbers(&body.angvel().to_array());
            table.end_row()?;
        }
        Ok(())
    }

    /// Writes the wrench on each body that fields move, at the current poses.
    pub fn wrenches(&mut self, step: usize, scene: &mut Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.wrenches else {
            return Ok(());
        };
        let dt = scene.world.integration_parameters.dt;
        let wrenches = scene.fields.sample_all(dt, &scene.world)?;
        let numbers = scene.bodies.iter().enumerate();
        let numbers: HashMap<_, _> = numbers.map(|(number, handle)| (*handle, number)).collect();
        for (handle, wrench) in wrenches {
            table.begin_row(step, scene.fields.time());
            table.count(numbers[&handle]);
            table.numbers(&wrench.force.to_array());
            table.numbers(&wrench.torque.to_array());
            table.end_row()?;
        }
        Ok(())
    }

    /// Writes the kinetic energy of all bodies, and their potential energies in the scene's gravity and
    /// in those fields that have a potential.
    pub fn energies(&mut self, step: usize, scene: &mut Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.energies else {
            return Ok(());
        };
        let world = &scene.world;
        let pull = to_dvec3(world.gravity);
        let (mut kinetic, mut gravity) = (0.0, 0.0);
        for (_, body) in world.bodies.iter().filter(|(_, body)| body.is_dynamic()) {
            kinetic += to_f64(body.kinetic_energy());
            let weight = pull * to_f64(body.mass()) * to_f64(body.gravity_scale());
            gravity -= weight.dot(to_dvec3(body.center_of_mass()));
        }
        let potential = scene.fields.potential_energy(world);
        table.begin_row(step, scene.fields.time());
        let total = kinetic + gravity + potential.total;
        for energy in [kinetic, gravity, potential.total, total] {
            let _ = write!(table.line, ",{energy:?}");
        }
        table.count(potential.without);
        table.end_row()
    }

    /// Writes the warnings of a step.
    pub fn warnings(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.warnings else {
            return Ok(());
        };
        for warning in scene.fields.warnings() {
            table.begin_row(step, scene.fields.time());
            let body = body_of(warning).and_then(|body| number_of(body, scene));
            let body = body.map_or(String::new(), |number| number.to_string());
            let _ = write!(
                table.line,
                ",{body},\"{}\"",
                warning.to_string().replace('"', "\"\"")
            );
            table.end_row()?;
        }
        Ok(())
    }

    /// Records the colliders before a step.
    pub fn before(&mut self, scene: &Scene) {
        self.time_before = scene.fields.time();
        if self.contacts.is_some() {
            let colliders = scene.world.colliders.iter();
            let states = colliders.map(|(handle, _)| (handle, before(handle, scene)));
            self.before = states.collect();
        }
    }

    /// Writes the contacts at the poses before a step: those that the fields found there, and
    /// Rapier's, which it answers in the step.
    pub fn contacts(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        self.contacts_before(step - 1, scene, true)?;
        let now = scene.fields.time();
        let contacts = scene.fields.contacts().iter();
        self.found.extend(contacts.map(|contact| Found {
            step,
            time: contact.time_of_impact.unwrap_or(now),
            contact: *contact,
        }));
        Ok(())
    }

    /// Writes the contacts after the last step, which Rapier does not answer any more.
    pub fn last_contacts(&mut self, step: usize, scene: &mut Scene) -> Result<(), AnyError> {
        self.before(scene);
        scene.world.detect_collisions(&(), &());
        self.contacts_before(step, scene, false)
    }

    /// Writes the contacts at the recorded poses. `solved`: whether Rapier has made the step that answers them.
    fn contacts_before(
        &mut self,
        step: usize,
        scene: &Scene,
        solved: bool,
    ) -> Result<(), AnyError> {
        let Some(table) = &mut self.contacts else {
            return Ok(());
        };
        let phase = &scene.world.narrow_phase;
        let impulse = |pair: &ContactPair| match solved {
            true => pair.total_impulse(),
            false => Vector::ZERO,
        };
        let mut by_fields: Vec<[ColliderHandle; 2]> = Vec::new();
        for found in self.found.drain(..) {
            let contact = &found.contact;
            let [first, second] = contact.colliders;
            let pair = phase.contact_pair(first, second);
            let by_rapier = pair.is_some_and(|pair| impulse(pair) != Vector::ZERO);
            if answered(contact) {
                by_fields.push(contact.colliders);
            }
            let row = Row::of(&found, by_rapier);
            table.contact(found.step, found.time, &row, scene, "field")?;
        }
        let mut rows: Vec<Row> = Vec::new();
        for pair in phase.contact_pairs() {
            rows.extend(deepest(pair, &self.before, impulse(pair)));
        }
        rows.sort_unstable_by_key(|row| row.colliders.map(ColliderHandle::into_raw_parts));
        for row in &mut rows {
            row.answered[0] = by_fields.contains(&row.colliders);
            table.contact(step, self.time_before, row, scene, "rapier")?;
        }
        Ok(())
    }

    /// Flushes all tables.
    pub fn finish(self) -> Result<(), AnyError> {
        let tables = [
            self.trajectory,
            self.wrenches,
            self.contacts,
            self.energies,
            self.warnings,
        ];
        for mut table in tables.into_iter().flatten() {
            let flushed = table.file.flush();
            flushed.map_err(|error| format!("cannot write {}: {error}", table.path))?;
            println!("written                 {}", table.path);
        }
        Ok(())
    }
}

impl Table {
    fn contact(
        &mut self,
        step: usize,
        time: f64,
        row: &Row,
        scene: &Scene,
        source: &str,
    ) -> Result<(), AnyError> {
        self.begin_row(step, time);
        for collider in row.colliders {
            let (body, part) = scene.part_of(collider).ok_or("a contact of no body")?;
            self.count(body);
            self.count(part);
        }
        self.numbers(&row.normal.to_array());
        self.numbers(&row.point.to_array());
        self.numbers(&[row.depth]);
        let _ = write!(self.line, ",{source}");
        self.numbers(&[row.approach_speed]);
        for impulse in row.impulses {
            self.numbers(&impulse.to_array());
        }
        let _ = write!(self.line, ",{}", row.answered_by());
        self.end_row()
    }
}

/// The body that a warning is about.
pub fn body_of(warning: &StepWarning) -> Option<RigidBodyHandle> {
    match warning {
        StepWarning::Stiff { body, .. }
        | StepWarning::ToleranceMissed { body, .. }
        | StepWarning::HitInStiffField { body, .. }
        | StepWarning::NotFinite { body }
        | StepWarning::NoVolume { body }
        | StepWarning::PinnedParticles { body, .. }
        | StepWarning::SpeedCapped { body, .. }
        | StepWarning::FarFromOrigin { body, .. }
        | StepWarning::AbruptForce { body, .. }
        | StepWarning::LeftOut { body, .. }
        | StepWarning::Quarantined { body, .. }
        | StepWarning::MassChanged { body, .. }
        | StepWarning::RotationCapped { body, .. } => Some(*body),
        _ => None,
    }
}

fn number_of(body: RigidBodyHandle, scene: &Scene) -> Option<usize> {
    scene.bodies.iter().position(|handle| *handle == body)
}

/// The pose and motion of a collider by those of its body: Rapier updates a collider's own pose only in the next step.
fn before(handle: ColliderHandle, scene: &Scene) -> Before {
    let collider = &scene.world.colliders[handle];
    let body = collider
        .parent()
        .and_then(|body| scene.world.bodies.get(body));
    let pose = match (body, collider.position_wrt_parent()) {
        (Some(body), Some(local_pose)) => *body.position() * *local_pose,
        _ => *collider.position(),
    };
    Before {
        pose,
        centre: body.map_or(Vector::ZERO, |body| {
            body.position() * body.local_center_of_mass()
        }),
        linvel: body.map_or(Vector::ZERO, |body| body.linvel()),
        angvel: body.map_or(Vector::ZERO, |body| body.angvel()),
    }
}

/// The deepest overlap of one of Rapier's pairs, if it overlaps, with its colliders in the order of handles.
fn deepest(
    pair: &ContactPair,
    before: &HashMap<ColliderHandle, Before>,
    impulse: Vector,
) -> Option<Row> {
    let points = pair.manifolds().iter().flat_map(|manifold| {
        let points = manifold.points.iter();
        points.map(move |point| (manifold, point))
    });
    let deepest = points.min_by(|(_, a), (_, b)| a.dist.total_cmp(&b.dist));
    let (manifold, point) = deepest.filter(|(_, point)| point.dist < 0.0)?;
    let (one, two) = (before.get(&pair.collider1)?, before.get(&pair.collider2)?);
    let middle = (one.pose * point.local_p1 + two.pose * point.local_p2) * 0.5;
    let normal = manifold.data.normal;
    let approach = one.velocity_at(middle) - two.velocity_at(middle);
    let row = Row {
        colliders: [pair.collider1, pair.collider2],
        normal,
        point: middle,
        depth: -point.dist,
        approach_speed: approach.dot(normal),
        impulses: [-impulse, impulse],
        answered: [false, impulse != Vector::ZERO],
    };
    let [first, second] = row.colliders.map(ColliderHandle::into_raw_parts);
    if first <= second {
        return Some(row);
    }
    Some(Row {
        colliders: [row.colliders[1], row.colliders[0]],
        normal: -row.normal,
        impulses: [impulse, -impulse],
        ..row
    })
}
