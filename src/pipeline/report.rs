//! What came of a frame: the persons found and how they were found.

use std::time::Duration;

use jiff::Timestamp;

use super::Profile;
use crate::{
    detection::{BBox, FramePixels, RefinementParameters},
    geometry::{
        OrientedBox, Pixel, Zone,
        floor::{Bearing, FloorPosition},
    },
    imaging::lens_circle::LensCircle,
    inference::Model,
    warning::Warning,
};

/// The persons in one frame.
#[derive(Debug, Clone)]
pub struct DetectionReport {
    /// Identifies the request in logs and answers.
    pub request_id: String,
    /// Which camera the frame came from; the calibration's ID unless the request named one.
    pub camera: String,
    /// When the request arrived.
    pub received_at: Timestamp,
    /// When the frame was taken, when the request said so.
    pub captured_at: Option<Timestamp>,
    /// The calibration used.
    pub calibration: CalibrationUsed,
    /// Frame width after EXIF orientation, pixels.
    pub image_width: u32,
    /// Frame height after EXIF orientation, pixels.
    pub image_height: u32,
    /// The detector used.
    pub model: ModelUsed,
    /// The detector that took some of the closer passes, where the profile asks a second one.
    pub second_model: Option<ModelUsed>,
    /// The profile used.
    pub profile: Profile,
    /// The refinement used, with all its parameters.
    pub refinement: RefinementParameters,
    /// Persons, highest score first.
    pub persons: Vec<Person>,
    /// How many of them are in each zone of the calibration, in its order.
    pub zones: Vec<ZoneCount>,
    /// What became of the views.
    pub views: ViewCounts,
    /// In how many batches it saw them.
    pub batch_count: usize,
    /// Candidates of the network dropped because a number of theirs was not finite.
    pub non_finite: usize,
    /// Where the time went.
    pub timings: StageTimings,
    /// Circumstances that the caller should consider.
    pub warnings: Vec<Warning>,
}

/// What became of the views of one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ViewCounts {
    /// The network saw these.
    pub inferred: usize,
    /// Nothing had moved in these: what was found in them before stands.
    pub unchanged: usize,
    /// These lie outside the lens image, where nothing can be seen.
    pub outside: usize,
    /// These see nothing but what the camera's masks hide.
    pub masked: usize,
}

/// Which calibration a report is based on.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationUsed {
    /// The calibration's ID; `assumed` when none was named.
    pub id: String,
    /// Changes whenever the calibration's content does.
    pub revision: String,
    /// The lens circle from which the lens was assumed; `None` with a calibration.
    pub assumed_circle: Option<LensCircle>,
}

/// How many persons are in a zone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneCount {
    /// The zone's name.
    pub name: String,
    /// Who is in it; one person may be in several.
    pub persons: usize,
}

impl ZoneCount {
    /// Counts who is in each zone.
    pub(super) fn of(zones: &[Zone], persons: &[Person]) -> Vec<Self> {
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

/// Which detector a report is based on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelUsed {
    /// The model's name.
    pub name: String,
    /// Changes whenever the model's weights do.
    pub revision: String,
}

impl From<&Model> for ModelUsed {
    fn from(model: &Model) -> Self {
        Self {
            name: model.name().to_owned(),
            revision: model.revision().to_owned(),
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
    pub oriented_box: OrientedBox,
    /// The direction of the box centre; `None` when it lies outside the lens image.
    pub bearing: Option<Bearing>,
    /// Where the person stands, when the camera's height is known.
    pub floor: Option<FloorPosition>,
    /// How many views agreed.
    pub views: usize,
    /// The names of the zones that the person's foot is in; `None` when the calibration has none.
    pub zones: Option<Vec<String>>,
}

impl Person {
    /// The names of those `zones` that hold a foot seen at `foot`, which is `floor`; `None` when
    /// there are no zones.
    pub(super) fn zones_of(
        zones: &[Zone],
        foot: Pixel,
        floor: Option<FloorPosition>,
    ) -> Option<Vec<String>> {
        let holding = zones.iter().filter(|zone| zone.holds(foot, floor));
        let names = holding.map(|zone| zone.name.clone());
        (!zones.is_empty()).then(|| names.collect())
    }
}

/// Disjoint wall-clock spans of one frame; together they make `total` but for scheduling gaps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StageTimings {
    /// Bytes to pixels.
    pub decode: Duration,
    /// Finding the camera: calibration, lens circle, tables when they are new.
    pub calibrate: Duration,
    /// Waiting for a worker and for the network.
    pub queue: Duration,
    /// Frame to network input.
    pub remap: Duration,
    /// The network.
    pub inference: Duration,
    /// Back-projection and merge.
    pub refine: Duration,
    /// From the arrival of the whole request to the report.
    pub total: Duration,
}

impl StageTimings {
    /// The time in which the frame was worked on: all stages but the queue.
    #[must_use]
    pub fn worked(&self) -> Duration {
        self.decode + self.calibrate + self.remap + self.inference + self.refine
    }
}
