//! Charges in uniform electric and magnetic fields.

use std::sync::Arc;

use super::super::fields;
use super::{Closed, Metric, Motion, Reference, State, Top, about, alone, each, summed};
use fields::math::{DVec3, from_dvec3};
use fields::{Axis, Field};

/// Tesla, if the charge is in coulombs.
const MAGNETIC: DVec3 = DVec3::new(1.0, 3.0, 6.0);
const VELOCITY: DVec3 = DVec3::new(1.0, -0.5, 2.0);
const MASS: f64 = 0.7;

/// A charge on a helix around a magnetic field.
pub fn helix() -> Motion {
    Motion {
        about: about(
            "helix",
            "A charge in a uniform magnetic field, three turns and more; against the helix.",
            (2.0, "s"),
            (0.125, 9),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        ..winding(DVec3::ZERO)
    }
}

/// A charge drifts across crossed fields.
pub fn crossed_fields() -> Motion {
    Motion {
        about: about(
            "E × B",
            "A charge in uniform electric and magnetic fields; against the drifting helix.",
            (2.0, "s"),
            (0.125, 9),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        ..winding(DVec3::new(4.0, -2.0, 1.0))
    }
}

fn winding(electric: DVec3) -> Motion {
    let closed: Closed = Arc::new(move |t| {
        let size = MAGNETIC.length();
        let (axis, turn) = (MAGNETIC / size, size / MASS);
        let drift = electric.cross(MAGNETIC) / (size * size);
        let (speed, pull) = (VELOCITY.dot(axis), electric.dot(axis) / MASS);
        let around = VELOCITY - axis * speed - drift;
        let (sin, cos) = (turn * t).sin_cos();
        let aside = around.cross(axis);
        let along = axis * (speed * t + 0.5 * pull * t * t);
        let position = drift * t + along + (around * sin + aside * (1.0 - cos)) / turn;
        let velocity = drift + axis * (speed + pull * t) + around * cos + aside * sin;
        alone(position, velocity)
    });
    let (b, e) = (from_dvec3(MAGNETIC), from_dvec3(electric));
    Motion {
        about: about("", "", (1.0, ""), (1.0, 1), &[(Metric::FinalState, 1e-2)]),
        tops: vec![Top::point(MASS, DVec3::ZERO, VELOCITY)],
        gravity: DVec3::ZERO,
        scales: [
            VELOCITY.length() * MASS / MAGNETIC.length(),
            VELOCITY.length(),
        ],
        tree: Arc::new(move |_| {
            let push = Field::uniform(e).coupled_to_axis(Axis::Charge);
            Field::magnetic(b).sum_union(push)
        }),
        forces: each(move |site| (site.velocity.cross(b) + e) * site.charge),
        potential: summed(move |at, charge| -charge * electric.dot(at)),
        first_site_axis: None,
        reference: Reference::Closed(closed),
    }
}

/// A rigid body with a charge at either end swings and spins in a uniform electric field.
pub fn dipole() -> Motion {
    let electric = DVec3::new(1.0, -2.0, 6.0);
    let moments = DVec3::new(0.9, 0.5, 1.2);
    let arm = DVec3::new(0.1, 0.2, 0.5);
    let e = from_dvec3(electric);
    Motion {
        about: about(
            "dipole",
            "An asymmetric top with opposite charges swings and spins in an electric field; against converged f64.",
            (4.0, "s"),
            (0.0625, 8),
            &[(Metric::Attitude, 1e-2), (Metric::Attitude, 1e-4)],
        ),
        tops: vec![Top {
            moments,
            start: State {
                momentum: moments * DVec3::new(0.6, 1.5, -0.4),
                ..State::default()
            },
            sites: vec![(arm, 3.0), (-arm, -3.0)],
            ..Top::point(1.3, DVec3::ZERO, DVec3::ZERO)
        }],
        gravity: DVec3::ZERO,
        scales: [1.0, 1.0],
        tree: Arc::new(move |_| Field::uniform(e).coupled_to_axis(Axis::Charge).into()),
        forces: each(move |site| e * site.charge),
        potential: summed(move |at, charge| -charge * electric.dot(at)),
        first_site_axis: None,
        reference: Reference::Converged,
    }
}
