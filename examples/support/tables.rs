//! Trajectory, wrenches and contacts as CSV, in full precision.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use rapier3d_fields::files::Scene;
use rapier3d_fields::prelude::*;

use super::support::{AnyError, make_folder_of};

/// The tables that were asked for.
pub struct Tables {
    trajectory: Option<Table>,
    wrenches: Option<Table>,
    contacts: Option<Table>,
    /// Where colliders were before the step: Rapier's contacts belong to those poses.
    before: HashMap<ColliderHandle, Pose>,
    time_before: f64,
}

struct Table {
    path: String,
    file: BufWriter<File>,
    line: String,
}

impl Table {
    /// Nothing for an empty path.
    fn create(path: &str, header: &str) -> Result<Option<Self>, AnyError> {
        if path.is_empty() {
            return Ok(None);
        }
        make_folder_of(Path::new(path))?;
        let file = File::create(path).map_err(|error| format!("cannot write {path}: {error}"))?;
        let mut table = Table {
            path: path.to_owned(),
            file: BufWriter::new(file),
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

/// A contact as it stands in a row.
struct Row {
    colliders: [ColliderHandle; 2],
    normal: Vector,
    point: Vector,
    depth: Real,
}

impl Tables {
    /// An empty path is a table that was not asked for.
    pub fn create(trajectory: &str, wrenches: &str, contacts: &str) -> Result<Self, AnyError> {
        let state = "step,time,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";
        let contact = "step,time,body1,part1,body2,part2,nx,ny,nz,px,py,pz,depth,source";
        Ok(Tables {
            trajectory: Table::create(trajectory, state)?,
            wrenches: Table::create(wrenches, "step,time,body,fx,fy,fz,tx,ty,tz")?,
            contacts: Table::create(contacts, contact)?,
            before: HashMap::new(),
            time_before: 0.0,
        })
    }

    /// Writes where all bodies are.
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

    /// Writes the wrench on each body that fields move, where all is now.
    pub fn wrenches(&mut self, step: usize, scene: &mut Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.wrenches else {
            return Ok(());
        };
        let PhysicsWorld {
            integration_parameters,
            bodies,
            colliders,
            ..
        } = &scene.world;
        let dt = integration_parameters.dt;
        let wrenches = scene.fields.sample_all(dt, bodies, colliders)?;
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

    /// Notes where all is before a step.
    pub fn before(&mut self, scene: &Scene) {
        self.time_before = scene.fields.time();
        if self.contacts.is_some() {
            let colliders = scene.world.colliders.iter();
            let places = colliders.map(|(handle, _)| (handle, place(handle, scene)));
            self.before = places.collect();
        }
    }

    /// Writes the contacts of a step: Rapier's, which belong to the end of the step before, and
    /// those of the fields.
    pub fn contacts(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        self.contacts_of_rapier(step - 1, scene)?;
        self.contacts_of_fields(step, scene)
    }

    /// Writes Rapier's contacts after the last step, which Rapier would find in the next.
    pub fn last_contacts(&mut self, step: usize, scene: &mut Scene) -> Result<(), AnyError> {
        self.before(scene);
        scene.world.detect_collisions(&(), &());
        self.contacts_of_rapier(step, scene)
    }

    /// Rapier's contacts, at the places noted before.
    fn contacts_of_rapier(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.contacts else {
            return Ok(());
        };
        let mut rows: Vec<Row> = Vec::new();
        for pair in scene.world.narrow_phase.contact_pairs() {
            rows.extend(deepest(pair, &self.before));
        }
        rows.sort_unstable_by_key(|row| row.colliders.map(ColliderHandle::into_raw_parts));
        for row in &rows {
            table.contact(step, self.time_before, row, scene, "rapier")?;
        }
        Ok(())
    }

    fn contacts_of_fields(&mut self, step: usize, scene: &Scene) -> Result<(), AnyError> {
        let Some(table) = &mut self.contacts else {
            return Ok(());
        };
        for contact in scene.fields.contacts() {
            let row = Row {
                colliders: contact.colliders,
                normal: contact.world_normal,
                point: contact.world_point,
                depth: contact.depth,
            };
            let time = contact.time_of_impact.unwrap_or(scene.fields.time());
            table.contact(step, time, &row, scene, "field")?;
        }
        Ok(())
    }

    /// Makes sure that all is written.
    pub fn finish(self) -> Result<(), AnyError> {
        let tables = [self.trajectory, self.wrenches, self.contacts];
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
        self.end_row()
    }
}

/// Where a collider is: Rapier moves it to its body in the next step only.
fn place(handle: ColliderHandle, scene: &Scene) -> Pose {
    let collider = &scene.world.colliders[handle];
    let body = collider
        .parent()
        .and_then(|body| scene.world.bodies.get(body));
    match (body, collider.position_wrt_parent()) {
        (Some(body), Some(local_pose)) => *body.position() * *local_pose,
        _ => *collider.position(),
    }
}

/// The deepest overlap of a pair of Rapier's, if it overlaps, in the order of the handles.
fn deepest(pair: &ContactPair, before: &HashMap<ColliderHandle, Pose>) -> Option<Row> {
    let points = pair.manifolds().iter().flat_map(|manifold| {
        let points = manifold.points.iter();
        points.map(move |point| (manifold, point))
    });
    let deepest = points.min_by(|(_, a), (_, b)| a.dist.total_cmp(&b.dist));
    let (manifold, point) = deepest.filter(|(_, point)| point.dist < 0.0)?;
    let (pose1, pose2) = (before.get(&pair.collider1)?, before.get(&pair.collider2)?);
    let middle = (*pose1 * point.local_p1 + *pose2 * point.local_p2) * 0.5;
    let row = Row {
        colliders: [pair.collider1, pair.collider2],
        normal: manifold.data.normal,
        point: middle,
        depth: -point.dist,
    };
    let [first, second] = row.colliders.map(ColliderHandle::into_raw_parts);
    if first <= second {
        return Some(row);
    }
    Some(Row {
        colliders: [row.colliders[1], row.colliders[0]],
        normal: -row.normal,
        ..row
    })
}
