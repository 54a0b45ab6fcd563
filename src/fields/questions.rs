//! Queries: the fields in the present world, the last step, and the reports kept over steps.

use super::Fields;
use crate::bridge::{StepError, WorldRef};
use crate::compile::Plan;
use crate::contact::{ContactPlan, FieldContact};
use crate::cross_check::CrossCheckReport;
use crate::diagnose::{EnergyAudit, Explanation};
use crate::eval::PotentialEnergy;
use crate::field::Query;
use crate::integrate::{StepWarning, Stiffness};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::pipeline::{BodySample, FieldValue, StepTimings, value_of};
use crate::rigid::Wrench;

impl Fields {
    /// The way of evaluation chosen for each field; its `Display` is a short report.
    pub fn plan(&self) -> Plan {
        self.pipeline.plan(&self.set)
    }

    /// The pairs of shapes among the colliders of a world that detection fields watch, and the precision with which
    /// they find contacts; its `Display` is a short report.
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

    /// The time that each stage of the last step took; empty unless it is [measured](Self::set_timed). Stages that a
    /// scene does not need are absent. Its `Display` is a short report.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// use rapier3d_fields::pipeline::StepStage;
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

    /// Turns the measurement of stages on or off, from the next step on. If it is off, no clock is read.
    pub fn set_timed(&mut self, on: bool) {
        self.pipeline.set_timed(on);
    }

    /// The simulated time: the sum of all steps since zero, or since it was [set](crate::pipeline::FieldState::set_time).
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// The wrench of the fields on a body in the last step, in world axes; `None` if the body was not sampled.
    #[must_use]
    pub fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.pipeline.last_wrench(&self.state, body)
    }

    /// The points at which a body is sampled in the present world, for any of the fields: for drawing, and for
    /// comparison with the [reference](crate::reference).
    pub fn samples<'a>(
        &self,
        body: RigidBodyHandle,
        world: impl Into<WorldRef<'a>>,
    ) -> Vec<BodySample> {
        self.pipeline
            .samples(&self.definition(), &self.state, world.into(), body)
    }

    /// The wrench of the fields on a body in the present world, which need not have been stepped; `None` for a body
    /// that fields do not move. A change of velocity counts as the force that makes it in one unit of time. It
    /// evaluates all bodies, so it costs as much as the evaluation in a step.
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

    /// The wrenches of the fields on all bodies that they move, as at the start of a step of `dt` in the present world,
    /// in the order of the bodies' handles.
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

    /// Possible errors of the last step: fields too stiff for the scheme and the time step (only the worst body),
    /// velocities that Rapier limited, and bodies to which fields gave forces that Rapier cannot take. Empty if there
    /// are none.
    #[must_use]
    pub fn warnings(&self) -> &[StepWarning] {
        self.pipeline.warnings()
    }

    /// The stiffness of the fields for a body in steps of `dt`, in the present world; `None` for a body that fields do
    /// not move. It evaluates all bodies, and this one with derivatives.
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

    /// The potential energy of all bodies in the fields, at their present poses: its `total`, and the number of fields
    /// that have none.
    pub fn potential_energy<'a>(&self, world: impl Into<WorldRef<'a>>) -> PotentialEnergy {
        self.pipeline
            .potential_energy(&self.definition(), &self.state, world.into())
    }

    /// The reasons for the wrench on a body in the present world: the force of each field except contact fields, the
    /// fields that overrule it, and the resulting wrench. `None` for a body that fields cannot move.
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

    /// The energy audit, if it is on: the potential and work of each field since it began, and the unexplained drift.
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

    /// The contacts of the last step, with the impulses that answered them. With swept detection the touches within the
    /// step come first, in the order of time; then overlaps at its end, in the order of the colliders' handles.
    #[must_use]
    pub fn contacts(&self) -> &[FieldContact] {
        self.pipeline.contacts()
    }

    /// The report of the cross-check with Rapier, if it is on.
    #[must_use]
    pub fn cross_check(&self) -> Option<&CrossCheckReport> {
        self.settings
            .cross_check
            .on
            .then_some(&self.state.cross_check)
    }

    /// The composite field at some points of the present world: the force on a resting point of unit mass without
    /// charge, whether any field is defined there, and the fields that count. Fields anchored to bodies act at all
    /// points, including points on these bodies.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let world = PhysicsWorld::new();
    /// let wind = Field::uniform(Vector::X).within(Region::ball(1.0)).named("wind");
    /// let fields = Fields::new(wind)?;
    /// let values = fields.values_at(&[Vector::ZERO, Vector::X * 5.0], &world);
    /// assert_eq!(values[0].force, Vector::X);
    /// assert_eq!(values[0].fields, ["field `wind`"]);
    /// assert!(!values[1].is_defined);
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn values_at<'a>(
        &self,
        world_points: &[Vector],
        world: impl Into<WorldRef<'a>>,
    ) -> Vec<FieldValue> {
        self.pipeline
            .values_at(&self.definition(), &self.state, world.into(), world_points)
    }

    /// The composite field at a sample with a velocity, a charge, other properties, or touches. A
    /// [contact](crate::Field::contact) field with one of the paper's laws gives the force that makes its change of
    /// velocity within the sample's `dt`. The time is that of the sample, not [that of the fields](Self::time). Fields
    /// anchored to the body of the sample do not act.
    ///
    /// ```
    /// use rapier3d_fields::field::{Query, Touch};
    /// use rapier3d_fields::math::DVec3;
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// let (_, ball) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(1.0));
    /// let fields = Fields::new(Field::contact(ContactLaw::Paper).at(ball))?;
    /// let touch = Touch { collider: ball, world_normal: DVec3::Y, speed: 3.0, approach_speed: 3.0 };
    /// let mut sample = Query { world_point: DVec3::Y * 1.5, mass: 2.0, dt: 0.5, ..Query::default() };
    /// assert_eq!(fields.value_for(&sample, &world).force, Vector::ZERO);
    /// sample.touches.push(touch);
    /// assert_eq!(fields.value_for(&sample, &world).force, Vector::Y * (2.0 * 3.0 / 0.5));
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn value_for<'a>(&self, sample: &Query, world: impl Into<WorldRef<'a>>) -> FieldValue {
        value_of(&self.set, &world.into(), sample)
    }

    /// The fields that are defined nowhere because their anchors are not in the world, as the errors that a first step
    /// would return.
    pub fn removed_anchors<'a>(&self, world: impl Into<WorldRef<'a>>) -> Vec<StepError> {
        self.pipeline
            .removed_anchors(&self.definition(), world.into())
    }
}
