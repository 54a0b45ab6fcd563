//! The energy audit: the effect of each field on the energy of bodies.

use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::sampled::SampledFields;
use crate::field::{Anchor, Field, FieldRef, Frames};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::reference::Fate;
use crate::rigid::Lookup;

/// Potential and work of each field, and the drift of the total energy, since the audit began.
///
/// Work is the power F·v at the samples, by the trapezoidal rule over each step: second order in the step. A field that
/// has a potential and begins or stops acting on a sample (at the border of its region, where another field overrules
/// it, by its lifetime) gives or takes the whole potential at once: that is its border work. The drift is the change
/// that neither potentials nor work explain: the error of the scheme, and the work of everything else that moves bodies
/// (contacts, joints, damping, Rapier's own gravity, the user). Its `Display` is a table.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct EnergyAudit {
    /// One entry for each field of the tree, and for each operation whose force is not the sum of its fields' (cross
    /// products, scales, limits).
    pub fields: Vec<FieldEnergy>,
    /// Kinetic energy of all dynamic bodies after the last step.
    pub kinetic: f64,
    /// The sum of the potentials after the last step.
    pub potential: f64,
    /// Kinetic energy and potentials when the audit began.
    pub initial: f64,
    /// Change of kinetic energy and potentials since the audit began, minus the work of all fields and operations
    /// without a potential, minus all border work.
    pub drift: f64,
    began: bool,
}

/// The effect of one field on the energy.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FieldEnergy {
    /// The field's name, or its place in the tree; a prototype stands for all its instances.
    pub field: FieldRef,
    /// The potential energy of all bodies on which it acts; `None` for a field without potential. A field anchored to a
    /// body counts half, because the field of the other body acts back; a reacting one counts in full.
    pub potential: Option<f64>,
    /// Work done on bodies since the audit began.
    pub work: f64,
    /// The gain of kinetic and potential energy where the field began or stopped acting on samples; zero for a field
    /// without potential.
    pub border: f64,
}

/// Power and potential of all fields at one moment, by their place in the set.
#[derive(Debug, Default)]
pub(crate) struct AuditReading {
    power: Vec<f64>,
    potential: Vec<Option<f64>>,
    /// A sum of hashes that identifies the samples on which a field acts.
    acts_on: Vec<u64>,
}

impl EnergyAudit {
    /// Records the state before a step; returns the power and potential of the fields at that moment.
    pub(crate) fn begin(
        &mut self,
        fields: &SampledFields<'_, impl Lookup + Frames>,
    ) -> AuditReading {
        let (set, world) = (fields.set, fields.frames);
        let reading = reading(fields);
        if !self.began {
            self.began = true;
            let places = 0..set.nodes().0.len() as u32;
            let energy = |place| FieldEnergy {
                field: set.field_ref(place),
                ..FieldEnergy::default()
            };
            self.fields = places.map(energy).collect();
            self.take(world, &reading);
            self.initial = self.kinetic + self.potential;
        }
        // Lifetimes are evaluated for the step, so their changes fall between two steps.
        for (place, field) in self.fields.iter_mut().enumerate() {
            let timeless = |field: &Field| field.lifetime.is_timeless();
            let changes = !set.field(place as u32).is_some_and(timeless);
            if let Some(potential) = field.potential.as_mut().filter(|_| changes) {
                let now = reading.potential.get(place).copied().flatten();
                field.border += now.unwrap_or(0.0) - *potential;
                *potential = now.unwrap_or(0.0);
            }
        }
        reading
    }

    /// Adds the work of a step that has just ended; `before` is the reading from its start.
    pub(crate) fn end(
        &mut self,
        before: &AuditReading,
        fields: &SampledFields<'_, impl Lookup + Frames>,
        dt: Real,
    ) {
        let reading = reading(fields);
        let common = before.power.len().min(reading.power.len());
        for (place, field) in self.fields.iter_mut().enumerate().take(common) {
            let work = (before.power[place] + reading.power[place]) / 2.0 * to_f64(dt);
            field.work += work;
            let crossed = before.acts_on[place] != reading.acts_on[place];
            let potentials = before.potential[place].zip(reading.potential[place]);
            if let (Some((before, after)), true) = (potentials, crossed) {
                field.border += after - before + work;
            }
        }
        self.take(fields.frames, &reading);
    }

    fn take(&mut self, world: &impl Lookup, reading: &AuditReading) {
        let audit = self;
        for (field, potential) in audit.fields.iter_mut().zip(&reading.potential) {
            // A field that no longer has a potential is set to zero, because its work was not counted.
            let gone = field.potential.map(|_| 0.0);
            field.potential = potential.or(gone);
        }
        let dynamic = world.bodies().filter(|(_, body)| body.is_dynamic());
        audit.kinetic = dynamic.map(|(_, body)| to_f64(body.kinetic_energy())).sum();
        audit.potential = reading.potential.iter().flatten().sum();
        let without = audit
            .fields
            .iter()
            .filter(|field| field.potential.is_none());
        let work: f64 = without.map(|field| field.work).sum();
        let border: f64 = audit.fields.iter().map(|field| field.border).sum();
        audit.drift = audit.kinetic + audit.potential - audit.initial - work - border;
    }
}

/// The velocity of a body's material at a world point, in world axes.
fn velocity_of(frames: &impl Frames, body: RigidBodyHandle, world_point: Vector) -> DVec3 {
    let frame = frames.frame(&Anchor::from(body));
    frame.map_or(DVec3::ZERO, |frame| {
        let arm = world_point - frame.pose.translation;
        to_dvec3(frame.velocity + frame.angvel.cross(arm))
    })
}

/// Power and potential of all fields on all sampled bodies in the present world.
fn reading(fields: &SampledFields<'_, impl Frames>) -> AuditReading {
    let (set, frames, samples) = (fields.set, fields.frames, fields.samples);
    let count = set.nodes().0.len();
    let mut reading = AuditReading {
        power: vec![0.0; count],
        potential: vec![None; count],
        acts_on: vec![0; count],
    };
    for place in 0..count {
        // A field with a potential has one even if it acts on no body.
        let field = set.field(place as u32);
        let known = field.is_some_and(|field| field.has_potential());
        reading.potential[place] = known.then_some(0.0);
    }
    for body in 0..samples.bodies.len() as u32 {
        let mut visit = 0_u32;
        fields.each_trace(body, |sample, term, trace| {
            visit += 1;
            let velocity = to_dvec3(sample.velocity);
            let mut rest = trace.force.unwrap_or_default().dot(velocity);
            for contribution in &trace.contributions {
                if contribution.fate != Fate::Counts {
                    continue;
                }
                let place = contribution.place as usize;
                let force = contribution.force.unwrap_or_default();
                let power = force.dot(velocity);
                reading.power[place] += power;
                rest -= power;
                let field = set.field(contribution.place);
                let carrier = contribution.carrier;
                // For a field that ends sharply, a change in the share of the body inside is a crossing of the border.
                // Buoyancy grows continuously with that share, so nothing is crossed.
                let ends = field.is_some_and(|field| !field.formula.reads_volume());
                let how_much = ends.then(|| to_f64(sample.fraction).to_bits());
                let who = (samples.bodies[body as usize], visit, carrier, how_much);
                let acts_on = &mut reading.acts_on[place];
                *acts_on = acts_on.wrapping_add(hash(who));
                if let Some(carrier) = carrier.filter(|_| field.is_some_and(|f| f.reacts)) {
                    let point = sample.world_point;
                    reading.power[place] -= force.dot(velocity_of(frames, carrier, point));
                }
                if let (Some(sum), Some(potential)) =
                    (&mut reading.potential[place], contribution.potential)
                {
                    let carried = carrier.is_some();
                    *sum += potential * field.map_or(1.0, |f| f.energy_share(carried));
                }
            }
            // The power of an operation beyond the sum of its fields.
            reading.power[term as usize] += rest;
        });
    }
    reading
}

fn hash(sample: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    sample.hash(&mut hasher);
    hasher.finish()
}

impl fmt::Display for EnergyAudit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [potential, work, border] = ["potential", "work", "border"];
        writeln!(f, "{potential:>14} {work:>14} {border:>14}  field")?;
        for field in &self.fields {
            let FieldEnergy { work, border, .. } = field;
            match field.potential {
                Some(potential) => write!(f, "{potential:>14.6e} {work:>14.6e} {border:>14.6e}")?,
                None if *work == 0.0 => continue,
                None => write!(f, "{:>14} {work:>14.6e} {:>14}", "none", "none")?,
            }
            writeln!(f, "  {}", field.field)?;
        }
        let EnergyAudit {
            kinetic, potential, ..
        } = self;
        writeln!(
            f,
            "kinetic {kinetic:.6e}, potential {potential:.6e}, drift {:.3e}",
            self.drift
        )
    }
}
