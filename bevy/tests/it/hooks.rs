//! The hooks of the app act as they do without fields.

use bevy::ecs::system::SystemParam;
use bevy_rapier3d::rapier::geometry::SolverFlags;

use crate::support::*;

#[derive(Component)]
struct Ghost;

#[derive(SystemParam)]
struct Ghosts<'w, 's>(Query<'w, 's, &'static Ghost>);

impl BevyPhysicsHooks for Ghosts<'_, '_> {
    fn filter_contact_pair(&self, pair: PairFilterContextView) -> Option<SolverFlags> {
        let is_ghost = |entity| self.0.contains(entity);
        let passes = is_ghost(pair.collider1()) || is_ghost(pair.collider2());
        (!passes).then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }
}

#[test]
fn hooks_of_the_app_filter_contacts_of_fields_and_of_rapier() {
    for answered_by_fields in [false, true] {
        let mut app = app_with(fixed(), RapierFieldsPlugin::<Ghosts>::default());
        let floor = (
            Collider::cuboid(9.0, 0.5, 9.0),
            Transform::from_xyz(0.0, -0.5, 0.0),
        );
        app.world_mut().spawn(floor);
        app.world_mut()
            .spawn(ForceField::new(Field::uniform(Vec3::Y * -5.0)));
        let fall = |app: &mut App, x: f32| {
            let hooks = ActiveHooks::FILTER_CONTACT_PAIRS;
            let body = app
                .world_mut()
                .spawn((ball(Vec3::new(x, 0.5, 0.0)), hooks))
                .id();
            if answered_by_fields {
                let field = ForceField::new(Field::contact(ContactLaw::restitution(0.5)));
                app.world_mut().entity_mut(body).insert(field);
            }
            body
        };
        let ghost = fall(&mut app, 0.0);
        app.world_mut().entity_mut(ghost).insert(Ghost);
        let other = fall(&mut app, 2.0);
        frames(&mut app, 120);
        assert!(place(&app, ghost).y < -1.0, "{answered_by_fields}");
        assert!(
            (place(&app, other).y - 0.1).abs() < 0.02,
            "{answered_by_fields}"
        );
    }
}
