//! Settings of fields.

use std::collections::{BTreeMap, HashSet};

use serde::{Deserialize, Serialize};

use super::error::{FileError, content};
use super::field::{Directory, PartDoc};
use super::number::{Num, unless};
use super::tree::TreeDoc;
use crate::bridge::WakePolicy;
use crate::contact::{Detection, Responder, Rules};
use crate::fields::Fields;
use crate::integrate::Scheme;
use crate::math::ColliderHandle;
use crate::pipeline::FieldSettings;

/// A tree and how it acts.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct FieldsDoc {
    /// Declared axes, and the world's values on them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    axes: BTreeMap<String, Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scheme: Option<Scheme>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wake: Option<WakePolicy>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    responder: Option<Responder>,
    /// Who answers contacts between any two of some colliders; the last that fits counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    responder_among: Vec<AmongDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    detection: Option<Detection>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    cross_check: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    audit: bool,
    /// The simulated time so far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    tree: TreeDoc,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct AmongDoc {
    parts: Vec<PartDoc>,
    responder: Responder,
}

impl FieldsDoc {
    /// Without a scene, bodies and colliders are Rapier's handles.
    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<Fields, FileError> {
        let tree = self
            .tree
            .read(scene)
            .map_err(|error| error.within("tree"))?;
        let mut builder = Fields::builder(tree).settings(FieldSettings {
            scheme: self.scheme.unwrap_or_default(),
            wake: self.wake.unwrap_or_default(),
            rules: self.rules(scene)?,
            detection: self.detection.unwrap_or_default(),
            cross_check: self.cross_check.into(),
            audit: self.audit,
        });
        for (name, value) in &self.axes {
            builder = builder.axis(name, value.0);
        }
        let mut fields = builder.build()?;
        let time = self.time.unwrap_or(0.0);
        if !time.is_finite() {
            let message = format!("expected a finite number, found {time}");
            return Err(content(message).within("time"));
        }
        fields.state.set_time(time);
        Ok(fields)
    }

    fn rules(&self, scene: Option<&Directory>) -> Result<Rules, FileError> {
        let mut rules = Rules {
            everywhere: self.responder.unwrap_or_default(),
            among: Vec::new(),
        };
        for (number, among) in self.responder_among.iter().enumerate() {
            let mut set: HashSet<ColliderHandle> = HashSet::new();
            for (place, part) in among.parts.iter().enumerate() {
                let here = format!("responder-among[{number}].parts[{place}]");
                set.insert(part.read(scene).map_err(|error| error.within(&here))?);
            }
            rules.among.push((set, among.responder));
        }
        Ok(rules)
    }

    pub(super) fn write(fields: &Fields, scene: Option<&Directory>) -> Result<Self, FileError> {
        let settings = &fields.settings;
        if settings.cross_check.on && !settings.cross_check.is_plain() {
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
        let axes = fields.set.data().axes().iter();
        let among = settings.rules.among.iter();
        let among = among.map(|(set, responder)| AmongDoc::write(set, *responder, scene));
        Ok(FieldsDoc {
            axes: axes
                .map(|(name, value)| (name.to_string(), Num(crate::math::from_f64(*value))))
                .collect(),
            scheme: unless(settings.scheme, Scheme::default()),
            wake: unless(settings.wake, WakePolicy::default()),
            responder: unless(settings.rules.everywhere, Responder::default()),
            responder_among: among.collect::<Result<_, _>>()?,
            detection: unless(settings.detection, Detection::default()),
            cross_check: settings.cross_check.on,
            audit: settings.audit,
            time: unless(fields.state.time(), 0.0),
            tree: TreeDoc::write(&fields.set.tree(), scene)
                .map_err(|error| error.within("tree"))?,
        })
    }
}

impl AmongDoc {
    fn write(
        set: &HashSet<ColliderHandle>,
        responder: Responder,
        scene: Option<&Directory>,
    ) -> Result<Self, FileError> {
        let mut handles: Vec<ColliderHandle> = set.iter().copied().collect();
        handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
        let parts = handles
            .into_iter()
            .map(|handle| PartDoc::write(handle, scene));
        let parts: Result<_, FileError> = parts.collect();
        Ok(AmongDoc {
            parts: parts.map_err(|error| error.within("responder-among"))?,
            responder,
        })
    }
}
