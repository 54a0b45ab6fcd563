//! The formulas, each with sensible numbers.

use rapier3d_fields::field::{Coordinates, Grid, LinearKernel, Path, Swirl, Turbulence};
use rapier3d_fields::math::DVec3;
use rapier3d_fields::prelude::*;

/// One panel of the table.
pub struct Entry {
    pub name: &'static str,
    pub formula: &'static str,
    pub tree: Tree,
    pub slice: Slice,
    /// From the middle of the slice to each side.
    pub extent: f64,
    /// The velocity of the sample at a point; without, it is at rest.
    pub velocity: Option<fn(DVec3) -> DVec3>,
    /// Radius of the sample.
    pub radius: f64,
    pub marks: Vec<Mark>,
}

/// The plane of a slice: through y, the axis of all rotating fields, or perpendicular to it.
#[derive(Clone, Copy)]
pub enum Slice {
    Upright,
    Level,
}

impl Slice {
    /// The axes across and up the page, such that the third one points out of it.
    pub fn axes(self) -> (DVec3, DVec3) {
        match self {
            Slice::Upright => (DVec3::X, DVec3::Y),
            Slice::Level => (DVec3::X, -DVec3::Z),
        }
    }
}

/// A shape drawn under the arrows.
pub enum Mark {
    /// Dashed, around the origin.
    Circle(f64),
    /// Filled.
    Disc(DVec3, f64),
    /// Dashed.
    Line(Vec<DVec3>),
    /// Filled.
    Area(Vec<DVec3>),
}

impl Entry {
    fn new(name: &'static str, formula: &'static str, field: impl Into<Tree>) -> Self {
        Entry {
            name,
            formula,
            tree: field.into(),
            slice: Slice::Upright,
            extent: 2.0,
            velocity: None,
            radius: 0.0,
            marks: Vec::new(),
        }
    }

    /// Slices perpendicular to the y axis.
    fn level(mut self) -> Self {
        self.slice = Slice::Level;
        self
    }

    fn within(mut self, extent: f64) -> Self {
        self.extent = extent;
        self
    }

    fn moving(mut self, velocity: fn(DVec3) -> DVec3) -> Self {
        self.velocity = Some(velocity);
        self
    }

    fn mark(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }
}

/// All formulas but the detection field.
pub fn entries() -> Vec<Entry> {
    let mut entries = radial();
    entries.extend(springs_and_axes());
    entries.extend(flows());
    entries.extend(data());
    entries
}

fn radial() -> Vec<Entry> {
    let dot = || Mark::Disc(DVec3::ZERO, 0.09);
    vec![
        Entry::new(
            "uniform(F)",
            "F",
            Field::uniform(Vector::new(1.0, 0.5, 0.0)),
        ),
        Entry::new(
            "radial(k, n)",
            "k rⁿ r̂,  here n = 1",
            Field::radial(1.0, 1.0),
        )
        .mark(dot()),
        Entry::new("point_gravity(μ)", "−m μ/r² r̂", Field::point_gravity(1.0)).mark(dot()),
        Entry::new("coulomb(c, q′)", "c q q′/r² r̂", Field::coulomb(1.0, 1.0)).mark(dot()),
        Entry::new(
            "lennard_jones(ε, σ)",
            "U = 4ε ((σ/r)¹² − (σ/r)⁶)",
            Field::lennard_jones(1.0, 1.0),
        )
        .within(2.4)
        .mark(Mark::Circle(2.0_f64.powf(1.0 / 6.0))),
        Entry::new(
            "morse(D, a, r₀)",
            "U = D ((1 − e^(−a (r − r₀)))² − 1)",
            Field::morse(1.0, 2.0, 1.0),
        )
        .within(2.4)
        .mark(Mark::Circle(1.0)),
        Entry::new("yukawa(k, λ)", "U = k e^(−r/λ)/r", Field::yukawa(1.0, 0.5)).mark(dot()),
        Entry::new(
            "hertz(k, d)",
            "k (d − r)^(3/2) r̂ for r < d",
            Field::hertz(1.0, 1.5),
        )
        .mark(Mark::Circle(1.5)),
        Entry::new(
            "gaussian(k, w)",
            "U = k e^(−r²/2w²)",
            Field::gaussian(1.0, 0.6),
        )
        .mark(Mark::Circle(0.6)),
    ]
}

fn springs_and_axes() -> Vec<Entry> {
    let swirl = Swirl {
        around: 1.0,
        inward: 0.5,
        along: 0.4,
        power: 0.0,
        core: 0.3,
    };
    let corners = [(-0.8, -0.5), (0.8, -0.5), (0.8, 0.5), (-0.8, 0.5)];
    let block = corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    let half = Vector::new(0.8, 0.5, 0.8);
    vec![
        Entry::new("spring(k)", "−k d", Field::spring(1.0)),
        Entry::new(
            "spring_damper(k, c, L)",
            "−k (r − L) r̂ − c v,  here v = 0",
            Field::spring_damper(1.0, 0.2, 1.0),
        )
        .mark(Mark::Circle(1.0)),
        Entry::new(
            ".around(shape)",
            "a radial law from the nearest point",
            Field::radial(-1.0, -2.0)
                .around(SharedShape::cuboid(half.x, half.y, half.z))
                .outside(Region::cuboid(half)),
        )
        .mark(Mark::Area(block)),
        Entry::new("spin(ω)", "ω ŷ × d,  seen from above", Field::spin(1.0)).level(),
        Entry::new(
            "vortex(k, n)",
            "k ρⁿ around ŷ,  here n = −1, smoothed",
            Field::vortex(1.0, -1.0).smoothed(0.4),
        )
        .level()
        .mark(Mark::Circle(0.4)),
        Entry::new(
            "swirl(Swirl { … })",
            "around, towards and along ŷ",
            Field::swirl(swirl),
        )
        .level(),
        Entry::new("updraft(k, i)", "k ŷ − i ρ̂", Field::updraft(1.0, 0.5))
            .mark(Mark::Line(vec![DVec3::Y * -2.0, DVec3::Y * 2.0])),
    ]
}

fn flows() -> Vec<Entry> {
    let turning = |p: DVec3| DVec3::new(-p.y, p.x, 0.0);
    let whirl = Field::vortex(1.0, -1.0).smoothed(0.5);
    let depths = [(-2.0, -2.0), (2.0, -2.0), (2.0, 0.0), (-2.0, 0.0)];
    let water = depths.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    let floating = Entry::new(
        "buoyancy(ρ, g)",
        "ρ g V(h) ŷ,  balls of radius 0.6",
        Field::buoyancy(1.0, 9.81),
    );
    let eddies = Field::turbulence(Turbulence::new(4, 1.0, 2.5));
    vec![
        Entry::new("drag(c₁, c₂)", "−(c₁ + c₂ |v|) v", Field::drag(0.5, 0.5)).moving(turning),
        Entry::new(
            "wind(u, c₁, c₂)",
            "(c₁ + c₂ |w|) w,  w = u − v",
            Field::wind(Vector::X * 1.5, 0.5, 0.5),
        )
        .moving(turning),
        Entry::new(
            ".as_wind(c₁, c₂)",
            "any field as u,  here a vortex",
            whirl.as_wind(0.5, 0.5),
        )
        .level()
        .moving(|_| DVec3::X * 0.7),
        Entry::new(
            "magnetic(B)",
            "q v × B,  B out of the page",
            Field::magnetic(Vector::Z),
        )
        .moving(|p| DVec3::new(p.y, 0.4, 0.0)),
        Entry {
            radius: 0.6,
            ..floating.mark(Mark::Area(water))
        },
        Entry::new("turbulence(…)", "curl of random waves, div = 0", eddies),
    ]
}

fn data() -> Vec<Entry> {
    let lane: [(Real, Real); 4] = [(-1.5, -1.2), (-0.6, 1.0), (0.7, 1.0), (1.5, -1.2)];
    let corners = lane.map(|(x, y)| Vector::new(x, y, 0.0));
    let path = Path::new(corners, false).damping(1.0, 1.0).look_ahead(0.3);
    let drawn = lane
        .map(|(x, y)| DVec3::new(x.into(), y.into(), 0.0))
        .to_vec();
    let grid = Grid::sampled(Vector::splat(-1.5), Vector::splat(1.5), [6, 6, 2], |p| {
        Vector::new((2.0 * p.y).sin(), (2.0 * p.x).cos(), 0.0)
    });
    let bounds = [
        (-1.5, -1.5),
        (1.5, -1.5),
        (1.5, 1.5),
        (-1.5, 1.5),
        (-1.5, -1.5),
    ];
    let bounds = bounds.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    let kernel = LinearKernel {
        coordinates: Coordinates::Toroidal { radius: 1.0 },
        constant: Vector::Z,
        position_multiplier: [Vector::X * 0.5, Vector::ZERO, Vector::ZERO],
        ..LinearKernel::default()
    };
    let double_well = Field::closure([], |sample| {
        let p = sample.local_point;
        Vector::new(p.x - p.x * p.x * p.x, -p.y, 0.0)
    });
    vec![
        Entry::new("path(Path)", "k (g − p) + c (s t − v)", Field::path(path))
            .mark(Mark::Line(drawn)),
        Entry::new(
            "grid(Grid)",
            "trilinear, within its bounds",
            Field::grid(grid),
        )
        .mark(Mark::Line(bounds)),
        Entry::new(
            "linear_kernel(…)",
            "PhysX 2.8,  here around a ring",
            Field::linear_kernel(kernel),
        )
        .mark(Mark::Disc(DVec3::X, 0.09))
        .mark(Mark::Disc(-DVec3::X, 0.09)),
        Entry::new(
            "expression([…])",
            "\"sin(2*y)\", \"sin(2*x)\", \"0\"",
            Field::expression(["sin(2*y)", "sin(2*x)", "0"]),
        ),
        Entry::new(
            "closure(reads, f)",
            "f(sample),  here (x − x³, −y, 0)",
            double_well,
        ),
    ]
}
