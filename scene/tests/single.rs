//! Tests of scene files in 32 bits.

use rapier3d_fields_lab::single as lab;
use rapier3d_fields_scene::single as files;

#[path = "../../tests/it/support/bits.rs"]
mod bits;
#[path = "it/hostile_files.rs"]
mod hostile_files;
#[path = "it/messages.rs"]
mod messages;
#[path = "it/replays.rs"]
mod replays;
#[path = "it/round_trips.rs"]
mod round_trips;
#[path = "it/scene_files.rs"]
mod scene_files;
#[path = "../../tests/it/support/trees/mod.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod trees;
#[path = "it/uneven_mesh.rs"]
mod uneven_mesh;
#[path = "../../tests/it/support/worlds.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod worlds;
