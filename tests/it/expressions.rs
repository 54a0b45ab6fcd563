//! Expressions as fields: their exact derivatives, and the errors of invalid texts.

use rapier3d_fields::field::{ExpressionErrorKind, Linearised, Query};
use rapier3d_fields::math::{DMat3, DVec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

fn linearised(field: Field, point: DVec3, velocity: DVec3) -> Linearised {
    let world = PhysicsWorld::new();
    let query = Query {
        world_point: point,
        world_velocity: velocity,
        ..Query::default()
    };
    let tree = Tree::from(field);
    let walk = Reference::new(&tree).expect("a valid tree");
    let found = walk.linearised(&WorldRef::from(&world), &query);
    found.expect("defined everywhere")
}

fn error(texts: [&str; 3]) -> BuildError {
    let built = Fields::new(Field::expression(texts));
    built.map(drop).expect_err("a bad text")
}

/// Through conditions, angles and corners; the branches that are not taken are not numbers.
#[test]
fn the_jacobian_is_exact() {
    let field = Field::expression([
        "if(x > 1, atan2(y, x), ln(-1)) - 2*vx",
        "abs(y)*z + if(vy < 0, abs(vy)*vy, 1/0)",
        "min(x^2, z^3, 100) - max(-x^2, sqrt(-1))",
    ]);
    let found = linearised(
        field,
        DVec3::new(3.0, -4.0, 2.0),
        DVec3::new(0.5, -0.25, 9.0),
    );
    let angle = (-4.0_f64).atan2(3.0) - 1.0;
    let force = DVec3::new(angle, 8.0 - 0.0625, 8.0 + 9.0);
    assert!((found.force - force).length() < 1e-15, "{}", found.force);
    let by_position = DMat3::from_cols(
        DVec3::new(4.0 / 25.0, 0.0, 6.0),
        DVec3::new(3.0 / 25.0, -2.0, 0.0),
        DVec3::new(0.0, 4.0, 12.0),
    );
    let by_velocity = DMat3::from_diagonal(DVec3::new(-2.0, 0.5, 0.0));
    for (found, expected) in [
        (found.by_position, by_position),
        (found.by_velocity, by_velocity),
    ] {
        let error = (found - expected).to_cols_array();
        let largest = error.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(largest < 1e-15, "{found}\nis not\n{expected}");
    }
}

/// At rest at the origin, where quotients and roots of dual numbers are not finite.
#[test]
fn derivatives_at_the_origin_are_finite() {
    let field = Field::expression(["-x^2 - x", "-y*hypot(x, y, z)", "-z^1.5*speed"]);
    let found = linearised(field, DVec3::ZERO, DVec3::ZERO);
    assert_eq!(found.force, DVec3::ZERO);
    let slopes = DMat3::from_diagonal(DVec3::new(-1.0, 0.0, 0.0));
    assert_eq!(found.by_position, slopes);
    assert_eq!(found.by_velocity, DMat3::ZERO);
}

#[test]
fn errors_point_at_the_character() {
    let told = error(["x", "1 + (2*x", "0"]);
    let place = "field #0 (expression): `1 + (2*x`, character 5: this bracket is not closed";
    assert_eq!(told.to_string(), place);
    let BuildError::Expression { error: told, .. } = told else {
        panic!("{told}");
    };
    assert_eq!((told.component, told.position), (1, 5));
    assert_eq!(told.kind, ExpressionErrorKind::Unclosed);
    assert_eq!(told.text, "1 + (2*x");
    // Unknown names are taken for axes, which the build looks up.
    let told = error(["heat", "0", "0"]).to_string();
    assert!(told.contains("there is no axis `heat`"), "{told}");
    let built = Fields::builder(Field::expression(["{heat flux} + 1", "0", "0"]));
    assert!(built.axis("heat flux", 2.0).build().is_ok());
}

/// From the text to the derivatives, on a small stack.
#[test]
fn long_expressions_need_no_stack() {
    let work = || {
        let sum = vec!["x"; 1000].join("+");
        let deep = "(".repeat(30_000) + "y" + &")".repeat(30_000);
        let sines = "sin(".repeat(10_000) + "z" + &")".repeat(10_000);
        let field = Field::expression([&sum, &deep, &sines]);
        let point = DVec3::new(1.0, 2.0, 0.0);
        let found = linearised(field, point, DVec3::ZERO);
        assert_eq!(found.force, DVec3::new(1000.0, 2.0, 0.0));
        assert_eq!(
            found.by_position,
            DMat3::from_diagonal(DVec3::new(1000.0, 1.0, 1.0))
        );
    };
    let thread = std::thread::Builder::new().stack_size(1024 * 1024);
    let thread = thread.spawn(work).expect("a thread");
    thread.join().expect("enough stack");
}
