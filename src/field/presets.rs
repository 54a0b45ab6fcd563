//! Fields under the names that users of other engines look for. Each consists of public constructors and
//! setters.

use super::anchor::Anchor;
use super::formula::LinearKernel;
use super::leaf::{Field, ForceMode};
use super::lifetime::Lifetime;
use super::region::Region;
use super::sampling::Sampling;
use super::scalar::Scalar;
use super::tree::Tree;
use crate::math::{Real, Vector};

/// Fields for games. Like other fields they can be scaled, restricted by [`within`](Self::within) and
/// [`groups`](Self::groups), anchored by [`at`](Self::at), and combined by operators.
///
/// See also [`point_gravity`](Self::point_gravity), [`wind`](Self::wind), [`vortex`](Self::vortex),
/// [`updraft`](Self::updraft) and [`turbulence`](Self::turbulence).
impl Field {
    /// A zone with a gravity of its own: an acceleration, the same for all bodies in the region. Of a body that is
    /// partly in the region, only that part is accelerated.
    ///
    /// It adds to the gravity of the world, which fields do not read. To replace the world's gravity in the zone, set
    /// `world.gravity` to zero and make it a field, too:
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let ball = |x| RigidBodyBuilder::dynamic().translation(Vector::X * x);
    /// let (inside, _) = world.insert(ball(0.0), ColliderBuilder::ball(0.5));
    /// let (outside, _) = world.insert(ball(9.0), ColliderBuilder::ball(0.5));
    ///
    /// let earth = Field::gravity_zone(-Vector::Y * 9.81, Region::everywhere());
    /// let lift = Field::gravity_zone(Vector::Y * 2.0, Region::cuboid(Vector::splat(3.0)));
    /// let mut fields = Fields::new(earth.replace_union(lift))?;
    /// fields.step(&mut world)?;
    /// assert!(world.bodies[inside].linvel().y > 0.0);
    /// assert!(world.bodies[outside].linvel().y < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("area", "gravity volume", "gravity region"))]
    pub fn gravity_zone(acceleration: Vector, region: Region) -> Self {
        Self::uniform(acceleration)
            .force_mode(ForceMode::Acceleration)
            .within(region)
    }

    /// Wind in a region: [`wind`](Self::wind) of this velocity, which accelerates slower bodies and slows
    /// faster ones.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let (leaf, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.1));
    ///
    /// let gale = Field::wind_zone(Vector::X * 12.0, 0.1, 0.0, Region::ball(100.0));
    /// let mut fields = Fields::new(gale)?;
    /// for _ in 0..120 {
    ///     fields.step(&mut world)?;
    /// }
    /// assert!((world.bodies[leaf].linvel() - Vector::X * 12.0).length() < 0.1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("area effector", "fan", "air"))]
    pub fn wind_zone(velocity: Vector, linear: Real, quadratic: Real, region: Region) -> Self {
        Self::wind(velocity, linear, quadratic).within(region)
    }

    /// A conveyor belt: a body with its centre of mass in the region is brought to this velocity along the
    /// belt, and not changed across it.
    ///
    /// `grip` is the rate at which the difference of the velocities decays, in 1/time. The region
    /// is the space above the belt, not the belt.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let belt = ColliderBuilder::cuboid(50.0, 0.5, 1.0).friction(0.0);
    /// world.insert(RigidBodyBuilder::fixed(), belt);
    /// let parcel = RigidBodyBuilder::dynamic().translation(Vector::Y);
    /// let (parcel, _) = world.insert(parcel, ColliderBuilder::cuboid(0.5, 0.5, 0.5).friction(0.0));
    ///
    /// let above = Region::cuboid(Vector::new(50.0, 1.0, 1.0));
    /// let belt = Field::conveyor(Vector::X * 2.0, 4.0, above).at(Vector::Y * 1.5);
    /// let mut fields = Fields::new(belt)?;
    /// for _ in 0..120 {
    ///     fields.step(&mut world)?;
    /// }
    /// assert!((world.bodies[parcel].linvel().x - 2.0).abs() < 0.01);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("belt", "surface effector", "surface velocity"))]
    pub fn conveyor(velocity: Vector, grip: Real, region: Region) -> Self {
        let along = velocity.normalize_or_zero();
        let kernel = LinearKernel {
            velocity_target: velocity,
            velocity_multiplier: along.to_array().map(|component| along * (component * grip)),
            ..LinearKernel::default()
        };
        Self::linear_kernel(kernel)
            .force_mode(ForceMode::Acceleration)
            .within(region)
            .sampled(Sampling::Centre)
    }

    /// A magnet: pulls everything within `reach` with a force of `strength` / r², which stays
    /// finite because it is softened over the length `size`. A negative strength repels.
    ///
    /// [`groups`](Self::groups) restrict it to some colliders, and with [`reacting`](Self::reacting) a body that
    /// carries the magnet is pulled in turn.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let nail = |x| RigidBodyBuilder::dynamic().translation(Vector::X * x);
    /// let (near, _) = world.insert(nail(2.0), ColliderBuilder::ball(0.1));
    /// let (far, _) = world.insert(nail(8.0), ColliderBuilder::ball(0.1));
    ///
    /// let mut fields = Fields::new(Field::magnet(1.0, 0.5, 5.0))?;
    /// fields.step(&mut world)?;
    /// assert!(world.bodies[near].linvel().x < 0.0);
    /// assert_eq!(world.bodies[far].linvel(), Vector::ZERO);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("attractor", "point effector"))]
    pub fn magnet(strength: Real, size: Real, reach: Real) -> Self {
        Self::radial(-strength, -2.0)
            .softened(size)
            .within(Region::ball(reach))
    }

    /// An explosion: a change of velocity outward, whatever the mass, which falls linearly from `speed` in the middle
    /// to zero at `reach`. It acts for one step and is then removed from its [set](crate::FieldSet).
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let barrel = RigidBodyBuilder::dynamic().translation(Vector::X * 2.0);
    /// let (barrel, _) = world.insert(barrel, ColliderBuilder::ball(0.5));
    ///
    /// let mut fields = Fields::new(Field::explosion(10.0, 4.0))?;
    /// fields.step(&mut world)?;
    /// // 5 halfway out, and a little less while it moves within the step.
    /// assert!((world.bodies[barrel].linvel().x - 5.0).abs() < 0.1);
    /// assert!(fields.set.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("blast", "radial impulse"))]
    pub fn explosion(speed: Real, reach: Real) -> Self {
        Self::radial(speed, 0.0)
            .force_mode(ForceMode::VelocityChange)
            .scaled_by(Scalar::distance().ramp(reach, 0.0))
            .within(Region::ball(reach))
            .lifetime(Lifetime::steps(1))
    }
}

/// Composites for games.
impl Tree {
    /// A pool of a fluid: buoyancy and drag for the bodies in it. Gravity itself is not included.
    ///
    /// The middle of the surface is the origin of `frame`, and +y is up. The fluid fills
    /// `half_extents.x` and `half_extents.z` to either side, and 2 `half_extents.y` downward.
    /// `density` is that of the fluid, `gravity` the acceleration of gravity downward, not negative. `drag` is the rate
    /// at which velocities decay in the fluid, in 1/time; the part of a body above the surface has no drag.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let light = ColliderBuilder::cuboid(0.5, 0.5, 0.5).density(500.0);
    /// let heavy = ColliderBuilder::cuboid(0.5, 0.5, 0.5).density(4000.0);
    /// let at = |x: Real| RigidBodyBuilder::dynamic().translation(Vector::X * x);
    /// let (cork, _) = world.insert(at(-3.0), light);
    /// let (stone, _) = world.insert(at(3.0), heavy);
    ///
    /// let water = Tree::pool(Vector::Y, Vector::new(10.0, 50.0, 10.0), 1000.0, 9.81, 5.0);
    /// let mut fields = Fields::new(water)?;
    /// for _ in 0..600 {
    ///     fields.step(&mut world)?;
    /// }
    /// // Half of the cork is in the water, whose surface is at y = 1.
    /// assert!((world.bodies[cork].translation().y - 1.0).abs() < 0.01);
    /// assert!(world.bodies[stone].translation().y < -5.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias("water", "buoyancy effector", "swimming"))]
    pub fn pool(
        frame: impl Into<Anchor>,
        half_extents: Vector,
        density: Real,
        gravity: Real,
        drag: Real,
    ) -> Self {
        let frame = frame.into();
        let down = -Vector::Y * half_extents.y;
        // Reaches above the surface, as the middle of a floating body may.
        let column = Region::cuboid(half_extents + Vector::Y * half_extents.y);
        let carried = Field::buoyancy(density, gravity).within(column).at(frame);
        let slowed = Field::drag(drag, 0.0)
            .force_mode(ForceMode::Acceleration)
            .within(Region::cuboid(half_extents).at(down))
            .sampled(Sampling::Volume)
            .at(frame);
        carried + slowed
    }
}
