//! The velocities of fields that move, under schemes that choose.
//!
//! A body that rides with a field shows the field's stiffness by its motion relative to it: in a fast train a spring is
//! as stiff as at rest, but the path through the world is longer.

use super::context::StepContext;
use super::predicted::PredictedMotions;
use crate::field::{Frame, Frames};
use crate::math::{DVec3, Real, Vector, from_dvec3, to_dvec3, to_f64};
use crate::rigid::{Body, Lookup};

/// Where more fields move than this, bodies are linearised without looking for those that they ride with.
const MOST: usize = 16;

/// How fields move through the world at the start of a step; the list is reused.
#[derive(Default)]
pub(super) struct Drifts {
    /// The mean velocity of bodies on which nothing acts but each other; zero if anything else does.
    common: Vector,
    /// The anchors that move on kinematic bodies; none where bodies act on each other.
    carriers: Vec<Frame>,
}

impl Drifts {
    /// Reads the drifts `elapsed` into a step, with the velocities that `bodies` have then.
    pub(super) fn read<W: Lookup>(
        &mut self,
        context: &StepContext<'_, W>,
        motions: &mut PredictedMotions,
        bodies: &[Body],
        elapsed: f64,
    ) {
        self.carriers.clear();
        self.common = Vector::ZERO;
        if context.is_coupled() {
            if context.is_closed() {
                self.common = mean_velocity(bodies);
            }
            return;
        }
        motions.clear();
        let frames = motions.frames(context, &[], elapsed);
        let anchors = context.compiled.anchors.moving();
        let carriers = anchors.filter_map(|(_, anchor)| frames.frame(anchor));
        let moves = |it: &Frame| it.velocity != Vector::ZERO || it.angvel != Vector::ZERO;
        self.carriers.extend(carriers.filter(moves));
    }

    /// Returns true if the forces on a body change also where it stands still, so that its path does not show all of
    /// their stiffness.
    pub(super) fn are_given(&self) -> bool {
        !self.carriers.is_empty()
    }

    /// The velocity of the frame in which the path of a body is looked at: that of all bodies together if the body
    /// moves along with them, at less than half of its velocity relative to them, otherwise zero, as it is along axes
    /// along which the body is locked. A body that flies off so does not make others look as if they moved.
    pub(super) fn frame(&self, body: &Body) -> DVec3 {
        let beside = (body.linvel - self.common).length_squared();
        if 4.0 * beside >= body.linvel.length_squared() {
            return DVec3::ZERO;
        }
        let share = |mass: Real| if mass == 0.0 { 0.0 } else { 1.0 };
        let [x, y, z] = body.inv_mass.to_array().map(share);
        to_dvec3(self.common * Vector::new(x, y, z))
    }

    /// (dt·ω)⁴ of a body that has shown `fourth_power` by its path through the world, if the change of its force comes
    /// from its motion relative to the carrier, or to the bodies together, to which it is closest in velocity.
    pub(super) fn shown(&self, body: &Body, fourth_power: Real) -> Real {
        if fourth_power == 0.0 {
            return 0.0;
        }
        let common = (body.linvel - self.common).length_squared();
        let (own, least) = (body.linvel.length_squared(), self.slowest(body).min(common));
        if least < own {
            fourth_power * (own / least)
        } else {
            fourth_power
        }
    }

    /// The square of the smallest velocity of a body relative to a carrier.
    fn slowest(&self, body: &Body) -> Real {
        if self.carriers.len() > MOST {
            return 0.0;
        }
        let beside = self.carriers.iter().map(|frame| {
            let arm = body.world_com() - frame.pose.translation;
            (body.linvel - frame.velocity - frame.angvel.cross(arm)).length_squared()
        });
        beside.fold(Real::INFINITY, Real::min)
    }
}

fn mean_velocity(bodies: &[Body]) -> Vector {
    let (mut momentum, mut mass) = (DVec3::ZERO, 0.0);
    for body in bodies {
        momentum += to_dvec3(body.linvel) * to_f64(body.mass);
        mass += to_f64(body.mass);
    }
    if mass > 0.0 {
        from_dvec3(momentum / mass)
    } else {
        Vector::ZERO
    }
}
