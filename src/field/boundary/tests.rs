//! Tests of boundaries against lists of all pieces.

use super::plane::dot;
use super::*;

fn vectors<const N: usize>(normals: &[[f64; N]]) -> Vec<Normal> {
    normals.iter().map(|n| n.to_vec()).collect()
}

/// The pieces that do not lie in a set.
fn complement(here: &Neighbourhood, set: Pieces) -> Pieces {
    here.difference(Pieces::ALL, set)
}

/// The half-spaces behind planes.
fn sides(here: &Neighbourhood, normals: &[Normal]) -> Vec<Pieces> {
    let side = |n: &Normal| here.behind(0.0, || n.clone());
    normals.iter().map(side).collect()
}

/// The number of pieces, found by testing every combination of sides.
fn pieces(normals: &[[f64; 3]]) -> usize {
    let normals = vectors(normals);
    let here = Neighbourhood::of(&normals);
    let sides = sides(&here, &normals);
    let piece = |number: &u32| {
        let side = |(k, side): (usize, &Pieces)| match number >> k & 1 {
            1 => *side,
            _ => complement(&here, *side),
        };
        let sides = sides.iter().enumerate().map(side);
        sides
            .fold(Pieces::ALL, |a, b| here.intersection(a, b))
            .any()
    };
    (0..1 << normals.len()).filter(piece).count()
}

/// Planes through a point in general position: 2, 4, 8, 14, 22 pieces (k² − k + 2).
#[test]
fn planes_in_general_position_make_the_known_number_of_pieces() {
    assert_eq!(pieces(&[]), 1);
    assert_eq!(pieces(&[[1.0, 0.0, 0.0]]), 2);
    assert_eq!(pieces(&[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]), 4);
    let mut planes = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(pieces(&planes), 8);
    planes.push([1.0, 2.0, 3.0]);
    assert_eq!(pieces(&planes), 14);
    planes.push([-2.0, 5.0, 7.0]);
    assert_eq!(pieces(&planes), 22);
}

#[test]
fn planes_through_one_line_make_wedges() {
    let wedges = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(pieces(&wedges), 6);
    // The same to within the rounding of turned boxes.
    let wedges = wedges.map(|[x, y, z]| [x, y, z + 1e-7 * x * y]);
    assert_eq!(pieces(&wedges), 6);
}

#[test]
fn equal_and_opposite_normals_are_one_plane() {
    let normals = [vec![0.0, 0.0, 2.0], vec![0.0, 0.0, -1.0]];
    let here = Neighbourhood::of(&normals);
    let (above, below) = (
        here.behind(0.0, || normals[0].clone()),
        here.behind(0.0, || normals[1].clone()),
    );
    assert!(above.any() && below.any());
    let shared = here.intersection(above, below);
    assert!(!shared.any(), "two half-spaces that share a face");
    assert_eq!(here.union(above, below), Pieces::ALL);
}

#[test]
fn axes_beyond_space_are_planes_too() {
    let normals = vectors(&[[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    let here = Neighbourhood::of(&normals);
    let [a, b] = sides(&here, &normals)[..] else {
        panic!("two planes");
    };
    for (a, b) in [(a, b), (a, complement(&here, b)), (complement(&here, a), b)] {
        assert!(here.intersection(a, b).any() && here.difference(a, b).any());
    }
}

/// The surface belongs to the closed sets on both its sides, a distance of NaN to no set.
#[test]
fn a_surface_belongs_to_the_sets_on_both_sides() {
    let here = Neighbourhood::of(&[vec![1.0, 0.0, 0.0]]);
    assert!(here.behind(0.0, || vec![1.0, 0.0, 0.0]).any());
    assert!(here.behind(-0.0, || vec![-1.0, 0.0, 0.0]).any());
    assert!(!here.behind(f64::NAN, || vec![1.0, 0.0, 0.0]).any());
}

/// For 24 axes with a border at the sample, for example, there are 16,777,216 pieces.
#[test]
fn work_grows_with_the_axes_and_not_with_their_pieces() {
    for count in [8, 12, 16, 24, 64, 200] {
        let axis = |k: usize| (0..count).map(|j| f64::from(u8::from(j == k))).collect();
        let normals: Vec<Normal> = (0..count).map(axis).collect();
        let here = Neighbourhood::of(&normals);
        let sides = sides(&here, &normals);
        let all_of = |sides: &[Pieces]| {
            let sides = sides.iter().copied();
            sides.fold(Pieces::ALL, |a, b| here.intersection(a, b))
        };
        let any_of = |sides: &[Pieces]| {
            let sides = sides.iter().copied();
            sides.fold(Pieces::NONE, |a, b| here.union(a, b))
        };
        assert!(all_of(&sides).any() && any_of(&sides).any());
        // Exactly one of each pair.
        let pairs: Vec<Pieces> = sides
            .chunks(2)
            .map(|pair| {
                let [a, b] = [pair[0], pair[1]];
                here.union(here.difference(a, b), here.difference(b, a))
            })
            .collect();
        let odd = all_of(&pairs);
        assert!(odd.any());
        assert!(!here.intersection(odd, all_of(&sides)).any());
        let size = here.sets.borrow().size();
        assert!(size < 20 * count, "{count} axes: {size} questions");
    }
}

/// The outward normals of the sides of a pyramid with its apex up, where all sides meet.
fn pyramid(sides: usize) -> Vec<Normal> {
    let side = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / sides as f64;
        vec![angle.cos(), 0.5, angle.sin()]
    };
    (0..sides).map(side).collect()
}

/// The apex also lies in the half-space beyond each side, but not in the intersection of that with the pyramid.
#[test]
fn the_apex_lies_in_a_pyramid_of_any_number_of_sides_and_in_its_complement() {
    for count in [3, 12, 64, 65, 128] {
        let normals = pyramid(count);
        let here = Neighbourhood::of(&normals);
        let sides = sides(&here, &normals);
        let all = sides.iter().copied();
        let inside = all.fold(Pieces::ALL, |a, b| here.intersection(a, b));
        assert!(inside.any(), "{count} sides");
        assert!(complement(&here, inside).any());
        let mut cut = sides.iter().map(|side| complement(&here, *side));
        assert!(cut.all(|cut| cut.any() && !here.intersection(inside, cut).any()));
        // Above all sides at once, and above one and none of the others.
        let above = sides.iter().map(|side| complement(&here, *side));
        let above = above.fold(Pieces::ALL, |a, b| here.intersection(a, b));
        assert!(above.any());
        let others = sides[1..].iter().copied();
        let others = others.fold(Pieces::ALL, |a, b| here.intersection(a, b));
        assert!(here.difference(others, sides[0]).any());
        // No piece is behind two sides that face each other and above two that do, at right angles.
        if count % 4 == 0 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|quarter| sides[quarter * count / 4]);
            let low = here.intersection(a, c);
            let high = here.intersection(complement(&here, b), complement(&here, d));
            assert!(!here.intersection(low, high).any());
        }
    }
}

/// A list of the pieces that planes through the origin cut space into; bit k of a piece is set behind plane k.
/// Found from the pieces that the other planes cut each plane into, by a step off that plane to both sides.
fn listed(planes: &[Normal]) -> Vec<u64> {
    if planes.is_empty() {
        return vec![0];
    }
    let mut found = Vec::new();
    for (k, normal) in planes.iter().enumerate() {
        let mut traces: Vec<Normal> = Vec::new();
        let mut trace_of: Vec<Option<(usize, bool)>> = vec![None; planes.len()];
        for (j, other) in planes.iter().enumerate().filter(|(j, _)| *j != k) {
            let along = dot(other, normal);
            let within = other.iter().zip(normal).map(|(o, n)| o - along * n);
            let Some(trace) = unit(&within.collect()) else {
                continue;
            };
            let mut seen = traces.iter().enumerate();
            let known = seen.find_map(|(t, seen)| Some((t, parallel(seen, &trace)?)));
            trace_of[j] = known.or_else(|| {
                traces.push(trace);
                Some((traces.len() - 1, true))
            });
        }
        for face in listed(&traces) {
            let mut piece = 0;
            for (j, trace) in trace_of.iter().enumerate() {
                if let Some((t, same_side)) = trace {
                    piece |= u64::from((face >> t & 1 == 1) == *same_side) << j;
                }
            }
            found.extend([piece, piece | 1 << k]);
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Pseudo-random numbers, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        (self.0 >> 33) % count
    }
}

/// Random combinations of sets, over planes that often meet in common lines.
#[test]
fn sets_agree_with_the_list_of_all_pieces() {
    let mut dice = Dice(1);
    for dimension in [2, 3, 4] {
        for _ in 0..300 {
            let mut normals: Vec<Normal> = Vec::new();
            for _ in 0..2 + dice.below(5) {
                let normal = (0..dimension).map(|_| dice.below(5) as f64 - 2.0).collect();
                normals.extend(unit(&normal));
            }
            let here = Neighbourhood::of(&normals);
            let planes: Vec<Normal> = here.planes.iter().map(|p| p.normal.clone()).collect();
            let list = listed(&planes);
            let mut sets: Vec<(Pieces, Vec<bool>)> = Vec::new();
            for (k, plane) in planes.iter().enumerate() {
                let behind = list.iter().map(|piece| piece >> k & 1 == 1).collect();
                sets.push((here.behind(0.0, || plane.clone()), behind));
            }
            for _ in 0..40 {
                let mut pick = || sets[dice.below(sets.len() as u64) as usize].clone();
                let ((a, in_a), (b, in_b)) = (pick(), pick());
                type Both = fn(bool, bool) -> bool;
                let (set, rule): (Pieces, Both) = match dice.below(4) {
                    0 => (here.union(a, b), |a, b| a || b),
                    1 => (complement(&here, a), |a, _| !a),
                    2 => (here.difference(a, b), |a, b| a && !b),
                    _ => (here.intersection(a, b), |a, b| a && b),
                };
                let both = in_a.iter().zip(&in_b);
                let expected: Vec<bool> = both.map(|(a, b)| rule(*a, *b)).collect();
                assert_eq!(set.any(), expected.contains(&true), "{planes:?}");
                sets.push((set, expected));
            }
        }
    }
}
