//! Zones: which bodies enter and leave the regions of fields, and when within a step.

use std::sync::mpsc::Sender;

use crate::bridge::WorldRef;
use crate::field::{Field, FieldHandle, FieldSet, Frame, Frames, LocalQuery, Query};
use crate::math::{DVec3, RigidBodyHandle, bisect, to_dpose3, to_dvec3, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::{Lookup, find_by, world_com};

/// The share of a step between two tests of a body, where depths in a region are not distances.
const COARSE: f64 = 1.0 / 16.0;
/// The smallest share of a step between two tests, where depths are distances.
const FINE: f64 = 1.0 / 256.0;

/// The centre of mass of a body entered or left the region of a field. Sent to the channel of
/// [`set_zone_events`](crate::Fields::set_zone_events).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ZoneEvent {
    /// A body entered the region, or the field began around it.
    Entered {
        /// The field.
        field: FieldHandle,
        /// The body.
        body: RigidBodyHandle,
        /// Simulated time, within the step.
        time: f64,
    },
    /// A body left the region, or the field ended; or one of the two was disabled or removed.
    Left {
        /// The field.
        field: FieldHandle,
        /// The body.
        body: RigidBodyHandle,
        /// Simulated time, within the step; after a removal, the start of the next step.
        time: f64,
    },
}

impl ZoneEvent {
    fn new(is_inside: bool, Occupant { field, body }: Occupant, time: f64) -> Self {
        if is_inside {
            ZoneEvent::Entered { field, body, time }
        } else {
            ZoneEvent::Left { field, body, time }
        }
    }

    /// True if the body entered, false if it left.
    #[must_use]
    pub fn has_entered(&self) -> bool {
        matches!(self, ZoneEvent::Entered { .. })
    }

    /// The field whose region it is. A field with a lifetime may have left its set when the event is read.
    #[must_use]
    pub fn field(&self) -> FieldHandle {
        match self {
            ZoneEvent::Entered { field, .. } | ZoneEvent::Left { field, .. } => *field,
        }
    }

    /// The body.
    #[must_use]
    pub fn body(&self) -> RigidBodyHandle {
        match self {
            ZoneEvent::Entered { body, .. } | ZoneEvent::Left { body, .. } => *body,
        }
    }

    /// Simulated time, within the step.
    #[must_use]
    pub fn time(&self) -> f64 {
        match self {
            ZoneEvent::Entered { time, .. } | ZoneEvent::Left { time, .. } => *time,
        }
    }
}

/// A body in a zone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Occupant {
    field: FieldHandle,
    body: RigidBodyHandle,
}

impl Occupant {
    pub(crate) fn key(&self) -> (FieldHandle, (u32, u32)) {
        (self.field, self.body.into_raw_parts())
    }
}

/// The zones and bodies of a step as it began.
#[derive(Debug, Default)]
pub(crate) struct ZoneWatch {
    zones: Vec<Zone>,
    /// In the order of their handles.
    bodies: Vec<BodyBefore>,
}

#[derive(Debug)]
struct Zone {
    field: FieldHandle,
    frame: Option<Frame>,
}

#[derive(Clone, Copy, Debug)]
struct BodyBefore {
    body: RigidBodyHandle,
    com: DVec3,
}

impl ZoneWatch {
    /// Records the start of a step.
    pub(crate) fn begin(&mut self, set: &FieldSet, world: &WorldRef<'_>) {
        self.zones.clear();
        let zones = set.fields_in_place();
        let zones = zones.filter(|(_, field)| is_zone(field));
        self.zones.extend(zones.map(|(handle, field)| Zone {
            field: handle,
            frame: world.frame(&field.anchor),
        }));
        self.bodies.clear();
        let movers = world.bodies.iter().filter(|it| may_enter(it.1));
        self.bodies.extend(movers.map(|(handle, body)| BodyBefore {
            body: handle,
            com: to_dvec3(world_com(body)),
        }));
        self.bodies
            .sort_unstable_by_key(|it| it.body.into_raw_parts());
    }

    /// Sends the events of a step, in the order of time, and updates the occupants of zones, `inside`. `times` are the
    /// start of the step and its length.
    pub(crate) fn end(
        &self,
        set: &FieldSet,
        world: &WorldRef<'_>,
        times: [f64; 2],
        inside: &mut Vec<Occupant>,
        channel: &Sender<ZoneEvent>,
    ) {
        let zones = self.zones.iter().filter_map(|zone| {
            let field = set.get(zone.field)?;
            let frame = world.frame(&field.anchor)?;
            let frames = [zone.frame.unwrap_or(frame), frame];
            Some(ZonePath::new(zone.field, field, frames, times))
        });
        let mut zones: Vec<ZonePath> = zones.collect();
        let was_inside = |occupant: &Occupant| {
            let found = inside.binary_search_by_key(&occupant.key(), Occupant::key);
            found.is_ok()
        };
        let (mut events, mut now) = (Vec::new(), Vec::new());
        for (handle, body) in world.bodies.iter().filter(|it| may_enter(it.1)) {
            let com = to_dvec3(world_com(body));
            let before = find_by(&self.bodies, handle, |it| it.body);
            let before = before.map_or(com, |place| self.bodies[place].com);
            for zone in &mut zones {
                let occupant = Occupant {
                    field: zone.handle,
                    body: handle,
                };
                let was = was_inside(&occupant);
                if !was && zone.is_far_from([before, com]) {
                    continue;
                }
                zone.take(world, handle, [before, com]);
                let is = zone.follow(was, |share, is| {
                    events.push(ZoneEvent::new(is, occupant, times[0] + share * times[1]));
                });
                if is {
                    now.push(occupant);
                }
            }
        }
        // Occupants whose field or body is gone have left.
        let stays = |it: &Occupant| {
            let is_zone = zones.iter().any(|zone| zone.handle == it.field);
            is_zone && world.body(it.body).is_some_and(may_enter)
        };
        let gone = inside.iter().filter(|it| !stays(it));
        events.extend(gone.map(|it| ZoneEvent::new(false, *it, times[0])));
        events.sort_by(|one: &ZoneEvent, other| one.time().total_cmp(&other.time()));
        for event in events {
            // A closed channel is no error: its receiver was dropped.
            let _ = channel.send(event);
        }
        now.sort_unstable_by_key(Occupant::key);
        *inside = now;
    }
}

/// Returns true if a field has a region of its own, the same for all parts of a body.
fn is_zone(field: &Field) -> bool {
    !field.region.is_everywhere() && !field.is_contact() && !field.region.reads_parts()
}

fn may_enter(body: &RigidBody) -> bool {
    body.is_enabled() && !body.is_fixed()
}

/// Returns true if the groups of a field allow any part of a body.
fn reaches(field: &Field, body: &RigidBody, world: &WorldRef<'_>) -> bool {
    let Some(groups) = field.groups else {
        return true;
    };
    let mut parts = body.colliders().iter();
    parts.any(|part| {
        let part = world.collider(*part);
        part.is_some_and(|part| part.collision_groups().test(groups))
    })
}

/// The path of a body over a step in the frame of a field, taken as straight.
struct ZonePath<'a> {
    handle: FieldHandle,
    field: &'a Field,
    /// At the start and at the end of the step.
    frames: [Frame; 2],
    times: [f64; 2],
    /// The radius of a ball around the origin of the frame that encloses the region.
    radius: f64,
    /// True if depths in the region are distances.
    is_solid: bool,
    /// The largest share of a step between two tests; less than one for a field that may begin or end within a step.
    longest: f64,
    /// True if the groups of the field allow any part of the body.
    is_reached: bool,
    query: Query,
    /// In the frame of the field.
    ends: [DVec3; 2],
}

impl<'a> ZonePath<'a> {
    fn new(handle: FieldHandle, field: &'a Field, frames: [Frame; 2], times: [f64; 2]) -> Self {
        let region = &field.region;
        ZonePath {
            handle,
            field,
            frames,
            times,
            radius: region.bounding_radius().map_or(f64::INFINITY, to_f64),
            is_solid: region.axes().next().is_none(),
            longest: if field.lifetime.is_timeless() {
                1.0
            } else {
                COARSE
            },
            is_reached: false,
            query: Query::default(),
            ends: [DVec3::ZERO; 2],
        }
    }

    /// Makes this the path of a body whose centre of mass goes from one point to another.
    fn take(&mut self, world: &WorldRef<'_>, handle: RigidBodyHandle, world_points: [DVec3; 2]) {
        let body = world.body(handle);
        self.is_reached = body.is_some_and(|body| reaches(self.field, body, world));
        self.query.body = Some(handle);
        self.query.world_velocity = body.map_or(DVec3::ZERO, |body| to_dvec3(body.linvel()));
        let local = |place: usize| {
            let pose = to_dpose3(&self.frames[place].pose);
            pose.inverse_transform_point(world_points[place])
        };
        self.ends = [local(0), local(1)];
    }

    /// Returns true if the path from one point to another does not come near the region; false if the frame turns, for
    /// which this test does not hold.
    fn is_far_from(&self, [from, to]: [DVec3; 2]) -> bool {
        let [first, last] = self.frames.map(|frame| frame.pose);
        let from = from - to_dvec3(first.translation);
        let to = to - to_dvec3(last.translation);
        let turns = first.rotation != last.rotation;
        !turns && from.length() > self.radius + from.distance(to)
    }

    /// The depth in the region after a share of the step; negative outside.
    fn depth(&self, share: f64) -> f64 {
        let [from, to] = self.ends;
        let frame = &self.frames[1];
        let query = Query {
            world_point: to_dpose3(&frame.pose).transform_point(from.lerp(to, share)),
            time: self.times[0] + share * self.times[1],
            ..self.query.clone()
        };
        if self.is_reached && self.field.acts_on(&query, frame) {
            self.field.region.depth(&LocalQuery::new(&query, frame))
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Calls `cross` at each crossing of the border, with the share of the step and whether the body is then inside.
    /// `was` is true if it was inside before the step. Returns whether it is inside at the end.
    fn follow(&self, was: bool, mut cross: impl FnMut(f64, bool)) -> bool {
        let length = self.ends[0].distance(self.ends[1]);
        let (mut share, mut depth) = (0.0, self.depth(0.0));
        let mut is = depth >= 0.0;
        if is != was {
            cross(0.0, is);
        }
        while share < 1.0 {
            // No border is nearer than the depth.
            let free = if !self.is_solid {
                COARSE
            } else if length == 0.0 {
                self.longest
            } else {
                (depth.abs() / length).clamp(FINE, self.longest)
            };
            let next = (share + free).min(1.0);
            depth = self.depth(next);
            if (depth >= 0.0) != is {
                let same = |share: f64| (self.depth(share) >= 0.0) == is;
                let at = bisect([share, next], f64::MANTISSA_DIGITS, same);
                is = !is;
                cross(at, is);
            }
            share = next;
        }
        is
    }
}
