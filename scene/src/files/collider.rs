//! Colliders, and their properties that fields read.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::body::{is_yes, yes};
use super::error::{FileError, content};
use super::field::GroupsDoc;
use super::fields::ColliderProperties;
use super::fields::math::{InteractionGroups, Real};
use super::fields::rapier::dynamics::CoefficientCombineRule;
use super::fields::rapier::geometry::{
    ActiveCollisionTypes, Collider, ColliderBuilder, ColliderMassProps,
};
use super::mass::MassDoc;
use super::number::{Num, Quad, Triple, not_negative, placed, quad, unless_num, unless_zero};
use super::shape::ShapeDoc;

/// A collider. Keys are named after Rapier's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct ColliderDoc {
    shape: ShapeDoc,
    /// In the frame of the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rotation: Option<Quad>,
    /// At most one of `density`, `mass` and `mass-properties`; without any, the density is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    density: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mass: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mass_properties: Option<MassDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    friction: Option<Num>,
    #[serde(default, skip_serializing_if = "RuleDoc::is_usual")]
    friction_rule: RuleDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    restitution: Option<Num>,
    #[serde(default, skip_serializing_if = "RuleDoc::is_usual")]
    restitution_rule: RuleDoc,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    sensor: bool,
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    enabled: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    collision_groups: Option<GroupsDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    solver_groups: Option<GroupsDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contact_skin: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<ProbeDoc>,
}

/// Properties of a collider that fields read, besides its shape and pose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct ProbeDoc {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    charge: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mass: Option<Num>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    axes: BTreeMap<String, Num>,
}

/// The rule that combines the coefficients of two colliders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum RuleDoc {
    #[default]
    Average,
    Min,
    Multiply,
    Max,
    ClampedSum,
    GeometricMean,
}

impl RuleDoc {
    fn is_usual(&self) -> bool {
        *self == RuleDoc::Average
    }

    fn read(self) -> CoefficientCombineRule {
        match self {
            RuleDoc::Average => CoefficientCombineRule::Average,
            RuleDoc::Min => CoefficientCombineRule::Min,
            RuleDoc::Multiply => CoefficientCombineRule::Multiply,
            RuleDoc::Max => CoefficientCombineRule::Max,
            RuleDoc::ClampedSum => CoefficientCombineRule::ClampedSum,
            RuleDoc::GeometricMean => CoefficientCombineRule::GeometricMean,
        }
    }

    fn write(rule: CoefficientCombineRule) -> Self {
        match rule {
            CoefficientCombineRule::Average => RuleDoc::Average,
            CoefficientCombineRule::Min => RuleDoc::Min,
            CoefficientCombineRule::Multiply => RuleDoc::Multiply,
            CoefficientCombineRule::Max => RuleDoc::Max,
            CoefficientCombineRule::ClampedSum => RuleDoc::ClampedSum,
            CoefficientCombineRule::GeometricMean => RuleDoc::GeometricMean,
        }
    }
}

impl ColliderDoc {
    pub(super) fn read(&self) -> Result<Collider, FileError> {
        let shape = self.shape.read().map_err(|error| error.within("shape"))?;
        let groups =
            |groups: Option<GroupsDoc>| groups.map_or(InteractionGroups::all(), GroupsDoc::read);
        let or = |name: &str, value: Option<Num>, usual| match value {
            Some(value) => not_negative(name, value),
            None => Ok(usual),
        };
        let mut builder = ColliderBuilder::new(shape)
            .position(placed(self.at, self.rotation)?)
            .friction(or("friction", self.friction, usual_friction())?)
            .friction_combine_rule(self.friction_rule.read())
            .restitution(or("restitution", self.restitution, 0.0)?)
            .restitution_combine_rule(self.restitution_rule.read())
            .sensor(self.sensor)
            .enabled(self.enabled)
            .collision_groups(groups(self.collision_groups))
            .solver_groups(groups(self.solver_groups))
            .contact_skin(or("contact-skin", self.contact_skin, 0.0)?);
        builder.mass_properties = self.mass()?;
        Ok(builder.build())
    }

    fn mass(&self) -> Result<ColliderMassProps, FileError> {
        Ok(match (self.density, self.mass, &self.mass_properties) {
            (None, None, None) => ColliderMassProps::default(),
            (Some(density), None, None) => {
                ColliderMassProps::Density(not_negative("density", density)?)
            }
            (None, Some(mass), None) => ColliderMassProps::Mass(not_negative("mass", mass)?),
            (None, None, Some(properties)) => {
                let properties = properties.read();
                let inner = |error: FileError| error.within("mass-properties");
                ColliderMassProps::MassProperties(Box::new(properties.map_err(inner)?))
            }
            _ => {
                return Err(content(
                    "expected one of `density`, `mass` and `mass-properties`, found several",
                ));
            }
        })
    }

    pub(super) fn write(collider: &Collider) -> Result<Self, FileError> {
        if collider.active_collision_types() != ActiveCollisionTypes::default() {
            return Err(content(
                "active collision types other than the usual ones cannot stand in a file",
            ));
        }
        let shape = ShapeDoc::write(collider.shared_shape()).map_err(|e| e.within("shape"))?;
        let pose = collider
            .position_wrt_parent()
            .unwrap_or(collider.position());
        let material = collider.material();
        let groups = |groups: InteractionGroups| {
            (groups != InteractionGroups::all()).then(|| GroupsDoc::write(groups))
        };
        let doc = ColliderDoc {
            shape,
            at: unless_zero(pose.translation),
            rotation: quad(pose.rotation),
            density: None,
            mass: None,
            mass_properties: None,
            friction: unless_num(material.friction, usual_friction()),
            friction_rule: RuleDoc::write(material.friction_combine_rule),
            restitution: unless_num(material.restitution, 0.0),
            restitution_rule: RuleDoc::write(material.restitution_combine_rule),
            sensor: collider.is_sensor(),
            enabled: collider.is_enabled(),
            collision_groups: groups(collider.collision_groups()),
            solver_groups: groups(collider.solver_groups()),
            contact_skin: unless_num(collider.contact_skin(), 0.0),
            probe: None,
        };
        Ok(doc.with_mass_of(collider))
    }

    /// Sets the shortest of density, mass and mass properties that gives the collider's mass properties exactly.
    fn with_mass_of(mut self, collider: &Collider) -> Self {
        let shape = collider.shape();
        let gives =
            |way: ColliderMassProps| way.mass_properties(shape) == collider.mass_properties();
        if gives(ColliderMassProps::default()) {
            return self;
        }
        let (mass, density) = (collider.mass(), collider.density());
        let by_mass = gives(ColliderMassProps::Mass(mass));
        let digits = |x: Real| format!("{x:e}").len();
        // For a given mass there is often a density that gives the same mass properties, with more digits.
        let shorter = !by_mass || digits(density) < digits(mass);
        if shorter && gives(ColliderMassProps::Density(density)) {
            self.density = Some(Num(density));
        } else if by_mass {
            self.mass = Some(Num(mass));
        } else {
            self.mass_properties = Some(MassDoc::write(&collider.mass_properties()));
        }
        self
    }
}

fn usual_friction() -> Real {
    ColliderBuilder::default_friction()
}

impl ProbeDoc {
    pub(super) fn read(&self) -> ColliderProperties {
        let mut properties = ColliderProperties::new();
        properties.charge = self.charge.map_or(0.0, |charge| charge.0);
        properties.mass = self.mass.map(|mass| mass.0);
        for (name, value) in &self.axes {
            properties = properties.axis(name, value.0);
        }
        properties
    }

    pub(super) fn write(properties: &ColliderProperties) -> Self {
        let axes = properties.axes.iter();
        ProbeDoc {
            charge: unless_num(properties.charge, 0.0),
            mass: properties.mass.map(Num),
            axes: axes
                .map(|(name, value)| (name.to_string(), Num(*value)))
                .collect(),
        }
    }
}
