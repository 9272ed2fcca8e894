//! One frame to be looked at, and what came of it.

use std::{sync::Arc, time::Instant};

use bytes::Bytes;
use jiff::Timestamp;
use tokio_util::sync::CancellationToken;

use super::{DetectParameters, DetectionReport, Ticket, camera_rig::CameraRig};
use crate::{
    calibration::Calibration,
    geometry::Pixel,
    imaging::{Frame, annotate::ZoneOutline},
    inference::Model,
};

/// One frame to be looked at.
#[derive(Debug, Clone)]
pub struct DetectJob {
    /// Identifies the request in logs and answers.
    pub request_id: String,
    /// When the request arrived, by the calendar.
    pub received_at: Timestamp,
    /// When the whole request was in memory: stages are timed from here.
    pub arrived: Instant,
    /// The encoded frame.
    pub image: Bytes,
    /// Its turn, and whether anybody still waits for it.
    pub ticket: Ticket,
    /// The checked parameters.
    pub parameters: DetectParameters,
    /// A calibration at hand, used instead of looking up `parameters.calibration`.
    pub calibration: Option<Arc<Calibration>>,
}

impl DetectJob {
    /// A frame that a client has sent, in the turn that its parameters say.
    #[must_use]
    pub fn sent(
        image: Bytes,
        parameters: DetectParameters,
        request_id: &str,
        received_at: Timestamp,
        arrived: Instant,
    ) -> Self {
        Self {
            request_id: request_id.to_owned(),
            received_at,
            arrived,
            image,
            ticket: Ticket::of(parameters.priority),
            parameters,
            calibration: None,
        }
    }
}

/// Views that somebody else has made, to be looked at as they are.
pub struct ViewsJob {
    /// When the whole request was in memory.
    pub arrived: Instant,
    /// Its turn, and whether anybody still waits for it.
    pub ticket: Ticket,
    /// Who passes.
    pub model: Arc<Model>,
    /// `[views, 3, height, width]` at the size of the model's input: planes of red, green and blue,
    /// 0 to 255. What their owner holds besides goes with them, when the work on them has ended.
    pub pixels: Box<dyn AsRef<[f32]> + Send>,
}

/// A report together with the frame it is about.
#[derive(Debug, Clone)]
pub struct Detected {
    /// The persons and how they were found.
    pub report: DetectionReport,
    /// The decoded frame, EXIF orientation applied.
    pub frame: Arc<Frame>,
    /// What it was decoded from; `None` where masks hide some of that.
    pub encoded: Option<Bytes>,
    /// Cancelled as soon as no client waits for the answer: drawing stops then.
    pub withdrawn: CancellationToken,
    pub(super) rigs: Vec<Arc<CameraRig>>,
}

impl Detected {
    /// Where the views looked that the frame was seen through: their borders, corner-origin frame
    /// pixels, closer passes after the plan's views; none when the detector saw the frame as it is.
    #[must_use]
    pub fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        let rigs = self.rigs.iter();
        rigs.flat_map(|rig| rig.view_outlines()).collect()
    }

    /// The zones of the frame's calibration, as the frame shows them.
    #[must_use]
    pub fn zone_outlines(&self) -> Vec<ZoneOutline> {
        // All rigs are of one camera.
        let camera = self.rigs.first().map(|rig| rig.geometry());
        let outlines = camera.into_iter().flat_map(|camera| {
            let outline = |zone| ZoneOutline::of(zone, &camera.lens, &camera.mount);
            camera.areas.zones.iter().map(outline)
        });
        outlines.collect()
    }
}
