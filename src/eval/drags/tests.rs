//! Compares closed forms of drag with numbers that carry derivatives.

use proptest::prelude::*;

use super::*;
use crate::compile::Compiled;
use crate::eval::Interpreter;
use crate::eval::wide::tests::{Moving, regions, samples};
use crate::field::{Field, FieldSet, Frames, Motion, Span, Turbulence};
use crate::math::RigidBodyHandle;
use crate::sample::Moment;

/// Drags and winds of all kinds, in regions and with scales.
fn drags() -> impl Strategy<Value = (Field, [f64; 2])> {
    let push = Vector::new(0.5, -1.0, 0.25);
    let speed = || Scalar::axis(Axis::Speed).gaussian(0.5);
    let fields = vec![
        Field::drag(0.5, 0.25),
        Field::wind(push, 0.5, 0.25).speed_cap(0.75),
        Field::vortex(1.0, -1.0).as_wind(0.5, 0.25),
        Field::turbulence(Turbulence::new(4, 1.5, 2.0).turnover(0.3)).as_wind(0.25, 0.5),
        Field::turbulence(Turbulence::new(4, 1.5, 1e-7)).as_wind(0.25, 0.0),
        Field::drag(0.5, 0.25).scaled_by(Scalar::distance().smooth(3.0, 0.5)),
        Field::drag(0.5, 0.25).scaled_by(speed()),
        Field::drag(0.5, 0.25).limited_to(0.5),
        Field::magnetic(push),
    ];
    let velocity = prop::array::uniform2(-1.0..1.0_f64);
    let region = prop::sample::select(regions());
    let field = (prop::sample::select(fields), region);
    let field = field.prop_map(|(field, region)| field.within(region).strength(1.5));
    (field, velocity)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn drags_in_closed_form_are_as_numbers_that_carry_derivatives(
        case in drags(),
        numbers in prop::array::uniform8(-2.0..2.0_f64),
        all in any::<bool>(),
    ) {
        let (field, carried) = case;
        let mut set = FieldSet::new();
        let handle = RigidBodyHandle::from_raw_parts(7, 0);
        let by_body = carried[0] > 0.0;
        set.insert(if by_body { field.at(handle) } else { field });
        let compiled = Compiled::new(&set);
        let frames = [Moving.frame(&compiled.anchors[0])];
        let samples = samples(&[numbers, numbers]);
        let span = Span::at(0.5);
        let moment = Moment { time: 0.5, dt: 0.25, span };
        let query = samples.query(&samples.list[1], moment);
        let (_, program) = compiled.programs.iter().next().expect("one drag");
        let terms = if all { Terms::All } else { Terms::ThatReadVelocities };
        let Some(closed) = drag_on(program, 0, &frames, &query, terms) else {
            return Ok(());
        };
        let motion = Motion::seeded(&query);
        let want = Interpreter::default().run(program, 0, &frames, &query, &motion);
        let want = want.map_or(Linearised::default(), |found| Linearised::new(found.force));
        let size = 1.0 + want.force.length() + want.by_velocity.col(0).length();
        prop_assert!(closed.force.abs_diff_eq(want.force, 1e-12 * size));
        prop_assert!(closed.by_velocity.abs_diff_eq(want.by_velocity, 1e-12 * size));
        let place = want.by_position;
        prop_assert!(!all || closed.by_position.abs_diff_eq(place, 1e-12 * size));
    }
}
