//! The observed cameras and the findings about them.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_calibration::{Calibration, CalibrationId, native::NativeCalibration};
use lookdown_imaging::decode::DecodeLimits;
use lookdown_lens::self_calibration::{
    CameraHeight, FitRefusal, HeightRefusal, KnownCamera, RoomFit,
};
use parking_lot::Mutex;

use super::observed::{Observed, Subject};
use crate::{
    calibration_store::Calibrations,
    room_calibration::{checked, may_set_height, room_calibration, set_height},
};

/// The parts that the thread uses, too.
pub(super) struct Shared {
    pub cameras: Mutex<BTreeMap<CalibrationId, Observed>>,
    pub calibrations: Arc<Calibrations>,
    pub limits: DecodeLimits,
    /// The known values of all cameras without a calibration.
    pub known: KnownCamera,
    /// True if a calibration from all frames is stored without a request.
    pub applies: bool,
}

/// The findings about a camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suggestion {
    /// The number of frames of the lens.
    pub frames: usize,
    /// The lens, or the reason why the frames do not determine it. `None` before the first frame,
    /// and for a camera with a calibration, which lacks the height only.
    pub fit: Option<Result<RoomFit, FitRefusal>>,
    /// The height, or the reason why the people do not determine it.
    pub height: Option<Result<CameraHeight, HeightRefusal>>,
    /// The calibration, if there is one to store.
    pub calibration: Option<NativeCalibration>,
    /// The revision of the calibration that it replaces.
    pub replaces: Option<String>,
}

impl Shared {
    /// The findings about a camera, if it is observed.
    pub(super) fn suggestion(&self, camera: &CalibrationId) -> Option<Suggestion> {
        let cameras = self.cameras.lock();
        let observed = cameras.get(camera)?;
        let (size, subject) = (observed.size(), observed.subject().clone());
        let (fit, height) = (observed.fit.clone(), observed.height);
        let frames = observed.frame_count();
        drop(cameras);
        let (base, replaces) = match &subject {
            Subject::Lens => {
                let found = fit.as_ref().and_then(|fit| fit.as_ref().ok());
                let native = found.map(|fit| room_calibration(camera, size, fit, self.known));
                (native, None)
            }
            Subject::Height(id) => {
                let entry = self.calibrations.entry(id)?;
                let revision = entry.calibration.revision().to_owned();
                // A height may have been given since the last frame.
                let is_found = matches!(height, Some(Ok(_))) && may_set_height(&entry.native);
                let native = is_found.then(|| entry.native.clone());
                (native, Some(revision))
            }
        };
        let calibration = base.map(|mut native: NativeCalibration| {
            if let Some(Ok(height)) = &height {
                set_height(&mut native, height);
            }
            native
        });
        let replaces = replaces.filter(|_| calibration.is_some());
        Some(Suggestion {
            frames,
            fit,
            height,
            calibration,
            replaces,
        })
    }

    /// The camera of the calibration in use, or that of the lens that was found.
    pub(super) fn known_camera(&self, camera: &CalibrationId) -> Option<Arc<Calibration>> {
        let cameras = self.cameras.lock();
        let observed = cameras.get(camera)?;
        match observed.subject() {
            Subject::Height(id) => {
                let entry = self.calibrations.entry(id)?;
                Some(Arc::clone(&entry.calibration))
            }
            Subject::Lens => {
                let fit = observed.fit.as_ref()?.as_ref().ok()?;
                let native = room_calibration(camera, observed.size(), fit, self.known);
                checked(&native).ok().map(Arc::new)
            }
        }
    }
}
