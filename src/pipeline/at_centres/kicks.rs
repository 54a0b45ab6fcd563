//! The kicks of the bodies of a block: plain ones, those that contain gravity, the user's force and damping, and those
//! of bodies that are held or precess.

use super::block::{BodyBlock, Kicked, Special};
use super::pass::{Done, Pass, Rules};
use crate::eval::in_lane;
use crate::integrate::{
    Completion, FASTEST, Load, Scheme, SpunUpdate, VelocityUpdate, complete,
    kicked as plainly_kicked,
};
use crate::math::{DVec3, RigidBodyHandle, Vector};
use crate::number::lanes_of;
use crate::rigid::Wrench;

impl Pass<'_> {
    /// Kicks all bodies of a block.
    pub(super) fn kick(&mut self, rules: &Rules, block: &BodyBlock, kicked: &Kicked) -> Done {
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
                    self.kick_specially(rules, special, in_lane(&kicked.forces, lane))?;
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

    /// Kicks a body that is held, or that precesses.
    fn kick_specially(&mut self, rules: &Rules, special: &Special, force: Vector) -> Done {
        let Special { body, free, before } = special;
        let torque = Vector::ZERO;
        let wrench = Wrench { force, torque };
        let held = self.held.contains(body.handle);
        let update = match self.half.first {
            None if held => {
                self.load(special, wrench)?;
                None
            }
            None => self.turn(rules, special, wrench)?,
            Some(_) => complete(body, free, wrench, held, *before, rules.kick.duration),
        };
        if let Some(update) = update {
            self.check_speed(rules, &update)?;
            self.visit.write(&update);
        }
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
        let caps = self.caps;
        self.warnings.extend(caps.of_speed(body, linvel.length()));
        let place = self.visit.body(body).map(|it| it.translation());
        self.warnings
            .extend(place.and_then(|it| caps.of_place(body, it, linvel)));
    }

    /// Loads a body that is held.
    fn load(&mut self, Special { body, .. }: &Special, wrench: Wrench) -> Done {
        let load = Load::new(body, wrench, false, self.half.dt);
        if !load.is_bearable(body, self.gravity) {
            return Err(body.handle);
        }
        let loads = &mut self.motions.loads;
        loads.extend((wrench != Wrench::ZERO).then_some(load));
        Ok(())
    }

    /// The first half for a body that precesses; `None` if there is nothing to write yet.
    fn turn(
        &mut self,
        rules: &Rules,
        Special { body, free, .. }: &Special,
        wrench: Wrench,
    ) -> Result<Option<VelocityUpdate>, RigidBodyHandle> {
        let duration = rules.kick.duration;
        let is_felt = wrench != Wrench::ZERO;
        let turns = self.compiled.torque_possible && body.angvel != Vector::ZERO;
        if !is_felt && !turns {
            return Ok(None);
        }
        let is_alone = !is_felt || self.half.scheme == Scheme::Kick || free.is_none();
        let (update, twist) = if is_alone {
            (plainly_kicked(body, wrench, duration), DVec3::ZERO)
        } else {
            free.along(body, wrench, duration)
        };
        let spins = self.spins.includes(body, &update);
        if is_alone {
            if spins {
                self.check_speed(rules, &update)?;
                self.spins
                    .add(self.motions, body, twist, SpunUpdate::Apart(update));
                return Ok(None);
            }
            return Ok(is_felt.then_some(update));
        }
        let linvel = free.given(update.linvel);
        let given = VelocityUpdate { linvel, ..update };
        self.motions.complete_by(body.handle, Completion::Free);
        self.motions.updates.push(given);
        if spins {
            self.check_speed(rules, &given)?;
            self.spins
                .add(self.motions, body, twist, SpunUpdate::Last(given));
            return Ok(None);
        }
        Ok(Some(given))
    }
}
