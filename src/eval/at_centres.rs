//! Evaluates fields that act at centres of mass, on eight bodies at a time and without a list of samples.

use super::constants::ConstantPull;
use super::frames::FrameCache;
use super::interpreter::{Interpreter, SampleContext};
use super::sampled_world::SampledWorld;
use super::simd::LaneForce;
use super::slowings::DragOn;
use crate::compile::{Compiled, Program, RadialBatch, Weighting};
use crate::field::{Coupling, ForceMode, Frames, Motion, Numbers, Queries};
use crate::math::{DVec3, InteractionGroups, Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::number::{
    LANES, LaneMask, Lanes, Number, Plain, Vec3, constant, in_registers, lanes_of,
};
use crate::rapier::na::{Matrix3, Vector3};
use crate::rigid::Slowing;
use crate::sample::{Moment, SamplePoint, Samples, owner};

/// The number of bodies that are evaluated together.
pub(crate) const TOGETHER: usize = LANES;

/// The forces of all fields on several bodies, in world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CentreForce {
    pub force: Vec3<Lanes>,
    /// The derivative by velocity of drag and wind, which are part of the force.
    pub slowing: Slowing<Lanes>,
}

/// Up to eight bodies, in columns. Entries after the last body are left from earlier blocks.
#[derive(Clone, Debug)]
pub(crate) struct CentreBlock {
    pub count: usize,
    pub bodies: [RigidBodyHandle; TOGETHER],
    /// Centres of mass.
    pub world_coms: [[Real; TOGETHER]; 3],
    pub linvels: [[Real; TOGETHER]; 3],
    pub masses: [Real; TOGETHER],
}

impl Default for CentreBlock {
    fn default() -> Self {
        CentreBlock {
            count: 0,
            bodies: [RigidBodyHandle::invalid(); TOGETHER],
            world_coms: [[0.0; TOGETHER]; 3],
            linvels: [[0.0; TOGETHER]; 3],
            masses: [1.0; TOGETHER],
        }
    }
}

/// The vector in one lane of columns of components.
#[inline(always)]
pub(crate) fn in_lane(columns: &[[Real; TOGETHER]; 3], lane: usize) -> Vector {
    let [x, y, z] = columns;
    Vector::new(x[lane], y[lane], z[lane])
}

/// Columns of components, widened to `f64`.
#[inline(always)]
pub(crate) fn widened([x, y, z]: &[[Real; TOGETHER]; 3]) -> Vec3<Lanes> {
    Vec3::new(lanes(x), lanes(y), lanes(z))
}

#[inline(always)]
fn lanes(column: &[Real; TOGETHER]) -> Lanes {
    Lanes::from_fn(|lane| to_f64(column[lane]))
}

impl CentreBlock {
    /// The properties of the bodies that fields read.
    #[inline(always)]
    fn queries(&self, moment: Moment) -> Queries {
        Queries {
            numbers: Numbers {
                time: moment.time,
                dt: to_f64(moment.dt),
                radius: 0.0.into(),
                mass: lanes(&self.masses),
                share: 1.0.into(),
                charge: 0.0.into(),
                fraction: 1.0.into(),
            },
            span: moment.span,
            bodies: self.bodies,
            groups: [InteractionGroups::all(); TOGETHER],
        }
    }

    /// A body of the block as a sample.
    fn sample(&self, lane: usize) -> SamplePoint {
        SamplePoint {
            world_point: in_lane(&self.world_coms, lane),
            velocity: in_lane(&self.linvels, lane),
            mass: self.masses[lane],
            ..SamplePoint::at_rest(0, owner(Some(self.bodies[lane])))
        }
    }
}

/// Evaluates a set that acts [at centres of mass](Compiled::at_centres). Keeps its buffers between calls.
#[derive(Debug)]
pub(crate) struct CentreEvaluator {
    frames: FrameCache,
    interpreter: Interpreter,
    moment: Moment,
    constants: ConstantPull,
    /// Samples without sites, with the handle of the one body that the interpreter evaluates.
    single: Samples,
}

impl Default for CentreEvaluator {
    fn default() -> Self {
        let moment = Moment::NEVER;
        CentreEvaluator {
            frames: FrameCache::default(),
            interpreter: Interpreter::default(),
            moment,
            constants: ConstantPull::of(&[], moment.dt),
            single: Samples::made_elsewhere(),
        }
    }
}

impl CentreEvaluator {
    /// Looks up the frames of all fields.
    pub(crate) fn begin(&mut self, compiled: &Compiled, world: &impl Frames, moment: Moment) {
        self.moment = moment;
        self.constants = ConstantPull::of(&compiled.constants, moment.dt);
        self.frames.clear(compiled);
        let scene = SampledWorld::new(compiled, world, &self.single, moment);
        for source in compiled.radials.iter().flat_map(|it| &it.1.sources) {
            self.frames.get(&scene, source.anchor);
        }
        for (_, program) in compiled.programs.iter() {
            self.frames.fill(&scene, program);
        }
    }

    /// The forces on the bodies of a block, with the fields at the places they had at [`begin`](Self::begin).
    pub(crate) fn forces(&mut self, compiled: &Compiled, block: &CentreBlock) -> CentreForce {
        let mut felt = in_registers(
            #[inline(always)]
            || CentreForce {
                force: self.sources(compiled, block),
                slowing: Slowing::none(),
            },
        );
        for (_, program) in compiled.programs.iter().filter(|it| it.1.has_force) {
            for instance in 0..program.instances.len() {
                self.add_program(program, instance, block, &mut felt);
            }
        }
        felt
    }

    /// Adds the forces of an instance of a program.
    fn add_program(
        &mut self,
        program: &Program,
        instance: usize,
        block: &CentreBlock,
        felt: &mut CentreForce,
    ) {
        let drag = DragOn::new(program, instance, self.moment);
        let doubtful = in_registers(
            #[inline(always)]
            || {
                let queries = block.queries(self.moment);
                let motion = Motion {
                    point: widened(&block.world_coms),
                    velocity: widened(&block.linvels),
                };
                let frames = self.frames.all();
                let place = SampleContext::new(program, instance, frames, &queries, &motion);
                let LaneForce {
                    force,
                    defined,
                    doubtful,
                } = place.in_lanes();
                felt.add(&queries.numbers, defined, force, drag.as_ref());
                doubtful.bits()
            },
        );
        for lane in lanes_of(doubtful & ((1 << block.count) - 1)) {
            self.single.bodies.clear();
            self.single.bodies.push(block.bodies[lane]);
            let query = self.single.query(&block.sample(lane), self.moment);
            let frames = self.frames.all();
            if let Some(force) = self.interpreter.force(program, instance, frames, &query) {
                let numbers = block.queries(self.moment).numbers;
                let there = LaneMask::from_fn(|other| other == lane);
                felt.add(&numbers, there, constant(force), drag.as_ref());
            }
        }
    }

    /// The forces of constants and radial fields.
    #[inline(always)]
    fn sources(&self, compiled: &Compiled, block: &CentreBlock) -> Vec3<Lanes> {
        let masses = lanes(&block.masses);
        let mut force = self.constants.on(masses, 1.0.into());
        let place = widened(&block.world_coms);
        let is_on = |batch: &RadialBatch| batch.prototype.is_on(self.moment.span);
        for (_, batch) in compiled.radials.iter().filter(|it| is_on(it.1)) {
            force += self.pulls(batch, place) * self.weight(&batch.weighting, masses);
        }
        force
    }

    /// The sum of the forces of a batch on bodies with a weight of one.
    #[inline(always)]
    fn pulls(&self, batch: &RadialBatch, place: Vec3<Lanes>) -> Vec3<Lanes> {
        let range2 = batch.range.map_or(f64::INFINITY, |it| to_f64(it).powi(2));
        let mut sum = Vec3::<Lanes>::zero();
        for source in &batch.sources {
            let Some(frame) = &self.frames.all()[source.anchor as usize] else {
                continue;
            };
            let way = place - to_dvec3(frame.pose.translation);
            let r2 = way.dot(way);
            let factor = batch.law.factor(r2) * to_f64(source.strength);
            sum += way * Lanes::select(r2.above(range2), 0.0.into(), factor);
        }
        sum
    }

    /// The factor from the vector of a field to its force on bodies of these masses.
    #[inline(always)]
    fn weight(&self, weighting: &Weighting, masses: Lanes) -> Lanes {
        let coupled = match &weighting.coupling {
            Coupling::Axis(_) => masses,
            Coupling::Share | Coupling::Each => 1.0.into(),
        };
        let whole = match weighting.mode {
            ForceMode::Force => coupled,
            ForceMode::Acceleration => coupled * masses,
            ForceMode::VelocityChange => coupled * masses / to_f64(self.moment.dt),
        };
        whole * weighting.lifetime().share_of(self.moment.span)
    }
}

impl CentreForce {
    /// The force on one body.
    pub(crate) fn force_in(&self, lane: usize) -> DVec3 {
        let Vec3 { x, y, z } = &self.force;
        DVec3::new(x.0[lane], y.0[lane], z.0[lane])
    }

    /// The derivative of the force on one body by its velocity.
    pub(crate) fn slope_in(&self, lane: usize) -> Matrix3<f64> {
        let Slowing {
            across,
            along,
            axis,
        } = &self.slowing;
        let axis = Vector3::new(axis.x.0[lane], axis.y.0[lane], axis.z.0[lane]);
        Matrix3::from_diagonal_element(-across.0[lane]) - axis * axis.transpose() * along.0[lane]
    }

    /// Adds a force in some lanes and, if it is a drag, its derivative by velocity.
    #[inline(always)]
    fn add(
        &mut self,
        numbers: &Numbers<Lanes>,
        there: LaneMask,
        force: Vec3<Lanes>,
        drag: Option<&DragOn>,
    ) {
        let zero = Lanes::from(0.0);
        let force = Vec3::select(there, force, Vec3::zero());
        self.force += force;
        if let Some(drag) = drag {
            let [mass, share] =
                [numbers.mass, numbers.share].map(|it| Lanes::select(there, it, zero));
            self.slowing.add(&drag.slowing(mass, share, force));
        }
    }
}
