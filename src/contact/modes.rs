//! When fields look for contacts, and who answers them.

/// When fields look for contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Detection {
    /// At the end of each step, as the paper does: who overlaps there is touching. What passes
    /// through another within a step is not seen.
    #[default]
    Discrete,
    /// Over the whole of each step: who touches first, when and where, the rotation of bodies
    /// included. Each contact is answered at the moment it happens: its bodies are taken back to
    /// it, pushed by their law, and move on freely for the rest of the step; so a body may bounce
    /// any number of times in one step, in the right order, and nothing tunnels.
    ///
    /// Balls and half-spaces are exact, to some roundings in 64 bits; other shapes are found by
    /// Parry's distance, in time to some roundings of their size (in [`Real`](crate::math::Real)) over the speed of
    /// approach. Not seen are a body's collisions with what only Rapier answers after it was
    /// pushed: those wait for the next step.
    ///
    /// Bodies move as they do for Rapier. Those that turn freely are all turned by this crate's own
    /// rotation, balls included, which Rapier would turn by linearised substeps. Where something
    /// else pushed a body within the step (gravity, joints, Rapier's contacts), its path is taken
    /// as the straight line, and the steady rotation, between its poses.
    Swept,
}

/// Who answers the contacts that fields detect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Responder {
    /// Rapier's solver; fields only observe.
    Rapier,
    /// The fields, by their laws. Rapier still finds and reports contacts between two colliders
    /// that both have a detection field, but is told by a [hook](crate::StepHooks) not to solve
    /// them. Contacts with all other colliders stay Rapier's.
    #[default]
    Fields,
    /// Both, each by its own rule.
    Both,
}
