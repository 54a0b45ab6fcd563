//! The settings of contact detection: when fields look for contacts, and whether they or Rapier answer them.

/// The time at which fields look for contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Detection {
    /// At the end of each step, as in the paper: parts that overlap there touch. A part that passes through another
    /// within a step is not detected. A mesh or a height field has no inside, so a part that would get halfway through
    /// one in a step (by half of its least half extent; by all of it where the law loses nothing) is left to Rapier to
    /// stop, with the restitution and friction of the law.
    #[default]
    Discrete,
    /// Over the whole of each step: the first touch of each pair, its time and place, with the rotation of bodies
    /// included. Each contact is answered at the moment it happens: its bodies are taken back to it, pushed by their
    /// law, and move on freely for the rest of the step. So a body may bounce several times in one step, in the right
    /// order. Parts that rest on each other touch again once they overlap deeper than rest explains: by another corner
    /// of a body that turns on, by the next face of a mesh on which it slides, or by the blow of a third body. Rest
    /// explains the way of a step at the speed below which contacts rest, and Rapier's allowed linear error, but no more
    /// than an eighth of the thickness of the thinner part. Of a mesh, the deepest overlap with a part counts: one by half
    /// of the part's thickness when the step begins hides others.
    ///
    /// Two balls, and a ball and a half-space that does not turn, are exact, to some roundings in 64 bits. Other shapes
    /// are found by Parry's distance, in time to some roundings of their size (in [`Real`](crate::math::Real)) divided
    /// by the speed of approach: see [`Capability`](crate::contact::Capability). After an impact, collisions of that body with
    /// parts that only Rapier answers are not detected before the next step. If a step reaches its limit of impacts,
    /// the bodies stay where they touch for the rest of it, and the outcome says so.
    ///
    /// Bodies move as they do for Rapier: on parabolas, under its gravity, their users' forces and the fields. Bodies
    /// that rotate freely are rotated by this crate, balls included, where Rapier would use linearised substeps. If
    /// something else pushed a body within the step (joints, Rapier's contacts), its path is taken as the straight
    /// line, and the steady rotation, between its poses.
    ///
    /// A hit is answered with the velocities at its moment, and a body moves on from there with the wrench at the end
    /// of the step: on average hits neither add nor take energy, as long as forces do not depend on velocities. A body
    /// that is integrated within the step (by `Substep`, `Forward4`, and by `Auto` where it is stiff) has a velocity of
    /// third order there, and moves on with the mean of the wrenches at the hit and at the end, whatever the number of
    /// substeps: each hit is off by at most (dt·ω)³/12 of its speed. From one percent of it on, or the tolerance of the
    /// scheme, the step warns with [`HitInStiffField`](crate::StepWarning::HitInStiffField).
    Swept,
}

/// The side that answers the contacts which fields detect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Responder {
    /// Rapier's solver. Fields only observe.
    Rapier,
    /// The fields, by their laws: all contacts of a collider that has a detection field whose law is not
    /// [`Observe`](crate::ContactLaw::Observe). Rapier still finds and reports these contacts.
    ///
    /// Contacts that last are handed to Rapier's solver by a [hook](crate::contact::StepHooks), with the friction of the law and
    /// no restitution, so resting bodies rest and sleep as in Rapier alone. A contact lasts while it approaches or
    /// separates more slowly than √((2 a dt)² + 2 a h), where a is the larger acceleration of its two bodies by
    /// gravity, fields and their users' forces, and h is Rapier's allowed linear error, 0.005 length units: a contact
    /// that would rebound lower than that is at rest. Under laws without loss (a restitution of one, the paper's) the
    /// limit is a dt, or energy would be lost. Where nothing accelerates the bodies no contact lasts; the load of
    /// joints alone is not known. A pair that still overlaps after three steps in each of which it was answered by a
    /// law that loses speed, or that goes deeper than before three times, is Rapier's until it separates; of the
    /// second, [`ContactDeepens`](crate::StepWarning::ContactDeepens) warns if the overlap exceeds 4 h. Springs
    /// ([`Penalty`](crate::ContactLaw::Penalty)) hold resting bodies themselves.
    ///
    /// Joints decide how their bodies move after an impact, so Rapier's solver answers all contacts of dynamic bodies
    /// with impulse joints under an [`Impulse`](crate::ContactLaw::Impulse) that loses speed, and of dynamic links of
    /// multibodies under any law: with the friction and restitution of an `Impulse`, else with those of the colliders.
    ///
    /// Impacts that happen at once are answered together (see [`Impulse`](crate::ContactLaw::Impulse)): of a row of
    /// touching balls that is hit, all move on, where one after the other only the last would.
    #[default]
    Fields,
    /// Both, each by its own rule.
    Both,
}
