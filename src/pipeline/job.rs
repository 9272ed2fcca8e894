//! Detection jobs and their results.

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

/// One frame to process.
#[derive(Debug, Clone)]
pub struct DetectJob {
    /// Identifies the request in logs and responses.
    pub request_id: String,
    /// The wall-clock time at which the request arrived.
    pub received_at: Timestamp,
    /// The time at which the whole request was in memory: the start of all stage timings.
    pub arrived: Instant,
    /// The encoded frame.
    pub image: Bytes,
    /// The priority of the job and its cancellation state.
    pub ticket: Ticket,
    /// The validated parameters.
    pub parameters: DetectParameters,
    /// A calibration that replaces the lookup of `parameters.calibration`.
    pub calibration: Option<Arc<Calibration>>,
}

impl DetectJob {
    /// Creates the job for a frame of a client.
    #[must_use]
    pub fn sent(
        image: Bytes,
        parameters: DetectParameters,
        ticket: Ticket,
        received_at: Timestamp,
        arrived: Instant,
    ) -> Self {
        Self {
            request_id: ticket.request_id.clone(),
            received_at,
            arrived,
            image,
            ticket,
            parameters,
            calibration: None,
        }
    }
}

/// Views rendered by a client, for inference without changes.
pub struct ViewsJob {
    /// The time at which the whole request was in memory.
    pub arrived: Instant,
    /// The priority of the job and its cancellation state.
    pub ticket: Ticket,
    /// The model that runs.
    pub model: Arc<Model>,
    /// `[views, 3, height, width]` at the size of the model's input: planes of red, green and blue,
    /// 0 to 255. The owner of the pixels, with any other resources, is dropped with the job.
    pub pixels: Box<dyn AsRef<[f32]> + Send>,
}

/// A report together with its frame.
#[derive(Debug, Clone)]
pub struct Detected {
    /// The persons with the settings and timings of their detection.
    pub report: DetectionReport,
    /// The decoded frame, EXIF orientation applied.
    pub frame: Arc<Frame>,
    /// The encoded frame; `None` if masks hide a part of it.
    pub encoded: Option<Bytes>,
    /// Cancelled when the client is gone. Drawing then stops.
    pub withdrawn: CancellationToken,
    pub(super) rigs: Vec<Arc<CameraRig>>,
}

impl Detected {
    /// Returns the outlines of the views in corner-origin frame pixels: the plan's views, then the
    /// views of the second pass. Empty if the detector processed the whole frame.
    #[must_use]
    pub fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        let rigs = self.rigs.iter();
        rigs.flat_map(|rig| rig.view_outlines()).collect()
    }

    /// Returns the outlines of the calibration's zones in the frame.
    #[must_use]
    pub fn zone_outlines(&self) -> Vec<ZoneOutline> {
        // All rigs belong to one camera.
        let camera = self.rigs.first().map(|rig| rig.geometry());
        let outlines = camera.into_iter().flat_map(|camera| {
            let outline = |zone| ZoneOutline::of(zone, &camera.lens, &camera.mount);
            camera.areas.zones.iter().map(outline)
        });
        outlines.collect()
    }
}
