//! The methods of a study.

/// A way to move a world with forces or contacts in it.
///
/// Rapier has its defaults, among them four solver iterations, unless the name says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Method {
    /// `Scheme::KickDriftKick`, the default.
    KickDriftKick,
    /// The same with one of Rapier's solver iterations, which suffices for bodies that move freely.
    KickDriftKickOnce,
    /// `Scheme::Kick`.
    Kick,
    /// `Scheme::ExternalForce`.
    ExternalForce,
    /// `Scheme::Substep` with four substeps.
    Substep4,
    /// `Scheme::Forward4`.
    Forward4,
    /// `Scheme::LinearlyImplicit`.
    LinearlyImplicit,
    /// `Scheme::Auto` with a tolerance of 1e-2.
    Auto,
    /// `Scheme::Auto` with a tolerance of 1e-4.
    AutoTight,
    /// Without this crate: `reset_forces`, `add_force` and `add_torque` once per step, with a force computed by hand.
    AddForce,
    /// The same with one solver iteration, which makes it the symplectic Euler scheme.
    AddForceOnce,
    /// Without this crate: half a kick by `apply_impulse` before Rapier's step and half after it, with one solver
    /// iteration.
    KicksByHand,
    /// Fields answer the contacts they find at the end of a step.
    FieldsDiscrete,
    /// Fields answer the contacts they find along the motion within a step.
    FieldsSwept,
    /// Fields answer by the law of the paper, read literally.
    PaperLaw,
    /// Rapier's own contact solver.
    Rapier,
    /// The same, with continuous collision detection on every body.
    RapierCcd,
    /// The same, with soft continuous collision detection on every body.
    RapierSoftCcd,
}

use Method::*;

impl Method {
    /// All methods.
    pub const ALL: [Method; 18] = [
        KickDriftKick,
        KickDriftKickOnce,
        Kick,
        ExternalForce,
        Substep4,
        Forward4,
        LinearlyImplicit,
        Auto,
        AutoTight,
        AddForce,
        AddForceOnce,
        KicksByHand,
        FieldsDiscrete,
        FieldsSwept,
        PaperLaw,
        Rapier,
        RapierCcd,
        RapierSoftCcd,
    ];

    /// The methods for forces.
    pub const FORCES: [Method; 12] = [
        KickDriftKick,
        KickDriftKickOnce,
        Kick,
        ExternalForce,
        Substep4,
        Forward4,
        LinearlyImplicit,
        Auto,
        AutoTight,
        AddForce,
        AddForceOnce,
        KicksByHand,
    ];

    /// The methods for contacts.
    pub const CONTACTS: [Method; 6] = [
        FieldsDiscrete,
        FieldsSwept,
        PaperLaw,
        Rapier,
        RapierCcd,
        RapierSoftCcd,
    ];

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            KickDriftKick => "KickDriftKick",
            KickDriftKickOnce => "KickDriftKick (1 iteration)",
            Kick => "Kick",
            ExternalForce => "ExternalForce",
            Substep4 => "Substep(4)",
            Forward4 => "Forward4",
            LinearlyImplicit => "LinearlyImplicit",
            Auto => "Auto(1e-2)",
            AutoTight => "Auto(1e-4)",
            AddForce => "add_force",
            AddForceOnce => "add_force (1 iteration)",
            KicksByHand => "kicks by hand",
            FieldsDiscrete => "fields (discrete)",
            FieldsSwept => "fields (swept)",
            PaperLaw => "fields (paper's law)",
            Rapier => "Rapier",
            RapierCcd => "Rapier (CCD)",
            RapierSoftCcd => "Rapier (soft CCD)",
        }
    }

    /// The method of that [name](Self::name).
    pub fn named(name: &str) -> Option<Method> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Whether it uses this crate.
    pub fn is_ours(self) -> bool {
        !matches!(
            self,
            AddForce | AddForceOnce | KicksByHand | Rapier | RapierCcd | RapierSoftCcd
        )
    }

    /// Whether Rapier makes one solver iteration instead of its four.
    pub fn iterates_once(self) -> bool {
        matches!(self, KickDriftKickOnce | AddForceOnce | KicksByHand)
    }
}
