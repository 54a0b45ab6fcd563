//! Rapier's integration parameters.

use serde::{Deserialize, Serialize};

use super::error::FileError;
use super::fields::math::Real;
use super::fields::rapier::dynamics::{FrictionModel, IntegrationParameters, SpringCoefficients};
use super::number::{Num, count, not_negative, positive, unless};

/// A parameter that a file can hold.
trait Parameter: Copy + PartialEq {
    type Doc: Copy;
    fn write(self) -> Self::Doc;
    fn read(name: &str, doc: Self::Doc) -> Result<Self, FileError>;
}

impl Parameter for Real {
    type Doc = Num;
    fn write(self) -> Num {
        Num(self)
    }
    fn read(name: &str, doc: Num) -> Result<Self, FileError> {
        match name {
            "length-unit" => positive(name, doc),
            _ => not_negative(name, doc),
        }
    }
}

impl Parameter for bool {
    type Doc = bool;
    fn write(self) -> bool {
        self
    }
    fn read(_: &str, doc: bool) -> Result<Self, FileError> {
        Ok(doc)
    }
}

impl Parameter for usize {
    type Doc = usize;
    fn write(self) -> usize {
        self
    }
    fn read(name: &str, doc: usize) -> Result<Self, FileError> {
        let least = usize::from(name == "num-solver-iterations");
        count(name, doc, least)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct SpringDoc {
    natural_frequency: Num,
    damping_ratio: Num,
}

impl Parameter for SpringCoefficients<Real> {
    type Doc = SpringDoc;
    fn write(self) -> SpringDoc {
        SpringDoc {
            natural_frequency: Num(self.natural_frequency),
            damping_ratio: Num(self.damping_ratio),
        }
    }
    fn read(name: &str, doc: SpringDoc) -> Result<Self, FileError> {
        let inner = |error: FileError| error.within(name);
        let frequency = not_negative("natural-frequency", doc.natural_frequency);
        let ratio = not_negative("damping-ratio", doc.damping_ratio);
        Ok(SpringCoefficients::new(
            frequency.map_err(inner)?,
            ratio.map_err(inner)?,
        ))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum FrictionDoc {
    Simplified,
    Coulomb,
}

impl Parameter for FrictionModel {
    type Doc = FrictionDoc;
    fn write(self) -> FrictionDoc {
        match self {
            FrictionModel::Simplified => FrictionDoc::Simplified,
            FrictionModel::Coulomb => FrictionDoc::Coulomb,
        }
    }
    fn read(_: &str, doc: FrictionDoc) -> Result<Self, FileError> {
        Ok(match doc {
            FrictionDoc::Simplified => FrictionModel::Simplified,
            FrictionDoc::Coulomb => FrictionModel::Coulomb,
        })
    }
}

/// The parameters of Rapier that a file can set, each by Rapier's name; those left out have Rapier's
/// defaults.
macro_rules! parameters {
    ($($parameter:ident: $kind:ty,)*) => {
        #[derive(Clone, Debug, Default, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(rename_all = "kebab-case", deny_unknown_fields)]
        pub(super) struct ParametersDoc {$(
            #[serde(default, skip_serializing_if = "Option::is_none")]
            $parameter: Option<<$kind as Parameter>::Doc>,
        )*}

        impl ParametersDoc {
            pub(super) fn set_dt(&mut self, dt: Real) {
                self.dt = Some(Num(dt));
            }

            pub(super) fn read(&self) -> Result<IntegrationParameters, FileError> {
                let mut parameters = IntegrationParameters::default();
                $(if let Some(doc) = self.$parameter {
                    let name = stringify!($parameter).replace('_', "-");
                    parameters.$parameter = Parameter::read(&name, doc)?;
                })*
                Ok(parameters)
            }

            pub(super) fn write(parameters: &IntegrationParameters) -> Self {
                let usual = IntegrationParameters::default();
                ParametersDoc {$(
                    $parameter: unless(parameters.$parameter, usual.$parameter)
                        .map(Parameter::write),
                )*}
            }
        }
    };
}

parameters! {
    dt: Real,
    min_ccd_dt: Real,
    contact_softness: SpringCoefficients<Real>,
    static_contact_softness: SpringCoefficients<Real>,
    warmstart_coefficient: Real,
    length_unit: Real,
    normalized_allowed_linear_error: Real,
    normalized_max_corrective_velocity: Real,
    normalized_prediction_distance: Real,
    normalized_max_linear_velocity: Real,
    num_solver_iterations: usize,
    num_internal_pgs_iterations: usize,
    num_internal_stabilization_iterations: usize,
    max_ccd_substeps: usize,
    contact_clustering: bool,
    contact_recycling: bool,
    normalized_contact_recycle_distance: Real,
    friction_in_bias_pass: bool,
    warmstart_joints: bool,
    friction_model: FrictionModel,
}
