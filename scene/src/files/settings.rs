//! Settings of fields.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::{FileError, content};
use super::field::PartDoc;
use super::fields::BuildError;
use super::fields::Fields;
use super::fields::math::ColliderHandle;
use super::fields::{Detection, Responder};
use super::fields::{FaultPolicy, Scheme, WakePolicy};
use super::names::{Directory, Names};
use super::number::{Num, unless};
use super::tree::TreeDoc;

/// A tree of fields and its settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct FieldsDoc {
    /// Declared axes, and the world's values on them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    axes: BTreeMap<String, Num>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub scheme: Option<Scheme>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    wake: Option<WakePolicy>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    on_fault: Option<FaultPolicy>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    responder: Option<Responder>,
    /// The side that answers contacts between any two of some colliders; the last entry that fits counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    responder_among: Vec<AmongDoc>,
    #[serde(
        default,
        deserialize_with = "crate::choice::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub detection: Option<Detection>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    cross_check: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    audit: bool,
    /// The simulated time so far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    /// Trees that `tree` can use by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    definitions: BTreeMap<String, TreeDoc>,
    tree: TreeDoc,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct AmongDoc {
    parts: Vec<PartDoc>,
    responder: Responder,
}

impl FieldsDoc {
    /// Makes the fields. Without a scene, bodies and colliders are Rapier's handles.
    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<Fields, FileError> {
        let mut names = Names::of(scene);
        let mut definitions = BTreeMap::new();
        for (name, tree) in &self.definitions {
            let here = |error: FileError| error.within(&format!("definitions.{name}"));
            definitions.insert(name.clone(), tree.read(&names).map_err(here)?);
        }
        names.definitions = definitions;
        let tree = self.tree.read(&names);
        let tree = tree.map_err(|error| error.within("tree"))?;
        let axes: Vec<&str> = self.axes.keys().map(String::as_str).collect();
        if let Err(error) = tree.check(&axes) {
            return Err(self.tree.blame(&names, &axes, error).within("tree"));
        }
        let mut builder = Fields::builder(tree)
            .scheme(self.scheme.unwrap_or_default())
            .wake(self.wake.unwrap_or_default())
            .on_fault(self.on_fault.unwrap_or_default())
            .responder(self.responder.unwrap_or_default())
            .detection(self.detection.unwrap_or_default())
            .cross_check(self.cross_check)
            .audit(self.audit);
        for (number, among) in self.responder_among.iter().enumerate() {
            let colliders = among.read(&names);
            let here = format!("responder-among[{number}]");
            let colliders = colliders.map_err(|error| error.within(&here))?;
            builder = builder.responder_among(colliders, among.responder);
        }
        for (name, value) in &self.axes {
            builder = builder.axis(name, value.0);
        }
        // Only axes, the scheme and the wake policy can still be wrong.
        let mut fields = builder.build().map_err(|error| match error {
            BuildError::DuplicateAxis { .. } => content(error.to_string()).within("axes"),
            BuildError::Parameter { ref field, .. } if *field == "the wake policy" => {
                content(error.to_string()).within("wake")
            }
            _ => content(error.to_string()).within("scheme"),
        })?;
        let time = fields.state.set_time(self.time.unwrap_or(0.0));
        time.map_err(|error| content(error.to_string()).within("time"))?;
        Ok(fields)
    }

    pub(super) fn write(fields: &Fields, scene: Option<&Directory>) -> Result<Self, FileError> {
        let settings = &fields.settings;
        if settings.cross_check.is_on() && !settings.cross_check.is_plain() {
            let message = "a cross-check of some pairs only, or of recycled contacts, cannot stand \
                           in a file";
            return Err(content(message).within("cross-check"));
        }
        if let WakePolicy::OnChange { fraction } = settings.wake
            && !fraction.is_finite()
        {
            let message = format!("{fraction} is not finite, and cannot stand in a file");
            return Err(content(message).within("wake.on-change.fraction"));
        }
        let axes = fields.set.axes();
        let among = settings.responders_among().map(|(parts, responder)| {
            let mut parts: Vec<ColliderHandle> = parts.collect();
            parts.sort_unstable_by_key(|handle| handle.into_raw_parts());
            AmongDoc::write(&parts, responder, scene)
        });
        let tree = TreeDoc::write(&fields.set.tree(), scene);
        Ok(FieldsDoc {
            axes: axes
                .map(|(axis, value)| (axis.name().to_owned(), Num(value)))
                .collect(),
            scheme: unless(settings.scheme, Scheme::default()),
            wake: unless(settings.wake, WakePolicy::default()),
            on_fault: unless(settings.on_fault, FaultPolicy::default()),
            responder: unless(settings.responder(), Responder::default()),
            responder_among: among.collect::<Result<_, _>>()?,
            detection: unless(settings.detection, Detection::default()),
            cross_check: settings.cross_check.is_on(),
            audit: settings.audit,
            time: unless(fields.state.time(), 0.0),
            definitions: BTreeMap::new(),
            tree: tree.map_err(|error| error.within("tree"))?,
        })
    }
}

impl AmongDoc {
    fn read(&self, names: &Names<'_>) -> Result<Vec<ColliderHandle>, FileError> {
        let numbered = self.parts.iter().enumerate();
        let handles = numbered.map(|(place, part)| {
            let here = |error: FileError| error.within(&format!("parts[{place}]"));
            part.read(names).map_err(here)
        });
        handles.collect()
    }

    fn write(
        parts: &[ColliderHandle],
        responder: Responder,
        scene: Option<&Directory>,
    ) -> Result<Self, FileError> {
        let parts = parts.iter().map(|handle| PartDoc::write(*handle, scene));
        let parts: Result<_, FileError> = parts.collect();
        Ok(AmongDoc {
            parts: parts.map_err(|error| error.within("responder-among"))?,
            responder,
        })
    }
}
