//! Constructors of fields, at least one for each kind of formula.

use std::sync::Arc;

use super::axis::Axis;
use super::closure::Closure;
use super::contact::ContactLaw;
#[cfg(feature = "expression")]
use super::formula::Expression;
use super::formula::{
    Buoyancy, Drag, Formula, Grid, LinearKernel, Magnetic, Path, Profile, Radial, Spring, Swirl,
    Turbulence, Uniform,
};
use super::leaf::{Coupling, Field, ForceMode};
use super::query::Sample;
use super::region::Region;
use crate::math::{Real, Vector};

/// Fields of each formula. In each, `d` is the distance vector from the origin of the field's frame, and `r`
/// its length. `assets/formulas.svg` in the repository shows them all, and the crate page has them in a table.
impl Field {
    /// The same vector everywhere, in the field's frame: a force, unless its [mode](Self::force_mode) is changed.
    pub fn uniform(vector: Vector) -> Self {
        Self::new(Formula::Uniform(Uniform { vector }))
    }

    /// Along the line through the field's origin: `strength` · rᵖᵒʷᵉʳ, positive outward.
    pub fn radial(strength: Real, power: Real) -> Self {
        Self::from_profile(Profile::Power {
            strength,
            power,
            softening: 0.0,
        })
    }

    /// The gravity of a point mass, an acceleration of `mu`/r² towards the field's origin.
    ///
    /// `mu` = G M, in length³/time². Singular at the origin unless [softened](Self::softened).
    pub fn point_gravity(mu: Real) -> Self {
        Self::radial(-mu, -2.0).force_mode(ForceMode::Acceleration)
    }

    /// The electric force of a point charge, `constant` · `charge` · (charge of the sample) / r².
    ///
    /// Coupled to [`Axis::Charge`]. `constant` is 1/4πε₀ in the units of the world
    /// (8.98755e9 N m²/C², or 138935.458 amu Å³ ps⁻² e⁻²).
    pub fn coulomb(constant: Real, charge: Real) -> Self {
        Self::radial(constant * charge, -2.0).coupled_to(Coupling::Axis(Axis::Charge))
    }

    /// The Lennard-Jones force of potential 4 ε ((σ/r)¹² − (σ/r)⁶), on [each](Coupling::Each)
    /// sample.
    pub fn lennard_jones(epsilon: Real, sigma: Real) -> Self {
        Self::from_profile(Profile::LennardJones { epsilon, sigma }).coupled_to(Coupling::Each)
    }

    /// A spring to the field's origin: −`stiffness` · d, for the distance vector d.
    pub fn spring(stiffness: Real) -> Self {
        Self::spring_damper(stiffness, 0.0, 0.0)
    }

    /// A spring to the field's origin with a rest length, and damping of the velocity relative
    /// to the field's frame.
    pub fn spring_damper(stiffness: Real, damping: Real, rest_length: Real) -> Self {
        Self::new(Formula::Spring(Spring {
            stiffness,
            damping,
            rest_length,
        }))
    }

    /// Drag −(`linear` + `quadratic` |v|) v, for the velocity v relative to the field's frame.
    pub fn drag(linear: Real, quadratic: Real) -> Self {
        Self::new(Formula::Drag(Drag { linear, quadratic }))
    }

    /// The magnetic part of the Lorentz force, q v × B, coupled to [`Axis::Charge`].
    pub fn magnetic(field: Vector) -> Self {
        Self::new(Formula::Magnetic(Magnetic { field })).coupled_to(Coupling::Axis(Axis::Charge))
    }

    /// A function of the user's, from the sample in the field's frame to a vector in that frame.
    ///
    /// `reads` lists the axes whose values are in [`Sample::axes`]; for a function of the velocity it must include
    /// [`Axis::Speed`]. The function must depend on nothing but the sample.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let pulse = Field::closure([Axis::Time], |sample: &Sample| Vector::Y * sample.axes[0].sin());
    /// ```
    pub fn closure(
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Vector + Send + Sync + 'static,
    ) -> Self {
        Self::new(Formula::Closure(Closure::new(None, reads, function)))
    }

    /// Like [`closure`](Self::closure), with a name under which it can be saved; see
    /// [`Registry`](super::Registry).
    pub fn closure_named(
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Vector + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        Self::new(Formula::Closure(closure))
    }

    /// A screened charge, of potential `strength` exp(−r/`screening`)/r (Yukawa), on
    /// [each](Coupling::Each) sample.
    pub fn yukawa(strength: Real, screening: Real) -> Self {
        let profile = Profile::Yukawa {
            strength,
            screening,
        };
        Self::from_profile(profile).coupled_to(Coupling::Each)
    }

    /// A bond, of potential `depth` ((1 − exp(−`stiffness` (r − `rest_length`)))² − 1) (Morse), on
    /// [each](Coupling::Each) sample.
    pub fn morse(depth: Real, stiffness: Real, rest_length: Real) -> Self {
        let profile = Profile::Morse {
            depth,
            stiffness,
            rest_length,
        };
        Self::from_profile(profile).coupled_to(Coupling::Each)
    }

    /// A smooth hill, of potential `height` exp(−r²/2 `width`²); a well if `height` is negative.
    pub fn gaussian(height: Real, width: Real) -> Self {
        Self::from_profile(Profile::Gaussian { height, width })
    }

    /// Elastic balls pressed together: `stiffness` (`diameter` − r)^{3/2} outward for
    /// r < `diameter` (Hertz), on [each](Coupling::Each) sample.
    pub fn hertz(stiffness: Real, diameter: Real) -> Self {
        let profile = Profile::Hertz {
            stiffness,
            diameter,
        };
        Self::from_profile(profile).coupled_to(Coupling::Each)
    }

    /// The velocity of a rigid body that turns around the y axis of the field's frame at `rate`: `rate` · ŷ × d.
    pub fn spin(rate: Real) -> Self {
        Self::vortex(rate, 1.0)
    }

    /// Around the y axis of the field's frame: `strength` · ρᵖᵒʷᵉʳ at the distance ρ from it,
    /// right-handed about +y. The power −1 is a free vortex, singular on the axis unless
    /// [smoothed](Self::smoothed).
    pub fn vortex(strength: Real, power: Real) -> Self {
        Self::swirl(Swirl {
            around: strength,
            inward: 0.0,
            along: 0.0,
            power,
            core: 0.0,
        })
    }

    /// Around, towards and along the y axis of the field's frame.
    pub fn swirl(swirl: Swirl) -> Self {
        Self::new(Formula::Swirl(swirl))
    }

    /// A force of `strength` along the y axis of the field's frame, and of `inward` towards it. As rising air, which
    /// carries bodies no faster than itself: `Field::updraft(…).as_wind(…)`.
    pub fn updraft(strength: Real, inward: Real) -> Self {
        Self::swirl(Swirl {
            around: 0.0,
            inward,
            along: strength,
            power: 0.0,
            core: 0.0,
        })
    }

    /// Drag in a wind of this velocity in the field's frame: the same as
    /// `Field::uniform(velocity).as_wind(linear, quadratic)`. Its coefficients are those of a whole body, whatever its
    /// size; the surface tells only how the force is distributed.
    pub fn wind(velocity: Vector, linear: Real, quadratic: Real) -> Self {
        Self::uniform(velocity).as_wind(linear, quadratic)
    }

    /// The weight of the displaced fluid: a fluid of this density below y = 0 of the field's
    /// frame, under this acceleration of gravity. On [each](Coupling::Each) sample by its volume;
    /// half-submerged parts count in part. Gravity itself is not included.
    pub fn buoyancy(density: Real, gravity: Real) -> Self {
        Self::new(Formula::Buoyancy(Buoyancy { density, gravity })).coupled_to(Coupling::Each)
    }

    /// A random flow without sources. As a wind: `Field::turbulence(…).as_wind(…)`.
    ///
    /// ```
    /// use rapier3d_fields::{field::Turbulence, prelude::*};
    /// let eddies = Turbulence::new(7, 4.0, 10.0).turnover(0.5);
    /// let gusts = Field::turbulence(eddies).as_wind(0.1, 0.0);
    /// # let _ = gusts;
    /// ```
    pub fn turbulence(turbulence: Turbulence) -> Self {
        Self::new(Formula::Turbulence(Arc::new(turbulence)))
    }

    /// Towards and along a path.
    ///
    /// ```
    /// use rapier3d_fields::{field::Path, prelude::*};
    /// let corners = [Vector::ZERO, Vector::X * 10.0, Vector::new(10.0, 0.0, 10.0)];
    /// let lane = Path::new(corners, true).stiffness(4.0).damping(4.0, 2.0).look_ahead(0.5);
    /// let field = Field::path(lane);
    /// # let _ = field;
    /// ```
    pub fn path(path: Path) -> Self {
        Self::new(Formula::Path(Arc::new(path)))
    }

    /// Vectors on a regular grid, within its bounds.
    pub fn grid(grid: Grid) -> Self {
        let middle = (grid.low + grid.high) * 0.5;
        let region = Region::cuboid((grid.high - grid.low) * 0.5).at(middle);
        Self::new(Formula::Grid(Arc::new(grid))).within(region)
    }

    /// The linear kernel of PhysX 2.8: drag, wind, spring and vortex in one.
    pub fn linear_kernel(kernel: LinearKernel) -> Self {
        Self::new(Formula::LinearKernel(Box::new(kernel)))
    }

    /// Three expressions, given as text; see [`Expression`].
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let swing = Field::expression(["-4 * x", "sin(2 * time)", "-0.1 * vz"]);
    /// assert!(Fields::new(swing).is_ok());
    /// assert!(Fields::new(Field::expression(["-4 * (x", "0", "0"])).is_err());
    /// ```
    #[cfg(feature = "expression")]
    pub fn expression(components: [&str; 3]) -> Self {
        Self::new(Formula::Expression(Arc::new(Expression::new(components))))
    }

    /// A detection field (§3.3): applies a law to parts that touch the collider it is anchored to, or in a prototype
    /// the colliders of its [instances](crate::Tree::instances).
    ///
    /// With the paper's laws it is a vector field like any other: a change of velocity (m/s) at the middle of a
    /// touching part, and zero at other parts. Operators, strength, scales and limits act on it as on any
    /// vector; the part gets the change that the touch makes to the composite. The other laws act on both parts at
    /// once: for these, operators decide only whether the field acts.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # let (_, ball) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    /// // Bodies that touch the ball are pushed sideways: across its vertical.
    /// let push = Field::contact(ContactLaw::Paper).at(ball);
    /// let fields = Fields::new(push.cross_union(Field::uniform(Vector::Y)));
    /// # fields?;
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn contact(law: ContactLaw) -> Self {
        Self::new(Formula::Contact(law))
    }

    fn from_profile(profile: Profile) -> Self {
        Self::new(Formula::Radial(Radial::new(profile)))
    }
}
