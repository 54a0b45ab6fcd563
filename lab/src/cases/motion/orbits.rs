//! A body around a centre that attracts as 1/r².

use std::f64::consts::TAU;
use std::sync::Arc;

use super::super::fields;
use super::wells::whole;
use super::{Closed, Metric, Motion, Reference, Top, about, alone, each, real, summed};
use fields::Field;
use fields::math::DVec3;

/// Strength of the attraction, length³/time².
const MU: f64 = 1.0;
/// The axes of all orbits, oblique to those of the world: towards the pericentre, and along the velocity there.
const TO_PERICENTRE: DVec3 = DVec3::new(2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0);
const ALONG: DVec3 = DVec3::new(6.0 / 7.0, 2.0 / 7.0, -3.0 / 7.0);

/// Two periods and an eighth on an ellipse of semi-major axis 1, from its pericentre.
pub fn kepler(eccentricity: f64) -> Motion {
    let closed: Closed = Arc::new(move |t| {
        let e = eccentric_anomaly(t, eccentricity);
        let minor = (1.0 - eccentricity * eccentricity).sqrt();
        let (sin, cos) = e.sin_cos();
        let rate = 1.0 / (1.0 - eccentricity * cos);
        alone(
            TO_PERICENTRE * (cos - eccentricity) + ALONG * (minor * sin),
            (TO_PERICENTRE * -sin + ALONG * (minor * cos)) * rate,
        )
    });
    let duration = 2.125 * TAU;
    Motion {
        about: about(
            format!("Kepler {eccentricity}"),
            "Two periods and an eighth of an elliptic orbit, from its pericentre; against Kepler's equation.",
            (duration, "time unit"),
            (duration / 128.0, 9),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        ..attracted(closed)
    }
}

/// Kepler's equation M = E − e sin E, by bisection.
fn eccentric_anomaly(mean: f64, eccentricity: f64) -> f64 {
    let off = |e: f64| e - eccentricity * e.sin() - mean;
    let (mut low, mut high) = (mean - 1.0, mean + 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        match off(middle) > 0.0 {
            true => high = middle,
            false => low = middle,
        }
    }
    0.5 * (low + high)
}

/// A hyperbola that passes its centre at a hundredth of its semi-axis: the velocity changes within a few steps.
pub fn close_pass() -> Motion {
    let (eccentricity, far) = (1.01_f64, 2.0_f64);
    // The pericentre is 0.01 away, with a semi-axis of 1.
    let time = |h: f64| eccentricity * h.sinh() - h;
    let duration = 2.0 * time(far);
    let state = move |h: f64| {
        let rate = 1.0 / (eccentricity * h.cosh() - 1.0);
        let minor = (eccentricity * eccentricity - 1.0).sqrt();
        let position = TO_PERICENTRE * (eccentricity - h.cosh()) + ALONG * (minor * h.sinh());
        let velocity = (TO_PERICENTRE * -h.sinh() + ALONG * (minor * h.cosh())) * rate;
        (position, velocity)
    };
    // The end is the mirrored start, and no other time is used.
    let closed: Closed = Arc::new(move |_| {
        let (position, velocity) = state(far);
        alone(position, velocity)
    });
    let (position, velocity) = state(-far);
    Motion {
        about: about(
            "close pass",
            "A hyperbolic pass at a hundredth of the semi-axis from the centre; against its mirrored start.",
            (duration, "time unit"),
            (duration / 64.0, 9),
            &[(Metric::FinalState, 1e-2), (Metric::FinalState, 1e-4)],
        ),
        tops: vec![Top::point(1.0, position, velocity)],
        ..attracted(closed)
    }
}

fn attracted(closed: Closed) -> Motion {
    let first = closed(0.0)[0];
    let mu = real(MU);
    Motion {
        about: about("", "", (1.0, ""), (1.0, 1), &[(Metric::FinalState, 1e-2)]),
        tops: vec![Top::point(1.0, first.position, first.velocity)],
        gravity: DVec3::ZERO,
        scales: [1.0, 1.0],
        tree: Arc::new(move |_| whole(Field::radial(-mu, -2.0)).into()),
        forces: each(move |site| {
            let inverse = site.world_point.length_squared().recip();
            site.world_point * (-mu * inverse * inverse.sqrt())
        }),
        potential: summed(|at, _| -MU / at.length()),
        first_site_axis: None,
        reference: Reference::Closed(closed),
    }
}
