//! What may be asked of the fields.

use super::Fields;
use crate::compile::{Plan, Prepared};
use crate::contact::FieldContact;
use crate::cross_check::CrossCheckReport;
use crate::diagnose::{EnergyAudit, Explanation, explain};
use crate::eval::{PotentialEnergy, WrenchError};
use crate::inject::{BodySample, StepError, StepWarning, Stiffness};
use crate::math::{ColliderSet, Real, RigidBodyHandle, RigidBodySet};
use crate::rigid::Wrench;

impl Fields {
    /// What the compiler decided; prints as a short report.
    pub fn plan(&self) -> Plan {
        self.compiled.plan(&self.set)
    }

    /// Simulated time: the sum of all steps.
    pub fn time(&self) -> f64 {
        self.injector.time
    }

    /// The last wrench of the fields on a body, in world axes; `None` if it was not sampled.
    pub fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.injector.wrench(body)
    }

    /// How far the last wrench on a body, by a step or by [`Fields::sample`], may be off because
    /// borders of regions pass through the body; `None` if it was not sampled
    /// [adaptively](crate::Sampling::Adaptive).
    ///
    /// It bounds what follows from not knowing where in a cell a border is, for forces that are
    /// constant over each cell: so all of the error for uniform forces on a body of cuboids, but
    /// not what a formula varies within a cell, nor what is uncertain about the volume in cells at
    /// the surface of other shapes. Borders are those of regions, predicates and soft edges aside;
    /// infinite if too many pass through one cell to be told apart (more than six of a term).
    pub fn wrench_error(&self, body: RigidBodyHandle) -> Option<WrenchError> {
        self.injector.wrench_error(body)
    }

    /// The points at which a body is sampled, as the world is now, whichever fields use them:
    /// for drawing, and for checking against the [reference](crate::reference). Those of
    /// [adaptive](crate::Sampling::Adaptive) sampling are the ones of a body clear of borders.
    pub fn samples(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Vec<BodySample> {
        self.injector.samples(
            body,
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            bodies,
            colliders,
        )
    }

    /// The wrench of the fields on a body as the world is now, whether or not a step was made;
    /// nothing for a body that fields do not move. Changes of velocity are taken to happen in a unit
    /// of time. Works out those on all bodies, so it costs as much as a step's evaluation.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn sample(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Wrench>, StepError> {
        let wrenches = self.sample_all(1.0, bodies, colliders)?;
        let mut wrenches = wrenches.into_iter();
        let found = wrenches.find(|(handle, _)| *handle == body);
        Ok(found.map(|(_, wrench)| wrench))
    }

    /// The wrenches of the fields on all bodies that they move, as a step of `dt` would begin with
    /// them in the world as it is now, in the order of the bodies' handles.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn sample_all(
        &mut self,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Vec<(RigidBodyHandle, Wrench)>, StepError> {
        self.injector.sample(
            dt,
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            bodies,
            colliders,
        )
    }

    /// What the last step may have got wrong: fields too stiff for the scheme and the time step
    /// (the worst body only), and velocities that Rapier cut down. Empty if nothing.
    pub fn warnings(&self) -> &[StepWarning] {
        &self.injector.warnings
    }

    /// How stiff the fields are for a body in steps of `dt`, as the world is now; `None` for a
    /// body that fields do not move. Evaluates all bodies, and this one with derivatives.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let ball = RigidBodyBuilder::dynamic().translation(Vector::X);
    /// let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5).mass(4.0));
    /// world.bodies[ball].recompute_mass_properties_from_colliders(&world.colliders);
    /// let mut fields = Fields::new(Field::spring(16.0))?;
    /// let stiffness = fields.stiffness(ball, 0.1, &world.bodies, &world.colliders)?;
    /// let stiffness = stiffness.expect("a dynamic body");
    /// assert!((stiffness.dt_omega - 0.2).abs() < 1e-4, "ω = √(16/4)");
    /// assert!((stiffness.largest_stable_dt - 1.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn stiffness(
        &mut self,
        body: RigidBodyHandle,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Stiffness>, StepError> {
        self.injector.stiffness(
            body,
            dt,
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            bodies,
            colliders,
        )
    }

    /// The potential energy of all bodies in the fields, as they are now.
    pub fn potential_energy(
        &mut self,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> PotentialEnergy {
        self.injector.potential_energy(
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            bodies,
            colliders,
        )
    }

    /// Why the fields push a body the way they do right now: what each field gives, who overrules
    /// whom, and the wrench that results. Nothing for a body that fields cannot move.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    /// let wind = Field::uniform(Vector::X).named("wind");
    /// let lee = Field::uniform(Vector::ZERO).within(Region::ball(2.0)).named("lee");
    /// let mut fields = Fields::new(wind.replace_union(lee))?;
    /// let why = fields.explain(body, &world.bodies, &world.colliders).unwrap();
    /// assert_eq!(why.contributions[0].overruled_by, ["field `lee`"]);
    /// println!("{why}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn explain(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Option<Explanation> {
        let (samples, moment) = self.injector.all_probes(
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            1.0,
            bodies,
            colliders,
        );
        let place = samples.bodies.iter().position(|handle| *handle == body)?;
        let frames = (bodies, colliders);
        Some(explain(&self.set, &frames, &samples, moment, place as u32))
    }

    /// The energy audit so far, if it is on: potential and work of each field, and the drift that
    /// is left.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # world.gravity = Vector::ZERO;
    /// # let ball = RigidBodyBuilder::dynamic().translation(Vector::X);
    /// # world.insert(ball, ColliderBuilder::ball(0.5));
    /// let spring = Field::spring(1.0).named("spring");
    /// let friction = Field::drag(0.1, 0.0).named("friction");
    /// let mut fields = Fields::builder(spring.sum_union(friction)).audit(true).build()?;
    /// for _ in 0..60 {
    ///     fields.step(&mut world)?;
    /// }
    /// let audit = fields.audit().unwrap();
    /// println!("{audit}");
    /// assert!(audit.drift.abs() < 1e-3 * audit.initial, "what friction took is accounted for");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn audit(&self) -> Option<&EnergyAudit> {
        self.auditor.as_ref().map(|auditor| &auditor.audit)
    }

    /// The contacts of the last step, with the impulses that answered them: with swept detection
    /// first the touches in it, in the order of time; then overlaps at its end, in the order of the
    /// colliders' handles.
    pub fn contacts(&self) -> &[FieldContact] {
        &self.detector.contacts
    }

    /// The cross-check with Rapier so far, if it is on.
    pub fn cross_check(&self) -> Option<&CrossCheckReport> {
        self.check.as_ref().map(|check| &check.report)
    }
}
