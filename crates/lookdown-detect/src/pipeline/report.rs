//! The report on a frame: the persons found, and the models, views and times behind them.

use std::time::Duration;

use jiff::Timestamp;
use lookdown_calibration::warning::Warning;
use lookdown_lens::geometry::{
    FloorVotes, OrientedBox, PersonHeight, Pixel, Posture, Zone,
    floor::{Bearing, FloorPosition},
};

use crate::{
    detection::{BBox, FramePixels, RefinementParameters},
    inference::Model,
    parameters::{DefaultUsed, Profile},
};
use lookdown_imaging::lens_circle::LensCircle;

/// The persons in one frame.
#[derive(Debug, Clone)]
pub struct DetectionReport {
    /// The ID of the request in logs and responses.
    pub request_id: String,
    /// The camera of the frame: the name in the request, otherwise the ID of the calibration.
    pub camera: String,
    /// The arrival time of the request.
    pub received_at: Timestamp,
    /// The capture time of the frame, when the request gave it.
    pub captured_at: Option<Timestamp>,
    /// The calibration used.
    pub calibration: CalibrationUsed,
    /// Frame width after EXIF orientation, pixels.
    pub image_width: u32,
    /// Frame height after EXIF orientation, pixels.
    pub image_height: u32,
    /// The detector used.
    pub model: ModelUsed,
    /// The detector of the upright crops, when it is another one.
    pub crop_model: Option<ModelUsed>,
    /// The profile used.
    pub profile: Profile,
    /// The refinement used, with all its parameters.
    pub refinement: RefinementParameters,
    /// The parameters whose values were defaults of the calibration or the server.
    pub defaults: Vec<DefaultUsed>,
    /// Persons, highest score first.
    pub persons: Vec<Person>,
    /// The scores of all boxes from [`lookdown_tracking::taught::LEAST_SCORE`] on that would count
    /// as persons: those of `persons`, and those below the threshold. Frames whose persons are
    /// followed have the lower ones of the last search.
    pub scores: Vec<f32>,
    /// Persons in the margin of the areas, who do not count; `None` without areas.
    pub margin: Option<Vec<Person>>,
    /// The number of persons in each zone, in the order of the calibration.
    pub zones: Vec<ZoneCount>,
    /// The origin of the persons.
    pub search: Search,
    /// The numbers of views by outcome.
    pub views: ViewCounts,
    /// The number of inference batches.
    pub batch_count: usize,
    /// Candidates of the network dropped because one of their numbers was not finite.
    pub non_finite: usize,
    /// The time spent in each stage.
    pub timings: StageTimings,
    /// Circumstances that the caller should consider.
    pub warnings: Vec<Warning>,
}

/// The origin of the persons of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr, strum::VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Search {
    /// The views of the profile, and crops around possible persons.
    Full,
    /// Crops where the persons of the last frame were expected.
    Followed,
    /// The frames before: nothing had moved.
    Unchanged,
}

impl Search {
    /// Returns the name, as in reports and metrics.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The numbers of views of one frame by outcome.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ViewCounts {
    /// Views processed by the network.
    pub inferred: usize,
    /// Views without motion, whose detections come from the motion cache.
    pub unchanged: usize,
    /// Views outside the lens image.
    pub outside: usize,
    /// Views wholly hidden by the masks of the camera.
    pub masked: usize,
    /// Views that cannot show a person in an area of the camera.
    pub outside_areas: usize,
    /// Detail views where the other views show no possible person.
    pub not_needed: usize,
}

/// The calibration on which a report is based.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationUsed {
    /// The calibration's ID; `assumed` when none was named.
    pub id: String,
    /// The revision, which changes with the content of the calibration.
    pub revision: String,
    /// The lens circle from which the lens was assumed; `None` with a calibration.
    pub assumed_circle: Option<LensCircle>,
}

/// The number of persons in a zone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneCount {
    /// The zone's name.
    pub name: String,
    /// The number of persons in the zone. One person may be in several zones.
    pub persons: usize,
}

impl ZoneCount {
    /// Counts the persons in each zone.
    pub(super) fn for_zones(zones: &[Zone], persons: &[Person]) -> Vec<Self> {
        let count = |zone: &Zone| Self {
            name: zone.name.clone(),
            persons: persons
                .iter()
                .filter(|person| person.zones.iter().flatten().any(|name| *name == zone.name))
                .count(),
        };
        zones.iter().map(count).collect()
    }
}

/// The detector on which a report is based.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelUsed {
    /// The model's name.
    pub name: String,
    /// The revision, which changes with the weights of the model.
    pub revision: String,
}

impl From<&Model> for ModelUsed {
    fn from(model: &Model) -> Self {
        Self {
            name: model.name.clone(),
            revision: model.revision.clone(),
        }
    }
}

/// One person.
#[derive(Debug, Clone)]
pub struct Person {
    /// Axis-parallel box, corner-origin frame pixels.
    pub bbox: BBox<FramePixels>,
    /// Confidence, 0 to 1.
    pub score: f64,
    /// The box turned so that its height axis is the projected vertical.
    pub upright_box: OrientedBox,
    /// The same, or the box along the body of a person who lies.
    pub oriented_box: OrientedBox,
    /// The place of the feet, or of the middle of a person who lies, corner-origin frame pixels.
    pub foot: Pixel,
    /// The direction of the box center; `None` when it lies outside the lens image.
    pub bearing: Option<Bearing>,
    /// The floor position of the person, when the height of the camera is known.
    pub floor: Option<FloorPosition>,
    /// The height of the person, where the boxes and the height of the camera give it.
    pub height: Option<PersonHeight>,
    /// The posture that the frame tells, and its probability.
    pub posture: (Posture, f64),
    /// Votes for a person on the floor; `None` if no network that tells postures looked.
    pub floor_votes: Option<FloorVotes>,
    /// The number of supporting views.
    pub views: usize,
    /// The names of the zones that the person's foot is in; `None` when the calibration has none.
    pub zones: Option<Vec<String>>,
}

impl Person {
    /// Returns true if the votes of a network tell that the person lies: a box alone is often
    /// wrong.
    pub fn lies(&self) -> bool {
        self.floor_votes.is_some() && self.posture.0 == Posture::Lying
    }

    /// Returns the names of the `zones` that contain the foot; `None` when there are no zones.
    pub(super) fn zones_of(&self, zones: &[Zone]) -> Option<Vec<String>> {
        let holding = zones
            .iter()
            .filter(|zone| zone.area.holds(self.foot, self.floor));
        let names = holding.map(|zone| zone.name.clone());
        (!zones.is_empty()).then(|| names.collect())
    }
}

/// Disjoint wall-clock spans of one frame. Their sum is `total` minus scheduling gaps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StageTimings {
    /// Decoding of the image.
    pub decode: Duration,
    /// Camera setup: calibration, lens circle, and remap tables when they are not cached.
    pub calibrate: Duration,
    /// Waiting for a worker and for the network.
    pub queue: Duration,
    /// Remapping of the frame to network inputs.
    pub remap: Duration,
    /// Inference.
    pub inference: Duration,
    /// Back-projection and merge.
    pub refine: Duration,
    /// From the arrival of the whole request to the report.
    pub total: Duration,
}

impl StageTimings {
    /// Returns the processing time: all stages except the queue.
    pub fn worked(&self) -> Duration {
        self.decode + self.calibrate + self.remap + self.inference + self.refine
    }
}
