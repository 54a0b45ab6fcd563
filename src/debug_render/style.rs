//! The colours, numbers of points and sizes.

use crate::field::FieldHandle;
use crate::math::{Real, Vector};
use crate::rapier::pipeline::DebugColor;

/// The angle between the hues of two fields that follow each other, in degrees: the golden angle, so that no two of the
/// first fields look alike.
const HUE_STEP: f64 = 137.508;

/// Colours, numbers of points and sizes of the [drawing](crate::debug_render::FieldDebugRenderPipeline) of fields. Colours are as in
/// Rapier: hue (degrees), saturation, lightness and alpha.
///
/// The *view* is a cube in world space, in which arrows and seeds of stream lines lie. By default it follows the
/// dynamic bodies. Give it a [centre](Self::centre) and a [size](Self::half_size) to keep it fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldDebugRenderStyle {
    /// The largest number of lines in one call. At this number the drawing stops, and
    /// [`limit_reached`](crate::debug_render::FieldDebugRenderOutcome::limit_reached) is set.
    pub max_lines: usize,
    /// The number of lines around a circle of an outline; clamped to 3 to 512.
    pub subdivisions: u32,

    /// The middle of the view, in world space. `None`: the mean of the centres of mass of all enabled dynamic bodies;
    /// without any, that of the places of all fields with a bounded region; or the origin.
    pub centre: Option<Vector>,
    /// Half the edge of the view. `None`: 1.25 times the distance of the farthest enabled dynamic body from the centre;
    /// where that is zero, the distance to the farthest end of a bounded region; or 5.
    pub half_size: Option<Real>,
    /// The direction across the slice, in world axes, of any length. The slice goes through the centre of the view.
    pub slice_normal: Vector,
    /// The number of arrows along each edge of the slice, at most 512; more are taken as 512.
    pub slice_points: u32,
    /// The number of arrows along each edge of the volume, at most 64; more are taken as 64.
    pub volume_points: u32,
    /// The length of an arrow of infinite magnitude, as a share of the distance between two neighbours.
    pub arrow_length: Real,
    /// The magnitude of the field (a force per unit of mass) at which an arrow has half of this length and the mean of
    /// the two colours. A magnitude m gives the share m / (m + half). `None`: the median of the magnitudes drawn.
    pub half_magnitude: Option<Real>,

    /// The points at which stream lines begin, in world space. If there are none, they begin on the slice.
    pub stream_seeds: Vec<Vector>,
    /// The number of stream lines along each edge of the slice, if there are no seeds; at most 64.
    pub stream_points: u32,
    /// The largest number of steps of a stream line. A stream line ends sooner where no field is defined, where the
    /// field is zero, infinite or NaN, and where it turns by more than a right angle within a step.
    pub stream_steps: u32,
    /// The length of one step of a stream line. `None`: a fiftieth of half the edge of the view.
    pub stream_step: Option<Real>,

    /// The length of the longest arrow of a force or torque on a body. `None`: 0.4 of half the edge of the view. Among
    /// bodies, lengths are compressed as those of the arrows of the field are.
    pub wrench_length: Option<Real>,
    /// The length of the normals of contacts. The arms of their crosses have a quarter of it, those of disagreements
    /// half.
    pub contact_normal_length: Real,

    /// The colour of regions. `None`: that of their [field](Self::field_color).
    pub region_color: Option<DebugColor>,
    /// The colour of solids that are cut away from a region.
    pub cut_color: DebugColor,
    /// The colour of arrows of small magnitude. Colours in between are mixed by component, including the hue.
    pub weak_color: DebugColor,
    /// The colour of arrows of large magnitude.
    pub strong_color: DebugColor,
    /// The colour of stream lines. They begin transparent and reach its alpha after 25 steps, which shows their
    /// direction.
    pub stream_color: DebugColor,
    /// The colour of forces on bodies.
    pub force_color: DebugColor,
    /// The colour of torques on bodies.
    pub torque_color: DebugColor,
    /// The colour of contacts.
    pub contact_color: DebugColor,
    /// The colour of disagreements with Rapier.
    pub disagreement_color: DebugColor,
}

impl FieldDebugRenderStyle {
    /// The colour of a field, which stays the same as long as the field is in its set: for legends.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// use rapier3d_fields::debug_render::FieldDebugRenderStyle;
    /// let set = FieldSet::from(Field::uniform(Vector::X).sum_union(Field::spring(4.0)));
    /// let colors: Vec<_> = set
    ///     .iter()
    ///     .map(|(handle, _)| FieldDebugRenderStyle::field_color(handle))
    ///     .collect();
    /// assert_ne!(colors[0], colors[1]);
    /// ```
    pub fn field_color(field: FieldHandle) -> DebugColor {
        let hue = (200.0 + HUE_STEP * f64::from(field.index)) % 360.0;
        [hue as f32, 0.75, 0.45, 1.0]
    }

    /// The colour of a share of the longest arrow, from 0 to 1.
    pub(super) fn strength_color(&self, share: Real) -> DebugColor {
        let [weak, strong] = [self.weak_color, self.strong_color];
        std::array::from_fn(|part| weak[part] + (strong[part] - weak[part]) * share as f32)
    }
}

impl Default for FieldDebugRenderStyle {
    fn default() -> Self {
        FieldDebugRenderStyle {
            max_lines: 50_000,
            subdivisions: 32,
            centre: None,
            half_size: None,
            slice_normal: Vector::Z,
            slice_points: 21,
            volume_points: 7,
            arrow_length: 1.0,
            half_magnitude: None,
            stream_seeds: Vec::new(),
            stream_points: 6,
            stream_steps: 200,
            stream_step: None,
            wrench_length: None,
            contact_normal_length: 0.3,
            region_color: None,
            cut_color: [0.0, 0.0, 0.55, 1.0],
            weak_color: [220.0, 0.7, 0.5, 1.0],
            strong_color: [0.0, 0.9, 0.45, 1.0],
            stream_color: [170.0, 0.8, 0.35, 1.0],
            force_color: [330.0, 0.9, 0.5, 1.0],
            torque_color: [280.0, 0.8, 0.55, 1.0],
            contact_color: [120.0, 1.0, 0.35, 1.0],
            disagreement_color: [0.0, 1.0, 0.5, 1.0],
        }
    }
}
