//! The contact laws, solved in 64 bits.
//!
//! Contacts that happen at once are answered in rounds. In each round, the contacts that approach are resolved
//! together: normal impulses λ ≥ 0 such that no contact of the round approaches, or separates more slowly than its
//! restitution requires, and none is pulled (Moreau's law of impact, a linear complementarity problem). Rounds follow
//! until no contact approaches, or [`ROUNDS`] were made. Each keeps momentum and adds no energy.

use super::contact_body::ContactBody;
use super::lcp;
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, to_f64};

/// The limit of rounds; a chain of bodies needs about one for each body.
const ROUNDS: usize = 64;

/// After the first round, an approach slower than this share of the faster part's speed is rounding.
const AT_REST: f64 = 16.0 * Real::EPSILON as f64;

/// Impulses that do more than this many times the energy that bodies bring as work are no impact: where no energy is
/// added they do four times as much at most, as on a ball thrown back. Such contacts are answered one after the other
/// instead, this many times, without rebound.
const JAMMED: f64 = 8.0;
const SWEEPS: usize = 8;

/// The largest number of connected contacts that are solved together, because the cost is the cube of their number.
/// Further ones are solved one after the other.
const MOST_AT_ONCE: usize = 48;

/// A point at which two parts touch, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactPoint {
    pub point: DVec3,
    /// Unit vector from the first part to the second.
    pub normal: DVec3,
    pub depth: f64,
}

/// A contact point to be answered.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactConstraint {
    /// Indices into the list of bodies; `None` for a side without a body.
    pub places: [Option<usize>; 2],
    pub point: DVec3,
    /// Unit vector from the first side to the second.
    pub normal: DVec3,
    pub depth: f64,
    pub law: ContactLaw,
    /// The velocity changes of the two sides by the paper's law.
    pub pushes: [DVec3; 2],
    /// Contacts that approach at this speed or below it are treated as resting and get no impulse.
    pub resting_speed: f64,
    /// The impulses on the two sides so far, in world axes.
    pub impulses: [DVec3; 2],
    /// True if its answer was not finite; it is then left out.
    pub failed: bool,
}

impl ContactConstraint {
    /// A contact point that has no impulse yet.
    pub(super) fn new(
        law: ContactLaw,
        resting_speed: f64,
        places: [Option<usize>; 2],
        spot: ContactPoint,
    ) -> Self {
        ContactConstraint {
            places,
            point: spot.point,
            normal: spot.normal,
            depth: spot.depth,
            law,
            pushes: [DVec3::ZERO; 2],
            resting_speed,
            impulses: [DVec3::ZERO; 2],
            failed: false,
        }
    }

    pub(super) fn velocities(&self, bodies: &[ContactBody]) -> [DVec3; 2] {
        let velocity = |place: usize| bodies[place].velocity_at(self.point);
        self.places.map(|place| place.map_or(DVec3::ZERO, velocity))
    }

    /// The speed at which the two parts approach along the normal; negative if they separate.
    pub(super) fn approach(&self, bodies: &[ContactBody]) -> f64 {
        let [first, second] = self.velocities(bodies);
        (first - second).dot(self.normal)
    }

    /// Turns an impact into a lasting contact. If `falls`, because the contact was lifted off Rapier's solver, the
    /// approach and the acceleration into the contact are removed. Otherwise Rapier holds it, and it is not answered.
    pub(super) fn lay_down(&mut self, falls: bool, bodies: &mut [ContactBody]) {
        if !falls {
            self.law = ContactLaw::Observe;
            return;
        }
        let friction = match self.law {
            ContactLaw::Impulse { friction, .. } => friction,
            _ => 0.0,
        };
        self.law = ContactLaw::restitution(0.0).with_friction(friction);
        self.resting_speed = 0.0;
        let yields = |place: usize| bodies[place].resistance.inverse_mass.max_element();
        let shares = self.places.map(|it| it.map_or(0.0, yields));
        let pressing = self.pressing(bodies);
        let whole = shares[0] + shares[1];
        if pressing <= 0.0 || whole <= 0.0 {
            return;
        }
        for (place, share) in self.places.into_iter().zip([-shares[0], shares[1]]) {
            if let Some(place) = place {
                bodies[place].acceleration += self.normal * (pressing * share / whole);
                bodies[place].pushed = true;
            }
        }
    }

    /// The relative acceleration of the two parts into the contact.
    fn pressing(&self, bodies: &[ContactBody]) -> f64 {
        let acceleration = |place: usize| bodies[place].acceleration;
        let [first, second] = self.places.map(|it| it.map_or(DVec3::ZERO, acceleration));
        (first - second).dot(self.normal)
    }

    /// The normal speed at which two parts that approach at `approach` are to separate. The speed that they gained
    /// within the overlap is neither lost nor returned twice. Zero if the rebound is below the resting threshold.
    fn rebound(&self, bodies: &[ContactBody], restitution: f64, approach: f64) -> f64 {
        let pressing = self.pressing(bodies).max(0.0);
        let gained = (2.0 * pressing * self.depth.max(0.0)).min(approach * approach);
        let touching = restitution * (approach * approach - gained).sqrt();
        if touching <= self.resting_speed {
            return 0.0;
        }
        (touching * touching + gained).sqrt()
    }

    /// An approach slower than this is rounding.
    pub(super) fn rounding(&self, bodies: &[ContactBody]) -> f64 {
        let [first, second] = self.velocities(bodies).map(DVec3::length);
        first.max(second) * AT_REST
    }
}

/// The body between the stiffest springs of a response.
#[derive(Clone, Copy)]
pub(super) struct Sprung {
    /// Its index in the list of bodies.
    pub place: usize,
    /// An upper bound of the square of its angular frequency there.
    pub omega2: f64,
}

/// Answers contact points that happen at once, and updates the bodies. `dt` is the time for which a penalty force acts.
/// Returns the body between the stiffest springs.
pub(super) fn resolve(
    bodies: &mut [ContactBody],
    constraints: &mut [ContactConstraint],
    dt: f64,
) -> Option<Sprung> {
    let mut solver = Solver {
        bodies,
        constraints,
    };
    solver.leave_out_unsound();
    let stiffest = solver.stiffest();
    solver.push_once();
    solver.spring(dt);
    for round in 0..ROUNDS {
        let approaching = solver.approaching(round);
        if approaching.is_empty() {
            break;
        }
        for cluster in solver.clusters(&approaching) {
            solver.impact(&cluster);
        }
    }
    solver.take_back_unsound();
    stiffest
}

struct Solver<'a> {
    bodies: &'a mut [ContactBody],
    constraints: &'a mut [ContactConstraint],
}

impl Solver<'_> {
    /// Marks contacts with quantities that are not finite as failed; they are not answered.
    fn leave_out_unsound(&mut self) {
        for number in 0..self.constraints.len() {
            let constraint = &self.constraints[number];
            let yields = self.inverse_effective_mass(constraint, constraint.normal);
            let sound = yields.is_finite()
                && constraint.approach(self.bodies).is_finite()
                && constraint.pushes.iter().all(|push| push.is_finite());
            if !sound && constraint.law != ContactLaw::Observe {
                let constraint = &mut self.constraints[number];
                (constraint.law, constraint.failed) = (ContactLaw::Observe, true);
            }
        }
    }

    /// Removes the impulses of contacts whose bodies end with a velocity that is not finite, and marks them as failed.
    fn take_back_unsound(&mut self) {
        let sound = |it: &ContactBody| it.linvel.is_finite() && it.angvel.is_finite();
        if self.bodies.iter().all(|it| sound(it) || !it.pushed) {
            return;
        }
        for constraint in self.constraints.iter_mut() {
            let mut places = constraint.places.iter().flatten();
            if constraint.impulses != [DVec3::ZERO; 2]
                && places.any(|place| !sound(&self.bodies[*place]))
            {
                constraint.impulses = [DVec3::ZERO; 2];
                constraint.failed = true;
            }
        }
    }

    /// Applies the laws that act once a step, all with the velocities before any of them.
    fn push_once(&mut self) {
        let pushes = self.constraints.iter().map(|it| self.push_of(it));
        let pushes: Vec<[DVec3; 2]> = pushes.collect();
        for (number, impulses) in pushes.into_iter().enumerate() {
            if impulses != [DVec3::ZERO; 2] {
                self.apply(number, impulses);
            }
        }
    }

    fn push_of(&self, constraint: &ContactConstraint) -> [DVec3; 2] {
        let pushes = constraint.law.is_vector()
            && constraint.approach(self.bodies) > constraint.resting_speed;
        if !pushes {
            return [DVec3::ZERO; 2];
        }
        let mass = |place: usize| self.bodies[place].mass();
        [0, 1].map(|part| constraint.pushes[part] * constraint.places[part].map_or(0.0, mass))
    }

    /// Applies the penalty laws. Damping is solved for the approach speed that all springs together leave in the middle
    /// of the next step (implicit Euler). So at any strength, and with any number of springs on one body, damping turns
    /// no body back, and a loaded body does not creep.
    fn spring(&mut self, dt: f64) {
        let mut damped = Vec::new();
        for number in 0..self.constraints.len() {
            let constraint = &self.constraints[number];
            let ContactLaw::Penalty { stiffness, damping } = constraint.law else {
                continue;
            };
            let push = constraint.normal * (to_f64(stiffness) * constraint.depth.max(0.0) * dt);
            if to_f64(damping) * dt > 0.0 {
                damped.push(number);
            } else if push != DVec3::ZERO {
                self.apply(number, [-push, push]);
            }
        }
        for cluster in self.clusters(&damped) {
            self.damp(&cluster, dt);
        }
    }

    /// Solves the springs of a cluster together, for λ ≥ 0:
    /// λ/dt = k·depth + c·(approach − the part of it that the λ remove).
    fn damp(&mut self, cluster: &[usize], dt: f64) {
        let mut matrix = self.couplings(cluster);
        let mut wanted = Vec::with_capacity(cluster.len());
        for (place, number) in cluster.iter().enumerate() {
            let constraint = &self.constraints[*number];
            let ContactLaw::Penalty { stiffness, damping } = constraint.law else {
                continue;
            };
            matrix[place * cluster.len() + place] += (to_f64(damping) * dt).recip();
            let spring = to_f64(stiffness) * constraint.depth / to_f64(damping);
            let midway = 0.5 * dt * constraint.pressing(self.bodies);
            wanted.push(spring + constraint.approach(self.bodies) + midway);
        }
        self.push_apart(cluster, &lcp::solve(&matrix, &wanted));
    }

    /// The body between the stiffest springs. By Gershgorin's circles, a contact oscillates no faster than all contacts
    /// of its two bodies together.
    fn stiffest(&self) -> Option<Sprung> {
        let constraints = self.constraints.iter();
        let springs = constraints.filter_map(|constraint| match constraint.law {
            ContactLaw::Penalty { stiffness, .. } => Some((constraint, to_f64(stiffness))),
            _ => None,
        });
        let share = |constraint: &ContactConstraint, place: usize| {
            let (point, normal) = (constraint.point, constraint.normal);
            self.bodies[place].answer(point, point, normal).dot(normal)
        };
        let mut sums = Vec::new();
        for (constraint, stiffness) in springs.clone() {
            sums.resize(self.bodies.len(), 0.0);
            for place in constraint.places.into_iter().flatten() {
                sums[place] += stiffness * share(constraint, place);
            }
        }
        let sum = |place: Option<usize>| place.map_or(0.0, |place| sums[place]);
        let bounds = springs.filter_map(|(constraint, _)| {
            let [a, b] = constraint.places.map(sum);
            let place = constraint.places[usize::from(b > a)]?;
            Some(Sprung {
                place,
                omega2: a + b,
            })
        });
        bounds.max_by(|one, other| one.omega2.total_cmp(&other.omega2))
    }

    /// The contacts that Newton's law answers in this round.
    fn approaching(&self, round: usize) -> Vec<usize> {
        let approaches = |number: &usize| {
            let constraint = &self.constraints[*number];
            if !matches!(constraint.law, ContactLaw::Impulse { .. }) {
                return false;
            }
            let rounding = match round {
                0 => constraint.resting_speed,
                _ => constraint
                    .rounding(self.bodies)
                    .max(constraint.resting_speed),
            };
            let yields = self.inverse_effective_mass(constraint, constraint.normal);
            constraint.approach(self.bodies) > rounding && yields > 0.0
        };
        (0..self.constraints.len()).filter(approaches).collect()
    }

    /// Groups of contacts that are connected through movable bodies.
    fn clusters(&self, contacts: &[usize]) -> Vec<Vec<usize>> {
        // Union-find: a set of connected bodies is named by its root.
        let mut parent: Vec<usize> = (0..self.bodies.len()).collect();
        fn find(parent: &mut [usize], mut one: usize) -> usize {
            while parent[one] != one {
                parent[one] = parent[parent[one]];
                one = parent[one];
            }
            one
        }
        let movable = |place: Option<usize>| {
            place.filter(|place| {
                let resistance = &self.bodies[*place].resistance;
                resistance.inverse_mass != DVec3::ZERO
                    || resistance.rotor.inverse_moments != DVec3::ZERO
            })
        };
        for number in contacts {
            if let [Some(a), Some(b)] = self.constraints[*number].places.map(movable) {
                let (a, b) = (find(&mut parent, a), find(&mut parent, b));
                parent[a.max(b)] = a.min(b);
            }
        }
        let mut clusters: Vec<(usize, Vec<usize>)> = Vec::new();
        for number in contacts {
            let [a, b] = self.constraints[*number].places.map(movable);
            let Some(member) = a.or(b) else { continue };
            let name = find(&mut parent, member);
            match clusters.iter_mut().find(|(known, _)| *known == name) {
                Some((_, list)) if list.len() < MOST_AT_ONCE => list.push(*number),
                _ => clusters.push((name, vec![*number])),
            }
        }
        clusters.into_iter().map(|(_, list)| list).collect()
    }

    /// The relative velocity along a direction, at a contact's point, that a unit impulse along it there gives the two
    /// sides.
    fn inverse_effective_mass(&self, constraint: &ContactConstraint, direction: DVec3) -> f64 {
        let point = constraint.point;
        let answer = |place: usize| self.bodies[place].answer(point, point, direction);
        let [first, second] = constraint.places.map(|it| it.map_or(DVec3::ZERO, answer));
        (first + second).dot(direction)
    }

    /// The change of the separation speed at contact `i` by a unit impulse at contact `j`.
    fn coupling(&self, i: usize, j: usize) -> f64 {
        let (here, there) = (&self.constraints[i], &self.constraints[j]);
        let mut sum = 0.0;
        for (part, place) in here.places.iter().enumerate() {
            for (other, by) in there.places.iter().enumerate() {
                let (Some(place), true) = (place, place == by) else {
                    continue;
                };
                let sign = if part == other { 1.0 } else { -1.0 };
                let answer = self.bodies[*place].answer(here.point, there.point, there.normal);
                sum += sign * answer.dot(here.normal);
            }
        }
        sum
    }

    /// The changes of the separation speeds at the contacts of a cluster by unit impulses at each, in rows.
    fn couplings(&self, cluster: &[usize]) -> Vec<f64> {
        let size = cluster.len();
        let mut matrix = vec![0.0; size * size];
        for (row, i) in cluster.iter().enumerate() {
            for (column, j) in cluster.iter().enumerate() {
                matrix[row * size + column] = self.coupling(*i, *j);
            }
        }
        matrix
    }

    /// Applies normal impulses of these sizes to the contacts of a cluster.
    fn push_apart(&mut self, cluster: &[usize], sizes: &[f64]) {
        for (number, size) in cluster.iter().zip(sizes) {
            let impulse = self.constraints[*number].normal * *size;
            self.apply(*number, [-impulse, impulse]);
        }
    }

    /// Resolves the impacts of a cluster together.
    fn impact(&mut self, cluster: &[usize]) {
        let wanted = |i: &usize| {
            let constraint = &self.constraints[*i];
            let ContactLaw::Impulse { restitution, .. } = constraint.law else {
                return 0.0;
            };
            let approach = constraint.approach(self.bodies);
            approach + constraint.rebound(self.bodies, to_f64(restitution), approach)
        };
        let wanted: Vec<f64> = cluster.iter().map(wanted).collect();
        let matrix = self.couplings(cluster);
        let mut sizes = lcp::solve(&matrix, &wanted);
        // Two sides that do not yield and close on a body let no velocity meet all contacts, or only a rotation without
        // measure.
        let work: f64 = sizes.iter().zip(&wanted).map(|(x, b)| x * b).sum();
        if cluster.len() > 1 && 0.5 * work > JAMMED * self.energy(cluster) {
            let approach = |i: &usize| self.constraints[*i].approach(self.bodies);
            let approaches: Vec<f64> = cluster.iter().map(approach).collect();
            sizes = lcp::relax(&matrix, &approaches, SWEEPS);
        }
        self.push_apart(cluster, &sizes);
        for (number, size) in cluster.iter().zip(sizes) {
            self.friction(*number, size);
        }
    }

    /// The energy that the contacts of a cluster bring, at most: that of the rotation of its bodies, and of all of its
    /// masses at the speed of the fastest one, in the frame of the first body.
    fn energy(&self, cluster: &[usize]) -> f64 {
        let constraints = || cluster.iter().map(|number| &self.constraints[*number]);
        let mut places: Vec<usize> = constraints().flat_map(|it| it.places).flatten().collect();
        places.sort_unstable();
        places.dedup();
        let bodies = || places.iter().map(|place| &self.bodies[*place]);
        let frame = bodies().next().map_or(DVec3::ZERO, |it| it.linvel);
        let sides = constraints().flat_map(|it| it.velocities(self.bodies));
        let speeds = sides.chain(bodies().map(|it| it.linvel));
        let fastest = speeds.map(|speed| (speed - frame).length_squared());
        let fastest = fastest.fold(0.0, f64::max);
        // Of a body whose centre cannot move, the mass that yields at its contacts counts.
        let yielding = constraints().map(|it| self.inverse_effective_mass(it, it.normal).recip());
        let masses: f64 = bodies().map(ContactBody::mass).chain(yielding).sum();
        let turning = |it: &ContactBody| {
            let rotor = &it.resistance.rotor;
            rotor.twice_energy(it.attitude, it.angvel)
        };
        0.5 * (fastest * masses + bodies().map(turning).sum::<f64>())
    }

    /// Applies Coulomb friction at a contact that got a normal impulse of a given size.
    fn friction(&mut self, number: usize, size: f64) {
        let constraint = self.constraints[number];
        let ContactLaw::Impulse { friction, .. } = constraint.law else {
            return;
        };
        let most = to_f64(friction) * size;
        if most <= 0.0 {
            return;
        }
        let [first, second] = constraint.velocities(self.bodies);
        let slip = (second - first).reject_from_normalized(constraint.normal);
        let Some(direction) = slip.try_normalize() else {
            return;
        };
        let yields = self.inverse_effective_mass(&constraint, direction);
        if yields > 0.0 {
            let impulse = direction * -(slip.length() / yields).min(most);
            self.apply(number, [-impulse, impulse]);
        }
    }

    fn apply(&mut self, number: usize, impulses: [DVec3; 2]) {
        let constraint = &mut self.constraints[number];
        for (part, impulse) in impulses.into_iter().enumerate() {
            constraint.impulses[part] += impulse;
            if let Some(place) = constraint.places[part] {
                self.bodies[place].push(constraint.point, impulse);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::contact_body::Resistance;
    use crate::math::DQuat;
    use crate::rigid::Rotor;

    /// Once, an answer by mass properties that are not finite was left out without a warning.
    #[test]
    fn an_answer_that_is_not_finite_fails() {
        let body = |principal_to_body| ContactBody {
            resistance: Resistance {
                inverse_mass: DVec3::ONE,
                rotor: Rotor {
                    inverse_moments: DVec3::ONE,
                    principal_to_body,
                },
                may_turn: DVec3::ONE,
            },
            com: DVec3::ZERO,
            attitude: DQuat::IDENTITY,
            linvel: DVec3::X,
            angvel: DVec3::ZERO,
            acceleration: DVec3::ZERO,
            pushed: false,
        };
        let nowhere = DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0);
        for (frame, fails) in [(DQuat::IDENTITY, false), (nowhere, true)] {
            let mut bodies = [body(frame)];
            let spot = ContactPoint {
                point: DVec3::new(0.5, 0.1, 0.0),
                normal: DVec3::X,
                depth: 0.0,
            };
            let places = [Some(0), None];
            let mut constraints = [ContactConstraint::new(
                ContactLaw::elastic(),
                0.0,
                places,
                spot,
            )];
            resolve(&mut bodies, &mut constraints, 0.01);
            assert_eq!(constraints[0].failed, fails);
            assert_eq!(constraints[0].impulses == [DVec3::ZERO; 2], fails);
            assert!(bodies[0].linvel.is_finite());
        }
    }
}
