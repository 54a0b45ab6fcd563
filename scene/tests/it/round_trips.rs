//! Scenes that are written and read again give the same forces, to the last bit, for every formula, region,
//! scalar and operator; content that cannot be read or written is refused by name and place.

use crate::files::{Document, FileError, SceneFile};
use crate::trees::{FormulaPlan, Numbers, RegionPlan, ScalarPlan, TermPlan};
use crate::worlds::{World, bodies};
use proptest::prelude::*;
use rapier3d_fields::prelude::*;

/// Whether a term holds closures or predicates, which files cannot hold.
fn is_code(term: &TermPlan) -> bool {
    fn predicate(region: &RegionPlan) -> bool {
        match region {
            RegionPlan::Predicate(_) => true,
            RegionPlan::Moved(of, _) | RegionPlan::Complement(of) => predicate(of),
            RegionPlan::Combined(_, a, b) => predicate(a) || predicate(b),
            _ => false,
        }
    }
    let scale = |scale: &ScalarPlan| match scale {
        ScalarPlan::Closure => true,
        ScalarPlan::Depth(region, ..) => predicate(region),
        _ => false,
    };
    let leaf = |leaf: &crate::trees::LeafPlan| {
        matches!(leaf.formula, FormulaPlan::Closure(_))
            || (!leaf.formula.brings_region() && predicate(&leaf.region))
    };
    term.any_leaf(&leaf) || term.any_scale(&scale)
}

/// The bits of the wrenches on all bodies.
fn wrenches(fields: &mut Fields, world: &PhysicsWorld) -> Vec<Option<[u64; 6]>> {
    let handles: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let wrench = |body| {
        let wrench = fields.sample(body, world);
        let wrench = wrench.ok()??;
        let [fx, fy, fz] = wrench.force.to_array();
        let [tx, ty, tz] = wrench.torque.to_array();
        Some([fx, fy, fz, tx, ty, tz].map(|x| rapier3d_fields::math::to_f64(x).to_bits()))
    };
    handles.into_iter().map(wrench).collect()
}

fn comes_back(plans: &[crate::worlds::BodyPlan], terms: &[TermPlan]) -> Result<(), TestCaseError> {
    let world = World::new(plans);
    let terms_of = terms.iter().map(|term| term.term(&world));
    let mut fields = world.fields(&Tree::fold(Operator::SumUnion, terms_of));
    let file = SceneFile::new(&world.physics, &fields);
    if terms.iter().any(is_code) {
        let refused = matches!(file, Err(FileError::Code { .. }));
        prop_assert!(refused, "code was written: {:?}", file.err());
        return Ok(());
    }
    let text = file.and_then(|file| file.to_json());
    let text = text.map_err(|error| TestCaseError::fail(error.to_string()))?;
    let failed = |error: FileError| TestCaseError::fail(format!("{error}\n{text}"));
    let read = SceneFile::from_json(&text).map_err(failed)?;
    prop_assert_eq!(&read.to_json().map_err(failed)?, &text);
    let mut scene = read.build().map_err(failed)?;
    let again = SceneFile::new(&scene.world, &scene.fields);
    prop_assert_eq!(again.and_then(|file| file.to_json()).map_err(failed)?, text);
    let found = wrenches(&mut scene.fields, &scene.world);
    prop_assert_eq!(found, wrenches(&mut fields, &world.physics));
    Ok(())
}

fn terms(numbers: Numbers) -> impl Strategy<Value = Vec<TermPlan>> {
    proptest::collection::vec(crate::trees::term(numbers), 1..=3)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1500,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn trees_of_integers_come_back(
        plans in bodies(3, 1..=3), terms in terms(Numbers::Integer),
    ) {
        comes_back(&plans, &terms)?;
    }

    #[test]
    fn trees_of_fractions_come_back(
        plans in bodies(3, 1..=3), terms in terms(Numbers::Fractional),
    ) {
        comes_back(&plans, &terms)?;
    }
}

/// A hand-written file with one of every formula, region, scalar, operator, law and setting. Read and written
/// again, it is the same to the letter, so no setting is lost or added.
const EVERYTHING: &str = include_str!("../data/everything.json");

/// The content of [`EVERYTHING`] as the first version of the program wrote it.
#[test]
fn a_file_of_an_earlier_version_is_read() {
    let file = SceneFile::from_json(include_str!("../data/version_1.json"));
    let scene = file.expect("a file of version 1").build();
    let scene = scene.expect("a possible scene");
    let again = SceneFile::new(&scene.world, &scene.fields).expect("a scene without code");
    let again = again.about("One of everything.").name_body(0, "floor");
    assert_eq!(again.to_json().expect("a scene without code"), EVERYTHING);
}

/// A setting that the first version did not have; its default is not written.
#[test]
fn the_policy_for_faults_comes_back() {
    let policies = [
        (FaultPolicy::LeaveOut, Some("\"on-fault\": \"leave-out\"")),
        (FaultPolicy::Quarantine, None),
        (FaultPolicy::Refuse, Some("\"on-fault\": \"refuse\"")),
    ];
    for (policy, line) in policies {
        let fields = Fields::builder(Field::uniform(Vector::X)).on_fault(policy);
        let fields = fields.build().expect("a valid tree");
        let file = SceneFile::new(&PhysicsWorld::new(), &fields).expect("a scene without code");
        let text = file.to_json().expect("a scene without code");
        assert_eq!(text.contains("on-fault"), line.is_some(), "{text}");
        assert!(line.is_none_or(|line| text.contains(line)), "{text}");
        let read = SceneFile::from_json(&text)
            .expect("what was written")
            .build();
        let read = read.expect("a possible scene");
        assert_eq!(read.fields.settings.on_fault, policy);
    }
    let bad = r#"{"version": 1, "fields": {"on-fault": "explode", "tree": "empty"}}"#;
    let error = SceneFile::from_json(bad)
        .expect_err("no such policy")
        .to_string();
    assert!(
        error.contains("on-fault") && error.contains("leave-out"),
        "{error}"
    );
}

#[test]
fn one_of_everything_comes_back_to_the_letter() {
    let file = SceneFile::from_json(EVERYTHING).expect("a file as documented");
    let scene = file.build().expect("a possible scene");
    let again = SceneFile::new(&scene.world, &scene.fields).expect("a scene without code");
    let again = again.about("One of everything.").name_body(0, "floor");
    let again = again.to_json().expect("a scene without code");
    if std::env::var_os("WRITE_SCENES").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/everything.json");
        std::fs::write(path, &again).expect("a file that can be written");
    }
    for (number, (found, expected)) in again.lines().zip(EVERYTHING.lines()).enumerate() {
        assert_eq!(found, expected, "line {}", number + 1);
    }
    assert_eq!(again.len(), EVERYTHING.len());
}
