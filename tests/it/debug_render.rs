//! Debug rendering of fields: the places and colours of lines, and the bound on their number.

use rapier3d_fields::debug_render::FieldDebugRenderMode as Mode;
use rapier3d_fields::debug_render::{
    FieldDebugRenderOutcome, FieldDebugRenderPipeline, FieldDebugRenderStyle,
};
use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::{cross_checked, overlapping, step, unseen};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    body: Option<RigidBodyHandle>,
    a: Vector,
    b: Vector,
    color: DebugColor,
}

impl Line {
    fn way(&self) -> Vector {
        self.b - self.a
    }
}

/// Collects the lines, except those of one body.
#[derive(Default)]
struct Recorder {
    lines: Vec<Line>,
    without: Option<RigidBodyHandle>,
}

fn body_of(object: DebugRenderObject<'_>) -> Option<RigidBodyHandle> {
    match object {
        DebugRenderObject::RigidBody(handle, _) => Some(handle),
        DebugRenderObject::Collider(_, collider) => collider.parent(),
        _ => None,
    }
}

impl DebugRenderBackend for Recorder {
    fn filter_object(&self, object: DebugRenderObject<'_>) -> bool {
        self.without.is_none() || body_of(object) != self.without
    }

    fn draw_line(
        &mut self,
        object: DebugRenderObject<'_>,
        a: Vector,
        b: Vector,
        color: DebugColor,
    ) {
        assert!(a.is_finite() && b.is_finite(), "{a} {b}");
        let body = body_of(object);
        self.lines.push(Line { body, a, b, color });
    }
}

/// A view around the origin that does not follow the bodies.
fn still() -> FieldDebugRenderStyle {
    FieldDebugRenderStyle {
        centre: Some(Vector::ZERO),
        half_size: Some(4.0),
        ..Default::default()
    }
}

fn render(
    style: FieldDebugRenderStyle,
    mode: Mode,
    fields: &Fields,
    world: &PhysicsWorld,
) -> (Vec<Line>, FieldDebugRenderOutcome) {
    let mut recorder = Recorder::default();
    let mut pipeline = FieldDebugRenderPipeline::new(style, mode);
    let outcome = pipeline.render(&mut recorder, fields, world);
    assert_eq!(outcome.lines, recorder.lines.len());
    (recorder.lines, outcome)
}

fn regions(tree: impl Into<Tree>, world: &PhysicsWorld) -> Vec<Line> {
    let fields = Fields::new(tree).expect("a valid tree");
    render(still(), Mode::REGIONS, &fields, world).0
}

fn push_within(region: Region) -> Field {
    Field::uniform(Vector::X).within(region)
}

fn ball(world: &mut PhysicsWorld, at: Vector) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic().translation(at);
    world.insert(body, ColliderBuilder::ball(0.5).mass(1.0)).0
}

fn free_world() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world
}

#[test]
fn a_ball_at_a_moving_body_is_outlined_at_its_radius() {
    let mut world = free_world();
    let start = RigidBodyBuilder::dynamic().linvel(Vector::new(3.0, 2.0, -1.0));
    let start = start.angvel(Vector::new(0.5, 1.0, 2.0));
    let (carrier, _) = world.insert(start, ColliderBuilder::ball(0.5));
    let mut fields = Fields::new(push_within(Region::ball(2.0)).at(carrier)).expect("a field");
    for _ in 0..5 {
        fields.step(&mut world).expect("a step");
        let (lines, _) = render(still(), Mode::REGIONS, &fields, &world);
        assert_eq!(lines.len(), 3 * 32, "three circles");
        let centre = world.bodies[carrier].translation();
        assert!(centre.length() > 0.01);
        for line in lines {
            assert_eq!(line.body, Some(carrier));
            for end in [line.a, line.b] {
                let radius = (end - centre).length();
                assert!((radius - 2.0).abs() < 1e-4, "{radius}");
            }
        }
    }
}

#[test]
fn a_cuboid_has_twelve_edges() {
    let half = Vector::new(1.0, 2.0, 3.0);
    let lines = regions(
        push_within(Region::cuboid(half).at(Vector::X * 5.0)),
        &free_world(),
    );
    assert_eq!(lines.len(), 12);
    for axis in 0..3 {
        let is_along = |line: &&Line| {
            let mut way = line.way().abs();
            way[axis] -= 2.0 * half[axis];
            way.length() < 1e-4
        };
        assert_eq!(lines.iter().filter(is_along).count(), 4, "{lines:?}");
    }
    let corner = |end: Vector| ((end - Vector::X * 5.0).abs() - half).length() < 1e-4;
    assert!(lines.iter().all(|line| corner(line.a) && corner(line.b)));
    for (at, line) in lines.iter().enumerate() {
        let same = |other: &Line| {
            let ends = [other.a, other.b];
            ends == [line.a, line.b] || ends == [line.b, line.a]
        };
        assert!(!lines[..at].iter().any(same), "drawn twice: {line:?}");
    }
}

#[test]
fn outlines_lie_on_the_surfaces_of_solids() {
    let world = free_world();
    let tilted = Pose::from_parts(
        Vector::new(1.0, -2.0, 0.5),
        Rotation::from_axis_angle(Vector::new(0.6, 0.0, 0.8), 0.7),
    );
    let on_cylinder = |p: Vector| (p.x.hypot(p.z) - 1.5).abs() + (p.y.abs() - 2.0).max(0.0);
    let on_cone = |p: Vector| (p.x.hypot(p.z) - 1.5 * (2.0 - p.y) / 4.0).abs();
    let on_capsule = |p: Vector| {
        let foot = Vector::Y * p.y.clamp(-2.0, 2.0);
        ((p - foot).length() - 1.5).abs()
    };
    let on_plane = |p: Vector| (p.x - 0.5).abs();
    type Distance<'a> = &'a dyn Fn(Vector) -> Real;
    let cases: [(Region, Distance<'_>); 4] = [
        (Region::cylinder(2.0, 1.5), &on_cylinder),
        (Region::cone(2.0, 1.5), &on_cone),
        (Region::capsule(2.0, 1.5), &on_capsule),
        (Region::half_space(Vector::X, 0.5), &on_plane),
    ];
    for (region, distance) in cases {
        let lines = regions(push_within(region).at(tilted), &world);
        assert!(lines.len() >= 10);
        for line in lines {
            for end in [line.a, line.b].map(|end| tilted.inverse() * end) {
                assert!(distance(end) < 1e-3, "{end}");
            }
        }
    }
    // A slab has two planes, and a shape of Parry's its own outline.
    let slab = regions(push_within(Region::interval(Axis::Y, -1.0, 3.0)), &world);
    let heights = slab.iter().map(|line| [line.a.y, line.b.y]);
    assert!(
        heights
            .clone()
            .all(|ends| ends == [-1.0; 2] || ends == [3.0; 2])
    );
    assert_eq!(slab.len(), 20);
    let shape = SharedShape::round_cuboid(1.0, 1.0, 1.0, 0.2);
    assert!(!regions(push_within(Region::shape(shape)), &world).is_empty());
    let plane = SharedShape::halfspace(Vector::Y);
    let plane = regions(push_within(Region::shape(plane)), &world);
    assert!(plane.len() == 10 && plane.iter().all(|line| line.a.y == 0.0));
}

#[test]
fn solids_that_are_cut_away_have_a_colour_of_their_own() {
    let during = Region::interval("time", 0.0, 9.0);
    let shell = Region::ball(3.0).difference(Region::ball(2.0));
    let lines = regions(push_within(shell.intersection(during)), &free_world());
    let cut = still().cut_color;
    assert!(!lines.is_empty());
    for line in lines {
        let expected = if line.color == cut { 2.0 } else { 3.0 };
        assert!((line.a.length() - expected).abs() < 1e-4);
    }
    assert!(regions(Field::uniform(Vector::X), &free_world()).is_empty());
}

#[test]
fn each_instance_has_its_outline() {
    let world = free_world();
    let places = [Vector::ZERO, Vector::X * 5.0, Vector::Y * 5.0];
    let inner = Tree::instances(
        push_within(Region::ball(1.0)),
        [Vector::ZERO, Vector::Z * 9.0],
    );
    let lines = regions(Tree::instances(inner, places), &world);
    assert_eq!(lines.len(), 6 * 3 * 32);
    for place in places {
        for z in [0.0, 9.0] {
            let centre = place + Vector::Z * z;
            let of_it = |line: &&Line| ((line.a - centre).length() - 1.0).abs() < 1e-4;
            assert_eq!(lines.iter().filter(of_it).count(), 3 * 32);
        }
    }
}

/// A wind that is replaced in its lee.
fn wind_and_lee() -> Tree {
    let wind = Field::uniform(Vector::new(2.0, 1.0, 0.0)).named("wind");
    let lee = Field::radial(-3.0, 1.0)
        .within(Region::ball(2.0))
        .named("lee");
    wind.replace_union(lee)
}

#[test]
fn arrows_point_along_the_field() {
    let world = free_world();
    let fields = Fields::new(wind_and_lee()).expect("a valid tree");
    for mode in [Mode::SLICE_ARROWS, Mode::VOLUME_ARROWS] {
        let style = still();
        let (lines, outcome) = render(style, mode, &fields, &world);
        assert_eq!(outcome.not_finite, 0);
        let shafts: Vec<Line> = lines.chunks(3).map(|arrow| arrow[0]).collect();
        let starts: Vec<Vector> = shafts.iter().map(|shaft| shaft.a).collect();
        let values = fields.values_at(&starts, &world);
        // The lee is zero at its middle, where both grids have a point.
        let points = if mode == Mode::SLICE_ARROWS {
            21 * 21
        } else {
            7 * 7 * 7
        };
        assert_eq!(shafts.len(), points - 1);
        let mut longest: (Real, Real) = (0.0, 0.0);
        for (shaft, value) in shafts.iter().zip(values) {
            let angle = shaft
                .way()
                .normalize()
                .cross(value.force.normalize())
                .length();
            assert!(angle < 1e-4 && shaft.way().dot(value.force) > 0.0);
            if value.force.length() > longest.0 {
                longest = (value.force.length(), shaft.way().length());
            }
        }
        let lengths = shafts.iter().map(|shaft| shaft.way().length());
        assert!(
            longest.1 >= lengths.fold(0.0, Real::max) * 0.9999,
            "{longest:?}"
        );
    }
}

#[test]
fn arrow_heads_have_the_colour_of_the_field_that_counts() {
    let world = free_world();
    let fields = Fields::new(wind_and_lee()).expect("a valid tree");
    let mode = Mode::SLICE_ARROWS | Mode::COUNTING_FIELDS;
    let (lines, _) = render(still(), mode, &fields, &world);
    let color = |name: &str| {
        let handle = fields.set.handle(name).expect("a field");
        FieldDebugRenderStyle::field_color(handle)
    };
    let [wind, lee] = ["wind", "lee"].map(color);
    assert_ne!(wind, lee);
    for arrow in lines.chunks(3) {
        let distance = arrow[0].a.length();
        // On the border rounding decides.
        if (distance - 2.0).abs() < 1e-3 {
            continue;
        }
        let inside = distance < 2.0;
        let expected = if inside { lee } else { wind };
        assert_eq!([arrow[1].color, arrow[2].color], [expected; 2]);
    }
    // Where two fields add up, the head has both colours.
    let sum = Field::uniform(Vector::X).sum_union(Field::uniform(Vector::Y));
    let fields = Fields::new(sum).expect("a valid tree");
    let handles: Vec<_> = fields.set.iter().map(|(handle, _)| handle).collect();
    let (lines, _) = render(still(), mode, &fields, &world);
    let colors = [handles[0], handles[1]].map(FieldDebugRenderStyle::field_color);
    assert_eq!([lines[1].color, lines[2].color], colors);
}

fn streams(field: Field, seeds: &[Vector]) -> Vec<Vec<Vector>> {
    let style = FieldDebugRenderStyle {
        stream_seeds: seeds.to_vec(),
        stream_step: Some(0.05),
        stream_steps: 300,
        ..still()
    };
    let fields = Fields::new(field).expect("a valid field");
    let (lines, _) = render(style, Mode::STREAM_LINES, &fields, &free_world());
    let mut paths: Vec<Vec<Vector>> = seeds.iter().map(|seed| vec![*seed]).collect();
    for line in lines {
        let of_line = |path: &&mut Vec<Vector>| path.last() == Some(&line.a);
        let path = paths
            .iter_mut()
            .find(of_line)
            .expect("it goes on where one ended");
        path.push(line.b);
    }
    paths
}

/// Without seeds, one line begins at each point of a lattice on the slice.
#[test]
fn stream_lines_begin_on_the_slice_by_default() {
    let style = FieldDebugRenderStyle {
        stream_points: 5,
        stream_steps: 1,
        half_size: Some(2.0),
        slice_normal: Vector::Y,
        ..still()
    };
    let fields = Fields::new(Field::uniform(Vector::Y)).expect("a valid field");
    let (lines, _) = render(style, Mode::STREAM_LINES, &fields, &free_world());
    assert_eq!(lines.len(), 25);
    let mut begins: Vec<_> = lines.iter().map(|line| [line.a.x, line.a.z]).collect();
    begins.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
    begins.dedup();
    assert_eq!(begins.len(), 25, "{begins:?}");
    assert!(
        begins.iter().flatten().all(|it| it.abs() <= 2.0),
        "{begins:?}"
    );
}

#[test]
fn stream_lines_of_a_vortex_are_circles() {
    let radii = [0.5, 1.0, 3.0];
    let seeds = radii.map(|radius| Vector::new(radius, 1.0, 0.0));
    for (path, radius) in streams(Field::vortex(4.0, -1.0), &seeds).iter().zip(radii) {
        assert_eq!(path.len(), 301, "it goes on until its last step");
        for point in path {
            let distance = point.x.hypot(point.z);
            assert!(
                (distance / radius - 1.0).abs() < 0.01,
                "{distance} at {radius}"
            );
            assert!((point.y - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn stream_lines_of_a_planet_are_straight_and_end_at_its_centre() {
    let seeds = [Vector::new(1.0, 2.0, 2.0), Vector::new(-4.0, 0.0, 3.0)];
    for (path, seed) in streams(Field::point_gravity(9.0), &seeds).iter().zip(seeds) {
        for point in path {
            let aside = point.cross(seed.normalize()).length();
            assert!(aside < 1e-3, "{point}");
        }
        let end = path.last().expect("a seed");
        assert!(end.length() < 0.06, "{end}");
        assert!(path.len() > (seed.length() / 0.05) as usize - 2);
    }
    // A stream line ends at the border of a region.
    let here = Field::uniform(Vector::X).within(Region::ball(1.0));
    let [path] = &streams(here, &[Vector::ZERO])[..] else {
        panic!("one seed")
    };
    let end = path.last().expect("a seed").x;
    assert!(end < 1.0001 && end > 0.94, "{end}");
}

#[test]
fn the_arrows_of_a_body_have_the_direction_of_its_wrench() {
    let mut world = free_world();
    let at = Vector::new(3.0, 1.0, -2.0);
    let beam = ColliderBuilder::cuboid(2.0, 0.1, 0.1);
    let (body, _) = world.insert(RigidBodyBuilder::dynamic().translation(at), beam);
    let other = ball(&mut world, Vector::Y * 40.0);
    let pull = Field::point_gravity(20.0).within(Region::ball(9.0));
    let mut fields = Fields::new(pull).expect("a field");
    assert!(
        render(still(), Mode::WRENCHES, &fields, &world)
            .0
            .is_empty(),
        "no step yet"
    );
    fields.step(&mut world).expect("a step");
    let wrench = fields.wrench(body).expect("a wrench");
    assert!(wrench.torque.length() > 1e-3);
    let (lines, _) = render(still(), Mode::WRENCHES, &fields, &world);
    assert_eq!(lines.len(), 6, "the other body feels nothing");
    for (arrow, vector) in lines.chunks(3).zip([wrench.force, wrench.torque]) {
        let way = arrow[0].way();
        assert_eq!(arrow[0].body, Some(body));
        assert_eq!(arrow[0].a, world.bodies[body].center_of_mass());
        assert!(
            way.normalize().dot(vector.normalize()) > 0.9999,
            "{way} {vector}"
        );
    }
    assert_ne!(lines[0].color, lines[3].color);
    assert!(lines.iter().all(|line| line.body != Some(other)));
    let mut pipeline = FieldDebugRenderPipeline::render_all(still());
    pipeline.mode = Mode::WRENCHES;
    let mut recorder = Recorder {
        without: Some(body),
        ..Default::default()
    };
    assert_eq!(
        pipeline.render(&mut recorder, &fields, &world).lines,
        0,
        "filtered"
    );
}

#[test]
fn contacts_are_drawn_with_their_normals() {
    let mut world = free_world();
    let one = ball(&mut world, Vector::ZERO);
    ball(&mut world, Vector::new(0.6, 0.6, 0.0));
    let collider = world.bodies[one].colliders()[0];
    let law = Field::contact(ContactLaw::Observe);
    let mut fields = Fields::new(law.at(collider)).expect("a field");
    fields.step(&mut world).expect("a step");
    let contact = fields.contacts()[0];
    let (lines, _) = render(still(), Mode::CONTACTS, &fields, &world);
    assert_eq!(lines.len(), 4, "a normal and a cross");
    assert_eq!(lines[0].a, contact.world_point);
    assert!((lines[0].way() - contact.world_normal * 0.3).length() < 1e-5);
    assert_eq!(lines[0].body, Some(one));
    for arm in &lines[1..] {
        assert!((arm.a.midpoint(arm.b) - contact.world_point).length() < 1e-5);
    }
}

#[test]
fn disagreements_with_rapier_have_a_colour_of_their_own() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    unseen(&mut world, &a);
    unseen(&mut world, &b);
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    step(&mut fields, &mut world);
    let (lines, _) = render(still(), Mode::CONTACTS, &fields, &world);
    assert_eq!(lines.len(), 7, "a normal and two crosses");
    let colors = [still().contact_color, still().disagreement_color];
    assert_eq!([lines[3].color, lines[4].color], colors);
    let place = fields.cross_check().expect("it is on").disagreements[0].world_point;
    assert_eq!(lines[6].a.midpoint(lines[6].b), place);
}

#[test]
fn rendering_stops_at_the_bound_on_lines_and_reports_it() {
    let world = free_world();
    let tree = wind_and_lee().sum_union(push_within(Region::ball(3.0)));
    let fields = Fields::new(tree).expect("a valid tree");
    let with = |max_lines: usize| FieldDebugRenderStyle {
        max_lines,
        ..still()
    };
    let (all, outcome) = render(with(50_000), Mode::all(), &fields, &world);
    assert!(!outcome.limit_reached);
    for bound in [0, 1, 50, 96, 97, 500, 2_000, all.len() - 1] {
        let (lines, outcome) = render(with(bound), Mode::all(), &fields, &world);
        assert!(outcome.limit_reached);
        assert_eq!(lines, all[..bound], "the first lines are the same");
    }
    let (lines, outcome) = render(with(all.len()), Mode::all(), &fields, &world);
    assert_eq!((lines.len(), outcome.limit_reached), (all.len(), false));
}

/// No line that is not finite reaches the backend; the recorder would panic at one.
#[test]
fn fields_that_are_not_finite_draw_no_arrows() {
    for bad in [Real::NAN, Real::INFINITY, Real::NEG_INFINITY] {
        let mut world = free_world();
        ball(&mut world, Vector::ZERO);
        let field = Field::closure([], move |_| Vector::new(bad, 1.0, 0.0));
        let mut fields = Fields::new(field).expect("a field");
        let arrows = Mode::SLICE_ARROWS | Mode::VOLUME_ARROWS | Mode::STREAM_LINES;
        let (lines, outcome) = render(still(), arrows, &fields, &world);
        assert!(lines.is_empty(), "{lines:?}");
        assert_eq!(outcome.not_finite, 21 * 21 + 7 * 7 * 7);
        let _ = fields.step(&mut world);
        let (lines, _) = render(Default::default(), Mode::all(), &fields, &world);
        assert!(lines.is_empty(), "{lines:?}");
    }
}

/// Edits that are refused only at the next step, styles and places out of range.
#[test]
fn rendering_never_panics() {
    let mut world = free_world();
    let body = ball(&mut world, Vector::X * Real::MAX);
    let mut fields = Fields::new(push_within(Region::ball(1.0)).named("it")).expect("a field");
    let far = SharedShape::convex_hull(&[Vector::ZERO, Vector::X, Vector::Y, Vector::Z]);
    for size in [-1.0, 0.0, Real::NAN, Real::INFINITY, Real::MAX] {
        let regions = [
            Region::ball(size),
            Region::cuboid(Vector::splat(size)),
            Region::cylinder(size, 1.0),
            Region::cone(1.0, size),
            Region::capsule(size, size),
            Region::half_space(Vector::X * size, size),
            Region::interval(Axis::X, size, size),
            Region::shape(far.clone().expect("a hull")).at(Vector::X * size),
            Region::shape(SharedShape::segment(Vector::ZERO, Vector::X * size)),
        ];
        for region in regions {
            fields.set["it"].region = region;
            let style = FieldDebugRenderStyle {
                subdivisions: (size as u32) % 7,
                slice_normal: Vector::X * size,
                slice_points: 3,
                volume_points: 2,
                half_magnitude: Some(size),
                stream_step: Some(size),
                stream_points: 1,
                arrow_length: size,
                wrench_length: Some(size),
                contact_normal_length: size,
                half_size: Some(size),
                ..Default::default()
            };
            render(style, Mode::all(), &fields, &world);
            render(Default::default(), Mode::REGIONS, &fields, &world);
        }
        fields.set["it"].strength = size;
        render(still(), Mode::all(), &fields, &world);
    }
    fields.set["it"].anchor = body.into();
    render(still(), Mode::all(), &fields, &world);
    world.bodies = RigidBodySet::new();
    let (lines, _) = render(still(), Mode::all(), &fields, &world);
    assert!(lines.is_empty(), "its anchor is gone");
}

#[test]
fn inactive_fields_and_empty_modes_draw_nothing() {
    let mut world = free_world();
    ball(&mut world, Vector::X);
    let tree = push_within(Region::ball(3.0)).named("it");
    let mut fields = Fields::new(tree).expect("a field");
    let (lines, _) = render(still(), Mode::all(), &fields, &world);
    assert!(!lines.is_empty());
    let (lines, outcome) = render(still(), Mode::empty(), &fields, &world);
    assert!(lines.is_empty() && outcome == FieldDebugRenderOutcome::default());
    fields.set["it"].enabled = false;
    assert!(render(still(), Mode::all(), &fields, &world).0.is_empty());
    fields.set["it"].enabled = true;
    fields.set["it"].lifetime = Lifetime::between(5.0, 6.0);
    assert!(render(still(), Mode::all(), &fields, &world).0.is_empty());
}

/// The default view shows the surroundings of the bodies, or of the fields if there are no bodies.
#[test]
fn the_view_follows_the_bodies() {
    let mut world = free_world();
    let fields = Fields::new(push_within(Region::ball(3.0)).at(Vector::X * 7.0)).expect("a field");
    let arrows = |fields: &Fields, world: &PhysicsWorld| {
        let style = FieldDebugRenderStyle {
            slice_points: 3,
            ..Default::default()
        };
        let (lines, _) = render(style, Mode::SLICE_ARROWS, fields, world);
        lines.chunks(3).map(|arrow| arrow[0].a).collect::<Vec<_>>()
    };
    // Of nine points 3 apart, five are in the ball.
    assert_eq!(arrows(&fields, &world).len(), 5);
    let everywhere = Fields::new(Field::uniform(Vector::X)).expect("a field");
    ball(&mut world, Vector::new(-2.0, 1.0, 5.0));
    ball(&mut world, Vector::new(6.0, 1.0, 5.0));
    for handle in world
        .bodies
        .iter()
        .map(|(handle, _)| handle)
        .collect::<Vec<_>>()
    {
        world.bodies[handle].recompute_mass_properties_from_colliders(&world.colliders);
    }
    let starts = arrows(&everywhere, &world);
    assert_eq!(starts.len(), 9);
    for (at, start) in starts.iter().enumerate() {
        let [x, y] = [at % 3, at / 3].map(|it| from_f64(5.0 * (it as f64 - 1.0)));
        assert_eq!(*start, Vector::new(2.0 + x, 1.0 + y, 5.0));
    }
    assert!(to_f64(starts[0].z) == 5.0);
}
