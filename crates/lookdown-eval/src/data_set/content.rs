//! The images of a data set and their annotations.

use std::{fmt, path::PathBuf, sync::Arc};

use lookdown_calibration::Calibration;
use lookdown_detect::detection::{BBox, FramePixels};
use lookdown_lens::geometry::{Lens, OrientedBox, Pixel, pixels::to_pixel_center};
use serde::{Deserialize, Serialize};

use crate::{AnnotatedPerson, GroundTruth, Outline, Scoring};

/// Images with annotated persons.
#[derive(Debug)]
pub struct DataSet {
    /// The images, in the order of the annotation files.
    pub images: Vec<DataSetImage>,
    /// The shape of the ground truth.
    pub scoring: Scoring,
}

/// One image of a data set.
#[derive(Debug)]
pub struct DataSetImage {
    /// The ID in the annotations.
    pub id: ImageId,
    /// The image's file.
    pub path: PathBuf,
    /// The camera's calibration. Without one a lens is assumed.
    pub calibration: Option<Arc<Calibration>>,
    /// `[width, height]` as annotated, pixels.
    pub size: Option<[u32; 2]>,
    /// The persons in it.
    pub truth: GroundTruth<Outline>,
}

impl DataSet {
    /// Returns the outline that is compared with the ground truth of `image` for a person detected
    /// with this box and this oriented box. A data set of rotated boxes has the size of every
    /// frame.
    pub fn outline(
        &self,
        image: &DataSetImage,
        bbox: BBox<FramePixels>,
        oriented_box: Option<&OrientedBox>,
    ) -> Outline {
        let frame = image.size.unwrap_or_default();
        self.scoring.outline(bbox, oriented_box, frame)
    }

    /// Returns the same data set with `calibration` for every image.
    pub fn with_calibration(mut self, calibration: &Arc<Calibration>) -> Self {
        for image in &mut self.images {
            image.calibration = Some(Arc::clone(calibration));
        }
        self
    }

    /// Returns the same data set with ground truth to be scored as `scoring`. Rotated boxes can be
    /// converted to axis-parallel ones: the bounds of the ellipse inscribed in each.
    ///
    /// # Errors
    /// [`ScoringMismatch`] if the ground truth cannot be converted to that shape.
    pub fn scored_as(mut self, scoring: Scoring) -> Result<Self, ScoringMismatch> {
        if scoring == self.scoring {
            return Ok(self);
        }
        if (self.scoring, scoring) != (Scoring::Rotated, Scoring::AxisParallel) {
            return Err(ScoringMismatch {
                truth: self.scoring,
                wanted: scoring,
            });
        }
        for image in &mut self.images {
            let persons = image.truth.persons.iter_mut();
            let persons = persons.map(|person| &mut person.outline);
            for outline in persons.chain(&mut image.truth.ignore_regions) {
                *outline = made_axis_parallel(outline);
            }
        }
        self.scoring = Scoring::AxisParallel;
        Ok(self)
    }
}

fn made_axis_parallel(outline: &Outline) -> Outline {
    match outline {
        Outline::Rotated(rotated) => rotated
            .inscribed_ellipse_bounds()
            .map_or(*outline, Outline::AxisParallel),
        other => *other,
    }
}

impl DataSetImage {
    /// Creates an image without annotations.
    pub(super) fn empty(id: ImageId, path: PathBuf) -> Self {
        Self {
            id,
            path,
            calibration: None,
            size: None,
            truth: GroundTruth::default(),
        }
    }

    pub(super) fn add(&mut self, person: AnnotatedPerson<Outline>) {
        self.truth.persons.push(person);
    }

    /// `[width, height]` in pixels as annotated, or else as calibrated. `None` if neither is known.
    pub fn frame_size(&self) -> Option<[u32; 2]> {
        let calibrated = || {
            let (width, height) = self.calibration.as_ref()?.image_size();
            Some([width, height])
        };
        self.size.or_else(calibrated)
    }

    /// The angle in degrees between the optical axis and the ray to a point (corner-origin pixels).
    /// It uses the calibrated lens, or else the equidistant lens of 180° with the largest circle in
    /// the frame. Beyond the lens image it is the angle of the rim. `None` if the frame's size is
    /// unknown.
    pub fn off_axis_deg(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let [width, height] = self.frame_size()?;
        let Some(calibration) = &self.calibration else {
            let (width, height) = (f64::from(width), f64::from(height));
            let from_center = (x - width / 2.0).hypot(y - height / 2.0);
            return Some((from_center / (width.min(height) / 2.0)).min(1.0) * 90.0);
        };
        let camera = calibration.for_frame(width, height).ok()?;
        let pixel = to_pixel_center([x, y].into());
        Some(off_axis(&camera.lens, &pixel).to_degrees())
    }
}

fn off_axis(lens: &Lens, pixel: &Pixel) -> f64 {
    lens.unproject(pixel)
        .map_or(lens.max_theta(), |ray| ray.x.hypot(ray.y).atan2(ray.z))
}

/// Ground truth of one shape cannot be scored as another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "this data set has {truth} and cannot be scored by {wanted}; only rotated boxes can be made \
     axis-parallel"
)]
pub struct ScoringMismatch {
    /// The shape of the ground truth.
    pub truth: Scoring,
    /// The requested shape.
    pub wanted: Scoring,
}

/// The ID of an image in its data set. In JSON it is a number or a string, as in the annotations.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ImageId {
    /// A number, as in COCO.
    Number(u64),
    /// A string, as in CEPDOF. Images without an ID have their path in the data set.
    Text(String),
}

impl fmt::Display for ImageId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(formatter),
            Self::Text(text) => text.fmt(formatter),
        }
    }
}
