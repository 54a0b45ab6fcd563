//! A planet, wind, a pool and a magnet, each a field on an entity; the space bar sets off an explosion.
//!
//! `cargo run` opens a window. `cargo run -- --picture out.png` draws the scene after ten seconds without a window, by
//! any Vulkan driver, such as Mesa's in software.

mod picture;
mod scene;

use bevy::prelude::*;
use bevy::window::ExitCondition;
use bevy_rapier3d::prelude::*;
use bevy_rapier3d_fields::prelude::*;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let picture = match &arguments[..] {
        [] => None,
        [flag, file] if flag == "--picture" => Some(file.clone()),
        _ => {
            eprintln!("usage: playground [--picture FILE.png]");
            std::process::exit(2);
        }
    };
    let mut app = App::new();
    match picture {
        Some(file) => picture::draw_into(&mut app, file),
        None => {
            let window = Window {
                title: "Fields: the space bar sets off an explosion".into(),
                ..default()
            };
            let plugin = WindowPlugin {
                primary_window: Some(window),
                exit_condition: ExitCondition::OnPrimaryClosed,
                ..default()
            };
            app.add_plugins(DefaultPlugins.set(plugin));
            app.add_systems(Startup, |mut commands: Commands| {
                commands.spawn(scene::camera());
            });
            app.add_systems(Update, explode_on_key);
        }
    }
    app.add_plugins(RapierFieldsPlugin::<NoUserData>::default());
    app.add_plugins(RapierFieldsDebugRenderPlugin);
    app.insert_resource(TimestepMode::Interpolated {
        dt: 1.0 / 60.0,
        time_scale: 1.0,
        substeps: 1,
    });
    app.add_systems(Startup, scene::build);
    app.add_systems(Update, scene::fade);
    app.run();
}

fn explode_on_key(keys: Res<ButtonInput<KeyCode>>, mut commands: Commands) {
    if keys.just_pressed(KeyCode::Space) {
        scene::explode(&mut commands);
    }
}
