//! The contents of the scene.

use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy_rapier3d::prelude::*;
use bevy_rapier3d_fields::prelude::*;

const PLANET: Vec3 = Vec3::new(0.0, 7.0, 0.0);
const POOL: Vec3 = Vec3::new(-6.0, 1.0, 0.0);
const WIND: Vec3 = Vec3::new(5.0, 2.5, 4.0);
const MAGNET: Vec3 = Vec3::new(5.0, 4.0, -4.0);
const MIDDLE: Vec3 = Vec3::new(0.0, 0.3, 4.0);

/// Meshes and materials.
#[derive(Clone)]
struct Looks {
    ball: Handle<Mesh>,
    cube: Handle<Mesh>,
    capsule: Handle<Mesh>,
    grey: Handle<StandardMaterial>,
    blue: Handle<StandardMaterial>,
    orange: Handle<StandardMaterial>,
    red: Handle<StandardMaterial>,
    green: Handle<StandardMaterial>,
}

impl Looks {
    fn new(meshes: &mut Assets<Mesh>, materials: &mut Assets<StandardMaterial>) -> Self {
        let mut paint = |red, green, blue| materials.add(Color::srgb(red, green, blue));
        Looks {
            ball: meshes.add(Sphere::new(1.0)),
            cube: meshes.add(Cuboid::from_length(2.0)),
            capsule: meshes.add(Capsule3d::new(0.06, 0.3)),
            grey: paint(0.45, 0.47, 0.5),
            blue: paint(0.25, 0.45, 0.8),
            orange: paint(0.9, 0.55, 0.2),
            red: paint(0.8, 0.2, 0.2),
            green: paint(0.35, 0.65, 0.35),
        }
    }
}

fn drawn(mesh: &Handle<Mesh>, material: &Handle<StandardMaterial>, at: Transform) -> impl Bundle {
    (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), at)
}

pub fn camera() -> impl Bundle {
    let from = Transform::from_xyz(0.0, 11.0, 19.0);
    let view = from.looking_at(Vec3::Y * 3.0, Vec3::Y);
    (Camera3d::default(), Tonemapping::AcesFitted, view)
}

/// Builds the scene. Rapier's gravity is off: here gravity is a field.
pub fn build(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut contexts: Query<&mut RapierConfiguration>,
    mut drawing: ResMut<FieldsDebugRender>,
) {
    for mut context in &mut contexts {
        context.gravity = Vec3::ZERO;
    }
    drawing.pipeline.mode = bevy_rapier3d_fields::fields::debug_render::FieldDebugRenderMode::REGIONS;
    let looks = Looks::new(&mut meshes, &mut materials);
    let light = DirectionalLight {
        illuminance: 8_000.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let sun = Transform::from_xyz(6.0, 12.0, 8.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((light, sun));

    wall(
        &mut commands,
        &looks,
        Vec3::new(0.0, -0.25, 0.0),
        Vec3::new(11.0, 0.25, 8.0),
    );
    spawn_gravity(&mut commands, &looks);
    spawn_pool(&mut commands, &looks);
    spawn_wind(&mut commands, &looks);
    spawn_magnet(&mut commands, &looks);
    for number in 0..24_u8 {
        let [x, y, z] = [number % 4, number / 12, number / 4 % 3].map(f32::from);
        let at = MIDDLE + Vec3::new(x - 1.5, y, z - 1.0) * 0.65;
        let cube = drawn(&looks.cube, &looks.orange, Transform::from_translation(at));
        let cube = commands
            .spawn((cube, body(Collider::cuboid(1.0, 1.0, 1.0))))
            .id();
        commands
            .entity(cube)
            .entry::<Transform>()
            .and_modify(|mut at| at.scale = Vec3::splat(0.3));
    }
}

fn body(collider: Collider) -> impl Bundle {
    (
        RigidBody::Dynamic,
        collider,
        TransformInterpolation::default(),
    )
}

fn wall(commands: &mut Commands, looks: &Looks, at: Vec3, half_extents: Vec3) {
    let place = Transform::from_translation(at).with_scale(half_extents);
    let collider = Collider::cuboid(1.0, 1.0, 1.0);
    commands.spawn((drawn(&looks.cube, &looks.grey, place), collider));
}

/// Gravity is one tree: around the planet, its gravity replaces the uniform one. Moons circle the planet.
fn spawn_gravity(commands: &mut Commands, looks: &Looks) {
    let down = Field::gravity_zone(Vec3::Y * -9.81, Region::everywhere());
    let planet = Field::point_gravity(20.0)
        .within(Region::ball(3.0))
        .at(PLANET);
    commands.spawn(ForceField::new(down.replace_union(planet)));
    let place = Transform::from_translation(PLANET).with_scale(Vec3::splat(0.9));
    commands.spawn((drawn(&looks.ball, &looks.green, place), Collider::ball(1.0)));
    for number in 0..5_u8 {
        let angle = f32::from(number) * std::f32::consts::TAU / 5.0;
        let tilt = Quat::from_rotation_x(0.3 + 0.2 * f32::from(number));
        let out = tilt * Vec3::new(angle.cos(), 0.0, angle.sin());
        let along = tilt * Vec3::new(-angle.sin(), 0.0, angle.cos());
        let distance = 1.7 + 0.2 * f32::from(number);
        let place = Transform::from_translation(PLANET + out * distance);
        let moon = drawn(
            &looks.ball,
            &looks.grey,
            place.with_scale(Vec3::splat(0.15)),
        );
        let speed = Velocity::linear(along * (20.0 / distance).sqrt());
        commands.spawn((moon, body(Collider::ball(1.0)), speed));
    }
}

/// Water in a basin, in which lighter bodies float.
fn spawn_pool(commands: &mut Commands, looks: &Looks) {
    let half_extents = Vec3::new(2.5, 1.0, 2.5);
    let water = Tree::pool(Vec3::Y, half_extents, 1.0, 9.81, 3.0);
    commands.spawn((ForceField::new(water), Transform::from_translation(POOL)));
    for side in [-1.0, 1.0] {
        let x = POOL + Vec3::X * side * 2.65;
        wall(commands, looks, x, Vec3::new(0.15, 1.3, 2.8));
        let z = POOL + Vec3::Z * side * 2.65;
        wall(commands, looks, z, Vec3::new(2.8, 1.3, 0.15));
    }
    for number in 0..12_u8 {
        let [x, z] = [number % 4, number / 4].map(f32::from);
        let place = POOL + Vec3::new(x - 1.5, 2.0 + 0.3 * x, z - 1.0);
        let place = Transform::from_translation(place).with_scale(Vec3::splat(0.35));
        // Every third cube sinks.
        let density = if number % 3 == 0 { 2.0 } else { 0.2 + 0.1 * z };
        let material = if number % 3 == 0 {
            &looks.grey
        } else {
            &looks.blue
        };
        let cube = drawn(&looks.cube, material, place);
        let mass = ColliderMassProperties::Density(density);
        commands.spawn((cube, body(Collider::cuboid(1.0, 1.0, 1.0)), mass));
    }
}

/// An updraft in the shape of a sensor, in which light balls hover.
fn spawn_wind(commands: &mut Commands, looks: &Looks) {
    let shape = (Collider::cylinder(2.5, 1.5), Sensor, WithinCollider);
    // It carries bodies whose terminal velocity is the speed of the wind.
    let wind = ForceField::new(Field::wind(Vec3::Y * 10.0, 0.0, 0.01));
    commands.spawn((shape, wind, Transform::from_translation(WIND)));
    for number in 0..9_u8 {
        let [x, z] = [number % 3, number / 3].map(f32::from);
        let place = WIND + Vec3::new(x - 1.0, x * 0.5 - 1.5, z - 1.0) * 0.8;
        let place = Transform::from_translation(place).with_scale(Vec3::splat(0.2));
        let ball = drawn(&looks.ball, &looks.red, place);
        let mass = ColliderMassProperties::Mass(0.08);
        commands.spawn((ball, body(Collider::ball(1.0)), mass));
    }
}

/// A magnet that lifts nails off the floor.
fn spawn_magnet(commands: &mut Commands, looks: &Looks) {
    let pull = ForceField::new(Field::magnet(6.0, 0.5, 4.5));
    let place = Transform::from_translation(MAGNET).with_scale(Vec3::splat(0.5));
    let magnet = drawn(&looks.cube, &looks.red, place);
    commands.spawn((magnet, Collider::cuboid(1.0, 1.0, 1.0), pull));
    for number in 0..16_u8 {
        let [x, z] = [number % 4, number / 4].map(f32::from);
        let place = MAGNET + Vec3::new((x - 1.5) * 0.7, -3.5, (z - 1.5) * 0.7);
        let nail = drawn(
            &looks.capsule,
            &looks.grey,
            Transform::from_translation(place),
        );
        let mass = ColliderMassProperties::Mass(0.02);
        commands.spawn((nail, body(Collider::capsule_y(0.15, 0.06)), mass));
    }
}

/// Seconds until an entity is despawned.
#[derive(Component)]
pub struct Fading(f32);

/// Sets off an explosion among the cubes in the middle. The field acts in one step; the entity stays for a moment.
pub fn explode(commands: &mut Commands) {
    let bang = ForceField::new(Field::explosion(9.0, 4.0));
    commands.spawn((bang, Fading(0.1), Transform::from_translation(MIDDLE)));
}

/// Despawns entities whose time is over.
pub fn fade(mut commands: Commands, time: Res<Time>, mut fading: Query<(Entity, &mut Fading)>) {
    for (entity, mut left) in &mut fading {
        left.0 -= time.delta_secs();
        if left.0 < 0.0 {
            commands.entity(entity).despawn();
        }
    }
}
