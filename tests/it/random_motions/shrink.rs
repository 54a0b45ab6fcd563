//! The smallest motion that shows a fault.

use rapier3d_fields::math::{DQuat, DVec3};

use super::by_hand::{Body, Motion, Push};

type EditBody = fn(&mut Body);
type EditPush = fn(&mut Push);

const OF_BODY: [EditBody; 13] = [
    |it| it.sites.truncate(1),
    |it| it.centre = DVec3::ZERO,
    |it| it.axes = DQuat::IDENTITY,
    |it| it.moments = DVec3::new(1.0, 1.2, 1.4),
    |it| it.pose.axes = DQuat::IDENTITY,
    |it| it.spin = DVec3::ZERO,
    |it| it.velocity = DVec3::ZERO,
    |it| it.user_force = DVec3::ZERO,
    |it| (it.damping, it.turn_damping) = (0.0, 0.0),
    |it| it.gravity_scale = 1.0,
    |it| it.free = DVec3::ONE,
    |it| (it.can_turn, it.spin) = (true, DVec3::ZERO),
    |it| it.mass = 1.0,
];

const OF_PUSH: [EditPush; 4] = [
    |it| it.grows = false,
    |it| it.reacts = false,
    |it| it.frame.axes = DQuat::IDENTITY,
    |it| it.frame.origin = DVec3::ONE,
];

/// Motions that are simpler in one respect.
fn simpler(motion: &Motion) -> Vec<Motion> {
    let mut all = Vec::new();
    for push in 0..motion.pushes.len() {
        let mut less = motion.clone();
        less.pushes.remove(push);
        all.push(less);
    }
    for body in 0..motion.bodies.len() {
        let mut less = motion.clone();
        less.bodies.remove(body);
        less.pushes.retain(|it| it.carrier != Some(body));
        for push in &mut less.pushes {
            push.carrier = push.carrier.map(|it| if it > body { it - 1 } else { it });
        }
        all.push(less);
        for edit in OF_BODY {
            let mut less = motion.clone();
            edit(&mut less.bodies[body]);
            all.push(less);
        }
    }
    for push in 0..motion.pushes.len() {
        for edit in OF_PUSH {
            let mut less = motion.clone();
            edit(&mut less.pushes[push]);
            all.push(less);
        }
    }
    let gravity = DVec3::ZERO;
    all.push(Motion {
        gravity,
        ..motion.clone()
    });
    all
}

/// Makes a motion simpler for as long as it is wrong.
pub fn smallest(motion: &Motion, is_wrong: impl Fn(&Motion) -> bool) -> Motion {
    let mut smallest = motion.clone();
    loop {
        let size = |motion: &Motion| format!("{motion:?}");
        let now = size(&smallest);
        let less = simpler(&smallest)
            .into_iter()
            .filter(|it| {
                !it.bodies.is_empty()
                    && it.pushes.iter().any(|push| push.carrier.is_none())
                    && size(it) != now
            })
            .find(|it| is_wrong(it));
        match less {
            Some(less) => smallest = less,
            None => return smallest,
        }
    }
}
