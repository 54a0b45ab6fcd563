//! The stages of a step as spans of `tracing`.

use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

use rapier3d_fields::prelude::*;
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::{Interest, set_global_default};
use tracing::{Event, Metadata, Subscriber};

/// The names of all spans, and the spans that are open.
#[derive(Default)]
struct Seen {
    names: Vec<&'static str>,
    open: Vec<usize>,
    /// For each span that was entered, the names of the open spans down to it.
    paths: Vec<Vec<&'static str>>,
}

/// Listens to one thread, since other tests step at the same time.
#[derive(Clone)]
struct Listener(Arc<Mutex<Seen>>, ThreadId);

impl Subscriber for Listener {
    fn register_callsite(&self, _: &'static Metadata<'static>) -> Interest {
        Interest::sometimes()
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target() == "rapier3d_fields" && thread::current().id() == self.1
    }

    fn new_span(&self, span: &Attributes<'_>) -> Id {
        let mut seen = self.0.lock().expect("one thread");
        seen.names.push(span.metadata().name());
        Id::from_u64(seen.names.len() as u64)
    }

    fn enter(&self, span: &Id) {
        let mut seen = self.0.lock().expect("one thread");
        seen.open.push(span.into_u64() as usize - 1);
        let path = seen.open.iter().map(|number| seen.names[*number]);
        let path = path.collect();
        seen.paths.push(path);
    }

    fn exit(&self, span: &Id) {
        let mut seen = self.0.lock().expect("one thread");
        assert_eq!(seen.open.pop(), Some(span.into_u64() as usize - 1));
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn event(&self, _: &Event<'_>) {}
}

/// The first step of a world of one box.
fn step() {
    let mut world = PhysicsWorld::new();
    let shape = ColliderBuilder::cuboid(0.5, 0.4, 0.3);
    let (_, collider) = world.insert(RigidBodyBuilder::dynamic(), shape);
    let pull = Field::point_gravity(4.0).at(Vector::X * 9.0);
    let tree = pull + Field::contact(ContactLaw::elastic()).at(collider);
    let mut fields = Fields::new(tree).expect("a valid tree");
    fields.step(&mut world).expect("a step");
}

#[test]
fn a_step_has_spans_for_its_stages() {
    // Global, since a span that a thread without a listener meets first would be disabled for all threads.
    let listener = Listener(Arc::default(), thread::current().id());
    set_global_default(listener.clone()).expect("the only one");
    step();
    let seen = listener.0.lock().expect("one thread");
    assert_eq!(seen.open, [0; 0], "all ended");
    let paths: Vec<_> = seen.paths.iter().map(|path| path.join("/")).collect();
    let of_bodies = ["read", "samples", "place", "evaluation"];
    let of_halves =
        ["begin", "finish"].map(|half| of_bodies.map(|it| format!("{half}/bodies/{it}")));
    let others = ["begin/bodies/motion", "begin/listen", "finish/touch"].map(str::to_owned);
    for path in of_halves.iter().flatten().chain(&others) {
        assert!(paths.contains(path), "{path}: {paths:?}");
    }
}
