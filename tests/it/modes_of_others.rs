//! The ways in which other engines combine zones, written with layers and with the paper's operators, against a plain
//! loop over the zones that contain a point.
//!
//! Zones are boxes with corners at integers; points lie off all faces.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::field::visit::Override;
use rapier3d_fields::math::{DVec3, to_dvec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::cases;

/// A box, and the vector of the field in it.
#[derive(Clone, Debug)]
struct Zone {
    low: [i32; 3],
    size: [i32; 3],
    vector: [i32; 3],
    priority: i32,
}

fn vector(v: [i32; 3]) -> Vector {
    Vector::from_array(v.map(|x| x as Real))
}

impl Zone {
    fn region(&self) -> Region {
        let half = vector(self.size) * 0.5;
        Region::cuboid(half).at(vector(self.low) + half)
    }

    fn field(&self) -> Field {
        Field::uniform(vector(self.vector)).within(self.region())
    }

    fn holds(&self, point: DVec3) -> bool {
        (0..3).all(|k| {
            let from_low = point[k] - f64::from(self.low[k]);
            0.0 < from_low && from_low < f64::from(self.size[k])
        })
    }

    fn value(&self) -> DVec3 {
        to_dvec3(vector(self.vector))
    }
}

fn force(tree: &Tree, point: DVec3) -> Option<DVec3> {
    if tree.field_count() == 0 {
        return None;
    }
    let world = PhysicsWorld::new();
    let reference = Reference::new(tree).expect("a valid tree");
    let query = Query {
        world_point: point,
        ..Query::default()
    };
    reference.force(&WorldRef::from(&world), &query)
}

/// Asserts that trees equal a loop at all points; where nothing acts, they are not defined.
fn same(
    trees: &[Tree],
    points: &[DVec3],
    walk: impl Fn(DVec3) -> Option<DVec3>,
) -> Result<(), TestCaseError> {
    for point in points {
        for (number, tree) in trees.iter().enumerate() {
            prop_assert_eq!(
                force(tree, *point),
                walk(*point),
                "tree {} at {}",
                number,
                point
            );
        }
    }
    Ok(())
}

fn triple(range: std::ops::RangeInclusive<i32>) -> impl Strategy<Value = [i32; 3]> {
    proptest::array::uniform3(range)
}

fn zone() -> impl Strategy<Value = Zone> {
    (triple(-3..=1), triple(1..=4), triple(-4..=4), -2..=2).prop_map(
        |(low, size, vector, priority)| Zone {
            low,
            size,
            vector,
            priority,
        },
    )
}

fn zones_and<T: std::fmt::Debug>(
    what: impl Strategy<Value = T>,
    most: usize,
) -> impl Strategy<Value = Vec<(Zone, T)>> {
    proptest::collection::vec((zone(), what), 1..=most)
}

fn points() -> impl Strategy<Value = Vec<DVec3>> {
    let point = triple(-4..=4).prop_map(|p| to_dvec3(vector(p)) + 0.5);
    proptest::collection::vec(point, 32)
}

/// Zones from the highest priority to the lowest, in their order where priorities are equal.
fn by_priority<T: Clone>(zones: &[(Zone, T)]) -> Vec<(Zone, T)> {
    let mut sorted = zones.to_vec();
    sorted.sort_by_key(|(zone, _)| -zone.priority);
    sorted
}

// Godot.

/// `Area3D.SpaceOverride` (Godot class reference).
#[derive(Clone, Copy, Debug, PartialEq)]
enum SpaceOverride {
    /// Adds to whatever was calculated so far, in priority order.
    Combine,
    /// Adds to whatever was calculated so far, ignoring any areas of lower priority.
    CombineReplace,
    /// Replaces whatever was calculated so far, even the defaults, ignoring any areas of lower
    /// priority.
    Replace,
    /// Replaces whatever was calculated so far, but keeps calculating the rest of the areas.
    ReplaceCombine,
}

impl SpaceOverride {
    const ALL: [SpaceOverride; 4] = [
        SpaceOverride::Combine,
        SpaceOverride::CombineReplace,
        SpaceOverride::Replace,
        SpaceOverride::ReplaceCombine,
    ];

    fn on(self, layer: Layer) -> Layer {
        match self {
            SpaceOverride::Combine => layer,
            SpaceOverride::CombineReplace => layer.stopping(),
            SpaceOverride::Replace => layer.mode(Override {
                replaces: true,
                stops: true,
            }),
            SpaceOverride::ReplaceCombine => layer.replacing(),
        }
    }
}

/// Areas over the gravity of the space, which comes last.
fn godot(default: Vector, areas: &[(Zone, SpaceOverride)]) -> Tree {
    let layer = |(zone, mode): &(Zone, SpaceOverride)| {
        mode.on(Layer::new(zone.field()).priority(zone.priority))
    };
    let space = Layer::new(Field::uniform(default)).priority(i32::MIN);
    Tree::layers(areas.iter().map(layer).chain([space]))
}

/// The same with +∪, →∪ and →∩ alone: `so_far` is what areas of higher priority gave.
fn godot_by_operators(so_far: Tree, default: Vector, rest: &[(Zone, SpaceOverride)]) -> Tree {
    let Some(((zone, mode), rest)) = rest.split_first() else {
        return so_far.sum_union(Field::uniform(default));
    };
    let below = |so_far: Tree| godot_by_operators(so_far, default, rest);
    match mode {
        SpaceOverride::Combine => below(so_far.sum_union(zone.field())),
        SpaceOverride::ReplaceCombine => below(so_far.replace_union(zone.field())),
        SpaceOverride::Replace => below(so_far).replace_union(zone.field()),
        SpaceOverride::CombineReplace => {
            let sum = so_far.clone().sum_union(zone.field());
            let here = zone.field().replace_intersection(sum);
            below(so_far).replace_union(here)
        }
    }
}

/// The documented loop.
fn godot_loop(default: DVec3, areas: &[(Zone, SpaceOverride)], point: DVec3) -> DVec3 {
    let mut gravity = DVec3::ZERO;
    for (zone, mode) in by_priority(areas) {
        if !zone.holds(point) {
            continue;
        }
        match mode {
            SpaceOverride::Combine => gravity += zone.value(),
            SpaceOverride::CombineReplace => return gravity + zone.value(),
            SpaceOverride::Replace => return zone.value(),
            SpaceOverride::ReplaceCombine => gravity = zone.value(),
        }
    }
    gravity + default
}

// glTF.

/// `replace` and `stop` of a gravity volume.
type Gravity = (bool, bool);

/// `OMI_physics_gravity` (OMI glTF extensions): volumes of higher `priority` are calculated
/// first, the world's gravity last; `replace` says whether to replace what was calculated so far
/// instead of adding to it, `stop` whether to leave out volumes of lower priority and the world.
fn omi(world: Vector, volumes: &[(Zone, Gravity)]) -> Tree {
    let layer = |(zone, (replace, stop)): &(Zone, Gravity)| {
        let layer = Layer::new(zone.field()).priority(zone.priority);
        let layer = if *replace { layer.replacing() } else { layer };
        if *stop { layer.stopping() } else { layer }
    };
    let world = Layer::new(Field::uniform(world)).priority(i32::MIN);
    Tree::layers(volumes.iter().map(layer).chain([world]))
}

fn omi_loop(world: DVec3, volumes: &[(Zone, Gravity)], point: DVec3) -> DVec3 {
    let mut gravity = DVec3::ZERO;
    for (zone, (replace, stop)) in by_priority(volumes) {
        if zone.holds(point) {
            if replace {
                gravity = DVec3::ZERO;
            }
            gravity += zone.value();
            if stop {
                return gravity;
            }
        }
    }
    gravity + world
}

// SpriteKit.

/// `SKFieldNode.isExclusive` (Apple): where it acts, the field overrides all others. More than
/// one exclusive field at a place gives undefined results; here, there is one.
fn sprite_kit(exclusive: &Zone, others: &[(Zone, ())]) -> Tree {
    let others = others.iter().map(|(zone, ())| Layer::new(zone.field()));
    let last = Layer::new(exclusive.field()).priority(-1).replacing();
    Tree::layers(others.chain([last]))
}

/// The same: (the sum of all others) →∪ the exclusive one.
fn sprite_kit_by_operators(exclusive: &Zone, others: &[(Zone, ())]) -> Tree {
    let others = others.iter().map(|(zone, ())| zone.field());
    Tree::fold(Operator::SumUnion, others).replace_union(exclusive.field())
}

fn sprite_kit_loop(exclusive: &Zone, others: &[(Zone, ())], point: DVec3) -> Option<DVec3> {
    if exclusive.holds(point) {
        return Some(exclusive.value());
    }
    let here = others.iter().filter(|(zone, ())| zone.holds(point));
    here.map(|(zone, ())| zone.value()).reduce(|u, v| u + v)
}

// PhysX 2.8.

/// Shape groups of a force field (`NX_FFSG_EXCLUDE_GROUP`, PhysX 2.8): the field acts in every
/// shape of an include group that no shape of an exclude group covers.
fn physx(push: Vector, shapes: &[(Zone, bool)]) -> Tree {
    let all = |exclude: bool| {
        let shapes = shapes.iter().filter(move |(_, kind)| *kind == exclude);
        shapes.map(|(zone, _)| zone.region()).reduce(Region::union)
    };
    let Some(include) = all(false) else {
        return Tree::empty();
    };
    let field = Field::uniform(push);
    match all(true) {
        Some(exclude) => field.within(include.difference(exclude)).into(),
        None => field.within(include).into(),
    }
}

/// The same: a replacement of all included shapes by one another, − the excluded ones.
fn physx_by_operators(push: Vector, shapes: &[(Zone, bool)]) -> Tree {
    let all = |exclude: bool| {
        let shapes = shapes.iter().filter(move |(_, kind)| *kind == exclude);
        let field = |(zone, _): &(Zone, bool)| Field::uniform(push).within(zone.region());
        Tree::fold(Operator::ReplaceUnion, shapes.map(field))
    };
    all(false).difference(all(true))
}

fn physx_loop(push: DVec3, shapes: &[(Zone, bool)], point: DVec3) -> Option<DVec3> {
    let within = |kind: bool| {
        shapes
            .iter()
            .any(|(zone, k)| *k == kind && zone.holds(point))
    };
    (within(false) && !within(true)).then_some(push)
}

// LAMMPS.

/// A fix with the keyword `region`.
#[derive(Clone, Copy, Debug)]
struct Fix {
    /// `fix setforce`, not `fix addforce`.
    set: bool,
    /// The region is defined with `side out`.
    side_out: bool,
}

impl Fix {
    fn field(self, zone: &Zone) -> Field {
        let field = Field::uniform(vector(zone.vector));
        if self.side_out {
            field.outside(zone.region())
        } else {
            field.within(zone.region())
        }
    }
}

/// Fixes act in the order they were defined (LAMMPS manual): `addforce` adds to the force of
/// atoms in the region, `setforce` erases all previously computed forces on them; `side out`
/// takes what is outside the region's geometry.
fn lammps(fixes: &[(Zone, Fix)]) -> Tree {
    let layer = |(zone, fix): &(Zone, Fix)| {
        let layer = Layer::new(fix.field(zone));
        if fix.set { layer.replacing() } else { layer }
    };
    Tree::layers(fixes.iter().map(layer))
}

/// The same: `addforce` is +∪, `setforce` is →∪.
fn lammps_by_operators(fixes: &[(Zone, Fix)]) -> Tree {
    fixes.iter().fold(Tree::empty(), |tree, (zone, fix)| {
        let field = fix.field(zone);
        if fix.set {
            tree.replace_union(field)
        } else {
            tree.sum_union(field)
        }
    })
}

fn lammps_loop(fixes: &[(Zone, Fix)], point: DVec3) -> Option<DVec3> {
    let mut force = None;
    for (zone, fix) in fixes {
        if zone.holds(point) != fix.side_out {
            let before = if fix.set { None } else { force };
            force = Some(before.unwrap_or(DVec3::ZERO) + zone.value());
        }
    }
    force
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn godot_areas_override_as_documented(
        areas in zones_and(proptest::sample::select(&SpaceOverride::ALL[..]), 5),
        default in triple(-4..=4), points in points(),
    ) {
        let default = vector(default);
        let by_operators = godot_by_operators(Tree::empty(), default, &by_priority(&areas));
        let trees = [godot(default, &areas), by_operators];
        same(&trees, &points, |point| Some(godot_loop(to_dvec3(default), &areas, point)))?;
    }

    #[test]
    fn gltf_gravity_replaces_and_stops_as_documented(
        volumes in zones_and(any::<Gravity>(), 6), world in triple(-4..=4), points in points(),
    ) {
        let world = vector(world);
        let trees = [omi(world, &volumes)];
        same(&trees, &points, |point| Some(omi_loop(to_dvec3(world), &volumes, point)))?;
    }

    #[test]
    fn sprite_kit_fields_exclude_as_documented(
        exclusive in zone(), others in zones_and(Just(()), 5), points in points(),
    ) {
        let trees = [sprite_kit(&exclusive, &others), sprite_kit_by_operators(&exclusive, &others)];
        same(&trees, &points, |point| sprite_kit_loop(&exclusive, &others, point))?;
    }

    #[test]
    fn physx_groups_include_and_exclude_as_documented(
        push in triple(-4..=4), shapes in zones_and(any::<bool>(), 6), points in points(),
    ) {
        let push = vector(push);
        let trees = [physx(push, &shapes), physx_by_operators(push, &shapes)];
        same(&trees, &points, |point| physx_loop(to_dvec3(push), &shapes, point))?;
    }

    #[test]
    fn lammps_fixes_add_and_set_as_documented(
        fixes in zones_and(any::<(bool, bool)>(), 6), points in points(),
    ) {
        let fix = |(zone, (set, side_out))| (zone, Fix { set, side_out });
        let fixes: Vec<(Zone, Fix)> = fixes.into_iter().map(fix).collect();
        let trees = [lammps(&fixes), lammps_by_operators(&fixes)];
        same(&trees, &points, |point| lammps_loop(&fixes, point))?;
    }
}
