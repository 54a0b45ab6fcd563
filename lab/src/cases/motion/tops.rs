//! Bodies that spin without torque.

use std::sync::Arc;

use super::super::fields;
use super::wells::whole;
use super::{Metric, Motion, Reference, State, Top, about, each, real, summed};
use fields::Field;
use fields::math::DVec3;

const MASS: f64 = 2.0;
const MOMENTS: DVec3 = DVec3::new(1.5, 2.6, 1.2);
/// N/m
const STIFFNESS: f64 = 80.0;

/// A spin close to the intermediate axis, which is unstable: the top tumbles.
pub fn asymmetric_top() -> Motion {
    turning(
        about(
            "top",
            "An asymmetric top tumbles about its middle axis while a weak spring holds it; against converged f64.",
            (8.0, "s"),
            (0.125, 8),
            &[(Metric::Attitude, 1e-2), (Metric::Attitude, 1e-4)],
        ),
        DVec3::new(-3.0, 0.05, -0.03),
        1.0,
    )
}

/// A fast spin on a strong spring.
pub fn spinning_in_a_spring() -> Motion {
    turning(
        about(
            "spinning in a spring",
            "The same top spins fast while it swings on a spring; against converged f64.",
            (2.0, "s"),
            (0.0625, 8),
            &[(Metric::FinalState, 1e-2), (Metric::Attitude, 1e-2)],
        ),
        DVec3::new(4.0, 9.0, -6.0),
        STIFFNESS,
    )
}

fn turning(about: super::About, angvel: DVec3, stiffness: f64) -> Motion {
    let k = real(stiffness);
    let position = DVec3::new(0.6, -0.3, 0.2);
    Motion {
        about,
        tops: vec![Top {
            moments: MOMENTS,
            start: State {
                momentum: MOMENTS * angvel,
                ..Top::point(MASS, position, DVec3::new(0.5, 1.0, 2.0)).start
            },
            ..Top::point(MASS, position, DVec3::ZERO)
        }],
        gravity: DVec3::ZERO,
        scales: [1.0, (stiffness / MASS).sqrt()],
        tree: Arc::new(move |_| whole(Field::spring(k)).into()),
        forces: each(move |site| site.world_point * -k),
        potential: summed(move |at, _| 0.5 * stiffness * at.length_squared()),
        first_site_axis: None,
        reference: Reference::Converged,
    }
}
