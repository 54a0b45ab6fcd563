//! Scenes as they went, for the page of the study: bodies frame by frame, contacts as both detections see
//! them, and fields as arrows.

use rapier3d_fields::math::to_f64;
use rapier3d_fields::prelude::*;
use rapier3d_fields::{Difference, Disagreement};
use serde_json::{Value, json};

use crate::AnyError;
use crate::single::scenes::ammonia::AmmoniaSettings;
use crate::single::scenes::level;
use crate::single::scenes::spheres::SpheresSettings;

/// Numbers of the page are to this share of a scene's size.
const FINE: f64 = 2e-4;

/// A scene and how it is told of.
struct Scene {
    name: &'static str,
    description: &'static str,
    time_unit: &'static str,
    /// What is shown is within this distance of the origin.
    radius: f64,
    steps: usize,
    /// Every so many steps is a frame.
    every: usize,
    world: PhysicsWorld,
    fields: Fields,
    /// Where the arrows of fields begin, and how long one of unit force is.
    arrows: (Vec<Vector>, f64),
    /// Whether contacts are cross-checked.
    checked: bool,
}

/// The scenes of the page.
///
/// # Errors
/// A scene cannot be built, or a step of it fails.
pub fn all() -> Result<Vec<Value>, AnyError> {
    [ammonia()?, spheres()?, level()?]
        .into_iter()
        .map(Scene::play)
        .collect()
}

fn ammonia() -> Result<Scene, AnyError> {
    let settings = AmmoniaSettings {
        count: 27,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build()?;
    let tree = scene.tree(Some(10.0), ContactLaw::elastic());
    let fields = scene.fields(Fields::builder(tree).cross_check(true))?;
    Ok(Scene {
        name: "27 molecules of ammonia",
        description: "Each atom carries an electric field, and a detection field that answers contacts.",
        time_unit: "ps",
        radius: 15.0,
        steps: 3000,
        every: 15,
        world: scene.world,
        fields,
        arrows: (Vec::new(), 0.0),
        checked: true,
    })
}

fn spheres() -> Result<Scene, AnyError> {
    let settings = SpheresSettings {
        count: 40,
        ..SpheresSettings::default()
    };
    let scene = settings.build()?;
    let tree = scene.tree(ContactLaw::elastic());
    let fields = Fields::builder(tree).cross_check(true).build()?;
    let size = scene.half_extents.length();
    Ok(Scene {
        name: "40 spheres in a box",
        description: "Elastic spheres, found and answered by a field around each.",
        time_unit: "s",
        radius: to_f64(size),
        steps: 600,
        every: 3,
        world: scene.world,
        fields,
        arrows: (Vec::new(), 0.0),
        checked: true,
    })
}

/// Crates on a floor under Rapier's gravity; wind over a half of it, a pool, a planet.
fn level() -> Result<Scene, AnyError> {
    let (world, tree) = level::build();
    let fields = Fields::new(tree)?;
    let mut from = Vec::new();
    for x in -7..0 {
        for z in -3..4 {
            from.push(Vector::new(x as Real, 0.0, 2.0 * z as Real));
        }
    }
    Ok(Scene {
        name: "a level with wind and water",
        description: "Crates and balls fall under Rapier's gravity; wind blows over the left half, a pool carries what \
                      floats on the right, a moon goes around its planet.",
        time_unit: "s",
        radius: 9.0,
        steps: 720,
        every: 4,
        world,
        fields,
        arrows: (from, 2e-3),
        checked: false,
    })
}

impl Scene {
    fn play(mut self) -> Result<Value, AnyError> {
        let movers: Vec<RigidBodyHandle> = self.movers();
        let bodies: Vec<Value> = movers.iter().map(|body| self.parts(*body)).collect();
        let (mut frames, mut contacts) = (Vec::new(), Vec::new());
        let mut since: Vec<[f64; 4]> = Vec::new();
        for step in 0..self.steps {
            if step % self.every == 0 {
                frames.push(self.frame(&movers));
                contacts.push(std::mem::take(&mut since));
            }
            self.fields.step(&mut self.world)?;
            self.note_contacts(&mut since);
        }
        let dt = to_f64(self.world.integration_parameters.dt);
        Ok(json!({
            "name": self.name, "description": self.description, "time_unit": self.time_unit,
            "interval": dt * self.every as f64, "center": [0.0, 0.0, 0.0], "radius": self.radius,
            "bodies": bodies, "frames": frames,
            "contacts": self.checked.then_some(contacts),
            "lines": self.edges(), "arrows": self.arrows(),
        }))
    }

    fn movers(&self) -> Vec<RigidBodyHandle> {
        let bodies = self.world.bodies.iter();
        let movers = bodies.filter(|(_, body)| body.is_dynamic());
        movers.map(|(handle, _)| handle).collect()
    }

    /// The colliders of a body, with their colours.
    fn parts(&self, body: RigidBodyHandle) -> Value {
        let colliders = self.world.bodies[body].colliders().iter().enumerate();
        let number = body.into_raw_parts().0 as usize;
        let several = self.world.bodies[body].colliders().len() > 1;
        let parts = colliders.map(|(place, handle)| {
            let collider = &self.world.colliders[*handle];
            let at = collider
                .position_wrt_parent()
                .map_or(Vector::ZERO, |it| it.translation);
            // Nitrogen is blue and its hydrogens are light; else bodies are told apart.
            let (color, light) = match (several, place) {
                (true, 0) => ("#2f6ecb", "#9cc3ff"),
                (true, _) => ("#aab4c4", "#f4f7fb"),
                _ => [
                    ("#1c9169", "#7fdcb9"),
                    ("#e27d28", "#ffc58f"),
                    ("#7a5cd6", "#c6b5ff"),
                ][number % 3],
            };
            let shape = collider.shape();
            let half = shape.as_cuboid().map(|it| it.half_extents.to_array());
            json!({
                "at": at.to_array(), "color": color, "light": light,
                "radius": shape.as_ball().map(|ball| ball.radius), "half": half,
            })
        });
        parts.collect()
    }

    /// Positions and attitudes, as whole multiples of what can be seen.
    fn frame(&self, movers: &[RigidBodyHandle]) -> Vec<f64> {
        let poses = movers.iter().flat_map(|handle| {
            let pose = self.world.bodies[*handle].position();
            let place = pose
                .translation
                .to_array()
                .map(|it| self.rounded(to_f64(it)));
            let turn = pose
                .rotation
                .to_array()
                .map(|it| (1e3 * to_f64(it)).round() / 1e3);
            place.into_iter().chain(turn)
        });
        poses.collect()
    }

    fn rounded(&self, length: f64) -> f64 {
        let fine = 10_f64.powf((self.radius * FINE).log10().floor());
        (length / fine).round() * fine
    }

    /// Where contacts are: 0 seen by both, 1 by fields only, 2 by Rapier only.
    fn note_contacts(&self, contacts: &mut Vec<[f64; 4]>) {
        let Some(report) = self.fields.cross_check() else {
            return;
        };
        let at = |point: Vector, kind: f64| {
            let [x, y, z] = point.to_array().map(|it| self.rounded(to_f64(it)));
            [x, y, z, kind]
        };
        let only = |it: &Disagreement| match it.difference {
            Difference::OnlyField { .. } => Some(1.0),
            Difference::OnlyRapier { .. } => Some(2.0),
            _ => None,
        };
        let odd = report.disagreements.iter();
        let odd = odd.filter_map(|it| Some(at(it.world_point, only(it)?)));
        contacts.extend(odd);
        let found = self.fields.contacts().iter();
        contacts.extend(found.map(|it| at(it.world_point, 0.0)));
    }

    /// The edges of fixed cuboids that bodies are within or on: their inner faces would hide what is seen.
    fn edges(&self) -> Vec<Value> {
        let mut lines = Vec::new();
        let boxes = self.world.colliders.iter();
        for (_, collider) in boxes {
            let fixed = collider
                .parent()
                .is_none_or(|it| self.world.bodies[it].is_fixed());
            let Some(cuboid) = collider.shape().as_cuboid().filter(|_| fixed) else {
                continue;
            };
            let corner = |bits: usize| {
                let sign = |bit: usize| if bits >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let local = cuboid.half_extents * Vector::new(sign(0), sign(1), sign(2));
                collider.position().transform_point(local).to_array()
            };
            for bits in 0..8 {
                let ends = (0..3).filter(|bit| bits >> bit & 1 == 0);
                lines.extend(ends.map(|bit| json!([corner(bits), corner(bits | 1 << bit)])));
            }
        }
        // Walls of closed boxes overlap far beyond what is seen.
        match lines.len() > 12 {
            true => self.inner_box(),
            false => lines,
        }
    }

    /// The edges of the closed box that six walls leave free.
    fn inner_box(&self) -> Vec<Value> {
        let mut free = [Real::INFINITY; 3];
        for (_, collider) in self.world.colliders.iter() {
            let Some(cuboid) = collider.shape().as_cuboid() else {
                continue;
            };
            let near = collider.translation().abs() - cuboid.half_extents;
            for (axis, free) in free.iter_mut().enumerate() {
                if near[axis] > 0.0 {
                    *free = free.min(near[axis]);
                }
            }
        }
        let mut lines = Vec::new();
        let corner = |bits: usize| {
            let sign = |bit: usize| if bits >> bit & 1 == 1 { 1.0 } else { -1.0 };
            [0, 1, 2].map(|axis| free[axis] * sign(axis))
        };
        for bits in 0..8 {
            let ends = (0..3).filter(|bit| bits >> bit & 1 == 0);
            lines.extend(ends.map(|bit| json!([corner(bits), corner(bits | 1 << bit)])));
        }
        lines
    }

    fn arrows(&self) -> Vec<Value> {
        let (from, scale) = &self.arrows;
        let values = self
            .fields
            .at(from, &self.world.bodies, &self.world.colliders);
        let arrows = from
            .iter()
            .zip(values)
            .filter(|(_, value)| value.is_defined);
        let arrows = arrows.map(|(from, value)| {
            let to = *from + value.force * (*scale as Real);
            json!([from.to_array(), to.to_array()])
        });
        arrows.collect()
    }
}
