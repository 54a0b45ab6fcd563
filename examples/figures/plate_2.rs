//! Plate 2: two molecules of ammonia collide off-centre, and then spin. Only contact fields around their atoms act.

use std::fmt::Write;
use std::path::Path;

use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::AnyError;
use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, document, text};
use rapier3d_fields_lab::single::scenes::ammonia::{Molecule, SITES, insert_molecule};

const FRAMES: usize = 8;
const COLUMNS: usize = 4;
/// Steps of 1 fs between frames.
const STEPS: usize = 55;
const CELL: [f64; 2] = [250.0, 190.0];
const HEADING: f64 = 84.0;
const MARGIN: f64 = 20.0;
/// Pixels per ångström.
const SCALE: f64 = 21.0;
/// Of nitrogen and hydrogen: fill and rim.
const COLORS: [[&str; 2]; 2] = [["#7ba2e8", "#2f55a4"], ["#ffffff", "#8b98ab"]];

/// Runs the collision, reports it, and draws some moments of it.
pub fn draw(path: &Path) -> Result<(), AnyError> {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.integration_parameters.dt = 1e-3;
    let mut insert = |x: f32, y: f32, turn: Vector, v: f32| {
        let pose = Pose::new(Vector::new(x, y, 0.0), turn);
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        insert_molecule(bodies, colliders, pose, Vector::X * v, Vector::ZERO)
    };
    // A hydrogen of each molecule is in the way of the other molecule.
    let turn = std::f32::consts::PI + 1.2;
    let left = insert(-3.6, -0.75, Vector::Z * 1.2, 12.0);
    let right = insert(3.6, 0.75, Vector::Z * turn, -12.0);
    let molecules = [left, right];
    let parts = molecules.iter().flat_map(|it| it.sites);
    let contacts = parts.map(|it| Field::contact(ContactLaw::elastic()).at(it));
    let tree = Tree::fold(Operator::SumUnion, contacts);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let mut fields = builder.build()?;

    let mut svg = String::new();
    let subtitle =
        "two molecules collide off their middles: what they lose in speed they spin with";
    text(&mut svg, [MARGIN, 36.0], 21.0, INK, "Plate 2");
    text(&mut svg, [MARGIN, 62.0], 14.5, FAINT, subtitle);
    let (before, mut touches) = (Motion::of(&world, &molecules), 0);
    for frame in 0..FRAMES {
        draw_frame(&mut svg, frame, &world, &molecules);
        for _ in 0..STEPS {
            fields.step(&mut world)?;
            touches += fields
                .contacts()
                .iter()
                .filter(|it| it.time_of_impact.is_some())
                .count();
        }
    }
    let after = Motion::of(&world, &molecules);
    println!("plate 2: {touches} touches; before {before}; after {after}");
    let rows = FRAMES.div_ceil(COLUMNS) as f64;
    let size = [
        2.0 * MARGIN + COLUMNS as f64 * CELL[0],
        HEADING + rows * CELL[1] + MARGIN,
    ];
    std::fs::write(path, document(size[0], size[1], &svg))?;
    println!("two molecules: {}\n", path.display());
    Ok(())
}

/// Sums over both molecules.
struct Motion {
    energy: f64,
    spinning: f64,
    momentum: DVec3,
    angular_momentum: DVec3,
}

impl Motion {
    fn of(world: &PhysicsWorld, molecules: &[Molecule]) -> Self {
        let mut sum = Motion {
            energy: 0.0,
            spinning: 0.0,
            momentum: DVec3::ZERO,
            angular_momentum: DVec3::ZERO,
        };
        for molecule in molecules {
            let body = &world.bodies[molecule.body];
            let (place, velocity) = (to_dvec3(body.translation()), to_dvec3(body.linvel()));
            let momentum = velocity * to_f64(body.mass());
            let inertia = body.mass_properties().effective_angular_inertia();
            let spin = to_dvec3(inertia * body.angvel());
            let all = to_f64(body.kinetic_energy());
            sum.energy += all;
            sum.spinning += all - 0.5 * momentum.dot(velocity);
            sum.momentum += momentum;
            sum.angular_momentum += spin + place.cross(momentum);
        }
        sum
    }
}

impl std::fmt::Display for Motion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "energy {:.2} amu Å²/ps², {:.0} % of it spin, momentum {:.2}, angular momentum {:.2}",
            self.energy,
            100.0 * self.spinning / self.energy,
            self.momentum,
            self.angular_momentum
        )
    }
}

/// Draws the atoms of both at one moment, with the radii at which they collide, the nearest last.
fn draw_frame(svg: &mut String, frame: usize, world: &PhysicsWorld, molecules: &[Molecule]) {
    let middle = [
        MARGIN + (frame % COLUMNS) as f64 * CELL[0] + 0.5 * CELL[0],
        HEADING + (frame / COLUMNS) as f64 * CELL[1] + 0.5 * CELL[1],
    ];
    let label = format!("{} fs", frame * STEPS);
    let corner = [
        middle[0] - 0.5 * CELL[0] + 8.0,
        middle[1] - 0.5 * CELL[1] + 18.0,
    ];
    text(svg, corner, 13.0, FAINT, &label);
    let mut atoms: Vec<(DVec3, usize)> = Vec::new();
    for molecule in molecules {
        let pose = world.bodies[molecule.body].position();
        for (number, site) in SITES.iter().enumerate() {
            let local = Vector::from_array(site.local_point.map(|x| x as f32));
            atoms.push((to_dvec3(pose.transform_point(local)), number));
        }
    }
    atoms.sort_by(|a, b| a.0.z.total_cmp(&b.0.z));
    for (place, number) in atoms {
        let [fill, rim] = COLORS[usize::from(number > 0)];
        let (x, y) = (middle[0] + SCALE * place.x, middle[1] - SCALE * place.y);
        let radius = SCALE * SITES[number].hard_radius;
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{fill}\" stroke=\"{rim}\" \
             stroke-width=\"1.3\"/>"
        );
    }
}
