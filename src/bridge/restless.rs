//! Bodies that must not fall asleep: Rapier puts slow bodies to sleep, but a slow body under an unbalanced force is
//! about to move.

use super::constrained::Constraints;
use crate::math::{Pose, Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rapier::geometry::ContactPair;
use crate::rigid::{Body, Wrench, find_by, is_in_order};

/// The relative resolution of balance. It is the same in both precisions, because with that of `f64` bodies would take
/// minutes to settle.
const RESOLUTION: Real = f32::EPSILON as Real;

/// Forces balance if no more than this share of them is left over, which is the size of rounding.
const ROUNDING: Real = 64.0 * RESOLUTION;

/// A body that has turned back this often, within this share of Rapier's allowed linear error, may rest: a body that
/// sinks or drifts does not turn back, and one that is thrown up turns back once.
const TURNS: u8 = 2;
const PART_OF_ERROR: Real = 0.1;

/// A body held by contacts is sliding if it is accelerated by at least this share of the acceleration that contacts
/// without friction would leave it. A rolling ball has five sevenths, and may rest.
const YIELDS: Real = 0.9;

/// The bodies that are slow enough to fall asleep, in the order of their handles. Part of the saved state.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Drowsing(Vec<Drowsy>);

/// The record of a slow body from one step to the next.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct Drowsy {
    body: RigidBodyHandle,
    /// Its velocity when it became slow.
    began: Vector,
    /// Its velocity at the start of the step.
    linvel: Vector,
    /// The change of velocity over the step by fields, gravity, the user's force and damping alone.
    gain: Vector,
    bob: Bob,
}

/// The motion of a body about a place.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct Bob {
    /// The pose at which the record of this place began.
    about: Pose,
    /// Its velocity and its angular velocity, each from when it last turned back.
    heading: [Vector; 2],
    /// The number of times that each has turned back at this place.
    turns: [u8; 2],
}

impl Bob {
    fn begin(body: &Body) -> Self {
        Bob {
            about: body.pose,
            heading: [body.linvel, body.angvel],
            turns: [0; 2],
        }
    }

    /// The record one step later. It begins anew once a part of the body has moved by more than `error`.
    fn step(mut self, body: &Body, error: Real) -> Self {
        let moved = body.pose.translation - self.about.translation;
        // Twice the sine of half the angle: an arc cosine is off by 3e-4 rad in 32 bits.
        let turn = body.pose.rotation * self.about.rotation.inverse();
        let turned = 2.0 * Vector::new(turn.x, turn.y, turn.z).length();
        if moved.length() + turned * radius(body) > error {
            return Bob::begin(body);
        }
        for (which, velocity) in [body.linvel, body.angvel].into_iter().enumerate() {
            if self.heading[which].dot(velocity) < 0.0 {
                self.turns[which] = self.turns[which].saturating_add(1);
                self.heading[which] = velocity;
            }
        }
        self
    }

    fn is_finite(&self) -> bool {
        let Bob { about, heading, .. } = self;
        let pose = about.translation.is_finite() && about.rotation.is_finite();
        pose && heading.iter().all(|it| it.is_finite())
    }
}

impl Drowsing {
    fn of(&self, body: RigidBodyHandle) -> Option<&Drowsy> {
        let place = find_by(&self.0, body, |known| known.body)?;
        Some(&self.0[place])
    }

    /// Returns true if the list is sorted and finite, which a deserialized one may not be.
    pub(crate) fn is_sound(&self) -> bool {
        let finite = |it: &Drowsy| {
            let vectors = [it.began, it.linvel, it.gain];
            vectors.iter().all(|v| v.is_finite()) && it.bob.is_finite()
        };
        is_in_order(&self.0, |known| known.body) && self.0.iter().all(finite)
    }
}

/// The inputs of the decision which bodies may sleep.
#[derive(Clone, Copy)]
pub(crate) struct Balance<'a> {
    pub constraints: Constraints<'a>,
    pub gravity: Vector,
    pub parameters: &'a IntegrationParameters,
    /// The record of the last step.
    pub drowsing: &'a Drowsing,
    /// True if forces depend on time: a body that turns back is then not at rest.
    pub varies: bool,
}

/// A body that is slow enough to fall asleep, and the accelerations that act on it.
struct Pressed<'a> {
    body: &'a Body,
    wrench: Wrench,
    /// The acceleration by fields, gravity, the user's force and damping.
    acceleration: Vector,
    /// The sum of the magnitudes of its parts.
    size: Real,
    /// The change of velocity over the last step, and the part of it that `acceleration` accounts for.
    change: Option<[Vector; 2]>,
}

/// Sums over bodies that are connected by joints and contacts.
#[derive(Default)]
struct GroupMomentum {
    mass: Real,
    momentum: Vector,
    /// The sum of the magnitudes of the momenta.
    motion: Real,
    force: Vector,
    /// The impulse in a step if no forces cancelled.
    impulse: Real,
    change: Vector,
    gain: Vector,
    known: bool,
}

impl GroupMomentum {
    fn add(&mut self, it: &Pressed<'_>, dt: Real) {
        let mass = it.body.mass;
        self.mass += mass;
        self.momentum += it.body.linvel * mass;
        self.motion += it.body.linvel.length() * mass;
        self.force += it.acceleration * mass;
        self.impulse += it.size * mass * dt;
        match it.change {
            Some([change, gain]) => {
                self.change += change * mass;
                self.gain += gain * mass;
            }
            None => self.known = false,
        }
    }

    /// The error of a momentum by rounding in a step.
    fn noise(&self) -> Real {
        ROUNDING * self.impulse + 4.0 * Real::EPSILON * self.motion
    }

    /// Returns true if the group moved in the last step as fields, gravity, the users' forces and damping alone would
    /// move it, so that nothing outside the group holds it.
    fn is_free(&self) -> bool {
        (self.change - self.gain).length() <= 0.5 * self.gain.length() + self.noise()
    }

    /// Returns true if the momentum of the group stayed the same, though fields and gravity would have changed it.
    fn is_held(&self) -> bool {
        let stays = self.change.length() <= 0.5 * self.gain.length() + self.noise();
        stays && !self.is_free()
    }
}

impl Balance<'_> {
    /// Collects in `restless` the bodies under fields that are slow enough to fall asleep and must stay awake. `bodies`
    /// come in the order of their handles; the record of this step is added to `drowsing`.
    pub(crate) fn find_restless<'b>(
        &self,
        bodies: impl Iterator<Item = (&'b Body, Wrench)>,
        drowsing: &mut Drowsing,
        restless: &mut Vec<RigidBodyHandle>,
    ) {
        restless.clear();
        let drowsy = bodies.filter(|(body, _)| body.drowsy > 0.0 && !body.sleeping);
        let drowsy: Vec<_> = drowsy
            .map(|(body, wrench)| self.press(body, wrench))
            .collect();
        if drowsy.iter().all(|it| it.wrench == Wrench::ZERO) {
            return;
        }
        drowsing.0.extend(drowsy.iter().map(|it| self.remember(it)));
        for members in self.groups(&drowsy) {
            let mut group = GroupMomentum {
                known: true,
                ..GroupMomentum::default()
            };
            let members = || members.iter().map(|place| &drowsy[*place]);
            members().for_each(|it| group.add(it, self.parameters.dt));
            if members().all(|it| it.wrench == Wrench::ZERO) {
                continue;
            }
            let bobs = |it: &Pressed<'_>| {
                let known = drowsing.of(it.body.handle);
                known.map_or([false; 2], |it| {
                    it.bob.turns.map(|it| !self.varies && it >= TURNS)
                })
            };
            let restless_group = match members().next() {
                Some(it) if self.is_alone(it.body.handle) => {
                    let held = if group.known {
                        group.is_held()
                    } else {
                        // The change becomes known in the next step, unless the body sleeps by then.
                        it.body.drowsy + 1.5 * self.parameters.dt < it.body.patience
                    };
                    let [moves, turns] = [self.moves(it, &group), self.turns(it)];
                    let [back, around] = bobs(it);
                    !held && (moves && !back || turns && !around)
                }
                Some(it) => {
                    let back = members().all(|it| bobs(it)[0]);
                    group.known && group.is_free() && self.moves(it, &group) && !back
                }
                None => false,
            };
            for it in members() {
                if restless_group || (!group.is_free() && self.slides(it, drowsing)) {
                    restless.push(it.body.handle);
                }
            }
        }
        restless.sort_unstable_by_key(|body| body.into_raw_parts().0);
    }

    fn press<'b>(&self, body: &'b Body, wrench: Wrench) -> Pressed<'b> {
        let own = self.gravity * (body.gravity_scale * body.mass) + body.user_force;
        let lost = body.linvel * body.damping[0];
        let acceleration = (wrench.force + own) * body.inv_mass - lost;
        let pushed = (wrench.force.length() + own.length()) * body.inv_mass.max_element();
        // A force that was not there in the last step has not changed the velocity yet.
        let acted =
            |was: &&Drowsy| 2.0 * was.gain.length() >= acceleration.length() * self.parameters.dt;
        let change = self.before(body).filter(acted).map(|was| {
            let gain = (was.gain + acceleration * self.parameters.dt) * 0.5;
            [body.linvel - was.linvel, gain]
        });
        Pressed {
            body,
            wrench,
            acceleration,
            size: pushed + lost.length(),
            change,
        }
    }

    /// The record of a body from the last step, if it was slow then.
    fn before(&self, body: &Body) -> Option<&Drowsy> {
        let known = self.drowsing.of(body.handle);
        known.filter(|_| body.drowsy > 1.5 * self.parameters.dt)
    }

    fn remember(&self, it: &Pressed<'_>) -> Drowsy {
        let (body, linvel, was) = (it.body, it.body.linvel, self.before(it.body));
        let error = PART_OF_ERROR * self.parameters.allowed_linear_error();
        // The record of its place goes on while the body is kept from falling asleep.
        let bob = self.drowsing.of(body.handle).map(|was| was.bob);
        Drowsy {
            body: body.handle,
            began: was.map_or(linvel, |was| was.began),
            linvel,
            gain: it.acceleration * self.parameters.dt,
            bob: bob.map_or_else(|| Bob::begin(body), |bob| bob.step(body, error)),
        }
    }

    /// Returns true if no joint holds a body and no contact pushed it.
    fn is_alone(&self, body: RigidBodyHandle) -> bool {
        !self.constraints.join(body) && self.constraints.pushing(body).next().is_none()
    }

    /// The groups that are connected by joints and contacts, as indices into the list.
    fn groups(&self, drowsy: &[Pressed<'_>]) -> Vec<Vec<usize>> {
        let mut of: Vec<usize> = (0..drowsy.len()).collect();
        let root = |of: &[usize], mut place: usize| {
            while of[place] != place {
                place = of[place];
            }
            place
        };
        for (place, it) in drowsy.iter().enumerate() {
            self.constraints.each_partner(it.body.handle, |partner| {
                let Some(other) = find_by(drowsy, partner, |it| it.body.handle) else {
                    return;
                };
                let (one, other) = (root(&of, place), root(&of, other));
                let first = one.min(other);
                (of[one], of[other], of[place]) = (first, first, first);
            });
        }
        let mut groups = vec![Vec::new(); drowsy.len()];
        for place in 0..drowsy.len() {
            groups[root(&of, place)].push(place);
        }
        groups.retain(|group| !group.is_empty());
        groups
    }

    /// An acceleration, and a speed, that would move a body by less than rounding in the time for which it has been
    /// slow.
    fn least(&self, it: &Pressed<'_>) -> [Real; 2] {
        let place = it.body.pose.translation.length() + self.parameters.length_unit;
        let (time, pushed) = (it.body.drowsy, ROUNDING * it.size);
        let slight = (RESOLUTION * place / (time * time)).max(pushed);
        [slight, slight * time]
    }

    fn moves(&self, it: &Pressed<'_>, group: &GroupMomentum) -> bool {
        let [slight, slow] = self.least(it);
        let accelerates = group.force.length() > slight * group.mass;
        accelerates || group.momentum.length() > slow * group.mass
    }

    fn turns(&self, it: &Pressed<'_>) -> bool {
        let [slight, slow] = self.least(it);
        let (body, radius) = (it.body, radius(it.body));
        let turning = (body.inv_inertia * it.wrench.torque).length() * radius;
        turning > slight || body.angvel.length() * radius > slow
    }

    /// Returns true if a body held by contacts was accelerated as contacts without friction would let it.
    fn slides(&self, it: &Pressed<'_>, drowsing: &Drowsing) -> bool {
        let body = it.body;
        let jointed = self.constraints.join(body.handle);
        if jointed || it.wrench == Wrench::ZERO || body.drowsy < 0.5 * body.patience {
            return false;
        }
        let began = drowsing
            .of(body.handle)
            .map_or(body.linvel, |known| known.began);
        let left = self.unresisted(body.handle, it.acceleration);
        let gained = (body.linvel - began).dot(left);
        let slight = self.least(it)[0];
        left.length() > slight && gained > YIELDS * left.length_squared() * body.drowsy
    }

    /// The part of an acceleration that contacts without friction leave.
    fn unresisted(&self, handle: RigidBodyHandle, acceleration: Vector) -> Vector {
        let mut left = acceleration;
        // Removing the component into one contact may add one into another.
        for _ in 0..4 {
            for (pair, first) in self.constraints.pushing(handle) {
                for away in pushes(pair, first) {
                    left -= away * left.dot(away).min(0.0);
                }
            }
        }
        left
    }
}

/// The directions in which the contacts of a pair push its first side, or its second; unit vectors in world axes.
fn pushes(pair: &ContactPair, first: bool) -> impl Iterator<Item = Vector> + '_ {
    let manifolds = pair.manifolds().iter();
    let active = manifolds.filter(|manifold| !manifold.data.solver_contacts.is_empty());
    active.map(move |manifold| manifold.data.normal * if first { -1.0 } else { 1.0 })
}

/// The radius of gyration about the axis of least inertia.
fn radius(body: &Body) -> Real {
    let easiest = body.principal_inertia.inverse.max_element();
    if easiest > 0.0 {
        return (body.inv_mass.max_element() / easiest).sqrt();
    }
    0.0
}
