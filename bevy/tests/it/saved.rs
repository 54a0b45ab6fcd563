//! Components are reflected and saved.

use bevy::reflect::TypeRegistry;
use bevy::reflect::serde::{TypedReflectDeserializer, TypedReflectSerializer};
use serde_json::Deserializer;

use crate::support::*;

fn again<T: Reflect + FromReflect>(value: &T, registry: &TypeRegistry) -> T {
    let text = serde_json::to_string(&TypedReflectSerializer::new(value, registry));
    let text = text.expect("it can be saved");
    let registration = registry
        .get(std::any::TypeId::of::<T>())
        .expect("the plugin registers it");
    use serde::de::DeserializeSeed;
    let reader = TypedReflectDeserializer::new(registration, registry);
    let read = reader
        .deserialize(&mut Deserializer::from_str(&text))
        .expect("it can be read");
    T::from_reflect(&*read).expect("of the same type")
}

#[test]
fn components_are_saved_and_read_by_reflection() {
    let mut app = app(fixed());
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let wind = Field::uniform(Vec3::X * 2.0).named("wind");
    let lee = Field::uniform(Vec3::ZERO)
        .within(Region::ball(1.0))
        .at(Vec3::Y * 3.0);
    let field = ForceField::new(wind.replace_union(lee));
    let charge = FieldProperties(ColliderProperties::new().charge(-2.0).axis("heat", 3.0));
    assert_eq!(again(&charge, &registry), charge);
    assert_eq!(again(&WithinCollider, &registry), WithinCollider);
    let sampling = FieldSampling(Sampling::Centre);
    assert_eq!(again(&sampling, &registry), sampling);
    let field = again(&field, &registry);
    drop(registry);

    app.world_mut().spawn(field);
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    let sheltered = app.world_mut().spawn(ball(Vec3::Y * 3.0)).id();
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * 2.0 * DT, 1e-6);
    assert_eq!(velocity(&mut app, sheltered), Vec3::ZERO);
}
