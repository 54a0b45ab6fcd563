//! Questions to the fields.

use super::Fields;
use crate::bridge::{StepError, WorldRef};
use crate::compile::Plan;
use crate::contact::{ContactPlan, FieldContact};
use crate::cross_check::CrossCheckReport;
use crate::diagnose::{EnergyAudit, Explanation};
use crate::eval::PotentialEnergy;
use crate::integrate::{StepWarning, Stiffness};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::pipeline::{BodySample, FieldValue, StepTimings};
use crate::rigid::Wrench;

impl Fields {
    /// The decisions of the compiler; prints as a short report.
    pub fn plan(&self) -> Plan {
        self.pipeline.plan(&self.set)
    }

    /// Which pairs of shapes among the colliders of a world detection fields watch, and how exactly they find
    /// their contacts; prints as a short report.
    pub fn contact_plan<'a>(&self, world: impl Into<WorldRef<'a>>) -> ContactPlan {
        let watched = self.pipeline.watched(&self.set);
        let kinds = world.into().colliders.iter().map(|(handle, collider)| {
            let kind = collider.shape().shape_type();
            (kind, watched.contains(&handle))
        });
        let mut kinds: Vec<_> = kinds.collect();
        kinds.sort_unstable_by_key(|(kind, watched)| (*kind as u32, *watched));
        kinds.dedup();
        ContactPlan::new(&kinds, self.settings.detection)
    }

    /// How long each stage of the last step took: empty unless it is [measured](Self::set_timed). Prints as a
    /// short report. Stages that a scene does not need are not there.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// use rapier3d_fields::StepStage;
    /// let mut world = PhysicsWorld::new();
    /// world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    /// let mut fields = Fields::new(Field::point_gravity(4.0).at(Vector::X * 9.0))?;
    /// fields.set_timed(true);
    /// fields.step(&mut world)?;
    /// let timings = fields.timings();
    /// assert!(timings.of(StepStage::Evaluation).is_some());
    /// assert_eq!(timings.of(StepStage::Contacts), None);
    /// println!("{timings}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn timings(&self) -> &StepTimings {
        self.pipeline.timings()
    }

    /// Sets whether the stages of steps are measured, from the next step on; without that no clock is read.
    pub fn set_timed(&mut self, on: bool) {
        self.pipeline.set_timed(on);
    }

    /// Simulated time: the sum of all steps.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// The last wrench of the fields on a body, in world axes; `None` if it was not sampled.
    #[must_use]
    pub fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.pipeline.last_wrench(&self.state, body)
    }

    /// The points at which a body is sampled, as the world is now, whichever fields use them:
    /// for drawing, and for checking against the [reference](crate::reference).
    pub fn samples<'a>(
        &self,
        body: RigidBodyHandle,
        world: impl Into<WorldRef<'a>>,
    ) -> Vec<BodySample> {
        self.pipeline
            .samples(&self.definition(), &self.state, world.into(), body)
    }

    /// The wrench of the fields on a body as the world is now, whether or not a step was made;
    /// nothing for a body that fields do not move. Changes of velocity are taken to happen in a unit
    /// of time. Works out those on all bodies, so it costs as much as a step's evaluation.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn sample<'a>(
        &self,
        body: RigidBodyHandle,
        world: impl Into<WorldRef<'a>>,
    ) -> Result<Option<Wrench>, StepError> {
        let wrenches = self.sample_all(1.0, world)?;
        let mut wrenches = wrenches.into_iter();
        let found = wrenches.find(|(handle, _)| *handle == body);
        Ok(found.map(|(_, wrench)| wrench))
    }

    /// The wrenches of the fields on all bodies that they move, as a step of `dt` would begin with
    /// them in the world as it is now, in the order of the bodies' handles.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn sample_all<'a>(
        &self,
        dt: Real,
        world: impl Into<WorldRef<'a>>,
    ) -> Result<Vec<(RigidBodyHandle, Wrench)>, StepError> {
        self.pipeline
            .wrenches(&self.definition(), &self.state, dt, world.into())
    }

    /// Possible errors of the last step: fields too stiff for the scheme and the time step
    /// (the worst body only), velocities that Rapier cut down, and bodies to which fields gave what
    /// cannot be given to Rapier. Empty if nothing.
    #[must_use]
    pub fn warnings(&self) -> &[StepWarning] {
        self.pipeline.warnings()
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
    /// let fields = Fields::new(Field::spring(16.0))?;
    /// let stiffness = fields.stiffness(ball, 0.1, &world)?;
    /// let stiffness = stiffness.expect("a dynamic body");
    /// assert!((stiffness.dt_omega - 0.2).abs() < 1e-4, "ω = √(16/4)");
    /// assert!((stiffness.largest_stable_dt - 1.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn stiffness<'a>(
        &self,
        body: RigidBodyHandle,
        dt: Real,
        world: impl Into<WorldRef<'a>>,
    ) -> Result<Option<Stiffness>, StepError> {
        self.pipeline
            .stiffness(&self.definition(), &self.state, dt, world.into(), body)
    }

    /// The potential energy of all bodies in the fields, as they are now.
    pub fn potential_energy<'a>(&self, world: impl Into<WorldRef<'a>>) -> PotentialEnergy {
        self.pipeline
            .potential_energy(&self.definition(), &self.state, world.into())
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
    /// let fields = Fields::new(wind.replace_union(lee))?;
    /// let why = fields.explain(body, &world).unwrap();
    /// assert_eq!(why.contributions[0].overruled_by, ["field `lee`"]);
    /// println!("{why}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn explain<'a>(
        &self,
        body: RigidBodyHandle,
        world: impl Into<WorldRef<'a>>,
    ) -> Option<Explanation> {
        self.pipeline
            .explain(&self.definition(), &self.state, world.into(), body)
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
    #[must_use]
    pub fn audit(&self) -> Option<&EnergyAudit> {
        self.settings.audit.then_some(&self.state.audit)
    }

    /// The contacts of the last step, with the impulses that answered them: with swept detection
    /// first the touches in it, in the order of time; then overlaps at its end, in the order of the
    /// colliders' handles.
    #[must_use]
    pub fn contacts(&self) -> &[FieldContact] {
        self.pipeline.contacts()
    }

    /// The cross-check with Rapier so far, if it is on.
    #[must_use]
    pub fn cross_check(&self) -> Option<&CrossCheckReport> {
        self.settings
            .cross_check
            .on
            .then_some(&self.state.cross_check)
    }

    /// The composite field at some points of the world as it is now: the force on a resting point of
    /// unit mass and no charge, whether any field is defined there, and which count. Fields that
    /// hang on bodies act at all points, those on these bodies, too.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let world = PhysicsWorld::new();
    /// let wind = Field::uniform(Vector::X).within(Region::ball(1.0)).named("wind");
    /// let fields = Fields::new(wind)?;
    /// let values = fields.at(&[Vector::ZERO, Vector::X * 5.0], &world);
    /// assert_eq!((values[0].force, &values[0].fields[..]), (Vector::X, &["field `wind`".into()][..]));
    /// assert!(!values[1].is_defined);
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn at<'a>(
        &self,
        world_points: &[Vector],
        world: impl Into<WorldRef<'a>>,
    ) -> Vec<FieldValue> {
        self.pipeline
            .at(&self.definition(), &self.state, world.into(), world_points)
    }

    /// The fields that are defined nowhere because what they were anchored to is not in the world,
    /// as the errors that a first step would give.
    pub fn removed_anchors<'a>(&self, world: impl Into<WorldRef<'a>>) -> Vec<StepError> {
        self.pipeline
            .removed_anchors(&self.definition(), world.into())
    }
}
