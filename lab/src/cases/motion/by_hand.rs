//! The same motions by Rapier without fields, as an experienced user writes them.

use super::fields;
use super::{Counter, Driver, Motion, Site};
use fields::math::{RigidBodyHandle, RigidBodySet, Vector, from_dvec3, from_f64};

/// Forces and torques on bodies.
struct Loads {
    motion: Motion,
    bodies: Vec<RigidBodyHandle>,
    sites: Vec<Site>,
    forces: Vec<Vector>,
    /// Force and torque per body, the torque about its centre of mass.
    wrenches: Vec<[Vector; 2]>,
    turns: bool,
    counter: Option<Counter>,
}

impl Motion {
    /// Writes the sites at the present poses of `bodies` to `sites`.
    pub(super) fn read_sites(
        &self,
        set: &RigidBodySet,
        bodies: &[RigidBodyHandle],
        sites: &mut Vec<Site>,
    ) {
        sites.clear();
        for (body, (handle, top)) in bodies.iter().zip(&self.tops).enumerate() {
            let rigid = &set[*handle];
            let (pose, velocity) = (rigid.position(), rigid.linvel());
            for (point, charge) in &top.sites {
                let arm = pose.rotation * from_dvec3(*point);
                sites.push(Site {
                    body,
                    world_point: pose.translation + arm,
                    velocity: velocity + rigid.angvel().cross(arm),
                    charge: from_f64(*charge),
                });
            }
        }
    }

    fn loads(&self, bodies: Vec<RigidBodyHandle>, counter: Option<Counter>) -> Loads {
        Loads {
            motion: self.clone(),
            sites: Vec::new(),
            forces: vec![Vector::ZERO; self.samples() as usize],
            wrenches: vec![[Vector::ZERO; 2]; bodies.len()],
            turns: self.tops.iter().any(super::Top::is_turned),
            bodies,
            counter,
        }
    }

    /// `add_force` and `add_torque`, once a step.
    pub(super) fn add_force(
        &self,
        bodies: Vec<RigidBodyHandle>,
        counter: Option<Counter>,
    ) -> Driver {
        let mut loads = self.loads(bodies, counter);
        Driver::Before(Box::new(move |set| {
            loads.work_out(set);
            for (handle, [force, torque]) in loads.bodies.iter().zip(&loads.wrenches) {
                let body = &mut set[*handle];
                body.reset_forces(true);
                body.add_force(*force, true);
                if loads.turns {
                    body.reset_torques(true);
                    body.add_torque(*torque, true);
                }
            }
        }))
    }

    /// Half a kick before Rapier's step and half after it. The forces after a step serve the next step as well.
    pub(super) fn kicks(
        &self,
        bodies: Vec<RigidBodyHandle>,
        dt: f64,
        counter: Option<Counter>,
    ) -> Driver {
        use std::cell::RefCell;
        use std::rc::Rc;
        let loads = Rc::new(RefCell::new(self.loads(bodies, counter)));
        let half = from_f64(0.5 * dt);
        let kick = move |loads: &Loads, set: &mut RigidBodySet| {
            for (handle, [force, torque]) in loads.bodies.iter().zip(&loads.wrenches) {
                let body = &mut set[*handle];
                body.apply_impulse(*force * half, true);
                if loads.turns {
                    body.apply_torque_impulse(*torque * half, true);
                }
            }
        };
        let (first, second) = (loads.clone(), loads);
        let mut begun = false;
        Driver::Around(
            Box::new(move |set| {
                let loads = &mut *first.borrow_mut();
                if !std::mem::replace(&mut begun, true) {
                    // Rapier computes masses in its first step, and impulses before it would be lost.
                    loads.weigh(set);
                    loads.work_out(set);
                }
                kick(loads, set);
            }),
            Box::new(move |set| {
                let loads = &mut *second.borrow_mut();
                loads.work_out(set);
                kick(loads, set);
            }),
        )
    }
}

impl Loads {
    fn weigh(&self, set: &mut RigidBodySet) {
        let none = fields::rapier::prelude::ColliderSet::new();
        for handle in &self.bodies {
            set[*handle].recompute_mass_properties_from_colliders(&none);
        }
    }

    fn work_out(&mut self, set: &RigidBodySet) {
        self.motion.read_sites(set, &self.bodies, &mut self.sites);
        (self.motion.forces)(&self.sites, &mut self.forces);
        self.wrenches.fill([Vector::ZERO; 2]);
        for (site, force) in self.sites.iter().zip(&self.forces) {
            let [sum, torque] = &mut self.wrenches[site.body];
            *sum += *force;
            if self.turns {
                let center = set[self.bodies[site.body]].center_of_mass();
                *torque += (site.world_point - center).cross(*force);
            }
        }
        if let Some(counter) = &self.counter {
            counter.count(self.sites.len() as u64);
        }
    }
}
