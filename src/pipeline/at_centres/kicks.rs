//! The kicks of the bodies of a block: plain ones, those that contain gravity, the user's force and damping, and those
//! of bodies that need a kick of their own.

use super::block::{BodyBlock, Kicked, Special};
use super::pass::{Done, Pass, Rules};
use crate::eval::{CentreForce, in_lane};
use crate::integrate::{Completion, FASTEST, Kick, LinearisedWrench, Method, VelocityUpdate};
use crate::math::{DVec3, RigidBodyHandle, Vector};
use crate::number::lanes_of;
use crate::rapier::na::Matrix3;
use crate::rigid::{Body, Wrench};

impl Pass<'_> {
    /// Kicks all bodies of a block.
    pub(super) fn kick(
        &mut self,
        rules: &Rules,
        block: &BodyBlock,
        felt: &CentreForce,
        kicked: &Kicked,
    ) -> Done {
        let moved = block.all() & (kicked.pushed | block.completed) & !block.special;
        if let Some(lane) = lanes_of(moved & !kicked.sound).next() {
            return Err(block.seen.bodies[lane]);
        }
        // In the order of the bodies, which searches in the lists of motions rely on.
        let mut specials = block.specials.iter();
        for lane in lanes_of(moved | block.special) {
            let is_set = |mask: u64| mask >> lane & 1 == 1;
            if is_set(block.special) {
                if let Some(special) = specials.next() {
                    let (force, torque) = (in_lane(&kicked.forces, lane), Vector::ZERO);
                    let of_body = || coupling(felt, lane, &special.body);
                    let coupling = rules.kick.slows.then(of_body).flatten();
                    let wrench = Wrench { force, torque };
                    self.kick_specially(rules, special, wrench, coupling.as_ref())?;
                }
                continue;
            }
            if is_set(block.falling) {
                self.kick_falling(rules, block, kicked, lane)?;
                continue;
            }
            let (handle, linvel) = (block.seen.bodies[lane], in_lane(&kicked.linvels, lane));
            if rules.kick.first && is_set(kicked.fast | block.far) {
                self.warn_of_cap(handle, linvel);
            }
            self.visit.set_linvel(handle, linvel);
        }
        self.spins
            .compute(self.motions, |update| self.visit.write(update));
        Ok(())
    }

    /// Kicks a body that gravity, the user's force or damping also moves.
    fn kick_falling(
        &mut self,
        rules: &Rules,
        block: &BodyBlock,
        kicked: &Kicked,
        lane: usize,
    ) -> Done {
        let (handle, free) = (block.seen.bodies[lane], &block.free[lane]);
        let Some(body) = self.visit.body(handle) else {
            return Ok(());
        };
        let is_set = |mask: u64| mask >> lane & 1 == 1;
        let (moves, was_free) = (in_lane(&kicked.linvels, lane), is_set(block.completed));
        let linvel = if rules.kick.first {
            free.given(moves)
        } else {
            moves + free.catches_up(was_free, is_set(kicked.pushed))
        };
        let (mut angvel, spun) = (body.angvel(), body.angvel());
        if was_free {
            [_, angvel] = free.moved(Vector::ZERO, angvel);
        }
        if was_free || rules.kick.first {
            angvel *= free.spin_kept(rules.kick.duration);
        }
        let update = VelocityUpdate {
            body: handle,
            linvel,
            angvel,
            spins: false,
            wake: false,
        };
        self.check_speed(rules, &update)?;
        if angvel == spun {
            self.visit.set_linvel(handle, linvel);
        } else {
            self.visit.write(&update);
        }
        if rules.kick.first && rules.twice {
            self.motions.complete_by(handle, Completion::Free);
            self.motions.updates.push(update);
        } else if rules.kick.first {
            self.motions.means.push(free.carried_out(handle, moves));
        }
        Ok(())
    }

    /// Kicks a body by itself, as steps with samples do.
    fn kick_specially(
        &mut self,
        rules: &Rules,
        special: &Special,
        wrench: Wrench,
        coupling: Option<&LinearisedWrench>,
    ) -> Done {
        let Special {
            body,
            before,
            loaded,
        } = special;
        let kick = Kick {
            rules: &self.motion,
            dt: self.half.dt,
            turns: self.compiled.torque_possible,
            body,
            held: self.motion.held.contains(body.handle),
            wrench,
            coupling,
            loaded: loaded.as_ref(),
            jacobian: None,
            before: self.half.first.map(|_| *before),
            wake: false,
        };
        if let Some(first) = self.half.first
            && let Some(was) = first.motions.slope(before.completion)
        {
            let update = kick.end_of_load(was, before.load.is_some());
            return update.map_or(Ok(()), |update| self.write(rules, &update));
        }
        let kicked = kick.done(Method::Kick(rules.kick.duration), self.motions);
        let Some((update, twist)) = kicked.map_err(|_| body.handle)? else {
            return Ok(());
        };
        if !rules.kick.first {
            return self.write(rules, &update);
        }
        self.motions.updates.push(update);
        if self.spins.includes(body, &update) {
            self.check_speed(rules, &update)?;
            self.spins.add(self.motions, body, update, twist);
            return Ok(());
        }
        self.write(rules, &update)
    }

    fn write(&mut self, rules: &Rules, update: &VelocityUpdate) -> Done {
        self.check_speed(rules, update)?;
        self.visit.write(update);
        Ok(())
    }

    /// Returns an error if a body is too fast for a visit, and warns of its velocity and place.
    fn check_speed(&mut self, rules: &Rules, update: &VelocityUpdate) -> Done {
        // `max_element` may pass over NaN, which is tested by itself.
        let linvel = update.linvel;
        let slow = linvel.abs().max_element() <= FASTEST * 0.5;
        if !slow || linvel.is_nan() {
            return Err(update.body);
        }
        if rules.kick.first {
            self.warn_of_cap(update.body, linvel);
        }
        Ok(())
    }

    /// Warns if Rapier will limit a velocity, or if a body is too far from the origin.
    fn warn_of_cap(&mut self, body: RigidBodyHandle, linvel: Vector) {
        let caps = self.motion.caps;
        self.warnings.extend(caps.of_speed(body, linvel.length()));
        let place = self.visit.body(body).map(|it| it.translation());
        self.warnings
            .extend(place.and_then(|it| caps.of_place(body, it, linvel)));
    }
}

/// The force in a lane, linearised in the velocity; `None` if no force acts on the body at any velocity.
fn coupling(felt: &CentreForce, lane: usize, body: &Body) -> Option<LinearisedWrench> {
    let (force, slope) = (felt.force_in(lane), felt.slope_in(lane));
    let acts = force != DVec3::ZERO || slope != Matrix3::zeros();
    acts.then(|| LinearisedWrench::at_centre(force, slope, body))
}
