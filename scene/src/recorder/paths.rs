//! The positions of moving bodies over a run, without outliers.

use super::super::fields::math::DVec3;
use super::bounds::Parts;
use super::frames::Frame;

/// Bodies that go farther than this multiple of the distance within which most bodies stay are outliers
/// and left out: in a view that includes them, nothing else could be seen.
const ASTRAY: f64 = 4.0;

/// The share of all bodies that "most" stands for.
const MOST: f64 = 0.8;

/// All positions of the moving bodies that are no outliers.
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

    /// All positions, body by body, each in order of time.
    pub fn places(&self) -> &[DVec3] {
        &self.0
    }
}

/// The median by axis; zero without positions.
fn median(places: Vec<DVec3>) -> DVec3 {
    let along = |axis: usize| {
        let mut all: Vec<f64> = places.iter().map(|at| at[axis]).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    };
    DVec3::new(along(0), along(1), along(2))
}
