//! The contacts of a box of ammonia by kind, and their effect on rotation.

use std::collections::HashMap;

use super::fields;
use fields::Fields;
use fields::contact::FieldContact;
use fields::math::{ColliderHandle, DVec3, Vector, to_dvec3};

use super::BoxOfAmmonia;

/// The kind of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactKind {
    /// Two nitrogens.
    NitrogenNitrogen,
    /// A nitrogen and a hydrogen.
    NitrogenHydrogen,
    /// Two hydrogens.
    HydrogenHydrogen,
    /// An atom and a wall.
    Wall,
}

impl ContactKind {
    /// All kinds.
    pub const ALL: [ContactKind; 4] = [
        ContactKind::NitrogenNitrogen,
        ContactKind::NitrogenHydrogen,
        ContactKind::HydrogenHydrogen,
        ContactKind::Wall,
    ];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            ContactKind::NitrogenNitrogen => "N–N",
            ContactKind::NitrogenHydrogen => "N–H",
            ContactKind::HydrogenHydrogen => "H–H",
            ContactKind::Wall => "wall",
        }
    }
}

/// Sums over the answered contacts of one kind; the two molecules of a contact count separately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KindTally {
    /// Answered contacts, counted once per step in which they were.
    pub contacts: u64,
    molecules: u64,
    arms: f64,
    spins: f64,
}

impl KindTally {
    /// Mean distance of a molecule's centre of mass from the line of the impulse, Å; zero without contacts.
    pub fn mean_arm(&self) -> f64 {
        self.arms / self.molecules.max(1) as f64
    }

    /// Mean angular momentum about its centre of mass that a molecule receives, amu Å²/ps.
    pub fn mean_spin(&self) -> f64 {
        self.spins / self.molecules.max(1) as f64
    }

    fn add(&mut self, arm: DVec3, impulse: DVec3) {
        let twist = arm.cross(impulse).length();
        self.molecules += 1;
        self.arms += twist / impulse.length();
        self.spins += twist;
    }
}

/// Counts of contacts by kind.
#[derive(Clone, Debug)]
pub struct ContactKinds {
    nitrogens: HashMap<ColliderHandle, bool>,
    tallies: [KindTally; 4],
}

impl ContactKinds {
    /// No contacts counted.
    pub fn new(scene: &BoxOfAmmonia) -> Self {
        let molecules = scene.molecules.iter();
        let atoms = molecules.flat_map(|it| it.sites.into_iter().enumerate());
        ContactKinds {
            nitrogens: atoms.map(|(site, atom)| (atom, site == 0)).collect(),
            tallies: Default::default(),
        }
    }

    /// Counts the answered contacts of the last step.
    pub fn count(&mut self, scene: &BoxOfAmmonia, fields: &Fields) {
        let answered = |contact: &&FieldContact| contact.impulses != [Vector::ZERO; 2];
        for contact in fields.contacts().iter().filter(answered) {
            let kind = self.kind(contact.colliders);
            let tally = &mut self.tallies[kind as usize];
            tally.contacts += 1;
            let point = to_dvec3(contact.world_point);
            for (body, impulse) in contact.bodies.iter().zip(contact.impulses) {
                let body = body.and_then(|handle| scene.world.bodies.get(handle));
                if let Some(body) = body.filter(|body| body.is_dynamic()) {
                    tally.add(point - to_dvec3(body.center_of_mass()), to_dvec3(impulse));
                }
            }
        }
    }

    /// The sums of one kind.
    pub fn of(&self, kind: ContactKind) -> &KindTally {
        &self.tallies[kind as usize]
    }

    fn kind(&self, colliders: [ColliderHandle; 2]) -> ContactKind {
        match colliders.map(|collider| self.nitrogens.get(&collider)) {
            [Some(true), Some(true)] => ContactKind::NitrogenNitrogen,
            [Some(false), Some(false)] => ContactKind::HydrogenHydrogen,
            [Some(_), Some(_)] => ContactKind::NitrogenHydrogen,
            _ => ContactKind::Wall,
        }
    }
}
