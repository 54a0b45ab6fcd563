//! Fields and their anchors.

use serde::{Deserialize, Deserializer, Serialize};

use super::error::{FileError, content};
use super::fields::math::{ColliderHandle, InteractionGroups, RigidBodyHandle};
use super::fields::rapier::geometry::{Group, InteractionTestMode};
use super::fields::{Anchor, Coupling, Field, ForceMode, Sampling};
use super::formula::FormulaDoc;
use super::names::{Directory, Names, Reference};
use super::number::{Num, Quad, Triple, pose, quad, unless, unless_zero};
use super::region::RegionDoc;
use super::scalar::{self, ScalarDoc};
use crate::choice::{self, Choice};

/// A field: a formula and its settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct FieldDoc {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    formula: FormulaDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    within: Option<RegionDoc>,
    #[serde(default, skip_serializing_if = "AnchorDoc::is_world")]
    at: AnchorDoc,
    #[serde(
        alias = "read-as",
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    force_mode: Option<ForceMode>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    coupled_to: Option<Coupling>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scaled_by: Option<ScalarDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limited_to: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    groups: Option<GroupsDoc>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    reacting: bool,
    #[serde(
        default,
        deserialize_with = "sampling",
        skip_serializing_if = "Option::is_none"
    )]
    sampled: Option<Sampling>,
}

/// The frame with which a field moves. In a scene, bodies and parts have numbers; a tree by itself holds
/// Rapier's handles, as index and generation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct AnchorDoc {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    body: Option<Reference>,
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
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct GroupsDoc {
    memberships: u32,
    filter: u32,
    /// Whether it is enough that the filter of one side accepts the other.
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

/// A collider, given as in an anchor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub(super) struct PartDoc(AnchorDoc);

impl PartDoc {
    pub(super) fn read(&self, scene: &Names<'_>) -> Result<ColliderHandle, FileError> {
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

    pub(super) fn read(&self, scene: &Names<'_>) -> Result<Anchor, FileError> {
        let local_pose = pose(self.at, self.rotation)?;
        let anchor = match (
            &self.body,
            self.part,
            self.body_handle,
            self.collider_handle,
            scene.directory,
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
                    "expected `body`, or `body` and `part`, by their numbers in the scene, or the body by its name",
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
                body: Some(scene.number_of_body(*handle).ok_or_else(gone)?.into()),
                ..placed
            },
            (Anchor::Collider { handle, .. }, Some(scene)) => {
                let (body, part) = scene.number_of_part(*handle).ok_or_else(gone)?;
                AnchorDoc {
                    body: Some(body.into()),
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

struct SamplingChoice;

impl<'de> Choice<'de> for SamplingChoice {
    type Value = Option<Sampling>;
    const WHAT: &'static str = "sampling";
    const GONE: &'static [(&'static str, &'static str)] = &[("adaptive", "volume")];
    fn read<D: Deserializer<'de>>(reader: D) -> Result<Option<Sampling>, D::Error> {
        Sampling::deserialize(reader).map(Some)
    }
}

/// Reads a sampling.
pub(super) fn sampling<'de, D: Deserializer<'de>>(reader: D) -> Result<Option<Sampling>, D::Error> {
    choice::read::<SamplingChoice, D>(reader)
}

impl FieldDoc {
    fn label(&self) -> String {
        let name = self.name.as_deref();
        name.map_or("field".to_owned(), |name| format!("field `{name}`"))
    }

    pub(super) fn read(&self, scene: &Names<'_>) -> Result<Field, FileError> {
        let inner = |name: &'static str| {
            let label = self.label();
            move |error: FileError| error.of_field(&label).within(name)
        };
        let mut field = self.formula.read().map_err(inner("formula"))?;
        if let Some(region) = &self.within {
            field = field.within(region.read().map_err(inner("within"))?);
        }
        field = field.at(self.at.read(scene).map_err(inner("at"))?);
        if let Some(reading) = self.force_mode {
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
        let view = field.view();
        if let Some(setter) = view.misfit {
            let message = format!("`{setter}` does not apply to its formula");
            return Err(named(content(message)));
        }
        let formula = FormulaDoc::of(field).map_err(named)?;
        // Settings that the constructor makes are left out.
        let usual = formula.read().map_err(named)?;
        let usual = usual.view();
        let region = (view.region != usual.region).then(|| RegionDoc::write(view.region));
        let scale = view.scale.map(scalar::write);
        Ok(FieldDoc {
            name: view.name.map(str::to_owned),
            within: region.transpose().map_err(named)?,
            at: AnchorDoc::write(view.anchor, scene).map_err(named)?,
            force_mode: unless(view.force_mode, usual.force_mode),
            coupled_to: unless(view.coupling.clone(), usual.coupling.clone()),
            scaled_by: scale.transpose().map_err(named)?,
            limited_to: view.limit.map(Num),
            groups: view.groups.map(GroupsDoc::write),
            reacting: view.reacts,
            sampled: unless(view.sampling, usual.sampling),
            formula,
        })
    }
}
