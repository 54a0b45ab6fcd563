//! The loop of the window: the testbed draws bodies, this program its fields and their panel.

use rapier_testbed3d::TestbedViewer;
use rapier3d_fields::debug_render::FieldDebugRenderMode;

use crate::catalogue::Catalogue;
use crate::drawing::Lines;
use crate::panel;
use crate::session::Session;
use crate::walls;

/// Frames between two looks at the file.
const LOOK_EVERY: usize = 20;

/// Shows the scenes of a catalogue until the window is closed.
///
/// # Errors
/// There is no screen, or a scene cannot be read when it is chosen.
pub async fn show(catalogue: &Catalogue, mode: FieldDebugRenderMode) -> Result<(), String> {
    // The window would end the program without these.
    let screens = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];
    if cfg!(target_os = "linux") && screens.iter().all(|name| std::env::var_os(name).is_none()) {
        return Err("there is no screen to open a window on; `--picture` needs none".to_owned());
    }
    let mut viewer = TestbedViewer::new(catalogue.examples()).await;
    let mut mode = mode;
    while !viewer.quitting() {
        let entry = catalogue.get(viewer.selected_name());
        let mut session = Session::open(&entry.path, mode)?;
        viewer.clear_scene();
        show_world(&mut viewer, &mut session);
        viewer.request_frame_all();
        run(&mut viewer, &mut session).await;
        // The next scene is drawn with the parts chosen in this one.
        mode = session.drawing.mode;
    }
    Ok(())
}

/// Gives the world to the testbed, which makes its pictures of the bodies in the next frame.
fn show_world(viewer: &mut TestbedViewer, session: &mut Session) {
    viewer.set_world(&mut session.scene.world);
    for wall in walls::hiding(&session.scene.world) {
        viewer.set_initial_body_color(wall, walls::GLASS);
    }
}

/// Runs a scene until another one is chosen, it is begun anew, or the window is closed.
async fn run(viewer: &mut TestbedViewer, session: &mut Session) {
    let mut frame = 0;
    while viewer.render_frame(&mut session.scene.world).await {
        frame += 1;
        if frame % LOOK_EVERY == 0 && session.reload_if_changed() {
            viewer.graphics_mut().clear();
            show_world(viewer, session);
        }
        if viewer.simulating() {
            session.step();
        }
        let window = viewer.window_mut();
        session.draw(&mut Lines { window, width: 2.0 });
        viewer
            .window_mut()
            .draw_ui(|context| panel::show(context, session));
    }
}
