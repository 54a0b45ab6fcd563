//! Where bodies go, without the few that go astray.

use super::super::fields::math::DVec3;
use super::bounds::Parts;
use super::frames::Frame;

/// Bodies that go more than so many times as far as most of them go astray, and do not count: a view
/// that had them in it would show nothing else.
const ASTRAY: f64 = 4.0;

/// Which part of all bodies "most" are.
const MOST: f64 = 0.8;

/// All places of all bodies that move and count.
pub(super) struct Paths(Vec<DVec3>);

impl Paths {
    pub fn new(parts: &Parts, frames: &[Frame]) -> Self {
        let mut movers: Vec<usize> = parts.movers().map(|part| part.body).collect();
        movers.dedup();
        let path = |body: usize| {
            let places = frames.iter().map(move |frame| frame.places[body].at);
            places.filter(|at| at.is_finite())
        };
        let middle = median(movers.iter().flat_map(|body| path(*body)).collect());
        let far = |body: usize| path(body).map(|at| at.distance(middle)).fold(0.0, f64::max);
        let distances: Vec<f64> = movers.iter().map(|body| far(*body)).collect();
        let mut sorted = distances.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1) as f64;
        let most = sorted.get((MOST * last) as usize).copied().unwrap_or(0.0);
        let counted = movers.iter().zip(&distances);
        let counted = counted.filter(|(_, far)| most == 0.0 || **far <= ASTRAY * most);
        Paths(counted.flat_map(|(body, _)| path(*body)).collect())
    }

    /// All places, body by body, each in the order of time.
    pub fn places(&self) -> &[DVec3] {
        &self.0
    }
}

/// By axis, the value that half of all are below; zero if there is none.
fn median(places: Vec<DVec3>) -> DVec3 {
    let along = |axis: usize| {
        let mut all: Vec<f64> = places.iter().map(|at| at[axis]).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    };
    DVec3::new(along(0), along(1), along(2))
}
