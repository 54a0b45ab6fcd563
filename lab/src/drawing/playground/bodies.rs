//! Moving bodies, and their shadows on the floor.

use rapier3d_fields::math::{DPose3, DVec3, to_dpose3, to_dvec3, to_f64};

use super::size_at;
use crate::drawing::space::{Camera, Canvas, Paint, Rgb, disc, draw_ball, draw_box, mix};
use crate::single::scenes::playground::{ISLAND, Kind, POOL, POOL_SIZE, Playground, Thing};

/// The appearance of a body.
struct Look {
    pose: DPose3,
    shape: Shape,
    colors: [Rgb; 2],
}

enum Shape {
    Ball(f64),
    Box(DVec3),
}

/// The two colours of an awake body of a kind.
fn colors(kind: Kind) -> [Rgb; 2] {
    match kind {
        Kind::Moon => [[206.0, 212.0, 224.0], [232.0, 236.0, 244.0]],
        Kind::Crate => [[214.0, 128.0, 34.0], [255.0, 178.0, 66.0]],
        Kind::Raft => [[212.0, 142.0, 60.0], [246.0, 190.0, 104.0]],
        Kind::Ball => [[42.0, 205.0, 160.0], [236.0, 255.0, 246.0]],
        Kind::Iron => [[224.0, 74.0, 148.0], [255.0, 128.0, 186.0]],
    }
}

/// The colours of sleeping bodies, mixed with a little of their own.
const ASLEEP: [Rgb; 2] = [[104.0, 118.0, 142.0], [124.0, 138.0, 162.0]];

impl Look {
    fn of(level: &Playground, thing: &Thing) -> Option<Self> {
        let size = size_at(level.step, thing.since);
        let size = if thing.kind == Kind::Moon { 1.0 } else { size };
        let body = &level.world.bodies[thing.body];
        let collider = &level.world.colliders[*body.colliders().first()?];
        let shape = match (collider.shape().as_ball(), collider.shape().as_cuboid()) {
            (Some(ball), _) => Shape::Ball(size * to_f64(ball.radius)),
            (_, Some(cuboid)) => Shape::Box(size * to_dvec3(cuboid.half_extents)),
            _ => return None,
        };
        let awake = colors(thing.kind);
        let asleep = [0, 1].map(|k| mix(ASLEEP[k], awake[k], 0.12));
        (size > 0.0).then(|| Self {
            pose: to_dpose3(body.position()),
            shape,
            colors: if body.is_sleeping() { asleep } else { awake },
        })
    }

    fn radius(&self) -> f64 {
        match self.shape {
            Shape::Ball(radius) => radius,
            Shape::Box(half) => 0.5 * (half.x + half.z) * 1.25,
        }
    }
}

fn looks(level: &Playground) -> impl Iterator<Item = Look> + '_ {
    let things = level.things.iter();
    things.filter_map(|thing| Look::of(level, thing))
}

pub fn draw(canvas: &mut Canvas, camera: &Camera, level: &Playground) {
    for look in looks(level) {
        let [base, mark] = look.colors;
        match look.shape {
            Shape::Box(half) => draw_box(canvas, camera, &look.pose, half, look.colors),
            Shape::Ball(radius) => draw_ball(canvas, camera, &look.pose, radius, |local| {
                // A band that makes rolling visible.
                if local.x.abs() < 0.28 { mark } else { base }
            }),
        }
    }
}

/// Darkens the floor below bodies, less below higher ones.
pub fn draw_shadows(canvas: &mut Canvas, camera: &Camera, level: &Playground) {
    let (near, far) = (to_dvec3(POOL - POOL_SIZE), to_dvec3(POOL + POOL_SIZE));
    let island = to_dvec3(ISLAND);
    for look in looks(level) {
        let at = look.pose.translation;
        let over_pool = near.x < at.x && at.x < far.x && near.z < at.z && at.z < far.z;
        if over_pool || at.x.abs() > island.x || at.z.abs() > island.z || at.y < 0.0 {
            continue;
        }
        let below = DVec3::new(at.x, 0.0, at.z);
        let strength = 0.2 / (1.0 + 0.5 * at.y);
        for share in [1.35, 1.1, 0.85] {
            let spots = disc(camera, below, share * look.radius() * (1.0 + 0.08 * at.y));
            let paint = Paint::clear([4.0, 8.0, 22.0], strength);
            canvas.polygon(&spots, &paint.on_face());
        }
    }
}
