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
    /// through another within a step is not seen. A mesh or a height field has no inside: what would
    /// come half through one in a step (by half of its least half extent; by the whole of it where the law
    /// loses nothing) is Rapier's to stop, with the restitution and friction of the law.
    #[default]
    Discrete,
    /// Over the whole of each step: who touches first, when and where, the rotation of bodies
    /// included. Each contact is answered at the moment it happens: its bodies are taken back to
    /// it, pushed by their law, and move on freely for the rest of the step; so a body may bounce
    /// any number of times in one step, in the right order, and nothing tunnels.
    ///
    /// Balls and half-spaces are exact, to some roundings in 64 bits; other shapes are found by
    /// Parry's distance, in time to some roundings of their size (in [`Real`](crate::math::Real))
    /// over the speed of approach: see [`Capability`](crate::Capability). Not seen are a body's
    /// collisions with what only Rapier answers after it was pushed: those wait for the next step.
    /// If a step has more impacts than one may have, its bodies are kept where they touch for the
    /// rest of it, and the outcome says so.
    ///
    /// Bodies move as they do for Rapier: on parabolas, under its gravity, their users' forces and
    /// the fields. Those that turn freely are all turned by this crate's own rotation, balls
    /// included, which Rapier would turn by linearised substeps. Where something else pushed a body
    /// within the step (joints, Rapier's contacts), its path is taken as the straight line, and the
    /// steady rotation, between its poses.
    ///
    /// A hit is answered with the velocities of its moment, and a body goes on from there with the wrench at
    /// the end of the step: in the mean hits add and take no energy, as far as forces do not read velocities.
    /// A body that is moved within the step (by `Substep`, `Suzuki4`, and by `Auto` where it is stiff) has a
    /// velocity of third order there, and goes on with the mean of the wrenches at the hit and at the end,
    /// however many substeps there are: each hit is off by (dt·ω)³/12 of its speed at the most. From a
    /// percent of it on, or the tolerance of the scheme,
    /// [`HitInStiffField`](crate::StepWarning::HitInStiffField) tells.
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
    /// The fields, by their laws: whatever touches a collider that has a detection field whose law
    /// is not [`Observe`](crate::ContactLaw::Observe). Rapier still finds and reports these
    /// contacts.
    ///
    /// Contacts that last are handed to Rapier's solver by a [hook](crate::StepHooks), with the
    /// friction of the law and no restitution: so what rests, rests and sleeps as it does in Rapier
    /// alone. A contact lasts while it approaches and parts more slowly than
    /// √((2 a dt)² + 2 a h), where a is the larger acceleration of its two bodies by gravity,
    /// fields and their users' forces, and h Rapier's allowed linear error, 0.005 length units: what
    /// would rebound lower than that is at rest. Of laws without loss (a restitution of one, the
    /// paper's) only what is slower than a dt lasts, or energy would be lost. Where nothing
    /// accelerates bodies, no contact lasts: what joints alone press together is not known. A pair that still
    /// overlaps after three steps in each of which it was answered, or more after each, lasts until it parts;
    /// [`ContactDeepens`](crate::StepWarning::ContactDeepens) tells of the second.
    /// Springs ([`Penalty`](crate::ContactLaw::Penalty)) hold what rests themselves.
    ///
    /// Impacts that happen at once are answered together (see
    /// [`Impulse`](crate::ContactLaw::Impulse)): of a row of touching balls that is hit all move on,
    /// where one after the other only the last would.
    #[default]
    Fields,
    /// Both, each by its own rule.
    Both,
}
