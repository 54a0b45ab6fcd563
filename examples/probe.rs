use rapier3d_fields::prelude::*;
use rapier3d_fields::scenes::ammonia::AmmoniaSettings;
use std::time::Instant;
#[path = "../benches/support/mod.rs"]
mod support;
fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let args: Vec<f32> = std::env::args()
        .skip(1)
        .filter_map(|a| a.parse().ok())
        .collect();
    let steps = args.first().copied().unwrap_or(2000.0) as usize;
    let dt = args.get(1).copied().unwrap_or(0.001);
    let settings = AmmoniaSettings {
        dt,
        ..AmmoniaSettings::default()
    };
    let mut scene = settings.build()?;
    let tree = scene.tree(Some(10.0), ContactLaw::Impulse { restitution: 1.0 });
    let mut fields = scene.fields(Fields::builder(tree).cross_check(true))?;
    println!("{}", fields.plan());
    let energy = |fields: &mut Fields, scene: &rapier3d_fields::scenes::ammonia::BoxOfAmmonia| {
        let k = scene.kinetic_energy();
        let u = fields
            .potential_energy(&scene.world.bodies, &scene.world.colliders)
            .total;
        (k, u)
    };
    let (k0, u0) = energy(&mut fields, &scene);
    println!("E0 {k0} {u0} {}", k0 + u0);
    let mut wall = rapier3d_fields::math::DVec3::ZERO;
    let p0 = scene.momentum();
    let start = Instant::now();
    let mut contacts = 0;
    for step in 0..steps {
        let out = fields.step(&mut scene.world)?;
        contacts += out.contacts;
        for c in fields.contacts() {
            for (body, j) in c.bodies.iter().zip(c.impulses) {
                if body.is_some_and(|b| scene.world.bodies[b].is_fixed()) {
                    wall += j.as_dvec3();
                }
            }
        }
        if (step + 1) % (steps / 8).max(1) == 0 {
            let (k, u) = energy(&mut fields, &scene);
            println!(
                "{} K {k:.1} U {u:.1} E {:.1} drift {:.2e} P {:?}",
                step + 1,
                k + u,
                (k + u - k0 - u0) / k0,
                (scene.momentum() + wall - p0).length()
            );
        }
    }
    let t = start.elapsed().as_secs_f64() / steps as f64 * 1e6;
    println!(
        "{t:.1} us/step, {contacts} contacts, {:?}",
        fields.cross_check()
    );
    let start = Instant::now();
    for _ in 0..2000 {
        fields.sample(
            scene.molecules[0].body,
            &scene.world.bodies,
            &scene.world.colliders,
        )?;
    }
    println!("sample {:.1}", start.elapsed().as_secs_f64() / 2000.0 * 1e6);
    let start = Instant::now();
    for _ in 0..2000 {
        scene.world.step();
    }
    println!(
        "bare step {:.1}",
        start.elapsed().as_secs_f64() / 2000.0 * 1e6
    );
    let mut scene = settings.build()?;
    let mut plain = support::cell_list::CellList::new(&scene, 10.0);
    let start = Instant::now();
    for _ in 0..steps {
        plain.step(&mut scene.world);
    }
    println!(
        "plain {:.1}",
        start.elapsed().as_secs_f64() / steps as f64 * 1e6
    );
    let start = Instant::now();
    for _ in 0..2000 {
        plain.forces(&scene.world);
    }
    println!(
        "plain forces {:.1}",
        start.elapsed().as_secs_f64() / 2000.0 * 1e6
    );
    let mut scene = settings.build()?;
    let mut rival = support::vectorised::Vectorised::new(&scene, 10.0);
    let start = Instant::now();
    for _ in 0..steps {
        rival.step(&mut scene.world);
    }
    println!(
        "rival {:.1}",
        start.elapsed().as_secs_f64() / steps as f64 * 1e6
    );
    let start = Instant::now();
    for _ in 0..2000 {
        rival.forces(&scene.world);
    }
    println!(
        "rival forces {:.1}",
        start.elapsed().as_secs_f64() / 2000.0 * 1e6
    );
    Ok(())
}
