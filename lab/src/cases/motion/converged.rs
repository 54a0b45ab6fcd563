//! Reference solutions: the equations of motion at steps so short that shorter ones change nothing.

use super::fields;
use super::{Motion, Site, Top};
use crate::study::State;
use fields::math::{DQuat, DVec3, Vector, from_dvec3, from_f64, to_dvec3};

/// Number of steps to begin with.
const STEPS: u32 = 1 << 10;
/// Maximum number of steps.
const MOST: u32 = 1 << 17;
/// Steps are halved until the end moves by no more than this share of the scene's length and speed.
const CONVERGED: f64 = 1e-12;
/// Changes below this may be rounding.
const SMALL: f64 = 1e-8;

impl Motion {
    /// Final states by the classical Runge-Kutta scheme, with steps halved until that changes nothing more, and the
    /// change by the last halving, relative to the scales of the scene.
    pub fn converged(&self) -> (Vec<State>, f64) {
        let (mut steps, mut last_change) = (STEPS, f64::INFINITY);
        let mut last = self.by_runge_kutta(steps);
        loop {
            steps *= 2;
            let next = self.by_runge_kutta(steps);
            let change = self.distance(&last, &next);
            // Halving the step divides errors of the scheme by sixteen: a change that falls by much less is rounding.
            let rounding = change < SMALL && change > 0.25 * last_change;
            if change <= CONVERGED || rounding || steps >= MOST {
                return (next, change);
            }
            (last, last_change) = (next, change);
        }
    }

    /// Distance of [`converged`](Self::converged) from the reference, relative to the scales of the scene, and the
    /// change by the last halving of the steps.
    pub fn doubt(&self) -> (f64, f64) {
        let (end, change) = self.converged();
        (self.distance(&end, &self.end()), change)
    }

    fn distance(&self, a: &[State], b: &[State]) -> f64 {
        let [length, speed] = self.scales;
        let off = a.iter().zip(b).map(|(a, b)| {
            a.position.distance(b.position) / length
                + a.velocity.distance(b.velocity) / speed
                + a.angle_to(b)
        });
        off.sum()
    }

    fn by_runge_kutta(&self, steps: u32) -> Vec<State> {
        let h = self.about.duration / f64::from(steps);
        let mut states: Vec<State> = self.tops.iter().map(|top| top.start).collect();
        for _ in 0..steps {
            let at = |rates: &[State], h: f64| -> Vec<State> {
                let all = states.iter().zip(rates);
                all.map(|(state, rate)| state.moved(rate, h)).collect()
            };
            let first = self.rates(&states);
            let second = self.rates(&at(&first, 0.5 * h));
            let third = self.rates(&at(&second, 0.5 * h));
            let fourth = self.rates(&at(&third, h));
            for (body, state) in states.iter_mut().enumerate() {
                *state = state.moved(&first[body], h / 6.0);
                *state = state.moved(&second[body], h / 3.0);
                *state = state.moved(&third[body], h / 3.0);
                *state = state.moved(&fourth[body], h / 6.0);
                state.rotation = state.rotation.normalize();
            }
        }
        states
    }

    /// Newton's and Euler's equations.
    fn rates(&self, states: &[State]) -> Vec<State> {
        let mut sites = Vec::new();
        for (body, (top, state)) in self.tops.iter().zip(states).enumerate() {
            sites.extend(top.sites_at(body, state));
        }
        let mut forces = vec![Vector::ZERO; sites.len()];
        (self.forces)(&sites, &mut forces);
        let mut rates: Vec<State> = self.tops.iter().zip(states).map(free_rate).collect();
        for (site, force) in sites.iter().zip(forces) {
            let (top, rate) = (&self.tops[site.body], &mut rates[site.body]);
            let (arm, force) = (
                to_dvec3(site.world_point) - states[site.body].position,
                to_dvec3(force),
            );
            rate.velocity += force / top.mass;
            rate.momentum += arm.cross(force);
        }
        for rate in &mut rates {
            rate.velocity += self.gravity;
        }
        rates
    }
}

/// Time derivative of a state without forces.
fn free_rate((top, state): (&Top, &State)) -> State {
    let w = state.angvel(top.moments);
    State {
        position: state.velocity,
        rotation: DQuat::from_xyzw(w.x, w.y, w.z, 0.0) * state.rotation * 0.5,
        velocity: DVec3::ZERO,
        momentum: DVec3::ZERO,
    }
}

impl Top {
    fn sites_at(&self, body: usize, state: &State) -> impl Iterator<Item = Site> {
        let w = state.angvel(self.moments);
        self.sites.iter().map(move |(point, charge)| {
            let arm = state.rotation * *point;
            Site {
                body,
                world_point: from_dvec3(state.position + arm),
                velocity: from_dvec3(state.velocity + w.cross(arm)),
                charge: from_f64(*charge),
            }
        })
    }
}
