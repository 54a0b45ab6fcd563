//! Eight bodies in columns, and the kicks that forces at their centres of mass, gravity, the user's forces and damping
//! give them.

use crate::eval::{CentreBlock, CentreForce, TOGETHER, in_lane, widened};
use crate::integrate::{Before, FASTEST, FreeMotion, FreeMotions, Loaded};
use crate::math::{Real, RigidBodyHandle, Vector, from_f64, to_f64};
use crate::number::{LaneMask, Lanes, Plain, Vec3, each_lane, in_registers};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::{Body, PartsMark, world_com};

/// One vector for each body, by axes.
pub(super) type Columns = [[Real; TOGETHER]; 3];

/// Bodies that are evaluated and kicked together. Entries after the last body are left from earlier blocks.
#[derive(Debug)]
pub(crate) struct BodyBlock {
    pub(super) seen: CentreBlock,
    pub(super) inv_masses: Columns,
    pub(super) parts: [PartsMark; TOGETHER],
    /// The places of the bodies in the previous evaluation.
    pub(super) known: [Option<usize>; TOGETHER],
    /// One bit for each body that gravity, the user's force or damping also moves, and the motion by these causes.
    pub(super) falling: u64,
    pub(super) free: [FreeMotion; TOGETHER],
    /// One bit for each body whose first half of a kick contained these causes.
    pub(super) completed: u64,
    /// One bit for each body that needs a kick of its own, and these bodies, in their order.
    pub(super) special: u64,
    /// Bodies that may be too far from the origin.
    pub(super) far: u64,
    pub(super) specials: Vec<Special>,
    /// All bodies so far that are about to fall asleep.
    pub(super) drowsy: Vec<Body>,
}

impl Default for BodyBlock {
    fn default() -> Self {
        BodyBlock {
            seen: CentreBlock::default(),
            inv_masses: Columns::default(),
            parts: Default::default(),
            known: [None; TOGETHER],
            falling: 0,
            free: [FreeMotion::NONE; TOGETHER],
            completed: 0,
            special: 0,
            far: 0,
            specials: Vec::new(),
            drowsy: Vec::new(),
        }
    }
}

/// The way of a body since the last evaluation.
pub(super) struct LastWay {
    /// The place of the body in its block.
    pub lane: usize,
    pub way: Vector,
    /// The change of the force, and the force at the end.
    pub change: Vector,
    pub force: Vector,
    /// The length of the step.
    pub dt: Real,
}

/// A body that needs a kick of its own.
#[derive(Debug)]
pub(super) struct Special {
    pub body: Body,
    pub before: Before,
    /// Its load in the last step.
    pub loaded: Option<Loaded>,
}

/// The rules by which a block is kicked.
pub(super) struct KickRules {
    /// The time for which forces act.
    pub duration: Real,
    /// True if forces may depend on velocities.
    pub slows: bool,
    /// True before Rapier's step.
    pub first: bool,
    /// The speed that Rapier allows.
    pub cap: Real,
}

/// The motion of the bodies of a block that are not special; the masks have one bit for each body.
pub(super) struct Kicked {
    /// Forces, rounded to Rapier's precision.
    pub forces: Columns,
    /// The velocities at which the bodies move.
    pub linvels: Columns,
    /// Bodies on which a force acts, or would act at another velocity.
    pub pushed: u64,
    /// Bodies whose forces are finite.
    pub finite: u64,
    /// Bodies whose velocities can be given to Rapier.
    pub sound: u64,
    /// Bodies that may be faster than Rapier allows.
    pub fast: u64,
}

impl BodyBlock {
    pub(super) fn clear(&mut self) {
        self.seen.count = 0;
        (self.falling, self.completed, self.special, self.far) = (0, 0, 0, 0);
        self.specials.clear();
    }

    /// Adds a body that moves at `linvel`.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        free: FreeMotion,
        linvel: Vector,
    ) {
        let seen = &mut self.seen;
        let lane = seen.count % TOGETHER;
        let inv_mass = body.mass_properties().effective_inv_mass;
        let world_com = world_com(body);
        seen.bodies[lane] = handle;
        seen.masses[lane] = body.mass();
        self.parts[lane] = PartsMark::of(body);
        self.free[lane] = free;
        for axis in 0..3 {
            seen.world_coms[axis][lane] = world_com[axis];
            seen.linvels[axis][lane] = linvel[axis];
            self.inv_masses[axis][lane] = inv_mass[axis];
        }
        seen.count += 1;
    }

    /// One bit for each body.
    pub(super) fn all(&self) -> u64 {
        (1 << self.seen.count) - 1
    }

    /// One bit for each body that is not in the previous evaluation.
    pub(super) fn unknown(&self) -> u64 {
        self.all() & mask(|lane| self.known[lane].is_none())
    }

    /// The vectors of all bodies.
    pub(super) fn each<'a>(
        &self,
        columns: &'a Columns,
    ) -> impl ExactSizeIterator<Item = Vector> + 'a {
        (0..self.seen.count).map(|lane| in_lane(columns, lane))
    }

    /// Kicks all bodies, with the causes other than fields for those that fall.
    pub(super) fn kick(&self, felt: &CentreForce, kick: &KickRules) -> Kicked {
        let acting = if kick.first {
            self.falling
        } else {
            self.falling & self.completed
        };
        in_registers(
            #[inline(always)]
            || {
                let force = felt.force;
                let zero = force.x.equals(0.0) & force.y.equals(0.0) & force.z.equals(0.0);
                let forces = rounded(force);
                let time = kick.duration;
                let causes = FreeMotions::new(&self.free, |lane| acting >> lane & 1 == 1);
                let (was, inv_masses) = (&self.seen.linvels, &self.inv_masses);
                let linvels = if kick.slows {
                    let (was, inv_masses) = (widened(was), widened(inv_masses));
                    rounded(causes.slowed(was, inv_masses, felt, to_f64(time)))
                } else {
                    causes.kicked(was, &forces, inv_masses, time)
                };
                let (strongest, most) = (largest(&forces), largest(&linvels));
                // A vector is no longer than √3 times its largest component.
                let quick = kick.cap * 0.5;
                Kicked {
                    pushed: (!(zero & felt.slowing.is_none())).bits(),
                    finite: mask(|lane| strongest[lane] < Real::INFINITY),
                    sound: mask(|lane| most[lane] <= FASTEST * 0.5),
                    fast: mask(|lane| most[lane] > quick),
                    forces,
                    linvels,
                }
            },
        )
    }

    /// For each share, one bit for each body whose force changed so much that it would move within a step by more than
    /// this share of its way. Shares and ways are compared by their squares.
    pub(super) fn swings<const N: usize>(
        &self,
        changes: &Columns,
        ways: &Columns,
        dt: Real,
        shares2: [Real; N],
    ) -> [u64; N] {
        in_registers(
            #[inline(always)]
            || {
                let per_force = each_lane(|lane| dt * dt / self.seen.masses[lane]);
                let swing2 = squares(changes, &per_force);
                let way2 = squares(ways, &[1.0; TOGETHER]);
                shares2.map(|share2| mask(|lane| swing2[lane] > share2 * way2[lane]))
            },
        )
    }
}

/// Vectors rounded to Rapier's precision.
#[inline(always)]
pub(super) fn rounded(vectors: Vec3<Lanes>) -> Columns {
    let each = |of: Lanes| each_lane(|lane| from_f64(of.0[lane]));
    [each(vectors.x), each(vectors.y), each(vectors.z)]
}

/// The largest component of each vector; NaN or infinite if any is.
#[inline(always)]
fn largest([x, y, z]: &Columns) -> [Real; TOGETHER] {
    each_lane(|lane| {
        let (x, y, z) = (x[lane].abs(), y[lane].abs(), z[lane].abs());
        let most = if x > y { x } else { y };
        let most = if most > z { most } else { z };
        // The products are zero, or NaN.
        most + x * 0.0 + y * 0.0 + z * 0.0
    })
}

/// The square of the length of each vector times a factor.
#[inline(always)]
fn squares([x, y, z]: &Columns, factors: &[Real; TOGETHER]) -> [Real; TOGETHER] {
    each_lane(|lane| {
        let factor = factors[lane];
        let (x, y, z) = (x[lane] * factor, y[lane] * factor, z[lane] * factor);
        x * x + y * y + z * z
    })
}

#[inline(always)]
fn mask(is_set: impl Fn(usize) -> bool) -> u64 {
    LaneMask::from_fn(is_set).bits()
}
