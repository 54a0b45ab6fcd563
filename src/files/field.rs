//! Fields, and what they are anchored to.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::error::{FileError, content};
use super::formula::FormulaDoc;
use super::number::{Num, Quad, Triple, pose, quad, unless, unless_zero};
use super::region::RegionDoc;
use super::scalar::{self, ScalarDoc};
use crate::field::{Anchor, Coupling, Field, ForceMode, Sampling};
use crate::math::{ColliderHandle, InteractionGroups, RigidBodyHandle};
use crate::rapier::geometry::{Group, InteractionTestMode};

/// A field: a formula, and what was set on it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct FieldDoc {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    formula: FormulaDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    within: Option<RegionDoc>,
    #[serde(default, skip_serializing_if = "AnchorDoc::is_world")]
    at: AnchorDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    read_as: Option<ForceMode>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    coupled_to: Option<Coupling>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scaled_by: Option<ScalarDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limited_to: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    groups: Option<GroupsDoc>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    reacting: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sampled: Option<Sampling>,
}

/// What a field moves with. In a scene bodies and parts have numbers; a tree alone holds Rapier's
/// handles, as index and generation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct AnchorDoc {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    body: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    body_handle: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    collider_handle: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rotation: Option<Quad>,
}

/// Collision groups, as bits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct GroupsDoc {
    memberships: u32,
    filter: u32,
    /// Whether it is enough that one of the two sides allows the other.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    either: bool,
}

impl GroupsDoc {
    pub(super) fn read(self) -> InteractionGroups {
        InteractionGroups {
            memberships: Group::from_bits_truncate(self.memberships),
            filter: Group::from_bits_truncate(self.filter),
            test_mode: match self.either {
                true => InteractionTestMode::Or,
                false => InteractionTestMode::And,
            },
        }
    }

    pub(super) fn write(groups: InteractionGroups) -> Self {
        GroupsDoc {
            memberships: groups.memberships.bits(),
            filter: groups.filter.bits(),
            either: groups.test_mode == InteractionTestMode::Or,
        }
    }
}

/// The bodies and parts of a scene, by number and by handle.
#[derive(Clone, Debug, Default)]
pub(super) struct Directory {
    pub bodies: Vec<RigidBodyHandle>,
    pub parts: Vec<Vec<ColliderHandle>>,
    body_numbers: HashMap<RigidBodyHandle, usize>,
    pub part_numbers: HashMap<ColliderHandle, (usize, usize)>,
}

impl Directory {
    pub(super) fn push(&mut self, body: RigidBodyHandle, parts: Vec<ColliderHandle>) {
        let number = self.bodies.len();
        self.body_numbers.insert(body, number);
        for (place, part) in parts.iter().enumerate() {
            self.part_numbers.insert(*part, (number, place));
        }
        self.bodies.push(body);
        self.parts.push(parts);
    }

    pub(super) fn number_of_body(&self, body: RigidBodyHandle) -> Option<usize> {
        self.body_numbers.get(&body).copied()
    }

    /// The number of its body, and its own among the parts of that body.
    pub(super) fn number_of_part(&self, part: ColliderHandle) -> Option<(usize, usize)> {
        self.part_numbers.get(&part).copied()
    }

    /// The bodies with their parts.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&RigidBodyHandle, &Vec<ColliderHandle>)> {
        self.bodies.iter().zip(&self.parts)
    }

    fn body(&self, number: usize) -> Result<RigidBodyHandle, FileError> {
        let count = self.bodies.len();
        let missing = || {
            content(format!(
                "there is no body {number}; the scene has {count}, from 0"
            ))
        };
        let body = self.bodies.get(number).copied();
        body.ok_or_else(|| missing().within("body"))
    }

    fn part(&self, body: usize, part: usize) -> Result<ColliderHandle, FileError> {
        self.body(body)?;
        let parts = &self.parts[body];
        let count = parts.len();
        let missing = || {
            content(format!(
                "body {body} has no part {part}; it has {count}, from 0"
            ))
        };
        let part = parts.get(part).copied();
        part.ok_or_else(|| missing().within("part"))
    }
}

/// A collider, as an anchor names it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct PartDoc(AnchorDoc);

impl PartDoc {
    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<ColliderHandle, FileError> {
        match self.0.read(scene)? {
            Anchor::Collider { handle, .. } => Ok(handle),
            _ => Err(content("expected a collider: `body` and `part`")),
        }
    }

    pub(super) fn write(
        handle: ColliderHandle,
        scene: Option<&Directory>,
    ) -> Result<Self, FileError> {
        AnchorDoc::write(&Anchor::from(handle), scene).map(PartDoc)
    }
}

impl AnchorDoc {
    pub(super) fn is_world(&self) -> bool {
        *self == AnchorDoc::default()
    }

    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<Anchor, FileError> {
        let local_pose = pose(self.at, self.rotation)?;
        let anchor = match (
            self.body,
            self.part,
            self.body_handle,
            self.collider_handle,
            scene,
        ) {
            (None, None, None, None, _) => Anchor::World { local_pose },
            (Some(body), None, None, None, Some(scene)) => Anchor::from(scene.body(body)?),
            (Some(body), Some(part), None, None, Some(scene)) => {
                Anchor::from(scene.part(body, part)?)
            }
            (None, None, Some([index, generation]), None, None) => {
                Anchor::from(RigidBodyHandle::from_raw_parts(index, generation))
            }
            (None, None, None, Some([index, generation]), None) => {
                Anchor::from(ColliderHandle::from_raw_parts(index, generation))
            }
            (.., Some(_)) => {
                return Err(content(
                    "expected `body`, or `body` and `part`, by their numbers in the scene",
                ));
            }
            (.., None) => {
                return Err(content(
                    "expected `body-handle` or `collider-handle`: outside of scenes there are no numbers",
                ));
            }
        };
        Ok(anchor.with_local_pose(local_pose))
    }

    pub(super) fn write(anchor: &Anchor, scene: Option<&Directory>) -> Result<Self, FileError> {
        let pose = anchor.local_pose();
        let placed = AnchorDoc {
            at: unless_zero(pose.translation),
            rotation: quad(pose.rotation),
            ..AnchorDoc::default()
        };
        let gone = || content("what it is anchored to is not in the world");
        Ok(match (anchor, scene) {
            (Anchor::World { .. }, _) => placed,
            (Anchor::Body { handle, .. }, Some(scene)) => AnchorDoc {
                body: Some(*scene.body_numbers.get(handle).ok_or_else(gone)?),
                ..placed
            },
            (Anchor::Collider { handle, .. }, Some(scene)) => {
                let (body, part) = *scene.part_numbers.get(handle).ok_or_else(gone)?;
                AnchorDoc {
                    body: Some(body),
                    part: Some(part),
                    ..placed
                }
            }
            (Anchor::Body { handle, .. }, None) => AnchorDoc {
                body_handle: Some(handle.into_raw_parts().into()),
                ..placed
            },
            (Anchor::Collider { handle, .. }, None) => AnchorDoc {
                collider_handle: Some(handle.into_raw_parts().into()),
                ..placed
            },
        })
    }
}

impl FieldDoc {
    fn label(&self) -> String {
        let name = self.name.as_deref();
        name.map_or("field".to_owned(), |name| format!("field `{name}`"))
    }

    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<Field, FileError> {
        let inner = |name: &'static str| {
            let label = self.label();
            move |error: FileError| error.of_field(&label).within(name)
        };
        let mut field = self.formula.read().map_err(inner("formula"))?;
        if let Some(region) = &self.within {
            field = field.within(region.read().map_err(inner("within"))?);
        }
        field = field.at(self.at.read(scene).map_err(inner("at"))?);
        if let Some(reading) = self.read_as {
            field = field.force_mode(reading);
        }
        if let Some(coupling) = &self.coupled_to {
            field = field.coupled_to(coupling.clone());
        }
        if let Some(steps) = &self.scaled_by {
            field = field.scaled_by(scalar::read(steps).map_err(inner("scaled-by"))?);
        }
        if let Some(length) = self.limited_to {
            field = field.limited_to(length.0);
        }
        if let Some(groups) = self.groups {
            field = field.groups(groups.read());
        }
        if self.reacting {
            field = field.reacting();
        }
        if let Some(sampling) = self.sampled {
            field = field.sampled(sampling);
        }
        if let Some(name) = &self.name {
            field = field.named(name);
        }
        Ok(field)
    }

    pub(super) fn write(
        field: &Field,
        label: &str,
        scene: Option<&Directory>,
    ) -> Result<Self, FileError> {
        let named = |error: FileError| error.of_field(label).within(label);
        if let Some(setter) = field.misfit {
            let message = format!("`{setter}` does not apply to its formula");
            return Err(named(content(message)));
        }
        let formula = FormulaDoc::of(field).map_err(named)?;
        // What the constructor sets anyway is left out.
        let usual = formula.read().map_err(named)?;
        let region = (field.region != usual.region).then(|| RegionDoc::write(&field.region));
        let scale = field.scale.as_ref().map(scalar::write);
        Ok(FieldDoc {
            name: field.name.as_deref().map(str::to_owned),
            within: region.transpose().map_err(named)?,
            at: AnchorDoc::write(&field.anchor, scene).map_err(named)?,
            read_as: unless(field.mode, usual.mode),
            coupled_to: unless(field.coupling.clone(), usual.coupling),
            scaled_by: scale.transpose().map_err(named)?,
            limited_to: field.limit.map(Num),
            groups: field.groups.map(GroupsDoc::write),
            reacting: field.reacts,
            sampled: unless(field.sampling, usual.sampling),
            formula,
        })
    }
}
