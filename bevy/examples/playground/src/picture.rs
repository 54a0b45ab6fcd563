//! The scene as a picture, without a window.

use std::time::Duration;

use bevy::app::ScheduleRunnerPlugin;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;

use crate::scene;

const SIZE: [u32; 2] = [1280, 720];

/// The frame in which cubes explode, the first that is drawn, and the one that is kept.
const EXPLODES: u32 = 590;
const DRAWN: u32 = 616;
const KEPT: u32 = 620;

#[derive(Resource)]
struct Picture {
    file: String,
    image: Handle<Image>,
    frame: u32,
}

/// Sets up an app to draw one frame into a file, and to exit.
pub fn draw_into(app: &mut App, file: String) {
    let no_window = WindowPlugin {
        primary_window: None,
        exit_condition: ExitCondition::DontExit,
        ..default()
    };
    // Otherwise the first frame that is drawn would be incomplete.
    let renderer = RenderPlugin {
        synchronous_pipeline_compilation: true,
        ..default()
    };
    let plugins = DefaultPlugins.set(no_window).set(renderer);
    let plugins = plugins.disable::<WinitPlugin>();
    app.add_plugins(plugins);
    app.add_plugins(ScheduleRunnerPlugin::run_loop(Duration::ZERO));
    let frame = Duration::from_secs_f64(1.0 / 60.0);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    let start = move |mut commands: Commands, mut images: ResMut<Assets<Image>>| {
        let [width, height] = SIZE;
        let image = Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
        let image = images.add(image);
        let file = file.clone();
        commands.insert_resource(Picture {
            file,
            image,
            frame: 0,
        });
    };
    app.add_systems(Startup, start);
    app.add_systems(Update, direct);
}

fn direct(mut commands: Commands, mut picture: ResMut<Picture>) {
    picture.frame += 1;
    if picture.frame == EXPLODES {
        scene::explode(&mut commands);
    }
    if picture.frame == DRAWN {
        let target = RenderTarget::Image(picture.image.clone().into());
        commands.spawn((scene::camera(), target));
    }
    if picture.frame == KEPT {
        let screenshot = Screenshot::image(picture.image.clone());
        let mut screenshot = commands.spawn(screenshot);
        screenshot.observe(save_to_disk(picture.file.clone()));
        let end = |_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
            exit.write(AppExit::Success);
        };
        screenshot.observe(end);
    }
}
