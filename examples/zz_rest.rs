//! scratch
#![allow(missing_docs, clippy::all)]
use rapier3d_fields::prelude::*;
use rapier3d_fields::{Detection, Responder};
use rapier3d_fields::rapier;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Mode { Rapier, Discrete, Swept, Both }

fn fields(world: &PhysicsWorld, mode: Mode, e: Real, f: Real, tree: Option<Tree>) -> Fields {
    let law = ContactLaw::restitution(e).with_friction(f);
    let mut trees: Vec<Tree> = Vec::new();
    if mode != Mode::Rapier {
        for (h, _) in world.colliders.iter() {
            trees.push(Field::contact(law).at(h).into());
        }
    }
    trees.extend(tree);
    if trees.is_empty() { trees.push(Field::uniform(Vector::ZERO).into()); }
    let mut b = Fields::builder(Tree::fold(Operator::SumUnion, trees));
    if mode == Mode::Swept { b = b.detection(Detection::Swept); }
    if mode == Mode::Both { b = b.responder(Responder::Both); }
    b.build().unwrap()
}

fn run(name: &str, hz: u32, secs: f32, mode: Mode, e: Real, f: Real, make: &dyn Fn(Real, Real) -> (PhysicsWorld, Vec<RigidBodyHandle>)) {
    let (mut world, bodies) = make(e, f);
    world.integration_parameters.dt = 1.0 / hz as Real;
    let mut fl = fields(&world, mode, e, f, None);
    let start: Vec<_> = bodies.iter().map(|b| world.bodies[*b].translation()).collect();
    let mut asleep = None;
    let mut maxrise: Real = 0.0;
    let t0 = std::time::Instant::now();
    let steps = (secs * hz as f32) as usize;
    let mut contacts = 0usize; let mut answered = 0;
    let mut exhausted = 0;
    let mut awake_steps = 0;
    for s in 0..steps {
        let out = fl.step(&mut world).unwrap();
        exhausted += out.exhausted as usize;
        contacts += out.contacts;
        answered += fl.contacts().iter().filter(|c| c.impulses[1] != Vector::ZERO).count();
        for (b, st) in bodies.iter().zip(&start) { maxrise = maxrise.max(world.bodies[*b].translation().y - st.y); }
        if bodies.iter().all(|b| world.bodies[*b].is_sleeping()) { if asleep.is_none() { asleep = Some(s); } } else { asleep = None; awake_steps += 1; }
    }
    let t = t0.elapsed().as_secs_f64() / steps as f64 * 1e6;
    let moved = bodies.iter().zip(&start).map(|(b, s)| { let d = world.bodies[*b].translation() - s; (d.x*d.x+d.z*d.z).sqrt() }).fold(0.0, Real::max);
    let low = bodies.iter().zip(&start).map(|(b, s)| s.y - world.bodies[*b].translation().y).fold(-1e9, Real::max);
    println!("{name:14} {hz:4} {mode:?} e{e} f{f}: fell {low:.4} moved {moved:.4} rise {maxrise:.4} asleep {asleep:?} contacts/step {:.1} answered {answered} exh {exhausted} us/step {t:.1} awake {awake_steps}", contacts as f64 / steps as f64);
}

fn floor(world: &mut PhysicsWorld, e: Real, f: Real) {
    world.insert(RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5, 0.0)), ColliderBuilder::cuboid(50.0, 0.5, 50.0).restitution(e).friction(f));
}

fn stack(n: usize, boxes: bool, gap: Real) -> impl Fn(Real, Real) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    move |e, f| {
        let mut w = PhysicsWorld::new();
        w.gravity = Vector::new(0.0, -9.81, 0.0);
        floor(&mut w, e, f);
        let b = (0..n).map(|i| {
            let c = if boxes { ColliderBuilder::cuboid(0.5, 0.5, 0.5) } else { ColliderBuilder::ball(0.5) };
            w.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.5 + i as Real * (1.0 + gap) + gap, 0.0)), c.restitution(e).friction(f)).0
        }).collect();
        (w, b)
    }
}

fn pyramid(e: Real, f: Real) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut w = PhysicsWorld::new();
    w.gravity = Vector::new(0.0, -9.81, 0.0);
    floor(&mut w, e, f);
    let mut b = vec![];
    for r in 0..6 { for i in 0..(6 - r) {
        b.push(w.insert(RigidBodyBuilder::dynamic().translation(Vector::new(i as Real * 1.05 + r as Real * 0.525, 0.5 + r as Real, 0.0)), ColliderBuilder::cuboid(0.5, 0.5, 0.5).restitution(e).friction(f)).0);
    } }
    (w, b)
}

fn slope(deg: Real) -> impl Fn(Real, Real) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    move |e, f| {
        let mut w = PhysicsWorld::new();
        let a = deg.to_radians();
        w.gravity = Vector::new(9.81 * a.sin(), -9.81 * a.cos(), 0.0);
        floor(&mut w, e, f);
        let b = w.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.5, 0.0)), ColliderBuilder::cuboid(0.5, 0.5, 0.5).restitution(e).friction(f)).0;
        (w, vec![b])
    }
}

fn heap(e: Real, f: Real) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut w = PhysicsWorld::new();
    w.gravity = Vector::new(0.0, -9.81, 0.0);
    floor(&mut w, e, f);
    for (x, z, hx, hz) in [(3.0, 0.0, 0.5, 3.5), (-3.0, 0.0, 0.5, 3.5), (0.0, 3.0, 3.5, 0.5), (0.0, -3.0, 3.5, 0.5)] {
        w.insert(RigidBodyBuilder::fixed().translation(Vector::new(x, 5.0, z)), ColliderBuilder::cuboid(hx, 5.0, hz).restitution(e).friction(f));
    }
    let mut b = vec![];
    for i in 0..50 {
        let p = Vector::new((i % 4) as Real * 1.1 - 1.6, 1.0 + (i / 16) as Real * 1.3, ((i / 4) % 4) as Real * 1.1 - 1.6);
        let c = match i % 5 {
            0 => ColliderBuilder::ball(0.45), 1 => ColliderBuilder::cuboid(0.4, 0.45, 0.5), 2 => ColliderBuilder::capsule_y(0.3, 0.3),
            3 => ColliderBuilder::cylinder(0.4, 0.4), _ => ColliderBuilder::cone(0.5, 0.45),
        };
        b.push(w.insert(RigidBodyBuilder::dynamic().translation(p).rotation(Vector::new(i as Real * 0.3, 0.2 * i as Real, 0.0)), c.restitution(e).friction(f)).0);
    }
    (w, b)
}

fn bounce(mode: Mode, hz: u32, e: Real, field_gravity: bool) {
    let mut w = PhysicsWorld::new();
    w.gravity = if field_gravity { Vector::ZERO } else { Vector::new(0.0, -9.81, 0.0) };
    w.integration_parameters.dt = 1.0 / hz as Real;
    floor(&mut w, e, 0.0);
    let b = w.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 2.5, 0.0)).can_sleep(false), ColliderBuilder::ball(0.5).restitution(e).friction(0.0)).0;
    let g: Option<Tree> = field_gravity.then(|| Field::uniform(Vector::new(0.0, -9.81, 0.0)).force_mode(ForceMode::Acceleration).into());
    let mut fl = fields(&w, mode, e, 0.0, g);
    let mut apex = vec![]; let (mut lasty, mut rising) = (2.5 as Real, false); let mut low: Real = 9.0;
    for _ in 0..(60 * hz) {
        fl.step(&mut w).unwrap();
        let y = w.bodies[b].translation().y;
        low = low.min(y);
        if rising && y < lasty { apex.push(lasty - 0.5); }
        rising = y > lasty; lasty = y;
    }
    let n = apex.len();
    println!("bounce {mode:?} {hz} e{e} field {field_gravity}: n {n} first {:?} last {:?} low {low:.4} final y {lasty:.4}", &apex[..n.min(4)], apex.last());
}

fn main() {
    let mut w = PhysicsWorld::new();
    w.gravity = Vector::new(0.0, -9.81, 0.0);
    w.integration_parameters.dt = 1.0 / 60.0;
    w.insert(RigidBodyBuilder::fixed(), ColliderBuilder::new(SharedShape::halfspace(Vector::Y)).restitution(0.0).friction(0.0));
    let b = w.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.3, 0.8, 0.2)), ColliderBuilder::cuboid(0.4, 0.3, 0.5).restitution(0.0).friction(0.0)).0;
    let mut fl = fields(&w, Mode::Swept, 0.0, 0.0, None);
    for s in 0..60 {
        fl.step(&mut w).unwrap();
        let bb = &w.bodies[b];
        println!("{s} y {} v {} w {:?} {:?}", bb.translation().y, bb.linvel().y, bb.angvel(), fl.contacts().iter().map(|c| (c.depth, c.approach_speed, c.time_of_impact, c.impulses[1])).collect::<Vec<_>>());
    }
}
