//! Every scene of the project has a file in `examples/scenes/`, as this crate writes it, which runs
//! like the scene built in code, bit for bit.
//!
//! The files are those of `f32`. `WRITE_SCENES=1 cargo test -p rapier3d-fields-scene the_files_are` writes them anew.

use crate::files::{Document, SceneFile};
use crate::lab::scenes::ammonia::AmmoniaSettings;
use crate::lab::scenes::figures::{Figure3Settings, Figure4Settings};
use crate::lab::scenes::flock::FlockSettings;
use crate::lab::scenes::head_on::{HeadOnSettings, Meeting};
use crate::lab::scenes::level;
use crate::lab::scenes::spheres::SpheresSettings;
use rapier3d_fields::prelude::*;

use crate::bits::bits;

/// A scene as it is built in code.
struct Built {
    name: &'static str,
    about: &'static str,
    world: PhysicsWorld,
    fields: Fields,
    /// The tree for the file, where that of the scene holds code.
    without_code: Option<Tree>,
    /// Some bodies' numbers, and their names.
    names: Vec<(usize, &'static str)>,
    steps: usize,
}

impl Built {
    fn new(name: &'static str, about: &'static str, world: PhysicsWorld, fields: Fields) -> Self {
        Built {
            name,
            about,
            world,
            fields,
            without_code: None,
            names: Vec::new(),
            steps: 400,
        }
    }

    fn file(&self) -> SceneFile {
        let file = match &self.without_code {
            None => SceneFile::new(&self.world, &self.fields),
            Some(tree) => SceneFile::new(&self.world, &fields(tree.clone())),
        };
        let file = file.expect("a scene without code").about(self.about);
        let names = self.names.iter();
        names.fold(file, |file, (number, name)| file.name_body(*number, name))
    }
}

fn fields(tree: impl Into<Tree>) -> Fields {
    Fields::new(tree).expect("a valid tree")
}

fn ammonia() -> Built {
    let settings = AmmoniaSettings {
        count: 27,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build().expect("valid settings");
    let tree = scene.tree(Some(10.0), ContactLaw::elastic());
    let fields = scene.fields(Fields::builder(tree).cross_check(true));
    let about = "27 rigid molecules of ammonia in a closed box (the paper's second simulation): on \
                 every atom an electric field and a collision field, on every nitrogen \
                 Lennard-Jones, on every wall a collision field. Å, amu, ps.";
    let fields = fields.expect("a valid tree");
    Built::new("ammonia", about, scene.world, fields)
}

fn spheres() -> Built {
    let scene = SpheresSettings::default().build().expect("valid settings");
    let tree = scene.tree(ContactLaw::elastic());
    let fields = Fields::builder(tree).cross_check(true).build();
    let about = "20 equal elastic spheres in a closed box (the paper's first simulation): a \
                 collision field around each, and on every wall.";
    Built::new("spheres", about, scene.world, fields.expect("a valid tree"))
}

fn figure_3() -> Built {
    let settings = Figure3Settings::default();
    let figure = settings.build().expect("valid settings");
    let about = "The paper's Figure 3: an attraction with a repulsion in its place where a body \
                 touches the surface. In code the repulsion asks for the body's radius by a \
                 predicate; here it has one ball for each radius there is.";
    let radii: Vec<Real> = settings.bodies.iter().map(|(radius, ..)| *radius).collect();
    let tree = Tree::instances(settings.field.tree_for(&radii), figure.sources.clone());
    Built {
        without_code: Some(tree),
        steps: 3000,
        ..Built::new("figure_3", about, figure.world, fields(figure.tree))
    }
}

fn figure_4() -> Built {
    let settings = Figure4Settings::default();
    let figure = settings.build().expect("valid settings");
    let about = "The paper's Figure 4: three bodies that each carry the composite of Figure 3. The \
                 repulsion has the ball for the radius that all three have, in place of a predicate.";
    let own = settings.field.tree_for(&[settings.field.surface]);
    let tree = Tree::instances(own, figure.sources.clone());
    Built {
        without_code: Some(tree),
        steps: 3000,
        ..Built::new("figure_4", about, figure.world, fields(figure.tree))
    }
}

fn flock() -> Built {
    let flock = FlockSettings::default().build().expect("valid settings");
    let about = "40 birds that avoid one another, hold together and follow a path; from time 8, \
                 for 1.5, a gust drives half of them into the others.";
    Built {
        steps: 1200,
        ..Built::new("flock", about, flock.world, fields(flock.tree))
    }
}

fn head_on(name: &'static str, about: &'static str, meeting: Meeting) -> Built {
    let settings = HeadOnSettings {
        meeting,
        ..HeadOnSettings::default()
    };
    let scene = settings.build().expect("valid settings");
    let tree = scene.tree_as_text();
    Built {
        without_code: Some(tree),
        ..Built::new(name, about, scene.world, fields(scene.tree))
    }
}

/// The world of `examples/planet.rs`.
fn planet() -> Built {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::ball(5.0));
    let mut ball = |position, velocity| {
        let body = RigidBodyBuilder::dynamic()
            .translation(position)
            .linvel(velocity);
        world.insert(body, ColliderBuilder::ball(0.5).mass(1.0)).0
    };
    ball(Vector::X * 10.0, Vector::Y * 5.0);
    ball(Vector::Z * 15.0, Vector::ZERO);
    ball(Vector::new(-4.0, 50.0, 0.0), Vector::ZERO);
    let rocket = ball(Vector::Y * -50.0, Vector::ZERO);
    world.bodies[rocket].add_force(Vector::Z * 2.0, true);
    let pull = Field::point_gravity(250.0).within(Region::ball(30.0));
    let wind = Field::uniform(Vector::X * 3.0)
        .within(Region::cuboid(Vector::new(5.0, 2.0, 2.0)))
        .at(Vector::Y * 50.0);
    let tree = pull.named("planet").sum_union(wind.named("wind"));
    let about = "A planet that pulls, a corridor of wind, and a body that keeps the user's own \
                 force.";
    Built {
        names: vec![
            (0, "planet"),
            (1, "moon"),
            (2, "stone"),
            (3, "leaf"),
            (4, "rocket"),
        ],
        ..Built::new("planet", about, world, fields(tree))
    }
}

fn level() -> Built {
    let (world, tree) = level::build();
    let about = "A level of a game: crates and balls that fall, a wind over the left half, a pool on the right, \
                 crates that sleep, and a planet with its moon.";
    Built::new("level", about, world, fields(tree))
}

fn all() -> Vec<Built> {
    let pair = "Two bodies driven towards each other's places: a repulsion, and its cross product \
                with the vertical, by which each passes on its right. In code a \
                predicate asks who comes nearer; here the vertical is an expression.";
    let crossing = "Four bodies driven across a crossing, each kept from the others as in head_on.";
    vec![
        ammonia(),
        spheres(),
        figure_3(),
        figure_4(),
        flock(),
        head_on("head_on", pair, Meeting::Pair),
        head_on("crossing", crossing, Meeting::Crossing),
        planet(),
        level(),
    ]
}

#[test]
fn the_files_are_up_to_date() {
    if size_of::<Real>() != 4 {
        return;
    }
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scenes");
    let write = std::env::var_os("WRITE_SCENES").is_some();
    let mut names: Vec<String> = Vec::new();
    for built in all() {
        let path = folder.join(format!("{}.json", built.name));
        let text = built.file().to_json().expect("a scene without code");
        if write {
            std::fs::create_dir_all(&folder).expect("a folder for the scenes");
            std::fs::write(&path, &text).expect("a file that can be written");
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "{} is out of date: see above",
            path.display()
        );
        names.push(format!("{}.json", built.name));
    }
    for entry in std::fs::read_dir(&folder).expect("the folder of scenes") {
        let name = entry.expect("a file").file_name();
        let known = names.iter().any(|known| **known == *name);
        assert!(known, "{} is no scene of this test", name.display());
    }
}

#[test]
fn files_run_as_the_scenes_in_code_do_bit_for_bit() {
    for mut built in all() {
        let text = built.file().to_json().expect("a scene without code");
        let scene = SceneFile::from_json(&text).and_then(|file| file.build());
        let mut scene = scene.unwrap_or_else(|error| panic!("{}: {error}", built.name));
        for step in 1..=built.steps {
            built.fields.step(&mut built.world).expect("a step in code");
            scene
                .fields
                .step(&mut scene.world)
                .expect("a step of the file");
            let (code, file) = (bits(&built.world), bits(&scene.world));
            assert_eq!(code, file, "{} differs after step {step}", built.name);
        }
        let (code, file) = (built.fields.contacts(), scene.fields.contacts());
        assert_eq!(code.len(), file.len(), "contacts of {}", built.name);
    }
}

/// The example of the documentation is a scene, and its moon stays in orbit.
#[test]
fn the_example_of_the_documentation_runs() {
    let page = include_str!("../../../docs/scenes.md");
    let (_, rest) = page.split_once("```json\n").expect("an example");
    let (text, _) = rest.split_once("```").expect("its end");
    let scene = SceneFile::from_json(text).and_then(|file| file.build());
    let mut scene = scene.unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..600 {
        scene.fields.step(&mut scene.world).expect("a step");
    }
    let distance = scene.world.bodies[scene.bodies[1]].translation().length();
    assert!((distance - 10.0).abs() < 0.05, "{distance}");
}
