//! Bodies on which forces change abruptly from one visit to the next.

use super::block::{BodyBlock, LastWay};
use super::pass::Pass;
use crate::eval::{CentreBlock, TOGETHER, in_lane};
use crate::integrate::ForceChange;
use crate::math::{DVec3, from_f64, to_dvec3, to_f64};
use crate::number::{Vec3, each_lane};
use crate::rapier::dynamics::RigidBody;

/// The number of parts of a way, in each of which forces are evaluated at as many points as there are lanes.
const PARTS: usize = 4;

impl Pass<'_> {
    /// Follows a body, and adds the error of its energy if its force has changed abruptly. The fields do not move.
    #[inline(never)]
    pub(super) fn follow(&mut self, block: &BodyBlock, last: &LastWay) {
        let handle = block.seen.bodies[last.lane];
        let damps = |it: &RigidBody| it.linear_damping() != 0.0 || it.angular_damping() != 0.0;
        if !self.edges.has_room_for(handle) || self.visit.body(handle).is_none_or(damps) {
            return;
        }
        let speed = to_f64(in_lane(&block.seen.linvels, last.lane).length());
        let (way, change) = (to_dvec3(last.way), to_dvec3(last.change));
        let (mass, dt) = (to_f64(block.seen.masses[last.lane]), to_f64(last.dt));
        let force = to_dvec3(last.force);
        let before = force - change;
        // A longer way is no motion.
        if way.length() > 2.0 * (speed + before.length() / mass * dt) * dt {
            return;
        }
        let swing = ForceChange {
            body: handle,
            swing: change.length() * way.length(),
            kinetic: 0.5 * mass * way.length_squared() / (dt * dt),
            force2: (before.length_squared()).max(force.length_squared()),
            mass,
            dt,
        };
        let Some(least) = self.edges.look(&swing) else {
            return;
        };
        let given = 0.5 * (before + force).dot(way);
        let mut error = |parts| given - self.work_along(block, last, parts);
        if error(1).abs() > least {
            let error = error(PARTS);
            self.edges.add(handle, error);
        }
    }

    /// The work of the fields along a way, by the forces at several points in each of some parts.
    fn work_along(&mut self, block: &BodyBlock, last: &LastWay, parts: usize) -> f64 {
        let (mut done, way) = (0.0, to_dvec3(last.way));
        let points = parts * TOGETHER;
        for part in 0..parts {
            let share = |lane: usize| ((part * TOGETHER + lane) as f64 + 0.5) / points as f64;
            let forces = self.forces(block, last, share);
            done += forces.iter().map(|force| force.dot(way)).sum::<f64>();
        }
        done / points as f64
    }

    /// The forces on a body at points of its way, given by their distances from its end as shares of it.
    fn forces(
        &mut self,
        block: &BodyBlock,
        last: &LastWay,
        share: impl Fn(usize) -> f64,
    ) -> [DVec3; TOGETHER] {
        let spread = spread(&block.seen, last, share);
        let Vec3 { x, y, z } = self.evaluator.forces(self.compiled, &spread).force;
        std::array::from_fn(|lane| DVec3::new(x.0[lane], y.0[lane], z.0[lane]))
    }
}

/// One body at points of its way.
fn spread(seen: &CentreBlock, last: &LastWay, share: impl Fn(usize) -> f64) -> CentreBlock {
    let mut points = seen.clone();
    points.count = TOGETHER;
    points.bodies = [seen.bodies[last.lane]; TOGETHER];
    points.masses = [seen.masses[last.lane]; TOGETHER];
    for axis in 0..3 {
        let (end, way) = (seen.world_coms[axis][last.lane], last.way[axis]);
        points.linvels[axis] = [seen.linvels[axis][last.lane]; TOGETHER];
        points.world_coms[axis] = each_lane(|lane| end - way * from_f64(share(lane)));
    }
    points
}
