//! One body in a force of one formula: fall, springs, drag.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::super::fields;
use super::{Closed, Metric, Motion, Reference, Top, about, alone, each, real, summed};
use fields::Coupling;
use fields::Field;
use fields::math::{DVec3, Vector};

/// The initial position: 1 m from the origin, oblique to the axes.
const START: DVec3 = DVec3::new(2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0);
/// kg
const MASS: f64 = 1.0;
const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);

/// A throw in a field of uniform gravity, which schemes of second order integrate exactly at any step.
pub fn fall() -> Motion {
    let (velocity, pull) = (DVec3::new(3.0, 5.0, -2.0), GRAVITY);
    let closed: Closed = Arc::new(move |t| {
        let position = START + velocity * t + pull * (0.5 * t * t);
        alone(position, velocity + pull * t)
    });
    let force = Vector::Y * real(GRAVITY.y);
    Motion {
        about: about(
            "fall",
            "A ball thrown up in a field of 9.81 m/s²; against the parabola.",
            (1.0, "s"),
            (1.0 / 8.0, 8),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        tops: vec![Top::point(MASS, START, velocity)],
        gravity: DVec3::ZERO,
        scales: [1.0, 9.81],
        tree: Arc::new(move |_| whole(Field::uniform(force)).into()),
        forces: each(move |_| force),
        potential: summed(|at, _| -GRAVITY.y * at.y),
        first_site_axis: None,
        reference: Reference::Closed(closed),
    }
}

/// A ball of 1 kg on a spring of 1 Hz, let go at 1 m, for ten and a quarter periods.
///
/// The quarter is needed because the first-order error of `Kick` cancels after whole periods.
pub fn spring() -> Motion {
    let about = about(
        "spring",
        "A ball on a spring of 1 Hz, let go at 1 m, ten and a quarter periods; against the closed form.",
        (10.25, "s"),
        (1.0 / 16.0, 9),
        &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
    );
    Motion {
        about,
        ..sprung(TAU, DVec3::ZERO)
    }
}

/// The same under Rapier's gravity.
pub fn spring_under_gravity() -> Motion {
    let about = about(
        "spring under gravity",
        "The same under Rapier's gravity, around where it would hang at rest; against the closed form.",
        (10.25, "s"),
        (1.0 / 16.0, 9),
        &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
    );
    Motion {
        about,
        ..sprung(TAU, GRAVITY)
    }
}

/// A spring so stiff that the longest step covers several of its periods.
pub fn stiff_well() -> Motion {
    let about = about(
        "stiff well",
        "A spring of 32 Hz: the longest steps turn it by 25 rad, the shortest by 0.1; against the closed form.",
        (1.0 + 1.0 / 128.0, "s"),
        ((1.0 + 1.0 / 128.0) / 8.0, 9),
        &[(Metric::FinalState, 0.1)],
    );
    Motion {
        about,
        ..sprung(32.0 * TAU, DVec3::ZERO)
    }
}

fn sprung(omega: f64, gravity: DVec3) -> Motion {
    let stiffness = MASS * omega * omega;
    let closed: Closed = Arc::new(move |t| {
        let hangs = gravity / (omega * omega);
        let (sin, cos) = (omega * t).sin_cos();
        let swing = START - hangs;
        alone(hangs + swing * cos, swing * (-omega * sin))
    });
    let k = real(stiffness);
    Motion {
        about: about("", "", (1.0, "s"), (1.0, 1), &[(Metric::FinalState, 1e-2)]),
        tops: vec![Top::point(MASS, START, DVec3::ZERO)],
        gravity,
        scales: [1.0, omega],
        tree: Arc::new(move |_| whole(Field::spring(k)).into()),
        forces: each(move |site| site.world_point * -k),
        potential: summed(move |at, _| 0.5 * stiffness * at.length_squared()),
        first_site_axis: None,
        reference: Reference::Closed(closed),
    }
}

/// A ball under Rapier's gravity in strong drag: rate × dt is about 6 at the longest step.
pub fn drag() -> Motion {
    let (rate, velocity) = (50.0, DVec3::new(3.0, 5.0, -2.0));
    let closed: Closed = Arc::new(move |t| {
        let terminal = GRAVITY / rate;
        let decay = (-rate * t).exp();
        let position = START + terminal * t + (velocity - terminal) * ((1.0 - decay) / rate);
        alone(position, terminal + (velocity - terminal) * decay)
    });
    let k = real(MASS * rate);
    Motion {
        about: about(
            "drag",
            "A ball thrown up under Rapier's gravity in drag of 50 /s, 0.5 s; against the closed form.",
            (0.5, "s"),
            (0.125, 9),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        tops: vec![Top::point(MASS, START, velocity)],
        gravity: GRAVITY,
        // Distance over which the throw decays, and terminal speed.
        scales: [velocity.length() / rate, 9.81 / rate],
        tree: Arc::new(move |_| whole(Field::drag(k, 0.0)).into()),
        forces: each(move |site| site.velocity * -k),
        potential: None,
        first_site_axis: None,
        reference: Reference::Closed(closed),
    }
}

/// A field that acts with its whole vector on every site.
pub(super) fn whole(field: Field) -> Field {
    field.coupled_to(Coupling::Each)
}
