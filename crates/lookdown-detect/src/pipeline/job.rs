//! Detection jobs and their results.

use std::{sync::Arc, time::Instant};

use bytes::Bytes;
use jiff::Timestamp;
use lookdown_calibration::{Calibration, CameraGeometry};
use lookdown_lens::geometry::Pixel;
use tokio_util::sync::CancellationToken;

use super::{DetectionReport, Person, Ticket, camera_rig::CameraRig};
use crate::parameters::DetectParameters;
use lookdown_imaging::{Frame, annotate::ZoneOutline, decode::declared_size};

/// The frame of a job.
#[derive(Debug, Clone)]
pub enum JobImage {
    /// A JPEG, PNG or WebP file.
    Encoded(Bytes),
    /// Pixels.
    Decoded(Arc<Frame>),
}

impl JobImage {
    /// Returns width and height in pixels, those of a file from its header. `None` without a
    /// readable header.
    pub(super) fn size(&self) -> Option<(u32, u32)> {
        match self {
            Self::Encoded(file) => declared_size(file),
            Self::Decoded(frame) => Some((frame.width(), frame.height())),
        }
    }
}

/// One frame to process.
#[derive(Debug, Clone)]
pub struct DetectJob {
    /// Identifies the request in logs and responses.
    pub request_id: String,
    /// The wall-clock time at which the request arrived.
    pub received_at: Timestamp,
    /// The time at which the whole request was in memory: the start of all stage timings.
    pub arrived: Instant,
    /// The frame.
    pub image: JobImage,
    /// The priority of the job and its cancellation state.
    pub ticket: Ticket,
    /// The validated parameters.
    pub parameters: DetectParameters,
    /// A calibration that replaces the lookup of `parameters.calibration`.
    pub calibration: Option<Arc<Calibration>>,
}

impl DetectJob {
    /// Creates the job for a frame of a client.
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
            image: JobImage::Encoded(image),
            ticket,
            parameters,
            calibration: None,
        }
    }

    /// Creates the job for a frame of this process, such as a file, named `name` in the report.
    /// `calibration` replaces the lookup of the parameter.
    pub fn local(
        name: String,
        image: JobImage,
        parameters: DetectParameters,
        calibration: Option<Arc<Calibration>>,
    ) -> Self {
        Self {
            request_id: name,
            received_at: Timestamp::now(),
            arrived: Instant::now(),
            image,
            ticket: Ticket::default(),
            parameters,
            calibration,
        }
    }
}

/// A report together with its frame.
#[derive(Debug, Clone)]
pub struct DetectedFrame {
    /// The persons with the settings and timings of their detection.
    pub report: DetectionReport,
    /// The decoded frame, EXIF orientation applied.
    pub frame: Arc<Frame>,
    /// The encoded frame; `None` if masks hide a part of it.
    pub encoded: Option<Bytes>,
    /// Cancelled when the client is gone. Drawing then stops.
    pub withdrawn: CancellationToken,
    /// Persons outside of all areas and their margins, or in an ignored place.
    pub(super) outside: Vec<Person>,
    pub(super) rigs: Vec<Arc<CameraRig>>,
}

impl DetectedFrame {
    /// Returns the outlines of the views in corner-origin frame pixels: the plan's views, then the
    /// views and crops of the later passes. Empty if the detector processed the whole frame.
    pub fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        let rigs = self.rigs.iter();
        rigs.flat_map(|rig| rig.view_outlines()).collect()
    }

    /// Returns the boxes (corner-origin frame pixels) that hide people who are in no result: those
    /// that were found, and all pixels in which none are looked for.
    pub fn boxes_of_others(&self) -> Vec<[f64; 4]> {
        let margin = self.report.margin.iter().flatten();
        let found = margin.chain(&self.outside);
        let found = found.map(|person| person.bbox.corners());
        // All rigs belong to one camera.
        let camera = self.rigs.first();
        let unsearched = camera.into_iter().flat_map(|rig| rig.unsearched());
        found.chain(unsearched).collect()
    }

    /// Returns the camera of the frame: its lens, mount and areas in pixels of the frame.
    pub fn camera(&self) -> Option<&CameraGeometry> {
        // All rigs belong to one camera.
        self.rigs.first().map(|rig| &rig.geometry)
    }

    /// Returns the outlines of the calibration's zones in the frame.
    pub fn zone_outlines(&self) -> Vec<ZoneOutline> {
        let outlines = self.camera().into_iter().flat_map(|camera| {
            let outline = |zone| ZoneOutline::new(zone, &camera.lens, &camera.mount);
            camera.areas.zones.iter().map(outline)
        });
        outlines.collect()
    }
}
